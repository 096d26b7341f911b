//! Cameras: from a point in front of the lens to a pixel and back.
//!
//! A point `(X, Y, Z)` in the camera frame (x right, y down, z forward) has the normalised coordinates
//! `x = X/Z, y = Y/Z`. The lens moves them ([`Model`]), the intrinsics scale and shift them:
//! `u = fx x' + cx, v = fy y' + cy`. Pixel centres are integers; (0, 0) is the centre of the top left pixel.
//!
//! | model | coefficients | known as |
//! | --- | --- | --- |
//! | [`Model::Pinhole`] | none | |
//! | [`Model::Radtan`] | k1 k2 p1 p2 \[k3\] | Brown-Conrady, EuRoC `radial-tangential`, ROS `plumb_bob` |
//! | [`Model::Rational`] | k1 k2 p1 p2 k3 k4 k5 k6 | the paper's model, ROS `rational_polynomial` |
//! | [`Model::Equidistant`] | k1 k2 k3 k4 | Kannala-Brandt, OpenCV `fisheye` |
//! | [`Model::DoubleSphere`] | xi alpha | Usenko, Kalibr and Basalt `ds` |
//! | [`Model::ExtendedUnified`] | alpha beta | Khomutenko, Kalibr and Basalt `eucm` |
//! | [`Model::Omnidirectional`] | xi k1 k2 p1 p2 | Mei, Kalibr `omni`, OpenCV `omnidir` |
//! | [`Model::FieldOfView`] | w, radians | Devernay, Kalibr and COLMAP `fov`, ATAN |
//!
//! Depth here is along the optical axis, so that a camera sees what lies in front of its plane: of a lens that looks
//! beyond 90 degrees off the axis, pixels out there have no ray.
//!
//! A distortion polynomial fitted inside the image may fold back outside it, so that points far to the side land
//! in the picture again. The radius where it stops growing is found once, when the camera is built, and nothing
//! beyond it projects. The inverse is a closed form where there is one, else Newton's method with the analytic
//! Jacobian: solved to [`UNPROJECT_TOLERANCE`] or an error.

mod batch;
mod derivative;
mod double_sphere;
mod equidistant;
mod extended_unified;
mod field_of_view;
mod named;
mod omnidirectional;
mod poly;
mod radtan;
mod rational;
mod seed;
mod solve;

use nalgebra::{Point3, Vector3};

use crate::lanes::Number;
use seed::Seed;

#[cfg(test)]
pub(crate) use batch::tests::lenses;
pub(crate) use batch::{Bound, Pinhole, Track, TrackAlong, with_lens};
pub use double_sphere::DoubleSphere;
pub use equidistant::Equidistant;
pub use extended_unified::ExtendedUnified;
pub use field_of_view::FieldOfView;
pub use omnidirectional::Omnidirectional;
pub use radtan::Radtan;
pub use rational::Rational;

/// How closely [`Camera::unproject`] solves, in normalised coordinates.
pub const UNPROJECT_TOLERANCE: f64 = 1e-10;

/// The seed is fitted up to this many times the distance of the farthest corner: a label may lie a little outside.
const REACH: f64 = 1.03;

/// A place in the image, in pixels; pixel centres are integers.
///
/// ```
/// use vice_core::camera::Pixel;
///
/// let (label, carried) = (Pixel::new(320.0, 240.0), Pixel::new(323.0, 244.0));
/// assert_eq!(label.distance_px(carried), 5.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "[f64; 2]", into = "[f64; 2]"))]
pub struct Pixel {
    /// To the right.
    pub u: f64,
    /// Downwards.
    pub v: f64,
}

impl Pixel {
    /// A place in the image.
    pub const fn new(u: f64, v: f64) -> Self {
        Self { u, v }
    }

    /// Euclidean distance in pixels.
    pub fn distance_px(self, other: Self) -> f64 {
        let (du, dv) = (self.u - other.u, self.v - other.v);
        // As `hypot` to the last bit or two, and ten times as fast; no two places are 1e150 pixels apart.
        (du * du + dv * dv).sqrt()
    }
}

impl From<[f64; 2]> for Pixel {
    fn from([u, v]: [f64; 2]) -> Self {
        Self { u, v }
    }
}

impl From<Pixel> for [f64; 2] {
    fn from(p: Pixel) -> Self {
        [p.u, p.v]
    }
}

/// The lens: what happens to normalised coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// Nothing happens.
    Pinhole,
    /// Radial and tangential polynomial.
    Radtan(Radtan),
    /// Radial quotient of polynomials, and tangential.
    Rational(Rational),
    /// Polynomial in the angle off the axis.
    Equidistant(Equidistant),
    /// Two unit spheres and a pinhole.
    DoubleSphere(DoubleSphere),
    /// An ellipsoid and a pinhole.
    ExtendedUnified(ExtendedUnified),
    /// A unit sphere and a pinhole, then radial and tangential polynomial.
    Omnidirectional(Omnidirectional),
    /// Arc tangent of the radius.
    FieldOfView(FieldOfView),
}

/// A lens as seen by the solvers: where a normalised point goes, and how that changes.
///
/// The formulas are written once for one point and for many side by side: see [`crate::lanes`].
pub(crate) trait Distortion: Copy + Send + Sync {
    /// Whether it does anything at all.
    const DISTORTS: bool = true;
    /// Distorted coordinates of normalised `(x, y)`.
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N);
    /// The same, with the Jacobian `[dx'/dx, dx'/dy, dy'/dx, dy'/dy]`.
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]);
    /// What is not radial: the part of `distort` that is beside the direction of `(x, y)`.
    #[inline(always)]
    fn tangential<N: Number>(&self, x: N, _: N) -> (N, N) {
        (x.of(0.0), x.of(0.0))
    }
    /// A fixed number of steps to the coordinates whose distortion is `(xd, yd)`, and whether they were enough and led to
    /// a radius below `quick_radius`.
    #[inline(always)]
    fn undistort_fast<N: Number>(
        &self,
        seed: &Seed,
        quick_radius: f64,
        distorted: (N, N),
    ) -> (N, N, N::Mask) {
        solve::in_the_plane(self, seed, quick_radius, distorted)
    }
    /// Where those steps do not decide: a search, or no ray.
    ///
    /// # Errors
    /// [`UnprojectError`] where there is no ray up to `max_radius`.
    fn undistort_slow(&self, max_radius: f64, distorted: (f64, f64)) -> Result<(f64, f64), UnprojectError> {
        solve::search(self, max_radius, distorted)
    }
    /// What makes a good start for distorted radii up to `reach`.
    fn seed(&self, reach: f64) -> Seed {
        Seed::fit(|r| self.radial(r), self.max_radius(), reach)
    }
    /// Undistorted radius up to which the radial part grows; infinity where it always does.
    fn max_radius(&self) -> f64;
    /// Distorted radius of an undistorted one, without the tangential part.
    fn radial(&self, r: f64) -> f64;
}

/// Why numbers are no camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A number is NaN or infinite.
    #[error("camera {0} is not finite")]
    NotFinite(&'static str),
    /// A focal length is zero or negative.
    #[error("focal length {name} = {value} is not positive")]
    FocalLength {
        /// `fx` or `fy`.
        name: &'static str,
        /// The value given, pixels.
        value: f64,
    },
    /// The image has no pixels.
    #[error("image size {width}x{height} is empty")]
    EmptyImage {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The model's name is not known.
    #[error(
        "unknown camera model `{0}`; known: pinhole, radtan (radial-tangential, plumb_bob), rational (rational_polynomial), equidistant (fisheye, kannala_brandt), ds (double_sphere), eucm, omni (mei), fov (atan)"
    )]
    UnknownModel(String),
    /// A parameter of the lens is outside what its formulas are made for.
    #[error("{parameter} = {value} of model {model} is not {expected}")]
    Parameter {
        /// Name of the model.
        model: &'static str,
        /// The model's own name of the parameter.
        parameter: &'static str,
        /// The value given.
        value: f64,
        /// What it should be, in words.
        expected: &'static str,
    },
    /// The model has another number of coefficients.
    #[error("model {model} takes {expected} distortion coefficients, got {got}{}", if *beyond { ", of which those beyond are not zero" } else { "" })]
    CoefficientCount {
        /// Name of the model, as it was given.
        model: String,
        /// How many it takes.
        expected: &'static str,
        /// How many there were.
        got: usize,
        /// Whether there were too many, and not all of those beyond are zero.
        beyond: bool,
    },
}

/// Why a point has no pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProjectError {
    /// The point is on or behind the plane of the camera (Z <= 0), or not a number.
    #[error("the point is not in front of the camera")]
    BehindCamera,
    /// The point is so far to the side that the distortion model folds back.
    #[error("the point is outside the radius in which the distortion model is valid")]
    OutsideModel,
}

/// Why a pixel has no ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UnprojectError {
    /// No ray within the valid radius of the distortion model reaches this pixel.
    #[error("no ray within the valid radius of the distortion model reaches the pixel")]
    OutsideModel,
    /// Newton's method did not converge.
    #[error("undistortion did not converge to 1e-10")]
    NotConverged,
}

/// A calibrated camera: image size in pixels, intrinsics in pixels, and a lens.
///
/// ```
/// use vice_core::camera::{Camera, Model, Pixel};
/// use vice_core::nalgebra::Point3;
///
/// let lens = Model::from_name("radtan", &[-0.28, 0.07, 0.0002, 0.00002])?;
/// let camera = Camera::new(752, 480, [458.0, 457.0, 367.0, 248.0], lens)?;
/// // Metres in the camera's frame: x to the right, y down, z along the optical axis.
/// let pixel = camera.project(&Point3::new(0.1, -0.2, 2.0))?;
/// assert!(camera.contains(pixel));
/// // Back to the ray (x, y, 1), which times the depth is the point.
/// let ray = camera.unproject(pixel)?;
/// assert!((ray * 2.0 - Point3::new(0.1, -0.2, 2.0).coords).norm() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    model: Model,
    max_radius: f64,
    seed: Seed,
}

impl Camera {
    /// A camera from its image size, `[fx, fy, cx, cy]` in pixels, and its lens.
    ///
    /// # Errors
    /// [`CameraError`] for an empty image, numbers that are not finite, or a focal length that is not positive.
    pub fn new(width: u32, height: u32, fx_fy_cx_cy: [f64; 4], model: Model) -> Result<Self, CameraError> {
        if width == 0 || height == 0 {
            return Err(CameraError::EmptyImage { width, height });
        }
        let [fx, fy, cx, cy] = fx_fy_cx_cy;
        for (name, value) in [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)] {
            if !value.is_finite() {
                return Err(CameraError::NotFinite(name));
            }
        }
        for (name, value) in [("fx", fx), ("fy", fy)] {
            if value <= 0.0 {
                return Err(CameraError::FocalLength { name, value });
            }
        }
        if !model.coefficients().iter().all(|c| c.is_finite()) {
            return Err(CameraError::NotFinite("distortion coefficient"));
        }
        model.check()?;
        // The farthest corner of the image, and a little beyond.
        let side = |n: u32, f: f64, c: f64| REACH * (c.abs() + 1.0).max((f64::from(n) - c).abs()) / f;
        let reach = [side(width, fx, cx), side(height, fy, cy)];
        let (max_radius, seed) = match &model {
            Model::Pinhole => (f64::INFINITY, Seed::NONE),
            Model::Radtan(m) => (m.max_radius(), solve::seed_of(m, reach)),
            Model::Rational(m) => (m.max_radius(), solve::seed_of(m, reach)),
            Model::Equidistant(m) => (m.max_radius(), solve::seed_of(m, reach)),
            Model::DoubleSphere(m) => (m.max_radius(), solve::seed_of(m, reach)),
            Model::ExtendedUnified(m) => (m.max_radius(), solve::seed_of(m, reach)),
            Model::Omnidirectional(m) => (m.max_radius(), solve::seed_of(m, reach)),
            Model::FieldOfView(m) => (m.max_radius(), solve::seed_of(m, reach)),
        };
        Ok(Self { width, height, fx, fy, cx, cy, model, max_radius, seed })
    }

    /// Columns.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// `[fx, fy, cx, cy]` in pixels.
    pub const fn fx_fy_cx_cy(&self) -> [f64; 4] {
        [self.fx, self.fy, self.cx, self.cy]
    }

    /// The lens.
    pub const fn model(&self) -> &Model {
        &self.model
    }

    /// The normalised radius `√(x²+y²)` beyond which nothing projects; infinity where the model never folds back.
    pub const fn max_radius(&self) -> f64 {
        self.max_radius
    }

    /// Whether the place lies on a pixel of the image: `[-0.5, width - 0.5)` by `[-0.5, height - 0.5)`.
    pub fn contains(&self, px: Pixel) -> bool {
        px.u >= -0.5
            && px.v >= -0.5
            && px.u < f64::from(self.width) - 0.5
            && px.v < f64::from(self.height) - 0.5
    }

    /// The pixel of a point in the camera frame (metres). It may lie outside the image: see [`Camera::contains`].
    ///
    /// # Errors
    /// [`ProjectError`] if the point is not in front of the camera or beyond the model's valid radius.
    pub fn project(&self, point: &Point3<f64>) -> Result<Pixel, ProjectError> {
        if point.z <= 0.0 || point.z.is_nan() {
            return Err(ProjectError::BehindCamera);
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let r2 = x * x + y * y;
        if r2.is_nan() {
            return Err(ProjectError::BehindCamera);
        }
        if r2 > self.max_radius * self.max_radius || r2.is_infinite() {
            return Err(ProjectError::OutsideModel);
        }
        let (xd, yd) = match &self.model {
            Model::Pinhole => (x, y),
            Model::Radtan(m) => m.distort(x, y),
            Model::Rational(m) => m.distort(x, y),
            Model::Equidistant(m) => m.distort(x, y),
            Model::DoubleSphere(m) => m.distort(x, y),
            Model::ExtendedUnified(m) => m.distort(x, y),
            Model::Omnidirectional(m) => m.distort(x, y),
            Model::FieldOfView(m) => m.distort(x, y),
        };
        Ok(Pixel::new(self.fx * xd + self.cx, self.fy * yd + self.cy))
    }

    /// The ray of a pixel: the point `(x, y, 1)` of the camera frame that projects to it.
    ///
    /// # Errors
    /// [`UnprojectError`] if no ray within the valid radius reaches the pixel or the solver does not converge.
    pub fn unproject(&self, px: Pixel) -> Result<Vector3<f64>, UnprojectError> {
        let (xd, yd) = ((px.u - self.cx) * (1.0 / self.fx), (px.v - self.cy) * (1.0 / self.fy));
        if !(xd.is_finite() && yd.is_finite()) {
            return Err(UnprojectError::OutsideModel);
        }
        let (x, y) = match &self.model {
            Model::Pinhole => (xd, yd),
            Model::Radtan(m) => solve::undistort(m, &self.seed, self.max_radius, (xd, yd))?,
            Model::Rational(m) => solve::undistort(m, &self.seed, self.max_radius, (xd, yd))?,
            Model::Equidistant(m) => solve::undistort(m, &self.seed, self.max_radius, (xd, yd))?,
            Model::DoubleSphere(m) => solve::undistort(m, &self.seed, self.max_radius, (xd, yd))?,
            Model::ExtendedUnified(m) => solve::undistort(m, &self.seed, self.max_radius, (xd, yd))?,
            Model::Omnidirectional(m) => solve::undistort(m, &self.seed, self.max_radius, (xd, yd))?,
            Model::FieldOfView(m) => solve::undistort(m, &self.seed, self.max_radius, (xd, yd))?,
        };
        Ok(Vector3::new(x, y, 1.0))
    }
}

#[cfg(test)]
mod tests;
