//! What a folder holds that nobody described: what is sure, what is guessed, and what cannot be known.

mod told_by;

use std::path::{Path, PathBuf};

use vice_core::dataset::GROUND_TRUTH;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;
use vice_files::calibration::CalibrationFile;
use vice_files::imu_file;
use vice_files::trajectory::{ReadOptions, looks_like_poses, read};

use crate::calibration::candidates;
use crate::files::{entries, folders, has_picture, name, pictures, stem};
use crate::layouts::ALL;
use told_by::{list_of, unit_of};

/// Rates that cameras have, Hz: a rate that follows from counts is believed near one of these.
const USUAL_HZ: [f64; 16] =
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5, 10.0, 12.5, 15.0, 20.0, 24.0, 25.0, 30.0, 50.0, 60.0];
/// How far from a usual rate one may be.
const RATE_TOLERANCE: f64 = 0.01;
/// Names of folders and files with depth images.
const DEPTH_WORDS: [&str; 2] = ["depth", "range"];

/// What was found in a folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Guess {
    /// A layout that is read without a description.
    pub layout: Option<&'static str>,
    /// Cameras, by name.
    pub cameras: Vec<GuessedCamera>,
    /// Pose streams: name and file.
    pub streams: Vec<(String, PathBuf)>,
    /// A calibration.
    pub calibration: Option<PathBuf>,
    /// Whether the calibration places the cameras in a body.
    pub has_extrinsics: bool,
    /// Inertial samples.
    pub imu: Option<PathBuf>,
    /// A scan.
    pub cloud: Option<PathBuf>,
    /// What is sure.
    pub found: Vec<String>,
    /// What was guessed, and why.
    pub guessed: Vec<String>,
    /// What has to be filled in.
    pub unknown: Vec<String>,
}

/// A camera as far as its folder tells.
#[derive(Clone, Debug, PartialEq)]
pub struct GuessedCamera {
    /// Its name.
    pub name: String,
    /// Its folder below the data set's; `.` is the data set's own.
    pub folder: String,
    /// When its pictures were taken.
    pub when: When,
    /// The folder of its depth images.
    pub depth: Option<String>,
    /// Counts a metre.
    pub depth_scale: Option<f64>,
}

/// When pictures were taken.
#[derive(Clone, Debug, PartialEq)]
pub enum When {
    /// The numbers in their names, in this unit.
    Names(&'static str),
    /// A list.
    List(String),
    /// Counted from a stamp on, seconds as text.
    Fps(f64, Option<String>),
    /// Nothing tells.
    Unknown,
}

/// Looks at a folder. Nothing is decoded.
///
/// # Errors
/// [`DataError`] if it cannot be read or holds no pictures.
pub fn guess(folder: &Path, fps: Option<f64>) -> DataResult<Guess> {
    if !folder.is_dir() {
        return Err(DataError::of_kind(ErrorKind::Missing, "no such folder").at(folder));
    }
    // What is described is described anew.
    let layout = ALL.iter().skip(1).find(|layout| (layout.is)(folder)).map(|layout| layout.name);
    let mut guess = Guess { layout, ..Guess::default() };
    let files: Vec<PathBuf> = entries(folder)?.into_iter().filter(|p| p.is_file()).collect();
    guess.calibration(folder);
    let trajectories = guess.trajectories(&files);
    guess.imu(&files);
    guess.cloud(&files);
    if guess.layout.is_none() {
        let cameras = camera_folders(folder);
        if cameras.is_empty() {
            return Err(DataError::of_kind(
                ErrorKind::Missing,
                "no PNG or JPEG lies in it or in the folders in it",
            )
            .at(folder)
            .hint("give the folder that holds the images, or the folder above it"));
        }
        let depths = depth_folders(folder);
        for place in &cameras {
            guess.camera(folder, place, cameras.len() == 1, &depths, &files, (&trajectories, fps))?;
        }
        let first = guess.cameras.first().map(|c| c.when.clone());
        if guess.cameras.iter().any(|c| Some(&c.when) != first.as_ref()) {
            guess.guessed.push("the cameras have stamps of different kinds: look at each".to_string());
        }
    }
    Ok(guess)
}

/// The folders of pictures that are no depth images: the folder itself, those in it, or one further down each.
fn camera_folders(folder: &Path) -> Vec<PathBuf> {
    if has_picture(folder) {
        return vec![folder.to_path_buf()];
    }
    let mut found = Vec::new();
    for place in folders(folder).into_iter().filter(|p| !is_depth(p)) {
        if has_picture(&place) {
            found.push(place);
        } else if let Some(below) = folders(&place).into_iter().find(|p| !is_depth(p) && has_picture(p)) {
            found.push(below);
        }
    }
    found
}

fn is_depth(place: &Path) -> bool {
    let name = name(place).to_ascii_lowercase();
    DEPTH_WORDS.iter().any(|word| name.contains(word))
}

fn depth_folders(folder: &Path) -> Vec<PathBuf> {
    folders(folder).into_iter().filter(|p| is_depth(p) && has_picture(p)).collect()
}

impl Guess {
    fn calibration(&mut self, folder: &Path) {
        let mut tried = Vec::new();
        for path in candidates(folder) {
            match CalibrationFile::read(&path) {
                Ok(file) if file.cameras().values().any(|c| c.intrinsics.is_some()) => {
                    tried.push((path, file))
                }
                _ => {}
            }
        }
        tried.sort_by_key(|(path, _)| !name(path).contains("camchain"));
        let others: Vec<String> = tried.iter().skip(1).map(|(path, _)| name(path)).collect();
        let Some((path, file)) = tried.into_iter().next() else {
            if self.layout.is_none() {
                self.unknown.push(
                    "calibration: no file in the folder reads as one; name it (Kalibr, ROS, OpenCV and others are read)"
                        .to_string(),
                );
            }
            return;
        };
        self.has_extrinsics = file.cameras().values().any(|c| c.body_from_camera.is_some());
        self.found.push(format!("calibration: {}", name(&path)));
        if !others.is_empty() {
            self.guessed.push(format!(
                "of several calibrations {} is taken, not {}",
                name(&path),
                others.join(", ")
            ));
        }
        self.calibration = Some(path);
    }

    fn trajectories(&mut self, files: &[PathBuf]) -> Vec<(PathBuf, Trajectory)> {
        let mut read_in = Vec::new();
        for path in files {
            let ending =
                path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
            if !["txt", "csv", "tum", "kitti", "freiburg", "log"].contains(&ending.as_str()) {
                continue;
            }
            if !looks_like_poses(path) || imu_file::read(path).is_ok() {
                continue;
            }
            match read(path, &ReadOptions::default()) {
                Ok(file) if file.trajectory.len() > 1 => {
                    read_in.push((path.clone(), file.trajectory));
                }
                Ok(_) => {}
                Err(error) => {
                    self.guessed.push(format!("{} looks like poses, and cannot be read: {error}", name(path)))
                }
            }
        }
        let truth: Vec<usize> = (0..read_in.len()).filter(|i| is_truth(&name(&read_in[*i].0))).collect();
        for (index, (path, trajectory)) in read_in.iter().enumerate() {
            let reference = truth == [index];
            let stream = if reference { GROUND_TRUTH.to_string() } else { stem(path) };
            let what = format!("{}: {} poses", name(path), trajectory.len());
            if reference {
                self.guessed.push(format!("{what}, the ground truth by its name"));
            } else {
                self.found.push(what);
            }
            self.streams.push((stream, path.clone()));
        }
        if read_in.is_empty() && self.layout.is_none() {
            self.unknown.push(
                "streams: no file of poses lies in the folder; name them, or give --estimate FILE"
                    .to_string(),
            );
        }
        read_in
    }

    fn imu(&mut self, files: &[PathBuf]) {
        let fits = |path: &&PathBuf| name(path).to_ascii_lowercase().contains("imu");
        let table = |path: &&PathBuf| path.extension().is_some_and(|e| e == "csv" || e == "txt");
        let found = files.iter().filter(fits).filter(table).find(|path| imu_file::read(path).is_ok());
        if let Some(path) = found {
            self.guessed.push(format!("{}: inertial samples, taken to be in the body frame", name(path)));
            self.imu = Some(path.clone());
        }
    }

    fn cloud(&mut self, files: &[PathBuf]) {
        let clouds: Vec<&PathBuf> =
            files.iter().filter(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"))).collect();
        match clouds[..] {
            [] => {}
            [one] => {
                self.guessed.push(format!("{}: a scan, taken to be in the world of the poses", name(one)));
                self.cloud = Some(one.clone());
            }
            _ => self
                .unknown
                .push(format!("cloud: {} files are PLY; name the one that is the scan", clouds.len())),
        }
    }

    fn camera(
        &mut self,
        folder: &Path,
        place: &Path,
        only: bool,
        depths: &[PathBuf],
        files: &[PathBuf],
        (trajectories, fps): (&[(PathBuf, Trajectory)], Option<f64>),
    ) -> DataResult<()> {
        let relative = place.strip_prefix(folder).unwrap_or(place).to_string_lossy().into_owned();
        let relative = if relative.is_empty() { ".".to_string() } else { relative };
        let there = pictures(place)?;
        let own = relative.split('/').next().unwrap_or_default();
        let name_of = if only && self.calibration.is_some() { self.only_camera() } else { None };
        let camera = name_of.unwrap_or_else(|| if own == "." { "cam0".to_string() } else { own.to_string() });
        self.found.push(format!("camera {camera}: {} pictures in {relative}", there.len()));
        let when = self.when(&camera, &there, files, folder, (trajectories, fps));
        let fits = |d: &&PathBuf| only || name(d).to_ascii_lowercase().contains(&own.to_ascii_lowercase());
        let depth = depths.iter().find(fits);
        let depth_scale = depth.map(|d| self.depth_scale(d));
        self.cameras.push(GuessedCamera {
            name: camera,
            folder: relative,
            when,
            depth: depth.map(|d| name(d)),
            depth_scale,
        });
        Ok(())
    }

    /// The name that the calibration has for its only camera.
    fn only_camera(&self) -> Option<String> {
        let file = CalibrationFile::read(self.calibration.as_ref()?).ok()?;
        let mut names = file.cameras().keys();
        let first = names.next().filter(|n| n.as_str() != "camera")?.clone();
        // Of a rig the first is meant where there is one folder.
        Some(first)
    }

    fn depth_scale(&mut self, depth: &Path) -> f64 {
        let first = pictures(depth).ok().and_then(|p| p.into_iter().next());
        let median = first.and_then(|path| {
            let bytes = vice_files::image_file::read_bytes(&path).ok()?;
            let image = vice_files::image_file::decode_depth_png(&bytes, Stamp::default(), 1.0).ok()?;
            let mut counts: Vec<f32> = image.z_m().iter().copied().filter(|z| !z.is_nan()).collect();
            vice_core::statistics::middle(&mut counts, f32::total_cmp)
        });
        // Rooms are some metres deep: of the usual scales the one that makes it so.
        let (scale, why) = match median {
            Some(counts) if counts > 12_000.0 => {
                (5000.0, "as TUM's: the first depth image would be too far in millimetres")
            }
            Some(_) => (1000.0, "millimetres"),
            None => (1000.0, "millimetres, though the first depth image cannot be looked at"),
        };
        let shown = median.map_or_else(String::new, |c| {
            format!(", half of the first is beyond {:.2} m then", f64::from(c) / scale)
        });
        self.guessed.push(format!("depth_scale = {scale} in {}: {why}{shown}", name(depth)));
        scale
    }

    fn when(
        &mut self,
        camera: &str,
        there: &[PathBuf],
        files: &[PathBuf],
        folder: &Path,
        (trajectories, fps): (&[(PathBuf, Trajectory)], Option<f64>),
    ) -> When {
        if let Some(list) = list_of(there, files, folder, trajectories) {
            self.found.push(format!("stamps of {camera}: {}", name(&list)));
            return When::List(name(&list));
        }
        if let Some(unit) = unit_of(there) {
            self.found.push(format!("stamps of {camera}: the numbers in the names, {}", unit.name()));
            return When::Names(unit.name());
        }
        let start = trajectories.first().map(|(_, t)| t.start().to_seconds_text());
        if let Some(fps) = fps {
            if let Some(start) = &start {
                self.guessed.push(format!(
                    "start_s = {start} of {camera}: the first picture is taken at the first pose"
                ));
            }
            return When::Fps(fps, start);
        }
        // A pose a picture.
        let same = trajectories.iter().find(|(_, t)| t.len() == there.len());
        if let Some((path, _)) = same {
            self.guessed.push(format!(
                "stamps of {camera}: the names say none; {} has as many rows as there are pictures, a row is taken for a picture",
                name(path)
            ));
            return When::List(name(path));
        }
        if let Some((path, t)) = trajectories.first() {
            let seconds = t.end().since(t.start()).as_secs_f64();
            let rate = (there.len().saturating_sub(1)) as f64 / seconds;
            let usual = USUAL_HZ.iter().copied().find(|hz| (rate / hz - 1.0).abs() < RATE_TOLERANCE);
            if let Some(hz) = usual {
                self.guessed.push(format!(
                    "fps = {hz} of {camera}: the names say no stamps; {} pictures over the {seconds:.2} s of {} are {rate:.3} Hz, and the \
                     first is taken at the first pose",
                    there.len(),
                    name(path)
                ));
                return When::Fps(hz, start);
            }
        }
        self.unknown.push(format!(
            "fps of {camera}: nothing says when its pictures were taken; fill in fps, or name a list of stamps"
        ));
        When::Unknown
    }
}

fn is_truth(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
    ["groundtruth", "ground"].iter().any(|w| name.contains(w))
        || words.contains(&"gt")
        || words.contains(&"vicon")
}
