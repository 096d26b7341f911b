//! Flights and trajectories of a size.

use std::io::Write;
use std::path::Path;

use vice_benches::flight::{FRAME_NS, Flight, START_NS, create};
use vice_core::random::Congruential;

use crate::Result;

/// Writes the folder `flight` with so many frames and a pose at each, and beside it `estimate.txt` and `labels.csv` with
/// so many points in every frame.
pub(crate) fn write(folder: &Path, frames: usize, points: usize) -> Result<()> {
    Flight { frames, poses_a_frame: 1, points }.write(folder)
}

/// Writes two trajectories in TUM's format that look about a little and turn round in their last thirty poses.
pub(crate) fn write_turning(folder: &Path, poses: usize) -> Result<()> {
    for (name, noise) in [("reference.tum", 0.0), ("estimate.tum", 0.02)] {
        let mut file = create(&folder.join(name))?;
        let mut numbers = Congruential::new(7);
        for i in 0..poses {
            let t = i as f64 * 0.05;
            let turned = if i + 30 >= poses { 170_f64.to_radians() } else { 0.0 };
            let yaw = 0.15 * (0.2 * t).sin() + turned + numbers.uniform(-noise, noise);
            let (x, y) = (t.cos() + numbers.uniform(-noise, noise), (2.0 * t).sin());
            let (stamp, half) = (START_NS + FRAME_NS * i as u64, 0.5 * yaw);
            let (seconds, nanos) = (stamp / 1_000_000_000, stamp % 1_000_000_000);
            writeln!(file, "{seconds}.{nanos:09} {x:.9} {y:.9} 0 0 0 {:.12} {:.12}", half.sin(), half.cos())?;
        }
        file.flush()?;
    }
    Ok(())
}

/// Writes a manifest of so many runs of the flight that lies beside it; each starts a little later, so that none is another.
pub(crate) fn write_manifest(path: &Path, runs: usize) -> Result<()> {
    let mut file = create(path)?;
    writeln!(file, "run_id,group,dataset,labels,estimate,depth,start")?;
    for i in 0..runs {
        writeln!(file, "run{i},g,flight,labels.csv,estimate.txt,floor,{}", i as f64 * 1e-6)?;
    }
    Ok(file.flush()?)
}
