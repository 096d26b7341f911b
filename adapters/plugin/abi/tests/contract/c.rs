//! A C header of the plain form of `vice_plugin.h`.

use super::Contract;

pub(super) fn read(header: &str) -> Contract {
    let text = without_comments(header);
    let mut contract = Contract::default();
    for line in text.lines() {
        let Some((name, value)) = line.strip_prefix("#define VICE_").and_then(|l| l.split_once(' ')) else {
            continue;
        };
        if let Ok(value) = value.trim().parse() {
            contract.constants.insert(name.to_string(), value);
        }
    }
    for definition in text.split("typedef struct ").skip(1) {
        let (name, rest) = definition.split_once(" {").expect("a structure has a body");
        let (body, _) = rest.split_once(&format!("}} {name};")).expect("a structure ends with its name");
        let fields = body.split(';').map(str::trim).filter(|f| !f.is_empty()).map(declaration);
        contract.structures.insert(type_name(name), fields.collect());
    }
    contract
}

fn without_comments(header: &str) -> String {
    let mut text = String::new();
    for (i, part) in header.split("/*").enumerate() {
        text += if i == 0 { part } else { part.split_once("*/").expect("comments end").1 };
    }
    text
}

/// Name and type of `double x[3]`, `const char *data` or `int32_t (*call)(void *dataset, ...)`.
fn declaration(text: &str) -> (String, String) {
    if let Some((result, rest)) = text.split_once("(*") {
        let (name, arguments) = rest.split_once(")(").expect("a call has arguments");
        let arguments = arguments.strip_suffix(')').expect("arguments end");
        let types: Vec<String> = arguments.split(',').map(|a| declaration(a.trim()).1).collect();
        let result = result.trim();
        let result = if result == "void" { String::new() } else { format!(" -> {}", type_name(result)) };
        return (name.to_string(), format!("fn({}){result}", types.join(", ")));
    }
    let (text, count) = match text.strip_suffix(']').and_then(|t| t.split_once('[')) {
        Some((text, count)) => (text, Some(count.trim_start_matches("VICE_"))),
        None => (text, None),
    };
    let at = text.rfind([' ', '*']).expect("a declaration has a type and a name");
    let (kind, name) = (text[..=at].trim(), &text[at + 1..]);
    let kind = pointers(kind);
    (name.to_string(), count.map_or_else(|| kind.clone(), |n| format!("[{kind}; {n}]")))
}

/// `const vice_text *` as `*const Text`, `void **` as `*mut *mut void`.
fn pointers(kind: &str) -> String {
    match kind.strip_suffix('*').map(str::trim) {
        None => type_name(kind),
        Some(to) if to.ends_with('*') => format!("*mut {}", pointers(to)),
        Some(to) => match to.strip_prefix("const ") {
            Some(to) => format!("*const {}", type_name(to)),
            None => format!("*mut {}", type_name(to)),
        },
    }
}

fn type_name(name: &str) -> String {
    let plain = match name.trim() {
        "int32_t" => "i32",
        "int64_t" => "i64",
        "uint32_t" => "u32",
        "uint64_t" => "u64",
        "char" | "uint8_t" => "u8",
        "size_t" => "usize",
        "float" => "f32",
        "double" => "f64",
        other => other,
    };
    let Some(words) = plain.strip_prefix("vice_") else { return plain.to_string() };
    words.split('_').map(|w| w[..1].to_uppercase() + &w[1..]).collect()
}
