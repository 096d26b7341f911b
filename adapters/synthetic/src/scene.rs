//! The room: a floor, four walls, a ceiling, and boxes, as cuboids that rays are cast against.
//!
//! The room is a cuboid seen from inside, every box one seen from outside. A [`Surface`] is one face of one cuboid;
//! the coordinates of a point on it are metres to the right and upwards for who looks at it, from its lower left.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use parry3d::math::Vector as ParryVector;
use parry3d::query::{Ray, RayCast};
use parry3d::shape::Cuboid;
use vice_core::random::SplitMix;

use crate::material::Material;

/// Width and depth of the room, metres; its middle is the origin of the world.
pub const ROOM_SIDE_M: f64 = 8.0;
/// Height of the room, metres.
pub const ROOM_HEIGHT_M: f64 = 2.8;

/// What a surface is part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum SurfaceKind {
    /// z = 0.
    Floor,
    /// One of the four walls.
    Wall,
    /// Above everything; hardly ever in view.
    Ceiling,
    /// A face of a box.
    Box,
}

/// A face of one of the cuboids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Surface(pub(crate) u16);

/// Where a ray meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// How many times the ray's direction: metres where that has unit length, depth where its camera z is 1.
    pub distance: f64,
    /// Which face.
    pub surface: Surface,
    /// Where, metres in the world.
    pub point: Point3<f64>,
    /// Where on the face, metres to the right and upwards from its lower left corner.
    pub texture_m: [f64; 2],
}

/// A face as shading sees it.
#[derive(Clone, Debug)]
pub(crate) struct Face {
    pub(crate) kind: SurfaceKind,
    pub(crate) material: Material,
    /// Directions of the texture coordinates in the world.
    pub(crate) right: Vector3<f64>,
    pub(crate) up: Vector3<f64>,
    /// Towards the viewer.
    pub(crate) normal: Vector3<f64>,
    /// Lower left corner in the world.
    pub(crate) corner: Point3<f64>,
    /// Size to the right and upwards, metres.
    pub(crate) size_m: [f64; 2],
}

/// A cuboid and its place.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    shape: Cuboid,
    half_m: Vector3<f64>,
    world_from_solid: Isometry3<f64>,
}

/// A furnished room, the same for the same seed.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The room first, then the boxes.
    pub(crate) solids: Vec<Solid>,
    /// Six faces a solid.
    pub(crate) faces: Vec<Face>,
}

impl Face {
    /// Texture coordinates of a point on the face, metres.
    pub(crate) fn texture_m(&self, point: &Point3<f64>) -> [f64; 2] {
        let from_corner = point - self.corner;
        [from_corner.dot(&self.right), from_corner.dot(&self.up)]
    }
}

impl Solid {
    fn new(size_m: [f64; 3], base: [f64; 3], yaw_rad: f64) -> Self {
        let half_m = Vector3::from(size_m) / 2.0;
        let centre = Vector3::new(base[0], base[1], base[2] + half_m.z);
        Self {
            shape: Cuboid::new(parry(&half_m)),
            half_m,
            world_from_solid: Isometry3::from_parts(
                Translation3::from(centre),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
            ),
        }
    }

    /// The pose, to bring rays into the solid's own frame.
    pub(crate) const fn world_from_solid(&self) -> &Isometry3<f64> {
        &self.world_from_solid
    }

    /// The eight corners in the world.
    pub(crate) fn corners(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        (0..8_u8).map(|bits| {
            let sign = |bit: u8| if bits & bit == 0 { -1.0 } else { 1.0 };
            let corner = self.half_m.component_mul(&Vector3::new(sign(1), sign(2), sign(4)));
            self.world_from_solid.transform_point(&Point3::from(corner))
        })
    }

    /// Distance along a ray in the solid's frame, in multiples of its direction, and the face (0 to 5) it meets first;
    /// from inside that is the far side.
    pub(crate) fn cast_local(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        limit: f64,
    ) -> Option<(f64, u16)> {
        let ray = Ray::new(parry(origin), parry(direction));
        let distance = self.shape.cast_local_ray(&ray, limit, false)?;
        // The face is the one whose plane the point lies on: the coordinate nearest to its half extent.
        let at = origin + direction * distance;
        let off = |axis: usize| (at[axis].abs() / self.half_m[axis] - 1.0).abs() * self.half_m[axis];
        let axis = (1..3).fold(0, |best, axis| if off(axis) < off(best) { axis } else { best });
        Some((distance, 2 * axis as u16 + u16::from(at[axis] < 0.0)))
    }

    /// Distance of a point from the solid, zero inside, metres.
    fn distance_m(&self, point: &Point3<f64>) -> f64 {
        let local = self.world_from_solid.inverse_transform_point(point);
        (local.coords.abs() - self.half_m).map(|d| d.max(0.0)).norm()
    }

    /// Whether a point is inside or on the solid.
    pub(crate) fn covers(&self, point: &Point3<f64>) -> bool {
        self.distance_m(point) < 1e-6
    }

    /// Distance of a point from the solid as seen from above, zero over or under it, metres; infinite beyond `limit_m`
    /// of its outline, which costs much less to find out.
    pub(crate) fn distance_on_floor_m(&self, point: &Point3<f64>, limit_m: f64) -> f64 {
        let from_centre = point.coords.xy() - self.world_from_solid.translation.vector.xy();
        if from_centre.norm_squared() > (self.half_m.xy().norm() + limit_m).powi(2) {
            return f64::INFINITY;
        }
        let local = self.world_from_solid.inverse_transform_point(point);
        (local.coords.xy().abs() - self.half_m.xy()).map(|d| d.max(0.0)).norm()
    }

    /// Whether it stands on the floor.
    pub(crate) fn stands_on_floor(&self) -> bool {
        (self.world_from_solid.translation.z - self.half_m.z).abs() < 1e-9
    }
}

impl Scene {
    /// The room of a seed.
    pub fn new(seed: u64) -> Self {
        let mut rng = SplitMix::for_purpose(seed, 1);
        let mut scene = Self { solids: Vec::new(), faces: Vec::new() };
        let room = Solid::new([ROOM_SIDE_M, ROOM_SIDE_M, ROOM_HEIGHT_M], [0.0; 3], 0.0);
        scene.add_room(room, &mut rng);
        scene.add_middle(&mut rng);
        scene.add_corners(&mut rng);
        scene
    }

    fn add_room(&mut self, room: Solid, rng: &mut SplitMix) {
        let materials = [
            (SurfaceKind::Wall, Material::WindowWall),
            (SurfaceKind::Wall, Material::Bricks),
            (SurfaceKind::Wall, Material::DoorWall),
            (SurfaceKind::Wall, Material::PosterWall(rng.bits32())),
            (SurfaceKind::Ceiling, Material::Plaster),
            (SurfaceKind::Floor, Material::Tiles(rng.bits32())),
        ];
        self.add(room, -1.0, materials);
    }

    /// Boxes in the middle, which the flight circles, with one on top of another: depth edges from every side.
    fn add_middle(&mut self, rng: &mut SplitMix) {
        let mut placed: Vec<(f64, f64, f64)> = Vec::new();
        let first = rng.uniform(0.0, std::f64::consts::TAU);
        for i in 0..4_u8 {
            let size = [rng.uniform(0.45, 0.7), rng.uniform(0.4, 0.65), rng.uniform(0.3, 0.8)];
            let reach = size[0].hypot(size[1]) / 2.0;
            let bearing = first + f64::from(i) * std::f64::consts::FRAC_PI_2 + rng.uniform(-0.3, 0.3);
            // Outwards until it touches no other: the order of the draws decides, nothing else.
            let mut distance = rng.uniform(0.35, 0.8);
            let clear = |d: f64| {
                let (x, y) = (d * bearing.cos(), d * bearing.sin());
                placed.iter().all(|(px, py, r)| (x - px).hypot(y - py) > r + reach + 0.12)
            };
            while !clear(distance) {
                distance += 0.02;
            }
            let (x, y) = (distance * bearing.cos(), distance * bearing.sin());
            placed.push((x, y, reach));
            let yaw = rng.uniform(0.0, std::f64::consts::PI);
            let material =
                if i % 2 == 0 { Material::Crate(rng.bits32()) } else { Material::Cardboard(rng.bits32()) };
            self.add_box(Solid::new(size, [x, y, 0.0], yaw), material);
            if i == 0 {
                let top = [size[0] * 0.55, size[1] * 0.6, rng.uniform(0.2, 0.28)];
                let turned = yaw + rng.uniform(0.2, 0.6);
                self.add_box(Solid::new(top, [x, y, size[2]], turned), Material::Cardboard(rng.bits32()));
            }
        }
    }

    /// Furniture in the corners and along the walls, outside the flight's circle.
    fn add_corners(&mut self, rng: &mut SplitMix) {
        for (i, (sx, sy)) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].into_iter().enumerate() {
            let size = [rng.uniform(0.7, 0.95), rng.uniform(0.5, 0.8), rng.uniform(0.6, 1.7)];
            let back = ROOM_SIDE_M / 2.0 - 0.05;
            let base = [sx * (back - size[0] / 2.0), sy * (back - size[1] / 2.0), 0.0];
            let material =
                if i % 2 == 0 { Material::Cabinet(rng.bits32()) } else { Material::Crate(rng.bits32()) };
            self.add_box(Solid::new(size, base, 0.0), material);
        }
        for (x, y) in [(0.0, 1.0), (0.0, -1.0)] {
            let size = [rng.uniform(0.5, 0.7), 0.45, rng.uniform(0.35, 0.6)];
            let along = rng.uniform(-1.4, 1.4);
            let base = [x + along, y * (ROOM_SIDE_M / 2.0 - 0.3), 0.0];
            self.add_box(Solid::new(size, base, rng.uniform(-0.08, 0.08)), Material::Cardboard(rng.bits32()));
        }
    }

    fn add_box(&mut self, solid: Solid, material: Material) {
        self.add(solid, 1.0, [(SurfaceKind::Box, material); 6]);
    }

    /// Adds a solid; `outwards` is 1 for a box and -1 for the room. Faces in the order +x -x +y -y +z -z.
    fn add(&mut self, solid: Solid, outwards: f64, materials: [(SurfaceKind, Material); 6]) {
        for (i, (kind, material)) in materials.into_iter().enumerate() {
            let (axis, sign) = (i / 2, if i % 2 == 0 { 1.0 } else { -1.0 });
            let mut outward = Vector3::zeros();
            outward[axis] = sign;
            let normal = outward * outwards;
            let (right, up) = if axis == 2 {
                (Vector3::x(), Vector3::y() * normal.z)
            } else {
                (Vector3::z().cross(&normal), Vector3::z())
            };
            let size_m = [right, up].map(|d| 2.0 * d.abs().dot(&solid.half_m));
            let centre = outward.component_mul(&solid.half_m);
            let corner = Point3::from(centre - right * size_m[0] / 2.0 - up * size_m[1] / 2.0);
            let pose = &solid.world_from_solid;
            self.faces.push(Face {
                kind,
                material,
                right: pose.rotation * right,
                up: pose.rotation * up,
                normal: pose.rotation * normal,
                corner: pose.transform_point(&corner),
                size_m,
            });
        }
        self.solids.push(solid);
    }

    /// Where a ray first meets the scene; `None` only for a ray that is not finite or starts outside the room.
    ///
    /// `origin` in metres in the world, `direction` of any length. Tests every solid.
    pub fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        let mut nearest: Option<(f64, u16)> = None;
        for (i, solid) in (0_u16..).zip(&self.solids) {
            let local_origin = solid.world_from_solid.inverse_transform_point(origin).coords;
            let local_direction = solid.world_from_solid.inverse_transform_vector(direction);
            let limit = nearest.map_or(f64::MAX, |(distance, _)| distance);
            if let Some((distance, face)) = solid.cast_local(&local_origin, &local_direction, limit) {
                nearest = Some((distance, 6 * i + face));
            }
        }
        let (distance, surface) = nearest?;
        let point = origin + direction * distance;
        let texture_m = self.faces[usize::from(surface)].texture_m(&point);
        Some(Hit { distance, surface: Surface(surface), point, texture_m })
    }

    /// What a surface is part of.
    ///
    /// # Panics
    /// If the surface is of another scene with more boxes.
    pub fn kind(&self, surface: Surface) -> SurfaceKind {
        self.faces[usize::from(surface.0)].kind
    }

    /// Distance of a point inside the room from the nearest wall or box, metres; zero inside a box.
    pub fn clearance_m(&self, point: &Point3<f64>) -> f64 {
        let room = &self.solids[0];
        let local = room.world_from_solid.inverse_transform_point(point);
        let inside = (room.half_m - local.coords.abs()).min();
        self.solids[1..].iter().map(|s| s.distance_m(point)).fold(inside, f64::min).max(0.0)
    }
}

fn parry(v: &Vector3<f64>) -> ParryVector {
    ParryVector::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{Flight, body_from_camera};
    use approx::assert_relative_eq;

    #[test]
    fn rays_meet_floor_walls_and_boxes_where_they_are() {
        let scene = Scene::new(3);
        let eye = Point3::new(0.3, -2.5, 1.6);
        let down = scene.cast(&eye, &Vector3::new(0.0, 0.0, -2.0)).unwrap();
        assert_eq!(scene.kind(down.surface), SurfaceKind::Floor);
        assert_relative_eq!(down.distance, 0.8, epsilon = 1e-12);
        assert_relative_eq!(down.texture_m[0], 4.3, epsilon = 1e-12);
        assert_relative_eq!(down.texture_m[1], 1.5, epsilon = 1e-12);
        let up = scene.cast(&eye, &Vector3::z()).unwrap();
        assert_eq!(scene.kind(up.surface), SurfaceKind::Ceiling);
        let wall = scene.cast(&Point3::new(0.0, 0.0, 2.5), &Vector3::new(1.0, 0.1, 0.0)).unwrap();
        assert_eq!(scene.kind(wall.surface), SurfaceKind::Wall);
        assert_relative_eq!(wall.point, Point3::new(4.0, 0.4, 2.5), epsilon = 1e-12);
        // From the middle of the wall at x = 4, right is towards -y for who looks at it.
        assert_relative_eq!(wall.texture_m[0], 3.6, epsilon = 1e-12);
        for solid in &scene.solids[1..] {
            let centre = Point3::from(solid.world_from_solid.translation.vector);
            let above = centre + Vector3::z() * (2.7 - centre.z);
            let hit = scene.cast(&above, &-Vector3::z()).unwrap();
            assert_eq!(scene.kind(hit.surface), SurfaceKind::Box);
            let face = &scene.faces[usize::from(hit.surface.0)];
            assert_relative_eq!(face.normal, Vector3::z(), epsilon = 1e-12);
        }
        assert!(scene.cast(&Point3::new(9.0, 0.0, 1.0), &Vector3::x()).is_none());
    }

    #[test]
    fn texture_coordinates_lie_on_the_face_and_run_right_and_up() {
        let scene = Scene::new(1);
        for face in &scene.faces {
            assert_relative_eq!(face.right.cross(&face.up), face.normal, epsilon = 1e-12);
        }
        let eye = Point3::new(2.4, 0.2, 1.4);
        for i in 0..500 {
            let direction = Vector3::new(-1.0, (f64::from(i) * 0.37).sin(), (f64::from(i) * 0.73).cos());
            let hit = scene.cast(&eye, &direction).unwrap();
            let face = &scene.faces[usize::from(hit.surface.0)];
            let again = face.corner + face.right * hit.texture_m[0] + face.up * hit.texture_m[1];
            assert_relative_eq!(again, hit.point, epsilon = 1e-9);
            assert!(face.normal.dot(&direction) < 0.0);
        }
    }

    #[test]
    fn the_flight_keeps_clear_of_everything() {
        for seed in 0..40 {
            let (scene, flight) = (Scene::new(seed), Flight::new(seed));
            for step in -10..=1200 {
                let pose = flight.at(f64::from(step) * 0.05).world_from_body * body_from_camera();
                let clearance = scene.clearance_m(&Point3::from(pose.translation()));
                assert!(clearance > 0.25, "seed {seed} at step {step}: {clearance} m");
            }
        }
    }
}
