//! Servers that fail, lie or are slow.

use std::time::{Duration, Instant};

use crate::Desk;
use crate::files::{Shape, labels, recorded, reshaped};
use crate::server::Server;

/// A server with a recording and its labels, and the addresses of both.
fn served() -> Option<(Server, String, String)> {
    let server = Server::start();
    let recording = server.put("run.mcap", reshaped(&recorded()?, Shape::Mixed));
    let labels = server.put("labels.csv", labels()?);
    Some((server, recording, labels))
}

fn evaluate<'a>(recording: &'a str, labels: &'a str) -> Vec<&'a str> {
    vec!["evaluate", recording, "--labels", labels, "--estimate", "slam", "--depth-check", "off"]
}

/// One line of error, of this exit code.
fn error(desk: &Desk, args: &[&str]) -> String {
    let run = desk.vice(args);
    assert_eq!((run.code, run.stdout.as_str()), (1, ""), "{}", run.stderr);
    assert_eq!(run.stderr.trim_end().lines().count(), 1, "{}", run.stderr);
    run.stderr
}

#[test]
fn what_passes_is_tried_again_and_changes_nothing() {
    let Some((server, recording, labels)) = served() else { return };
    let more = ["--estimate", "slam", "--depth-check", "off"];
    let good = Desk::new().evaluated(&recording, &labels, &more);
    server.behave(|b| b.refuse = 3);
    assert_eq!(Desk::new().evaluated(&recording, &labels, &more), good, "503");
    // Several requests are on their way at a time, each of which may be cut.
    server.behave(|b| b.cut = 3);
    assert_eq!(Desk::new().evaluated(&recording, &labels, &more), good, "cut connections");
    server.behave(|b| b.tags = false);
    assert_eq!(Desk::new().evaluated(&recording, &labels, &more), good, "no ETag");
    server.behave(|b| b.ranges = false);
    assert_eq!(Desk::new().evaluated(&recording, &labels, &more), good, "no ranges");
}

#[test]
fn what_does_not_pass_is_one_line_in_bounded_time() {
    let Some((server, recording, labels)) = served() else { return };
    let desk = Desk::new().with("VICE_REMOTE_TIMEOUT", "1");
    let begun = Instant::now();
    server.behave(|b| b.refuse = 10_000);
    let line = error(&desk, &evaluate(&recording, &labels));
    assert!(line.contains("run.mcap: cannot be fetched, tried 4 times") && line.contains("503"), "{line}");
    server.behave(|b| (b.refuse, b.cut) = (0, 10_000));
    let line = error(&desk, &evaluate(&recording, &labels));
    assert!(line.contains("cannot be fetched, tried 4 times"), "{line}");
    server.behave(|b| (b.cut, b.delay) = (0, Duration::from_secs(3)));
    let line = error(&desk, &evaluate(&recording, &labels));
    assert!(line.contains("no answer within 1 s") || line.contains("timed out"), "{line}");
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
    // Nobody listens any more, and there is no such file.
    let line = error(&desk, &["info", "http://127.0.0.1:9/run.mcap"]);
    assert!(line.contains("http://127.0.0.1:9/run.mcap: cannot be fetched"), "{line}");
    server.behave(|b| b.delay = Duration::ZERO);
    let line = error(&desk, &["info", &server.url("no.mcap")]);
    assert!(line.contains("no.mcap: no such object"), "{line}");
    let line = error(&desk, &["info", &server.url("folder/")]);
    assert!(line.contains("folder/: a web server does not say what is in a folder"), "{line}");
}

#[test]
fn a_file_that_changes_while_it_is_read_is_refused() {
    let Some((server, recording, labels)) = served() else { return };
    for tags in [true, false] {
        server.behave(|b| (b.tags, b.change_after) = (tags, Some(12)));
        let run = Desk::new().vice(&evaluate(&recording, &labels));
        if tags {
            assert_eq!(run.code, 1, "{}", run.stdout);
            assert!(run.stderr.contains("run.mcap: has changed while it was read"), "{}", run.stderr);
        } else {
            // The server does not say, and the size is the same.
            assert_eq!(run.code, 0, "{}", run.stderr);
        }
    }
    // A shorter one is told by its size, too.
    server.behave(|b| (b.tags, b.change_after) = (false, None));
    let desk = Desk::new();
    let run = std::thread::scope(|scope| {
        server.behave(|b| b.delay = Duration::from_millis(60));
        let run = scope.spawn(|| desk.vice(&evaluate(&recording, &labels)));
        std::thread::sleep(Duration::from_millis(350));
        server.put("run.mcap", vec![7; 1 << 20]);
        run.join().unwrap()
    });
    assert_eq!(run.code, 1, "{}", run.stdout);
    assert!(run.stderr.contains("run.mcap: has changed while it was read: it had"), "{}", run.stderr);
}

#[test]
fn more_than_may_be_staged_is_refused_with_the_way_out() {
    let Some((server, recording, labels)) = served() else { return };
    server.behave(|b| b.ranges = false);
    let desk = Desk::new().with("VICE_STAGE_LIMIT", "0.01");
    let line = error(&desk, &evaluate(&recording, &labels));
    assert!(line.contains("run.mcap: 0.0") && line.contains("more than 0.01"), "{line}");
    assert!(line.contains("VICE_STAGE_LIMIT"), "{line}");
    let desk = Desk::new().with("VICE_STAGE_LIMIT", "much");
    assert!(error_of_usage(&desk, &evaluate(&recording, &labels)).contains("VICE_STAGE_LIMIT"));
}

fn error_of_usage(desk: &Desk, args: &[&str]) -> String {
    let run = desk.vice(args);
    assert_eq!(run.code, 2, "{}", run.stderr);
    run.stderr
}

#[test]
fn secrets_are_used_and_never_shown() {
    let Some((server, recording, labels)) = served() else { return };
    // me:hush
    server.behave(|b| b.authorization = Some("Basic bWU6aHVzaA==".to_string()));
    let secret = |url: &str| url.replace("http://", "http://me:hush@") + "?X-Amz-Signature=whisper";
    let desk = Desk::new();
    let args = evaluate(&recording, &labels);
    assert!(error(&desk, &args).contains("may not be read"));
    let (recording, labels) = (secret(&recording), secret(&labels));
    let mut args = evaluate(&recording, &labels);
    args.extend(["--json", "out.json", "--report", "out.html", "-vv"]);
    let run = desk.vice(&args);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let mut texts = vec![run.stdout, run.stderr];
    texts.extend(["out.json", "out.html"].map(|name| std::fs::read_to_string(desk.path(name)).unwrap()));
    server.behave(|b| b.refuse = 10_000);
    texts.push(error(&desk, &evaluate(&recording, &labels)));
    texts.push(desk.vice(&["info", &recording, "-vv"]).stderr);
    server.behave(|b| b.refuse = 0);
    let manifest = format!("dataset,labels,estimate,depth-check\n{recording},{labels},slam,off\n");
    std::fs::write(desk.path("m.csv"), manifest).unwrap();
    let run = desk.vice(&["batch", "m.csv", "--out", "out", "--progress", "json"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    texts.extend([run.stdout, run.stderr]);
    let collected = desk.vice(&["batch", "collect", "out"]);
    assert_eq!(collected.code, 0, "{}", collected.stderr);
    let mut folders = vec![desk.path("out"), desk.path("cache")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
            texts.push(entry.display().to_string());
            match entry.is_dir() {
                true => folders.push(entry),
                false => texts.push(String::from_utf8_lossy(&std::fs::read(&entry).unwrap()).into_owned()),
            }
        }
    }
    assert!(texts.len() > 10);
    for text in texts {
        for word in ["hush", "whisper", "bWU6aHVzaA"] {
            assert!(!text.contains(word), "{word} in {}", &text[..text.len().min(2000)]);
        }
    }
}

#[test]
fn a_run_of_a_batch_is_known_by_what_the_server_says() {
    let Some((server, recording, labels)) = served() else { return };
    let desk = Desk::new();
    let manifest = format!("run_id,dataset,labels,estimate,depth-check\na,{recording},{labels},slam,off\n");
    std::fs::write(desk.path("m.csv"), manifest).unwrap();
    let run = || {
        let run = desk.vice(&["batch", "m.csv", "--out", "out"]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        run.stderr
    };
    assert!(run().contains("1 of 1 runs evaluated"));
    server.forget();
    assert!(run().contains("1 were there"));
    assert!(server.fetched("run.mcap").1 < 100, "asked for, not read");
    // Another ETag is another content.
    server.behave(|b| b.change_after = Some(0));
    assert!(run().contains("1 of 1 runs evaluated"));
}
