//! Text from data in HTML and SVG, and in embedded JSON.

use std::fmt::Write;

use crate::text::printable;

/// Appends a text so that it is a text in HTML and XML, in an element as in an attribute.
pub(crate) fn push_escaped(out: &mut String, text: &str) {
    // Writing to a string does not fail.
    let _ = maud::Escaper::new(out).write_str(&printable(text));
}

/// JSON that no HTML parser takes for anything else: inside a string all of these may be written as escapes.
pub(crate) fn json_for_script(json: &str) -> String {
    let mut safe = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => {
                let _ = write!(safe, "\\u{:04x}", c as u32);
            }
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_from_data_is_markup() {
        let mut out = String::new();
        push_escaped(&mut out, "<b a=\"x\">&'\u{1b}[31m");
        assert_eq!(out, "&lt;b a=&quot;x&quot;&gt;&amp;' [31m");
        let json = json_for_script("{\"a\":\"</script><!--&\u{2028}\u{2029}\"}");
        assert_eq!(json, "{\"a\":\"\\u003c/script\\u003e\\u003c!--\\u0026\\u2028\\u2029\"}");
        let back: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(back["a"], "</script><!--&\u{2028}\u{2029}");
    }
}
