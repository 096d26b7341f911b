//! The program starts. A test of this package also makes `cargo test --workspace` build the program among all else: the
//! whole-program tests (`tests/`) then need not build it, with other features of its dependencies, a second time.

use std::process::Command;

#[test]
fn the_program_says_its_name_and_version() {
    let output = Command::new(env!("CARGO_BIN_EXE_vice")).arg("--version").output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.trim(), format!("vice {}", env!("CARGO_PKG_VERSION")));
}
