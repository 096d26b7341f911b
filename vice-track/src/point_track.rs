//! One point from frame to frame.

use std::sync::Arc;

use nalgebra::Matrix2;
use vice_core::camera::Pixel;

use crate::affine::{Match, NoMatch, Template, Warp};
use crate::lucas_kanade::track_one;
use crate::pyramid::Pyramid;

/// Under this confidence an observation is doubtful: a person should look at it.
pub const DOUBT_CONFIDENCE: f64 = 0.5;

/// The looks of a point are taken anew when it has become this much smaller or larger.
const REFRESH_SCALES: [f64; 2] = [0.77, 1.3];
/// And only where it is seen this well.
const REFRESH_CORRELATION: f64 = 0.9;

/// When tracking stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackOptions {
    /// Under this confidence the point is lost; 0.2 by default.
    pub stop_confidence: f64,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self { stop_confidence: 0.2 }
    }
}

/// Why a point cannot be tracked from where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// What surrounds it is not all in the image.
    #[error("the point is too near to the border of the image to be tracked")]
    AtBorder,
    /// There is nothing around it to recognise.
    #[error("the surroundings of the point are too even to be tracked")]
    NoTexture,
}

/// What became of a point in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// Found.
    Tracked,
    /// Found, and its looks had changed so much that they were taken anew from this frame.
    Refreshed,
    /// It has left the image, or what surrounds it has: tracking has ended.
    LeftImage,
    /// Not found, or not to be trusted: tracking has ended.
    Lost,
}

impl Outcome {
    /// Whether the point was found, so that its place is an observation.
    pub const fn is_found(self) -> bool {
        matches!(self, Self::Tracked | Self::Refreshed)
    }
}

/// A point in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Where it is; where it was last, if it was not found.
    pub px: Pixel,
    /// 0 to 1; under [`DOUBT_CONFIDENCE`] it is doubtful. 0 if it was not found.
    pub confidence: f64,
    /// What became of it.
    pub outcome: Outcome,
}

/// A point that is carried from frame to frame.
///
/// The window around it is found from the frame before; then its place is made exact against the template of the frame
/// that tracking started from, so that small errors do not add up.
#[derive(Clone, Debug)]
pub struct PointTrack {
    frame: Arc<Pyramid>,
    template: Template,
    warp: Warp,
    /// Motion of the last step, pixels.
    motion: [f64; 2],
    refreshes: usize,
    ended: Option<Outcome>,
    options: TrackOptions,
}

impl PointTrack {
    /// Starts from an observation.
    ///
    /// # Errors
    /// [`TrackError`] if the point is too near to the border or its surroundings are too even.
    pub fn start(frame: &Arc<Pyramid>, px: Pixel, options: TrackOptions) -> Result<Self, TrackError> {
        if !has_room(frame, px) {
            return Err(TrackError::AtBorder);
        }
        let template = Template::cut(frame.base(), px).ok_or(TrackError::NoTexture)?;
        Ok(Self {
            frame: Arc::clone(frame),
            template,
            warp: Warp { linear: Matrix2::identity(), at: px },
            motion: [0.0; 2],
            refreshes: 0,
            ended: None,
            options,
        })
    }

    /// Where the point is in the last frame in which it was found.
    pub fn px(&self) -> Pixel {
        self.warp.at
    }

    /// How often its looks were taken anew.
    pub const fn refreshes(&self) -> usize {
        self.refreshes
    }

    /// Finds the point in the next frame, whether that is later or earlier in time.
    ///
    /// `seed` is where it is expected, from ego-motion for instance. It moves the start of the search only: where the
    /// image shows the point elsewhere, it is found there.
    pub fn step(&mut self, next: &Arc<Pyramid>, seed: Option<Pixel>) -> Step {
        let step = match self.ended {
            Some(outcome) => self.nothing(outcome),
            None => self.search(next, seed),
        };
        if !step.outcome.is_found() {
            self.ended = Some(step.outcome);
        }
        step
    }

    fn nothing(&self, outcome: Outcome) -> Step {
        Step { px: self.warp.at, confidence: 0.0, outcome }
    }

    fn search(&mut self, next: &Arc<Pyramid>, seed: Option<Pixel>) -> Step {
        let from = self.warp.at;
        let ahead = Pixel::new(from.u + self.motion[0], from.v + self.motion[1]);
        let mut best: Option<(Pixel, f64)> = None;
        for start in [seed, Some(ahead), Some(from)].into_iter().flatten() {
            let Some(px) = track_one(&self.frame, next, from, start) else { continue };
            // The way back starts as far off as the way there did.
            let back_start = Pixel::new(px.u + from.u - start.u, px.v + from.v - start.v);
            let Some(back) = track_one(next, &self.frame, px, back_start) else { continue };
            let off_px = back.distance_px(from);
            if best.is_none_or(|(_, other)| off_px < other) {
                best = Some((px, off_px));
            }
            if off_px < 0.2 {
                break;
            }
        }
        let Some((flow, back_px)) = best else {
            return self.nothing(if has_room(next, ahead) { Outcome::Lost } else { Outcome::LeftImage });
        };
        if !has_room(next, flow) {
            return self.nothing(Outcome::LeftImage);
        }
        let found = self.template.find(next.base(), Warp { at: flow, ..self.warp });
        let Match { warp, correlation } = match found {
            Ok(found) => found,
            Err(NoMatch::Outside) => return self.nothing(Outcome::LeftImage),
            Err(NoMatch::Lost) => return self.nothing(Outcome::Lost),
        };
        let jump_px = warp.at.distance_px(flow);
        let confidence = confidence(back_px, jump_px, correlation);
        if confidence < self.options.stop_confidence {
            return self.nothing(Outcome::Lost);
        }
        self.motion = [warp.at.u - from.u, warp.at.v - from.v];
        self.warp = warp;
        self.frame = Arc::clone(next);
        let mut outcome = Outcome::Tracked;
        let [largest, smallest] = warp.scales();
        // Never because it is seen less well: what comes in front of a point would become its looks bit by bit.
        let rescaled = largest > REFRESH_SCALES[1] || smallest < REFRESH_SCALES[0];
        if rescaled
            && correlation > REFRESH_CORRELATION
            && let Some(template) = Template::cut(next.base(), warp.at)
        {
            self.template = template;
            self.warp.linear = Matrix2::identity();
            self.refreshes += 1;
            outcome = Outcome::Refreshed;
        }
        Step { px: warp.at, confidence, outcome }
    }
}

/// Falls from 1 to 0 as the way back misses, as flow and template disagree and as the template is seen less well.
fn confidence(back_px: f64, jump_px: f64, correlation: f64) -> f64 {
    let fall = |x: f64, half: f64| 1.0 / (1.0 + (x / half).powi(4));
    let seen = ((correlation - 0.8) / 0.14).clamp(0.0, 1.0);
    fall(back_px, 1.0) * fall(jump_px, 1.5) * seen
}

/// Whether the surroundings of a point are all in the image.
fn has_room(frame: &Pyramid, px: Pixel) -> bool {
    let margin = f64::from(crate::affine::REACH_PX) + 2.0;
    px.u >= margin
        && px.v >= margin
        && px.u <= frame.width() as f64 - 1.0 - margin
        && px.v <= frame.height() as f64 - 1.0 - margin
}
