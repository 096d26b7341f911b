//! A flight as a data set.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use nalgebra::Vector3;
use vice_core::camera::Camera;
use vice_core::dataset::{Dataset, DepthImage, Fact, Floor, GROUND_TRUTH, Image, Plane};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{BodyFromCamera, World};
use vice_core::imu::{ImuSample, InertialState};
use vice_core::statistics::middle;
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::{Span, Stamp};
use vice_core::time_unit::unit_mixup;
use vice_core::trajectory::Trajectory;
use vice_video::{Ffmpeg, reference_state};

use crate::camera::CameraFrames;
use crate::depth::DepthFrames;
use crate::layout::{self, Kind, POSES, STAMPS, Side};
use crate::{ned, offsets, tables};

/// Stamps of these years are of the data set's clock; others are of another unit, if one explains them.
const PLAUSIBLE_NS: std::ops::Range<i64> = 946_684_800_000_000_000..4_102_444_800_000_000_000;

pub(crate) struct BlackbirdDataset {
    name: String,
    flight: PathBuf,
    environments: Vec<String>,
    environment: Option<String>,
    camera: Camera,
    cameras: Vec<CameraFrames>,
    depths: Vec<(Side, DepthFrames)>,
    initial_velocity_m_s: Option<Vector3<f64>>,
    truth: OnceLock<Trajectory>,
    /// What was left out of the ground truth.
    suspicions: OnceLock<Suspicions>,
    imu: OnceLock<Arc<[ImuSample]>>,
    floor: OnceLock<Plane<World>>,
}

impl BlackbirdDataset {
    pub(crate) fn open(
        flight: &Path,
        environment: Option<&str>,
        initial_velocity_m_s: Option<Vector3<f64>>,
        ffmpeg: Ffmpeg,
    ) -> DataResult<Self> {
        let environments = layout::environments(flight);
        let environment = layout::choose(flight, &environments, environment)?;
        let camera = ned::camera()?;
        let (mut cameras, mut depths) = (Vec::new(), Vec::new());
        for folder in environment.iter().flat_map(|e| layout::cameras(&flight.join(e))) {
            if folder.kind == Kind::Depth {
                depths.push((folder.side, DepthFrames::new(folder.path)));
            } else {
                cameras.push(CameraFrames::new(folder, (camera.width(), camera.height()), ffmpeg.clone()));
            }
        }
        Ok(Self {
            name: flight_name(flight),
            flight: flight.to_path_buf(),
            environments,
            environment,
            camera,
            cameras,
            depths,
            initial_velocity_m_s,
            truth: OnceLock::new(),
            suspicions: OnceLock::new(),
            imu: OnceLock::new(),
            floor: OnceLock::new(),
        })
    }

    fn find(&self, camera: &str) -> DataResult<&CameraFrames> {
        self.cameras.iter().find(|c| c.folder.name() == camera).ok_or_else(|| {
            let known = self.cameras().join(", ");
            let known = if known.is_empty() { "none".to_string() } else { known };
            DataError::new(format!("there is no camera `{camera}`"))
                .at(&self.flight)
                .hint(format!("it has: {known}"))
        })
    }

    fn depth_of(&self, camera: &CameraFrames) -> Option<&DepthFrames> {
        let of_side = self.depths.iter().find(|(side, _)| *side == camera.folder.side);
        of_side.map(|(_, depth)| depth).filter(|d| d.is_there())
    }

    fn truth(&self) -> DataResult<&Trajectory> {
        if let Some(truth) = self.truth.get() {
            return Ok(truth);
        }
        let path = self.flight.join(POSES);
        let (truth, suspicions) = tables::read_poses(&path)?;
        self.check_clock(&path, (truth.start(), truth.end()))?;
        let _ = self.suspicions.set(suspicions);
        Ok(self.truth.get_or_init(|| truth))
    }

    /// Compares stamps that were read with those of the first camera. The stamps' own trouble is told by `frames`.
    fn check_clock(&self, path: &Path, range: (Stamp, Stamp)) -> DataResult<()> {
        let Some(first) = self.cameras.first() else { return Ok(()) };
        let Ok(frames) = first.frames() else { return Ok(()) };
        let stamps = first.folder.path.join(STAMPS);
        same_clock((path, range), (&stamps, (frames[0], frames[frames.len() - 1])))
    }
}

/// Refuses two files whose stamps only agree if one of them is in another unit; blames the one whose years are odd.
fn same_clock(a: (&Path, (Stamp, Stamp)), b: (&Path, (Stamp, Stamp))) -> DataResult<()> {
    let (suspect, expected) = if PLAUSIBLE_NS.contains(&a.1.0.as_nanos()) { (b, a) } else { (a, b) };
    unit_mixup(expected.1, suspect.1).map_or(Ok(()), |error| Err(error.at(suspect.0)))
}

/// The last three folders of a flight's path, `picasso_yawForward_maxSpeed1p0`.
fn flight_name(flight: &Path) -> String {
    let real = flight.canonicalize().unwrap_or_else(|_| flight.to_path_buf());
    let parts: Vec<_> = real.iter().map(|p| p.to_string_lossy().into_owned()).collect();
    parts[parts.len().saturating_sub(3)..].join("_")
}

impl Dataset for BlackbirdDataset {
    fn name(&self) -> &str {
        &self.name
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        self.suspicions.get().into_iter().flat_map(|list| list.iter().cloned()).collect()
    }

    fn format(&self) -> &str {
        "blackbird"
    }

    fn cameras(&self) -> Vec<String> {
        self.cameras.iter().map(|c| c.folder.name()).collect()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        self.find(camera)?;
        Ok(self.camera)
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        let camera = self.find(camera)?;
        let frames = camera.frames()?;
        let poses = self.flight.join(POSES);
        let pose = self.truth.get().map(Trajectory::start).or_else(|| tables::first_pose_stamp(&poses));
        if let Some(pose) = pose {
            let stamps = camera.folder.path.join(STAMPS);
            same_clock((&poses, (pose, pose)), (&stamps, (frames[0], frames[frames.len() - 1])))?;
        }
        Ok(frames)
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.find(camera)?.image(index)
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        self.find(camera)?.image_file(index)
    }

    fn body_from_camera(&self, camera: &str, _stamp: Stamp) -> DataResult<BodyFromCamera> {
        ned::body_from_camera(self.find(camera)?.folder.side)
    }

    fn streams(&self) -> Vec<String> {
        vec![GROUND_TRUTH.to_string()]
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        if stream != GROUND_TRUTH {
            return Err(DataError::new(format!("there is no pose stream `{stream}`"))
                .at(&self.flight)
                .hint(format!("it has: {GROUND_TRUTH}")));
        }
        Ok(self.truth()?.clone())
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        if let Some(samples) = self.imu.get() {
            return Ok(Arc::clone(samples));
        }
        let path = self.flight.join("csv").join("blackbird_slash_imu.csv");
        if !path.exists() {
            return Ok(Arc::new([]));
        }
        let samples = tables::read_imu(&path)?;
        if let (Some(first), Some(last)) = (samples.first(), samples.last()) {
            self.check_clock(&path, (first.stamp, last.stamp))?;
        }
        Ok(Arc::clone(self.imu.get_or_init(|| samples.into())))
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        reference_state(self.truth()?, stamp, self.initial_velocity_m_s)
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        let camera = self.find(camera)?;
        let Some(depth) = self.depth_of(camera) else { return Ok(None) };
        let frames = camera.frames()?;
        let Some(stamp) = frames.get(index) else {
            return Err(DataError::new(format!(
                "there is no frame {index}, the camera has {}",
                frames.len()
            ))
            .at(&camera.folder.path));
        };
        // Half a frame period: gray at 120 Hz has depth at 60 Hz for every other frame only.
        depth.nearest(*stamp, half_period(&frames), (self.camera.width(), self.camera.height()))
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.find(camera).is_ok_and(|c| self.depth_of(c).is_some())
    }

    fn floor(&self, _keyframe: Stamp) -> DataResult<Floor> {
        if let Some(floor) = self.floor.get() {
            return Ok(Floor::World(*floor));
        }
        let environment = self.environment.as_ref().ok_or_else(|| {
            DataError::new("has no environment, and without one there is no floor").at(&self.flight)
        })?;
        let floor = offsets::floor(&self.flight, environment)?;
        Ok(Floor::World(*self.floor.get_or_init(|| floor)))
    }

    fn facts(&self) -> Vec<Fact> {
        let fact = |section: &str, text: String| Fact { section: section.to_string(), text };
        let environments = self.environments.iter().map(|name| {
            let chosen = if Some(name) == self.environment.as_ref() { " (chosen)" } else { "" };
            fact("environments", format!("{name}{chosen}"))
        });
        let pixels =
            self.cameras.iter().map(|c| fact("pixels", format!("{}: {}", c.folder.name(), c.describe())));
        environments.chain(pixels).collect()
    }
}

/// Half the median time between frames.
fn half_period(frames: &[Stamp]) -> Span {
    let mut periods: Vec<i64> = frames.windows(2).map(|w| w[1].since(w[0]).as_nanos()).collect();
    Span::from_nanos(middle(&mut periods, Ord::cmp).unwrap_or(0) / 2)
}

#[cfg(test)]
mod tests;
