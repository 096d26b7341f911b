//! nerfstudio: `transforms.json` (docs.nerf.studio, data conventions), also as the first NeRF papers wrote it.
//!
//! `transform_matrix` is `world_from_camera` with the axes of OpenGL: x right, y up, z backward; they are turned to x
//! right, y down, z forward. Its principal point counts from the corner of the image, where pixel centres are halves:
//! half a pixel is taken off. The world's z points up as the format asks, but its scale and floor are its own. Frames
//! have no stamps: the numbers in their names are counted.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use vice_core::camera::Model;
use vice_core::dataset::{CloudRef, CloudSource, Floor};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Rigid, World, WorldFromBody};
use vice_core::time::Stamp;
use vice_files::paths;

use super::Layout;
use crate::files::name;
use crate::parts::{CameraPart, DepthPart, Description, Frames, Intrinsics, Place, Poses, Read, StreamPart};
use crate::poses::{Shared, collected};
use crate::settings::Settings;
use crate::stamps;

pub(crate) const LAYOUT: Layout = Layout { name: "nerfstudio", is, describe };

/// The file.
const FILE: &str = "transforms.json";
/// Counts a metre of its depth images where it does not say.
const DEPTH_UNIT: f64 = 1e-3;
/// Keys of intrinsics, also of single frames.
const INTRINSICS: [&str; 16] = [
    "fl_x",
    "fl_y",
    "cx",
    "cy",
    "w",
    "h",
    "k1",
    "k2",
    "k3",
    "k4",
    "p1",
    "p2",
    "camera_angle_x",
    "camera_angle_y",
    "camera_model",
    "is_fisheye",
];

fn is(folder: &Path) -> bool {
    folder.join(FILE).is_file()
}

/// What is read of the file; other keys are of training.
#[derive(Debug, Deserialize)]
struct File {
    frames: Vec<Frame>,
    ply_file_path: Option<String>,
    depth_unit_scale_factor: Option<f64>,
    applied_transform: Option<Vec<Vec<f64>>>,
    applied_scale: Option<f64>,
    #[serde(flatten)]
    rest: BTreeMap<String, serde_json::Value>,
}

#[derive(Debug, Deserialize)]
struct Frame {
    file_path: String,
    depth_file_path: Option<String>,
    transform_matrix: Vec<Vec<f64>>,
    #[serde(flatten)]
    rest: BTreeMap<String, serde_json::Value>,
}

/// The file, checked: pictures in natural order.
struct Scene {
    path: PathBuf,
    file: File,
    /// Of each frame in natural order: its picture, its depth image, its pose.
    frames: Vec<(PathBuf, Option<PathBuf>, WorldFromBody)>,
}

fn read(folder: &Path) -> DataResult<Scene> {
    let path = folder.join(FILE);
    let text =
        std::fs::read_to_string(&path).map_err(|e| DataError::new("cannot be read").at(&path).because(e))?;
    let file: File = serde_json::from_str(&text).map_err(|e| {
        DataError::new(format!("is not what nerfstudio writes: {e}")).at(&path).line(e.line() as u64)
    })?;
    one_camera(&file).map_err(|e| e.at(&path))?;
    let mut frames = Vec::with_capacity(file.frames.len());
    for (index, frame) in file.frames.iter().enumerate() {
        let wrong = |problem: String| {
            DataError::new(format!("frame {index}, {}: {problem}", frame.file_path)).at(&path)
        };
        let below = |file: &str| {
            let file = file.strip_prefix("./").unwrap_or(file);
            paths::safe_join(folder, file).map_err(|e| wrong(e.problem().to_string()))
        };
        let mut picture = below(&frame.file_path)?;
        if picture.extension().is_none() {
            // The first NeRF papers left the ending out.
            picture.set_extension("png");
        }
        let depth = frame.depth_file_path.as_deref().map(below).transpose()?;
        let matrix: Vec<f64> = frame.transform_matrix.concat();
        let count = matrix.len();
        let matrix = <[f64; 16]>::try_from(matrix)
            .map_err(|_| wrong(format!("transform_matrix has {count} numbers, not 4x4")))?;
        frames.push((picture, depth, pose(&matrix).map_err(|e| wrong(e.to_string()))?));
    }
    if frames.is_empty() {
        return Err(DataError::of_kind(ErrorKind::Missing, "holds no frames").at(&path));
    }
    frames.sort_by(|a, b| crate::files::natural(&a.0.to_string_lossy(), &b.0.to_string_lossy()));
    Ok(Scene { path, file, frames })
}

/// A camera with y up that looks along -z, as one with y down that looks along z.
fn pose(m: &[f64; 16]) -> Result<WorldFromBody, vice_core::frames::FrameError> {
    let mut turned = *m;
    for row in 0..4 {
        turned[4 * row + 1] = -m[4 * row + 1];
        turned[4 * row + 2] = -m[4 * row + 2];
    }
    WorldFromBody::try_from_row_major(&turned)
}

/// Frames of several cameras have no one calibration.
fn one_camera(file: &File) -> DataResult<()> {
    let of = |frame: &Frame| -> Vec<Option<serde_json::Value>> {
        INTRINSICS.iter().map(|key| frame.rest.get(*key).or_else(|| file.rest.get(*key)).cloned()).collect()
    };
    let Some(first) = file.frames.first() else { return Ok(()) };
    let known = of(first);
    let other = file.frames.iter().position(|frame| of(frame) != known);
    let Some(index) = other else { return Ok(()) };
    let theirs = of(&file.frames[index]);
    let key = known.iter().zip(&theirs).position(|(a, b)| a != b).map_or("", |i| INTRINSICS[i]);
    Err(DataError::of_kind(
        ErrorKind::Unsupported,
        format!(
            "the frames are of more than one camera: {key} of frame 0 ({}) and of frame {index} ({}) differ",
            first.file_path, file.frames[index].file_path
        ),
    )
    .hint("write one transforms.json for each camera, in folders of their own"))
}

fn intrinsics(scene: &Scene) -> DataResult<Intrinsics> {
    let wrong = |problem: String| DataError::new(problem).at(&scene.path);
    let frame = scene.file.frames.first();
    let value = |key: &str| frame.and_then(|f| f.rest.get(key)).or_else(|| scene.file.rest.get(key));
    let number = |key: &str| -> DataResult<Option<f64>> {
        match value(key) {
            None | Some(serde_json::Value::Null) => Ok(None),
            Some(found) => match found.as_f64() {
                Some(v) => Ok(Some(v)),
                None => Err(wrong(format!("{key} = {found} is no number"))),
            },
        }
    };
    let size = match (number("w")?, number("h")?) {
        (Some(w), Some(h)) if w >= 1.0 && h >= 1.0 => Some([w, h].map(|v| v as u32)),
        (None, None) => None,
        _ => return Err(wrong("of w and h only one is given, or one is no number of pixels".into())),
    };
    let size = match size {
        Some(size) => size,
        None => {
            let first = scene.frames.first().map(|(picture, _, _)| picture.clone()).unwrap_or_default();
            let (w, h) = vice_files::image_file::dimensions(&first)?;
            [w, h]
        }
    };
    let (w, h) = (f64::from(size[0]), f64::from(size[1]));
    let angle = |key: &str, side: f64| -> DataResult<Option<f64>> {
        Ok(number(key)?.map(|angle| side / 2.0 / (angle / 2.0).tan()))
    };
    let fx = match number("fl_x")? {
        Some(fx) => Some(fx),
        None => angle("camera_angle_x", w)?,
    };
    let fx = fx.ok_or_else(|| {
        DataError::of_kind(ErrorKind::Missing, "says neither fl_x nor camera_angle_x").at(&scene.path)
    })?;
    let fy = match number("fl_y")? {
        Some(fy) => fy,
        None => angle("camera_angle_y", h)?.unwrap_or(fx),
    };
    let (cx, cy) = (number("cx")?.unwrap_or(w / 2.0), number("cy")?.unwrap_or(h / 2.0));
    let mut k = [0.0; 6];
    for (place, key) in ["k1", "k2", "p1", "p2", "k3", "k4"].iter().enumerate() {
        k[place] = number(key)?.unwrap_or(0.0);
    }
    let [k1, k2, p1, p2, k3, k4] = k;
    let named = value("camera_model").and_then(|v| v.as_str()).unwrap_or("OPENCV").to_string();
    let fisheye = value("is_fisheye").and_then(serde_json::Value::as_bool).unwrap_or(false);
    let model = match named.as_str() {
        "OPENCV_FISHEYE" => Model::from_name("equidistant", &[k1, k2, k3, k4]),
        _ if fisheye => Model::from_name("equidistant", &[k1, k2, k3, k4]),
        "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "perspective" if k == [0.0; 6] => Ok(Model::Pinhole),
        "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "perspective" if k4 == 0.0 => {
            Model::from_name("radtan", &[k1, k2, p1, p2, k3])
        }
        other => {
            return Err(DataError::of_kind(
                ErrorKind::Unsupported,
                format!("camera_model {other} is not read, or has a k4 that it does not have here"),
            )
            .at(&scene.path)
            .hint("OPENCV, OPENCV_FISHEYE and PINHOLE are; --calibration names another"));
        }
    };
    let model = model.map_err(|e| DataError::of(e).at(&scene.path))?;
    // Pixel centres are integers here, and halves there.
    let pinhole = Intrinsics::pinhole([fx, fy, cx - 0.5, cy - 0.5], scene.path.display().to_string());
    Ok(Intrinsics { size: Some(size), model, ..pinhole })
}

fn describe(folder: &Path, settings: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let fps = settings.fps_or_assumed();
    let root = folder.to_path_buf();
    let scene = Shared::new(move || read(&root));
    // Whether there is depth must be known; the file is small beside its pictures.
    let known = scene.get()?;
    let has_depth = known.frames.iter().any(|(_, depth, _)| depth.is_some());
    let unit = known.file.depth_unit_scale_factor.unwrap_or(DEPTH_UNIT);
    let pictures = |scene: &std::sync::Arc<Shared<Scene>>, root: &Path| -> Read<Frames> {
        let (scene, root) = (scene.clone(), root.to_path_buf());
        Box::new(move || {
            let pictures = scene.get()?.frames.iter().map(|(p, _, _)| p.clone()).collect();
            let mut frames = stamps::by_index(&root, pictures, fps, Stamp::default())?;
            frames.suspicions.push(stamps::made(&root, fps));
            Ok(frames)
        })
    };
    let depth = if has_depth {
        if !(unit.is_finite() && unit > 0.0) {
            return Err(
                DataError::new(format!("depth_unit_scale_factor = {unit} is not positive")).at(&known.path)
            );
        }
        let (metres_per_count, from) = settings.metres_per_count(1.0 / unit, FILE);
        let (own, colour) = (scene.clone(), pictures(&scene, folder));
        let root = folder.to_path_buf();
        let frames: Read<Frames> = Box::new(move || {
            let colour = colour()?;
            let depth: BTreeMap<&PathBuf, &PathBuf> =
                own.get()?.frames.iter().filter_map(|(p, d, _)| d.as_ref().map(|d| (p, d))).collect();
            let there = colour.stamps.iter().zip(&colour.files);
            let frames = there.filter_map(|(s, p)| depth.get(p).map(|d| (*s, (*d).clone()))).collect();
            stamps::in_order(&root, frames, Vec::new())
        });
        Some(DepthPart { frames, metres_per_count, invalid: None, from })
    } else {
        None
    };
    let own = scene.clone();
    found.cameras.push(CameraPart {
        name: "camera".to_string(),
        frames: pictures(&scene, folder),
        intrinsics: Box::new(move || intrinsics(own.get()?)),
        place: Place::body(),
        depth,
    });
    let (own, colour, root) = (scene.clone(), pictures(&scene, folder), folder.to_path_buf());
    let poses: Read<Poses> = Box::new(move || {
        let frames = colour()?;
        let by_picture: BTreeMap<&PathBuf, &WorldFromBody> =
            own.get()?.frames.iter().map(|(p, _, pose)| (p, pose)).collect();
        let there = frames.stamps.iter().zip(&frames.files);
        let poses = there.filter_map(|(s, p)| by_picture.get(p).map(|pose| (*s, **pose))).collect();
        collected(&root.join(FILE), poses, Vec::new())
    });
    found.streams.push(StreamPart { name: "transforms".to_string(), read: poses });
    if let Some(ply) = known.file.ply_file_path.clone() {
        let path = paths::safe_join(folder, ply.strip_prefix("./").unwrap_or(&ply))
            .map_err(|e| DataError::new(format!("ply_file_path: {}", e.problem())).at(&known.path))?;
        found.cloud = Some(Box::new(move || {
            Ok(CloudRef {
                source: CloudSource::File(path.clone()),
                world_from_cloud: Rigid::<World, _>::identity(),
            })
        }));
    }
    found.fact(format!(
        "{}: poses of the camera, which is the body; frames are counted at {fps} Hz",
        name(&known.path)
    ));
    if known.file.applied_transform.is_some() || known.file.applied_scale.is_some_and(|s| s != 1.0) {
        found.fact("the file says that its world was moved or scaled: distances may not be metres");
    }
    found.fact("z is up by the format; the scale of the world and the height of its floor are not known");
    found.floor = Floor::Unknown;
    Ok(found)
}
