//! What was asked for, so that it can be asked for again.

use maud::{Markup, html};
use serde_json::Value;

use crate::result::ResultDocument;
use crate::text::printable;

/// The request and what was chosen where it leaves something open, as a table; and as a command.
pub(crate) fn settings(document: &ResultDocument) -> Markup {
    let mut rows: Vec<(String, String)> = vec![("VICE".to_string(), document.vice_version.clone())];
    // A document is made of values that JSON has.
    let request = serde_json::to_value(&document.request).unwrap_or_default();
    push_rows(&mut rows, "", &request);
    let used = &document.used;
    rows.push(("points that take part".to_string(), used.points.join(", ")));
    rows.push(("anchor of depth".to_string(), used.anchor.clone()));
    rows.push(("seconds added to the estimates' stamps".to_string(), used.time_offset_s.to_string()));
    rows.push(("alignment".to_string(), used.align.clone()));
    html! {
        div.wide {
            table {
                tbody {
                    @for (name, value) in rows {
                        tr { td.t { (printable(&name)) } td.wrap { (printable(&value)) } }
                    }
                }
            }
        }
        @if let Some(command) = command(document) {
            p { "The same again:" }
            pre { (printable(&command)) }
        }
    }
}

/// A row for each field, with a dot between the names of fields that lie in each other.
fn push_rows(rows: &mut Vec<(String, String)>, name: &str, value: &Value) {
    let below = |key: &str| if name.is_empty() { key.to_string() } else { format!("{name}.{key}") };
    match value {
        Value::Object(fields) => fields.iter().for_each(|(key, value)| push_rows(rows, &below(key), value)),
        Value::Array(values) => {
            let texts: Vec<String> = values.iter().map(text).collect();
            rows.push((name.to_string(), texts.join(", ")));
        }
        Value::Null => {}
        value => rows.push((name.to_string(), text(value))),
    }
}

fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

/// The command line that evaluates the same again; `None` where recording, labels or poses were never files.
pub(crate) fn command(document: &ResultDocument) -> Option<String> {
    let named = !document.request.dataset.path.as_os_str().is_empty();
    (named && document.request.has_command_line()).then(|| document.request.command_line())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, part, sample};

    #[test]
    fn the_command_holds_what_was_asked_for_and_no_more_words() {
        let mut d = document(vec![part("e", &[sample("a", 1, 2.0)])]);
        assert_eq!(command(&d), None, "without the path of the data set");
        d.request.dataset.path = "my run".into();
        d.request.labels.file = "$(rm).csv".into();
        d.request.streams.estimates = vec!["e.txt".to_string().into()];
        d.request.dataset.set.insert("topic".to_string(), "/a b".to_string());
        assert_eq!(
            command(&d).unwrap(),
            "vice evaluate 'my run' --set 'topic=/a b' --labels '$(rm).csv' --estimate e.txt"
        );
    }

    #[test]
    fn each_field_of_the_request_has_a_row() {
        let mut rows = Vec::new();
        let request =
            serde_json::json!({"depth": {"sources": ["floor", "zmap"], "tag_size_m": 0.1}, "a": null});
        push_rows(&mut rows, "", &request);
        let row = |name: &str, value: &str| (name.to_string(), value.to_string());
        assert_eq!(rows, [row("depth.sources", "floor, zmap"), row("depth.tag_size_m", "0.1")]);
    }
}
