//! Labels and key labels that are far from where they should be. Their variance is raised, they are not dropped.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::filter::{Shifts, Weights, whiten};
use super::fit::{Fit, Work, expected_of};
use super::normal::Normal;
use super::scene::{Residual, Scene};
use crate::statistics::middle;

/// Variance of an outlier over that of a usual label.
const RAISED: f64 = 400.0;
/// A label this many deviations from its neighbours is one.
const FAR: f64 = 4.6;
/// Chi-square of the shift of a key label that is one.
const FAR_KEY: f64 = 16.0;
/// The same of a label.
const FAR_LABEL: f64 = 20.0;
/// At most this share of the segments.
const MOST_KEYS: f64 = 1.0 / 6.0;
/// Deviations below this are exact data, pixels.
const LEAST_PX: f64 = 0.02;

/// Labels far from what their neighbours along the segment predict: free of whatever moves them smoothly.
fn labels(scene: &Scene<'_>, residuals: &[Residual]) -> Vec<bool> {
    let mut outliers = vec![false; scene.labels.len()];
    let all: Vec<Vec<usize>> = scene.segments.iter().map(|s| s.labels.clone().collect()).collect();
    let mut usual: Vec<f64> = all
        .iter()
        .flat_map(|labels| (0..labels.len()).filter_map(|i| deviation(scene, residuals, labels, i)))
        .collect();
    // Half of the lengths of a normal distribution in the plane are below 1.18 deviations.
    let Some(median) = middle(&mut usual, f64::total_cmp) else { return outliers };
    let sigma = (median / 1.1774).max(LEAST_PX);
    for mut labels in all {
        let most = labels.len().div_ceil(5);
        for _ in 0..most {
            let worst = (0..labels.len())
                .filter_map(|i| Some((deviation(scene, residuals, &labels, i)?, i)))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, i)) = worst.filter(|(d, _)| *d > FAR * sigma) else { break };
            outliers[labels.remove(i)] = true;
        }
    }
    outliers
}

/// How far a label is from the line through its neighbours, in the deviation of a label.
fn deviation(scene: &Scene<'_>, residuals: &[Residual], labels: &[usize], i: usize) -> Option<f64> {
    let n = labels.len();
    if n < 4 {
        return None;
    }
    let (a, b) = match i {
        0 => (1, 2),
        _ if i == n - 1 => (n - 3, n - 2),
        _ => (i - 1, i + 1),
    };
    let t = |i: usize| scene.frames[scene.labels[labels[i]].frame].t_s;
    let span = t(b) - t(a);
    if span <= 0.0 {
        return None;
    }
    let share = (t(i) - t(a)) / span;
    let predicted: Vector2<f64> = residuals[labels[a]] * (1.0 - share) + residuals[labels[b]] * share;
    let factor = (1.0 + share * share + (1.0 - share).powi(2)).sqrt();
    Some((residuals[labels[i]] - predicted).norm() / factor)
}

/// Weights by the neighbours of the labels alone.
pub(super) fn by_neighbours(work: &Work<'_, '_>, residuals: &[Residual]) -> Weights {
    let far = labels(work.scene, residuals);
    let labels = far.iter().map(|far| if *far { RAISED } else { 1.0 }).collect();
    work.without_dead(Weights { labels, keys: vec![1.0; work.scene.segments.len()] })
}

/// Finds outliers of a fit: labels by their neighbours, labels and key labels by what a shift of each would explain.
pub(super) fn find(work: &Work<'_, '_>, fit: &Fit) -> Weights {
    let mut weights = by_neighbours(work, &fit.residuals_now());
    let most_keys = ((work.scene.segments.len() as f64 * MOST_KEYS) as usize).max(1);
    let most_labels = work.scene.labels.len().div_ceil(10);
    for _ in 0..4 {
        let keys = raise(work, fit, &mut weights, Shifts::Keys, most_keys);
        let labels = raise(work, fit, &mut weights, Shifts::Labels, most_labels);
        if !keys && !labels {
            break;
        }
    }
    weights
}

/// Raises the variance of those whose shift explains most; whether there were any.
fn raise(work: &Work<'_, '_>, fit: &Fit, weights: &mut Weights, shifts: Shifts, most: usize) -> bool {
    let scores = scores(work, fit, weights, shifts);
    let (own, limit) = match shifts {
        Shifts::Labels => (&mut weights.labels, FAR_LABEL),
        _ => (&mut weights.keys, FAR_KEY),
    };
    // The median of chi-square with two degrees of freedom is 1.39.
    let high = (middle(&mut scores.clone(), f64::total_cmp).unwrap_or(0.0) / 1.39).max(1.0);
    let found = own.iter().filter(|w| **w > 1.0).count();
    let mut worst: Vec<(f64, usize)> = scores
        .iter()
        .enumerate()
        .filter(|(i, _)| own[*i] == 1.0)
        .map(|(i, s)| (s / high, i))
        .filter(|(s, _)| *s > limit)
        .collect();
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    let largest = worst.first().map_or(0.0, |w| w.0);
    let mut any = false;
    for (score, i) in worst.into_iter().take(most.saturating_sub(found)) {
        // What one outlier leaves in those beside it goes with it.
        if score > 0.5 * largest {
            own[i] = RAISED;
            any = true;
        }
    }
    any
}

/// Chi-square of a shift of each label or key label beside the parameters of a fit.
fn scores(work: &Work<'_, '_>, fit: &Fit, weights: &Weights, shifts: Shifts) -> Vec<f64> {
    let columns: Vec<&[Residual]> =
        std::iter::once(fit.residuals.as_slice()).chain(fit.columns.iter().map(Vec::as_slice)).collect();
    let sizes = work.noise.sizes(&fit.logs);
    let whitened = whiten(&work.geometry, &columns, &sizes, weights, &fit.jumps, shifts);
    let p = fit.parameters.len();
    let all: Vec<usize> = (1..=p).collect();
    let solution = Normal::of(&whitened, &all).solve(&fit.linearised_at(), &expected_of(&fit.parameters));
    whitened
        .shifts
        .iter()
        .map(|shift| {
            let cross = DMatrix::from_fn(2, p, |a, c| shift.with[a][1 + c]);
            let own = Matrix2::from_fn(|a, b| shift.own[a][b]);
            let left = &cross * &solution.covariance * cross.transpose();
            let left = own - Matrix2::from_fn(|a, b| left[(a, b)]);
            let score = DVector::from_fn(2, |a, _| shift.with[a][0]) + &cross * &solution.step;
            let score = Vector2::new(score[0], score[1]);
            left.try_inverse().map_or(0.0, |inverse| (score.transpose() * inverse * score)[0].max(0.0))
        })
        .collect()
}
