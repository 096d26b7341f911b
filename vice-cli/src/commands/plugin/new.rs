//! `vice plugin new`: a project that builds, reads a small format, and has a test.

use std::path::PathBuf;

use vice_run::plugin as project;

use crate::terminal::{self, Outcome, usage};

/// Arguments of `vice plugin new`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  vice plugin new myrobot --language cpp\n  \
    vice plugin new myrobot --language rust --vice-path ../vice")]
pub(crate) struct Args {
    /// Name of the format, such as myrobot.
    #[arg(value_name = "NAME", value_parser = name)]
    name: String,
    /// Language to write it in.
    #[arg(long)]
    language: Language,
    /// Folder to write; new or empty [default: NAME].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Rust: a checkout of VICE that the project depends on.
    #[arg(long, value_name = "DIR", conflicts_with = "vice_git")]
    vice_path: Option<PathBuf>,
    /// Rust: in place of a checkout, the address of VICE's repository, at the commit that this program was built from.
    #[arg(long, value_name = "URL")]
    vice_git: Option<String>,
}

/// A language that a project can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Language {
    /// A crate that implements the traits of vice-core
    Rust,
    /// C++17, nothing but the header
    Cpp,
}

/// Words of Rust and C++, and names that the project itself uses.
const RESERVED: &str = "abstract alignas and as asm async auto await become bool box break case catch char class const continue crate default delete do double dyn else enum explicit export extern false final float fn for friend gen goto if impl in inline int let long loop main match mod move mut namespace new not operator or override pub ref return self short signed sizeof static std struct super switch template test this throw trait true try type typename union unsafe unsigned use using vice virtual void where while";

fn name(text: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if !text.starts_with(|c: char| c.is_ascii_lowercase()) || !text.chars().all(plain) || text.len() > 40 {
        return Err("a name starts with a letter and has a-z, 0-9 and _ only, at most 40".to_string());
    }
    if text.ends_with('_') || text.contains("__") {
        return Err("a name has single _ between its words".to_string());
    }
    if RESERVED.split(' ').any(|word| word == text) {
        return Err("this is a word of Rust or C++; choose another name".to_string());
    }
    if vice_run::formats::built_in().by_name(text).is_ok() {
        return Err("this format is built in; choose another name".to_string());
    }
    Ok(text.to_string())
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from(&args.name));
    let (files, next) = match args.language {
        Language::Rust => (project::rust(&args.name, &dependency(args)?), "cargo build && cargo test"),
        Language::Cpp if args.vice_path.is_some() || args.vice_git.is_some() => {
            return Err(usage(
                "--vice-path and --vice-git are for Rust: a project in C++ has the header beside it",
            ));
        }
        Language::Cpp => (project::cpp(&args.name), "make && make check"),
    };
    project::write(&folder, &files)?;
    terminal::print(&format!(
        "wrote {}: {}\nnext: cd {} && {next}\n",
        folder.display(),
        files.iter().map(|f| f.path).collect::<Vec<_>>().join(", "),
        folder.display()
    ))?;
    if let Some(url) = &args.vice_git {
        terminal::print(&match COMMIT {
            Some(commit) => {
                format!("it depends on {url} at {commit}, the commit that this program was built from\n")
            }
            None => format!(
                "it depends on the newest of {url}: this program does not know which commit it was built from. Add \
                 rev = \"...\" in Cargo.toml to keep to one\n"
            ),
        })?;
    }
    Ok(Outcome::Done)
}

/// The commit that this program was built from, where that is known.
const COMMIT: Option<&str> = option_env!("VICE_COMMIT");

/// How the project in Rust depends on VICE.
fn dependency(args: &Args) -> anyhow::Result<project::Dependency> {
    match (&args.vice_path, &args.vice_git) {
        (Some(path), _) => {
            let no_checkout = || usage(format!("--vice-path: {} is no checkout of VICE", path.display()));
            // Absolute, so that the project can be moved.
            let path = path.canonicalize().map_err(|_| no_checkout())?;
            if !path.join("adapters/plugin/abi/Cargo.toml").is_file() {
                return Err(no_checkout());
            }
            let text = path.to_str().ok_or_else(|| usage("--vice-path: the path is not UTF-8"))?;
            Ok(project::Dependency::Path(text.to_string()))
        }
        (None, Some(url)) => {
            Ok(project::Dependency::Git { url: url.clone(), commit: COMMIT.map(str::to_string) })
        }
        (None, None) => Err(usage(
            "a project in Rust depends on VICE: give --vice-path (a checkout) or --vice-git (the repository's address)",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_can_be_those_of_crates_and_classes() {
        for good in ["myrobot", "my_robot2"] {
            assert!(name(good).is_ok(), "{good}");
        }
        for bad in ["", "My", "2x", "a-b", "a b", "../x", "struct", "virtual", "euroc", "x__y", "x_", "é"] {
            assert!(name(bad).is_err(), "{bad}");
        }
        assert!(name(&"x".repeat(41)).is_err());
    }
}
