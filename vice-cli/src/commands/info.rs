//! `vice info`.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;
use std::path::Path;

use vice_core::dataset::{Dataset, Floor, Probe};
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};

use crate::formats;
use crate::inputs::DatasetArgs;
use crate::terminal::{self, Outcome, printable};

/// Arguments of `vice info`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice info V1_01_easy")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let path = &args.dataset.path;
    let registry = formats::registry(&args.dataset.plugins)?;
    if args.dataset.format.is_none()
        && let (factory, Probe::Collection(runs)) = registry.detect(path)?
    {
        return list(&factory.info().name, path, &runs);
    }
    let dataset = args.dataset.open_in(&registry)?;
    if args.dataset.camera.is_some() {
        args.dataset.camera_name(dataset.as_ref())?;
    }
    terminal::print(&describe(dataset.as_ref(), args.dataset.camera.as_deref())?)?;
    Ok(Outcome::Done)
}

fn list(format: &str, path: &Path, runs: &[std::path::PathBuf]) -> anyhow::Result<Outcome> {
    let mut text = format!("{}: {} {format} data sets\n", path.display(), runs.len());
    for run in runs {
        writeln!(text, "  {}", printable(&run.display().to_string()))?;
    }
    terminal::print(&text)?;
    Ok(Outcome::Done)
}

fn describe(dataset: &dyn Dataset, camera: Option<&str>) -> anyhow::Result<String> {
    let mut text = String::new();
    writeln!(text, "{} ({})", printable(dataset.name()), printable(dataset.format()))?;
    writeln!(text, "cameras")?;
    let mut first_frame = None;
    // A camera that is asked for may be one of several that none of is listed.
    let cameras = camera.map_or_else(|| dataset.cameras(), |name| vec![name.to_string()]);
    for name in &cameras {
        first_frame = first_frame.or(describe_camera(&mut text, dataset, name)?);
    }
    describe_streams(&mut text, dataset)?;
    match dataset.imu() {
        Ok(imu) => {
            if let (Some(first), Some(last)) = (imu.first(), imu.last()) {
                writeln!(text, "imu")?;
                writeln!(text, "  {}", stretch(imu.len(), first.stamp, last.stamp))?;
            }
        }
        Err(error) => writeln!(text, "imu\n  cannot be read: {}", printable(&error.to_string()))?,
    }
    if let Some(cloud) = dataset.cloud()? {
        writeln!(text, "point cloud")?;
        match &cloud.source {
            vice_core::dataset::CloudSource::Ply(path) => writeln!(text, "  {}", path.display())?,
            vice_core::dataset::CloudSource::Points(points) => writeln!(text, "  {} points", points.len())?,
            _ => {}
        }
    }
    if let Some(Ok(floor)) = first_frame.map(|stamp| dataset.floor(stamp)) {
        writeln!(text, "floor")?;
        let (frame, n, d) = match floor {
            Floor::World(plane) => ("world", plane.normal(), plane.d_m()),
            Floor::Body(plane) => ("body at the key frame", plane.normal(), plane.d_m()),
            _ => return Ok(text),
        };
        writeln!(text, "  {:.4} x + {:.4} y + {:.4} z + {d:.4} m = 0 in the {frame}", n.x, n.y, n.z)?;
    }
    let mut sections: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut known: HashSet<String> = HashSet::new();
    for fact in dataset.facts() {
        known.insert(fact.text.clone());
        sections.entry(fact.section).or_default().push(fact.text);
    }
    for (section, lines) in sections {
        writeln!(text, "{}", printable(&section))?;
        for line in lines {
            writeln!(text, "  {}", printable(&line))?;
        }
    }
    // What stands among the facts already is not said twice.
    let said: Vec<String> = dataset.suspicions().iter().map(Suspicion::line).collect();
    let mut new = said.iter().filter(|line| !known.contains(*line)).peekable();
    if new.peek().is_some() {
        writeln!(text, "suspicions")?;
    }
    for line in new {
        writeln!(text, "  {}", printable(line))?;
    }
    Ok(text)
}

fn describe_camera(text: &mut String, dataset: &dyn Dataset, name: &str) -> anyhow::Result<Option<Stamp>> {
    let shown = printable(name);
    match dataset.camera(name) {
        Ok(camera) => {
            let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
            let model = camera.model();
            writeln!(text, "  {shown}: {}x{}, {}", camera.width(), camera.height(), model.name())?;
            writeln!(text, "    fx {fx} fy {fy} cx {cx} cy {cy}, distortion {:?}", model.coefficients())?;
        }
        Err(error) => writeln!(text, "  {shown}: no usable calibration: {}", printable(&error.to_string()))?,
    }
    let frames = dataset.frames(name)?;
    let (Some(first), Some(last)) = (frames.first(), frames.last()) else {
        writeln!(text, "    no frames")?;
        return Ok(None);
    };
    writeln!(text, "    frames: {}", stretch(frames.len(), *first, *last))?;
    match dataset.body_from_camera(name, *first) {
        Ok(pose) => {
            let (t, q) = (pose.translation(), pose.rotation());
            writeln!(
                text,
                "    body_from_camera at the first frame: t [{:.4}, {:.4}, {:.4}] m, q wxyz [{:.5}, {:.5}, {:.5}, {:.5}]",
                t.x, t.y, t.z, q.w, q.i, q.j, q.k
            )?;
        }
        Err(error) => writeln!(text, "    body_from_camera unknown: {}", printable(&error.to_string()))?,
    }
    if dataset.has_depth(name) {
        writeln!(text, "    depth images: yes")?;
    }
    Ok(Some(*first))
}

fn describe_streams(text: &mut String, dataset: &dyn Dataset) -> anyhow::Result<()> {
    writeln!(text, "pose streams")?;
    for name in dataset.streams() {
        let shown = printable(&name);
        match dataset.trajectory(&name) {
            Ok(t) => {
                let extent = stretch(t.len(), t.start(), t.end());
                writeln!(text, "  {shown}: {extent}, path {:.2} m", t.path_length_m())?;
            }
            Err(error) => writeln!(text, "  {shown}: cannot be read: {}", printable(&error.to_string()))?,
        }
    }
    if dataset.streams().is_empty() {
        writeln!(text, "  none")?;
    }
    Ok(())
}

/// Count, rate and range of stamps.
fn stretch(count: usize, first: Stamp, last: Stamp) -> String {
    let length: Span = last.since(first);
    let rate = match length.as_secs_f64() {
        s if s > 0.0 && count > 1 => format!(", {:.1} Hz on average", (count - 1) as f64 / s),
        _ => String::new(),
    };
    format!("{count}{rate}, {first} to {last} ns ({:.2} s)", length.as_secs_f64())
}
