//! Where to put new points: corners that can be tracked, spread over the image.

use vice_core::camera::Pixel;

use crate::corners::{Corner, corners};
use crate::lookalike::lookalike;
use crate::pyramid::Pyramid;

/// Corners with a smaller share than this of the best one's score are no suggestions.
const MIN_SHARE: f64 = 0.15;
/// Gray levels a pixel under which a corner is noise.
const MIN_SCORE: f64 = 2.0;
/// A place of which another one beside it looks this much alike (correlation) is no suggestion.
const MAX_LOOKALIKE: f64 = 0.75;
/// Of so many candidates, best first, suggestions are chosen.
const MAX_CANDIDATES: usize = 4000;

/// What suggested points must satisfy.
#[derive(Clone, Copy)]
pub struct SuggestOptions<'a> {
    /// Least distance between two of them, and to the points in `taken`, pixels.
    pub min_distance_px: f64,
    /// Least distance to the border of the image, pixels.
    pub border_px: f64,
    /// Points that are there already.
    pub taken: &'a [Pixel],
    /// What else is asked of a place: that there is depth, or that it is on the floor. Called for few places only.
    pub accept: &'a dyn Fn(Pixel) -> bool,
}

/// A suggested point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suggestion {
    /// Where.
    pub px: Pixel,
    /// How well it can be tracked, larger is better: see [`Corner::score`].
    pub score: f64,
}

impl Default for SuggestOptions<'_> {
    /// Thirty pixels apart and from the border, everything accepted.
    fn default() -> Self {
        Self { min_distance_px: 30.0, border_px: 30.0, taken: &[], accept: &|_| true }
    }
}

/// At most `count` points to label, the best choice first; fewer where the image has no more.
///
/// One after the other is chosen for its score and for its distance to those that are there already. Places that are
/// seen again beside themselves, as in bricks, are passed over.
pub fn suggest(image: &Pyramid, count: usize, options: &SuggestOptions<'_>) -> Vec<Suggestion> {
    let mut candidates = corners(image, options.border_px);
    let best = candidates.first().map_or(0.0, |c| c.score);
    candidates.retain(|c| c.score >= (best * MIN_SHARE).max(MIN_SCORE));
    candidates.truncate(MAX_CANDIDATES);
    // As far apart as that is spread well enough.
    let far_px = 0.35 * (image.width() as f64).hypot(image.height() as f64);
    let mut apart_px: Vec<f64> = candidates
        .iter()
        .map(|c| options.taken.iter().map(|t| t.distance_px(c.px)).fold(f64::INFINITY, f64::min))
        .collect();
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let worth = |i: usize, c: &Corner| (c.score / best).sqrt() * (apart_px[i].min(far_px) / far_px);
        let next = (0..candidates.len())
            .filter(|i| apart_px[*i] >= options.min_distance_px.max(f64::MIN_POSITIVE))
            // The first of equals.
            .rev()
            .max_by(|a, b| worth(*a, &candidates[*a]).total_cmp(&worth(*b, &candidates[*b])));
        let Some(next) = next else { break };
        let Corner { px, score } = candidates[next];
        if lookalike(image, px) > MAX_LOOKALIKE || !(options.accept)(px) {
            apart_px[next] = 0.0;
            continue;
        }
        chosen.push(Suggestion { px, score });
        for (apart, candidate) in apart_px.iter_mut().zip(&candidates) {
            *apart = apart.min(px.distance_px(candidate.px));
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::dataset::{Image, PixelFormat};

    /// Gray with bright squares of 8 pixels: four corners each.
    fn squares(at: &[[u32; 2]]) -> Pyramid {
        let mut gray = vec![60_u8; 320 * 240];
        for [left, top] in at {
            for (x, y) in (0..8).flat_map(|y| (0..8).map(move |x| (x, y))) {
                gray[((top + y) * 320 + left + x) as usize] = 200;
            }
        }
        Pyramid::new(&Image::new(320, 240, PixelFormat::Gray8, gray).unwrap(), 3).unwrap()
    }

    #[test]
    fn suggestions_lie_on_corners_and_far_apart() {
        let image = squares(&[[60, 60], [66, 90], [250, 60], [250, 170], [60, 170], [150, 120], [5, 5]]);
        let found = suggest(&image, 4, &SuggestOptions::default());
        assert_eq!(found.len(), 4);
        for (i, a) in found.iter().enumerate() {
            assert!(found[i + 1..].iter().all(|b| a.px.distance_px(b.px) > 80.0), "{found:?}");
            assert!(a.px.u >= 30.0 && a.px.v >= 30.0, "{found:?}");
        }
        // A corner of a square lies between two pixels.
        let corner = found.iter().find(|s| s.px.u > 200.0 && s.px.v < 100.0).unwrap();
        let near = [249.5, 257.5].iter().any(|u| (corner.px.u - u).abs() < 2.5);
        assert!(near, "{corner:?}");
        let taken = [found[0].px];
        let accept = |px: Pixel| px.u < 200.0;
        let others =
            suggest(&image, 9, &SuggestOptions { taken: &taken, accept: &accept, ..Default::default() });
        assert!(!others.is_empty() && others.iter().all(|s| s.px.u < 200.0));
        assert!(others.iter().all(|s| s.px.distance_px(taken[0]) >= 30.0));
    }

    #[test]
    fn an_even_image_has_none() {
        assert!(suggest(&squares(&[]), 4, &SuggestOptions::default()).is_empty());
        let tiny = Image::new(3, 2, PixelFormat::Gray8, vec![1; 6]).unwrap();
        assert!(suggest(&Pyramid::new(&tiny, 3).unwrap(), 4, &SuggestOptions::default()).is_empty());
    }
}
