//! `vice sensitivity`: how RMSE_2D answers to each flaw, and which size of it the labels at hand can show.

use std::path::PathBuf;

use vice_core::diagnose::{Curve, Diagnosis, Flaw, SensitivityDocument, sensitivity};
use vice_core::result::Role;

use super::diagnose::{LookingArgs, scoring};
use crate::inputs::{EvaluationArgs, Outputs, to_json};
use crate::report::{sensitivity_plot, table};
use crate::terminal::{self, Outcome, Verbosity, advance, printable, usage};

/// Arguments of `vice sensitivity`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice sensitivity V1_01_easy --labels floor.csv --estimate ground-truth --svg sensitivity.svg\n\n\
    Each flaw is injected into what is in use, both ways round, at growing size. `seen from` is the size at which\n\
    RMSE_2D is a tenth larger than it is now; `found from` the smallest size that `vice diagnose` finds nineteen times\n\
    of twenty. Labels that cannot show a flaw say `never` there.")]
pub(crate) struct Args {
    #[command(flatten)]
    evaluation: EvaluationArgs,
    #[command(flatten)]
    looking: LookingArgs,
    /// Sensitivity document, vice.sensitivity/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    json: Option<PathBuf>,
    /// The curves as CSV.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    csv: Option<PathBuf>,
    /// The curves as a picture.
    #[arg(long, value_name = "FILE.svg", help_heading = "Output")]
    svg: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.json, &args.csv, &args.svg], &args.evaluation.files())?;
    let flaws = args.looking.flaws();
    let document = args.evaluation.with_evaluation(&scoring(), |evaluation, streams| {
        let estimates: Vec<usize> = evaluation
            .streams
            .iter()
            .enumerate()
            .filter(|(_, s)| s.role == Role::Estimate)
            .map(|(index, _)| index)
            .collect();
        let ([stream], [_]) = (estimates.as_slice(), evaluation.depths) else {
            return Err(usage("sensitivity takes one --estimate and one --depth"));
        };
        let inertial = streams.inertial_run(*stream);
        let options = args.looking.options();
        let diagnosis = Diagnosis { evaluation, stream: *stream, depth: 0, inertial, flaws: &flaws, options };
        let bar = verbosity.progress("injecting");
        let document = sensitivity(&diagnosis, &|done, total| {
            advance(&bar, done, total);
        })?;
        bar.finish_and_clear();
        Ok(document)
    })?;
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&document)?));
    }
    if let Some(path) = &args.csv {
        texts.push((path, csv(&document)?));
    }
    if let Some(path) = &args.svg {
        texts.push((path, sensitivity_plot::draw(&document)));
    }
    if !outputs.write(&texts)? {
        terminal::print(&render(&document))?;
    }
    Ok(Outcome::Done)
}

/// The unit that a parameter is shown in, and how many of them one of its own is.
pub(crate) fn shown_unit(curve: &Curve) -> (&'static str, f64) {
    let degrees = 180.0 / std::f64::consts::PI;
    match curve.flaw {
        Flaw::ClockOffset => ("ms", 1e3),
        Flaw::ExtrinsicRotation | Flaw::InitialTilt => ("°", degrees),
        Flaw::ExtrinsicTranslation => ("mm", 1e3),
        Flaw::FocalLength | Flaw::Scale | Flaw::Aspect => ("%", 1e2),
        Flaw::ClockRate => ("ppm", 1e6),
        Flaw::RollingShutter => ("ms", 1e3),
        Flaw::Distortion => ("", 1.0),
        Flaw::Drift if curve.parameter.ends_with("rad_s") => ("°/s", degrees),
        Flaw::Drift => ("mm/s", 1e3),
        _ => ("px", 1.0),
    }
}

/// The axis of a parameter of several, as its name has it.
pub(crate) fn axis(curve: &Curve) -> &'static str {
    let parts: Vec<&str> = curve.parameter.split('_').collect();
    match curve.flaw {
        Flaw::ClockOffset
        | Flaw::FocalLength
        | Flaw::Scale
        | Flaw::Aspect
        | Flaw::ClockRate
        | Flaw::RollingShutter => "",
        Flaw::Distortion => {
            ["k1", "k2", "p1", "p2"].into_iter().find(|name| parts.contains(name)).unwrap_or("")
        }
        Flaw::Drift if parts.first() == Some(&"yaw") => "yaw",
        _ => ["x", "y", "z", "u", "v"].into_iter().find(|axis| parts.contains(axis)).unwrap_or(""),
    }
}

fn render(document: &SensitivityDocument) -> String {
    let mut text = format!(
        "{}, {} with {}: {:.3} px over {} labels of {} points; flaws injected one at a time\n\n",
        printable(&document.dataset),
        printable(&document.stream),
        printable(&document.depth),
        document.rmse_px,
        document.labels.scored,
        document.labels.points
    );
    let mut grid = vec![
        ["flaw", "axis", "injected", "RMSE_2D px", "seen from", "found from"].map(String::from).to_vec(),
    ];
    for curve in &document.curves {
        let (unit, scale) = shown_unit(curve);
        let size = |value: Option<f64>| {
            value.map_or_else(|| "never".to_string(), |v| format!("{} {unit}", three_digits(v * scale)))
        };
        // The typical size stands for the curve, which the CSV and the picture have.
        let typical = curve.points.get(5).or(curve.points.last());
        grid.push(vec![
            curve.flaw.words().to_string(),
            axis(curve).to_string(),
            size(typical.map(|p| p.size)),
            typical.map_or_else(String::new, |p| format!("{:.2}", p.rmse_px)),
            size(curve.seen_from),
            size(curve.found_from),
        ]);
    }
    text.push_str(&table::align(&grid));
    text
}

/// Three digits that count.
fn three_digits(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

fn csv(document: &SensitivityDocument) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(["flaw", "parameter", "size", "rmse_px"])?;
    for curve in &document.curves {
        for point in &curve.points {
            let (size, rmse) = (point.size.to_string(), point.rmse_px.to_string());
            writer.write_record([curve.flaw.name(), &curve.parameter, &size, &rmse])?;
        }
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_at_a_glance() {
        assert_eq!([0.012345, 1.23456, 123.456].map(three_digits), ["0.0123", "1.23", "123"]);
        let curve = |flaw, parameter: &str| Curve {
            flaw,
            parameter: parameter.to_string(),
            points: vec![],
            seen_from: None,
            found_from: None,
        };
        let shown = |flaw, parameter: &str| {
            let c = curve(flaw, parameter);
            (axis(&c), shown_unit(&c).0)
        };
        assert_eq!(shown(Flaw::Drift, "yaw_drift_rad_s"), ("yaw", "°/s"));
        assert_eq!(shown(Flaw::Drift, "drift_z_m_s"), ("z", "mm/s"));
        assert_eq!(shown(Flaw::PrincipalPoint, "principal_v_px"), ("v", "px"));
        assert_eq!(shown(Flaw::ClockOffset, "offset_s"), ("", "ms"));
    }
}
