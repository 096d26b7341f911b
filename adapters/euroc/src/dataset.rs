//! A sequence: its sensors behind the core's [`Dataset`].

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use vice_core::camera::Camera;
use vice_core::check::Finding;
use vice_core::check::stamps::nominal;
use vice_core::dataset::{CloudRef, CloudSource, Dataset, DepthImage, Fact, GROUND_TRUTH, Image};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Body, BodyFromCamera, Sensor};
use vice_core::imu::{ImuSample, InertialState};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;
use vice_files::once::cached;
use vice_files::trajectory::{self, TrajectoryFile};

use crate::camera::EurocCamera;
use crate::depth::EurocDepth;
use crate::listing::check_unit;
use crate::{NAME, inertial, sensor};

/// Folder of the ground truth.
pub(crate) const GROUND_TRUTH_FOLDER: &str = "state_groundtruth_estimate0";
/// Sensors that give whole poses, the better one first. `leica0` has no rotation.
const POSE_FOLDERS: [&str; 3] = [GROUND_TRUTH_FOLDER, "vicon0", "mocap0"];

/// An opened sequence.
pub(crate) struct Sequence {
    name: String,
    folder: PathBuf,
    cameras: Vec<EurocCamera>,
    truth_folder: Option<PathBuf>,
    truth: OnceLock<TrajectoryFile>,
    imu: OnceLock<(Arc<[ImuSample]>, Suspicions)>,
    /// Other folders whose tables look like poses.
    other_poses: Vec<PathBuf>,
    depth: Option<EurocDepth>,
}

impl Sequence {
    /// Finds the sensors. `given` is the path as the user gave it, `folder` the `mav0` in it.
    pub(crate) fn open(given: &Path, folder: PathBuf) -> DataResult<Self> {
        let mut cameras = Vec::new();
        let entries = std::fs::read_dir(&folder)
            .map_err(|e| DataError::new("cannot be read").at(&folder).because(e))?;
        for entry in entries.filter_map(Result::ok) {
            let name = entry.file_name().to_string_lossy().into_owned();
            let number = name.strip_prefix("cam").and_then(|n| n.parse::<u32>().ok());
            if let Some(number) = number.filter(|_| entry.path().is_dir()) {
                cameras.push((number, EurocCamera::new(name, entry.path())));
            }
        }
        cameras.sort_by(|a, b| (a.0, &a.1.name).cmp(&(b.0, &b.1.name)));
        let cameras: Vec<EurocCamera> = cameras.into_iter().map(|(_, camera)| camera).collect();
        if cameras.is_empty() {
            return Err(DataError::new("the sequence has no camera")
                .at(&folder)
                .hint("a folder cam0 with data.csv and sensor.yaml is expected"));
        }
        let other_poses = match POSE_FOLDERS.iter().any(|name| folder.join(name).is_dir()) {
            true => Vec::new(),
            false => tables_of_poses(&folder),
        };
        let truth_folder = POSE_FOLDERS.iter().map(|name| folder.join(name)).find(|p| p.is_dir());
        let depth_folder = folder.join("depth0");
        let depth = if depth_folder.is_dir() { Some(EurocDepth::open(depth_folder)?) } else { None };
        if let Some(depth) = depth.as_ref().filter(|d| cameras.iter().all(|c| c.name != d.camera())) {
            return Err(DataError::new(format!(
                "depth0 is registered to `{}`, which is missing",
                depth.camera()
            ))
            .at(&folder));
        }
        Ok(Self {
            name: name_of(given, &folder),
            folder,
            cameras,
            truth_folder,
            truth: OnceLock::new(),
            imu: OnceLock::new(),
            other_poses,
            depth,
        })
    }

    fn find(&self, camera: &str) -> DataResult<&EurocCamera> {
        self.cameras.iter().find(|c| c.name == camera).ok_or_else(|| {
            DataError::new(format!("there is no camera `{camera}`"))
                .at(&self.folder)
                .hint(format!("known: {}", self.cameras().join(", ")))
        })
    }

    fn truth(&self) -> DataResult<Option<&TrajectoryFile>> {
        let Some(folder) = &self.truth_folder else { return Ok(None) };
        cached(&self.truth, || {
            let path = folder.join("data.csv");
            let file = trajectory::read_euroc(&path)?;
            // The file gives poses of its sensor, which need not be the body.
            let body_from_sensor = sensor::body_from_sensor(folder)?;
            let file = in_body(file, body_from_sensor);
            let range = (file.trajectory.start(), file.trajectory.end());
            self.check_unit(&path, range)?;
            Ok(file)
        })
        .map(Some)
    }

    /// Compares a sensor's stamps with the first camera's. A camera whose list is broken says so when it is asked.
    fn check_unit(&self, path: &Path, range: (Stamp, Stamp)) -> DataResult<()> {
        let camera = &self.cameras[0];
        match camera.listing().map(|l| (l.stamps.first().copied(), l.stamps.last().copied())) {
            Ok((Some(first), Some(last))) => {
                check_unit((path, range), (&camera.folder.join("data.csv"), (first, last)))
            }
            _ => Ok(()),
        }
    }
}

impl Dataset for Sequence {
    fn name(&self) -> &str {
        &self.name
    }

    fn format(&self) -> &str {
        NAME
    }

    fn cameras(&self) -> Vec<String> {
        self.cameras.iter().map(|c| c.name.clone()).collect()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        self.find(camera)?.intrinsics()
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        Ok(Arc::clone(&self.find(camera)?.listing()?.stamps))
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.find(camera)?.image(index)
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        self.find(camera)?.image_file(index).map(Some)
    }

    fn body_from_camera(&self, camera: &str, _stamp: Stamp) -> DataResult<BodyFromCamera> {
        Ok(self.find(camera)?.calibration()?.body_from_camera)
    }

    fn streams(&self) -> Vec<String> {
        self.truth_folder.iter().map(|_| GROUND_TRUTH.to_string()).collect()
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        match self.truth()? {
            Some(file) if stream == GROUND_TRUTH => Ok(file.trajectory.clone()),
            truth => {
                let known = if truth.is_some() { GROUND_TRUTH } else { "none" };
                Err(DataError::new(format!("there is no pose stream `{stream}`"))
                    .at(&self.folder)
                    .hint(format!("known: {known}")))
            }
        }
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        let folder = self.folder.join("imu0");
        if !folder.is_dir() {
            return Ok(Arc::new([]));
        }
        let samples = cached(&self.imu, || {
            let (samples, suspicions) = inertial::samples(&folder)?;
            if let [first, .., last] = &samples[..] {
                self.check_unit(&folder.join("data.csv"), (first.stamp, last.stamp))?;
            }
            Ok((samples, suspicions))
        })?;
        Ok(Arc::clone(&samples.0))
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        Ok(self.truth()?.and_then(|file| inertial::state_at(file, stamp)))
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        let frames = self.frames(camera)?;
        match &self.depth {
            Some(depth) if depth.camera() == camera && index < frames.len() => depth.at(&frames, index),
            Some(depth) if depth.camera() == camera => {
                Err(DataError::new(format!("frame {index} does not exist: there are {}", frames.len()))
                    .at(&self.folder))
            }
            _ => Ok(None),
        }
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.depth.as_ref().is_some_and(|depth| depth.camera() == camera)
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        let folder = self.folder.join("pointcloud0");
        let ply = folder.join("data.ply");
        if !ply.is_file() {
            return Ok(None);
        }
        let world_from_cloud = sensor::world_from_cloud(&folder)?;
        Ok(Some(CloudRef { source: CloudSource::File(ply), world_from_cloud }))
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let mut list: Suspicions = self.cameras.iter().flat_map(EurocCamera::suspicions).collect();
        if let Some(truth) = self.truth.get() {
            list.extend(truth.suspicions.iter().cloned());
        }
        if let Some((_, suspicions)) = self.imu.get() {
            list.extend(suspicions.iter().cloned());
        }
        if let Some(depth) = &self.depth {
            list.extend(depth.suspicions());
        }
        list.extend(self.other_poses.iter().map(|table| {
            let shown = table.display().to_string();
            Suspicion::new(
                "poses-not-named",
                &shown,
                "looks like poses, and is not taken for the reference by itself",
            )
            .advice(format!("--reference {shown}"))
        }));
        list.into_iter().collect()
    }

    fn checks(&self) -> Vec<Finding> {
        let mut found = Vec::new();
        for camera in &self.cameras {
            let stamps = camera.listing().map(|l| l.stamps.clone()).unwrap_or_default();
            let rate = sensor::rate_hz(&camera.folder);
            found.extend(rate.and_then(|hz| nominal(&camera.name, "frame", &stamps, hz)));
        }
        let stamps: Vec<Stamp> = self.imu().map(|s| s.iter().map(|s| s.stamp).collect()).unwrap_or_default();
        let rate = sensor::rate_hz(&self.folder.join("imu0"));
        found.extend(rate.and_then(|hz| nominal("imu", "sample", &stamps, hz)));
        found
    }

    fn facts(&self) -> Vec<Fact> {
        let mut facts = Vec::new();
        let mut add = |text: String| facts.push(Fact { section: "sensors".into(), text });
        if let Some(folder) = &self.truth_folder {
            let name = folder.file_name().unwrap_or_default().to_string_lossy();
            match self.truth() {
                Ok(Some(file)) => add(format!("{name}: {} poses", file.trajectory.len())),
                Ok(None) => {}
                Err(error) => add(format!("{name}: {error}")),
            }
        }
        if let Some(depth) = &self.depth {
            match depth.count() {
                Ok(count) => add(format!("depth0: {count} images registered to {}", depth.camera())),
                Err(error) => add(format!("depth0: {error}")),
            }
        }
        for table in &self.other_poses {
            add(format!("{}: looks like poses; name it with --reference", table.display()));
        }
        if self.folder.join("leica0").is_dir() {
            add("leica0: positions without rotation, not used".into());
        }
        facts
    }
}

/// Poses of the body from poses of a sensor on it. Velocities are the body's in EuRoC's ground truth, whose sensor it is.
fn in_body(
    mut file: TrajectoryFile,
    body_from_sensor: vice_core::frames::Rigid<Body, Sensor>,
) -> TrajectoryFile {
    let moved = body_from_sensor.translation().norm() > 0.0
        || vice_core::frames::rotation_angle_rad(&body_from_sensor.rotation()) > 0.0;
    if moved {
        let sensor_from_body = body_from_sensor.inverse();
        file.trajectory = file
            .trajectory
            .map_poses(|_, world_from_sensor| world_from_sensor.reinterpret() * sensor_from_body);
        file.inertial = None;
    }
    file
}

/// Tables in folders of sensors that are not known by name but hold poses.
fn tables_of_poses(folder: &Path) -> Vec<PathBuf> {
    let folders = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let known =
        |name: &str| ["cam", "imu", "leica", "depth", "pointcloud"].iter().any(|k| name.starts_with(k));
    let mut tables: Vec<PathBuf> = folders
        .filter(|f| !known(&f.file_name().to_string_lossy()))
        .map(|f| f.path().join("data.csv"))
        .filter(|table| trajectory::looks_like_poses(table))
        .collect();
    tables.sort();
    tables
}

/// The sequence's name: its folder's, also where `mav0` or `.` was given.
fn name_of(given: &Path, mav: &Path) -> String {
    let sequence = if given == mav && given.file_name().is_some_and(|n| n == "mav0") {
        given.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
    } else {
        given
    };
    let real = sequence.canonicalize().unwrap_or_else(|_| sequence.to_path_buf());
    let name = real.file_name().map(|n| n.to_string_lossy().into_owned());
    name.unwrap_or_else(|| NAME.to_string())
}
