//! Depth of the floor: a pixel's ray against a plane.
//!
//! The paper divides by the length of a ray it has not normalised; what it means is the intersection of ray and
//! plane, and that is what this computes. The ray of a pixel is `(x, y, 1)` in the camera, so that the ray's
//! parameter at the plane is the depth along the optical axis itself. The plane is met from either side: a camera
//! under a ceiling plane looks up at it as one above a floor looks down.

use parry3d::math::Vector;
use parry3d::query::{Ray, RayCast};
use parry3d::shape::HalfSpace;
use vice_core::camera::Pixel;
use vice_core::dataset::{Floor, Plane};
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Camera, World};

/// Sine of the angle to the plane below which a ray counts as running along the horizon.
///
/// At 1e-4 the plane is met ten thousand camera heights away, where a tenth of a pixel decides between that and
/// infinity: such a number says nothing about the scene.
pub const HORIZON_SINE: f64 = 1e-4;

/// Depth from a floor plane.
///
/// The plane is the key frame's [`Floor`]. One in the world needs the anchor's pose; one in the body does not.
///
/// ```
/// use vice_core::camera::{Camera, Model, Pixel};
/// use vice_core::dataset::{Floor, Plane};
/// use vice_core::depth::{DepthMiss, DepthSource, Keyframe};
/// use vice_core::frames::Rigid;
/// use vice_core::nalgebra::{UnitQuaternion, Vector3};
/// use vice_core::time::Stamp;
/// use vice_depth::FloorDepth;
///
/// // 2 m over the floor z = 0, looking straight down.
/// let camera = Camera::new(640, 480, [400.0, 400.0, 320.0, 240.0], Model::Pinhole)?;
/// let down = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
/// let keyframe = Keyframe {
///     stamp: Stamp::from_nanos(0),
///     frame: 0,
///     camera: &camera,
///     body_from_camera: Rigid::identity(),
///     world_from_camera: Some(Rigid::from_parts(Vector3::new(0.0, 0.0, 2.0), down)),
///     floor: Floor::World(Plane::z_zero()),
/// };
/// let depths = FloorDepth::new().depths(&keyframe, &[Pixel::new(100.0, 80.0)])?;
/// assert!((depths[0].unwrap().z_m - 2.0).abs() < 1e-12);
/// // Without a pose the floor of the world is nowhere.
/// let lost = Keyframe { world_from_camera: None, ..keyframe };
/// assert_eq!(FloorDepth::new().depths(&lost, &[Pixel::new(100.0, 80.0)])?, [Err(DepthMiss::NoAnchor)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct FloorDepth {
    plane: Option<Plane<World>>,
}

impl FloorDepth {
    /// The floor as the data set has it at each key frame.
    pub const fn new() -> Self {
        Self { plane: None }
    }

    /// A plane of the world instead of the data set's floor.
    pub const fn with_plane(plane: Plane<World>) -> Self {
        Self { plane: Some(plane) }
    }

    /// The floor of a key frame, seen from the camera.
    fn in_camera(&self, keyframe: &Keyframe<'_>) -> Result<Plane<Camera>, DepthMiss> {
        let of_world = |plane: &Plane<World>| {
            let world_from_camera = keyframe.world_from_camera.ok_or(DepthMiss::NoAnchor)?;
            Ok(plane.transformed(&world_from_camera.inverse()))
        };
        match (&self.plane, &keyframe.floor) {
            (Some(plane), _) => of_world(plane),
            (None, Floor::World(plane)) => of_world(plane),
            (None, Floor::Body(plane)) => Ok(plane.transformed(&keyframe.body_from_camera.inverse())),
            // `Floor` may grow a frame that this source knows nothing of.
            (None, _) => Err(DepthMiss::NoAnchor),
        }
    }
}

impl DepthSource for FloorDepth {
    fn name(&self) -> &str {
        "floor"
    }

    fn needs_world(&self, floor: &Floor) -> bool {
        matches!(floor, Floor::World(_))
    }

    fn is_assumed(&self) -> bool {
        true
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        if self.plane.is_none() && keyframe.floor == Floor::Unknown {
            return Err(DataError::of_kind(
                ErrorKind::Missing,
                "no floor is known: nothing says which way is up or how high the cameras are",
            )
            .hint("give `floor-plane`, which `vice floor fit` finds in a scan or a depth image, or ask another `depth`"));
        }
        let plane = self.in_camera(keyframe);
        let depth = |pixel: &Pixel| {
            let plane = plane?;
            let ray = keyframe.camera.unproject(*pixel).map_err(|_| DepthMiss::OutsideModel)?;
            plane_depth_m(&plane, ray.x, ray.y).map(DepthSample::new).ok_or(DepthMiss::AboveHorizon)
        };
        Ok(pixels.iter().map(depth).collect())
    }
}

/// Depth along the optical axis at which the ray `(x, y, 1)` meets a plane of the camera frame, metres.
///
/// `None` where the plane lies behind the camera, or closer to parallel than [`HORIZON_SINE`].
fn plane_depth_m(plane: &Plane<Camera>, x: f64, y: f64) -> Option<f64> {
    let n = plane.normal();
    let normal = Vector::new(n.x, n.y, n.z);
    let direction = Vector::new(x, y, 1.0);
    if normal.dot(direction).abs() < HORIZON_SINE * direction.length() {
        return None;
    }
    // parry's half space goes through the origin: move the ray instead of the plane.
    let ray = Ray::new(normal * plane.d_m(), direction);
    let z_m = HalfSpace::new(normal).cast_local_ray(&ray, f64::MAX, false)?;
    (z_m > 0.0).then_some(z_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, UnitQuaternion, Vector3};
    use proptest::prelude::*;
    use vice_core::camera::{Camera as Intrinsics, Model};
    use vice_core::dataset::GROUND_TRUTH;
    use vice_core::frames::{Body, BodyFromCamera, Rigid, WorldFromCamera};
    use vice_core::time::Stamp;

    fn camera() -> Intrinsics {
        let model = Model::from_name("radtan", &[-0.28, 0.07, 0.0002, 0.00002]).unwrap();
        Intrinsics::new(752, 480, [458.0, 457.0, 367.0, 248.0], model).unwrap()
    }

    fn keyframe<'a>(
        camera: &'a Intrinsics,
        world_from_camera: Option<WorldFromCamera>,
        floor: Floor,
    ) -> Keyframe<'a> {
        Keyframe {
            stamp: Stamp::default(),
            frame: 0,
            camera,
            body_from_camera: BodyFromCamera::identity(),
            world_from_camera,
            floor,
        }
    }

    fn one(source: FloorDepth, keyframe: &Keyframe<'_>, u: f64, v: f64) -> Result<f64, DepthMiss> {
        source.depths(keyframe, &[Pixel::new(u, v)]).unwrap()[0].map(|d| d.z_m)
    }

    /// A camera 1.5 m above z = 0 that looks along world y: its y axis points down.
    fn level() -> WorldFromCamera {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
        Rigid::from_parts(Vector3::new(3.0, -2.0, 1.5), down)
    }

    #[test]
    fn an_unknown_floor_is_refused_unless_a_plane_is_given() {
        let camera = Intrinsics::new(640, 480, [400.0, 400.0, 320.0, 240.0], Model::Pinhole).unwrap();
        let keyframe = Keyframe {
            stamp: Stamp::default(),
            frame: 0,
            camera: &camera,
            body_from_camera: Rigid::identity(),
            world_from_camera: Some(Rigid::from_parts(
                Vector3::new(0.0, 0.0, 2.0),
                UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0),
            )),
            floor: Floor::Unknown,
        };
        let error = FloorDepth::new().depths(&keyframe, &[Pixel::new(320.0, 240.0)]).unwrap_err();
        assert!(error.to_string().starts_with("no floor is known"), "{error}");
        let given = FloorDepth::with_plane(Plane::z_zero()).depths(&keyframe, &[Pixel::new(320.0, 240.0)]);
        assert!((given.unwrap()[0].unwrap().z_m - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_horizon_is_an_error_and_never_a_huge_number() {
        let pinhole = Intrinsics::new(752, 480, [458.0, 457.0, 367.0, 248.0], Model::Pinhole).unwrap();
        let level = keyframe(&pinhole, Some(level()), Floor::World(Plane::z_zero()));
        let at = |v| one(FloorDepth::new(), &level, 367.0, v);
        assert_eq!(at(248.0), Err(DepthMiss::AboveHorizon), "along the horizon");
        assert_eq!(at(248.0 + 1e-9), Err(DepthMiss::AboveHorizon));
        assert_eq!(at(100.0), Err(DepthMiss::AboveHorizon), "above it the plane is behind the camera");
        assert!((at(249.0).unwrap() - 1.5 * 457.0).abs() < 1e-9);
        assert_eq!(one(FloorDepth::new(), &level, f64::NAN, 3.0), Err(DepthMiss::OutsideModel));
        assert_eq!(FloorDepth::new().name(), "floor");
        assert_ne!(FloorDepth::new().name(), GROUND_TRUTH);
    }

    #[test]
    fn an_anchor_is_needed_by_a_floor_of_the_world_only() {
        let camera = camera();
        let world = keyframe(&camera, None, Floor::World(Plane::z_zero()));
        assert_eq!(one(FloorDepth::new(), &world, 300.0, 400.0), Err(DepthMiss::NoAnchor));
        // The body frame coincides with the camera's: a floor 2 m in front of it.
        let body = keyframe(&camera, None, Floor::Body(Plane::<Body>::new([0.0, 0.0, 1.0], -2.0).unwrap()));
        assert!((one(FloorDepth::new(), &body, 300.0, 400.0).unwrap() - 2.0).abs() < 1e-12);
        // A plane asked for by the user is in the world, whatever the data set says.
        let plane = Plane::new([0.0, 0.0, 1.0], 0.0).unwrap();
        assert_eq!(one(FloorDepth::with_plane(plane), &body, 300.0, 400.0), Err(DepthMiss::NoAnchor));
    }

    proptest! {
        #[test]
        fn the_point_at_the_depth_lies_on_the_plane(
            (u, v) in (0.0..751.0, 0.0..479.0),
            turn in prop::array::uniform3(-3.0..3.0),
            at in prop::array::uniform3(-5.0..5.0),
            normal in prop::array::uniform3(-1.0..1.0),
            d in -3.0..3.0,
        ) {
            prop_assume!(Vector3::from(normal).norm() > 0.1);
            let camera = camera();
            let plane = Plane::<World>::new(normal, d).unwrap();
            let world_from_camera =
                WorldFromCamera::from_parts(at.into(), UnitQuaternion::from_scaled_axis(turn.into()));
            let keyframe = keyframe(&camera, Some(world_from_camera), Floor::World(Plane::z_zero()));
            let ray = camera.unproject(Pixel::new(u, v)).unwrap();
            let direction = world_from_camera.rotate(&ray);
            let height = plane.normal().dot(&Vector3::from(at)) + plane.d_m();
            let towards = -plane.normal().dot(&direction) * height.signum();
            match one(FloorDepth::with_plane(plane), &keyframe, u, v) {
                Ok(z) => {
                    let p = world_from_camera.transform_point(&Point3::from(ray * z));
                    let off = plane.normal().dot(&p.coords) + plane.d_m();
                    prop_assert!(off.abs() < 1e-9 * z.max(1.0), "{off} m off the plane at {z} m");
                    prop_assert!(towards > 0.0 && z <= height.abs() / HORIZON_SINE);
                }
                Err(miss) => {
                    prop_assert_eq!(miss, DepthMiss::AboveHorizon);
                    prop_assert!(towards <= HORIZON_SINE * direction.norm());
                }
            }
        }
    }
}
