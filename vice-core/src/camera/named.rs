//! Lenses by the names that calibrations use.

use super::{
    CameraError, DoubleSphere, Equidistant, ExtendedUnified, FieldOfView, Model, Omnidirectional, Radtan,
    Rational,
};

impl Model {
    /// A model by the names that calibrations use, with its coefficients.
    ///
    /// Drivers fill vectors of a fixed length with zeros: those beyond the model's own count are passed over.
    ///
    /// # Errors
    /// [`CameraError`] for an unknown name, a wrong number of coefficients or one that is not finite.
    pub fn from_name(name: &str, coefficients: &[f64]) -> Result<Self, CameraError> {
        if !coefficients.iter().all(|c| c.is_finite()) {
            return Err(CameraError::NotFinite("distortion coefficient"));
        }
        let got = coefficients.len();
        let count = |expected, most: usize| {
            let model = if name.trim().is_empty() { "none" } else { name.trim() }.to_string();
            CameraError::CoefficientCount { model, expected, got, beyond: got > most && most > 0 }
        };
        match name.trim().to_ascii_lowercase().as_str() {
            "pinhole" | "none" | "" => match coefficients.iter().all(|c| *c == 0.0) {
                true => Ok(Self::Pinhole),
                false => Err(count("no", 0)),
            },
            "radtan" | "radial-tangential" | "plumb_bob" | "brown_conrady" => {
                match *without_padding(coefficients, 5) {
                    [k1, k2, p1, p2] => Ok(Self::Radtan(Radtan { k1, k2, p1, p2, k3: 0.0 })),
                    [k1, k2, p1, p2, k3] => Ok(Self::Radtan(Radtan { k1, k2, p1, p2, k3 })),
                    _ => Err(count("4 or 5", 5)),
                }
            }
            "rational" | "rational_polynomial" => match *without_padding(coefficients, 8) {
                [k1, k2, p1, p2, k3, k4, k5, k6] => {
                    Ok(Self::Rational(Rational { k1, k2, p1, p2, k3, k4, k5, k6 }))
                }
                _ => Err(count("8", 8)),
            },
            "equidistant" | "fisheye" | "kannala_brandt" => match *without_padding(coefficients, 4) {
                [k1, k2, k3, k4] => Ok(Self::Equidistant(Equidistant { k1, k2, k3, k4 })),
                _ => Err(count("4", 4)),
            },
            "ds" | "double_sphere" | "double-sphere" => match *without_padding(coefficients, 2) {
                [xi, alpha] => Ok(Self::DoubleSphere(DoubleSphere { xi, alpha })),
                _ => Err(count("2 (xi, alpha)", 2)),
            },
            "eucm" | "extended_unified" | "extended-unified" => match *without_padding(coefficients, 2) {
                [alpha, beta] => Ok(Self::ExtendedUnified(ExtendedUnified { alpha, beta })),
                _ => Err(count("2 (alpha, beta)", 2)),
            },
            "omni" | "omnidirectional" | "omnidir" | "mei" => match *without_padding(coefficients, 5) {
                [xi] => Ok(Self::Omnidirectional(Omnidirectional { xi, ..Omnidirectional::default() })),
                [xi, k1, k2, p1, p2] => Ok(Self::Omnidirectional(Omnidirectional { xi, k1, k2, p1, p2 })),
                _ => Err(count("1 or 5 (xi, then k1, k2, p1, p2)", 5)),
            },
            "fov" | "atan" | "field_of_view" | "field-of-view" => match *without_padding(coefficients, 1) {
                [w] => Ok(Self::FieldOfView(FieldOfView::new(w))),
                _ => Err(count("1 (w, radians)", 1)),
            },
            _ => Err(CameraError::UnknownModel(name.to_string())),
        }
        .and_then(|model| model.check().map(|()| model))
    }

    /// Whether the parameters are such as the formulas are made for.
    pub(super) fn check(&self) -> Result<(), CameraError> {
        let model = self.name();
        let refuse =
            |parameter, value, expected| Err(CameraError::Parameter { model, parameter, value, expected });
        match *self {
            Self::DoubleSphere(DoubleSphere { xi, .. })
            | Self::Omnidirectional(Omnidirectional { xi, .. })
                if xi <= -1.0 =>
            {
                refuse("xi", xi, "above -1")
            }
            Self::DoubleSphere(DoubleSphere { alpha, .. })
            | Self::ExtendedUnified(ExtendedUnified { alpha, .. })
                if !(0.0..=1.0).contains(&alpha) =>
            {
                refuse("alpha", alpha, "from 0 to 1")
            }
            Self::ExtendedUnified(ExtendedUnified { beta, .. }) if beta <= 0.0 => {
                refuse("beta", beta, "above 0")
            }
            Self::FieldOfView(lens) if !(lens.w() > 0.0 && lens.w() < std::f64::consts::PI) => {
                refuse("w", lens.w(), "an angle above 0 and below pi radians")
            }
            _ => Ok(()),
        }
    }

    /// The name VICE writes.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Radtan(_) => "radtan",
            Self::Rational(_) => "rational",
            Self::Equidistant(_) => "equidistant",
            Self::DoubleSphere(_) => "ds",
            Self::ExtendedUnified(_) => "eucm",
            Self::Omnidirectional(_) => "omni",
            Self::FieldOfView(_) => "fov",
        }
    }

    /// The coefficients in the order of [`Model::from_name`].
    pub fn coefficients(&self) -> Vec<f64> {
        match *self {
            Self::Pinhole => vec![],
            Self::Radtan(Radtan { k1, k2, p1, p2, k3 }) => vec![k1, k2, p1, p2, k3],
            Self::Rational(Rational { k1, k2, p1, p2, k3, k4, k5, k6 }) => {
                vec![k1, k2, p1, p2, k3, k4, k5, k6]
            }
            Self::Equidistant(Equidistant { k1, k2, k3, k4 }) => vec![k1, k2, k3, k4],
            Self::DoubleSphere(DoubleSphere { xi, alpha }) => vec![xi, alpha],
            Self::ExtendedUnified(ExtendedUnified { alpha, beta }) => vec![alpha, beta],
            Self::Omnidirectional(Omnidirectional { xi, k1, k2, p1, p2 }) => vec![xi, k1, k2, p1, p2],
            Self::FieldOfView(lens) => vec![lens.w()],
        }
    }
}

/// The coefficients without zeros beyond the `most` that a model takes.
fn without_padding(coefficients: &[f64], most: usize) -> &[f64] {
    match coefficients.split_at_checked(most) {
        Some((own, padding)) if padding.iter().all(|c| *c == 0.0) => own,
        _ => coefficients,
    }
}
