//! Frames of a run as JPEGs for a page, small ones of its course and whole ones of its worst moments, within a budget of
//! bytes; and pieces around its points.

use std::collections::{BTreeMap, BTreeSet};

use crate::result::ResultDocument;
use vice_core::dataset::{Dataset, Image};
use vice_core::error::{DataError, DataResult, one_line};
use vice_core::time::Stamp;
use vice_files::image_file::{encode_jpeg, shrink};

use super::crops::{self, PointPieces};
use super::marks::Marks;
use super::moments::{Moment, worst_moments};

/// Columns of a picture: what a phone or half a screen shows.
const MAX_COLUMNS: u32 = 640;
const QUALITY: u8 = 62;
/// Of a picture at full resolution, in which people look for what went wrong.
const FULL_QUALITY: u8 = 78;
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
    /// The worst moments at full resolution, the worst first.
    pub(crate) moments: Vec<(Moment, Shot)>,
    /// How many more worst moments there are than fit the budget.
    pub(crate) moments_left_out: usize,
    /// Pieces around each point, the worst point first.
    pub(crate) pieces: Vec<PointPieces>,
    /// Why there are fewer than there could be.
    pub problem: Option<String>,
}

impl Shots {
    /// No pictures, with the reason.
    pub fn missing(problem: impl Into<String>) -> Self {
        Self { problem: Some(problem.into()), ..Self::default() }
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
        let (mut failed, mut first) = (0_usize, None);
        let moments = worst_moments(&marks);
        let mut shots = Self { pieces: crops::wanted(&marks), ..Self::default() };
        let mut of_moments: Vec<Option<Shot>> = moments.iter().map(|_| None).collect();
        // In the order of time, in which films are decoded, and each once.
        let of_pieces = shots.pieces.iter().flat_map(|p| p.pieces.iter().map(|piece| piece.stamp));
        let all: BTreeSet<Stamp> =
            wanted.iter().copied().chain(moments.iter().map(|m| m.stamp)).chain(of_pieces).collect();
        let small: BTreeSet<Stamp> = wanted.iter().copied().collect();
        for (done, stamp) in all.iter().enumerate() {
            progress(done, all.len());
            let image = match frames.binary_search(stamp) {
                Ok(index) => dataset.image(camera, index),
                Err(_) => Err(DataError::new(format!("{} has no frame at {stamp} ns", dataset.name()))),
            };
            let made = image.and_then(|image| {
                if small.contains(stamp) {
                    shots.frames.insert(*stamp, shot(&shrink(&image, MAX_COLUMNS)?, &image, QUALITY)?);
                }
                for (_, made) in moments.iter().zip(&mut of_moments).filter(|(m, _)| m.stamp == *stamp) {
                    *made = Some(shot(&image, &image, FULL_QUALITY)?);
                }
                let pieces = shots.pieces.iter_mut().flat_map(|p| &mut p.pieces);
                for piece in pieces.filter(|p| p.stamp == *stamp) {
                    piece.png = crops::cut(&image, piece.at)?;
                }
                Ok(())
            });
            if let Err(error) = made {
                failed += 1;
                first.get_or_insert_with(|| one_line(&error));
            }
        }
        shots.problem = first.map(|why| {
            format!("{failed} of {} pictures cannot be shown, the first because: {why}", all.len())
        });
        shots.keep_within(&wanted, budget_bytes / 2);
        shots.keep_moments(moments.into_iter().zip(of_moments), budget_bytes / 2);
        shots
    }

    /// Keeps the worst moments that fit.
    fn keep_moments(&mut self, moments: impl Iterator<Item = (Moment, Option<Shot>)>, budget_bytes: usize) {
        let mut left = budget_bytes;
        for (moment, shot) in moments.filter_map(|(moment, shot)| Some((moment, shot?))) {
            match left.checked_sub(shot.jpeg.len()) {
                Some(rest) => {
                    left = rest;
                    self.moments.push((moment, shot));
                }
                None => self.moments_left_out += 1,
            }
        }
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

/// A picture of an image, as marks are given in that.
fn shot(picture: &Image, of: &Image, quality: u8) -> DataResult<Shot> {
    Ok(Shot { jpeg: encode_jpeg(picture, quality)?, size_px: [of.width(), of.height()] })
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
