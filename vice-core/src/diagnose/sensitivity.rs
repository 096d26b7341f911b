//! How RMSE_2D answers to each flaw, and which size of it the labels at hand can show.
//!
//! A flaw is injected into what is in use, both ways round, and the error is scored as an evaluation would. The
//! document is `vice.sensitivity/1`.

use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};

use super::fit::{Work, parameters_of};
use super::flaw::{Flaw, PARAMETERS};
use super::noise::NoiseModel;
use super::outliers;
use super::report::labels_part;
use super::theta::Theta;
use super::{DiagnoseError, Diagnosis, LabelsPart, Prepared, flaws_of};
use crate::parallel::*;

/// The schema's name and version.
pub const SENSITIVITY_SCHEMA: &str = "vice.sensitivity/1";

/// Injected sizes, in typical ones.
const SIZES: [f64; 8] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// So many standard deviations a flaw must have to be found nineteen times of twenty at 95 %: 1.96 + 1.645.
const DETECTED: f64 = 3.6;
/// Deviations of the model are this much too small: half the width of a diagnosis' interval over 1.96.
const INFLATED: f64 = 1.28;
/// An RMSE_2D that is larger by this share is seen.
const SEEN_SHARE: f64 = 0.1;

/// The document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensitivityDocument {
    /// [`SENSITIVITY_SCHEMA`].
    pub schema: String,
    /// Version of VICE that wrote it.
    pub vice_version: String,
    /// Name of the data set.
    pub dataset: String,
    /// The camera.
    pub camera: String,
    /// The pose stream.
    pub stream: String,
    /// The depth source.
    pub depth: String,
    /// What the flaws are injected against.
    pub labels: LabelsPart,
    /// RMSE_2D as it is, pixels.
    pub rmse_px: f64,
    /// One curve for each parameter of each flaw.
    pub curves: Vec<Curve>,
}

/// How RMSE_2D answers to one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// The flaw.
    pub flaw: Flaw,
    /// Its parameter, with the unit.
    pub parameter: String,
    /// Injected sizes and the RMSE_2D with them, the mean square over both signs.
    pub points: Vec<CurvePoint>,
    /// The size at which RMSE_2D is 10 % larger than it is now; null where none that was tried does it.
    pub seen_from: Option<f64>,
    /// The smallest size that a diagnosis finds nineteen times of twenty if it is the only flaw; null where no
    /// plausible size is found.
    pub found_from: Option<f64>,
}

/// One injection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Size, in the parameter's unit.
    pub size: f64,
    /// RMSE_2D, pixels.
    pub rmse_px: f64,
}

/// Injects each flaw at growing size. `progress` is called with (done, total) as flaws are done.
///
/// # Errors
/// [`DiagnoseError`] if there is too little to fit to or the stream cannot be evaluated.
pub fn sensitivity(
    diagnosis: &Diagnosis<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<SensitivityDocument, DiagnoseError> {
    let Diagnosis { evaluation, stream, depth, inertial, options, .. } = *diagnosis;
    let flaws: Vec<Flaw> = flaws_of(diagnosis)?.into_iter().filter(|f| *f != Flaw::ClockStep).collect();
    let prepared = Prepared::new(diagnosis, &flaws)?;
    let (scene, motion) = (&prepared.scene, &prepared.motion);
    let zero = Theta::zero();
    let noise = NoiseModel { odometry: options.odometry_noise, inertial: inertial.is_some() };
    let mut work = Work::new(scene, motion, noise, &zero)?;
    let base = work.residuals(&zero)?;
    work.weights = outliers::by_neighbours(&work, &base);
    // The noise that is there with nothing injected.
    let none = work.newton(&[], &zero, &[0.0; 6], &[], 0)?;
    let none = work.sized(none, 3);
    let labels = labels_part(&prepared, &work);
    let now_px = work.rms(&base);
    // One pass for all of them.
    let parameters = parameters_of(&flaws);
    let columns = scene.columns(&zero, motion, &parameters)?;
    let whitened = work.whiten(&base, &columns, &none.logs, &none.jumps);
    drop(columns);
    let squares = |place: usize| -> f64 {
        whitened.rows.chunks_exact(whitened.width).map(|row| row[1 + place] * row[1 + place]).sum()
    };
    let done = AtomicUsize::new(0);
    let of_flaw = |flaw: &Flaw| -> Result<Vec<Curve>, DiagnoseError> {
        let curves = flaw.solved().map(|parameter| {
            let place = parameters.iter().position(|p| *p == parameter).unwrap_or_default();
            let found_from = DETECTED * INFLATED / squares(place).max(f64::MIN_POSITIVE).sqrt();
            let points = curve(&work, parameter, now_px)?;
            Ok(Curve {
                flaw: *flaw,
                parameter: PARAMETERS[parameter].name.to_string(),
                seen_from: seen_from(now_px, &points),
                found_from: (found_from < PARAMETERS[parameter].plausible).then_some(found_from),
                points,
            })
        });
        let curves = curves.collect::<Result<Vec<_>, DiagnoseError>>();
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, flaws.len());
        curves
    };
    let curves: Vec<Result<Vec<Curve>, DiagnoseError>> = flaws.par_iter().map(of_flaw).collect();
    let curves: Vec<Curve> =
        curves.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    Ok(SensitivityDocument {
        schema: SENSITIVITY_SCHEMA.to_string(),
        vice_version: env!("CARGO_PKG_VERSION").to_string(),
        dataset: evaluation.rig.name().to_string(),
        camera: evaluation.rig.camera_name().to_string(),
        stream: evaluation.streams[stream].name.clone(),
        depth: evaluation.depths[depth].name().to_string(),
        labels,
        rmse_px: prepared.rmse_px,
        curves,
    })
}

/// RMSE_2D over injected sizes, nothing injected first.
fn curve(work: &Work<'_, '_>, parameter: usize, now_px: f64) -> Result<Vec<CurvePoint>, DiagnoseError> {
    let mut points = vec![CurvePoint { size: 0.0, rmse_px: now_px }];
    for times in SIZES {
        let size = times * PARAMETERS[parameter].typical;
        let mut sum = 0.0;
        for sign in [-1.0, 1.0] {
            let mut theta = Theta::zero();
            theta[parameter] = sign * size;
            sum += work.rms(&work.residuals(&theta)?).powi(2);
        }
        points.push(CurvePoint { size, rmse_px: (0.5 * sum).sqrt() });
    }
    Ok(points)
}

/// Where the curve first crosses 10 % more than now, linear in the squares between the sizes tried.
fn seen_from(now_px: f64, points: &[CurvePoint]) -> Option<f64> {
    let limit = (now_px * (1.0 + SEEN_SHARE)).powi(2);
    points.windows(2).find_map(|pair| {
        let [a, b] = [pair[0], pair[1]];
        let (low, high) = (a.rmse_px.powi(2), b.rmse_px.powi(2));
        let share = (limit - low) / (high - low);
        // The square of the error grows with the square of the size.
        (low <= limit && high > limit)
            .then(|| (a.size.powi(2) + share * (b.size.powi(2) - a.size.powi(2))).sqrt())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_seen_where_it_is_a_tenth_higher() {
        let at = |size: f64| CurvePoint { size, rmse_px: (1.0 + 4.0 * size * size).sqrt() };
        let points = [at(0.0), at(0.1), at(0.2), at(0.4)];
        let seen = seen_from(1.0, &points).unwrap();
        assert!((4.0 * seen * seen - 0.21).abs() < 1e-9, "{seen}");
        assert_eq!(seen_from(1.0, &points[..2]), None);
    }
}
