//! Reads a scan of many points from a file, indexes it, asks it for a key frame, and says what that took.
//!
//! usage: `large_scan [POINTS]` (50,000,000 by default; the file is written to a temporary folder first)
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use vice_benches::{in_the_room, keyframe, scan_points};
use vice_core::camera::{Camera, Model, Pixel};
use vice_core::depth::DepthSource;
use vice_core::frames::Rigid;
use vice_depth::{Cloud, CloudOptions, ZMapDepth, ZMapOptions, depth_image, read_scan_points};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    if let (Some(first), Some(path)) = (arguments.next(), arguments.next())
        && first == "--read"
    {
        return read(&path);
    }
    let points: usize = std::env::args().nth(1).map_or(Ok(50_000_000), |n| n.parse())?;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("scan.ply");
    let mut file = BufWriter::new(File::create(&path)?);
    write!(file, "ply\nformat binary_little_endian 1.0\nelement vertex {points}\n")?;
    write!(file, "property float x\nproperty float y\nproperty float z\nend_header\n")?;
    for p in scan_points(points) {
        for v in [p.x, p.y, p.z] {
            file.write_all(&v.to_le_bytes())?;
        }
    }
    file.into_inner()?.sync_all()?;
    // A process of its own, so that its peak memory is that of reading alone.
    let status = Command::new(std::env::current_exe()?).arg("--read").arg(&path).status()?;
    if status.success() { Ok(()) } else { Err("reading failed".into()) }
}

fn read(path: &str) -> Result<(), Box<dyn Error>> {
    let options = CloudOptions::default();
    let start = Instant::now();
    let points = read_scan_points(path, &options)?;
    let (n, took) = (points.points.len(), start.elapsed());
    drop(points);
    println!("read {n} points in {took:.2?}: {:.1} million points/s", n as f64 / took.as_secs_f64() / 1e6);
    let start = Instant::now();
    let cloud = Arc::new(Cloud::read(path, &options)?);
    let index = start.elapsed().saturating_sub(took);
    println!("indexed in about {index:.2?}: {:.1} million points/s", n as f64 / index.as_secs_f64() / 1e6);
    println!(
        "the cloud holds {:.0} MB, {:.2} times its coordinates",
        cloud.bytes() as f64 / 1e6,
        cloud.bytes() as f64 / (12.0 * n as f64)
    );
    println!("{}", peak_memory());
    let camera = Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], Model::Pinhole)?;
    let keyframe = keyframe(&camera, in_the_room());
    for occlusion in [true, false] {
        let zmap = ZMapDepth::new(
            Arc::clone(&cloud),
            Rigid::identity(),
            ZMapOptions { occlusion, ..ZMapOptions::default() },
        );
        let pixels: Vec<Pixel> =
            (0..8).map(|i| Pixel::new(60.0 + 90.0 * f64::from(i), 400.0 - 45.0 * f64::from(i))).collect();
        for count in [1, 8] {
            let start = Instant::now();
            let answered = zmap.depths(&keyframe, &pixels[..count])?.iter().filter(|d| d.is_ok()).count();
            println!(
                "occlusion {occlusion}: {answered} of {count} pixels answered in {:.1?}",
                start.elapsed()
            );
        }
    }
    println!("{}", peak_memory());
    let zmap = ZMapDepth::new(cloud, Rigid::identity(), ZMapOptions::default());
    let start = Instant::now();
    let answered = depth_image(&zmap, &keyframe)?.answered();
    println!("whole depth image, occlusion on: {answered} pixels answered in {:.2?}", start.elapsed());
    println!("{}", peak_memory());
    Ok(())
}

/// The line of the kernel that says so, where there is one.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or("peak memory is not known here").to_string()
}
