//! Whether the labels can show a flaw at all, and tell it from another.

use nalgebra::{DMatrix, DVector};

use super::blocks::Blocks;
use super::flaw::PARAMETERS;
use super::noise::Noise;
use super::solve::Fit;

/// A direction shows if a typical flaw moves the labels by this many deviations of one independent label.
const SEEN: f64 = 2.0;

/// What a flaw of typical size does to the labels.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Observability {
    /// RMS effect by direction of the parameters, pixels.
    effects_px: Vec<f64>,
    /// RMS effect in the direction that shows least, pixels.
    pub(super) weakest_px: f64,
    /// RMS effect in the direction that shows most, pixels.
    pub(super) strongest_px: f64,
}

impl Observability {
    pub(super) fn of(fit: &Fit) -> Self {
        let labels = fit.residuals.len().max(1) as f64;
        let typical = DMatrix::from_diagonal(&typical(fit));
        let scaled = &typical * hessian(fit) * &typical;
        let effects_px: Vec<f64> =
            scaled.symmetric_eigenvalues().iter().map(|e| (e.max(0.0) / labels).sqrt()).collect();
        Self {
            weakest_px: effects_px.iter().copied().fold(f64::INFINITY, f64::min),
            strongest_px: effects_px.iter().copied().fold(0.0, f64::max),
            effects_px,
        }
    }

    /// Number of directions that show. `noise` is what the best fit leaves.
    pub(super) fn rank(&self, blocks: &Blocks, noise: &Noise) -> usize {
        // Labels of a segment err alike: the cells are what is independent.
        let threshold_px =
            SEEN * noise.after_px(blocks.typical_seconds()) / (blocks.cells.len().max(1) as f64).sqrt();
        self.effects_px.iter().filter(|e| **e >= threshold_px).count()
    }
}

/// How much of the pixels that one fit accounts for another could account for as well, 0 to 1: the squared cosine of
/// the angle between the first one's correction and all that the second one's parameters can do.
pub(super) fn overlap(of: &Fit, with: &Fit) -> f64 {
    let field =
        stacked(of) * DVector::from_iterator(of.parameters.len(), of.parameters.iter().map(|p| of.theta[*p]));
    let columns = stacked(with) * DMatrix::from_diagonal(&typical(with));
    let length = field.norm_squared();
    if length == 0.0 {
        return 0.0;
    }
    let svd = columns.svd(true, false);
    let Some(u) = svd.u else { return 0.0 };
    let largest = svd.singular_values.max();
    let shared: f64 = u
        .column_iter()
        .zip(svd.singular_values.iter())
        .filter(|(_, s)| **s > 1e-9 * largest)
        .map(|(column, _)| column.dot(&field).powi(2))
        .sum();
    (shared / length).clamp(0.0, 1.0)
}

fn typical(fit: &Fit) -> DVector<f64> {
    DVector::from_iterator(fit.parameters.len(), fit.parameters.iter().map(|p| PARAMETERS[*p].typical))
}

fn hessian(fit: &Fit) -> DMatrix<f64> {
    let j = stacked(fit);
    j.transpose() * j
}

/// The Jacobian as one matrix, two rows a label.
fn stacked(fit: &Fit) -> DMatrix<f64> {
    DMatrix::from_fn(2 * fit.residuals.len(), fit.parameters.len(), |row, column| {
        fit.jacobian[column][row / 2][row % 2]
    })
}
