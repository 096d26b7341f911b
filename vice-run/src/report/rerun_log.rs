//! A result as a recording for the Rerun viewer: images with labels and carried points, lifted points and poses in the
//! world, and errors over time. In builds with the feature `rerun`.

use std::path::Path;

use crate::error::RunResult;
use crate::result::{OWN_ANCHOR, ResultDocument};
use rerun::{RecordingStream, RecordingStreamBuilder, entity_path};
use vice_core::camera::Pixel;
use vice_core::dataset::Dataset;
use vice_core::time::Stamp;
use vice_files::image_file::encode_jpeg;

use super::marks::{Carrier, FrameMarks, Marks};
use super::numbers::mean_by_frame;

/// The timeline that everything is on: nanoseconds of the data set's clock.
const TIMELINE: &str = "time";
const LABEL: [u8; 3] = [0, 114, 178];
const REFERENCE: [u8; 3] = [213, 94, 0];
const ESTIMATES: [[u8; 3]; 4] = [[0, 158, 115], [204, 121, 167], [240, 228, 66], [86, 180, 233]];

/// Writes the recording; it takes its name when it is complete. Images that cannot be had are warned about and left out.
pub fn write(path: &Path, document: &ResultDocument, dataset: &dyn Dataset) -> RunResult<()> {
    let unfinished = path.with_extension("rrd.part");
    let written = log_all(&unfinished, document, dataset)
        .and_then(|()| std::fs::rename(&unfinished, path).context("cannot be renamed"));
    if written.is_err() {
        // What it leaves is of no use; the error says more than this one would.
        let _ = std::fs::remove_file(&unfinished);
    }
    written.with_context(|| format!("cannot write {}", path.display()))
}

fn log_all(path: &Path, document: &ResultDocument, dataset: &dyn Dataset) -> RunResult<()> {
    let recording = RecordingStreamBuilder::new("vice").save(path)?;
    if let Some(marks) = Marks::of(document, None) {
        log_frames(&recording, document, dataset, &marks)?;
    }
    log_world(&recording, document)?;
    log_errors(&recording, document)?;
    recording.flush_blocking()?;
    Ok(())
}

fn at(recording: &RecordingStream, stamp: Stamp) {
    recording.set_timestamp_nanos_since_epoch(TIMELINE, stamp.as_nanos());
}

fn log_frames(
    recording: &RecordingStream,
    document: &ResultDocument,
    dataset: &dyn Dataset,
    marks: &Marks,
) -> RunResult<()> {
    let camera = &document.dataset.camera;
    let stamps = dataset.frames(camera)?;
    for (stamp, frame) in &marks.frames {
        at(recording, *stamp);
        let image = stamps.binary_search(stamp).ok().map(|index| dataset.image(camera, index));
        match image {
            Some(Ok(image)) => {
                let jpeg = rerun::EncodedImage::from_file_contents(encode_jpeg(&image, 80)?);
                recording.log(entity_path!["camera", "image"], &jpeg)?;
            }
            Some(Err(error)) => tracing::warn!("the recording lacks an image: {error}"),
            None => tracing::warn!("the recording lacks an image: there is no frame at {stamp} ns"),
        }
        log_points(recording, marks, frame)?;
    }
    Ok(())
}

fn log_points(recording: &RecordingStream, marks: &Marks, frame: &FrameMarks) -> RunResult<()> {
    let place = |px: Pixel| [px.u as f32, px.v as f32];
    let labels: Vec<_> =
        frame.iter().filter_map(|(name, mark)| Some((place(mark.label_px?), name.0.to_string()))).collect();
    let (places, names): (Vec<_>, Vec<_>) = labels.into_iter().unzip();
    let points =
        rerun::Points2D::new(places).with_colors([colour(LABEL)]).with_radii([4.0]).with_labels(names);
    recording.log(entity_path!["camera", "image", "label"], &points)?;
    for (index, carrier) in marks.carriers.iter().enumerate() {
        let carried = frame.values().flat_map(|m| m.carried.iter().filter(|c| c.0 == index));
        let places: Vec<_> = carried.map(|c| place(c.1)).collect();
        let points = rerun::Points2D::new(places).with_colors([colour(colour_of(carrier))]).with_radii([3.0]);
        recording.log(entity_path!["camera", "image", carrier.name.as_str()], &points)?;
    }
    Ok(())
}

fn log_world(recording: &RecordingStream, document: &ResultDocument) -> RunResult<()> {
    let f32s = |p: [f64; 3]| p.map(|v| v as f32);
    // Points are lifted in the world of their stream; that of the anchor is where the scene is.
    let placing = |name: &str| name == document.used.anchor || document.used.anchor == OWN_ANCHOR;
    for part in document.pixel.iter().filter(|p| placing(&p.stream)) {
        for keyframe in &part.keyframes {
            let Some(point) = keyframe.point_world_m else { continue };
            at(recording, keyframe.timestamp_ns);
            let path = entity_path!["world", "points", part.depth.as_str(), &*keyframe.point.0];
            let points = rerun::Points3D::new([f32s(point)]).with_colors([colour(LABEL)]).with_radii([0.02]);
            recording.log(path, &points)?;
        }
    }
    for path in &document.paths {
        let strip: Vec<[f32; 3]> = path.poses.iter().map(|p| f32s(p.position_m)).collect();
        let stream = path.stream.as_str();
        recording.log_static(entity_path!["world", stream, "path"], &rerun::LineStrips3D::new([strip]))?;
        for pose in &path.poses {
            at(recording, pose.timestamp_ns);
            let [w, x, y, z] = pose.rotation_wxyz.map(|v| v as f32);
            let rotation = rerun::Quaternion::from_xyzw([x, y, z, w]);
            let transform = rerun::Transform3D::from_translation_rotation(f32s(pose.position_m), rotation);
            recording.log(entity_path!["world", stream, "body"], &transform)?;
        }
    }
    Ok(())
}

fn log_errors(recording: &RecordingStream, document: &ResultDocument) -> RunResult<()> {
    for part in &document.pixel {
        for (stamp, error_px) in mean_by_frame(part) {
            at(recording, stamp);
            let path = entity_path!["error", "pixel_px", part.stream.as_str(), part.depth.as_str()];
            recording.log(path, &rerun::Scalars::single(error_px))?;
        }
    }
    for part in &document.trajectory {
        for frame in &part.frames {
            at(recording, frame.timestamp_ns);
            let estimate = part.estimate.as_str();
            for (name, value) in [("position_m", frame.position_m), ("angle_rad", frame.angle_rad)] {
                recording.log(entity_path!["error", name, estimate], &rerun::Scalars::single(value))?;
            }
        }
    }
    Ok(())
}

fn colour_of(carrier: &Carrier) -> [u8; 3] {
    carrier.estimate.map_or(REFERENCE, |index| ESTIMATES[index % ESTIMATES.len()])
}

fn colour([red, green, blue]: [u8; 3]) -> rerun::Color {
    rerun::Color::from_rgb(red, green, blue)
}
