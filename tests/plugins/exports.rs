//! A plugin of the workspace is built as a shared library with the symbol that is looked for. A test of the plugin's own package
//! makes `cargo test --workspace` build it among all else: the whole-program tests then need not build it, with other features
//! of its dependencies, a second time.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};

#[test]
fn the_library_exports_its_entry() {
    let format = env!("CARGO_PKG_NAME").strip_prefix("vice-plugin-").unwrap();
    let program = std::env::current_exe().unwrap();
    let library = program.with_file_name(format!("{DLL_PREFIX}vice_adapter_{format}{DLL_SUFFIX}"));
    let bytes = std::fs::read(&library).unwrap_or_else(|e| panic!("{}: {e}", library.display()));
    let entry = b"vice_plugin";
    assert!(bytes.windows(entry.len()).any(|w| w == entry), "{}", library.display());
}
