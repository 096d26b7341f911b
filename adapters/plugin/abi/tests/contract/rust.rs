//! Rust of the plain form of `src/contract`.

use std::collections::BTreeMap;

use super::Contract;

pub(super) fn read(source: &str) -> Contract {
    let code: String =
        source.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let aliases = aliases(&code);
    let mut contract = Contract::default();
    for item in code.split("pub const ").skip(1) {
        let Some((declared, value)) = item.split_once(';').and_then(|(c, _)| c.split_once(" = ")) else {
            continue;
        };
        if let (Some((name, _)), Ok(value)) = (declared.split_once(':'), value.parse()) {
            contract.constants.insert(name.to_string(), value);
        }
    }
    for (before, definition) in neighbours(&code, "pub struct ") {
        assert!(
            before.trim_end().lines().rev().take(3).any(|l| l == "#[repr(C)]"),
            "a structure without repr(C)"
        );
        let (name, rest) = definition.split_once(" {").expect("a structure has a body");
        let (body, _) = rest.split_once("\n}").expect("a structure ends");
        let fields = body.split("pub ").skip(1).map(|field| {
            let (name, kind) =
                field.trim().trim_end_matches(',').split_once(": ").expect("a field has a type");
            (name.to_string(), plain(kind, &aliases))
        });
        contract.structures.insert(name.to_string(), fields.collect());
    }
    contract
}

/// What stands before and behind each place of a word.
fn neighbours<'a>(code: &'a str, word: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
    code.match_indices(word).map(move |(at, _)| (&code[..at], &code[at + word.len()..]))
}

/// Names of calls, `Call<T>` among them, to what they stand for.
fn aliases(code: &str) -> BTreeMap<String, String> {
    let items = code.split("pub type ").skip(1).map(|item| {
        let (name, call) =
            item.split_once(';').expect("an alias ends").0.split_once(" =").expect("an alias has a type");
        let call = call.trim().strip_prefix("unsafe extern \"C\" ").expect("calls are those of C");
        (name.to_string(), call.replace("c_void", "void"))
    });
    items.collect()
}

/// A type without `Option`, names of calls resolved.
fn plain(kind: &str, aliases: &BTreeMap<String, String>) -> String {
    let kind = kind.replace("c_void", "void");
    let Some(call) = kind.strip_prefix("Option<").and_then(|k| k.strip_suffix('>')) else { return kind };
    let (name, of) = match call.split_once('<') {
        Some((name, of)) => (format!("{name}<T>"), of.trim_end_matches('>')),
        None => (call.to_string(), ""),
    };
    let known = aliases.get(&name).unwrap_or_else(|| panic!("{name} is no call"));
    known.replace("*mut T,", &format!("*mut {of},"))
}
