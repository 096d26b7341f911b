//! The lens that the keys of a camera make together: which projection it is, and the order of its parameters.

use serde_json::{Map, Value};
use vice_core::error::{DataError, DataResult, ErrorKind};

use super::CameraOverride;
use super::keys::{self, Key};

/// How a file says that a camera projects, before any distortion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Projection {
    Pinhole,
    /// Angles off the axis (Kannala and Brandt).
    Kannala,
    Omni,
    Eucm,
    Ds,
}

/// Parameters that a file gives by their names.
pub(super) struct Numbers<'a> {
    /// k1 k2 p1 p2 k3 k4 k5 k6.
    pub(super) coefficients: [Option<f64>; 8],
    /// xi, alpha, beta.
    pub(super) mirror: &'a [(String, f64)],
}

/// The projection that a camera's keys name, and under which key.
pub(super) fn projection(map: &Map<String, Value>) -> DataResult<(Projection, String)> {
    let named = map.iter().find(|(key, _)| keys::of(key) == Key::CameraModel);
    let Some((key, Value::String(name))) = named else {
        return Ok((Projection::Pinhole, "camera_model".to_string()));
    };
    let known = match name.to_lowercase().as_str() {
        "pinhole" | "perspective" | "pinhole_camera" | "pinhole_full" => Projection::Pinhole,
        "kannala_brandt" | "kannalabrandt8" => Projection::Kannala,
        "omni" | "omnidirectional" | "mei" => Projection::Omni,
        "eucm" => Projection::Eucm,
        "ds" | "double_sphere" => Projection::Ds,
        "rectified" => {
            return Err(DataError::of_kind(
                ErrorKind::Unsupported,
                format!("{key} `{name}` is of images that were rectified, which those of a camera are not"),
            )
            .hint("give the calibration of the images as they are recorded"));
        }
        _ => {
            return Err(DataError::new(format!(
                "unknown {key} `{name}`; known: pinhole, kannala_brandt, omni (mei), eucm, ds"
            )));
        }
    };
    Ok((known, key.clone()))
}

impl Projection {
    /// Names of the parameters of its own, in the order of Kalibr's list, which is that of the core's model.
    const fn own(self) -> &'static [&'static str] {
        match self {
            Self::Pinhole | Self::Kannala => &[],
            Self::Omni => &["xi"],
            Self::Eucm => &["alpha", "beta"],
            Self::Ds => &["xi", "alpha"],
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Kannala => "equidistant",
            Self::Omni => "omni",
            Self::Eucm => "eucm",
            Self::Ds => "ds",
        }
    }

    /// What a part of `projection_parameters`, `mirror_parameters` or `distortion_parameters` is.
    pub(super) fn part(self, within: Key, name: &str) -> Option<Key> {
        let lower = name.to_lowercase();
        match (within, lower.as_str()) {
            (Key::Mirror, own) => self.own().contains(&own).then_some(Key::Mirror),
            // camodocal counts the coefficients of an angle from that of its cube on.
            (Key::Projection, "k2" | "k3" | "k4" | "k5") if self == Self::Kannala => {
                [("k2", 0), ("k3", 1), ("k4", 4), ("k5", 5)]
                    .iter()
                    .find(|(k, _)| *k == lower)
                    .map(|(_, at)| Key::Coefficient(*at))
            }
            (Key::Projection, "gamma1" | "mu") => Some(Key::Intrinsic(0)),
            (Key::Projection, "gamma2" | "mv") => Some(Key::Intrinsic(1)),
            (Key::Projection, "u0") => Some(Key::Intrinsic(2)),
            (Key::Projection, "v0") => Some(Key::Intrinsic(3)),
            _ => match keys::of(name) {
                key @ (Key::Intrinsic(_) | Key::Coefficient(_)) => Some(key),
                _ => None,
            },
        }
    }

    /// A list of intrinsics as Kalibr writes it: the projection's own parameters, then fx, fy, cx, cy.
    pub(super) fn split(self, key: &str, values: &[f64]) -> DataResult<(Named, [f64; 4])> {
        let own = self.own();
        let split =
            values.split_at_checked(own.len()).and_then(|(first, rest)| Some((first, rest.try_into().ok()?)));
        match split {
            Some((first, intrinsics)) => {
                Ok((own.iter().map(|name| name.to_string()).zip(first.iter().copied()).collect(), intrinsics))
            }
            None => {
                let names: Vec<&str> = own.iter().copied().chain(["fx", "fy", "cx", "cy"]).collect();
                Err(DataError::new(format!(
                    "is not the YAML expected: {key} are {}: {} numbers, not {}",
                    names.join(", "),
                    names.len(),
                    values.len()
                )))
            }
        }
    }
}

/// Parameters with their names.
pub(super) type Named = Vec<(String, f64)>;

/// Puts the lens into the camera: its model by the names and numbers that were found.
pub(super) fn settle(
    camera: &mut CameraOverride,
    projection: Projection,
    key: &str,
    fisheye: bool,
    numbers: &Numbers<'_>,
) -> DataResult<()> {
    let named = numbers.coefficients.iter().rposition(Option::is_some);
    let of = |at: usize| numbers.coefficients[at].unwrap_or(0.0);
    if let (Some(last), None) = (named, &camera.distortion) {
        let angular = projection == Projection::Kannala || fisheye;
        let tangential = numbers.coefficients[2].is_some() || numbers.coefficients[3].is_some();
        camera.distortion = Some(match angular && !tangential {
            true => vec![of(0), of(1), of(4), of(5)],
            false => (0..=last.max(3)).map(of).collect(),
        });
    }
    match projection {
        Projection::Pinhole | Projection::Kannala => {
            settle_plain(camera, fisheye || projection == Projection::Kannala);
            Ok(())
        }
        _ => settle_own(camera, projection, key, numbers.mirror),
    }
}

/// The lens where the file does not name it as such.
fn settle_plain(camera: &mut CameraOverride, angular: bool) {
    match camera.model.as_deref() {
        // Kalibr writes four zeros where there is no distortion.
        Some("none") => camera.distortion = Some(Vec::new()),
        Some("equi") => camera.model = Some("equidistant".to_string()),
        Some(_) => {}
        None if angular => camera.model = Some("equidistant".to_string()),
        // OpenCV's order, whose name is how many there are.
        None => {
            if let Some(distortion) = &camera.distortion
                && camera.intrinsics.is_some()
            {
                let used = distortion.iter().rposition(|c| *c != 0.0).map_or(0, |last| last + 1);
                camera.model = Some(if used > 5 { "rational" } else { "radtan" }.to_string());
            }
        }
    }
}

/// A lens whose projection has parameters of its own, before those of a distortion.
fn settle_own(
    camera: &mut CameraOverride,
    projection: Projection,
    key: &str,
    mirror: &[(String, f64)],
) -> DataResult<()> {
    let name = projection.name();
    let own = projection.own().iter().map(|wanted| {
        let found = mirror.iter().find(|(name, _)| name == wanted);
        found.map(|(_, value)| *value).ok_or_else(|| DataError::new(format!("{key} {name} has no {wanted}")))
    });
    let mut parameters = own.collect::<DataResult<Vec<f64>>>()?;
    let distortion = camera.distortion.take().unwrap_or_default();
    let distorted = distortion.iter().any(|c| *c != 0.0);
    let brown = matches!(
        camera.model.as_deref(),
        None | Some("none" | "radtan" | "radial-tangential" | "plumb_bob" | "brown_conrady")
    );
    if projection == Projection::Omni && (brown || !distorted) {
        if distortion.len() > 4 && distortion[4..].iter().any(|c| *c != 0.0) {
            return Err(unsupported(format!(
                "{key} {name} takes k1, k2, p1, p2; further coefficients are not zero"
            )));
        }
        parameters.extend((0..4).map(|i| distortion.get(i).copied().unwrap_or(0.0)));
    } else if distorted {
        let lens = camera.model.as_deref().unwrap_or("unnamed");
        return Err(unsupported(format!(
            "{key} {name} with {lens} distortion is none of the models that are known"
        )));
    }
    camera.model = Some(name.to_string());
    camera.distortion = Some(parameters);
    Ok(())
}

fn unsupported(problem: String) -> DataError {
    DataError::of_kind(ErrorKind::Unsupported, problem)
}
