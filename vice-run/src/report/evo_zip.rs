//! A trajectory result in the archive that evo's `evo_res` reads: `info.json`, `stats.json`, arrays as `.npy` and
//! trajectories as `.tum`. evo keeps stamps as doubles, and so do the arrays; the `.tum` files hold every nanosecond.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use serde::Serialize;
use vice_core::frames::WorldFromBody;
use vice_core::metrics::align::ReferenceFromEstimate;
use vice_core::metrics::associate::PosePairs;
use vice_core::metrics::trajectory::{ApeErrors, Statistics};
use vice_core::time::Stamp;
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use crate::error::RunResult;

/// What the archive says about the comparison.
pub(crate) struct About<'a> {
    pub(crate) reference: &'a str,
    pub(crate) estimate: &'a str,
    pub(crate) align: &'a str,
    pub(crate) transform: &'a ReferenceFromEstimate,
}

#[derive(Serialize)]
struct Info<'a> {
    title: String,
    label: &'a str,
    ref_name: &'a str,
    est_name: &'a str,
}

/// The archive of the translation part of the APE of aligned pairs.
pub(crate) fn encode(pairs: &PosePairs, about: &About<'_>) -> RunResult<Vec<u8>> {
    let errors = ApeErrors::of(pairs).translation_m;
    let statistics = Statistics::of(&errors)?;
    let info = Info {
        title: format!("APE w.r.t. translation part (m)\n(alignment: {})", about.align),
        label: "APE (m)",
        ref_name: about.reference,
        est_name: about.estimate,
    };
    let seconds: Vec<f64> = pairs.stamps().iter().map(|s| s.as_secs_f64()).collect();
    let first = pairs.stamps().first().copied().unwrap_or_default();
    let from_start: Vec<f64> = pairs.stamps().iter().map(|s| s.since(first).as_secs_f64()).collect();
    let n = pairs.len();
    let array = |values: &[f64]| super::npy::encode_f64(&[n], values);
    let files: [(&str, Vec<u8>); 10] = [
        ("info.json", serde_json::to_vec(&info)?),
        ("stats.json", serde_json::to_vec(&statistics)?),
        ("error_array.npy", array(&errors)),
        ("seconds_from_start.npy", array(&from_start)),
        ("timestamps.npy", array(&seconds)),
        ("distances_from_start.npy", array(&travelled(pairs.reference()))),
        ("distances.npy", array(&travelled(pairs.estimate()))),
        ("alignment_transformation_sim3.npy", super::npy::encode_f64(&[4, 4], &matrix(about.transform))),
        ("reference.tum", tum(pairs.stamps(), pairs.reference()).into_bytes()),
        ("estimate.tum", tum(pairs.stamps(), pairs.estimate()).into_bytes()),
    ];
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // Without a time in it the archive is the same on every run.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, bytes) in files {
        archive.start_file(name, options)?;
        archive.write_all(&bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// Metres travelled up to each pose.
fn travelled(poses: &[WorldFromBody]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = poses.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm());
    std::iter::once(0.0)
        .chain(steps)
        .map(|step| {
            sum += step;
            sum
        })
        .take(poses.len())
        .collect()
}

/// The similarity as a 4x4 matrix, row by row: scale times rotation, and translation.
fn matrix(transform: &ReferenceFromEstimate) -> [f64; 16] {
    let rotation = transform.rotation.to_rotation_matrix();
    let mut m = [0.0; 16];
    for row in 0..3 {
        for column in 0..3 {
            m[4 * row + column] = transform.scale * rotation[(row, column)];
        }
        m[4 * row + 3] = transform.translation_m[row];
    }
    m[15] = 1.0;
    m
}

fn tum(stamps: &[Stamp], poses: &[WorldFromBody]) -> String {
    let mut text = String::new();
    for (stamp, pose) in stamps.iter().zip(poses) {
        let (p, q) = (pose.translation(), pose.rotation());
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{} {} {} {} {} {} {} {}",
            stamp.to_seconds_text(),
            p.x,
            p.y,
            p.z,
            q.i,
            q.j,
            q.k,
            q.w
        );
    }
    text
}
