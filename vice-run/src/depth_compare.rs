//! Two or more depth sources at labelled key points, and what their difference costs in pixels.

use serde::Serialize;
use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource};
use vice_core::evaluate::{SelectedKeyframe, Selection};
use vice_core::frames::WorldFromCamera;
use vice_core::statistics::{quantile, sorted};
use vice_core::suspicion::Suspicions;
use vice_core::time::Stamp;
use vice_core::track::{lift, track};
use vice_files::address;

use crate::error::{Context, RunError, RunResult};
use crate::report::table;
use crate::request::Request;
use crate::scene::Scene;
use crate::text::printable;

/// The document `vice.depth-compare/1`.
#[derive(Serialize)]
pub struct DepthComparison {
    /// The schema's name and version.
    pub schema: &'static str,
    /// Names of the sources.
    pub sources: Vec<String>,
    /// What looks wrong in the data.
    #[serde(skip_serializing_if = "Suspicions::is_empty")]
    pub suspicions: Suspicions,
    /// The labelled key points.
    pub key_points: Vec<KeyPoint>,
}

/// A labelled pixel at its key frame.
#[derive(Serialize)]
pub struct KeyPoint {
    /// Name of the point.
    pub point: String,
    /// The frame.
    pub timestamp_ns: Stamp,
    /// The labelled pixel.
    pub label_px: Pixel,
    /// Metres along the optical axis by source, or why there is none.
    pub depths: Vec<SourceDepth>,
    /// By how many pixels the carried point moves for a millimetre of depth, at each later labelled frame.
    pub cost: Vec<Cost>,
}

/// The depth of one source, or why there is none.
#[derive(Serialize)]
pub struct SourceDepth {
    /// Name of the source.
    pub source: String,
    /// Metres along the optical axis.
    pub depth_z_m: Option<f64>,
    /// Why there is no depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<DepthMiss>,
}

/// What a millimetre of depth costs at a later frame.
#[derive(Serialize)]
pub struct Cost {
    /// The frame.
    pub timestamp_ns: Stamp,
    /// Pixels for a millimetre.
    pub px_per_mm: f64,
}

/// Compares the depth sources of a request at its labelled key points; the reference places the camera.
///
/// # Errors
/// [`RunError`] if fewer than two sources are named, or something cannot be read.
pub fn compare_depths(request: &Request) -> RunResult<DepthComparison> {
    request.check()?;
    request.depth.check_of_frames()?;
    if request.depth.names().len() < 2 {
        return Err(RunError::usage("depth", "name two sources to compare, such as floor,zmap"));
    }
    let scene = Scene::open(&request.dataset, &request.streams.reference, request.streams.max_gap)?;
    let opened = &scene.opened;
    let (labels, mut suspicions) = request.labels(opened, &crate::progress::silent)?;
    let sources = request.depth.make_all(opened)?;
    let selection = Selection::new(&labels, &opened.frames, &opened.camera, &request.window())
        .context(|| address::shown_path(&request.labels.file).display().to_string())?;
    let key_points: Vec<KeyPoint> =
        selection.keyframes().map(|k| key_point(&scene, &sources, &k)).collect::<RunResult<_>>()?;
    suspicions.extend(opened.dataset.suspicions().into_iter().chain(opened.suspicions()));
    suspicions.extend(sources.iter().flat_map(|source| source.suspicions()));
    let sources = sources.iter().map(|s| s.name().to_string()).collect();
    Ok(DepthComparison { schema: "vice.depth-compare/1", sources, key_points, suspicions })
}

fn key_point(
    scene: &Scene,
    sources: &[Box<dyn DepthSource>],
    selected: &SelectedKeyframe<'_>,
) -> RunResult<KeyPoint> {
    let keyframe = scene.keyframe(selected.frame)?;
    let px = selected.keyframe.px;
    let mut depths = Vec::new();
    for source in sources {
        let answer: Result<DepthSample, DepthMiss> = source
            .depths(&keyframe, &[px])?
            .into_iter()
            .next()
            .ok_or_else(|| RunError::missing(format!("{} answered no pixel", source.name())))?;
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
    let camera = &scene.opened.camera;
    let carried = |z_m: f64| track(camera, at_keyframe, now, &lift(camera, px, z_m).ok()?).ok();
    Some(carried(z_m - STEP_M)?.distance_px(carried(z_m + STEP_M)?))
}

/// The comparison as a table.
pub fn render(document: &DepthComparison) -> String {
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
        let sizes =
            sorted(document.key_points.iter().filter_map(|k| difference_mm(k, i)).map(f64::abs).collect());
        let answered = sizes.len();
        let Some((median, largest)) = quantile(&sizes, 0.5).zip(sizes.last()) else {
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
