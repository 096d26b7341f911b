//! Several cameras of one recording in one run: each for itself, and all together.
//!
//! The recording is opened once, and each camera is evaluated as if it were asked for alone, with its own labels. Together
//! their squared errors are pooled.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vice_core::result::{PixelPart, Role};
use vice_files::address;
use vice_files::calibration::CalibrationFile;
use vice_files::labels;

use crate::error::{RunError, RunResult};
use crate::evaluation::Samples;
use crate::formats;
use crate::in_memory::is_in_memory;
use crate::open::Opened;
use crate::place::Place;
use crate::progress::Progress;
use crate::report::csv::{cell, finished};
use crate::report::rows::pixels;
use crate::report::{csv, latex, table};
use crate::request::{Request, is_auto};
use crate::result::{ResultDocument, SCHEMA_OF_RIGS};
use crate::text::printable;

/// What stands for a camera's name in the name of a labels file.
const CAMERA: &str = "{camera}";

/// The document `vice.rig/1`: the results of several cameras of one recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigDocument {
    /// [`SCHEMA_OF_RIGS`].
    pub schema: String,
    /// Version of VICE that wrote it.
    pub vice_version: String,
    /// What was asked for, all cameras in it.
    pub request: Request,
    /// The result of each camera, in the order in which they were named.
    pub cameras: Vec<ResultDocument>,
    /// All cameras together, one entry for each pose stream and depth source.
    pub together: Vec<TogetherPart>,
}

/// Pixel errors of one pose stream with one depth source in all cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TogetherPart {
    /// Name of the pose stream.
    pub stream: String,
    /// Its role.
    pub role: Role,
    /// Name of the depth source.
    pub depth: String,
    /// RMSE_2D of all labels of all cameras, pixels; null where nothing was scored. Pixels of cameras with other focal lengths
    /// are other angles.
    pub pooled_rmse_px: Option<f64>,
    /// The same of the labels that hold. It has no interval: the cameras share the motion, and so a part of their errors.
    pub held_rmse_px: Option<f64>,
    /// The same as angles, milliradians, which cameras of any focal length share; null where a camera has none.
    pub held_mrad: Option<f64>,
    /// Number of scored samples.
    pub scored: u64,
    /// Number of labels that could not be scored.
    pub skipped: u64,
    /// RMSE_2D of all labels of each camera, pixels.
    pub pooled_rmse_px_by_camera: BTreeMap<String, Option<f64>>,
}

/// The cameras of a recording, each with what is asked of it.
pub struct Rig {
    request: Request,
    /// The request of each camera, and the recording as it sees it.
    pub cameras: Vec<(Request, Opened)>,
}

impl Request {
    /// The cameras that are named, where they are several: `cam0,cam1`.
    pub fn cameras(&self) -> Option<Vec<&str>> {
        let names: Vec<&str> = self.dataset.camera.as_deref()?.split(',').map(str::trim).collect();
        (names.len() > 1).then_some(names)
    }

    /// The request of each of several cameras; `None` where one is asked for.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage for a camera without a name or named twice, and for what is of one camera only.
    pub fn of_each_camera(&self) -> RunResult<Option<Vec<Self>>> {
        let Some(names) = self.cameras() else { return Ok(None) };
        let twice = names.iter().enumerate().find(|(place, name)| names[..*place].contains(name));
        if let Some((_, name)) = twice.or(names.iter().enumerate().find(|(_, name)| name.is_empty())) {
            return Err(RunError::usage("camera", format!("`{name}` is no camera of its own in the list")));
        }
        let dataset = &self.dataset;
        for (field, given) in [
            ("intrinsics", dataset.intrinsics.is_some()),
            ("distortion", dataset.distortion.is_some()),
            ("image-size", dataset.image_size.is_some()),
            ("body-from-camera", dataset.body_from_camera.is_some()),
            ("stereo-camera", self.depth.stereo_camera.is_some()),
        ] {
            if given {
                let problem = format!("is of one camera, and {} are asked", names.len());
                return Err(
                    RunError::usage(field, problem).advise("give a `calibration` with an entry for each")
                );
            }
        }
        let one = |name: &&str| {
            let mut request = self.clone();
            request.dataset.camera = Some((*name).to_string());
            if let Some(file) = self.labels.file.to_str().filter(|file| file.contains(CAMERA)) {
                request.labels.file = file.replace(CAMERA, name).into();
            }
            request
        };
        Ok(Some(names.iter().map(one).collect()))
    }
}

impl Rig {
    /// Opens the recording once for all cameras. What a request does not name is what the data set says.
    ///
    /// # Errors
    /// [`RunError`] if it cannot be opened, a camera is not there, or labels or a calibration do not say which camera they are of.
    pub fn open(request: &Request, each: Vec<Request>) -> RunResult<Self> {
        request.check()?;
        let calibration = match &request.dataset.calibration {
            Some(file) => {
                let place = Place::of_file(file)?;
                Some(place.told(CalibrationFile::read(place.path()))?)
            }
            None => None,
        };
        if calibration.is_some_and(|file| file.is_nameless()) {
            return Err(RunError::usage("calibration", "names no camera, and several are asked")
                .advise("give a file with an entry for each camera"));
        }
        let dataset = request.dataset.open_raw(&formats::registry(&request.dataset.plugins)?)?;
        let mut cameras = Vec::with_capacity(each.len());
        for one in each {
            let opened = one.dataset.apply_to(Arc::clone(&dataset))?;
            cameras.push((one.completed(&opened)?, opened));
        }
        check_labels(&cameras)?;
        Ok(Self { request: request.clone(), cameras })
    }

    /// Evaluates each camera, and all of them together.
    ///
    /// # Errors
    /// [`RunError`] with the camera if one cannot be evaluated.
    pub fn evaluate(&self, keep_samples: bool, progress: &Progress<'_>) -> RunResult<RigDocument> {
        let mut cameras = Vec::with_capacity(self.cameras.len());
        for (request, opened) in &self.cameras {
            let samples = if keep_samples { Samples::Keep } else { Samples::Drop };
            cameras.push(request.evaluate(opened, samples, progress)?);
        }
        Ok(RigDocument {
            schema: SCHEMA_OF_RIGS.to_string(),
            vice_version: env!("CARGO_PKG_VERSION").to_string(),
            request: self.request.without_secrets(),
            together: together(&cameras),
            cameras,
        })
    }
}

/// Labels of one file for all cameras have to say whose they are.
fn check_labels(cameras: &[(Request, Opened)]) -> RunResult<()> {
    let Some((request, opened)) = cameras.first() else { return Ok(()) };
    let file = &request.labels.file;
    let shared = cameras.iter().filter(|(other, _)| other.labels.file == *file).count() > 1;
    if !shared || is_auto(file) || is_in_memory(&file.to_string_lossy()) {
        return Ok(());
    }
    let place = Place::of_file(file)?;
    let read = place.told(labels::read_file(place.path(), Some(&opened.frames)))?;
    if read.cameras().is_empty() {
        let problem = format!(
            "{} does not say which camera its labels are of, and several are asked",
            address::shown_path(file).display()
        );
        return Err(RunError::usage("labels", problem)
            .advise("add a column camera; or name a file for each: labels_{camera}.csv"));
    }
    Ok(())
}

fn together(cameras: &[ResultDocument]) -> Vec<TogetherPart> {
    let Some(first) = cameras.first() else { return Vec::new() };
    let part_of = |like: &PixelPart| -> Vec<(&str, &PixelPart)> {
        let is_it = |p: &&PixelPart| (&p.stream, p.role, &p.depth) == (&like.stream, like.role, &like.depth);
        cameras
            .iter()
            .filter_map(|d| Some((d.dataset.camera.as_str(), d.pixel.iter().find(is_it)?)))
            .collect()
    };
    first.pixel.iter().map(|like| together_part(like, &part_of(like))).collect()
}

fn together_part(like: &PixelPart, parts: &[(&str, &PixelPart)]) -> TogetherPart {
    let held = |p: &PixelPart| p.held.as_ref().map_or(0, |h| h.samples);
    let pooled = parts.iter().map(|(_, p)| (p.pooled_rmse_px, p.scored));
    let of_held = parts.iter().map(|(_, p)| (p.held_rmse_px, held(p)));
    let angles = parts.iter().map(|(_, p)| (p.held.as_ref().and_then(|h| h.mrad).map(|f| f.rmse), held(p)));
    let by_camera = parts.iter().map(|(name, p)| ((*name).to_string(), p.pooled_rmse_px));
    TogetherPart {
        stream: like.stream.clone(),
        role: like.role,
        depth: like.depth.clone(),
        pooled_rmse_px: pool(pooled),
        held_rmse_px: pool(of_held),
        held_mrad: pool(angles),
        scored: parts.iter().map(|(_, p)| p.scored).sum(),
        skipped: parts.iter().map(|(_, p)| p.skipped.len() as u64).sum(),
        pooled_rmse_px_by_camera: by_camera.collect(),
    }
}

/// The RMSE of all samples from those of parts of them; `None` where there is no sample, or a part with samples has none.
fn pool(parts: impl Iterator<Item = (Option<f64>, u64)>) -> Option<f64> {
    let (mut squares, mut count) = (0.0, 0_u64);
    for (rmse, samples) in parts.filter(|(_, samples)| *samples > 0) {
        squares += rmse?.powi(2) * samples as f64;
        count += samples;
    }
    (count > 0).then(|| (squares / count as f64).sqrt())
}

impl RigDocument {
    /// Leaves out the scored samples and what only plots need.
    pub fn drop_samples(&mut self) {
        self.cameras.iter_mut().for_each(ResultDocument::drop_samples);
    }

    /// The table of each camera, and one of all together.
    pub fn table(&self) -> String {
        let mut text: String = self.cameras.iter().map(|d| table::render(d) + "\n").collect();
        let names: Vec<String> = self.cameras.iter().map(|d| printable(&d.dataset.camera)).collect();
        text.push_str(&format!("{} together\n", names.join(" and ")));
        let head = ["stream", "role", "depth", "pooled px", "held px", "held mrad", "scored", "skipped"];
        let mut grid = vec![head.map(String::from).to_vec()];
        let number = |v: Option<f64>| v.map_or_else(|| "-".to_string(), |v| pixels(v, 3));
        for part in &self.together {
            grid.push(vec![
                printable(&part.stream),
                format!("{:?}", part.role).to_lowercase(),
                printable(&part.depth),
                number(part.pooled_rmse_px),
                number(part.held_rmse_px),
                number(part.held_mrad),
                part.scored.to_string(),
                part.skipped.to_string(),
            ]);
        }
        text.push_str(&table::align(&grid));
        text
    }

    /// The tables of the cameras as one CSV, with the camera first.
    ///
    /// # Errors
    /// [`RunError`] if a text is none.
    pub fn csv(&self) -> RunResult<String> {
        let mut writer = ::csv::Writer::from_writer(Vec::new());
        for (place, document) in self.cameras.iter().enumerate() {
            let text = csv::render(document)?;
            let mut rows = ::csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
            for (line, row) in rows.records().enumerate() {
                let row = row?;
                let first = if line == 0 { "camera".to_string() } else { cell(&document.dataset.camera) };
                if line > 0 || place == 0 {
                    writer.write_record(std::iter::once(first.as_str()).chain(row.iter()))?;
                }
            }
        }
        finished(writer)
    }

    /// A `tabular` for each camera.
    ///
    /// # Errors
    /// [`RunError`] if a text is none.
    pub fn latex(&self) -> RunResult<String> {
        self.cameras.iter().map(latex::render).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, part, sample};

    fn of(camera: &str, errors: &[f64]) -> ResultDocument {
        let samples: Vec<_> = errors.iter().enumerate().map(|(i, e)| sample("a", i as i64, *e)).collect();
        let mut document = document(vec![part("slam", &samples)]);
        document.dataset.camera = camera.to_string();
        document
    }

    #[test]
    fn squared_errors_are_pooled_over_the_cameras() {
        let found = together(&[of("cam0", &[3.0, 1.0]), of("cam1", &[5.0])]);
        let [part] = &found[..] else { panic!("{found:?}") };
        assert!((part.pooled_rmse_px.unwrap() - (35.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!((part.scored, part.skipped, part.held_rmse_px), (3, 0, None));
        assert_eq!(part.pooled_rmse_px_by_camera["cam1"], Some(5.0));
        // A camera without a sample takes nothing away.
        let found = together(&[of("cam0", &[3.0]), of("cam1", &[])]);
        assert_eq!(found[0].pooled_rmse_px, Some(3.0));
        assert_eq!(together(&[of("cam0", &[])])[0].pooled_rmse_px, None);
    }

    #[test]
    fn each_camera_has_a_request_of_its_own() {
        let mut request = Request::new("run", "l_{camera}.csv", []);
        assert!(request.of_each_camera().unwrap().is_none());
        request.dataset.camera = Some("cam0, cam1".to_string());
        let each = request.of_each_camera().unwrap().unwrap();
        let told: Vec<String> =
            each.iter().map(|r| format!("{:?} {}", r.dataset.camera, r.labels.file.display())).collect();
        assert_eq!(told, ["Some(\"cam0\") l_cam0.csv", "Some(\"cam1\") l_cam1.csv"]);
        for wrong in ["cam0,cam0", "cam0,", ",cam1"] {
            request.dataset.camera = Some(wrong.to_string());
            assert_eq!(request.of_each_camera().unwrap_err().field(), Some("camera"), "{wrong}");
        }
        request.dataset.camera = Some("cam0,cam1".to_string());
        request.dataset.intrinsics = Some([500.0, 500.0, 320.0, 240.0]);
        assert_eq!(request.of_each_camera().unwrap_err().field(), Some("intrinsics"));
    }

    #[test]
    fn tables_name_the_camera() {
        let rig = RigDocument {
            schema: SCHEMA_OF_RIGS.to_string(),
            vice_version: "0".to_string(),
            request: Request::default(),
            together: together(&[of("cam0", &[3.0, 1.0]), of("cam1", &[5.0])]),
            cameras: vec![of("cam0", &[3.0, 1.0]), of("cam1", &[5.0])],
        };
        let csv = rig.csv().unwrap();
        let first: Vec<&str> = csv.lines().map(|l| l.split(',').next().unwrap()).collect();
        assert_eq!(first, ["camera", "cam0", "cam1"]);
        assert!(
            rig.table().contains("cam0 and cam1 together") && rig.table().contains("3.416"),
            "{}",
            rig.table()
        );
        let text = serde_json::to_string(&rig).unwrap();
        assert_eq!(serde_json::from_str::<RigDocument>(&text).unwrap(), rig);
    }
}
