//! The scan against the depth camera: whether both show the same surfaces, in one unit and one frame.

use nalgebra::Point3;
use vice_core::camera::{Camera, Pixel};
use vice_core::check::pictures::DEPTH;
use vice_core::check::{Finding, State, short};
use vice_core::dataset::{CloudRef, Dataset, DepthImage};
use vice_core::error::one_line;
use vice_core::frames::{Camera as CameraFrame, Cloud as CloudFrame, Rigid, World};
use vice_core::statistics::median;
use vice_core::time::Span;
use vice_core::trajectory::Trajectory;
use vice_depth::{Cloud, CloudOptions, load_cloud};

/// Edge of a cell, pixels: of the points in it the nearest one counts, since it hides the others.
const CELL_PX: usize = 6;
/// Points that are projected into an image, at most.
const POINTS: usize = 2_000_000;
/// Images that are looked at, at most.
const IMAGES: usize = 5;
/// Fewer cells say nothing.
const FEWEST: usize = 300;
/// Depths within this share are the same.
const SAME: f64 = 0.1;
/// This share of the cells agrees where unit and frame are right.
const AGREE: f64 = 0.5;
/// Less than this share agrees where they are not.
const APART: f64 = 0.25;
/// A common factor that is off by more than this is wrong, or by this worth a look.
const WRONG: f64 = 0.2;
const LOOK: f64 = 0.04;
/// Depth that steps by more than this between neighbours is an edge, a share.
const STEP: f32 = 0.05;

/// What places cameras in the world in which scan and floor are.
pub(super) struct World3d<'a> {
    /// The reference, where there is one.
    pub(super) anchor: Option<&'a Trajectory>,
    pub(super) max_gap: Span,
}

/// A scan that was read.
pub(super) struct Scan {
    pub(super) cloud: std::sync::Arc<Cloud>,
    pub(super) reference: CloudRef,
}

/// Reads the scan, where there is one; one that cannot be read is a finding.
pub(super) fn read(dataset: &dyn Dataset, found: &mut Vec<Finding>) -> Option<Scan> {
    let scan = dataset.cloud().and_then(|reference| match reference {
        Some(reference) => {
            let cloud = load_cloud(&reference, &CloudOptions::default())?;
            Ok(Some(Scan { cloud, reference }))
        }
        None => Ok(None),
    });
    scan.unwrap_or_else(|error| {
        let says = format!("cannot be used: {}", one_line(&error));
        found.push(Finding::new("reading", "cloud", State::Look, says));
        None
    })
}

/// One depth image and where it was taken.
struct View {
    depth: DepthImage,
    world_from_camera: Rigid<World, CameraFrame>,
}

/// Depth of the images over depth of the scan, and how many of these agree with a factor.
struct Ratios(Vec<f64>);

impl Ratios {
    fn middle(&self) -> f64 {
        median(&mut self.0.clone()).unwrap_or(f64::NAN)
    }

    fn share(&self, factor: f64) -> f64 {
        self.0.iter().filter(|r| (*r / factor - 1.0).abs() < SAME).count() as f64 / self.0.len().max(1) as f64
    }

    fn enough(&self) -> bool {
        self.0.len() >= FEWEST
    }
}

/// What scan and depth images say of each other; nothing without poses or depth.
pub(super) fn against_depth(
    dataset: &dyn Dataset,
    camera: &str,
    places: &[usize],
    world: &World3d<'_>,
    scan: &Scan,
) -> Option<Finding> {
    let (model, frames, anchor) = (dataset.camera(camera).ok()?, dataset.frames(camera).ok()?, world.anchor?);
    let every = places.len().div_ceil(IMAGES).max(1);
    let views: Vec<View> = places
        .iter()
        .step_by(every)
        .filter_map(|frame| {
            let pose = anchor.pose_at(frames[*frame], world.max_gap).ok()?;
            let world_from_camera = pose * dataset.body_from_camera(camera, frames[*frame]).ok()?;
            let depth = dataset.depth_image(camera, *frame).ok()??;
            Some(View { depth, world_from_camera })
        })
        .collect();
    if views.is_empty() {
        return None;
    }
    let placed = scan.reference.world_from_cloud;
    let ratios = |world_from_cloud: &Rigid<World, CloudFrame>, unit_m: f64| {
        let each = views.iter().flat_map(|view| cells(view, &model, scan, world_from_cloud, unit_m));
        Ratios(each.collect())
    };
    let about = format!("{camera} / cloud");
    let read = ratios(&placed, 1.0);
    let (middle, share) = (read.middle(), read.share(1.0));
    let numbers = |finding: Finding| {
        finding.number("middle-ratio", middle, "").number("share-that-agrees", share, "").number(
            "places",
            read.0.len() as f64,
            "",
        )
    };
    let say = |state, says: String| numbers(Finding::new(DEPTH.name, &about, state, says));
    if read.enough() && read.share(middle) >= AGREE {
        let off = (middle - 1.0).abs();
        let says = format!("the depth images have {} times the depth of the scan", short(middle));
        return Some(match off {
            o if o > WRONG => say(State::Wrong, says).mend("the unit of the depth images, or of the scan, is not metres: convert it, or give the right one"),
            o if o > LOOK => say(State::Look, says).mend("see the scale of the depth camera, and the focal length"),
            _ => say(
                State::Ok,
                format!("scan and depth images agree at {:.0} % of the places, in the middle within {:.1} %", 100.0 * share, 100.0 * off),
            ),
        });
    }
    if read.enough() && share >= APART {
        let says = format!("scan and depth images agree at {:.0} % of the places only", 100.0 * share);
        return Some(
            say(State::Look, says).mend("see whether the scan is of this scene, and where its frame lies"),
        );
    }
    // Units and frames that people mistake.
    let turned = placed.inverse().reinterpret::<World, CloudFrame>();
    let tried: [(&str, &str, Rigid<World, CloudFrame>, f64); 5] = [
        ("the scan is in millimetres", "convert the scan to metres", placed, 1e-3),
        ("the scan is in centimetres", "convert the scan to metres", placed, 1e-2),
        ("the scan's points are a thousandth of metres", "convert the scan to metres", placed, 1e3),
        (
            "the scan's place in the world is inverted",
            "give world_from_cloud, not cloud_from_world",
            turned,
            1.0,
        ),
        (
            "the scan lies in the world already",
            "its place in the world is none: give the identity",
            Rigid::identity(),
            1.0,
        ),
    ];
    for (words, mend, world_from_cloud, unit_m) in tried {
        let then = ratios(&world_from_cloud, unit_m);
        if then.enough() && then.share(1.0) >= AGREE {
            let says = format!(
                "{words}: so read, it agrees with the depth images at {:.0} % of the places",
                100.0 * then.share(1.0)
            );
            return Some(say(State::Wrong, says).mend(mend));
        }
    }
    Some(match read.enough() {
        true => say(
            State::Look,
            format!("scan and depth images show other surfaces: they agree at {:.0} % of the places", 100.0 * share),
        )
        .mend("see whether the scan is of this scene, in which frame and unit it is, and whose poses place the camera"),
        false => say(
            State::Unknown,
            format!("the scan has {} points where the depth images look, {FEWEST} are needed", read.0.len()),
        ),
    })
}

/// The ratio of both depths at each cell that has them, away from edges.
fn cells(
    view: &View,
    camera: &Camera,
    scan: &Scan,
    world_from_cloud: &Rigid<World, CloudFrame>,
    unit_m: f64,
) -> Vec<f64> {
    let camera_from_cloud = view.world_from_camera.inverse() * *world_from_cloud;
    let (w, h) = (view.depth.width() as usize, view.depth.height() as usize);
    let (across, down) = (w.div_ceil(CELL_PX), h.div_ceil(CELL_PX));
    let mut nearest: Vec<Option<(f64, Pixel)>> = vec![None; across * down];
    let every = scan.cloud.len().div_ceil(POINTS).max(1);
    for point in scan.cloud.points().step_by(every) {
        let seen = camera_from_cloud.transform_point(&Point3::from(point.coords * unit_m));
        let Ok(px) = camera.project(&seen) else { continue };
        if px.u < 0.0 || px.v < 0.0 || px.u >= w as f64 - 1.0 || px.v >= h as f64 - 1.0 {
            continue;
        }
        let cell = &mut nearest[px.v as usize / CELL_PX * across + px.u as usize / CELL_PX];
        if cell.is_none_or(|(z, _)| seen.z < z) {
            *cell = Some((seen.z, px));
        }
    }
    let even = |px: &Pixel| {
        let (u, v) = (px.u.round() as u32, px.v.round() as u32);
        let here = view.depth.get(u, v)?;
        let near = |du: i64, dv: i64| {
            let (u, v) = (u32::try_from(i64::from(u) + du).ok()?, u32::try_from(i64::from(v) + dv).ok()?);
            view.depth.get(u, v).filter(|z| (z / here - 1.0).abs() < STEP)
        };
        let around = [(-2, 0), (2, 0), (0, -2), (0, 2)];
        around.iter().all(|(du, dv)| near(*du, *dv).is_some()).then(|| f64::from(here))
    };
    nearest.iter().flatten().filter_map(|(z, px)| Some(even(px)? / z)).collect()
}
