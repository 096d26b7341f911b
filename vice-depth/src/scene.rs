//! A scene whose depth is known exactly, for tests: a room with boxes in it, scanned at random.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use vice_core::camera::{Camera, Model, Pixel};
use vice_core::dataset::{Floor, Plane};
use vice_core::depth::Keyframe;
use vice_core::frames::{BodyFromCamera, WorldFromCamera};
use vice_core::time::Stamp;

/// Numbers that are random enough, and the same every time.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Boxes with sides along the axes; the first is the room, seen from inside. Metres.
pub(crate) struct Scene {
    pub(crate) boxes: Vec<[[f64; 3]; 2]>,
}

impl Scene {
    /// Six by five metres, with four boxes on the floor and one in the air.
    pub(crate) fn room() -> Self {
        Self {
            boxes: vec![
                [[-3.0, -2.5, 0.0], [3.0, 2.5, 3.0]],
                [[0.2, -1.4, 0.0], [0.9, -0.6, 0.8]],
                [[1.2, 0.3, 0.0], [1.6, 0.9, 1.5]],
                [[-1.0, 1.0, 0.0], [-0.2, 1.8, 0.4]],
                [[2.0, -2.2, 0.0], [2.7, -1.5, 2.0]],
                [[0.8, -0.2, 1.2], [1.1, 0.1, 1.5]],
            ],
        }
    }

    /// Points at random, so many a square metre of surface.
    pub(crate) fn scan(&self, per_m2: f64) -> Vec<Point3<f32>> {
        let mut random = Random(7);
        let mut points = Vec::new();
        for [low, high] in &self.boxes {
            for axis in 0..3 {
                let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                for side in [low[axis], high[axis]] {
                    let area = (high[a] - low[a]) * (high[b] - low[b]);
                    for _ in 0..(area * per_m2) as usize {
                        let mut p = Point3::origin();
                        p[axis] = side;
                        p[a] = low[a] + (high[a] - low[a]) * random.next();
                        p[b] = low[b] + (high[b] - low[b]) * random.next();
                        points.push(p.cast());
                    }
                }
            }
        }
        points
    }

    /// Distance along a ray, in lengths of its direction.
    pub(crate) fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> f64 {
        let mut nearest = f64::INFINITY;
        for (i, [low, high]) in self.boxes.iter().enumerate() {
            let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
            for axis in 0..3 {
                let (a, b) = (
                    (low[axis] - origin[axis]) / direction[axis],
                    (high[axis] - origin[axis]) / direction[axis],
                );
                (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
            }
            let hit = if i == 0 { leave } else { enter };
            if enter <= leave && hit > 0.0 {
                nearest = nearest.min(hit);
            }
        }
        nearest
    }

    /// Depth along the optical axis of a pixel, metres.
    pub(crate) fn depth(&self, keyframe: &Keyframe<'_>, px: Pixel) -> f64 {
        let world_from_camera = keyframe.world_from_camera.unwrap();
        let ray = keyframe.camera.unproject(px).unwrap();
        self.cast(&Point3::from(world_from_camera.translation()), &world_from_camera.rotate(&ray))
    }
}

/// A camera like EuRoC's.
pub(crate) fn camera() -> Camera {
    let model = Model::from_name("radtan", &[-0.283, 0.074, 0.0002, 0.00002]).unwrap();
    Camera::new(752, 480, [458.0, 457.0, 367.0, 248.0], model).unwrap()
}

/// A camera at a place of the room that looks at another.
pub(crate) fn look(camera: &Camera, from: [f64; 3], to: [f64; 3]) -> Keyframe<'_> {
    let (from, to) = (Vector3::from(from), Vector3::from(to));
    let world_from_axes = UnitQuaternion::face_towards(&(to - from), &-Vector3::z());
    Keyframe {
        stamp: Stamp::default(),
        frame: 0,
        camera,
        body_from_camera: BodyFromCamera::identity(),
        world_from_camera: Some(WorldFromCamera::from_parts(from, world_from_axes)),
        floor: Floor::World(Plane::z_zero()),
    }
}

/// Every `step`th pixel of an image.
pub(crate) fn grid(camera: &Camera, step: usize) -> Vec<Pixel> {
    let columns =
        move |v: u32| (0..camera.width()).step_by(step).map(move |u| Pixel::new(u.into(), v.into()));
    (0..camera.height()).step_by(step).flat_map(columns).collect()
}
