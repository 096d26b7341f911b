//! Benchmarks, and what they share: where the data is, and a scan of any size.

use std::path::PathBuf;

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use vice_core::camera::Camera;
use vice_core::dataset::{Floor, Plane};
use vice_core::depth::Keyframe;
use vice_core::frames::{BodyFromCamera, WorldFromCamera};
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
    let mut state = 42_u64;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
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
