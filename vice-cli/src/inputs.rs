//! Options as clap sees them, and the parts of a request that they become. Shared by all commands.

mod dataset;
mod depth;
mod evaluation;
mod streams;

use std::path::Path;

use anyhow::Context;
use vice_run::core::time::Span;
use vice_run::files::atomic::{self, Overwrite};

pub(crate) use dataset::{Counted, DatasetArgs, PluginArgs, counted_spec, setting};
pub(crate) use depth::{AnchorArgs, CalibrationArgs, DepthArgs, SourceArgs, on_off};
#[cfg(test)]
pub(crate) use evaluation::ASKED;
pub(crate) use evaluation::{EvaluationArgs, LabelArgs, WindowArgs};
pub(crate) use streams::{PoseArgs, StreamArgs};

/// A span in decimal seconds.
pub(crate) fn span(text: &str) -> Result<Span, String> {
    Span::parse_seconds(text).map_err(|e| e.to_string())
}

/// A span that is not negative.
pub(crate) fn span_not_negative(text: &str) -> Result<Span, String> {
    let span = span(text)?;
    if span < Span::ZERO { Err("must not be negative".to_string()) } else { Ok(span) }
}

/// A number above zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        Ok(_) => Err("must be a number above zero".to_string()),
        Err(error) => Err(error.to_string()),
    }
}

/// Exactly `N` numbers separated by commas.
pub(crate) fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let values = numbers_any(text)?;
    let got = values.len();
    values.try_into().map_err(|_| format!("{N} numbers separated by commas are expected, got {got}"))
}

/// Any number of numbers, in one value of an option.
#[derive(Clone, Debug)]
pub(crate) struct Numbers(pub(crate) Vec<f64>);

impl std::str::FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers_any(text).map(Self)
    }
}

/// Numbers separated by commas.
fn numbers_any(text: &str) -> Result<Vec<f64>, String> {
    let values: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().map_err(|e| format!("`{part}`: {e}")))
        .collect::<Result<_, _>>()?;
    match values.iter().all(|v| v.is_finite()) {
        true => Ok(values),
        false => Err("all numbers must be finite".to_string()),
    }
}

/// Lists repeat the option or take commas; a value that is a file keeps its commas.
pub(crate) fn split_list(values: &[String]) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for value in values {
        let whole = Path::new(value).exists();
        let parts: Vec<&str> = if whole { vec![value.as_str()] } else { value.split(',').collect() };
        for part in parts.into_iter().map(str::trim).filter(|p| !p.is_empty()) {
            if !list.iter().any(|p| p == part) {
                list.push(part.to_string());
            }
        }
    }
    list
}

/// A document as one line of JSON.
pub(crate) fn to_json(document: &impl serde::Serialize) -> anyhow::Result<String> {
    let mut text = serde_json::to_string(document).context("cannot make the JSON")?;
    text.push('\n');
    Ok(text)
}

/// Writes a document beside and renames it.
pub(crate) fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    atomic::write(path, Overwrite::Replace, |out| out.write_all(text.as_bytes()))
        .with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_repeat_or_take_commas() {
        let list = |values: &[&str]| split_list(&values.iter().map(|v| (*v).to_string()).collect::<Vec<_>>());
        assert_eq!(list(&["floor,zmap", "zcam", "floor"]), ["floor", "zmap", "zcam"]);
        assert_eq!(list(&["a, b,,"]), ["a", "b"]);
    }
}
