//! A flight, three estimates, and what VICE sees of them.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

use vice_core::dataset::{Dataset, GROUND_TRUTH, OpenOptions};
use vice_core::depth::DepthSource;
use vice_core::diagnose::{Diagnosis, Flaw, Options, diagnose};
use vice_core::evaluate::{DatasetRig, Evaluation, Selection, Stream, Window, evaluate};
use vice_core::result::{PixelPart, Role};
use vice_core::time::Stamp;
use vice_depth::{CloudOptions, FloorDepth, ZMapDepth, ZMapOptions, load_cloud};
use vice_files::atomic::{Overwrite, write};
use vice_files::image_file::encode_png;
use vice_synthetic::{Synthetic, SyntheticOptions, write_euroc};

use crate::auto_labels::TrackingSpec;
use crate::error::{RunError, RunResult};
use crate::evaluation::Samples;
use crate::progress::Progress;
use crate::report::assessment::{Assessment, Diagnosed};
use crate::report::frames::Shots;
use crate::report::html::{IMAGE_BUDGET_BYTES, Run, render};
use crate::report::numbers::{first_and_last, mean};
use crate::report::overlay::{Canvas, Colour, ESTIMATE_GREEN, ESTIMATE_YELLOW, LABEL_BLUE};
use crate::report::table;
use crate::request::DepthName;
use crate::request::{DatasetSpec, EstimateSpec, Request};
use crate::result::{ResultDocument, Used};
use crate::scene::Scene;

/// The estimates that are shown, the colours of their dots, and what is wrong with them.
const ESTIMATES: [(&str, Colour); 3] =
    [("exact", [255, 255, 255]), ("drift", ESTIMATE_GREEN), ("clock-offset", ESTIMATE_YELLOW)];

/// Points that are followed without a hand.
const AUTO_POINTS: usize = 20;

/// Makes the flight, evaluates and diagnoses its estimates, and tells what the numbers mean. With a folder the flight, the
/// result, a picture and a page are kept there; `force` writes into one that is not empty.
///
/// # Errors
/// [`RunError`] if the folder cannot be written to.
pub fn run(out: Option<&Path>, force: bool, progress: &Progress<'_>) -> RunResult<String> {
    let flight = Synthetic::new(SyntheticOptions::default())?;
    if let Some(out) = out {
        write_euroc(&flight, out, force, &|done, total| progress("rendering the flight", done, total))?;
    }
    let (document, diagnoses) = evaluate_flight(&flight, out, progress)?;
    let mut text =
        "A 10 s flight through a rendered room; four points on the floor are followed.\n".to_string();
    text.push_str("Three estimates of its motion are evaluated with two sources of depth at key frames:\n\n");
    text.push_str(&table::render(&document));
    text.push('\n');
    text.push_str(&in_words(&document)?);
    text.push_str(&without_a_hand(progress)?);
    text.push_str("\nWhat `vice diagnose` makes of it, from the labels alone\n");
    for diagnosed in &diagnoses {
        writeln!(text, "- {}", verdict_line(diagnosed))?;
    }
    if let Some(out) = out {
        keep(&flight, document, diagnoses, out, progress)?;
        text.push_str(&kept(out)?);
    } else {
        text.push_str("\nKeep the flight, the result and a picture with `vice demo --out demo_out`.\n");
    }
    Ok(text)
}

/// Writes the result, the picture and the page beside the flight.
fn keep(
    flight: &Synthetic,
    document: ResultDocument,
    diagnoses: Vec<Diagnosed>,
    out: &Path,
    progress: &Progress<'_>,
) -> RunResult<()> {
    let json = serde_json::to_string(&document)? + "\n";
    let picture = draw(flight, &document)?;
    // Read back what was rendered: to render it again would take as long as all the rest.
    let written = crate::formats::built_in().open(out, Some("euroc"), &OpenOptions::default())?;
    let opened = document.request.dataset.apply_to(Arc::from(written))?;
    let shots = Shots::of(&document, opened.dataset.as_ref(), IMAGE_BUDGET_BYTES, &|done, total| {
        progress("reading images", done, total);
    });
    let mut assessment = Assessment { diagnoses, findings: None, not_run: vec![] };
    document.request.add_checks(&mut assessment, &opened);
    let run = Run::new(document, shots, assessment);
    let page = render(&[run])?;
    for (name, bytes) in
        [("result.json", json.as_bytes()), ("overlay.png", &picture), ("report.html", page.as_bytes())]
    {
        write(out.join(name), Overwrite::Replace, |w| w.write_all(bytes))?;
    }
    Ok(())
}

/// Evaluates the flight and diagnoses each estimate; where it is kept, the document says where its files are.
fn evaluate_flight(
    flight: &Synthetic,
    kept: Option<&Path>,
    progress: &Progress<'_>,
) -> RunResult<(ResultDocument, Vec<Diagnosed>)> {
    let lacks = |what: &str| RunError::missing(format!("the flight has no {what}"));
    let camera_name = flight.cameras().into_iter().next().ok_or_else(|| lacks("camera"))?;
    let camera = flight.camera(&camera_name)?;
    let frames: Arc<[Stamp]> = flight.frames(&camera_name)?;
    let labels = flight.floor_labels()?;
    let selection = Selection::new(&labels, &frames, &camera, &Window::default())?;
    let mut streams = vec![Stream::new(GROUND_TRUTH, Role::Reference, flight.trajectory(GROUND_TRUTH)?)];
    for (name, _) in ESTIMATES {
        streams.push(Stream::new(name, Role::Estimate, flight.trajectory(name)?));
    }
    let cloud = flight.cloud()?.ok_or_else(|| lacks("cloud"))?;
    let points = load_cloud(&cloud, &CloudOptions::default())?;
    let zmap = ZMapDepth::new(points, cloud.world_from_cloud, ZMapOptions::default());
    let floor = FloorDepth::new();
    let sources: [&dyn DepthSource; 2] = [&floor, &zmap];
    let rig = DatasetRig::new(flight, &camera_name);
    let evaluation = Evaluation::builder(&rig, &camera, &frames, &selection)
        .streams(&streams)
        .depths(&sources)
        .keep_samples(true)
        .build();
    let used = Used {
        points: selection.point_names().map(str::to_string).collect(),
        anchor: GROUND_TRUTH.to_string(),
        time_offset_s: 0.0,
        align: evaluation.align.name().to_string(),
        label_noise_px: None,
        tracking: None,
    };
    let document = ResultDocument::new(request(kept), used, evaluate(&evaluation, &|_, _| {})?);
    let diagnoses = diagnose_estimates(&evaluation, progress)?;
    Ok((document, diagnoses))
}

/// The same estimates by labels that nobody placed: the first seconds of the flight in small pictures, so that it takes no
/// longer than all the rest.
fn without_a_hand(progress: &Progress<'_>) -> RunResult<String> {
    let options =
        SyntheticOptions { duration_s: 3.0, rate_hz: 10.0, width: 320, height: 240, ..Default::default() };
    let flight: Arc<dyn Dataset> = Arc::new(Synthetic::new(options)?);
    let opened = DatasetSpec::default().apply_to(flight)?;
    let spec = TrackingSpec { points: Some(AUTO_POINTS), ..TrackingSpec::default() };
    let scene = Scene::of(opened, &spec.reference, spec.max_gap)?;
    let made = spec.run_on(&scene, progress)?;
    let mut opened = scene.opened.clone();
    let labels = opened.in_memory.add_labels(made.labels.clone());
    let mut request =
        Request::new("", labels, ["exact", "drift"].map(|name| EstimateSpec::from(name.to_string())));
    request.depth.sources = vec![DepthName::ZCam];
    let document = request.evaluate(&opened, Samples::Drop, progress)?;
    let px = |stream: &str| part(&document, stream, "zcam")?.pooled_rmse_px.ok_or_else(not_scored);
    Ok(format!(
        "- labels without a hand: {AUTO_POINTS} points that were chosen and followed by themselves in the first 3 s ({} labels, half \
         as wide pictures) give exact {:.2} px and drift {:.2} px: `vice evaluate ... --labels auto`.\n",
        made.report.made,
        px("exact")?,
        px("drift")?
    ))
}

/// What asks for the same again, where the flight is kept.
fn request(kept: Option<&Path>) -> Request {
    let below = |name: String| kept.map_or_else(|| Path::new(&name).to_path_buf(), |out| out.join(&name));
    let estimates = ESTIMATES.map(|(name, _)| below(format!("estimates/{name}.txt")).display().to_string());
    let mut request = Request::new(
        kept.unwrap_or(Path::new("")),
        below("labels/floor.csv".to_string()),
        estimates.map(EstimateSpec::from),
    );
    request.depth.sources = vec![DepthName::Floor, DepthName::ZMap];
    request
}

/// The diagnosis of each estimate, with the first source of depth.
fn diagnose_estimates(evaluation: &Evaluation<'_>, progress: &Progress<'_>) -> RunResult<Vec<Diagnosed>> {
    let mut diagnoses = Vec::new();
    for (stream, estimate) in evaluation.streams.iter().enumerate().filter(|(_, s)| s.role == Role::Estimate)
    {
        let options = Options::default();
        let diagnosis =
            Diagnosis { evaluation, stream, depth: 0, inertial: None, flaws: &Flaw::ALL, options };
        let diagnosed = diagnose(&diagnosis, &|done, total| progress("diagnosing", done, total))?;
        let depth = evaluation.depths[0].name().to_string();
        diagnoses.push(Diagnosed { stream: estimate.name.clone(), depth, outcome: Ok(diagnosed.document) });
    }
    Ok(diagnoses)
}

/// A verdict and what corrects it, in a line.
fn verdict_line(diagnosed: &Diagnosed) -> String {
    match &diagnosed.outcome {
        Ok(document) => {
            let verdict = &document.verdict;
            let correction = verdict.corrections.first().map(|c| format!(" ({c})")).unwrap_or_default();
            format!("{}: {}{correction}", diagnosed.stream, verdict.sentence)
        }
        Err(why) => format!("{}: {why}", diagnosed.stream),
    }
}

/// What the table shows, with its own numbers.
fn in_words(document: &ResultDocument) -> RunResult<String> {
    let px = |stream: &str, depth: &str| -> RunResult<f64> {
        part(document, stream, depth)?
            .pooled_rmse_px
            .ok_or_else(|| RunError::missing(format!("{stream} was not scored")))
    };
    let (exact, drift, clock) = (px("exact", "floor")?, px("drift", "floor")?, px("clock-offset", "floor")?);
    let (drift_start, drift_end) =
        first_and_last(part(document, "drift", "floor")?).ok_or_else(not_scored)?;
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

fn not_scored() -> RunError {
    RunError::missing("no sample was scored")
}

fn part<'a>(document: &'a ResultDocument, stream: &str, depth: &str) -> RunResult<&'a PixelPart> {
    let mut parts = document.pixel.iter().filter(|p| p.role == Role::Estimate);
    parts
        .find(|p| p.stream == stream && p.depth == depth)
        .ok_or_else(|| RunError::missing(format!("no result for {stream} with {depth}")))
}

/// Mean errors of the best and of the worst fifth of the samples.
fn quiet_and_fast(part: &PixelPart) -> RunResult<(f64, f64)> {
    let mut errors: Vec<f64> = part.samples.iter().map(|s| s.error_px).collect();
    errors.sort_by(f64::total_cmp);
    let fifth = errors.len().div_ceil(5);
    let both = mean(&errors[..fifth]).zip(mean(&errors[errors.len() - fifth..]));
    both.ok_or_else(not_scored)
}

/// The frame in which the drifting estimate is furthest off, with labels and estimates on it.
fn draw(flight: &Synthetic, document: &ResultDocument) -> RunResult<Vec<u8>> {
    let shown = part(document, "drift", "floor")?;
    let mut by_frame: std::collections::BTreeMap<Stamp, (usize, f64)> = std::collections::BTreeMap::new();
    for sample in &shown.samples {
        let entry = by_frame.entry(sample.timestamp_ns).or_default();
        *entry = (entry.0 + 1, entry.1 + sample.error_px);
    }
    // As many points as can be, then as far off as can be.
    let best = by_frame.iter().max_by(|a, b| (a.1.0.cmp(&b.1.0)).then(a.1.1.total_cmp(&b.1.1)));
    let stamp = *best.ok_or_else(not_scored)?.0;
    let camera_name = &document.dataset.camera;
    let index = flight
        .frames(camera_name)?
        .binary_search(&stamp)
        .map_err(|_| RunError::missing(format!("no frame at {stamp} ns")))?;
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

fn kept(out: &Path) -> RunResult<String> {
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
