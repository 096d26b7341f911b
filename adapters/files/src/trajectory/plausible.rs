//! Whether poses can be those of a robot: the unit of a length shows in the speed.

use vice_core::statistics::middle;
use vice_core::suspicion::Suspicion;
use vice_core::trajectory::Trajectory;

/// Median speed beyond which a trajectory is suspected to be in another unit than metres, m/s (250 km/h).
const MOST_M_S: f64 = 70.0;
/// Poses below which there is no median to speak of.
const FEWEST: usize = 5;

/// A trajectory that is far too fast: millimetres or centimetres read as metres, or stamps in another unit.
pub(super) fn suspicion(trajectory: &Trajectory, about: &str) -> Option<Suspicion> {
    let (stamps, poses) = (trajectory.stamps(), trajectory.poses());
    if poses.len() < FEWEST {
        return None;
    }
    let mut speeds: Vec<f64> = (1..poses.len())
        .map(|i| {
            let seconds = stamps[i].since(stamps[i - 1]).as_secs_f64();
            (poses[i].translation() - poses[i - 1].translation()).norm() / seconds
        })
        .collect();
    let median = middle(&mut speeds, f64::total_cmp)?;
    (median > MOST_M_S).then(|| {
        Suspicion::new("implausible-speed", about, "the poses move too fast for metres and seconds")
            .evidence(format!("half of the time faster than {median:.0} m/s"))
            .advice("are the positions in millimetres or centimetres? Name the unit in a heading, such as tx [mm]")
    })
}
