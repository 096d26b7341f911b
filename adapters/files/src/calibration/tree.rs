//! A calibration of whatever dialect as a tree of keys and values: YAML, OpenCV's YAML and OpenCV's XML.

use roxmltree::{Document, Node};
use serde_json::{Map, Value};
use vice_core::error::{DataError, DataResult};

use crate::yaml;

/// Reads the text of a file.
pub(super) fn read(text: &str) -> DataResult<Map<String, Value>> {
    let value = if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
        from_xml(text)?
    } else if text.trim_start_matches('\u{feff}').trim_start().starts_with('{') && text.contains("\"value0\"")
    {
        // JSON that YAML's readers do not take, such as with tabs.
        serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| {
            DataError::new(format!("is not the JSON expected: {e}"))
                .line(e.line() as u64)
                .hint(super::DIALECTS)
        })?
    } else {
        yaml::parse(text).map_err(|e| e.hint(super::DIALECTS))?
    };
    match value {
        Value::Object(map) => Ok(map),
        _ => Err(DataError::new("is not the YAML expected: no keys").hint(super::DIALECTS)),
    }
}

fn from_xml(text: &str) -> DataResult<Value> {
    let document = Document::parse(text.trim_start_matches('\u{feff}')).map_err(|e| {
        DataError::new(format!("is not the XML expected: {e}"))
            .line(u64::from(e.pos().row))
            .hint(super::DIALECTS)
    })?;
    Ok(of_node(&document.root_element()))
}

fn of_node(node: &Node<'_, '_>) -> Value {
    let children: Vec<Node<'_, '_>> = node.children().filter(Node::is_element).collect();
    if !children.is_empty() {
        return Value::Object(
            children.iter().map(|c| (c.tag_name().name().to_string(), of_node(c))).collect(),
        );
    }
    let text = node.text().unwrap_or_default().trim();
    let numbers: Option<Vec<f64>> =
        text.split_whitespace().map(|w| w.trim_end_matches(',').parse().ok()).collect();
    match numbers {
        Some(numbers) if numbers.len() > 1 => numbers.into(),
        Some(numbers) if numbers.len() == 1 => numbers[0].into(),
        _ => Value::String(text.to_string()),
    }
}

/// A number, also where it is written as text.
pub(super) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::String(text) => text.trim().parse().ok(),
        Value::Bool(set) => Some(f64::from(u8::from(*set))),
        _ => None,
    }
}

/// A list of numbers: flat, in rows, or in OpenCV's `{rows, cols, data}`.
pub(super) fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(items) => {
            let mut all = Vec::with_capacity(items.len());
            for item in items {
                match item {
                    Value::Array(_) => all.extend(numbers(item)?),
                    _ => all.push(number(item)?),
                }
            }
            Some(all)
        }
        Value::Object(map) => map.get("data").and_then(numbers),
        Value::Number(_) => number(value).map(|n| vec![n]),
        _ => None,
    }
}

/// Whether a value says nothing: zero, null, empty, or an identity.
pub(super) fn says_nothing(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::String(text) if text.trim().is_empty() => true,
        _ => numbers(value).or_else(|| number(value).map(|n| vec![n])).is_some_and(|all| {
            let side = (1..=4).find(|n| n * n == all.len()).filter(|n| *n > 1);
            let identity = side.is_some_and(|n| {
                all.iter().enumerate().all(|(i, v)| *v == f64::from(u8::from(i / n == i % n)))
            });
            identity || all.iter().all(|v| *v == 0.0)
        }),
    }
}
