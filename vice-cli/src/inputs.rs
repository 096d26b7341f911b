//! From options to what the pipeline takes. Shared by all commands that evaluate.

mod depth;
mod estimates;
mod evaluation;
mod open;
mod outputs;
mod streams;

pub(crate) use depth::{AnchorArgs, DepthArgs, Scene};
pub(crate) use estimates::SceneEstimates;
pub(crate) use evaluation::{EvaluationArgs, Scoring};
pub(crate) use open::{DatasetArgs, setting, split_list};
pub(crate) use outputs::Outputs;
pub(crate) use streams::{LoadedStreams, StreamArgs, load_streams};

use std::path::PathBuf;

use anyhow::Context;
use vice_core::evaluate::{Observations, Window};
use vice_core::time::Span;

/// Labels and the part of the run that is evaluated.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Labels")]
pub(crate) struct LabelArgs {
    /// Labels: CSV, JSON, or the authors' pickle.
    #[arg(long, value_name = "FILE")]
    pub(crate) labels: PathBuf,
    /// Only these points.
    #[arg(long, value_name = "NAME,...")]
    pub(crate) points: Vec<String>,
    /// Whose labels count: all, or only those that a human placed.
    #[arg(long, value_name = "manual|all", default_value = "all")]
    pub(crate) observations: Observations,
    /// Keep the frame nearest to each tick of this rate, and every key frame [default: every labelled frame].
    #[arg(long, value_name = "HZ", value_parser = positive)]
    pub(crate) fps: Option<f64>,
    /// Seconds after the camera's first frame.
    #[arg(long, value_name = "S", default_value = "0", allow_hyphen_values = true, value_parser = span_not_negative)]
    pub(crate) start: Span,
    /// Seconds from there [default: to the end].
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = span_not_negative)]
    pub(crate) duration: Option<Span>,
}

impl LabelArgs {
    pub(crate) fn window(&self) -> Window {
        Window { fps: self.fps, start: self.start, duration: self.duration, observations: self.observations }
    }

    /// The labels, or those of the chosen points.
    pub(crate) fn read(
        &self,
        frames: &[vice_core::time::Stamp],
    ) -> anyhow::Result<vice_core::label::LabelSet> {
        let labels = vice_files::labels::read(&self.labels, Some(frames))?;
        let wanted = split_list(&self.points);
        if wanted.is_empty() {
            return Ok(labels);
        }
        labels.select(&wanted).map_err(|unknown| {
            let names: Vec<&str> = labels.points().iter().map(|p| p.name.as_str()).collect();
            crate::terminal::usage(format!(
                "--points: there is no point {unknown}; there are {}",
                names.join(", ")
            ))
        })
    }
}

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
    let values: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().map_err(|e| format!("`{part}`: {e}")))
        .collect::<Result<_, _>>()?;
    if !values.iter().all(|v| v.is_finite()) {
        return Err("all numbers must be finite".to_string());
    }
    let got = values.len();
    values.try_into().map_err(|_| format!("{N} numbers separated by commas are expected, got {got}"))
}

/// A document as one line of JSON.
pub(crate) fn to_json(document: &impl serde::Serialize) -> anyhow::Result<String> {
    let mut text = serde_json::to_string(document).context("cannot make the JSON")?;
    text.push('\n');
    Ok(text)
}

/// Writes a document beside and renames it.
pub(crate) fn write_text(path: &std::path::Path, text: &str) -> anyhow::Result<()> {
    vice_files::atomic::write(path, vice_files::atomic::Overwrite::Replace, |out| {
        out.write_all(text.as_bytes())
    })
    .with_context(|| format!("cannot write {}", path.display()))
}
