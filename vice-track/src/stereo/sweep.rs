//! A neighbourhood carried along its ray into the second camera, and where it looks alike there.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use vice_core::camera::{Camera, Pixel};
use vice_core::frames::{self, Rigid};

use crate::pyramid::Pyramid;
use crate::sampler::sample;

/// Half the side of the neighbourhood, pixels.
const HALF_PX: i32 = 6;
/// Pixels of a neighbourhood.
const COUNT: usize = ((2 * HALF_PX + 1) * (2 * HALF_PX + 1)) as usize;

/// Nothing nearer is looked for, metres.
const NEAREST_M: f64 = 0.1;
/// Steps along the ray: at most so far apart in the second image, pixels, and never more than these.
const STEP_PX: f64 = 0.7;
const MOST_STEPS: usize = 2048;

/// Correlation below which nothing is alike.
const ALIKE: f64 = 0.75;
/// A second place that is nearly as much alike makes both doubtful.
const RIVAL: f64 = 0.05;
/// Places nearer than this are one, pixels.
const ONE_PLACE_PX: f64 = 4.0;
/// Gray levels of deviation below which a neighbourhood shows nothing.
const FLAT: f64 = 2.0;

/// Two images of one time, and how their cameras are placed.
pub(super) struct Pair<'a> {
    pub(super) first: Arc<Pyramid>,
    pub(super) second: Arc<Pyramid>,
    pub(super) cameras: [&'a Camera; 2],
    pub(super) second_from_first: Rigid<frames::Camera, frames::Camera>,
}

/// Where a pixel's ray looks like the pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// One over the depth in the first camera, 1/m.
    pub(super) inverse_m: f64,
    /// The place in the second image.
    pub(super) px: Pixel,
    /// How fast that place moves along the line, pixels for each 1/m.
    pub(super) px_per_inverse_m: f64,
}

/// The neighbourhood of a pixel, and the rays of its pixels turned into the second camera's frame.
pub(super) struct Sweep<'a> {
    pair: &'a Pair<'a>,
    turned: Vec<Vector3<f64>>,
    /// Gray values with the mean taken off, of length 1.
    looks: [f64; COUNT],
}

/// Gray values with the mean taken off, of length 1; `None` where they show nothing.
fn normed(mut values: [f64; COUNT]) -> Option<[f64; COUNT]> {
    let mean = values.iter().sum::<f64>() / COUNT as f64;
    values.iter_mut().for_each(|v| *v -= mean);
    let length = values.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length.is_nan() || length < FLAT * (COUNT as f64).sqrt() {
        return None;
    }
    values.iter_mut().for_each(|v| *v /= length);
    Some(values)
}

impl<'a> Sweep<'a> {
    /// `None` where the neighbourhood is not all in the image and seen by the lens, or shows nothing.
    pub(super) fn new(pair: &'a Pair<'a>, px: Pixel) -> Option<Self> {
        let (mut values, mut turned) = ([0.0; COUNT], Vec::with_capacity(COUNT));
        let offsets = (-HALF_PX..=HALF_PX).flat_map(|v| (-HALF_PX..=HALF_PX).map(move |u| (u, v)));
        for (value, (u, v)) in values.iter_mut().zip(offsets) {
            let place = Pixel::new(px.u + f64::from(u), px.v + f64::from(v));
            *value = sample(pair.first.base(), place)?;
            turned.push(pair.second_from_first.rotate(&pair.cameras[0].unproject(place).ok()?));
        }
        Some(Self { pair, turned, looks: normed(values)? })
    }

    /// The place of a ray at one over a depth: projecting does not see the scale, so that infinity is no other depth.
    fn place(&self, ray: &Vector3<f64>, inverse_m: f64) -> Option<Pixel> {
        let point = ray + self.pair.second_from_first.translation() * inverse_m;
        self.pair.cameras[1].project(&Point3::from(point)).ok()
    }

    fn centre(&self, inverse_m: f64) -> Option<Pixel> {
        self.place(&self.turned[COUNT / 2], inverse_m)
    }

    /// How much the neighbourhood looks alike at a depth: the correlation, -1 to 1.
    fn alike(&self, inverse_m: f64) -> Option<f64> {
        let mut values = [0.0; COUNT];
        for (value, ray) in values.iter_mut().zip(&self.turned) {
            *value = sample(self.pair.second.base(), self.place(ray, inverse_m)?)?;
        }
        let values = normed(values)?;
        Some(values.iter().zip(&self.looks).map(|(a, b)| a * b).sum())
    }

    /// The depth at which the neighbourhood looks most alike, where it is the only one.
    pub(super) fn best(&self) -> Option<Found> {
        let steps = self.steps();
        let alike: Vec<f64> = steps.iter().map(|(q, _)| self.alike(*q).unwrap_or(-1.0)).collect();
        let best = (0..steps.len()).max_by(|a, b| alike[*a].total_cmp(&alike[*b]))?;
        if alike[best] < ALIKE {
            return None;
        }
        let rival = (0..steps.len())
            .filter(|i| steps[*i].1.distance_px(steps[best].1) > ONE_PLACE_PX)
            .any(|i| alike[i] > alike[best] - RIVAL);
        if rival || best == 0 || best + 1 == steps.len() {
            return None;
        }
        let inverse_m = self.top(steps[best - 1].0, steps[best + 1].0);
        let (px, off) = (self.centre(inverse_m)?, 1e-4 * inverse_m);
        let beside = [self.centre(inverse_m - off)?, self.centre(inverse_m + off)?];
        Some(Found { inverse_m, px, px_per_inverse_m: beside[0].distance_px(beside[1]) / (2.0 * off) })
    }

    /// One over depths from far to near, and their places in the second image, evenly along the line.
    fn steps(&self) -> Vec<(f64, Pixel)> {
        let mut steps = Vec::new();
        let (mut q, mut wide) = (0.0, 1e-3);
        let inside = |px: &Pixel| self.pair.cameras[1].contains(*px);
        while q <= 1.0 / NEAREST_M && steps.len() < MOST_STEPS {
            let Some(here) = self.centre(q) else { break };
            if inside(&here) {
                steps.push((q, here));
            }
            // The next step is as wide as the last one would have had to be.
            let moved = self.centre(q + wide).map_or(STEP_PX, |next| next.distance_px(here));
            wide = (wide * STEP_PX / moved.max(1e-9)).clamp(1e-5, 2.0 * wide);
            q += wide;
        }
        steps
    }

    /// Where between two depths it is most alike: golden sections.
    fn top(&self, mut low: f64, mut high: f64) -> f64 {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let value = |q: f64| self.alike(q).unwrap_or(-1.0);
        let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (mut at_a, mut at_b) = (value(a), value(b));
        for _ in 0..24 {
            if at_a > at_b {
                (high, b, at_b) = (b, a, at_a);
                a = high - GOLDEN * (high - low);
                at_a = value(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = low + GOLDEN * (high - low);
                at_b = value(b);
            }
        }
        0.5 * (low + high)
    }
}
