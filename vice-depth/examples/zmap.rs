//! Depth at pixels from a scan of the scene: the Z-map of a PLY file.
//!
//! ```text
//! cargo run --release -p vice-depth --example zmap [scan.ply]
//! ```
//!
//! The camera stands at the origin of the scan and looks along its z axis. Without a file a small scan is written to a
//! temporary folder first: a wall 4 m away, and a board 1.5 m in front of its left half.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::camera::{Camera, Model, Pixel};
use vice_core::dataset::{Floor, Plane};
use vice_core::depth::{DepthSource, Keyframe};
use vice_core::frames::Rigid;
use vice_core::time::Stamp;
use vice_depth::{Cloud, CloudOptions, ZMapDepth, ZMapOptions, depth_image};

/// Points every 2 cm.
const SPACING_M: f64 = 0.02;

/// A grid of points at one depth, from left to right and 3 m high.
fn grid(from_x_m: f64, to_x_m: f64, z_m: f64) -> impl Iterator<Item = [f64; 3]> {
    let columns = ((to_x_m - from_x_m) / SPACING_M) as usize;
    let at = move |column, row| [from_x_m + SPACING_M * column as f64, SPACING_M * row as f64 - 1.5, z_m];
    (0..columns).flat_map(move |column| (0..150).map(move |row| at(column, row)))
}

fn write_scan(path: &Path) -> std::io::Result<()> {
    let points: Vec<[f64; 3]> = grid(-2.5, 2.5, 4.0).chain(grid(-1.0, 0.0, 2.5)).collect();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        points.len()
    );
    for [x, y, z] in points {
        writeln!(text, "{x} {y} {z}").map_err(std::io::Error::other)?;
    }
    std::fs::write(path, text)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = match std::env::args_os().nth(1) {
        Some(path) => PathBuf::from(path),
        None => {
            let path = folder.path().join("scan.ply");
            write_scan(&path)?;
            path
        }
    };
    let cloud = Cloud::read(&path, &CloudOptions::default())?;
    let zmap = ZMapDepth::new(Arc::new(cloud), Rigid::identity(), ZMapOptions::default());

    let camera = Camera::new(320, 240, [250.0, 250.0, 160.0, 120.0], Model::Pinhole)?;
    let keyframe = Keyframe {
        stamp: Stamp::from_nanos(0),
        frame: 0,
        camera: &camera,
        body_from_camera: Rigid::identity(),
        world_from_camera: Some(Rigid::identity()),
        floor: Floor::World(Plane::z_zero()),
    };
    let pixels = [Pixel::new(100.0, 120.0), Pixel::new(159.5, 120.0), Pixel::new(220.0, 120.0)];
    for (pixel, depth) in pixels.iter().zip(zmap.depths(&keyframe, &pixels)?) {
        match depth {
            Ok(depth) => println!("({}, {}): {:.3} m", pixel.u, pixel.v, depth.z_m),
            Err(why) => println!("({}, {}): {why}", pixel.u, pixel.v),
        }
    }
    let map = depth_image(&zmap, &keyframe)?;
    println!("{} of {} pixels have a depth", map.answered(), map.pixels().len());
    for (why, pixels) in map.misses() {
        println!("  {pixels}: {why}");
    }
    Ok(())
}
