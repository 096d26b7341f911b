//! The arrows of docs/architecture.md: which package uses which, and which module.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A package as the page lists it.
#[derive(Default)]
struct Listed {
    folder: PathBuf,
    /// Packages of this workspace that it may use.
    uses: BTreeSet<String>,
    /// Its modules, each of which uses only those before it.
    modules: Vec<String>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// Sections such as "### `vice-core` in `vice-core`", a line "Uses: ..." and a block of modules.
fn listed() -> BTreeMap<String, Listed> {
    let page = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let mut packages: BTreeMap<String, Listed> = BTreeMap::new();
    let (mut name, mut in_block) = (None, false);
    for line in page.lines() {
        if let Some(head) = line.strip_prefix("### `") {
            let words: Vec<&str> = head.split('`').collect();
            name = Some(words[0].to_string());
            packages.entry(words[0].to_string()).or_default().folder = PathBuf::from(words[2]);
        } else if line.starts_with("## ") {
            name = None;
        }
        let Some(package) = name.as_ref().and_then(|n| packages.get_mut(n)) else { continue };
        if line.starts_with("```") {
            in_block = !in_block;
        } else if in_block {
            package.modules.extend(line.split_whitespace().next().map(str::to_string));
        } else if let Some(uses) = line.strip_prefix("Uses: ") {
            let names = uses.trim_end_matches('.').split(", ").map(str::to_string);
            package.uses.extend(names.filter(|n| n != "nothing of this workspace"));
        }
    }
    packages
}

/// All files of Rust below a folder, sorted.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// The code of a file without comments and without its tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    text.lines().map(|l| l.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Names behind a prefix of a path: one, or those of a list in braces.
fn names_behind(code: &str, prefix: &str) -> BTreeSet<String> {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut names = BTreeSet::new();
    for (at, _) in code.match_indices(prefix) {
        if code[..at].chars().next_back().is_some_and(word) {
            continue;
        }
        let rest = &code[at + prefix.len()..];
        if let Some(list) = rest.strip_prefix('{') {
            let list = &list[..list.find(';').unwrap_or(list.len())];
            names.extend(list.split(['{', '}', ',']).filter_map(|part| {
                part.trim().split("::").next().map(str::to_string).filter(|n| !n.is_empty())
            }));
        } else {
            names.insert(rest.chars().take_while(|c| word(*c)).collect());
        }
    }
    names
}

/// A file's module below `src`: its folders and its own name.
fn module_path(src: &Path, file: &Path) -> Vec<String> {
    let relative = file.strip_prefix(src).unwrap().with_extension("");
    let mut parts: Vec<String> = relative.iter().map(|p| p.to_string_lossy().into_owned()).collect();
    if parts.last().is_some_and(|p| p == "mod") {
        parts.pop();
    }
    parts
}

fn is_test(parts: &[String]) -> bool {
    parts.last().is_some_and(|p| p.ends_with("tests") || p == "testing")
}

/// What is wrong with the modules of a package: one that is not listed, or uses one that stands below it.
fn wrong_modules(package: &Listed, src: &Path) -> Vec<String> {
    let place = |name: &str| package.modules.iter().position(|m| m == name);
    let mut wrong = BTreeSet::new();
    for file in sources(src) {
        let parts = module_path(src, &file);
        if parts[0] == "bin" || matches!(parts[0].as_str(), "lib" | "main") || is_test(&parts) {
            continue;
        }
        let Some(own) = place(&parts[0]) else {
            wrong.insert(format!(
                "{}: the module {} is not in docs/architecture.md",
                file.display(),
                parts[0]
            ));
            continue;
        };
        let code = code(&file);
        let mut used = names_behind(&code, "crate::");
        if parts.len() == 1 {
            used.extend(names_behind(&code, "super::"));
        }
        for name in used.iter().filter(|n| place(n).is_some_and(|p| p > own)) {
            wrong.insert(format!("{}: {} uses {name}, which stands below it", file.display(), parts[0]));
        }
    }
    wrong.into_iter().collect()
}

/// Files of one folder that use each other in a circle.
fn circles(src: &Path) -> Vec<String> {
    let mut uses: BTreeMap<(PathBuf, String), BTreeSet<String>> = BTreeMap::new();
    for file in sources(src) {
        let parts = module_path(src, &file);
        // A folder's own file names its parts: `foo.rs` beside `foo/`, or `foo/mod.rs`.
        if parts.len() < 2 || is_test(&parts) || file.file_name().is_some_and(|n| n == "mod.rs") {
            continue;
        }
        let folder = file.parent().unwrap().to_path_buf();
        let (code, own) = (code(&file), parts.last().unwrap().clone());
        let mut used = names_behind(&code, "super::");
        used.extend(names_behind(&code, &format!("crate::{}::", parts[..parts.len() - 1].join("::"))));
        used.remove(&own);
        uses.insert((folder, own), used);
    }
    let mut found = Vec::new();
    for (folder, start) in uses.keys() {
        let (mut seen, mut next) = (BTreeSet::new(), vec![start.clone()]);
        while let Some(name) = next.pop() {
            for used in uses.get(&(folder.clone(), name)).into_iter().flatten() {
                if used == start {
                    found.push(format!("{}: {start} uses itself through others", folder.display()));
                    next.clear();
                    break;
                }
                if seen.insert(used.clone()) {
                    next.push(used.clone());
                }
            }
        }
    }
    found
}

/// Packages of this workspace in the dependencies of a manifest, those of tests left out.
fn dependencies(manifest: &Path) -> BTreeSet<String> {
    let text = fs::read_to_string(manifest).unwrap();
    let section = text.split("\n[dependencies]\n").nth(1).unwrap_or_default();
    let section = section.split("\n[").next().unwrap_or_default();
    let name = |line: &str| line.split([' ', '.', '=']).next().unwrap_or_default().to_string();
    section.lines().map(name).filter(|n| n.starts_with("vice-")).collect()
}

#[test]
fn each_package_uses_what_the_page_lets_it() {
    let packages = listed();
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let members = manifest.split("members = [").nth(1).unwrap().split(']').next().unwrap().to_string();
    for folder in members.split('"').skip(1).step_by(2) {
        let listed = packages.values().find(|p| p.folder == Path::new(folder));
        let listed = listed.unwrap_or_else(|| panic!("{folder} is not in docs/architecture.md"));
        let used = dependencies(&root().join(folder).join("Cargo.toml"));
        let more: Vec<&String> = used.difference(&listed.uses).collect();
        assert!(more.is_empty(), "{folder} uses {more:?}, which docs/architecture.md does not let it");
    }
}

#[test]
fn each_module_uses_only_those_above_it() {
    let mut wrong = Vec::new();
    for package in listed().values() {
        let src = root().join(&package.folder).join("src");
        wrong.extend(wrong_modules(package, &src));
        wrong.extend(circles(&src));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_forbidden_use_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    let package = Listed { modules: vec!["low".to_string(), "high".to_string()], ..Listed::default() };
    write("low.rs", "// use crate::high::X;\n#[cfg(test)]\nmod tests {\n    use crate::high::X;\n}\n");
    write("high.rs", "use crate::low::X;\n");
    assert_eq!(wrong_modules(&package, folder.path()), Vec::<String>::new());
    write("low.rs", "use crate::{other, high::X};\n");
    assert!(wrong_modules(&package, folder.path())[0].contains("low uses high"));
    write("low.rs", "fn f() -> super::high::X { super::high::X }\n");
    assert!(wrong_modules(&package, folder.path())[0].contains("low uses high"));
    write("extra.rs", "");
    assert!(wrong_modules(&package, folder.path())[0].contains("extra is not in"));
    write("high/a.rs", "use super::b::X;\n");
    write("high/b.rs", "use super::c::X;\n");
    write("high/c.rs", "");
    assert_eq!(circles(folder.path()), Vec::<String>::new());
    write("high/c.rs", "use crate::high::a::X;\n");
    assert_eq!(circles(folder.path()).len(), 3);
}
