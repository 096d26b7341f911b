//! COLMAP: a model (`cameras`, `images`, `points3D`, text or binary) in the folder or in `sparse/0`, its images in `images`.
//!
//! Each camera of the model is one here; the first is the body, and others are where their poses say at the same number.
//! See [`crate::colmap`] for the conventions. Images have no stamps: the numbers in their names are counted.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::dataset::Floor;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Body, BodyFromCamera, Camera, Rigid, WorldFromBody};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_files::paths;

use super::Layout;
use crate::colmap::{SparseModel, has_points, is_model};
use crate::files::folders;
use crate::parts::{CameraPart, Description, Frames, Place, StreamPart};
use crate::poses::{Shared, collected};
use crate::settings::Settings;
use crate::stamps;

pub(crate) const LAYOUT: Layout = Layout { name: "COLMAP", is, describe };

/// Where a model lies below a folder.
const PLACES: [&str; 8] =
    ["", "sparse/0", "sparse", "model", "colmap/sparse/0", "colmap", "dslr_calibration_undistorted", "0"];

fn model_of(folder: &Path) -> Option<PathBuf> {
    PLACES
        .iter()
        .map(|p| if p.is_empty() { folder.to_path_buf() } else { folder.join(p) })
        .find(|p| is_model(p))
}

fn is(folder: &Path) -> bool {
    model_of(folder).is_some()
}

/// The folder that the names of the images start from: the first that has one of them.
fn pictures_of(folder: &Path, model: &SparseModel) -> Option<PathBuf> {
    let mut places: Vec<PathBuf> =
        ["images", "rgb", "image", "input"].iter().map(|p| folder.join(p)).collect();
    places.push(folder.to_path_buf());
    places.extend(folders(folder));
    // A model that was opened by itself has its images beside its folder, or two above.
    let above = |p: &Path| p.canonicalize().ok().and_then(|p| p.parent().map(|p| p.join("images")));
    places.extend(above(folder));
    places.extend(folder.parent().and_then(above));
    let has = |place: &PathBuf| model.images.iter().take(100).any(|i| place.join(&i.name).is_file());
    places.into_iter().find(has)
}

/// A model and its frames, by camera.
struct Reconstruction {
    model: SparseModel,
    /// Of each camera: stamps, files and poses.
    by_camera: BTreeMap<u32, Vec<(Stamp, PathBuf, WorldFromBody)>>,
    missing: Option<Suspicion>,
}

fn read(folder: &Path, model: &Path, fps: f64) -> DataResult<Reconstruction> {
    let model = SparseModel::read(model)?;
    let pictures = pictures_of(folder, &model);
    let root = pictures.clone().unwrap_or_else(|| folder.join("images"));
    let (mut gone, mut first) = (0_u64, String::new());
    let mut grouped: BTreeMap<u32, Vec<(PathBuf, WorldFromBody)>> = BTreeMap::new();
    for image in &model.images {
        let path = paths::safe_join(&root, &image.name)
            .map_err(|e| DataError::new(format!("an image's name: {}", e.problem())).at(&model.folder))?;
        if !path.is_file() {
            if gone == 0 {
                first.clone_from(&image.name);
            }
            gone += 1;
        }
        grouped.entry(image.camera).or_default().push((path, image.world_from_camera));
    }
    let missing = (gone > 0).then(|| {
        Suspicion::new(
            "pictures-missing",
            root.display().to_string(),
            "images of the model are not there: those frames cannot be looked at",
        )
        .evidence(format!("{gone} of {}, the first is {first}", model.images.len()))
        .advice("the names in the model are relative to a folder `images` beside it")
    });
    let all: Vec<PathBuf> = grouped.values().flatten().map(|(path, _)| path.clone()).collect();
    let first = (stamps::first_number(&all), Stamp::default());
    let mut by_camera = BTreeMap::new();
    for (camera, images) in grouped {
        let files = images.iter().map(|(path, _)| path.clone()).collect();
        let frames = stamps::counted_from(&root, files, fps, first)?;
        let poses: BTreeMap<&PathBuf, WorldFromBody> = images.iter().map(|(p, pose)| (p, *pose)).collect();
        let all = frames.stamps.iter().zip(frames.files.iter());
        let all = all.filter_map(|(s, f)| poses.get(f).map(|pose| (*s, f.clone(), *pose))).collect();
        by_camera.insert(camera, all);
    }
    Ok(Reconstruction { model, by_camera, missing })
}

fn describe(folder: &Path, settings: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let fps = settings.fps_or_assumed();
    let at = model_of(folder).unwrap_or_else(|| folder.to_path_buf());
    let (root, model) = (folder.to_path_buf(), at.clone());
    let shared = Shared::new(move || read(&root, &model, fps));
    // Which cameras there are must be known.
    let known = shared.get()?;
    let ids: Vec<u32> = known.by_camera.keys().copied().collect();
    let first =
        *ids.first().ok_or_else(|| DataError::of_kind(ErrorKind::Missing, "has no camera").at(&at))?;
    if ids.len() > 1 && ids.len() >= known.model.images.len() / 2 {
        found.doubt(
            "a-camera-an-image",
            &format!("the model has {} cameras for {} images", ids.len(), known.model.images.len()),
            "let COLMAP share one: --ImageReader.single_camera 1",
        );
    }
    let single = ids.len() == 1;
    for id in ids {
        let (own, frames, place) = (shared.clone(), shared.clone(), shared.clone());
        let from = at.join("cameras").display().to_string();
        let about = at.clone();
        found.cameras.push(CameraPart {
            name: if single { "camera".to_string() } else { format!("camera-{id}") },
            frames: Box::new(move || pictures(frames.get()?, id, &about, fps)),
            intrinsics: Box::new(move || match own.get()?.model.cameras.get(&id) {
                Some(camera) => camera.intrinsics(&from),
                None => Err(DataError::new(format!("camera {id} is not in the model"))),
            }),
            place: if id == first { Place::body() } else { Place::At(beside(place, first, id)) },
            depth: None,
        });
    }
    // Those of another camera are not those of the body.
    let (own, about) = (shared.clone(), at.clone());
    let poses = Box::new(move || {
        let frames = own.get()?.by_camera.get(&first).map_or(&[][..], Vec::as_slice);
        collected(&about, frames.iter().map(|(s, _, pose)| (*s, *pose)).collect(), Vec::new())
    });
    found.streams.push(StreamPart { name: "colmap".to_string(), read: poses });
    if has_points(&at) {
        let model = at.clone();
        found.cloud = Some(Box::new(move || SparseModel::cloud(&model)));
    }
    let body = if single { "the camera" } else { "the first camera; others are placed frame by frame" };
    found.fact(format!("the body is {body}; frames are counted at {fps} Hz"));
    found.fact("the world is the model's own: its scale and which way is up are not known");
    found.floor = Floor::Unknown;
    Ok(found)
}

fn pictures(known: &Reconstruction, id: u32, about: &Path, fps: f64) -> DataResult<Frames> {
    let frames = known.by_camera.get(&id).map_or(&[][..], Vec::as_slice);
    let mut suspicions = vec![stamps::made(about, fps)];
    suspicions.extend(known.missing.clone());
    stamps::in_order(about, frames.iter().map(|(s, f, _)| (*s, f.clone())).collect(), suspicions)
}

type At = Box<dyn Fn(Stamp) -> DataResult<BodyFromCamera> + Send + Sync>;

/// Where a camera is beside the first one, by the poses of both at a stamp.
fn beside(shared: Arc<Shared<Reconstruction>>, first: u32, id: u32) -> At {
    Box::new(move |stamp| {
        let known = shared.get()?;
        let at = |camera: u32| -> DataResult<WorldFromBody> {
            let frames = known.by_camera.get(&camera).map_or(&[][..], Vec::as_slice);
            let found = frames.binary_search_by_key(&stamp, |(s, _, _)| *s).ok();
            found.map(|i| frames[i].2).ok_or_else(|| {
                DataError::of_kind(
                    ErrorKind::Missing,
                    format!(
                        "the model has no image of camera {camera} at {stamp} ns to place camera {id} by"
                    ),
                )
                .at(&known.model.folder)
            })
        };
        let body: WorldFromBody = at(first)?;
        let camera: Rigid<_, Camera> = at(id)?.reinterpret();
        Ok(Rigid::<Body, Camera>::from_isometry(*(body.inverse() * camera).isometry()))
    })
}
