//! Where to put new points: corners that can be tracked, spread over the image.

use vice_core::camera::Pixel;

use crate::tracker::{Corner, Pyramid, corners, lookalike};

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
