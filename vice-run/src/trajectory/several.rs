//! Several estimates against one reference: one table and one plot.

use serde::Serialize;
use vice_core::metrics::associate::PosePairs;

use super::{Compared, TrajectoryDocument};
use crate::report::plots::trajectory as plot;
use crate::report::table;
use crate::text::printable;

/// The document `vice.trajectories/1`: several estimates against one reference.
#[derive(Clone, Debug, Serialize)]
pub struct TrajectoriesDocument<'a> {
    /// The schema's name and version.
    pub schema: &'static str,
    /// One for each estimate, in the order in which they were named.
    pub estimates: Vec<&'a TrajectoryDocument>,
}

impl<'a> TrajectoriesDocument<'a> {
    /// Of comparisons with the same reference.
    pub fn of(compared: &'a [Compared]) -> Self {
        Self { schema: "vice.trajectories/1", estimates: compared.iter().map(|c| &c.document).collect() }
    }
}

/// One table of several estimates, a row each. Angles in radians, or in degrees.
pub fn render_several(compared: &[Compared], degrees: bool) -> String {
    let unit = if degrees { "deg" } else { "rad" };
    let angle = |v: f64| if degrees { v.to_degrees() } else { v };
    let head = [
        "estimate",
        "matched",
        "RMSE_3D m",
        &format!("AOE {unit}"),
        &format!("ROE {unit}"),
        "APE mean m",
        "median m",
        "max m",
        "RPE rmse m",
    ];
    let mut grid = vec![head.map(String::from).to_vec()];
    let mut problems = String::new();
    for one in compared {
        let d = &one.document;
        let (ape, rpe) = (&d.ape.translation_m, d.rpe.as_ref());
        grid.push(vec![
            printable(&d.estimate),
            format!("{} of {}", d.matched, one.estimate_poses),
            format!("{:.4}", d.rmse_3d_m),
            format!("{:.4}", angle(d.aoe_rad)),
            d.roe_rad.map_or_else(|| "-".to_string(), |v| format!("{:.4}", angle(v))),
            format!("{:.6}", ape.mean),
            format!("{:.6}", ape.median),
            format!("{:.6}", ape.max),
            rpe.map_or_else(|| "-".to_string(), |r| format!("{:.6}", r.errors.translation_m.rmse)),
        ]);
        if let Some(problem) = &d.rpe_problem {
            problems.push_str(&format!("no RPE of {}: {}\n", printable(&d.estimate), printable(problem)));
        }
    }
    let about = compared.first().map(|one| {
        let rpe = one.document.rpe.as_ref().map(|r| format!(", RPE over {} {}", r.delta, r.delta_unit));
        format!(
            "against {}, align {}{}\n\n",
            printable(&one.document.reference),
            one.document.align,
            rpe.unwrap_or_default()
        )
    });
    format!("{}{}{problems}", about.unwrap_or_default(), table::align(&grid))
}

/// All paths from above and their differences over time, as SVG.
pub fn plot_several(compared: &[Compared]) -> String {
    let all: Vec<(&PosePairs, &str)> =
        compared.iter().map(|c| (&c.pairs, c.document.estimate.as_str())).collect();
    plot::file(&all, compared.first().map_or("", |c| c.document.reference.as_str()))
}
