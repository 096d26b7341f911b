//! All flaws at once as one vector, and what it does to the camera and its place in the body.

use std::ops::{Index, IndexMut};

use nalgebra::{UnitQuaternion, Vector3};

use super::flaw::{Flaw, PARAMETER_COUNT};
use crate::camera::{Camera, CameraError, Equidistant, Model, Omnidirectional, Radtan, Rational};
use crate::frames::{BodyFromCamera, Rigid};

/// The errors of what is in use, in the order and units of [`super::PARAMETERS`]. Zero where nothing is wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Theta(pub [f64; PARAMETER_COUNT]);

impl Theta {
    /// Nothing is wrong.
    pub const fn zero() -> Self {
        Self([0.0; PARAMETER_COUNT])
    }

    /// The numbers of one flaw.
    pub fn of(&self, flaw: Flaw) -> &[f64] {
        &self.0[flaw.parameters()]
    }

    /// With one flaw set.
    ///
    /// # Panics
    /// If there are not as many values as the flaw has parameters.
    #[must_use]
    pub fn with(mut self, flaw: Flaw, values: &[f64]) -> Self {
        self.0[flaw.parameters()].copy_from_slice(values);
        self
    }

    /// The same errors the other way round: to inject a flaw is to correct its opposite.
    #[must_use]
    pub fn negated(&self) -> Self {
        Self(self.0.map(|v| -v))
    }

    /// The vector of three parameters from one on.
    pub(super) fn vector(&self, first: usize) -> Vector3<f64> {
        Vector3::new(self.0[first], self.0[first + 1], self.0[first + 2])
    }

    /// The camera without its error.
    ///
    /// # Errors
    /// [`CameraError`] if the errors leave no camera, as a focal share of -1 does.
    pub fn correct_camera(&self, used: &Camera) -> Result<Camera, CameraError> {
        let [fx, fy, cx, cy] = used.fx_fy_cx_cy();
        let longer = 1.0 + self.of(Flaw::FocalLength)[0];
        let wider = 1.0 + self.of(Flaw::Aspect)[0];
        let [du, dv] = [self.of(Flaw::PrincipalPoint)[0], self.of(Flaw::PrincipalPoint)[1]];
        let corrected = [fx / (longer * wider), fy / longer, cx - du, cy - dv];
        Camera::new(used.width(), used.height(), corrected, self.correct_lens(used.model()))
    }

    fn correct_lens(&self, used: &Model) -> Model {
        let off = self.of(Flaw::Distortion);
        if off.iter().all(|v| *v == 0.0) {
            return *used;
        }
        let [k1, k2, p1, p2] = [off[0], off[1], off[2], off[3]];
        match *used {
            Model::Pinhole => Model::Radtan(Radtan { k1: -k1, k2: -k2, p1: -p1, p2: -p2, k3: 0.0 }),
            Model::Radtan(m) => {
                Model::Radtan(Radtan { k1: m.k1 - k1, k2: m.k2 - k2, p1: m.p1 - p1, p2: m.p2 - p2, ..m })
            }
            Model::Rational(m) => {
                Model::Rational(Rational { k1: m.k1 - k1, k2: m.k2 - k2, p1: m.p1 - p1, p2: m.p2 - p2, ..m })
            }
            Model::Equidistant(m) => Model::Equidistant(Equidistant { k1: m.k1 - k1, k2: m.k2 - k2, ..m }),
            Model::Omnidirectional(m) => Model::Omnidirectional(Omnidirectional {
                k1: m.k1 - k1,
                k2: m.k2 - k2,
                p1: m.p1 - p1,
                p2: m.p2 - p2,
                ..m
            }),
            // Nothing of theirs is like these coefficients: such a flaw has no effect, and so is not found.
            Model::DoubleSphere(_) | Model::ExtendedUnified(_) | Model::FieldOfView(_) => *used,
        }
    }

    /// The extrinsics without their error.
    pub fn correct_extrinsics(&self, used: &BodyFromCamera) -> BodyFromCamera {
        let turn = UnitQuaternion::from_scaled_axis(-self.vector(Flaw::ExtrinsicRotation.parameters().start));
        let shift = self.vector(Flaw::ExtrinsicTranslation.parameters().start);
        Rigid::from_parts(used.translation() - shift, used.rotation() * turn)
    }
}

impl Index<usize> for Theta {
    type Output = f64;
    fn index(&self, parameter: usize) -> &f64 {
        &self.0[parameter]
    }
}

impl IndexMut<usize> for Theta {
    fn index_mut(&mut self, parameter: usize) -> &mut f64 {
        &mut self.0[parameter]
    }
}
