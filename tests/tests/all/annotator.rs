//! `vice annotate` as a running program, and a client that may send whatever it likes.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use vice_tests::vice_program;

/// An answer as it came.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {} {}", self.head, self.text()))
    }
}

/// The program, killed at the end of the test at the latest.
pub(crate) struct Annotator {
    child: Child,
    _stdout: BufReader<ChildStdout>,
    address: String,
    cookie: String,
}

impl Drop for Annotator {
    fn drop(&mut self) {
        self.kill();
    }
}

impl Annotator {
    pub(crate) fn start(args: &[String]) -> Self {
        Self::run(Command::new(vice_program()).args(args))
    }

    /// Under a shell's limits.
    pub(crate) fn start_limited(args: &[String], limits: &str) -> Self {
        let script = format!("{limits}; exec \"$0\" \"$@\"");
        Self::run(Command::new("sh").arg("-c").arg(script).arg(vice_program()).args(args))
    }

    fn run(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        stdout.read_line(&mut line).unwrap();
        let address = line.trim().to_string();
        assert!(address.starts_with("http://127.0.0.1:"), "no address: `{line}`");
        let mut started = Self { child, _stdout: stdout, address, cookie: String::new() };
        let entrance = started.address[started.address.rfind("/open").unwrap()..].to_string();
        let answer = started.raw(&format!("GET {entrance} HTTP/1.1\r\nHost: {}\r\n", started.host()), "");
        assert_eq!(answer.status, 200, "{}", answer.text());
        let cookie = answer.head.lines().find_map(|l| l.strip_prefix("set-cookie: ")).unwrap();
        started.cookie = cookie.split(';').next().unwrap().to_string();
        started
    }

    pub(crate) fn host(&self) -> String {
        self.address.trim_start_matches("http://").split('/').next().unwrap().to_string()
    }

    /// The address that was printed, from its path on; it is used up.
    pub(crate) fn entrance(&self) -> &str {
        &self.address[self.address.rfind("/open").unwrap()..]
    }

    /// Name and value.
    pub(crate) fn cookie(&self) -> &str {
        &self.cookie
    }

    /// Sends a head (without the blank line) and a body, and reads until the server closes.
    pub(crate) fn try_raw(&self, head: &str, body: &str) -> std::io::Result<Answer> {
        ask(&self.host(), head, body)
    }

    pub(crate) fn raw(&self, head: &str, body: &str) -> Answer {
        self.try_raw(head, body).unwrap()
    }

    fn head(&self, method: &str, path: &str) -> String {
        let (host, cookie) = (self.host(), &self.cookie);
        format!(
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nCookie: {cookie}\r\nOrigin: http://{host}\r\n\
             Content-Type: application/json\r\n"
        )
    }

    pub(crate) fn get(&self, path: &str) -> Answer {
        self.raw(&self.head("GET", path), "")
    }

    pub(crate) fn post(&self, path: &str, body: &str) -> Answer {
        self.raw(&self.head("POST", path), body)
    }

    pub(crate) fn delete(&self, path: &str) -> Answer {
        self.raw(&self.head("DELETE", path), "")
    }

    pub(crate) fn edit(&self, revision: u64, edits: &[Value]) -> Answer {
        self.post("/api/edits", &json!({ "revision": revision, "edits": edits }).to_string())
    }

    pub(crate) fn state(&self) -> Value {
        self.get("/api/state").json()
    }

    /// What is needed to write from another thread.
    pub(crate) fn writer(&self) -> impl Fn(&str, &str) -> std::io::Result<Answer> + Send + use<> {
        let (host, head) = (self.host(), self.head("POST", "PATH"));
        move |path, body| ask(&host, &head.replace("PATH", path), body)
    }

    pub(crate) fn wait_for_job(&self, id: &Value) -> Value {
        let until = Instant::now() + Duration::from_secs(60);
        while Instant::now() < until {
            let state = self.state();
            let job = state["jobs"].as_array().unwrap().iter().find(|j| j["id"] == *id).unwrap().clone();
            if job["state"] != "running" {
                return job;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("the job does not end");
    }

    /// Collects all events until the server ends.
    pub(crate) fn listen(&self) -> JoinHandle<String> {
        let mut stream = TcpStream::connect(self.host()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        stream.write_all(format!("{}\r\n", self.head("GET", "/api/events")).as_bytes()).unwrap();
        // The answer's head tells that the listening has begun.
        let mut first = [0; 16];
        stream.read_exact(&mut first).unwrap();
        std::thread::spawn(move || {
            let mut text = Vec::new();
            stream.read_to_end(&mut text).unwrap();
            String::from_utf8_lossy(&text).into_owned()
        })
    }

    /// Ctrl-C, then waits for the end.
    pub(crate) fn interrupt(&mut self) {
        let pid = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
        assert!(self.child.wait().unwrap().success());
    }

    /// Kill -9.
    pub(crate) fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn ask(host: &str, head: &str, body: &str) -> std::io::Result<Answer> {
    let mut stream = TcpStream::connect(host)?;
    stream.set_read_timeout(Some(Duration::from_secs(30)))?;
    let request = format!("{head}Content-Length: {}\r\nConnection: close\r\n\r\n{body}", body.len());
    // A server that refuses a body need not read all of it.
    let _ = stream.write_all(request.as_bytes());
    let mut answer = Vec::new();
    let read = stream.read_to_end(&mut answer);
    let Some(end) = answer.windows(4).position(|w| w == b"\r\n\r\n") else {
        read?;
        return Err(std::io::ErrorKind::UnexpectedEof.into());
    };
    let head = String::from_utf8_lossy(&answer[..end]).into_owned();
    let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap();
    let body = answer[end + 4..].to_vec();
    // A killed server may have sent the head of an answer only.
    let length =
        head.lines().find_map(|l| l.to_ascii_lowercase().strip_prefix("content-length: ")?.parse().ok());
    if length.is_some_and(|l: usize| l != body.len()) {
        return Err(std::io::ErrorKind::UnexpectedEof.into());
    }
    Ok(Answer { status, head, body })
}
