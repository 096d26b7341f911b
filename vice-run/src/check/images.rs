//! The checks that need pictures: a sample is decoded, several at a time, and looked at in order.

use nalgebra::Vector3;
use rayon::prelude::*;
use vice_core::check::pictures::{DEPTH, Registration, Seen, depths, images, registration};
use vice_core::check::{Finding, State, short};
use vice_core::dataset::{Dataset, Floor, Plane, depth_unit_doubt};
use vice_core::frames::World;
use vice_core::time::Span;
use vice_depth::{FloorFit, FloorFitOptions, fit_floor_to_cloud, fit_floor_to_depth_image};

use super::cloud::{self, Scan, World3d};

/// Places of the recording that are looked at; at each two neighbouring frames.
const PLACES: usize = 12;
/// Frames that follow each other within this are neighbours.
const NEIGHBOURS: Span = Span::from_millis(210);
/// Floors fitted to depth, at most.
const FLOORS: usize = 5;
/// A floor is off by more than this: metres, and degrees.
const FLOOR_M: f64 = 0.05;
const FLOOR_DEG: f64 = 3.0;
/// A fitted plane with less of the points is none to compare with.
const FLOOR_SHARE: f64 = 0.1;

/// Findings about the pictures of a camera.
pub(super) fn look(
    dataset: &dyn Dataset,
    camera: &str,
    world: &World3d<'_>,
    scan: Option<&Scan>,
) -> Vec<Finding> {
    let Ok(frames) = dataset.frames(camera) else { return Vec::new() };
    if frames.len() < 2 {
        return vec![Finding::new("images", camera, State::Unknown, "there are no two frames to compare")];
    }
    let count = PLACES.min(frames.len() / 2);
    let places: Vec<usize> = (0..count).map(|k| (2 * k + 1) * (frames.len() - 1) / (2 * count)).collect();
    let calibrated = dataset.camera(camera).ok();
    let has_depth = dataset.has_depth(camera);
    // What lies far apart is no neighbour: it may be lit otherwise, and show another place.
    let near = |i: usize| frames[i + 1].since(frames[i]) <= NEIGHBOURS;
    let looked: Vec<Looked> =
        places.par_iter().map(|i| Looked::at(dataset, camera, *i, near(*i), has_depth)).collect();
    let pairs: Vec<[Option<Seen>; 2]> = looked.iter().map(|l| l.seen).collect();
    let mut found = images(camera, &pairs, calibrated.as_ref().map(|c| (c.width(), c.height())));
    let error = looked.iter().find_map(|l| l.error.as_ref());
    if let (Some(error), true) = (error, pairs.iter().flatten().all(Option::is_none)) {
        return vec![Finding::new("images", camera, State::Unknown, format!("none can be decoded: {error}"))];
    }
    if let Some(error) = error {
        found.push(Finding::new("images", camera, State::Look, format!("some cannot be decoded: {error}")));
    }
    if has_depth {
        let valid: Vec<f64> = looked.iter().filter_map(|l| l.valid).collect();
        let edges: Vec<Registration> = looked.iter().filter_map(|l| l.registration).collect();
        found.extend(depths(camera, &valid, &edges));
        if let Some(doubt) = looked.iter().find_map(|l| l.unit.clone()) {
            let says = format!("{}: {}", doubt.message, doubt.evidence);
            found.push(Finding::new(DEPTH.name, camera, State::Wrong, says).mend(doubt.advice));
        }
        found.extend(floor_by_depth(dataset, camera, &places, world));
        found.extend(scan.and_then(|scan| cloud::against_depth(dataset, camera, &places, world, scan)));
    }
    // The cloud is the same for all cameras.
    if dataset.cameras().first().is_none_or(|first| first == camera) {
        found.extend(scan.and_then(|scan| floor_by_cloud(dataset, camera, scan)));
    }
    found
}

/// What is kept of two neighbouring frames.
#[derive(Default)]
struct Looked {
    seen: [Option<Seen>; 2],
    valid: Option<f64>,
    registration: Option<Registration>,
    unit: Option<vice_core::suspicion::Suspicion>,
    error: Option<String>,
}

impl Looked {
    fn at(dataset: &dyn Dataset, camera: &str, frame: usize, near: bool, has_depth: bool) -> Self {
        let mut looked = Self::default();
        for (k, index) in [frame, frame + 1].into_iter().take(1 + usize::from(near)).enumerate() {
            match dataset.image(camera, index) {
                Ok(image) => {
                    looked.seen[k] = Some(Seen::of(index, &image));
                    if k == 0 && has_depth {
                        looked.depth(dataset, camera, index, &image);
                    }
                }
                Err(error) => looked.error = Some(error.to_string()),
            }
        }
        looked
    }

    fn depth(
        &mut self,
        dataset: &dyn Dataset,
        camera: &str,
        index: usize,
        image: &vice_core::dataset::Image,
    ) {
        match dataset.depth_image(camera, index) {
            Ok(Some(depth)) => {
                let valid = depth.z_m().iter().filter(|z| z.is_finite()).count();
                self.valid = Some(valid as f64 / depth.z_m().len().max(1) as f64);
                self.registration = registration(image, &depth);
                self.unit = depth_unit_doubt(&depth);
            }
            Ok(None) => {}
            Err(error) => self.error = Some(error.to_string()),
        }
    }
}

/// The floor that the data set gives, where it is a plane of the world.
fn world_floor(dataset: &dyn Dataset, camera: &str) -> Option<Plane<World>> {
    let first = *dataset.frames(camera).ok()?.first()?;
    match dataset.floor(first).ok()? {
        Floor::World(plane) => Some(plane),
        _ => None,
    }
}

fn floor_by_depth(
    dataset: &dyn Dataset,
    camera: &str,
    places: &[usize],
    world: &World3d<'_>,
) -> Option<Finding> {
    let (anchor, floor) = (world.anchor?, world_floor(dataset, camera)?);
    let (model, frames) = (dataset.camera(camera).ok()?, dataset.frames(camera).ok()?);
    let fits: Vec<FloorFit> = places
        .iter()
        .filter_map(|frame| {
            let stamp = frames[*frame];
            let pose = anchor.pose_at(stamp, world.max_gap).ok()?;
            let world_from_camera = pose * dataset.body_from_camera(camera, stamp).ok()?;
            let depth = dataset.depth_image(camera, *frame).ok()??;
            let options = FloorFitOptions::default();
            fit_floor_to_depth_image(&depth, &model, &world_from_camera, Vector3::z_axis(), &options).ok()
        })
        .filter(|fit| fit.inliers as f64 > FLOOR_SHARE * fit.points as f64)
        .take(FLOORS)
        .collect();
    // One image may show a table; several that agree show the floor.
    let mut sorted = fits;
    sorted.sort_by(|a, b| height(&a.plane).total_cmp(&height(&b.plane)));
    let (least, most) = (sorted.first()?, sorted.last()?);
    if sorted.len() < 2 || height(&most.plane) - height(&least.plane) > FLOOR_M {
        let says = "level planes in the depth images do not agree: nothing can be said of the floor";
        return Some(Finding::new(DEPTH.name, camera, State::Unknown, says));
    }
    Some(compared(camera, "depth images", &floor, &sorted[sorted.len() / 2], "vice floor fit --at"))
}

fn floor_by_cloud(dataset: &dyn Dataset, camera: &str, scan: &Scan) -> Option<Finding> {
    let floor = world_floor(dataset, camera)?;
    let options = FloorFitOptions::default();
    let fit = |up| fit_floor_to_cloud(&scan.cloud, &scan.reference.world_from_cloud, up, &options);
    match fit(Vector3::z_axis()) {
        Ok(fit) if fit.inliers as f64 > 0.02 * fit.points as f64 => {
            Some(compared(camera, "cloud", &floor, &fit, "vice floor fit"))
        }
        Ok(_) => Some(Finding::new(DEPTH.name, camera, State::Unknown, "the cloud shows no floor")),
        Err(error) => {
            // A floor about another axis: that one is up.
            let others = [
                (Vector3::y_axis(), "y"),
                (-Vector3::y_axis(), "-y"),
                (Vector3::x_axis(), "x"),
                (-Vector3::x_axis(), "-x"),
                (-Vector3::z_axis(), "-z"),
            ];
            let share = |fit: &FloorFit| fit.inliers as f64 / fit.points.max(1) as f64;
            let floors = others.into_iter().filter_map(|(up, word)| Some((fit(up).ok()?, word)));
            let best = floors.max_by(|a, b| share(&a.0).total_cmp(&share(&b.0)));
            let says = match best.filter(|(fit, _)| share(fit) > FLOOR_SHARE) {
                Some((fit, word)) => format!(
                    "no floor of the cloud is level about z, and {:.0} % of its points lie on one whose up is {word}: its world is not z up",
                    100.0 * share(&fit)
                ),
                None => format!("no level floor is found in the cloud: {error}"),
            };
            Some(Finding::new(DEPTH.name, camera, State::Look, says).mend(
                "turn the cloud and the poses into a world whose z points up (`estimate-as` y-up for poses), or give the floor with `floor-plane`",
            ))
        }
    }
}

/// Height of a plane over the origin, metres.
fn height(plane: &Plane<World>) -> f64 {
    -plane.d_m() / plane.normal().z
}

fn compared(camera: &str, what: &str, floor: &Plane<World>, fit: &FloorFit, mend: &str) -> Finding {
    let off = height(&fit.plane) - height(floor);
    let tilt = fit.plane.normal().angle(&floor.normal()).to_degrees();
    let tilt = tilt.min(180.0 - tilt);
    let state = if off.abs() > FLOOR_M || tilt > FLOOR_DEG { State::Look } else { State::Ok };
    let says = match state {
        State::Ok => {
            format!("the floor is that of the {what}, within {} mm", short((1e3 * off.abs()).ceil()))
        }
        _ => format!("the floor of the {what} is {off:+.3} m and {tilt:.1} degrees off the one in use"),
    };
    let finding = Finding::new(DEPTH.name, camera, state, says)
        .number("height-off", off, "m")
        .number("tilt", tilt, "degrees")
        .number("share-of-points", fit.inliers as f64 / fit.points as f64, "");
    if state == State::Ok { finding } else { finding.mend(format!("`floor-plane`, as `{mend}` prints it")) }
}
