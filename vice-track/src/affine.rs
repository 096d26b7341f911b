//! A template: what the surroundings of a point look like, matched with turn, scale and shear, whatever the light.
//!
//! Gray values are compared after their mean is taken off and their contrast is made one, so that gain and offset do
//! not matter. The search is the inverse compositional one: S. Baker and I. Matthews, "Lucas-Kanade 20 years on: a
//! unifying framework", 2004.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};
use vice_core::camera::Pixel;

use crate::pyramid::Level;
use crate::sampler::sample;

/// The template reaches this far from its centre, pixels of the frame it was cut from.
pub(crate) const REACH_PX: i32 = 10;
const SIDE: usize = 2 * REACH_PX as usize + 1;
/// Standard deviation of the weights around the centre, pixels: what lies at the rim may be another surface.
const WEIGHT_SIGMA_PX: f64 = 6.0;
/// Weighted standard deviation of gray levels under which there is nothing to match.
const MIN_CONTRAST: f64 = 1.5;
const MAX_STEPS: usize = 40;
/// The search ends when no place of the template moves by more, pixels.
const SHORT_STEP_PX: f64 = 0.002;
/// A step that moves the rim by more than this is no refinement any more, pixels.
const LONG_STEP_PX: f64 = 6.0;

/// Where a template is: place = `at` + `linear` · offset in the template.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warp {
    pub(crate) linear: Matrix2<f64>,
    pub(crate) at: Pixel,
}

impl Warp {
    pub(crate) fn place(&self, offset: Vector2<f64>) -> Pixel {
        let moved = self.linear * offset;
        Pixel::new(self.at.u + moved.x, self.at.v + moved.y)
    }

    /// Largest and smallest magnification.
    pub(crate) fn scales(&self) -> [f64; 2] {
        let s = self.linear.singular_values();
        [s[0].max(s[1]), s[0].min(s[1])]
    }
}

/// A match.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Match {
    pub(crate) warp: Warp,
    /// Weighted correlation of template and image, 1 at best.
    pub(crate) correlation: f64,
}

/// Why there is no match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoMatch {
    /// The template reaches over the border of the image.
    Outside,
    /// The search ran away, or there is nothing to match.
    Lost,
}

/// The surroundings of a point in one frame.
#[derive(Clone, Debug)]
pub(crate) struct Template {
    /// Mean zero and length one, weighted.
    values: Vec<f64>,
    /// How the values change with the six parameters of a warp, without what mean and contrast take up.
    descent: Vec<Vector6<f64>>,
    inverse_hessian: Matrix6<f64>,
    weights: Vec<f64>,
}

/// Offsets of the template's places from its centre, row by row.
fn offsets(reach: i32) -> impl Iterator<Item = Vector2<f64>> {
    (-reach..=reach)
        .flat_map(move |y| (-reach..=reach).map(move |x| Vector2::new(f64::from(x), f64::from(y))))
}

/// Takes off the weighted mean and scales to weighted length one; none where the contrast is too small.
fn normalised(mut values: Vec<f64>, weights: &[f64]) -> Option<(Vec<f64>, f64)> {
    let total: f64 = weights.iter().sum();
    let mean = values.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>() / total;
    for value in &mut values {
        *value -= mean;
    }
    let length = values.iter().zip(weights).map(|(v, w)| v * v * w).sum::<f64>().sqrt();
    if length < MIN_CONTRAST * total.sqrt() {
        return None;
    }
    for value in &mut values {
        *value /= length;
    }
    Some((values, length))
}

impl Template {
    /// Cuts a template; none where it reaches over the border or there is nothing in it to match.
    pub(crate) fn cut(level: &Level, at: Pixel) -> Option<Self> {
        let weights: Vec<f64> = offsets(REACH_PX)
            .map(|o| (-o.norm_squared() / (2.0 * WEIGHT_SIGMA_PX * WEIGHT_SIGMA_PX)).exp())
            .collect();
        let wide: Vec<f64> = offsets(REACH_PX + 1)
            .map(|o| sample(level, Pixel::new(at.u + o.x, at.v + o.y)))
            .collect::<Option<_>>()?;
        let wide_at = |x: usize, y: usize| wide[y * (SIDE + 2) + x];
        let inner = (1..=SIDE).flat_map(|y| (1..=SIDE).map(move |x| (x, y)));
        let values = inner.clone().map(|(x, y)| wide_at(x, y)).collect();
        let (values, length) = normalised(values, &weights)?;
        let mut descent: Vec<Vector6<f64>> = inner
            .zip(offsets(REACH_PX))
            .map(|((x, y), o)| {
                let right = (wide_at(x + 1, y) - wide_at(x - 1, y)) / (2.0 * length);
                let down = (wide_at(x, y + 1) - wide_at(x, y - 1)) / (2.0 * length);
                Vector6::new(right, down, right * o.x, right * o.y, down * o.x, down * o.y)
            })
            .collect();
        let total: f64 = weights.iter().sum();
        let mut mean = Vector6::zeros();
        let mut along = Vector6::zeros();
        for ((d, v), w) in descent.iter().zip(&values).zip(&weights) {
            mean += d * (w / total);
            along += d * (v * w);
        }
        let mut hessian = Matrix6::zeros();
        for ((d, v), w) in descent.iter_mut().zip(&values).zip(&weights) {
            *d -= mean + along * *v;
            hessian += *d * d.transpose() * *w;
        }
        let inverse_hessian = hessian.try_inverse()?;
        inverse_hessian.iter().all(|x| x.is_finite()).then_some(Self {
            values,
            descent,
            inverse_hessian,
            weights,
        })
    }

    /// The image's values where the template is supposed to be, normalised.
    fn seen(&self, level: &Level, warp: &Warp) -> Result<Vec<f64>, NoMatch> {
        let values = offsets(REACH_PX).map(|o| sample(level, warp.place(o))).collect::<Option<_>>();
        let seen = normalised(values.ok_or(NoMatch::Outside)?, &self.weights);
        seen.map(|(values, _)| values).ok_or(NoMatch::Lost)
    }

    /// Finds the template near a warp.
    ///
    /// # Errors
    /// [`NoMatch`] where it leaves the image or the search runs away.
    pub(crate) fn find(&self, level: &Level, start: Warp) -> Result<Match, NoMatch> {
        let mut warp = start;
        for _ in 0..MAX_STEPS {
            let seen = self.seen(level, &warp)?;
            let mut gradient = Vector6::zeros();
            for (((d, v), s), w) in self.descent.iter().zip(&self.values).zip(&seen).zip(&self.weights) {
                gradient += d * ((s - v) * w);
            }
            let step = self.inverse_hessian * gradient;
            let shift = Vector2::new(step[0], step[1]);
            let linear = Matrix2::new(1.0 + step[2], step[3], step[4], 1.0 + step[5]);
            warp.linear *= linear.try_inverse().ok_or(NoMatch::Lost)?;
            let moved = warp.linear * shift;
            warp.at = Pixel::new(warp.at.u - moved.x, warp.at.v - moved.y);
            let reach = f64::from(REACH_PX);
            let rim_px = moved.norm() + reach * (linear - Matrix2::identity()).norm();
            if !rim_px.is_finite() || rim_px > LONG_STEP_PX {
                return Err(NoMatch::Lost);
            }
            if rim_px < SHORT_STEP_PX {
                break;
            }
        }
        let seen = self.seen(level, &warp)?;
        let correlation = self.values.iter().zip(&seen).zip(&self.weights).map(|((a, b), w)| a * b * w).sum();
        Ok(Match { warp, correlation })
    }
}
