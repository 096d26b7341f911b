//! What a `vice.toml` beside a data set says of it, in place of what it says itself, for every format.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use vice_core::camera::Camera;
use vice_core::dataset::{CloudRef, CloudSource, Dataset, DepthImage, Fact, Floor, Image, Plane};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::finding::Finding;
use vice_core::frames::{BodyFromCamera, Rigid, World, WorldFromBody, WorldFromCamera};
use vice_core::imu::{ImuSample, InertialState};
use vice_core::registry::Registry;
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{PoseCovariance, Trajectory, in_other_world};
use vice_files::calibration::CalibrationFile;
use vice_files::image_file;
use vice_files::once::cached;
use vice_files::trajectory::{ReadOptions, TrajectoryFile, read};
use vice_files::vice_toml::ViceToml;

/// What a `vice.toml` says, read and checked.
#[derive(Clone, Debug)]
pub struct Told {
    /// The file.
    pub file: ViceToml,
    /// The calibration that it names.
    pub calibration: Option<CalibrationFile>,
}

impl Told {
    /// What is said of a data set at a path; `None` where nothing is.
    ///
    /// # Errors
    /// [`DataError`] if the file, or one that it names, cannot be used.
    pub(crate) fn of(path: &Path) -> DataResult<Option<Self>> {
        let Some(place) = ViceToml::place(path) else { return Ok(None) };
        let file = ViceToml::read(&place)?;
        let calibration = file.calibration.as_ref().map(CalibrationFile::read).transpose()?;
        let named = file.cloud.iter().chain(&file.mesh).chain(file.streams.values().map(|s| &s.file));
        if let Some(gone) = named.into_iter().find(|f| !f.is_file()) {
            return Err(DataError::of_kind(ErrorKind::Missing, "no such file")
                .at(gone)
                .hint(format!("{} names it", place.display())));
        }
        Ok(Some(Self { file, calibration }))
    }

    /// The data set as the file says that it is.
    ///
    /// # Errors
    /// [`DataError`] for a key that is not known, or one that does not fit the data set.
    pub(crate) fn apply(
        self,
        dataset: Arc<dyn Dataset>,
        registry: &Registry,
    ) -> DataResult<Arc<dyn Dataset>> {
        let formats: Vec<String> = registry.formats().into_iter().map(|f| f.name).collect();
        let settings: Vec<String> = registry.by_name(dataset.format()).map_or_else(
            |_| Vec::new(),
            |format| format.info().settings.into_iter().map(|s| s.key).collect(),
        );
        self.file.check_keys(&formats, &settings)?;
        let floor = match self.file.floor {
            Some([x, y, z, d]) => Some(Plane::<World>::new([x, y, z], d).map_err(|e| e.at(&self.file.path))?),
            None => None,
        };
        let cameras = dataset.cameras();
        if let Some(file) = &self.calibration {
            // For none of the cameras: what it is about has to be said.
            let fits = cameras.is_empty() || cameras.iter().any(|c| file.for_camera(c, &cameras).is_ok());
            if let (false, Some(first)) = (fits, cameras.first()) {
                file.for_camera(first, &cameras)?;
            }
        }
        let streams = self.file.streams.keys().map(|name| (name.clone(), OnceLock::new())).collect();
        Ok(Arc::new(Beside { inner: dataset, told: self, floor, streams, cameras: Mutex::default() }))
    }

    /// Seconds that are added to the stamps of estimates for a camera.
    pub(crate) fn time_offset_of(&self, camera: &str) -> Option<Span> {
        self.file.time_offset.or_else(|| self.calibration.as_ref()?.time_offset_of(camera))
    }
}

/// Intrinsics of a camera with what a file says in place of what the data set says. A data set without a calibration of
/// its own gives at least the size of its pictures.
///
/// # Errors
/// [`DataError`] if the parts do not fit.
pub(crate) fn calibrated(
    file: &CalibrationFile,
    name: &str,
    dataset: &dyn Dataset,
) -> DataResult<Option<Camera>> {
    if let Ok(base) = dataset.camera(name) {
        return file.camera(name, Some(&base));
    }
    match picture_size(dataset, name) {
        Some(size) => file.of_pictures(name, size)?.camera(name, None),
        None => file.camera(name, None),
    }
}

/// Size of the first picture that is there.
fn picture_size(dataset: &dyn Dataset, camera: &str) -> Option<[u32; 2]> {
    /// Pictures that are looked for.
    const MOST: usize = 10;
    let count = dataset.frames(camera).ok()?.len().min(MOST);
    (0..count).find_map(|index| match dataset.image_file(camera, index) {
        Ok(Some(bytes)) => image_file::decode_size(&bytes).ok().map(|(w, h)| [w, h]),
        _ => dataset.image(camera, index).ok().map(|image| [image.width(), image.height()]),
    })
}

struct Beside {
    inner: Arc<dyn Dataset>,
    told: Told,
    floor: Option<Plane<World>>,
    streams: BTreeMap<String, OnceLock<TrajectoryFile>>,
    /// Cameras with what the calibration says in place.
    cameras: Mutex<BTreeMap<String, Camera>>,
}

impl Beside {
    /// A scan that the file names, in its place in the world.
    fn scan(&self, path: &Path) -> CloudRef {
        let world_from_cloud = self.told.file.world_from_cloud.unwrap_or_else(Rigid::identity);
        CloudRef { source: CloudSource::File(path.to_path_buf()), world_from_cloud }
    }

    /// The calibration for a camera, where it says something of it.
    fn calibration(&self, camera: &str) -> Option<CalibrationFile> {
        self.told.calibration.as_ref()?.for_camera(camera, &self.inner.cameras()).ok()
    }

    fn turn(&self) -> Option<Rigid<World, World>> {
        self.told.file.up.map(|up| up.turn())
    }

    fn turned(&self, own: CloudRef) -> CloudRef {
        match self.turn() {
            Some(turn) => CloudRef { world_from_cloud: turn * own.world_from_cloud, ..own },
            None => own,
        }
    }

    /// A stream in a file, as poses of the body, in the world that the file has.
    fn stream(&self, name: &str, cell: &OnceLock<TrajectoryFile>) -> DataResult<Trajectory> {
        let entry = &self.told.file.streams[name];
        let file = cached(cell, || {
            read(&entry.file, &ReadOptions { times: entry.times.clone(), ..ReadOptions::default() })
        })?;
        if !entry.of_camera {
            return Ok(file.trajectory.clone());
        }
        let cameras = self.inner.cameras();
        let camera = cameras.first().ok_or_else(|| {
            DataError::of_kind(
                ErrorKind::Contradictory,
                format!("[streams] {name}: there is no camera whose poses these are"),
            )
            .at(&self.told.file.path)
        })?;
        let poses: Vec<(Stamp, WorldFromBody)> = file
            .trajectory
            .iter()
            .map(|(stamp, pose)| {
                let world_from_camera: WorldFromCamera = pose.reinterpret();
                Ok((stamp, world_from_camera * self.body_from_camera(camera, stamp)?.inverse()))
            })
            .collect::<DataResult<_>>()?;
        Trajectory::from_poses(poses).map_err(|e| DataError::of(e).at(&entry.file))
    }
}

impl Dataset for Beside {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn format(&self) -> &str {
        self.inner.format()
    }

    fn cameras(&self) -> Vec<String> {
        self.inner.cameras()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        let Some(file) = self.calibration(camera) else { return self.inner.camera(camera) };
        let known = || self.cameras.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = known().get(camera) {
            return Ok(*found);
        }
        match calibrated(&file, camera, self.inner.as_ref())? {
            Some(found) => {
                known().insert(camera.to_string(), found);
                Ok(found)
            }
            None => self.inner.camera(camera),
        }
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        self.inner.frames(camera)
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.inner.image(camera, index)
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        self.inner.image_file(camera, index)
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        match self.calibration(camera).and_then(|file| file.body_from_camera(camera)) {
            Some(place) => Ok(place),
            None => self.inner.body_from_camera(camera, stamp),
        }
    }

    fn streams(&self) -> Vec<String> {
        let mut names = self.inner.streams();
        names.extend(self.streams.keys().filter(|name| !names.contains(name)).cloned().collect::<Vec<_>>());
        names
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        let trajectory = match self.streams.get(stream) {
            Some(cell) => self.stream(stream, cell)?,
            None => self.inner.trajectory(stream)?,
        };
        Ok(match self.turn() {
            Some(turn) => in_other_world(&turn, &trajectory),
            None => trajectory,
        })
    }

    fn pose_covariances(&self, stream: &str) -> DataResult<Vec<PoseCovariance>> {
        match self.streams.contains_key(stream) {
            true => Ok(Vec::new()),
            false => self.inner.pose_covariances(stream),
        }
    }

    fn is_relative(&self, stream: &str) -> bool {
        !self.streams.contains_key(stream) && self.inner.is_relative(stream)
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        self.inner.imu()
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        let state = self.inner.inertial_state(stamp)?;
        Ok(match (state, self.turn()) {
            (Some(state), Some(turn)) => Some(InertialState {
                world_from_body: turn * state.world_from_body,
                velocity_m_s: turn.rotate(&state.velocity_m_s),
                ..state
            }),
            (state, _) => state,
        })
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        self.inner.depth_image(camera, index)
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.inner.has_depth(camera)
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        // Its place is said in the world as it is used; that of the data set's own is turned with the poses.
        match &self.told.file.cloud {
            Some(path) => Ok(Some(self.scan(path))),
            None => Ok(self.inner.cloud()?.map(|own| self.turned(own))),
        }
    }

    fn mesh(&self) -> DataResult<Option<CloudRef>> {
        match &self.told.file.mesh {
            Some(path) => Ok(Some(self.scan(path))),
            None => Ok(self.inner.mesh()?.map(|own| self.turned(own))),
        }
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        if let Some(plane) = self.floor {
            return Ok(Floor::World(plane));
        }
        Ok(match (self.inner.floor(keyframe)?, self.turn()) {
            // z = 0 was the floor of a world whose z was thought to point up.
            (Floor::World(_), Some(_)) => Floor::Unknown,
            (floor, _) => floor,
        })
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let files = self.streams.values().filter_map(OnceLock::get);
        let of_streams = files.flat_map(|f| f.suspicions.iter().cloned());
        let of_calibration = self.told.calibration.iter().flat_map(|f| f.suspicions().iter().cloned());
        self.inner.suspicions().into_iter().chain(of_streams).chain(of_calibration).collect()
    }

    fn checks(&self) -> Vec<Finding> {
        self.inner.checks()
    }

    fn facts(&self) -> Vec<Fact> {
        let file = &self.told.file;
        let mut said = Vec::new();
        said.extend(file.calibration.as_ref().map(|p| format!("calibration: {}", p.display())));
        said.extend(file.time_offset.map(|o| format!("time offset of estimates: {} s", o.to_seconds_text())));
        said.extend(
            file.up
                .map(|up| format!("up: {} of the poses' world, which is turned so that z is up", up.text())),
        );
        said.extend(file.labels.file.as_ref().map(|p| format!("labels: {}", p.display())));
        let section = file.path.display().to_string();
        let about = said.into_iter().map(|text| Fact { section: section.clone(), text });
        self.inner.facts().into_iter().chain(about).collect()
    }
}
