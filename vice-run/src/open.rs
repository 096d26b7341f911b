//! Opening a recording: its format, the camera in use, and what the user overrides.

use std::path::Path;
use std::sync::Arc;

use vice_core::camera::Camera;
use vice_core::dataset::{
    Calibrated, CloudRef, CloudSource, Dataset, Floor, GROUND_TRUTH, OpenOptions, Plane,
};
use vice_core::error::{DataError, ErrorKind};
use vice_core::evaluate::{DatasetRig, Observations};
use vice_core::frames::{Rigid, World};
use vice_core::registry::Registry;
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};
use vice_files::address::{self, is_address};
use vice_files::calibration::CalibrationFile;
use vice_files::rigid_file;

use crate::away::Away;
use crate::beside::{Told, calibrated};
use crate::error::{RunError, RunResult};
use crate::formats;
use crate::in_memory::InMemory;
use crate::place::Place;
use crate::request::{DatasetSpec, EstimateSpec, Protocol, ReferenceSpec, Request, points_asked};
use crate::scans::Scans;

/// A recording as it is used.
#[derive(Clone)]
pub struct Opened {
    /// The data set, with what was overridden in place.
    pub dataset: Arc<dyn Dataset>,
    /// Name of the camera in use.
    pub camera_name: String,
    /// Its intrinsics.
    pub camera: Camera,
    /// Stamps of its frames.
    pub frames: Arc<[Stamp]>,
    /// The calibration file, where one was given.
    pub calibration: Option<CalibrationFile>,
    /// What a `vice.toml` beside the data set says.
    pub told: Option<Told>,
    /// Scans that other runs may have read already, where several runs are made.
    pub scans: Option<Arc<Scans>>,
    /// Poses and labels that a request may name though no file holds them.
    pub in_memory: InMemory,
    /// Files that were fetched from elsewhere, kept as long as they may be read.
    #[expect(dead_code, reason = "held, so that the files are not removed")]
    staged: Arc<Vec<Place<'static>>>,
}

impl DatasetSpec {
    /// Opens the recording with all formats, those of plugins among them.
    ///
    /// # Errors
    /// [`RunError`] if no format reads it, what overrides it cannot be used, or the camera is not there.
    pub fn open(&self) -> RunResult<Opened> {
        // Small files first, so that a mistake in one costs nothing.
        let calibration = self.calibration()?;
        let floor = self.floor()?;
        let (dataset, told) = self.open_told(&formats::registry(&self.plugins)?)?;
        self.calibrate(dataset, told, calibration, floor)
    }

    /// The recording as a `vice.toml` beside it says that it is, with formats that were loaded before: no camera is chosen,
    /// and nothing of the request overrides it.
    ///
    /// # Errors
    /// [`RunError`] if no format reads it.
    pub fn open_raw(&self, registry: &Registry) -> RunResult<Arc<dyn Dataset>> {
        Ok(self.open_told(registry)?.0)
    }

    /// The same, and what the `vice.toml` says.
    fn open_told(&self, registry: &Registry) -> RunResult<(Arc<dyn Dataset>, Option<Told>)> {
        let mut options = OpenOptions { settings: self.set.clone() };
        // A setting may name a file.
        for value in options.settings.values_mut().filter(|v| is_address(v)) {
            *value = Place::of_file(Path::new(value))?.path().to_string_lossy().into_owned();
        }
        let place = Place::of_data_set(&self.path)?;
        // A small file first: a mistake in it may be why the data set does not open.
        let told = place.told(Told::of(place.path()))?;
        let dataset = registry.open(place.path(), self.format.as_deref(), &options);
        let dataset = place.told(dataset.map_err(|e| describable(e, &self.path)))?;
        let dataset: Arc<dyn Dataset> = match place.is_elsewhere() {
            true => Arc::new(Away { inner: dataset, place: place.kept() }),
            false => Arc::from(dataset),
        };
        Ok(match told {
            Some(told) => (told.clone().apply(dataset, registry)?, Some(told)),
            None => (dataset, None),
        })
    }

    /// What a `vice.toml` beside the recording says.
    fn told(&self) -> RunResult<Option<Told>> {
        let place = Place::of_data_set(&self.path)?;
        Ok(place.told(Told::of(place.path()))?)
    }

    /// A data set that is open already, with the camera and the overrides of this request.
    ///
    /// # Errors
    /// [`RunError`] if what overrides it cannot be used, or the camera is not there.
    pub fn apply_to(&self, dataset: Arc<dyn Dataset>) -> RunResult<Opened> {
        self.calibrate(dataset, self.told()?, self.calibration()?, self.floor()?)
    }

    fn calibrate(
        &self,
        dataset: Arc<dyn Dataset>,
        told: Option<Told>,
        calibration: Option<CalibrationFile>,
        floor: Option<Floor>,
    ) -> RunResult<Opened> {
        let name = self.camera_name(dataset.as_ref())?;
        let mut overridden = Calibrated::new(Arc::clone(&dataset));
        let others = dataset.cameras().into_iter().filter(|other| *other != name);
        for (other, file) in others.filter_map(|other| Some((other, calibration.as_ref()?))) {
            // A second camera, where the file has an entry of that very name.
            if let Some(camera) = file.camera(&other, dataset.camera(&other).ok().as_ref())? {
                overridden = overridden.with_camera(&other, camera);
            }
            if let Some(body_from_camera) = file.body_from_camera(&other) {
                overridden = overridden.with_body_from_camera(&other, body_from_camera);
            }
        }
        let calibration = calibration
            .map(|file| file.for_camera(&name, &dataset.cameras()))
            .transpose()
            .map_err(|e| RunError::new(ErrorKind::Usage, "").because(e).of("calibration"))?;
        if let Some(file) = &calibration {
            // The file may hold only extrinsics, or be all there is where the data set's own is broken.
            if let Some(camera) = calibrated(file, &name, dataset.as_ref())? {
                overridden = overridden.with_camera(&name, camera);
            }
            if let Some(body_from_camera) = file.body_from_camera(&name) {
                overridden = overridden.with_body_from_camera(&name, body_from_camera);
            }
        }
        if let Some(floor) = floor {
            overridden = overridden.with_floor(floor);
        }
        let base = overridden.camera(&name).ok();
        if let Some(plain) = self.plain_camera(base.as_ref())? {
            let missing = |e: DataError| RunError::new(ErrorKind::Usage, "").because(e).of("intrinsics");
            if let Some(camera) = plain.camera(base.as_ref()).map_err(missing)? {
                overridden = overridden.with_camera(&name, camera);
            }
            if let Some(body_from_camera) = plain.body_from_camera {
                overridden = overridden.with_body_from_camera(&name, body_from_camera);
            }
        }
        let (overridden, staged) = self.scanned(dataset.as_ref(), overridden)?;
        let camera = overridden.camera(&name)?;
        let frames = overridden.frames(&name)?;
        tracing::info!(
            "{} ({}): camera {name} with {} frames",
            dataset.name(),
            dataset.format(),
            frames.len()
        );
        let in_memory = InMemory::default();
        Ok(Opened {
            dataset: Arc::new(overridden),
            camera_name: name,
            camera,
            frames,
            calibration,
            told,
            scans: None,
            in_memory,
            staged: Arc::new(staged),
        })
    }

    /// The scan and the faces that are given, in place of the data set's own, with the files that were fetched for them.
    fn scanned(
        &self,
        dataset: &dyn Dataset,
        mut calibrated: Calibrated,
    ) -> RunResult<(Calibrated, Vec<Place<'static>>)> {
        let mut staged = Vec::new();
        let placed = match &self.world_from_cloud {
            Some(file) => {
                let place = Place::of_file(file)?;
                Some(place.told(rigid_file::read_world_from_cloud(place.path()))?)
            }
            None => None,
        };
        let mut given = |file: &Path| -> RunResult<CloudRef> {
            let place = Place::of_file(file)?;
            if !place.path().is_file() {
                return Err(RunError::missing(format!("{}: no such file", file.display())));
            }
            let source = CloudSource::File(place.path().to_path_buf());
            staged.push(place.kept());
            Ok(CloudRef { source, world_from_cloud: placed.unwrap_or_else(Rigid::identity) })
        };
        let cloud = self.cloud.as_deref().map(&mut given).transpose()?;
        let mesh = self.mesh.as_deref().map(&mut given).transpose()?;
        let moved = |own: Option<CloudRef>| {
            own.zip(placed).map(|(own, placed)| CloudRef { world_from_cloud: placed, ..own })
        };
        let own = match (&cloud, placed) {
            (None, Some(_)) => moved(dataset.cloud()?),
            _ => None,
        };
        if placed.is_some() && cloud.is_none() && mesh.is_none() && own.is_none() {
            return Err(RunError::usage("world-from-cloud", "places a cloud, and there is none")
                .advise("add `cloud`"));
        }
        if let Some(cloud) = cloud.or(own) {
            calibrated = calibrated.with_cloud(cloud);
        }
        if let Some(mesh) = mesh {
            calibrated = calibrated.with_mesh(mesh);
        }
        Ok((calibrated, staged))
    }

    /// The name of the camera that was asked for, or the first.
    ///
    /// # Errors
    /// [`RunError`] if there is no such camera, or none at all.
    pub fn camera_name(&self, dataset: &dyn Dataset) -> RunResult<String> {
        let names = dataset.cameras();
        match &self.camera {
            Some(name) if names.contains(name) => Ok(name.clone()),
            // Where several cameras could be meant none is listed, and each is there by its name.
            Some(name) if names.is_empty() && dataset.frames(name).is_ok() => Ok(name.clone()),
            Some(_) if names.is_empty() => Err(self.no_camera(dataset)),
            Some(name) => Err(RunError::usage(
                "camera",
                format!("there is no camera {name}; there are {}", names.join(", ")),
            )),
            None => names.into_iter().next().ok_or_else(|| self.no_camera(dataset)),
        }
    }

    /// Why there is no camera: the data set may know.
    fn no_camera(&self, dataset: &dyn Dataset) -> RunError {
        let path = address::shown_path(&self.path);
        let path = path.display();
        match dataset.suspicions().into_iter().find(|s| s.code == "no-camera") {
            Some(reason) => RunError::missing(format!("{path}: {}", reason.line())),
            None => RunError::missing(format!("{path}: the data set has no camera")),
        }
    }

    fn calibration(&self) -> RunResult<Option<CalibrationFile>> {
        let Some(file) = &self.calibration else { return Ok(None) };
        let place = Place::of_file(file)?;
        Ok(Some(place.told(CalibrationFile::read(place.path()))?))
    }

    fn floor(&self) -> RunResult<Option<Floor>> {
        let Some([nx, ny, nz, d]) = self.floor_plane else { return Ok(None) };
        let plane = Plane::<World>::new([nx, ny, nz], d)
            .map_err(|e| RunError::usage("floor-plane", e.to_string()))?;
        Ok(Some(Floor::World(plane)))
    }
}

/// A folder that no format knows may be one of images that nobody described.
fn describable(error: DataError, path: &Path) -> DataError {
    match error.hint_text() {
        Some(hint) if path.is_dir() && error.problem().starts_with("no format recognises") => {
            let hint = format!("a folder of images is described by `vice init {}`; {hint}", path.display());
            error.hint(hint)
        }
        _ => error,
    }
}

impl Request {
    /// The same, where what is not named is what the data set says: labels of its `vice.toml`, and all its streams but the
    /// reference as estimates.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage if no labels are named anywhere.
    pub fn completed(mut self, opened: &Opened) -> RunResult<Self> {
        if self.labels.file.as_os_str().is_empty() {
            let told = opened.told.as_ref().map(|told| &told.file.labels);
            let Some((file, points)) = told.and_then(|l| Some((l.file.clone()?, &l.points))) else {
                return Err(RunError::usage("labels", "no file of labels is named").advise(
                    "name one, or `auto`; or write it into the data set's vice.toml: [labels] file",
                ));
            };
            self.labels.file = file;
            if self.labels.points.is_empty() {
                self.labels.points.clone_from(points);
            }
            points_asked(&self.labels.file)?;
        }
        if self.streams.estimates.is_empty() {
            let reference = match &self.streams.reference {
                ReferenceSpec::Default => Some(GROUND_TRUTH.to_string()),
                ReferenceSpec::None => None,
                ReferenceSpec::Named(spec) => Some(spec.to_string()),
            };
            let others = opened.dataset.streams().into_iter().filter(|name| Some(name) != reference.as_ref());
            self.streams.estimates = others.map(EstimateSpec::from).collect();
        }
        Ok(self)
    }
}

impl Protocol {
    /// Indices of the frames that are looked at, where nothing is scored.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage if there are none.
    pub fn frames(&self, opened: &Opened) -> RunResult<Vec<usize>> {
        self.check()?;
        let frames = self.window(Observations::default()).frames(&opened.frames);
        if frames.is_empty() {
            return Err(RunError::new(
                ErrorKind::Usage,
                format!(
                    "no frame lies in the part of the run that was asked for; camera {} has {}",
                    opened.camera_name,
                    opened.frames.len()
                ),
            )
            .advise("see `start` and `duration`"));
        }
        Ok(frames)
    }
}

impl Opened {
    /// The camera in use, and the floor, as an evaluation asks for them.
    pub fn rig(&self) -> DatasetRig<'_> {
        DatasetRig::new(self.dataset.as_ref(), &self.camera_name)
    }

    /// What looked wrong in what was read beside the data set itself.
    pub fn suspicions(&self) -> impl Iterator<Item = Suspicion> {
        self.calibration.iter().flat_map(|file| file.suspicions().iter().cloned())
    }

    /// Seconds that the calibration, or a `vice.toml`, adds to the stamps of estimates, where one says so.
    pub fn calibrated_time_offset(&self) -> Option<Span> {
        let given = self.calibration.as_ref().and_then(|file| file.time_offset_of(&self.camera_name));
        given.or_else(|| self.told.as_ref()?.time_offset_of(&self.camera_name))
    }
}
