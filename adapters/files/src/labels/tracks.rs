//! Dense tracks of anyone's tracker as labels: arrays of the shape (frames, points, 2), as CoTracker and TAPIR write them.
//!
//! An archive has them as `tracks`, `pred_tracks`, `trajectories` or `points`, and whether they are seen as `visibility`,
//! `pred_visibility`, `visibilities`, `visibles` or `visible`, or the other way round as `occluded`. A batch of one in
//! front is passed over; (points, frames, 2) is turned where only that fits the number of frames. Numbers of a visibility are
//! seen from 0.5 on. A place that is not finite is not seen.
//!
//! A track keeps its point through what hides it, so it is one segment: it starts where the point is first seen.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::label::{LabelSet, LabelSetBuilder, Observation, ObservationSource};
use vice_core::time::Stamp;

use super::label_error;
use super::npy::{self, Array};

const TRACKS: [&str; 4] = ["tracks", "pred_tracks", "trajectories", "points"];
const SEEN: [&str; 5] = ["visibility", "pred_visibility", "visibilities", "visibles", "visible"];
const HIDDEN: [&str; 2] = ["occluded", "occlusion"];

/// How places of tracks are meant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TracksOptions<'a> {
    /// Name of the tracker.
    pub tool: Option<&'a str>,
    /// Columns and rows of the pictures that were tracked, where they were made smaller or larger.
    pub size_px: Option<[u32; 2]>,
    /// (0, 0) is the corner of the top left pixel, as TAPIR has it, and not its centre.
    pub from_corner: bool,
}

/// Whether bytes are an array of NumPy or an archive of some.
pub fn is_tracks(bytes: &[u8]) -> bool {
    bytes.starts_with(npy::NPY) || bytes.starts_with(npy::NPZ) && first_name(bytes).ends_with(b".npy")
}

/// The same of a file, of which no more is read than that takes. One that cannot be read is none.
pub fn is_tracks_file(path: impl AsRef<Path>) -> bool {
    const HEAD_BYTES: u64 = 4096;
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD_BYTES).read_to_end(&mut head));
    read.is_ok() && is_tracks(&head)
}

/// The name of the first file in a ZIP archive: spreadsheets are such archives too.
fn first_name(archive: &[u8]) -> &[u8] {
    const LENGTH_AT: usize = 26;
    const NAME_AT: usize = 30;
    match archive.get(LENGTH_AT..LENGTH_AT + 2) {
        Some([low, high]) => {
            archive.get(NAME_AT..NAME_AT + usize::from(u16::from_le_bytes([*low, *high]))).unwrap_or_default()
        }
        _ => &[],
    }
}

/// Labels of tracks through the frames of these stamps, in images of so many columns and rows. Places outside of the
/// image are left out: their number is the second part of the answer.
///
/// # Errors
/// [`DataError`] if the bytes hold no such array, or one of another number of frames.
pub fn read_tracks(
    bytes: &[u8],
    frame_stamps: &[Stamp],
    image_px: [u32; 2],
    options: &TracksOptions<'_>,
) -> DataResult<(LabelSet, usize)> {
    let arrays = npy::read(bytes)?;
    let named =
        |names: &[&str]| names.iter().find_map(|name| arrays.iter().find(|(n, _)| n == name)).map(|(_, a)| a);
    let tracks = match arrays.as_slice() {
        [(name, only)] if name.is_empty() => Some(only),
        _ => named(&TRACKS),
    };
    let tracks = tracks.ok_or_else(|| {
        let names: Vec<&str> = arrays.iter().map(|(n, _)| n.as_str()).collect();
        DataError::of_kind(
            ErrorKind::Missing,
            format!("the archive has no `tracks`; it has {}", names.join(", ")),
        )
        .hint("save the places as `tracks`, of the shape (frames, points, 2), and `visibility`")
    })?;
    let layout = Layout::of(tracks, frame_stamps.len())?;
    let (seen, negate) = match (named(&SEEN), named(&HIDDEN)) {
        (Some(seen), _) => (Some(seen), false),
        (None, hidden) => (hidden, true),
    };
    if let Some(seen) = seen {
        layout.check_seen(seen)?;
    }
    let [width, height] = image_px.map(f64::from);
    let mut builder = LabelSetBuilder::default();
    let mut outside = 0;
    for point in 0..layout.points {
        let name = point.to_string();
        let mut begun = false;
        for (frame, stamp) in frame_stamps.iter().enumerate() {
            let at = layout.index(frame, point);
            let is_seen = seen.is_none_or(|s| (s.values[at] >= 0.5) != negate);
            let place = [tracks.values[2 * at], tracks.values[2 * at + 1]];
            if !is_seen || !place.iter().all(|v| v.is_finite()) {
                continue;
            }
            let px = meant(place, image_px, options);
            if !(px.u >= -0.5 && px.v >= -0.5 && px.u < width - 0.5 && px.v < height - 0.5) {
                outside += 1;
                continue;
            }
            let keyframe = !std::mem::replace(&mut begun, true);
            let observation =
                Observation { source: ObservationSource::Auto, keyframe, ..Observation::manual(*stamp, px) };
            builder.push(&name, observation).map_err(label_error)?;
        }
    }
    let mut labels = builder.finish().map_err(label_error)?;
    if labels.points().is_empty() {
        return Err(DataError::new("no point is seen in any frame"));
    }
    labels.tool = options.tool.map(str::to_string);
    Ok((labels, outside))
}

fn meant([u, v]: [f64; 2], [width, height]: [u32; 2], options: &TracksOptions<'_>) -> Pixel {
    // From the corner of the image, then to its own size, then from the centre of its first pixel.
    let corner = if options.from_corner { 0.0 } else { 0.5 };
    let scale = |own: u32, tracked: fn([u32; 2]) -> u32| {
        options.size_px.map_or(1.0, |size| f64::from(own) / f64::from(tracked(size)))
    };
    Pixel::new((u + corner) * scale(width, |s| s[0]) - 0.5, (v + corner) * scale(height, |s| s[1]) - 0.5)
}

/// Which index counts what.
struct Layout {
    frames: usize,
    points: usize,
    /// Points come before frames.
    turned: bool,
}

impl Layout {
    fn of(tracks: &Array, frames: usize) -> DataResult<Self> {
        let shape = match tracks.shape.as_slice() {
            [1, rest @ ..] if rest.len() == 3 => rest,
            all => all,
        };
        let &[first, second, 2] = shape else {
            return Err(DataError::new(format!(
                "the tracks have the shape {:?}, not (frames, points, 2)",
                tracks.shape
            )));
        };
        match (first == frames, second == frames) {
            (true, _) => Ok(Self { frames, points: second, turned: false }),
            (false, true) => Ok(Self { frames, points: first, turned: true }),
            _ => Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!("the tracks are of {first} frames ({:?}), and {frames} were asked for", tracks.shape),
            )
            .hint("say which frames were tracked with `start`, `duration` and `fps`")),
        }
    }

    fn index(&self, frame: usize, point: usize) -> usize {
        if self.turned { point * self.frames + frame } else { frame * self.points + point }
    }

    fn check_seen(&self, seen: &Array) -> DataResult<()> {
        let count = self.frames * self.points;
        if seen.values.len() == count {
            return Ok(());
        }
        Err(DataError::of_kind(
            ErrorKind::Contradictory,
            format!("the visibility has the shape {:?}, and there are {count} places", seen.shape),
        ))
    }
}

#[cfg(test)]
mod tests;
