//! `vice demo`: a flight, three estimates, and what VICE sees of them.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use vice_core::dataset::{Dataset, GROUND_TRUTH, OpenOptions};
use vice_core::depth::DepthSource;
use vice_core::diagnose::{Diagnosis, Flaw, Options, diagnose};
use vice_core::evaluate::{Evaluation, Selection, Stream, Window, evaluate};
use vice_core::metrics::align::Alignment;
use vice_core::result::{PixelPart, ResultDocument, Role, Settings};
use vice_core::time::{Span, Stamp};
use vice_depth::{CloudOptions, FloorDepth, ZMapDepth, ZMapOptions, load_cloud};
use vice_files::image_file::encode_png;
use vice_synthetic::{Synthetic, SyntheticOptions, write_euroc};

use super::report::with_progress;
use crate::report::html::{IMAGE_BUDGET_BYTES, Run, Section, render};
use crate::report::numbers::{first_and_last, mean};
use crate::report::overlay::{Canvas, Colour, ESTIMATE_GREEN, ESTIMATE_YELLOW, LABEL_BLUE};
use crate::report::table;
use crate::terminal::{self, Outcome, Verbosity, advance};

/// The estimates that are shown, the colours of their dots, and what is wrong with them.
const ESTIMATES: [(&str, Colour); 3] =
    [("exact", [255, 255, 255]), ("drift", ESTIMATE_GREEN), ("clock-offset", ESTIMATE_YELLOW)];

/// Arguments of `vice demo`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice demo\n  vice demo --out demo_out   (keeps the flight, the result and a picture)"
)]
pub(crate) struct Args {
    /// Folder to keep the flight, the result document and a picture in; it must be empty or new.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let flight = Synthetic::new(SyntheticOptions::default())?;
    if let Some(out) = &args.out {
        let bar = verbosity.progress("rendering the flight");
        write_euroc(&flight, out, args.force, &|done, total| {
            advance(&bar, done, total);
        })?;
        bar.finish_and_clear();
    }
    let (document, verdicts) = evaluate_flight(&flight, args.out.as_deref(), verbosity)?;
    let mut text =
        "A 10 s flight through a rendered room; four points on the floor are followed.\n".to_string();
    text.push_str("Three estimates of its motion are evaluated with two sources of depth at key frames:\n\n");
    text.push_str(&table::render(&document));
    text.push('\n');
    text.push_str(&in_words(&document)?);
    text.push_str("\nWhat `vice diagnose` makes of it, from the labels alone\n");
    for line in &verdicts {
        writeln!(text, "- {line}")?;
    }
    if let Some(out) = &args.out {
        let json = out.join("result.json");
        crate::inputs::write_text(&json, &crate::inputs::to_json(&document)?)?;
        let picture = out.join("overlay.png");
        let bytes = draw(&flight, &document)?;
        vice_files::atomic::write(&picture, vice_files::atomic::Overwrite::Replace, |w| w.write_all(&bytes))?;
        // Read back what was rendered: to render it again would take as long as all the rest.
        let written = crate::formats::built_in().open(out, Some("euroc"), &OpenOptions::default())?;
        let shots = with_progress(&document, written.as_ref(), IMAGE_BUDGET_BYTES, verbosity);
        let mut run = Run::new(document, shots);
        run.more.push(Section { title: "Diagnosis".to_string(), lines: verdicts });
        crate::inputs::write_text(&out.join("report.html"), &render(&[run])?)?;
        text.push_str(&kept(out)?);
    } else {
        text.push_str("\nKeep the flight, the result and a picture with `vice demo --out demo_out`.\n");
    }
    terminal::print(&text)?;
    Ok(Outcome::Done)
}

/// Evaluates the flight and diagnoses each estimate; where it is kept, the document says where its files are.
fn evaluate_flight(
    flight: &Synthetic,
    kept: Option<&Path>,
    verbosity: Verbosity,
) -> anyhow::Result<(ResultDocument, Vec<String>)> {
    let camera_name = flight.cameras().into_iter().next().context("the flight has a camera")?;
    let camera = flight.camera(&camera_name)?;
    let frames: Arc<[Stamp]> = flight.frames(&camera_name)?;
    let labels = flight.floor_labels()?;
    let selection = Selection::new(&labels, &frames, &camera, &Window::default())?;
    let truth = flight.trajectory(GROUND_TRUTH)?;
    let mut streams =
        vec![Stream { name: GROUND_TRUTH.to_string(), role: Role::Reference, trajectory: truth }];
    for (name, _) in ESTIMATES {
        let trajectory = flight.trajectory(name)?;
        streams.push(Stream { name: name.to_string(), role: Role::Estimate, trajectory });
    }
    let cloud = flight.cloud()?.context("the flight has a cloud")?;
    let points = load_cloud(&cloud, &CloudOptions::default())?;
    let zmap = ZMapDepth::new(points, cloud.world_from_cloud, ZMapOptions::default());
    let floor = FloorDepth::new();
    let sources: [&dyn DepthSource; 2] = [&floor, &zmap];
    let max_gap = Span::from_millis(100);
    let below = |name: String| kept.map_or_else(|| name.clone(), |out| out.join(&name).display().to_string());
    let mut other = std::collections::BTreeMap::new();
    if kept.is_some() {
        let files = ESTIMATES.map(|(name, _)| below(format!("estimates/{name}.txt")));
        other.insert("estimate".to_string(), files.join(","));
    }
    let settings = Settings {
        dataset: kept.map(|out| out.display().to_string()),
        labels: below("labels/floor.csv".to_string()),
        points: labels.points().iter().map(|p| p.name.clone()).collect(),
        max_gap_s: max_gap.as_secs_f64(),
        align: Alignment::Se3.name().to_string(),
        anchor: GROUND_TRUTH.to_string(),
        zmap_occlusion: true,
        estimate_frame: "body".to_string(),
        other,
        ..Settings::default()
    };
    let evaluation = Evaluation {
        dataset: flight,
        camera_name: &camera_name,
        camera: &camera,
        body_from_camera: None,
        frames: &frames,
        selection: &selection,
        streams: &streams,
        anchor: 0,
        depths: &sources,
        floor: None,
        max_gap,
        subsets: None,
        align: Alignment::Se3,
        keep_samples: true,
        settings,
    };
    let document = evaluate(&evaluation, &|_, _| {})?;
    let verdicts = diagnose_estimates(&evaluation, verbosity)?;
    Ok((document, verdicts))
}

/// The verdict on each estimate, with the first source of depth.
fn diagnose_estimates(evaluation: &Evaluation<'_>, verbosity: Verbosity) -> anyhow::Result<Vec<String>> {
    let mut verdicts = Vec::new();
    for (stream, estimate) in evaluation.streams.iter().enumerate().filter(|(_, s)| s.role == Role::Estimate)
    {
        let options = Options::default();
        let diagnosis =
            Diagnosis { evaluation, stream, depth: 0, inertial: None, flaws: &Flaw::ALL, options };
        let bar = verbosity.progress("diagnosing");
        let diagnosed = diagnose(&diagnosis, &|done, total| {
            advance(&bar, done, total);
        })?;
        bar.finish_and_clear();
        let verdict = &diagnosed.document.verdict;
        let mut line = format!("{}: {}", estimate.name, verdict.sentence);
        if let Some(correction) = verdict.corrections.first() {
            line.push_str(&format!(" ({correction})"));
        }
        verdicts.push(line);
    }
    Ok(verdicts)
}

/// What the table shows, with its own numbers.
fn in_words(document: &ResultDocument) -> anyhow::Result<String> {
    let px = |stream: &str, depth: &str| -> anyhow::Result<f64> {
        part(document, stream, depth)?.pooled_rmse_px.with_context(|| format!("{stream} was not scored"))
    };
    let (exact, drift, clock) = (px("exact", "floor")?, px("drift", "floor")?, px("clock-offset", "floor")?);
    let (drift_start, drift_end) =
        first_and_last(part(document, "drift", "floor")?).context("no sample was scored")?;
    let (clock_slow, clock_fast) = quiet_and_fast(part(document, "clock-offset", "floor")?)?;
    let zmap = px("exact", "zmap")?;
    let mut text = String::from("What this shows\n");
    writeln!(
        text,
        "- exact: the dots stay on their points ({exact:.4} px). Nothing is wrong, and VICE sees nothing wrong."
    )?;
    writeln!(
        text,
        "- drift: {drift:.1} px. The error grows with the time since the key frame: {drift_start:.1} px in the first fifth of each segment, {drift_end:.1} px in the last."
    )?;
    writeln!(
        text,
        "- clock-offset: {clock:.1} px from a clock that is 50 ms off. It comes and goes with the motion of the camera: the worst fifth of the samples averages {clock_fast:.1} px, the best {clock_slow:.1} px."
    )?;
    let agree = if (zmap - exact).abs() < 0.5 { "agree" } else { "do not agree" };
    writeln!(
        text,
        "- depth: the floor plane and the Z-map of the scanned room {agree}: with the Z-map the exact poses give {zmap:.4} px."
    )?;
    Ok(text)
}

fn part<'a>(document: &'a ResultDocument, stream: &str, depth: &str) -> anyhow::Result<&'a PixelPart> {
    let mut parts = document.pixel.iter().filter(|p| p.role == Role::Estimate);
    parts
        .find(|p| p.stream == stream && p.depth == depth)
        .with_context(|| format!("no result for {stream} with {depth}"))
}

/// Mean errors of the best and of the worst fifth of the samples.
fn quiet_and_fast(part: &PixelPart) -> anyhow::Result<(f64, f64)> {
    let mut errors: Vec<f64> = part.samples.iter().map(|s| s.error_px).collect();
    errors.sort_by(f64::total_cmp);
    let fifth = errors.len().div_ceil(5);
    let both = mean(&errors[..fifth]).zip(mean(&errors[errors.len() - fifth..]));
    both.context("no sample was scored")
}

/// The frame in which the drifting estimate is furthest off, with labels and estimates on it.
fn draw(flight: &Synthetic, document: &ResultDocument) -> anyhow::Result<Vec<u8>> {
    let shown = part(document, "drift", "floor")?;
    let mut by_frame: std::collections::BTreeMap<Stamp, (usize, f64)> = std::collections::BTreeMap::new();
    for sample in &shown.samples {
        let entry = by_frame.entry(sample.timestamp_ns).or_default();
        *entry = (entry.0 + 1, entry.1 + sample.error_px);
    }
    // As many points as can be, then as far off as can be.
    let best = by_frame.iter().max_by(|a, b| (a.1.0.cmp(&b.1.0)).then(a.1.1.total_cmp(&b.1.1)));
    let stamp = *best.context("no sample was scored")?.0;
    let camera_name = &document.dataset.camera;
    let index = flight.frames(camera_name)?.binary_search(&stamp).ok().context("the sample is at a frame")?;
    let mut canvas = Canvas::new(&flight.image(camera_name, index)?);
    for (name, colour) in ESTIMATES.iter().rev() {
        for sample in part(document, name, "floor")?.samples.iter().filter(|s| s.timestamp_ns == stamp) {
            if *name == "exact" {
                canvas.ring(sample.label_px, 9.0, LABEL_BLUE);
            } else {
                canvas.line(sample.label_px, sample.tracked_px, *colour);
            }
            canvas.dot(sample.tracked_px, 4.0, *colour);
        }
    }
    Ok(encode_png(&canvas.into_image()?)?)
}

fn kept(out: &Path) -> anyhow::Result<String> {
    let out = out.display();
    let mut text = String::new();
    writeln!(
        text,
        "\n{out} now holds the flight in the EuRoC layout, result.json, overlay.png (blue ring: the label;"
    )?;
    writeln!(
        text,
        "white: exact; green: drift; yellow: clock-offset) and report.html, to be opened in a browser. Go on with"
    )?;
    writeln!(text, "  vice info {out}")?;
    writeln!(
        text,
        "  vice evaluate {out} --labels {out}/labels/scene.csv --estimate {out}/estimates/drift.txt --depth zmap"
    )?;
    Ok(text)
}
