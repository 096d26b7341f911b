//! Scans and meshes as PLY.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::Result;

fn create(folder: &Path) -> Result<BufWriter<File>> {
    let folder = folder.join("flight/mav0/pointcloud0");
    std::fs::create_dir_all(&folder)?;
    Ok(BufWriter::with_capacity(1 << 20, File::create(folder.join("data.ply"))?))
}

fn head(file: &mut impl Write, vertices: usize, faces: Option<usize>) -> Result<()> {
    write!(file, "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n")?;
    write!(file, "property float x\nproperty float y\nproperty float z\n")?;
    if let Some(faces) = faces {
        write!(file, "element face {faces}\nproperty list uchar int vertex_indices\n")?;
    }
    Ok(file.write_all(b"end_header\n")?)
}

/// A scan of a room with so many points, as the flight's cloud.
pub(crate) fn write_scan(folder: &Path, points: usize) -> Result<()> {
    let mut file = create(folder)?;
    head(&mut file, points, None)?;
    for p in vice_benches::scan_points(points) {
        for v in [p.x, p.y, p.z] {
            file.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(file.flush()?)
}

/// A wavy ground of about so many faces, 10 x 10 m, as the flight's cloud.
pub(crate) fn write_mesh(folder: &Path, faces: usize) -> Result<()> {
    let side = ((faces / 2) as f64).sqrt().ceil() as u32;
    let mut file = create(folder)?;
    head(&mut file, ((side + 1) * (side + 1)) as usize, Some((2 * side * side) as usize))?;
    let at = |i: u32| (f64::from(i) / f64::from(side) * 10.0 - 5.0) as f32;
    for (x, y) in (0..=side).flat_map(|j| (0..=side).map(move |i| (at(i), at(j)))) {
        for v in [x, y, 0.1 * (3.0 * x).sin() * (2.0 * y).cos()] {
            file.write_all(&v.to_le_bytes())?;
        }
    }
    for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
        let corner = j * (side + 1) + i;
        let above = corner + side + 1;
        for triangle in [[corner, corner + 1, above], [corner + 1, above + 1, above]] {
            file.write_all(&[3])?;
            for index in triangle {
                file.write_all(&index.to_le_bytes())?;
            }
        }
    }
    Ok(file.flush()?)
}
