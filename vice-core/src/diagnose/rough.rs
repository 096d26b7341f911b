//! Depth that is rough: that of a scanned cloud jumps from triangle to triangle as the camera is turned.
//!
//! Asked again at each trial value it makes every fit a search among the bumps of the cloud: the lowest of them says
//! which noise suits best, not which flaw it is. So the depth of a key frame is asked once, every segment has a depth
//! error of its own besides, as large as the source's roughness allows, and that error is solved for at each trial value.
//! Depth is asked again where a solution has moved it by more than its roughness.

use nalgebra::Vector2;

use super::problem::Residual;

/// Half the difference of depth over which the effect on a label is taken, as a share: large enough for its curvature.
pub(super) const SHARE: f64 = 0.01;
/// Reweighted steps to the depth error of a segment.
const STEPS: usize = 6;
/// Errors longer than this count linearly, pixels.
const HUBER_PX: f64 = 1.0;

/// How a label moves with the depth of its key frame: `now + slope · share + ½ · bend · share²`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    now: Residual,
    slope: Residual,
    bend: Residual,
}

impl Response {
    /// From residuals at the depth and at depths [`SHARE`] nearer and farther.
    pub(super) fn new(nearer: Residual, now: Residual, farther: Residual) -> Self {
        let slope = (farther - nearer) / (2.0 * SHARE);
        let bend = (farther + nearer - now * 2.0) / (SHARE * SHARE);
        Self { now, slope, bend }
    }

    /// The residual with the depth farther by a share.
    pub(super) fn at(&self, share: f64) -> Residual {
        self.now + self.slope * share + self.bend * (0.5 * share * share)
    }
}

/// The share by which the depth of a segment is off: what fits its labels best, held by a pull to zero as wide as the
/// roughness.
pub(super) fn depth_error(segment: &[Response], roughness: f64) -> f64 {
    let mut share = 0.0;
    for _ in 0..STEPS {
        let (mut curvature, mut gradient) = (roughness.powi(-2), share * roughness.powi(-2));
        for label in segment {
            let residual = label.at(share);
            let slope: Vector2<f64> = label.slope + label.bend * share;
            let weight = HUBER_PX / residual.norm().max(HUBER_PX);
            curvature += weight * slope.norm_squared();
            gradient += weight * slope.dot(&residual);
        }
        // The parabola holds near the depth only.
        share = (share - gradient / curvature).clamp(-5.0 * roughness, 5.0 * roughness);
    }
    share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_depth_error_is_found_as_far_as_the_labels_show_it() {
        let moves = |slope: f64, error: f64| {
            let at =
                |share: f64| Vector2::new(slope * (share - error), 0.4 * slope * (share - error).powi(2));
            Response::new(at(-SHARE), at(0.0), at(SHARE))
        };
        let shown: Vec<Response> = (1..6).map(|i| moves(40.0 * f64::from(i), 0.02)).collect();
        let found = depth_error(&shown, 0.03);
        assert!((found - 0.02).abs() < 0.001, "{found}");
        assert!(shown.iter().all(|label| label.at(found).norm() < 0.2));
        // Labels that do not move with depth say nothing of it.
        let unshown: Vec<Response> = (0..5).map(|_| moves(0.1, 0.02)).collect();
        assert!(depth_error(&unshown, 0.03).abs() < 1e-4);
        assert_eq!(depth_error(&[], 0.03), 0.0);
    }
}
