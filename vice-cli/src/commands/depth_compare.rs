//! `vice depth compare`: two sources at labelled key points, and what their difference costs in pixels.

use std::path::PathBuf;

use anyhow::Context;
use serde::Serialize;
use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource};
use vice_core::evaluate::{SelectedKeyframe, Selection};
use vice_core::frames::WorldFromCamera;
use vice_core::time::Stamp;
use vice_core::track::{lift, track};

use crate::inputs::{AnchorArgs, DatasetArgs, DepthArgs, LabelArgs, Outputs, Scene, to_json};
use crate::report::table;
use crate::terminal::{self, Outcome, printable, usage};

/// Arguments of `vice depth compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice depth compare V1_01_easy --labels floor.csv --source floor,zmap")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    labels: LabelArgs,
    /// Two or more depth sources: floor, zmap, zcam, mesh, tag.
    #[arg(long, value_name = "SOURCE,...", required = true)]
    source: Vec<String>,
    #[command(flatten)]
    depth: DepthArgs,
    #[command(flatten)]
    anchor: AnchorArgs,
    /// The comparison as JSON, vice.depth-compare/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The document `vice.depth-compare/1`.
#[derive(Serialize)]
struct Document {
    schema: &'static str,
    sources: Vec<String>,
    key_points: Vec<KeyPoint>,
}

/// A labelled pixel at its key frame.
#[derive(Serialize)]
struct KeyPoint {
    point: String,
    timestamp_ns: Stamp,
    label_px: Pixel,
    /// Metres along the optical axis by source, or why there is none.
    depths: Vec<SourceDepth>,
    /// By how many pixels the carried point moves for a millimetre of depth, at each later labelled frame.
    cost: Vec<Cost>,
}

#[derive(Serialize)]
struct SourceDepth {
    source: String,
    depth_z_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<DepthMiss>,
}

#[derive(Serialize)]
struct Cost {
    timestamp_ns: Stamp,
    px_per_mm: f64,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.json], &[args.dataset.path.clone(), args.labels.labels.clone()])?;
    let scene = Scene::open(&args.dataset, &args.depth, &args.anchor)?;
    let labels = args.labels.read(&scene.used.frames)?;
    let sources = args.depth.sources("--source", &args.source, &scene.dataset, &scene.used.name)?;
    if sources.len() < 2 {
        return Err(usage("--source: name two sources to compare, such as floor,zmap"));
    }
    let selection = Selection::new(&labels, &scene.used.frames, &scene.used.camera, &args.labels.window())
        .with_context(|| args.labels.labels.display().to_string())?;
    let key_points: Vec<KeyPoint> =
        selection.keyframes().map(|k| key_point(&scene, &sources, &k)).collect::<anyhow::Result<_>>()?;
    let sources = sources.iter().map(|s| s.name().to_string()).collect();
    let document = Document { schema: "vice.depth-compare/1", sources, key_points };
    let json = args.json.as_ref().map(|path| anyhow::Ok((path, to_json(&document)?)));
    if !outputs.write(&json.into_iter().collect::<anyhow::Result<Vec<_>>>()?)? {
        terminal::print(&render(&document))?;
    }
    Ok(Outcome::Done)
}

fn key_point(
    scene: &Scene,
    sources: &[Box<dyn DepthSource>],
    selected: &SelectedKeyframe<'_>,
) -> anyhow::Result<KeyPoint> {
    let keyframe = scene.keyframe(selected.frame)?;
    let px = selected.keyframe.px;
    let mut depths = Vec::new();
    for source in sources {
        let answer: Result<DepthSample, DepthMiss> =
            source.depths(&keyframe, &[px])?.into_iter().next().context("a source answers each pixel")?;
        depths.push(SourceDepth {
            source: source.name().to_string(),
            depth_z_m: answer.ok().map(|d| d.z_m),
            reason: answer.err(),
        });
    }
    let mut cost = Vec::new();
    if let (Some(z_m), Some(at_keyframe)) =
        (depths.iter().find_map(|d| d.depth_z_m), keyframe.world_from_camera)
    {
        for (later, index) in selected.samples() {
            let Some(now) = scene.keyframe(index)?.world_from_camera else { continue };
            if let Some(px_per_mm) = px_per_mm(scene, px, z_m, &at_keyframe, &now) {
                cost.push(Cost { timestamp_ns: later.stamp, px_per_mm });
            }
        }
    }
    Ok(KeyPoint {
        point: selected.point.to_string(),
        timestamp_ns: keyframe.stamp,
        label_px: px,
        depths,
        cost,
    })
}

/// How far the carried point moves for a millimetre of depth, by a central difference.
fn px_per_mm(
    scene: &Scene,
    px: Pixel,
    z_m: f64,
    at_keyframe: &WorldFromCamera,
    now: &WorldFromCamera,
) -> Option<f64> {
    const STEP_M: f64 = 0.0005;
    let camera = &scene.used.camera;
    let carried = |z_m: f64| track(camera, at_keyframe, now, &lift(camera, px, z_m).ok()?).ok();
    Some(carried(z_m - STEP_M)?.distance_px(carried(z_m + STEP_M)?))
}

fn render(document: &Document) -> String {
    let mut head = vec!["point".to_string(), "key frame ns".to_string()];
    head.extend(document.sources.iter().map(|s| format!("{s} m")));
    head.extend(document.sources[1..].iter().map(|s| format!("{s} - {} mm", document.sources[0])));
    head.extend(["px/mm mean", "px/mm max"].map(String::from));
    let mut grid = vec![head];
    let mut summary = String::new();
    for k in &document.key_points {
        let mut row = vec![printable(&k.point), k.timestamp_ns.to_string()];
        row.extend(k.depths.iter().map(|d| match (d.depth_z_m, &d.reason) {
            (Some(z), _) => format!("{z:.4}"),
            (None, Some(reason)) => reason.to_string(),
            (None, None) => "-".to_string(),
        }));
        row.extend((1..document.sources.len()).map(|i| dash(difference_mm(k, i), 1)));
        row.push(dash(mean(k.cost.iter().map(|c| c.px_per_mm)), 4));
        row.push(dash(k.cost.iter().map(|c| c.px_per_mm).reduce(f64::max), 4));
        grid.push(row);
    }
    let all_costs = mean(document.key_points.iter().flat_map(|k| &k.cost).map(|c| c.px_per_mm));
    for (i, source) in document.sources.iter().enumerate().skip(1) {
        let mut sizes: Vec<f64> =
            document.key_points.iter().filter_map(|k| difference_mm(k, i)).map(f64::abs).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let answered = sizes.len();
        let Some((median, largest)) = median_of(&sizes).zip(sizes.last()) else {
            summary.push_str(&format!("{source} and {} answer no key point together\n", document.sources[0]));
            continue;
        };
        summary.push_str(&format!(
            "|{source} - {}|: median {median:.1} mm, largest {largest:.1} mm over {answered} of {} key points",
            document.sources[0],
            document.key_points.len()
        ));
        if let Some(cost) = all_costs {
            summary.push_str(&format!(
                "; at {cost:.4} px a millimetre on average the median costs {:.2} px",
                median * cost
            ));
        }
        summary.push('\n');
    }
    format!("{}\n{summary}", table::align(&grid))
}

/// The median of sorted values.
fn median_of(sorted: &[f64]) -> Option<f64> {
    let (low, high) = (sorted.get(sorted.len().checked_sub(1)? / 2)?, sorted.get(sorted.len() / 2)?);
    Some(0.5 * (low + high))
}

fn difference_mm(k: &KeyPoint, source: usize) -> Option<f64> {
    Some((k.depths[source].depth_z_m? - k.depths[0].depth_z_m?) * 1000.0)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_u64), |(s, n), v| (s + v, n + 1));
    (count > 0).then(|| sum / count as f64)
}

fn dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_string(), |v| format!("{v:.decimals$}"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_median_of_an_even_count_is_between_its_middle_two() {
        let median = |v: &[f64]| super::median_of(v);
        assert_eq!((median(&[]), median(&[3.0]), median(&[1.0, 2.0])), (None, Some(3.0), Some(1.5)));
        assert_eq!(median(&[7.4, 9.8, 11.5, 12.1, 13.5, 28.9, 34.3, 73.4]), Some(12.8));
    }
}
