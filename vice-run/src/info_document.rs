//! What a data set holds, as a document for programs: `vice.info/1`.

use serde::Serialize;
use vice_core::dataset::{CloudSource, Dataset, Floor};
use vice_core::error::one_line;
use vice_core::suspicion::Suspicions;
use vice_core::time::Stamp;

/// The document `vice.info/1`. What cannot be read has a `problem` in place of its numbers.
#[derive(Clone, Debug, Serialize)]
pub struct InfoDocument {
    /// The schema's name and version.
    pub schema: &'static str,
    /// Name of the data set.
    pub name: String,
    /// Its format.
    pub format: String,
    /// The cameras, the default first.
    pub cameras: Vec<CameraPart>,
    /// The pose streams.
    pub streams: Vec<StreamPart>,
    /// The inertial samples, where there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<Extent>,
    /// The scan of the scene: a file, or how many points it has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cloud: Option<String>,
    /// The floor at the first frame; `None` where it is not known.
    pub floor: Option<FloorPart>,
    /// What the format says more: heading and line.
    pub facts: Vec<(String, String)>,
    /// What looks wrong.
    #[serde(skip_serializing_if = "Suspicions::is_empty")]
    pub suspicions: Suspicions,
}

/// How many there are of something, and from when to when.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Extent {
    /// How many.
    pub count: usize,
    /// The first stamp, nanoseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_ns: Option<i64>,
    /// The last stamp, nanoseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_ns: Option<i64>,
    /// Why it cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// A camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraPart {
    /// Its name.
    pub name: String,
    /// Columns and rows.
    pub size: Option<[u32; 2]>,
    /// fx, fy, cx, cy in pixels.
    pub fx_fy_cx_cy: Option<[f64; 4]>,
    /// The lens model.
    pub model: Option<String>,
    /// Its coefficients.
    pub distortion: Option<Vec<f64>>,
    /// Why there is no calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
    /// Row-major 4x4 at the first frame, metres.
    pub body_from_camera: Option<[f64; 16]>,
    /// Whether there are depth images.
    pub depth: bool,
    /// The frames.
    pub frames: Extent,
}

/// A pose stream.
#[derive(Clone, Debug, Serialize)]
pub struct StreamPart {
    /// Its name.
    pub name: String,
    /// Length of the path, metres.
    pub path_length_m: Option<f64>,
    /// The poses.
    pub poses: Extent,
}

/// A floor.
#[derive(Clone, Debug, Serialize)]
pub struct FloorPart {
    /// `world`, or `body` at the key frame.
    pub frame: &'static str,
    /// nx, ny, nz, d of n·p + d = 0, metres.
    pub plane: [f64; 4],
}

/// What a data set holds, or one of its cameras.
pub fn document(dataset: &dyn Dataset, camera: Option<&str>) -> InfoDocument {
    let names = camera.map_or_else(|| dataset.cameras(), |name| vec![name.to_string()]);
    let mut first_frame = None;
    let cameras = names.into_iter().map(|name| camera_part(dataset, name, &mut first_frame)).collect();
    let streams: Vec<StreamPart> =
        dataset.streams().into_iter().map(|name| stream_part(dataset, name)).collect();
    let imu = match dataset.imu() {
        Ok(samples) if samples.is_empty() => None,
        Ok(samples) => {
            Some(extent(samples.len(), samples.first().map(|s| s.stamp), samples.last().map(|s| s.stamp)))
        }
        Err(error) => Some(Extent { problem: Some(one_line(&error)), ..Extent::default() }),
    };
    let cloud = match dataset.cloud() {
        Ok(None) => None,
        Ok(Some(cloud)) => Some(match cloud.source {
            CloudSource::File(path) => path.display().to_string(),
            CloudSource::Points(points) => format!("{} points", points.len()),
            _ => "a scan".to_string(),
        }),
        Err(error) => Some(one_line(&error)),
    };
    let floor = first_frame.and_then(|stamp| dataset.floor(stamp).ok());
    let floor = floor.filter(|floor| !(streams.is_empty() && matches!(floor, Floor::World(_))));
    let floor = floor.and_then(|floor| match floor {
        Floor::World(plane) => Some(("world", plane.normal(), plane.d_m())),
        Floor::Body(plane) => Some(("body", plane.normal(), plane.d_m())),
        _ => None,
    });
    let floor = floor.map(|(frame, n, d)| FloorPart { frame, plane: [n.x, n.y, n.z, d] });
    InfoDocument {
        schema: "vice.info/1",
        name: dataset.name().to_string(),
        format: dataset.format().to_string(),
        cameras,
        streams,
        imu,
        cloud,
        floor,
        facts: dataset.facts().into_iter().map(|fact| (fact.section, fact.text)).collect(),
        // Asked last: readers doubt while they read.
        suspicions: dataset.suspicions().into_iter().collect(),
    }
}

fn extent(count: usize, first: Option<Stamp>, last: Option<Stamp>) -> Extent {
    let ns = |stamp: Option<Stamp>| stamp.map(Stamp::as_nanos);
    Extent { count, first_ns: ns(first), last_ns: ns(last), problem: None }
}

fn camera_part(dataset: &dyn Dataset, name: String, first_frame: &mut Option<Stamp>) -> CameraPart {
    let frames = match dataset.frames(&name) {
        Ok(frames) => {
            *first_frame = first_frame.or(frames.first().copied());
            extent(frames.len(), frames.first().copied(), frames.last().copied())
        }
        Err(error) => Extent { problem: Some(one_line(&error)), ..Extent::default() },
    };
    let first = frames.first_ns.map(Stamp::from_nanos);
    let place = first.and_then(|stamp| dataset.body_from_camera(&name, stamp).ok());
    let camera = dataset.camera(&name);
    let known = camera.as_ref().ok();
    CameraPart {
        size: known.map(|c| [c.width(), c.height()]),
        fx_fy_cx_cy: known.map(|c| c.fx_fy_cx_cy()),
        model: known.map(|c| c.model().name().to_string()),
        distortion: known.map(|c| c.model().coefficients()),
        problem: camera.as_ref().err().map(|e| one_line(e)),
        body_from_camera: place.map(|pose| pose.to_row_major()),
        depth: dataset.has_depth(&name),
        frames,
        name,
    }
}

fn stream_part(dataset: &dyn Dataset, name: String) -> StreamPart {
    match dataset.trajectory(&name) {
        Ok(t) => StreamPart {
            path_length_m: Some(t.path_length_m()),
            poses: extent(t.len(), Some(t.start()), Some(t.end())),
            name,
        },
        Err(error) => StreamPart {
            name,
            path_length_m: None,
            poses: Extent { problem: Some(one_line(&error)), ..Extent::default() },
        },
    }
}
