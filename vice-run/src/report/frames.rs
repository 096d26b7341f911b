//! Frames of a run as small JPEGs for a page, within a budget of bytes.

use std::collections::BTreeMap;

use crate::result::ResultDocument;
use vice_core::dataset::{Dataset, Image};
use vice_core::error::one_line;
use vice_core::time::Stamp;
use vice_files::image_file::{encode_jpeg, shrink};

use super::marks::Marks;

/// Columns of a picture: what a phone or half a screen shows.
const MAX_COLUMNS: u32 = 640;
const QUALITY: u8 = 62;
/// Pictures a page shows of a run: a person looks at some, not at hundreds.
const MAX_FRAMES: usize = 40;

/// A frame as a JPEG, and the size of the image that marks are given in.
pub struct Shot {
    /// The JPEG.
    pub jpeg: Vec<u8>,
    /// Columns and rows of the image that it was made from.
    pub size_px: [u32; 2],
}

/// The pictures of one document by their stamps, and why there are fewer than there could be.
#[derive(Default)]
pub struct Shots {
    /// The pictures.
    pub frames: BTreeMap<Stamp, Shot>,
    /// Why there are fewer than there could be.
    pub problem: Option<String>,
}

impl Shots {
    /// No pictures, with the reason.
    pub fn missing(problem: impl Into<String>) -> Self {
        Self { frames: BTreeMap::new(), problem: Some(problem.into()) }
    }

    /// Decodes the frames most worth a look, as many as fit the budget. Images that cannot be had are no failure: the
    /// page says so and shows the rest.
    pub fn of(
        document: &ResultDocument,
        dataset: &dyn Dataset,
        budget_bytes: usize,
        progress: &dyn Fn(usize, usize),
    ) -> Self {
        let Some(marks) = Marks::of(document, None) else {
            return Self::missing("the result lists no samples, so that there is nothing to draw");
        };
        let camera = &document.dataset.camera;
        let frames = match dataset.frames(camera) {
            Ok(frames) => frames,
            Err(error) => return Self::missing(one_line(&error)),
        };
        let wanted: Vec<Stamp> = marks.by_interest().into_iter().take(MAX_FRAMES).collect();
        let mut shots = Self::default();
        let (mut failed, mut first) = (0, None);
        // In the order of time, in which films are decoded.
        let mut in_time: Vec<Stamp> = wanted.clone();
        in_time.sort_unstable();
        for (done, stamp) in in_time.iter().enumerate() {
            progress(done, in_time.len());
            let shot = match frames.binary_search(stamp) {
                Ok(index) => dataset.image(camera, index).and_then(|image| shot(&image)),
                Err(_) => Err(vice_core::error::DataError::new(format!(
                    "{} has no frame at {stamp} ns",
                    dataset.name()
                ))),
            };
            match shot {
                Ok(shot) => {
                    shots.frames.insert(*stamp, shot);
                }
                Err(error) => {
                    failed += 1;
                    first.get_or_insert_with(|| one_line(&error));
                }
            }
        }
        shots.problem = first.map(|why| {
            format!("{failed} of {} pictures cannot be shown, the first because: {why}", in_time.len())
        });
        shots.keep_within(&wanted, budget_bytes);
        shots
    }

    /// Leaves out what is least worth a look.
    fn keep_within(&mut self, by_interest: &[Stamp], budget_bytes: usize) {
        let mut left = budget_bytes;
        for stamp in by_interest {
            let Some(shot) = self.frames.get(stamp) else { continue };
            match left.checked_sub(shot.jpeg.len()) {
                Some(rest) => left = rest,
                None => {
                    self.frames.remove(stamp);
                }
            }
        }
    }
}

fn shot(image: &Image) -> vice_core::error::DataResult<Shot> {
    let small = shrink(image, MAX_COLUMNS)?;
    Ok(Shot { jpeg: encode_jpeg(&small, QUALITY)?, size_px: [image.width(), image.height()] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_interesting_frames_keep_the_budget() {
        let stamps: Vec<Stamp> = (0..4).map(Stamp::from_nanos).collect();
        let mut shots = Shots::default();
        for (stamp, bytes) in stamps.iter().zip([10, 90, 10, 10]) {
            shots.frames.insert(*stamp, Shot { jpeg: vec![0; bytes], size_px: [1, 1] });
        }
        shots.keep_within(&[stamps[2], stamps[1], stamps[0], stamps[3]], 30);
        assert_eq!(shots.frames.keys().copied().collect::<Vec<_>>(), [stamps[0], stamps[2], stamps[3]]);
    }
}
