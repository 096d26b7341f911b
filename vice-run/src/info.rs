//! What a data set holds, in words.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;

use vice_core::dataset::{Dataset, Floor, Plane};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::{Span, Stamp};

use crate::error::RunResult;
use crate::text::printable;

/// What a data set holds, or one of its cameras.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if what it lists cannot be read.
pub fn describe(dataset: &dyn Dataset, camera: Option<&str>) -> RunResult<String> {
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
            vice_core::dataset::CloudSource::File(path) => writeln!(text, "  {}", path.display())?,
            vice_core::dataset::CloudSource::Points(points) => writeln!(text, "  {} points", points.len())?,
            _ => {}
        }
    }
    if let Some(Ok(floor)) = first_frame.map(|stamp| dataset.floor(stamp)) {
        writeln!(text, "floor")?;
        writeln!(text, "  {}", floor_line(&floor, dataset.streams().is_empty()))?;
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
    describe_suspicions(&mut text, dataset, &known)?;
    Ok(text)
}

/// The floor in words. That z is 0 on it is nothing that is known where no poses say what the world is.
fn floor_line(floor: &Floor, no_poses: bool) -> String {
    let (frame, n, d) = match floor {
        Floor::World(plane) if no_poses && *plane == Plane::z_zero() => {
            return "not known: no poses say where the world is".to_string();
        }
        Floor::World(plane) => ("world", plane.normal(), plane.d_m()),
        Floor::Body(plane) => ("body at the key frame", plane.normal(), plane.d_m()),
        _ => return "not known: give --floor-plane, which `vice floor fit` finds".to_string(),
    };
    format!("{:.4} x + {:.4} y + {:.4} z + {d:.4} m = 0 in the {frame}", n.x, n.y, n.z)
}

fn describe_camera(text: &mut String, dataset: &dyn Dataset, name: &str) -> RunResult<Option<Stamp>> {
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

fn describe_streams(text: &mut String, dataset: &dyn Dataset) -> RunResult<()> {
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

/// What looked wrong while all this was read; what stands among the facts already is not said twice.
fn describe_suspicions(text: &mut String, dataset: &dyn Dataset, known: &HashSet<String>) -> RunResult<()> {
    let suspicions: Suspicions = dataset.suspicions().into_iter().collect();
    let mut new = suspicions.iter().map(Suspicion::line).filter(|line| !known.contains(line)).peekable();
    if new.peek().is_some() {
        writeln!(text, "suspicions")?;
    }
    for line in new {
        writeln!(text, "  {}", printable(&line))?;
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
