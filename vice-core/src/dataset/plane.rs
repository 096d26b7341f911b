//! Planes, of which the floor is one.

use nalgebra::{Unit, Vector3};

use crate::error::{DataError, DataResult};
use crate::frames::{Body, Rigid, World};

/// The plane `n·p + d = 0` in frame `F`, `n` of unit length, `d` in metres.
///
/// ```
/// use vice_core::dataset::{Floor, Plane};
/// use vice_core::frames::World;
///
/// // A floor 5 cm below the origin of the world. Its normal need not be of unit length.
/// let plane = Plane::<World>::new([0.0, 0.0, 2.0], 0.1)?;
/// assert_eq!((plane.normal().z, plane.d_m()), (1.0, 0.05));
/// let floor = Floor::World(plane);
/// # assert!(matches!(floor, Floor::World(_)));
/// # Ok::<(), vice_core::error::DataError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<F> {
    normal: Unit<Vector3<f64>>,
    d_m: f64,
    frame: std::marker::PhantomData<fn() -> F>,
}

impl<F> Plane<F> {
    /// The plane `n·p + d = 0`; both are divided by the length of `n`.
    ///
    /// # Errors
    /// [`DataError`] if a number is not finite or the normal is shorter than 1e-9.
    pub fn new(normal: [f64; 3], d_m: f64) -> DataResult<Self> {
        let n = Vector3::from(normal);
        let length = n.norm();
        if !(length.is_finite() && d_m.is_finite()) {
            return Err(DataError::new("the plane has a number that is not finite"));
        }
        if length < 1e-9 {
            return Err(DataError::new("the normal of the plane is zero")
                .hint("give it as nx,ny,nz,d with n·p + d = 0"));
        }
        Ok(Self {
            normal: Unit::new_unchecked(n / length),
            d_m: d_m / length,
            frame: std::marker::PhantomData,
        })
    }

    /// The plane of a normal that is of unit length already, kept to the bit; `d_m` is finite.
    pub const fn from_unit(normal: Unit<Vector3<f64>>, d_m: f64) -> Self {
        Self { normal, d_m, frame: std::marker::PhantomData }
    }

    /// z = 0.
    pub fn z_zero() -> Self {
        Self { normal: Vector3::z_axis(), d_m: 0.0, frame: std::marker::PhantomData }
    }

    /// The unit normal.
    pub const fn normal(&self) -> Unit<Vector3<f64>> {
        self.normal
    }

    /// `d` of `n·p + d = 0`, metres.
    pub const fn d_m(&self) -> f64 {
        self.d_m
    }

    /// The same plane in another frame.
    pub fn transformed<G>(&self, g_from_f: &Rigid<G, F>) -> Plane<G> {
        let normal = Unit::new_normalize(g_from_f.rotate(&self.normal));
        let d_m = self.d_m - normal.dot(&g_from_f.translation());
        Plane { normal, d_m, frame: std::marker::PhantomData }
    }
}

/// The floor, in the frame in which it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Floor {
    /// In the world: the camera's place is taken from the anchor.
    World(Plane<World>),
    /// In the body at the key frame (a ground robot stands on it): no anchor is used.
    Body(Plane<Body>),
    /// Nowhere that is known: nothing says which way is up, or how high the world's origin lies. Depth by the floor is
    /// refused, and nothing else asks.
    Unknown,
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::frames::WorldFromBody;

    #[test]
    fn a_plane_moves_with_its_frame() {
        let floor = Plane::<World>::new([0.0, 0.0, 2.0], -1.0).unwrap();
        assert_eq!((floor.normal().z, floor.d_m()), (1.0, -0.5));
        let world_from_body =
            WorldFromBody::try_from_parts([1.0, 2.0, 3.0], [0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0, 0.0])
                .unwrap();
        let in_body = floor.transformed(&world_from_body.inverse());
        let on_floor = world_from_body.inverse().transform_point(&Point3::new(7.0, -4.0, 0.5));
        assert!((in_body.normal().dot(&on_floor.coords) + in_body.d_m()).abs() < 1e-12);
        assert!(Plane::<World>::new([0.0; 3], 1.0).is_err());
        assert!(Plane::<World>::new([f64::NAN, 0.0, 1.0], 1.0).is_err());
    }
}
