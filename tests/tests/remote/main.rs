//! Data elsewhere, from servers on this machine: what is fetched of it, and what goes wrong on the way.
//!
//! Built with `--features remote` only; `.ci/remote` runs it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)] // A test.

mod bucket;
mod faults;
mod files;
mod recordings;
mod server;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;
use vice_tests::Run;

/// The program with clients for data elsewhere, apart from the one without.
fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let built = vice_tests::build_with("vice-cli", "remote");
        let ending = std::env::consts::EXE_SUFFIX;
        let own = built.join(format!("vice-remote-test{ending}"));
        std::fs::copy(built.join(format!("vice{ending}")), &own).unwrap();
        own
    })
}

/// A folder to run in, with a cache of its own.
struct Desk {
    folder: tempfile::TempDir,
    variables: Vec<(&'static str, String)>,
}

impl Desk {
    fn new() -> Self {
        let variables =
            vec![("VICE_REMOTE_TIMEOUT", "5".to_string()), ("VICE_REMOTE_RETRIES", "3".to_string())];
        Self { folder: tempfile::tempdir().unwrap(), variables }
    }

    fn with(mut self, name: &'static str, value: &str) -> Self {
        self.variables.retain(|v| v.0 != name);
        self.variables.push((name, value.to_string()));
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn vice(&self, args: &[&str]) -> Run {
        Command::new(program())
            .current_dir(self.folder.path())
            .env("VICE_CACHE", self.path("cache"))
            .env_remove("HTTP_PROXY")
            .env_remove("http_proxy")
            .envs(self.variables.iter().map(|(name, value)| (name, value)))
            .args(args)
            .output()
            .unwrap()
            .into()
    }

    /// The result document of an evaluation, without what was asked: that names another place.
    fn evaluated(&self, dataset: &str, labels: &str, more: &[&str]) -> Value {
        let fixed = ["evaluate", dataset, "--labels", labels, "--json", "out.json", "--quiet"];
        let run = self.vice(&[&fixed[..], more].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        let mut document: Value =
            serde_json::from_slice(&std::fs::read(self.path("out.json")).unwrap()).unwrap();
        assert!(document.as_object_mut().unwrap().remove("request").is_some());
        document
    }
}
