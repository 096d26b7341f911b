//! Two calibrations against each other: from a request to the document and a picture.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::camera::Camera;
use vice_core::check::camera_difference::{CameraDifference, camera_difference};
use vice_core::check::short;
use vice_core::frames::{BodyFromCamera, rotation_angle_rad, rotation_vector_rad};
use vice_core::suspicion::Suspicions;
use vice_files::calibration::CalibrationFile;

use crate::error::{RunError, RunResult};
use crate::formats;
use crate::place::Place;
use crate::report::plots::picture::{Anchor, Picture};
use crate::request::DatasetSpec;

/// Differences below this are none, pixels.
const SAME_PX: f64 = 1e-6;

/// Which calibrations are compared.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationDiffRequest {
    /// A calibration file, or a recording with a calibration.
    pub first: PathBuf,
    /// Another one.
    pub second: PathBuf,
    /// Camera; `None`: the first, or the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
}

/// The document `vice.calibration-diff/1`.
#[derive(Clone, Debug, Serialize)]
pub struct CalibrationDiffDocument {
    /// The schema's name and version.
    pub schema: &'static str,
    /// What was asked for.
    pub request: CalibrationDiffRequest,
    /// The cameras that were compared, by their names.
    pub cameras: [String; 2],
    /// RMS, median, 95 % quantile and largest difference after the best rotation, pixels.
    pub rms_px: f64,
    /// See `rms_px`.
    pub median_px: f64,
    /// See `rms_px`.
    pub p95_px: f64,
    /// See `rms_px`.
    pub most_px: f64,
    /// RMS without a rotation, pixels.
    pub rms_unrotated_px: f64,
    /// The best rotation as a rotation vector, degrees: takes rays of the first to rays of the second.
    pub rotation_deg: [f64; 3],
    /// Share of the image that one of both has no ray for.
    pub unseen: f64,
    /// What the difference adds to RMSE_2D, in squares, for tracks that move by a quarter of the image, pixels.
    pub rmse_2d_px: f64,
    /// Angle between both extrinsics, degrees, and between their places, metres, where both have any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extrinsics: Option<ExtrinsicsDiff>,
    /// What looks wrong in the files.
    #[serde(skip_serializing_if = "Suspicions::is_empty")]
    pub suspicions: Suspicions,
    /// Pixels, and what the second has less what the first has; `null` where one has no ray.
    pub places: Vec<DiffPlace>,
}

/// How extrinsics differ.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ExtrinsicsDiff {
    /// Angle between them, degrees.
    pub angle_deg: f64,
    /// Distance, metres.
    pub distance_m: f64,
}

/// One place of the image.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DiffPlace {
    /// Column and row.
    pub pixel: [f64; 2],
    /// Difference, pixels.
    pub off_px: Option<[f64; 2]>,
}

/// Two calibrations, compared.
pub struct CalibrationDiff {
    /// The document.
    pub document: CalibrationDiffDocument,
    found: CameraDifference,
    size: (f64, f64),
}

struct One {
    name: String,
    camera: Camera,
    extrinsics: Option<BodyFromCamera>,
    suspicions: Suspicions,
}

/// Compares two calibrations.
///
/// # Errors
/// [`RunError`] if one of them cannot be read or says nothing of the camera, or their images have different sizes.
pub fn compare_calibrations(request: &CalibrationDiffRequest) -> RunResult<CalibrationDiff> {
    let read = |path: &Path| read(path, request.camera.as_deref());
    let (first, second) = (read(&request.first)?, read(&request.second)?);
    let size = |c: &Camera| format!("{}x{}", c.width(), c.height());
    let found = camera_difference(&first.camera, &second.camera).ok_or_else(|| {
        match size(&first.camera) == size(&second.camera) {
            true => RunError::missing("no pixel has a ray by both calibrations"),
            false => RunError::usage(
                "camera",
                format!(
                    "the calibrations are of images of {} and {}: scale one first",
                    size(&first.camera),
                    size(&second.camera)
                ),
            ),
        }
    })?;
    let mut suspicions = first.suspicions;
    suspicions.extend(second.suspicions);
    let turn = rotation_vector_rad(&found.second_from_first);
    let document = CalibrationDiffDocument {
        schema: "vice.calibration-diff/1",
        request: request.clone(),
        cameras: [first.name, second.name],
        rms_px: found.rms_px,
        median_px: found.median_px,
        p95_px: found.p95_px,
        most_px: found.most_px,
        rms_unrotated_px: found.rms_unrotated_px,
        rotation_deg: [0, 1, 2].map(|i| turn[i].to_degrees()),
        unseen: found.unseen,
        rmse_2d_px: found.rmse_2d_px,
        extrinsics: first.extrinsics.zip(second.extrinsics).map(|(a, b)| ExtrinsicsDiff {
            angle_deg: rotation_angle_rad(&(a.rotation().inverse() * b.rotation())).to_degrees(),
            distance_m: (a.translation() - b.translation()).norm(),
        }),
        suspicions,
        places: found
            .places
            .iter()
            .map(|p| DiffPlace { pixel: [p.pixel.u, p.pixel.v], off_px: p.off_px })
            .collect(),
    };
    let size = (f64::from(first.camera.width()), f64::from(first.camera.height()));
    Ok(CalibrationDiff { document, found, size })
}

/// The camera of a calibration file or of a recording.
fn read(path: &Path, camera: Option<&str>) -> RunResult<One> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if matches!(extension.as_str(), "toml" | "yaml" | "yml" | "xml") {
        let place = Place::of_file(path)?;
        let file = place.told(CalibrationFile::read(place.path()))?;
        let names: Vec<&String> = file.cameras().keys().collect();
        let name = match (camera, names.as_slice()) {
            (Some(name), _) => name.to_string(),
            (None, [one]) => (*one).clone(),
            (None, []) => return Err(RunError::missing(format!("{} is of no camera", path.display()))),
            (None, several) => {
                let list: Vec<&str> = several.iter().map(|n| n.as_str()).collect();
                return Err(RunError::usage(
                    "camera",
                    format!("{} is of several cameras: {}", path.display(), list.join(", ")),
                )
                .advise("name one with `camera`"));
            }
        };
        let file = file.for_camera(&name, std::slice::from_ref(&name))?;
        let model = file.camera(&name, None)?.ok_or_else(|| {
            RunError::missing(format!("{} says nothing of the intrinsics of {name}", path.display()))
        })?;
        let extrinsics = file.body_from_camera(&name);
        return Ok(One { camera: model, extrinsics, suspicions: file.suspicions().clone(), name });
    }
    let spec = DatasetSpec {
        path: path.to_path_buf(),
        camera: camera.map(str::to_string),
        ..DatasetSpec::default()
    };
    let dataset = spec.open_raw(&formats::registry(&spec.plugins)?)?;
    let name = spec.camera_name(dataset.as_ref())?;
    let first = dataset.frames(&name).ok().and_then(|f| f.first().copied());
    Ok(One {
        camera: dataset.camera(&name)?,
        extrinsics: first.and_then(|stamp| dataset.body_from_camera(&name, stamp).ok()),
        suspicions: dataset.suspicions().into_iter().collect(),
        name,
    })
}

impl CalibrationDiff {
    /// What differs, in words.
    pub fn render(&self) -> String {
        let d = &self.document;
        if d.most_px.max(d.rms_unrotated_px) < SAME_PX {
            return format!("the intrinsics are the same{}\n", self.extrinsics_text());
        }
        let angle = d.rotation_deg.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut text = format!(
            "after the best rotation ({} degrees: [{}]):\n  RMS {} px, median {} px, 95 % {} px, at most {} px\n",
            short(angle),
            d.rotation_deg.map(short).join(", "),
            short(d.rms_px),
            short(d.median_px),
            short(d.p95_px),
            short(d.most_px)
        );
        text.push_str(&format!("without it: RMS {} px\n", short(d.rms_unrotated_px)));
        if d.unseen > 0.0 {
            text.push_str(&format!("{:.1} % of the image has no ray by one of both\n", 100.0 * d.unseen));
        }
        text.push_str(&format!(
            "tracks that move by a quarter of the image's width: adds {} px to RMSE_2D (in squares)\n",
            short(d.rmse_2d_px)
        ));
        let extrinsics = self.extrinsics_text();
        if let Some(rest) = extrinsics.strip_prefix(", ") {
            text.push_str(&format!("{rest}\n"));
        }
        text
    }

    fn extrinsics_text(&self) -> String {
        self.document.extrinsics.map_or_else(String::new, |e| {
            format!(", the extrinsics differ by {} degrees and {} m", short(e.angle_deg), short(e.distance_m))
        })
    }

    /// The differences as strokes on the image, enlarged until they can be seen.
    pub fn picture(&self) -> String {
        let (w, h) = self.size;
        let scale = 640.0 / w;
        let (margin, head) = (10.0, 34.0);
        let mut picture = Picture::new(640.0 + 2.0 * margin, h * scale + head + margin);
        let at = |u: f64, v: f64| (margin + u * scale, head + v * scale);
        let times = match self.found.p95_px {
            p if p > 1e-9 => nice(0.03 * w / p),
            _ => 1.0,
        };
        let says = format!(
            "differences {} times as long; RMS {} px, at most {} px",
            short(times),
            short(self.found.rms_px),
            short(self.found.most_px)
        );
        picture.text("title", (margin, 20.0), Anchor::Start, &says);
        picture.frame("", at(0.0, 0.0), (w * scale, h * scale));
        let shown = self.found.places.iter().enumerate().filter(|(i, _)| {
            (i / self.found.across).is_multiple_of(2) && (i % self.found.across).is_multiple_of(2)
        });
        let strokes: Vec<_> = shown
            .filter_map(|(_, p)| {
                let [du, dv] = p.off_px?;
                Some((at(p.pixel.u, p.pixel.v), at(p.pixel.u + times * du, p.pixel.v + times * dv)))
            })
            .collect();
        picture.dots("e0", strokes.iter().map(|(from, _)| *from));
        picture.strokes("e0", strokes);
        picture.into_file(&says)
    }
}

/// A factor of one digit.
fn nice(value: f64) -> f64 {
    let decade = 10.0_f64.powf(value.max(1e-12).log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().rfind(|d| d * decade <= value).unwrap_or(1.0);
    digit * decade
}
