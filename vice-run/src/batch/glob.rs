//! Paths with `*` and `?` in their parts, as a shell has them.

use std::path::{Component, Path, PathBuf};

use vice_files::address::is_address;

/// Whether a path has a wildcard in it.
pub(super) fn is_glob(path: &str) -> bool {
    // A `?` of an address starts its query.
    !is_address(path) && path.contains(['*', '?'])
}

/// All paths below `base` that a pattern stands for, as the pattern would be written without its wildcards, sorted by
/// name. `**` stands for any number of folders.
pub(super) fn expand(base: &Path, pattern: &str) -> Vec<PathBuf> {
    let mut found = vec![PathBuf::new()];
    for part in Path::new(pattern).components() {
        let mut next = Vec::new();
        for path in found {
            match part {
                Component::Normal(name) => {
                    let name = name.to_string_lossy();
                    if name == "**" {
                        below(base, &path, &mut next);
                    } else if is_glob(&name) {
                        next.extend(children(base, &path, &name));
                    } else if base.join(&path).join(&*name).exists() {
                        next.push(path.join(&*name));
                    }
                }
                other => next.push(path.join(other)),
            }
        }
        found = next;
    }
    found.sort();
    found.dedup();
    found
}

fn children(base: &Path, path: &Path, pattern: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder(base, path)).into_iter().flatten().flatten();
    let names = entries.map(|e| e.file_name().to_string_lossy().into_owned());
    // As in a shell, what is hidden is meant only where it is said.
    let shown = |n: &String| !n.starts_with('.') || pattern.starts_with('.');
    names.filter(shown).filter(|n| matches(pattern, n)).map(|n| path.join(n)).collect()
}

/// A folder and all below it; links are not followed, so that there is an end.
fn below(base: &Path, path: &Path, found: &mut Vec<PathBuf>) {
    found.push(path.to_path_buf());
    for child in children(base, path, "*") {
        if base.join(&child).symlink_metadata().is_ok_and(|m| m.is_dir()) {
            below(base, &child, found);
        }
    }
}

fn folder(base: &Path, path: &Path) -> PathBuf {
    let folder = base.join(path);
    if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder }
}

/// Whether a name fits a pattern. The last star is tried again further on where the rest does not fit.
fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    let mut star: Option<(usize, usize)> = None;
    while n < name.len() {
        if p < pattern.len() && pattern[p] == '*' {
            star = Some((p, n));
            p += 1;
        } else if p < pattern.len() && (pattern[p] == '?' || pattern[p] == name[n]) {
            p += 1;
            n += 1;
        } else if let Some((star_p, star_n)) = star {
            p = star_p + 1;
            n = star_n + 1;
            star = Some((star_p, n));
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_any_letters() {
        for (pattern, name) in [("*", "x"), ("V1_*_easy", "V1_01_easy"), ("a?c*", "abc"), ("*a*b", "xaab")] {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        assert!(!matches("V1_*", "V2_01") && !matches("a?", "a") && !matches("*ab", "abx"));
    }

    #[test]
    fn a_pattern_is_what_is_there_in_order() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b/run2", "b/run1", "a/run1", "a/.hidden", "c"] {
            std::fs::create_dir_all(folder.path().join(name)).unwrap();
        }
        let names = |pattern: &str| -> Vec<String> {
            expand(folder.path(), pattern).iter().map(|p| p.to_string_lossy().into_owned()).collect()
        };
        assert_eq!(names("*/run?"), ["a/run1", "b/run1", "b/run2"]);
        assert_eq!(names("**/run1"), ["a/run1", "b/run1"]);
        assert_eq!(names("*/*"), ["a/run1", "b/run1", "b/run2"]);
        assert!(names("no/*").is_empty());
    }
}
