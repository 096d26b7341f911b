//! The lists of what is depended on are those of the manifests.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use vice_tests::root;

fn text(relative: &str) -> String {
    fs::read_to_string(root().join(relative)).unwrap_or_else(|e| panic!("{relative}: {e}"))
}

#[test]
fn each_direct_dependency_has_its_reason() {
    let manifest = text("Cargo.toml");
    let part = manifest.split("[workspace.dependencies]").nth(1).unwrap().split("\n[").next().unwrap();
    let outside = part.lines().filter(|line| !line.contains("path = ") && !line.trim().is_empty());
    let asked: BTreeSet<&str> = outside.map(|line| line.split(' ').next().unwrap()).collect();
    assert!(asked.len() > 40, "{asked:?}");
    let page = text("docs/dependencies.md");
    let mut listed = BTreeSet::new();
    for row in page.lines().filter(|line| line.starts_with("| ")).skip(2) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        assert!(cells.len() == 3 && cells.iter().all(|cell| cell.len() > 2), "{row}");
        listed.extend(cells[0].split(", "));
    }
    assert_eq!(listed, asked);
    // No package goes past the list.
    for member in
        manifest.split("members = [").nth(1).unwrap().split(']').next().unwrap().split('"').skip(1).step_by(2)
    {
        for line in text(&format!("{member}/Cargo.toml")).lines() {
            let asks = line.contains("version = \"") && line.contains(" = {") || line.contains("git = ");
            assert!(!asks, "{member}: `{line}` is no dependency of the workspace");
        }
    }
}

#[test]
fn each_crate_with_several_versions_has_its_reason() {
    let lock = text("Cargo.lock");
    let mut versions: BTreeMap<&str, usize> = BTreeMap::new();
    for package in lock.split("[[package]]").skip(1) {
        let name = package.lines().find_map(|l| l.strip_prefix("name = ")).unwrap();
        *versions.entry(name.trim_matches('"')).or_default() += 1;
    }
    let several: BTreeSet<&str> = versions.iter().filter(|(_, n)| **n > 1).map(|(name, _)| *name).collect();
    let deny = text("deny.toml");
    let skip = deny.split("skip = [").nth(1).unwrap().split("\n]").next().unwrap();
    let mut listed = BTreeSet::new();
    for line in skip.lines().filter(|line| line.contains("crate = ")) {
        let words: Vec<&str> = line.split('"').collect();
        assert!(words.len() == 5 && words[2].contains("reason") && words[3].len() > 10, "{line}");
        listed.insert(words[1]);
    }
    assert_eq!(listed, several);
}
