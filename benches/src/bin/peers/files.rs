//! Files that both sides read.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Poses of each trajectory.
pub(crate) const POSES: usize = 100_000;
/// Points of the scan.
pub(crate) const SCAN_POINTS: usize = 200_000;

/// Where they are.
pub(crate) struct Files {
    pub(crate) reference: PathBuf,
    pub(crate) estimate: PathBuf,
    pub(crate) scan: PathBuf,
}

impl Files {
    pub(crate) fn write(folder: &Path) -> Result<Self, Box<dyn Error + Send + Sync>> {
        let files = Self {
            reference: folder.join("reference.tum"),
            estimate: folder.join("estimate.tum"),
            scan: folder.join("scan.ply"),
        };
        vice_benches::write_tum(&files.reference, POSES, 0.0)?;
        vice_benches::write_tum(&files.estimate, POSES, 0.02)?;
        let mut ply = BufWriter::new(File::create(&files.scan)?);
        write!(ply, "ply\nformat binary_little_endian 1.0\nelement vertex {SCAN_POINTS}\n")?;
        write!(ply, "property float x\nproperty float y\nproperty float z\nend_header\n")?;
        for p in vice_benches::before_the_camera(SCAN_POINTS) {
            for v in [p.x, p.y, p.z] {
                ply.write_all(&v.to_le_bytes())?;
            }
        }
        ply.flush()?;
        Ok(files)
    }
}
