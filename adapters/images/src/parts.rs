//! What a layout says of a folder: which files hold what, in which conventions. The same parts for every layout.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::camera::Model;
use vice_core::dataset::{CloudRef, Floor};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::BodyFromCamera;
use vice_core::imu::ImuSample;
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

/// Something that is read when it is first asked for.
pub(crate) type Read<T> = Box<dyn Fn() -> DataResult<T> + Send + Sync>;

/// A folder as one of the layouts has it.
pub(crate) struct Description {
    /// The layout's name.
    pub(crate) layout: &'static str,
    /// The recording's name.
    pub(crate) name: String,
    /// The folder, for messages.
    pub(crate) root: PathBuf,
    /// The cameras, the default first.
    pub(crate) cameras: Vec<CameraPart>,
    /// The pose streams.
    pub(crate) streams: Vec<StreamPart>,
    /// Inertial samples in the body frame.
    pub(crate) imu: Option<Read<Samples>>,
    /// The scan of the scene.
    pub(crate) cloud: Option<Read<CloudRef>>,
    /// The floor; [`Floor::Unknown`] where nothing tells which way is up.
    pub(crate) floor: Floor,
    /// What was taken for granted, for `vice info`.
    pub(crate) facts: Vec<String>,
    /// What looks wrong already.
    pub(crate) suspicions: Vec<Suspicion>,
}

impl Description {
    /// An empty one, whose world's z points up over a floor at z = 0.
    pub(crate) fn new(layout: &'static str, root: &Path) -> Self {
        Self {
            layout,
            name: name_of(root),
            root: root.to_path_buf(),
            cameras: Vec::new(),
            streams: Vec::new(),
            imu: None,
            cloud: None,
            floor: Floor::World(vice_core::dataset::Plane::z_zero()),
            facts: Vec::new(),
            suspicions: Vec::new(),
        }
    }

    /// Adds a line for `vice info`.
    pub(crate) fn fact(&mut self, text: impl Into<String>) {
        self.facts.push(text.into());
    }

    /// Adds what is to be doubted of the whole folder.
    pub(crate) fn doubt(&mut self, code: &str, message: &str, advice: &str) {
        self.suspicions.push(Suspicion::new(code, self.root.display().to_string(), message).advice(advice));
    }
}

/// One camera.
pub(crate) struct CameraPart {
    pub(crate) name: String,
    pub(crate) frames: Read<Frames>,
    pub(crate) intrinsics: Read<Intrinsics>,
    pub(crate) place: Place,
    pub(crate) depth: Option<DepthPart>,
}

/// Where a camera sits in the body.
pub(crate) enum Place {
    /// Bolted to it.
    Fixed(Read<BodyFromCamera>),
    /// As the poses of this camera and of the body say, stamp by stamp.
    At(Box<dyn Fn(Stamp) -> DataResult<BodyFromCamera> + Send + Sync>),
}

impl Place {
    /// The body is the camera.
    pub(crate) fn body() -> Self {
        Self::known(BodyFromCamera::identity())
    }

    /// A place that is known.
    pub(crate) fn known(body_from_camera: BodyFromCamera) -> Self {
        Self::Fixed(Box::new(move || Ok(body_from_camera)))
    }
}

/// The pictures of a camera, by stamp.
#[derive(Debug)]
pub(crate) struct Frames {
    /// Strictly increasing.
    pub(crate) stamps: Arc<[Stamp]>,
    /// One for each stamp.
    pub(crate) files: Vec<PathBuf>,
    /// What was left out, missing or made up.
    pub(crate) suspicions: Vec<Suspicion>,
}

impl Frames {
    /// The file of a frame.
    pub(crate) fn file(&self, index: usize) -> DataResult<&Path> {
        self.files.get(index).map(PathBuf::as_path).ok_or_else(|| {
            let folder = self.files.first().and_then(|f| f.parent()).unwrap_or(Path::new(""));
            DataError::of_kind(
                ErrorKind::Missing,
                format!("frame {index} does not exist: there are {}", self.files.len()),
            )
            .at(folder)
        })
    }
}

/// Intrinsics, as far as a layout says them.
#[derive(Clone, Debug)]
pub(crate) struct Intrinsics {
    /// Columns and rows; `None`: those of the pictures.
    pub(crate) size: Option<[u32; 2]>,
    /// fx, fy, cx, cy in pixels; pixel centres are integers.
    pub(crate) fx_fy_cx_cy: [f64; 4],
    /// The lens.
    pub(crate) model: Model,
    /// Where they are from, for messages.
    pub(crate) from: String,
    /// What looks wrong in them.
    pub(crate) suspicions: Vec<Suspicion>,
}

impl Intrinsics {
    /// Of a lens without distortion.
    pub(crate) fn pinhole(fx_fy_cx_cy: [f64; 4], from: impl Into<String>) -> Self {
        Self { size: None, fx_fy_cx_cy, model: Model::Pinhole, from: from.into(), suspicions: Vec::new() }
    }
}

/// Depth images that belong to a camera's pixels.
pub(crate) struct DepthPart {
    pub(crate) frames: Read<Frames>,
    /// Worth of a count; 0 is no depth.
    pub(crate) metres_per_count: f64,
    /// A second count that is no depth.
    pub(crate) invalid: Option<u16>,
    /// Where the worth is from, for messages.
    pub(crate) from: String,
}

/// A pose stream.
pub(crate) struct StreamPart {
    pub(crate) name: String,
    pub(crate) read: Read<Poses>,
}

/// Poses `world_from_body` in a world whose z points up, or whose up is not known.
#[derive(Clone, Debug)]
pub(crate) struct Poses {
    pub(crate) trajectory: Trajectory,
    pub(crate) suspicions: Vec<Suspicion>,
}

/// Inertial samples in the body frame.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    pub(crate) samples: Arc<[ImuSample]>,
    pub(crate) suspicions: Vec<Suspicion>,
}

/// A folder's own name, also where it was given as `.`.
pub(crate) fn name_of(folder: &Path) -> String {
    let real = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
    let part = |p: &Path| p.file_name().map(|n| n.to_string_lossy().into_owned());
    part(&real).filter(|n| !n.is_empty()).unwrap_or_else(|| "images".to_string())
}
