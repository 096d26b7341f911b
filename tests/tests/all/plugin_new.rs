//! `vice plugin new`: the projects build, their own tests run the check, and the commands of docs/plugins.md do what it says.

use std::path::Path;
use std::process::Command;

use vice_tests::{Run, root, shared, vice, vice_program};

use crate::plugin_hostile::{one_error, text};

fn good(command: &mut Command) -> Run {
    let run: Run = command.output().unwrap().into();
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    run
}

#[test]
fn a_project_in_cpp_builds_and_passes() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("my_robot");
    let run = vice(&["plugin", "new", "my_robot", "--language", "cpp", "--out", text(&project)]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let vice = format!("VICE={}", vice_program().display());
    let check = good(Command::new("make").current_dir(&project).args([
        "check",
        &vice,
        "CXXFLAGS=-O0 -Wall -Wextra -Werror",
    ]));
    assert!(check.stdout.contains("opened and closed 1000 times"), "{}", check.stdout);
    assert!(check.stdout.contains("0 suspicious, 0 faults"), "{}", check.stdout);
    assert!(project.join("README.md").is_file());
}

#[test]
fn a_project_in_rust_builds_and_passes() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("my_robot");
    let checkout = text(root());
    let run = vice(&[
        "plugin",
        "new",
        "my_robot",
        "--language",
        "rust",
        "--vice-path",
        checkout,
        "--out",
        text(&project),
    ]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    // With the versions of this checkout, so that nothing is looked for elsewhere.
    std::fs::copy(root().join("Cargo.lock"), project.join("Cargo.lock")).unwrap();
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(&project).args(["test", "--quiet", "--", "--nocapture"]);
    // Kept between runs, since it builds the crates that the project depends on.
    cargo
        .env("VICE", vice_program())
        .env("CARGO_TARGET_DIR", concat!(env!("CARGO_TARGET_TMPDIR"), "/plugin_new"));
    let test = good(&mut cargo);
    assert!(test.stdout.contains("0 suspicious, 0 faults"), "{}{}", test.stdout, test.stderr);
}

/// The commands of docs/plugins.md, a block each.
fn documented() -> Vec<String> {
    let page = std::fs::read_to_string(root().join("docs/plugins.md")).unwrap();
    // The rest of the fence's line says why others do not run it.
    let after_fence = |b: &str| b.split_once('\n').unwrap().1.split("```").next().unwrap().to_string();
    page.split("```sh").skip(1).map(after_fence).collect()
}

/// Runs a block in a folder outside of the project, as somebody who follows the page does.
fn follow(block: &str, folder: &Path) -> Run {
    let programs = vice_program().parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let mut shell = Command::new("sh");
    shell.current_dir(folder).args(["-e", "-c", block]).env("PATH", path).env_remove("CARGO_TARGET_DIR");
    good(&mut shell)
}

#[test]
fn the_documented_way_to_a_plugin_in_cpp_works() {
    let folder = tempfile::tempdir().unwrap();
    let blocks = documented();
    let block = blocks.iter().find(|b| b.contains("--language cpp")).expect("the page has commands for C++");
    let check = follow(block, folder.path());
    as_it_should_be(&check);
}

#[test]
fn the_documented_way_to_a_plugin_in_rust_works() {
    let folder = tempfile::tempdir().unwrap();
    let blocks = documented();
    let block =
        blocks.iter().find(|b| b.contains("--language rust")).expect("the page has commands for Rust");
    assert!(block.contains("PATH/TO/VICE") && block.contains("cd myrobot\n"), "{block}");
    // With the versions of this checkout, and with what was built before.
    let lock = root().join("Cargo.lock");
    let kept = concat!(env!("CARGO_TARGET_TMPDIR"), "/plugin_new");
    let kept = format!("cd myrobot\ncp {} . && mkdir -p {kept} && ln -s {kept} target\n", lock.display());
    let block = block.replace("PATH/TO/VICE", text(root())).replace("cd myrobot\n", &kept);
    as_it_should_be(&follow(&block, folder.path()));
}

/// Relative streams and stored images came through.
fn as_it_should_be(check: &Run) {
    for words in [
        "pose stream odometry: 5 poses, one each 0.1 s, chained from relative motions",
        "5 of 5 images are given as they are stored, and show the same",
        "0 suspicious, 0 faults",
    ] {
        assert!(check.stdout.contains(words), "`{words}` is not in {}{}", check.stdout, check.stderr);
    }
}

#[test]
fn the_documented_way_to_the_whole_example_works() {
    if shared("data/tum_rgbd5").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let blocks = documented();
    let block =
        blocks.iter().find(|b| b.contains("tum_rgbd")).expect("the page has commands for the example");
    // A copy of what it needs, beside the data: nothing is built into the sources.
    let checkout = folder.path().join("vice");
    std::fs::create_dir_all(checkout.join("adapters/plugin/abi")).unwrap();
    for part in ["adapters/plugin/abi/include", "adapters/plugin/examples"] {
        let to = checkout.join(part);
        good(Command::new("cp").arg("-r").arg(root().join(part)).arg(to.parent().unwrap()));
    }
    let data = shared("data").unwrap().canonicalize().unwrap();
    std::fs::create_dir(folder.path().join("shared")).unwrap();
    std::os::unix::fs::symlink(data, folder.path().join("shared/data")).unwrap();
    let run = follow(block, &checkout);
    assert!(run.stdout.contains("RMSE_2D") || run.stdout.contains("RMSE"), "{}", run.stdout);
}

/// A project on a repository keeps to the commit that the program was built from, where that is known.
#[test]
fn a_project_on_a_repository_is_pinned() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("my_robot");
    let url = "https://example.org/vice";
    let args =
        ["plugin", "new", "my_robot", "--language", "rust", "--vice-git", url, "--out", text(&project)];
    let run = vice(&args);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let manifest = std::fs::read_to_string(project.join("Cargo.toml")).unwrap();
    let head = Command::new("git").current_dir(root()).args(["rev-parse", "HEAD"]).output();
    match head.ok().filter(|h| h.status.success()) {
        Some(head) => {
            let commit = String::from_utf8(head.stdout).unwrap().trim().to_string();
            let pinned = format!("{{ git = \"{url}\", rev = \"{commit}\" }}");
            assert_eq!(manifest.matches(&pinned).count(), 3, "{manifest}");
            assert!(run.stdout.contains(&format!("at {commit}, the commit")), "{}", run.stdout);
        }
        None => {
            assert_eq!(manifest.matches(&format!("{{ git = \"{url}\" }}")).count(), 3, "{manifest}");
            assert!(run.stdout.contains("does not know which commit"), "{}", run.stdout);
        }
    }
}

#[test]
fn what_cannot_be_a_project_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x");
    let new = |args: &[&str]| vice(&[&["plugin", "new"], args, &["--out", out.to_str().unwrap()]].concat());
    one_error(&new(&["My-Robot", "--language", "cpp"]), &["a name starts with a letter"]);
    one_error(&new(&["class", "--language", "cpp"]), &["a word of Rust or C++"]);
    one_error(&new(&["euroc", "--language", "cpp"]), &["is built in"]);
    one_error(&new(&["robot", "--language", "rust"]), &["--vice-path"]);
    one_error(&new(&["robot", "--language", "rust", "--vice-path", "/no/such"]), &["no checkout of VICE"]);
    one_error(&new(&["robot", "--language", "cpp", "--vice-path", "."]), &["for Rust"]);
    assert!(!out.exists());
    std::fs::create_dir(&out).unwrap();
    std::fs::write(Path::new(&out).join("mine.txt"), "mine").unwrap();
    one_error(&new(&["robot", "--language", "cpp"]), &["not empty"]);
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1);
}
