//! `vice_plugin.h`, its wrapper in C++ and the Rust types are one contract: each is read, and what one has and another lacks
//! or has otherwise fails here.

// Helpers of tests fail their test.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod c;
mod rust;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use vice_abi::contract::{ENTRY_SYMBOL, PluginTable};
use vice_abi::{CPP_EXPORT_HEADER, CPP_HEADER, HEADER};

/// What a side says: both are read into the names and types of Rust.
#[derive(Default)]
struct Contract {
    /// Constants without `VICE_`.
    constants: BTreeMap<String, u64>,
    /// Fields of structures, in their order, with their types.
    structures: BTreeMap<String, Vec<(String, String)>>,
}

impl Contract {
    fn table(&self) -> impl Iterator<Item = (&str, &str)> {
        self.structures["PluginTable"].iter().map(|(name, kind)| (name.as_str(), kind.as_str()))
    }

    /// Names of the table's calls.
    fn calls(&self) -> impl Iterator<Item = &str> {
        self.table().filter(|(_, kind)| kind.starts_with("fn(")).map(|(name, _)| name)
    }
}

/// A line for each thing that is on one side only, or is not the same.
fn differences<T: PartialEq + std::fmt::Debug>(
    c: &BTreeMap<String, T>,
    rust: &BTreeMap<String, T>,
) -> Vec<String> {
    let names: BTreeSet<&String> = c.keys().chain(rust.keys()).collect();
    let different = names.into_iter().filter(|name| c.get(*name) != rust.get(*name));
    different.map(|name| format!("{name}: in C {:?}, in Rust {:?}", c.get(name), rust.get(name))).collect()
}

fn rust_sources() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/contract");
    let files = ["constants.rs", "values.rs", "table.rs"];
    files.map(|f| std::fs::read_to_string(folder.join(f)).unwrap()).concat()
}

#[test]
fn the_header_is_what_rust_says() {
    let (c, rust) = (c::read(HEADER), rust::read(&rust_sources()));
    let mut wrong = differences(&c.constants, &rust.constants);
    wrong.extend(differences(&c.structures, &rust.structures));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(c.constants.len() > 30 && c.structures.len() > 25, "the header was not read");
    let entry = format!("const vice_plugin_table *{ENTRY_SYMBOL}(const vice_host *host);");
    assert!(HEADER.contains(&entry), "{entry}");
}

/// That the comparison itself finds what is missing.
#[test]
fn a_missing_or_changed_field_is_found() {
    let rust = rust::read(&rust_sources());
    let lines = |header: &str| {
        let c = c::read(header);
        [differences(&c.constants, &rust.constants), differences(&c.structures, &rust.structures)].concat()
    };
    assert_eq!(lines(HEADER), Vec::<String>::new());
    for (from, to, name) in [
        ("#define VICE_FLOOR_BODY 1", "#define VICE_FLOOR_BODY 2", "FLOOR_BODY"),
        ("#define VICE_FLOOR_BODY 1", "", "FLOOR_BODY"),
        ("    double d_m;", "", "Floor"),
        ("    double d_m;", "    float d_m;", "Floor"),
        ("    int64_t from_ns;\n    int64_t to_ns;", "    int64_t to_ns;\n    int64_t from_ns;", "Motion"),
        ("    const float *z_m;", "    float *z_m;", "DepthImage"),
        ("double coefficients[VICE_MAX_COEFFICIENTS]", "double coefficients[4]", "Camera"),
        ("int64_t keyframe_ns, vice_floor", "uint64_t keyframe_ns, vice_floor", "PluginTable"),
        ("} vice_fact;", "} vice_fact;\ntypedef struct vice_more {\n    int32_t x;\n} vice_more;", "More"),
    ] {
        assert!(HEADER.contains(from), "{from}");
        let found = lines(&HEADER.replacen(from, to, 1));
        assert!(found.iter().any(|l| l.starts_with(&format!("{name}: "))), "{from}: {found:?}");
    }
}

#[test]
fn the_wrapper_fills_the_whole_table_and_has_no_numbers_of_its_own() {
    let c = c::read(HEADER);
    for (field, _) in c.table() {
        assert!(CPP_EXPORT_HEADER.contains(&format!("t.{field} = ")), "the wrapper does not set `{field}`");
    }
    // What a data set is asked is a method of the class.
    for call in c.calls().filter(|c| !["probe", "open", "close", "release", "describe"].contains(c)) {
        let method = if call == "frames" { "frames_ns" } else { call };
        let there = CPP_HEADER.lines().any(|l| l.contains("virtual") && l.contains(&format!(" {method}(")));
        assert!(there, "vice::Dataset has no method for `{call}`");
    }
    for header in [CPP_HEADER, CPP_EXPORT_HEADER] {
        assert!(
            !header.contains("constexpr") && !header.contains("enum "),
            "constants are those of the C header"
        );
        for (at, _) in header.match_indices("VICE_") {
            let name: String = header[at + 5..]
                .chars()
                .take_while(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || *c == '_')
                .collect();
            let own = name.starts_with("PLUGIN") || name == "EXPORT" || name.ends_with('_');
            assert!(own || c.constants.contains_key(&name), "VICE_{name} is not in the C header");
        }
    }
}

fn include() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("include")
}

fn compile(variable: &str, usual: &str, file: &str, source: &str, flags: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(file);
    std::fs::write(&path, source).unwrap();
    let compiler = std::env::var(variable).unwrap_or_else(|_| usual.to_string());
    let mut command = Command::new(compiler);
    command.args(flags).args(["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"]);
    let output = command.arg("-fsyntax-only").arg("-I").arg(include()).arg(&path).output();
    let output = output.expect("the system has a C and a C++ compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_headers_compile_without_warnings() {
    // The size stands for the rest: the types were compared one by one.
    let c = format!(
        "#include \"vice_plugin.h\"\ntypedef char same[sizeof(vice_plugin_table) == {} ? 1 : -1];\n",
        size_of::<PluginTable>()
    );
    compile("CC", "cc", "uses.c", &c, &["-std=c99"]);
    compile("CXX", "c++", "uses.cpp", include_str!("uses.cpp"), &["-std=c++17"]);
}
