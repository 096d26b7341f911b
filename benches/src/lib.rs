//! Benchmarks, and what they share: where the data is, and a scan of any size.

pub mod flight;

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use vice_core::camera::{Camera, CameraError, Model};
use vice_core::dataset::{Floor, Plane};
use vice_core::depth::Keyframe;
use vice_core::frames::{BodyFromCamera, WorldFromCamera};
use vice_core::random::Congruential;
use vice_core::time::Stamp;

/// A file of the shared data (`VICE_SHARED`, by default `../shared`), if it is there.
pub fn shared(relative: &str) -> Option<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let base = std::env::var_os("VICE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let path = root.join(base).join(relative);
    path.exists().then_some(path)
}

/// A key frame of a camera at a place.
pub fn keyframe(camera: &Camera, world_from_camera: WorldFromCamera) -> Keyframe<'_> {
    Keyframe {
        stamp: Stamp::default(),
        frame: 0,
        camera,
        body_from_camera: BodyFromCamera::identity(),
        world_from_camera: Some(world_from_camera),
        floor: Floor::World(Plane::z_zero()),
    }
}

/// A room of 10 x 10 x 3 m with nine columns in it, scanned evenly at random: so many points, metres.
pub fn scan(points: usize) -> Vec<Point3<f32>> {
    scan_points(points).collect()
}

/// The same, one point after the other.
pub fn scan_points(points: usize) -> impl Iterator<Item = Point3<f32>> {
    let mut boxes = vec![[[-5.0, -5.0, 0.0], [5.0, 5.0, 3.0]]];
    for i in 0..9 {
        let (x, y) = (f64::from(i % 3) * 3.0 - 3.0, f64::from(i / 3) * 3.0 - 3.0);
        boxes.push([[x - 0.3, y - 0.3, 0.0], [x + 0.3, y + 0.3, 1.0 + 0.2 * f64::from(i)]]);
    }
    let mut faces = Vec::new();
    let mut area_m2 = 0.0;
    for [low, high] in boxes {
        for axis in 0..3 {
            let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
            for side in [low[axis], high[axis]] {
                area_m2 += (high[a] - low[a]) * (high[b] - low[b]);
                faces.push((area_m2, axis, side, low, high));
            }
        }
    }
    let mut numbers = Congruential::new(42);
    let mut next = move || numbers.uniform(0.0, 1.0);
    (0..points).map(move |_| {
        let at = next() * area_m2;
        let (_, axis, side, low, high) = faces[faces.partition_point(|f| f.0 <= at).min(faces.len() - 1)];
        let mut p = [0.0; 3];
        p[axis] = side;
        for i in [(axis + 1) % 3, (axis + 2) % 3] {
            p[i] = low[i] + (high[i] - low[i]) * next();
        }
        Point3::from(p).cast()
    })
}

/// A camera in that room, 1.5 m up, that looks along its diagonal and a little down.
pub fn in_the_room() -> WorldFromCamera {
    let forward = Vector3::new(1.0, 0.8, -0.15).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    WorldFromCamera::from_parts(Vector3::new(-4.5, -4.2, 1.5), rotation)
}

/// Runs something with one thread.
///
/// # Errors
/// If the thread cannot be started.
pub fn in_one_thread<R: Send>(work: impl FnOnce() -> R + Send) -> Result<R, rayon::ThreadPoolBuildError> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(work))
}

/// Points in the view of a camera at the origin that looks along z: two walls, one 4 m and one 9 m away, metres.
pub fn before_the_camera(points: usize) -> impl Iterator<Item = Point3<f32>> {
    let mut numbers = Congruential::new(42);
    (0..points).map(move |_| {
        let [a, b] = [numbers.uniform(-0.8, 0.8), numbers.uniform(-0.5, 0.5)];
        let z = if a < 0.0 { 4.0 + b } else { 9.0 - a };
        Point3::new(a * z, b * z, z).cast()
    })
}

/// Writes poses along a curve at 200 Hz in TUM's format, each coordinate off by at most `noise_m`.
///
/// # Errors
/// If the file cannot be written.
pub fn write_tum(path: &Path, poses: usize, noise_m: f64) -> std::io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    let mut numbers = Congruential::new(7);
    for i in 0..poses {
        let ns = 1_600_000_000_000_000_000 + 5_000_000 * i as u64;
        let t = i as f64 / 200.0;
        let [x, y, z] = [t.cos(), (2.0 * t).sin(), 0.3 * t].map(|v| v + numbers.uniform(-noise_m, noise_m));
        let half = 0.5 * (0.2 * t).sin();
        let (seconds, nanos) = (ns / 1_000_000_000, ns % 1_000_000_000);
        writeln!(file, "{seconds}.{nanos:09} {x:.9} {y:.9} {z:.9} 0 0 {:.9} {:.9}", half.sin(), half.cos())?;
    }
    file.flush()
}

/// The camera of EuRoC's first sequence.
///
/// # Errors
/// Never with these numbers.
pub fn radtan() -> Result<Camera, CameraError> {
    let model = Model::from_name("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05])?;
    Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], model)
}

/// A small motion.
pub fn small_motion() -> WorldFromCamera {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.2, 0.05));
    WorldFromCamera::from_parts(Vector3::new(0.1, 0.0, -0.1), rotation)
}

/// The best time of moving and projecting so many points with [`radtan`], seconds; infinity where that camera fails.
pub fn project_moved_seconds(points: usize) -> f64 {
    let Ok(camera) = radtan() else { return f64::INFINITY };
    let mut numbers = Congruential::new(7);
    let [x, y, z] =
        [[-0.7, 0.7], [-0.42, 0.42], [1.0, 8.0]].map(|[low, high]| numbers.list(points, low, high));
    let (mut u, mut v, mut valid) = (vec![0.0; points], vec![0.0; points], vec![false; points]);
    let camera_from_world = small_motion().inverse();
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let start = Instant::now();
        camera.project_from_batch(&camera_from_world, [&x, &y, &z], [&mut u, &mut v], &mut valid);
        best = best.min(start.elapsed().as_secs_f64());
    }
    best
}
