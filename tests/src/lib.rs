//! Helpers of the whole-program tests: where the shared data is, and the `vice` program itself.
//!
//! Cargo does not build another package's program for a test, but for its own tests: `cargo test --workspace` builds program and
//! plugins before it runs anything. Where they are older than the sources they are built here, in the profile and target folder
//! that the test itself was built in.
#![allow(clippy::expect_used, clippy::panic, clippy::print_stderr)] // A test helper fails its test.

pub mod flawed;
pub mod fuzzing;
pub mod layouts;
pub mod measured;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package lies in the workspace")
}

/// A file or folder of the shared data (`VICE_SHARED`, by default `../shared`).
///
/// Where it is missing this prints the reason and gives `None`, so that the test is skipped; with
/// `VICE_REQUIRE_DATA=1` it fails instead.
pub fn shared(relative: &str) -> Option<PathBuf> {
    let base = std::env::var_os("VICE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let path = root().join(base).join(relative);
    if path.exists() {
        return Some(path);
    }
    let reason =
        format!("skipped: {} is missing (set VICE_SHARED to the folder of shared data)", path.display());
    if std::env::var("VICE_REQUIRE_DATA").is_ok_and(|v| v == "1") {
        panic!("{reason}");
    }
    eprintln!("{reason}");
    None
}

/// Says why a part of a test is skipped.
pub fn skipped(reason: &str) {
    eprintln!("skipped: {reason}");
}

/// A JSON file of the shared data; see [`shared`].
pub fn shared_json(relative: &str) -> Option<serde_json::Value> {
    let path = shared(relative)?;
    let text = std::fs::read_to_string(&path).expect("the oracle can be read");
    Some(serde_json::from_str(&text).expect("the oracle is JSON"))
}

/// Builds a package of the workspace once more, in this test's own profile, and gives the folder its artefacts are in.
pub fn build(package: &str) -> PathBuf {
    build_with(package, "")
}

/// As [`build`], with features of the package.
pub fn build_with(package: &str, features: &str) -> PathBuf {
    let folder = folder();
    let profile = match folder.file_name().and_then(|n| n.to_str()).expect("a profile has a name") {
        "debug" => "dev",
        name => name,
    };
    let target = folder.parent().expect("a profile lies in the target folder");
    let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(root())
        .args(["build", "--quiet", "--locked", "--package", package, "--profile", profile, "--target-dir"])
        .arg(target)
        .args(["--features", features])
        .status()
        .expect("cargo can be run");
    assert!(status.success(), "building {package} failed");
    folder
}

/// The folder that this test was built in, with the profile's name.
fn folder() -> PathBuf {
    let test_program = std::env::current_exe().expect("a test knows where it is");
    // target/<profile>/deps/<test>
    test_program.ancestors().nth(2).expect("the test lies in target/<profile>/deps").to_path_buf()
}

/// A plugin of the workspace as a library, built in this test's own profile.
pub fn plugin(format: &str) -> PathBuf {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    let name = format!("{DLL_PREFIX}vice_adapter_{format}{DLL_SUFFIX}");
    // As of the program: `cargo test --workspace` has built it already.
    up_to_date(folder().join("deps").join(&name), &format!("vice-plugin-{format}"), &name)
}

/// Compiles a source of `tests/plugins` into a shared library `name` of a folder, with the system's C or C++ compiler. A source
/// in a folder of its own brings the header along, as of the version that it was written for.
pub fn compile_plugin(source: &str, defines: &[&str], folder: &Path, name: &str) -> PathBuf {
    let library = folder.join(format!("lib{name}{}", std::env::consts::DLL_SUFFIX));
    let (variable, usual, standard) = match source.ends_with(".cpp") {
        true => ("CXX", "c++", "-std=c++17"),
        false => ("CC", "cc", "-std=gnu11"),
    };
    let compiler = std::env::var(variable).unwrap_or_else(|_| usual.to_string());
    let output = Command::new(compiler)
        .args([standard, "-O1", "-g", "-fPIC", "-shared", "-fvisibility=hidden"])
        .args(defines.iter().map(|d| format!("-D{d}")))
        .arg("-I")
        .arg(root().join("adapters/plugin/abi/include"))
        .arg("-o")
        .arg(&library)
        .arg(root().join("tests/plugins").join(source))
        .arg("-lm")
        .output()
        .expect("the system has a C and a C++ compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    library
}

/// The `vice` program, built once.
pub fn vice_program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let name = format!("vice{}", std::env::consts::EXE_SUFFIX);
        // `cargo test --workspace` has built it already; a test of this package alone has not.
        up_to_date(folder().join(&name), "vice-cli", &name)
    })
}

/// What is there, where it is newer than the sources; else what a build of the package gives under a name.
fn up_to_date(there: PathBuf, package: &str, name: &str) -> PathBuf {
    if is_newer_than_sources(&there) { there } else { build(package).join(name) }
}

/// Whether a program is newer than all that it may be built from.
fn is_newer_than_sources(program: &Path) -> bool {
    let changed = |path: &Path| path.metadata().and_then(|m| m.modified()).ok();
    let Some(built) = changed(program) else { return false };
    let mut folders = vec![root().to_path_buf()];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for entry in entries.flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            if path.is_dir() {
                // What no program is built from.
                let skipped =
                    ["target", "tests", "benches", "docs", "examples", "fuzz", "vice-py", "node_modules"];
                let hidden = name.to_string_lossy().starts_with('.');
                if !(hidden || skipped.iter().any(|s| name == *s)) {
                    folders.push(path);
                } else if name == "tests" && folder == root() {
                    folders.push(path.join("plugins/panicking"));
                }
            } else if changed(&path).is_none_or(|at| at > built) {
                let unused = path.extension().is_some_and(|e| e == "md")
                    || folder == root() && name != "Cargo.lock" && name != "Cargo.toml";
                if !unused {
                    return false;
                }
            }
        }
    }
    true
}

/// What a run of `vice` gave.
#[derive(Debug)]
pub struct Run {
    /// Exit code; -1 where a signal ended it.
    pub code: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// Runs `vice` in a folder.
pub fn vice_in<I: AsRef<std::ffi::OsStr>>(folder: &Path, args: &[I]) -> Run {
    Command::new(vice_program()).current_dir(folder).args(args).output().expect("vice can be run").into()
}

/// Runs `vice` in the workspace's root.
pub fn vice<I: AsRef<std::ffi::OsStr>>(args: &[I]) -> Run {
    vice_in(root(), args)
}
