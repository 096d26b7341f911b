//! How far a window has moved between two frames: Lucas and Kanade's method over a pyramid, after J.-Y. Bouguet,
//! "Pyramidal implementation of the Lucas Kanade feature tracker", 2000, with the constants of OpenCV's
//! `calcOpticalFlowPyrLK`: 21x21, thirty steps, a hundredth of a pixel.

use fearless_simd::{Simd, dispatch};
use vice_core::camera::Pixel;

use crate::pyramid::{Level, Pyramid, WINDOW_PX};
use crate::registers;
use crate::window::{Corner, Patch, Region};

const MAX_STEPS: usize = 30;
/// Squared length of a step that ends the search, pixels².
const SHORT_STEP_PX2: f32 = 0.01 * 0.01;
/// Two steps that undo each other up to this much, pixels: the search swings between two places.
const SWING_PX: f32 = 0.01;
/// Smallest eigenvalue of the mean gradient product, in the unit of OpenCV's `minEigThreshold`.
const MIN_EIGENVALUE: f32 = 1e-4;
/// That unit: OpenCV counts gradients 32 fold, then divides by 2^20.
const EIGENVALUE_UNIT: f32 = 1.0 / 1024.0;

/// Where the windows around points of one frame are in another one; `None` where that cannot be told.
///
/// Each point is on its own: an order of points changes nothing. Nothing is checked backwards. In definition this is
/// OpenCV's `calcOpticalFlowPyrLK` with its default arguments, over as many levels as both pyramids have.
pub fn track_translation(prev: &Pyramid, next: &Pyramid, points: &[Pixel]) -> Vec<Option<Pixel>> {
    let mut found = Vec::with_capacity(points.len());
    dispatch!(registers::level(), simd => track_all(simd, prev, next, points, &mut found));
    found
}

/// The same for one point whose place in the next frame is supposed to be near `start`.
pub(crate) fn track_one(prev: &Pyramid, next: &Pyramid, from: Pixel, start: Pixel) -> Option<Pixel> {
    dispatch!(registers::level(), simd => simd.vectorize(
        #[inline(always)]
        || Search::new().track(simd, prev, next, from, start)
    ))
}

#[inline(always)]
fn track_all<S: Simd>(
    simd: S,
    prev: &Pyramid,
    next: &Pyramid,
    points: &[Pixel],
    found: &mut Vec<Option<Pixel>>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut search = Search::new();
            // No iterator adaptor: what it calls would not be compiled for the vectors of this machine.
            for point in points {
                found.push(search.track(simd, prev, next, *point, *point));
            }
        },
    );
}

/// What is needed at one level, kept from point to point since it is large.
struct Search {
    patch: Patch,
    region: Region,
}

impl Search {
    const fn new() -> Self {
        Self { patch: Patch::empty(), region: Region::empty() }
    }

    #[inline(always)]
    fn track<S: Simd>(
        &mut self,
        simd: S,
        prev: &Pyramid,
        next: &Pyramid,
        from: Pixel,
        start: Pixel,
    ) -> Option<Pixel> {
        if ![from.u, from.v, start.u, start.v].iter().all(|x| x.abs() < 1e6) {
            return None;
        }
        let levels = prev.levels().len().min(next.levels().len());
        let top_scale = 0.5_f32.powi(levels as i32 - 1);
        let mut place = [start.u as f32 * top_scale, start.v as f32 * top_scale];
        let mut found = false;
        for level in (0..levels).rev() {
            let scale = 0.5_f32.powi(level as i32);
            let from = [from.u as f32 * scale, from.v as f32 * scale];
            // A level that cannot tell leaves the place to the next finer one.
            found = self.track_level(simd, &prev.levels()[level], &next.levels()[level], from, &mut place);
            if level > 0 {
                place = place.map(|x| 2.0 * x);
            }
        }
        found.then(|| Pixel::new(f64::from(place[0]), f64::from(place[1])))
    }

    /// Improves `place`; whether it could.
    #[inline(always)]
    fn track_level<S: Simd>(
        &mut self,
        simd: S,
        prev: &Level,
        next: &Level,
        from: [f32; 2],
        place: &mut [f32; 2],
    ) -> bool {
        let corner = Corner::of_window(from);
        if !corner.touches(prev) {
            return false;
        }
        self.patch.cut(simd, prev, corner);
        let [xx, xy, yy] = self.patch.structure(simd);
        let determinant = xx * yy - xy * xy;
        let smaller = (xx + yy - ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt()) / 2.0;
        let pixels = (WINDOW_PX * WINDOW_PX) as f32;
        if smaller * EIGENVALUE_UNIT / pixels < MIN_EIGENVALUE
            || determinant * EIGENVALUE_UNIT.powi(2) < f32::EPSILON
        {
            return false;
        }
        self.region.forget();
        let mut last_step = [0.0_f32; 2];
        for i in 0..MAX_STEPS {
            let corner = Corner::of_window(*place);
            if !corner.touches(next) {
                return false;
            }
            self.region.cover(next, corner);
            let [bx, by] = self.patch.mismatch(simd, &self.region, corner);
            let step = [(xy * by - yy * bx) / determinant, (xy * bx - xx * by) / determinant];
            *place = [place[0] + step[0], place[1] + step[1]];
            if step[0] * step[0] + step[1] * step[1] <= SHORT_STEP_PX2 {
                break;
            }
            if i > 0 && (0..2).all(|k| (step[k] + last_step[k]).abs() < SWING_PX) {
                *place = [place[0] - step[0] / 2.0, place[1] - step[1] / 2.0];
                break;
            }
            last_step = step;
        }
        true
    }
}
