//! The annotator among other users and programs of one machine: who learns its address, and who can stop it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::json;
use vice_tests::{skipped, vice_program};

use crate::annotate::Run;

#[test]
fn connections_that_ask_nothing_keep_nobody_out() {
    let run = Run::new();
    let mut annotator = run.open();
    // More than a process may have files open by default, each with half a head.
    let mut half_open: Vec<TcpStream> = Vec::new();
    for _ in 0..1100 {
        let Ok(mut stream) = TcpStream::connect(annotator.host()) else { break };
        let _ = stream.write_all(b"GET / HTTP/1.1\r\nHost: x");
        half_open.push(stream);
    }
    let begun = Instant::now();
    let edit = json!({ "op": "place", "point": "1", "frame": 0, "u": 9.0, "v": 9.0 });
    assert_eq!(annotator.edit(0, &[edit]).status, 200);
    assert_eq!(annotator.get("/api/frames/1").status, 200);
    assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
    // The labels file is written meanwhile.
    let until = Instant::now() + Duration::from_secs(20);
    while !run.path("my.json").exists() {
        assert!(Instant::now() < until, "the labels file is not written");
        std::thread::sleep(Duration::from_millis(50));
    }
    // Most of them were sent away again.
    let gone = half_open.iter_mut().map(is_closed).filter(|closed| *closed).count();
    assert!(gone + 128 >= half_open.len(), "{gone} of {}", half_open.len());
    annotator.interrupt();
}

fn is_closed(stream: &mut TcpStream) -> bool {
    stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
    match stream.read(&mut [0; 16]) {
        Ok(0) => true,
        Ok(_) => false,
        Err(e) => !matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut),
    }
}

/// The program with a browser that only notes what it is asked to open.
#[cfg(target_os = "linux")]
struct WithBrowser {
    child: Child,
    noted: PathBuf,
}

#[cfg(target_os = "linux")]
impl WithBrowser {
    fn start(run: &Run) -> Self {
        use std::os::unix::fs::PermissionsExt;
        let bin = run.path("bin");
        std::fs::create_dir(&bin).unwrap();
        let noted = run.path("noted");
        let script =
            format!("#!/bin/sh\nprintf '%s\\n' \"$@\" > '{0}.part'\nmv '{0}.part' '{0}'\n", noted.display());
        let browser = bin.join("xdg-open");
        std::fs::write(&browser, script).unwrap();
        std::fs::set_permissions(&browser, std::fs::Permissions::from_mode(0o755)).unwrap();
        let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap());
        let args = run.args(&[]).into_iter().filter(|a| a != "--no-open");
        let child = Command::new(vice_program())
            .args(args)
            .env("PATH", path)
            .env_remove("BROWSER")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        Self { child, noted }
    }

    fn opened(&self) -> String {
        let until = Instant::now() + Duration::from_secs(30);
        loop {
            match std::fs::read_to_string(&self.noted) {
                Ok(text) => return text.trim().to_string(),
                Err(_) => assert!(Instant::now() < until, "no browser was started"),
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

#[cfg(target_os = "linux")]
impl Drop for WithBrowser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn the_annotators_token_stands_in_no_command_line_and_is_used_once() {
    let run = Run::new();
    let vice = WithBrowser::start(&run);
    let asked = vice.opened();
    assert!(!asked.contains("token") && !asked.contains("127.0.0.1"), "{asked}");
    let page = asked.strip_prefix("file://").unwrap_or(&asked).to_string();
    let text = std::fs::read_to_string(&page).unwrap();
    let url = text.split('"').find_map(|part| part.strip_prefix("0;url=http://")).unwrap();
    let (host, path) = url.split_once('/').unwrap();
    another_user_sees_nothing(Path::new(&page), host);
    // Used, it goes away.
    let answer = ask(host, &format!("/{path}"));
    assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("HttpOnly; SameSite=Strict"), "{answer}");
    assert!(ask(host, &format!("/{path}")).starts_with("HTTP/1.1 401"));
    assert!(!Path::new(&page).exists());
}

/// As `nobody`, where the test may become somebody else: the page cannot be read, and asking the server gives nothing.
#[cfg(target_os = "linux")]
fn another_user_sees_nothing(page: &Path, host: &str) {
    use std::os::unix::fs::PermissionsExt;
    assert_eq!(page.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    let nobody = |script: &str| {
        Command::new("setpriv")
            .args(["--reuid", "65534", "--clear-groups", "bash", "-c", script])
            .stderr(Stdio::null())
            .output()
            .ok()
    };
    if nobody("true").is_none_or(|o| !o.status.success()) {
        skipped("this user cannot act as another one");
        return;
    }
    assert!(!nobody(&format!("cat '{}'", page.display())).unwrap().status.success());
    let (ip, port) = host.split_once(':').unwrap();
    let script = format!(
        "exec 3<>/dev/tcp/{ip}/{port}; printf 'GET /api/state HTTP/1.1\\r\\nHost: {host}\\r\\nConnection: close\\r\\n\\r\\n' >&3; head -1 <&3"
    );
    let answer = nobody(&script).unwrap();
    assert!(String::from_utf8_lossy(&answer.stdout).contains("401"), "{answer:?}");
}

#[cfg(target_os = "linux")]
fn ask(host: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}
