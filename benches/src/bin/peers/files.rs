//! Files that both sides read.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::DataError;

/// Poses of each trajectory.
pub(crate) const POSES: usize = 100_000;
/// Points of the scan.
pub(crate) const SCAN_POINTS: usize = 200_000;

/// Where they are.
pub(crate) struct Files {
    pub(crate) reference: PathBuf,
    pub(crate) estimate: PathBuf,
    pub(crate) scan: PathBuf,
    /// The bytes of two pictures, row by row.
    pub(crate) pictures: [PathBuf; 2],
    pub(crate) before: Image,
    pub(crate) after: Image,
}

impl Files {
    pub(crate) fn write(folder: &Path) -> Result<Self, Box<dyn Error + Send + Sync>> {
        let files = Self {
            reference: folder.join("reference.tum"),
            estimate: folder.join("estimate.tum"),
            scan: folder.join("scan.ply"),
            pictures: [folder.join("before.raw"), folder.join("after.raw")],
            before: picture([0.0, 0.0])?,
            after: picture([3.3, -2.4])?,
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
        for (path, image) in files.pictures.iter().zip([&files.before, &files.after]) {
            std::fs::write(path, image.data())?;
        }
        Ok(files)
    }
}

/// Smoothed noise, 752x480, moved by so many pixels.
fn picture([right, down]: [f64; 2]) -> Result<Image, DataError> {
    const MARGIN: usize = 16;
    let (width, height) = (752 + 2 * MARGIN, 480 + 2 * MARGIN);
    let mut smooth = vice_core::random::Congruential::new(7).list(width * height, 0.0, 255.0);
    // Three means over five pixels each way are nearly a Gaussian of 2.4 pixels.
    for step in [1, width, 1, width, 1, width] {
        let before = smooth.clone();
        for i in 2 * step..smooth.len() - 2 * step {
            smooth[i] = (0..5).map(|k| before[i + k * step - 2 * step]).sum::<f64>() / 5.0;
        }
    }
    let at = |x: f64, y: f64| {
        let (i, j) = (x.floor(), y.floor());
        let (a, b, corner) = (x - i, y - j, j as usize * width + i as usize);
        let row = |start: usize| smooth[start] * (1.0 - a) + smooth[start + 1] * a;
        row(corner) * (1.0 - b) + row(corner + width) * b
    };
    let bytes = (0..480).flat_map(|y| (0..752).map(move |x| (f64::from(x), f64::from(y)))).map(|(x, y)| {
        let value = at(x + MARGIN as f64 - right, y + MARGIN as f64 - down);
        // The noise is flat after smoothing: its contrast is brought back.
        ((value - 127.5) * 6.0 + 127.5).round().clamp(0.0, 255.0) as u8
    });
    Image::new(752, 480, PixelFormat::Gray8, bytes.collect())
}
