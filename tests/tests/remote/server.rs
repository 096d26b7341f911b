//! A web server that counts, and misbehaves where it is told to.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// What the server does to those who ask.
#[derive(Clone, Debug)]
pub(crate) struct Behaviour {
    /// Gives parts of files.
    pub(crate) ranges: bool,
    /// Says ETags, and heeds `If-Match`.
    pub(crate) tags: bool,
    /// So many requests from now on are answered with 503.
    pub(crate) refuse: u32,
    /// So many answers from now on end in the middle.
    pub(crate) cut: u32,
    /// How long it thinks before each answer.
    pub(crate) delay: Duration,
    /// After so many more requests each file is another of the same size.
    pub(crate) change_after: Option<u32>,
    /// Only who says this may read.
    pub(crate) authorization: Option<String>,
}

impl Default for Behaviour {
    fn default() -> Self {
        Self {
            ranges: true,
            tags: true,
            refuse: 0,
            cut: 0,
            delay: Duration::ZERO,
            change_after: None,
            authorization: None,
        }
    }
}

#[derive(Default)]
struct State {
    files: BTreeMap<String, Arc<Vec<u8>>>,
    behaviour: Behaviour,
    version: u32,
    /// Name and bytes of what was asked for.
    answers: Vec<(String, u64)>,
}

/// A server on this machine, until the test ends.
pub(crate) struct Server {
    port: u16,
    state: Arc<Mutex<State>>,
}

impl Server {
    pub(crate) fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let state: Arc<Mutex<State>> = Arc::default();
        let served = Arc::clone(&state);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let state = Arc::clone(&served);
                std::thread::spawn(move || drop(serve(stream, &state)));
            }
        });
        Self { port, state }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    pub(crate) fn put(&self, name: &str, bytes: Vec<u8>) -> String {
        self.state().files.insert(name.to_string(), Arc::new(bytes));
        self.url(name)
    }

    pub(crate) fn url(&self, name: &str) -> String {
        format!("http://127.0.0.1:{}/{name}", self.port)
    }

    pub(crate) fn behave(&self, change: impl FnOnce(&mut Behaviour)) {
        change(&mut self.state().behaviour);
    }

    /// Forgets what was asked for so far.
    pub(crate) fn forget(&self) {
        self.state().answers.clear();
    }

    /// Requests for a file, and the bytes that went out for it.
    pub(crate) fn fetched(&self, name: &str) -> (usize, u64) {
        let state = self.state();
        let of = state.answers.iter().filter(|(n, _)| n == name);
        (of.clone().count(), of.map(|(_, bytes)| bytes).sum())
    }
}

fn serve(stream: TcpStream, state: &Mutex<State>) -> std::io::Result<()> {
    stream.set_read_timeout(Some(Duration::from_secs(60)))?;
    let mut reader = BufReader::new(stream.try_clone()?);
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line)? == 0 {
            return Ok(());
        }
        let words: Vec<String> = line.split_whitespace().map(str::to_string).collect();
        let mut headers = BTreeMap::new();
        loop {
            let mut header = String::new();
            reader.read_line(&mut header)?;
            match header.trim_end().split_once(": ") {
                Some((name, value)) => headers.insert(name.to_lowercase(), value.to_string()),
                None => break,
            };
        }
        let name = words.get(1).map_or("", |w| w.trim_start_matches('/'));
        let name = name.split('?').next().unwrap_or_default().to_string();
        if !answer(&stream, state, &words[0], &name, &headers)? {
            return Ok(());
        }
    }
}

/// Answers one request; false where the connection is not used again.
fn answer(
    mut stream: &TcpStream,
    state: &Mutex<State>,
    method: &str,
    name: &str,
    headers: &BTreeMap<String, String>,
) -> std::io::Result<bool> {
    let (file, version, behaviour, refused, cut) = {
        let mut state = state.lock().unwrap();
        if let Some(left) = &mut state.behaviour.change_after {
            match *left {
                0 => {
                    state.behaviour.change_after = None;
                    state.version += 1;
                }
                _ => *left -= 1,
            }
        }
        let refused = state.behaviour.refuse > 0;
        state.behaviour.refuse = state.behaviour.refuse.saturating_sub(1);
        let cut = !refused && state.behaviour.cut > 0;
        state.behaviour.cut = state.behaviour.cut.saturating_sub(u32::from(!refused));
        let behaviour = state.behaviour.clone();
        (state.files.get(name).cloned(), state.version, behaviour, refused, cut)
    };
    std::thread::sleep(behaviour.delay);
    let empty = |status: &str| format!("HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n");
    if refused {
        stream.write_all(empty("503 Service Unavailable").as_bytes())?;
        return Ok(true);
    }
    if behaviour.authorization.is_some() && headers.get("authorization") != behaviour.authorization.as_ref() {
        stream.write_all(empty("401 Unauthorized").as_bytes())?;
        return Ok(true);
    }
    let Some(file) = file else {
        stream.write_all(empty("404 Not Found").as_bytes())?;
        return Ok(true);
    };
    let tag = format!("\"{}-{version}\"", file.len());
    if behaviour.tags && headers.get("if-match").is_some_and(|m| *m != tag) {
        stream.write_all(empty("412 Precondition Failed").as_bytes())?;
        return Ok(true);
    }
    let range = headers.get("range").filter(|_| behaviour.ranges).and_then(|r| range(r, file.len()));
    if behaviour.ranges && headers.contains_key("range") && range.is_none() {
        stream.write_all(empty("416 Range Not Satisfiable").as_bytes())?;
        return Ok(true);
    }
    let body = range.clone().map_or(&file[..], |r| &file[r]);
    let mut head = match &range {
        Some(r) => format!(
            "HTTP/1.1 206 Partial Content\r\nContent-Range: bytes {}-{}/{}\r\n",
            r.start,
            r.end - 1,
            file.len()
        ),
        None => "HTTP/1.1 200 OK\r\n".to_string(),
    };
    if behaviour.tags {
        head.push_str(&format!("ETag: {tag}\r\n"));
    }
    head.push_str(&format!("Content-Length: {}\r\n\r\n", body.len()));
    stream.write_all(head.as_bytes())?;
    let body = match (method, cut) {
        ("HEAD", _) => &[],
        (_, true) => &body[..body.len() / 2],
        _ => body,
    };
    state.lock().unwrap().answers.push((name.to_string(), body.len() as u64));
    stream.write_all(body)?;
    if cut {
        stream.shutdown(std::net::Shutdown::Both)?;
    }
    Ok(!cut)
}

fn range(header: &str, len: usize) -> Option<std::ops::Range<usize>> {
    let (from, to) = header.strip_prefix("bytes=")?.split_once('-')?;
    let from: usize = from.parse().ok()?;
    let to = to.parse::<usize>().map_or(len, |to| (to + 1).min(len));
    (from < to).then_some(from..to)
}
