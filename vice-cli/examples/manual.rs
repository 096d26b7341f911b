//! Writes the manual pages and the completions of all shells, as an archive of a release holds them:
//! `cargo run -p vice-cli --example manual -- DIR`.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap_complete::Shell;

fn main() -> io::Result<()> {
    let folder: Option<OsString> = std::env::args_os().nth(1);
    let folder = folder
        .map(PathBuf::from)
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "name the folder to write to"))?;
    write(&folder)
}

/// `man1/vice.1`, `man1/vice-evaluate.1`, ... and a script for each shell.
fn write(folder: &Path) -> io::Result<()> {
    let (man, completions) = (folder.join("man1"), folder.join("completions"));
    fs::create_dir_all(&man)?;
    fs::create_dir_all(&completions)?;
    clap_mangen::generate_to(vice_cli::command_line(), &man)?;
    for shell in Shell::value_variants() {
        clap_complete::generate_to(*shell, &mut vice_cli::command_line(), "vice", &completions)?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // A test fails its test.
mod tests {
    use super::*;

    #[test]
    fn each_command_has_a_page_that_names_its_options() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path()).unwrap();
        let page = |name: &str| fs::read_to_string(folder.path().join("man1").join(name)).unwrap();
        for command in vice_cli::commands().iter().filter(|name| *name != "help") {
            assert!(page(&format!("vice-{command}.1")).contains(".SH NAME"), "{command}");
        }
        let evaluate = page("vice-evaluate.1").replace("\\-", "-");
        for option in ["--labels", "--no-diagnosis", "--stamp", "--request"] {
            assert!(evaluate.contains(option), "{option}");
        }
        assert!(page("vice-floor-fit.1").contains(".SH NAME"));
        let scripts = fs::read_dir(folder.path().join("completions")).unwrap().count();
        assert_eq!(scripts, Shell::value_variants().len());
    }
}
