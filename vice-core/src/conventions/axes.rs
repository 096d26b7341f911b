//! Axes that are other axes, or point the other way.

use std::fmt;

use nalgebra::{Matrix3, Vector3};

/// A signed permutation of three axes: entry `i` says which old axis (1, 2, 3) is the new axis `i`, with its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SignedAxes(pub(super) [i8; 3]);

impl SignedAxes {
    /// `None` unless each of the axes 1, 2 and 3 stands there once, with a sign.
    pub fn new(axes: [i8; 3]) -> Option<Self> {
        let mut found = axes.map(i8::unsigned_abs);
        found.sort_unstable();
        (found == [1, 2, 3]).then_some(Self(axes))
    }

    /// As a matrix: new = matrix · old.
    pub fn matrix(self) -> Matrix3<f64> {
        let mut matrix = Matrix3::zeros();
        for (row, axis) in self.0.iter().enumerate() {
            matrix[(row, usize::from(axis.unsigned_abs()) - 1)] = f64::from(axis.signum());
        }
        matrix
    }

    /// A vector in the new axes.
    pub fn apply(self, old: &Vector3<f64>) -> Vector3<f64> {
        self.matrix() * old
    }
}

impl fmt::Display for SignedAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c] = self.0;
        write!(f, "({a:+},{b:+},{c:+})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_a_signed_permutation() {
        assert_eq!(SignedAxes::new([1, 1, 3]), None);
        assert_eq!(SignedAxes::new([0, 1, 2]), None);
        let turned = SignedAxes::new([3, -1, -2]).unwrap();
        assert_eq!(turned.apply(&Vector3::new(1.0, 2.0, 3.0)), Vector3::new(3.0, -1.0, -2.0));
        assert_eq!(turned.matrix().determinant(), 1.0);
    }
}
