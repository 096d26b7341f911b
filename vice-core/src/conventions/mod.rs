//! The discrete mistakes that people make with poses: another convention, unit or frame than the one that was meant.
//!
//! A [`Convention`] says what a pose stream **is**, where it was read as something else: `inverse` are poses
//! `body_from_world` that were read as `world_from_body`, `mm` are positions in millimetres that were read as metres.
//! [`Convention::cured`] (or [`cure`] for a list) makes of the poses as read those that were meant.
//!
//! | use | call |
//! | --- | --- |
//! | `--estimate-as inverse,wxyz` | [`parse_list`], then [`cure`] with a [`Given`] |
//! | name in a verdict (`convention:inverse-pose`) | [`Convention::verdict_name`] |
//! | the word of the option (`inverse`), in a sentence | `to_string()`, [`Convention::words`] |
//! | does another convention fit a reference far better? | [`suspect`], with [`crate::metrics::associate::PosePairs`] |
//! | which ones a diagnosis tries | [`Convention::TRIED`] |
//!
//! Mistakes that leave nothing to mend ([`Convention::FrozenRotation`], [`Convention::OtherCamera`],
//! [`Convention::Degrees`]) have a name, but no cure. Nothing here is ever applied by itself.

mod apply;
mod axes;
mod suspect;

use std::fmt;
use std::str::FromStr;

pub use apply::{Given, cure};
pub use axes::SignedAxes;
pub use suspect::{Suspected, suspect};

/// One discrete mistake: what the poses of a stream are, where they were read as something else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "String", into = "String"))]
#[non_exhaustive]
pub enum Convention {
    /// Quaternions are written w first, and were read w last.
    WFirst,
    /// Quaternions are written w last, and were read w first.
    WLast,
    /// Rotations are `body_from_world` beside the right position.
    ConjugateQuaternion,
    /// Angles of roll, pitch and yaw are degrees that were read as radians: what is left of them cannot be turned back.
    Degrees,
    /// Angles of roll, pitch and yaw are radians that were read as degrees.
    Radians,
    /// Positions are in millimetres.
    Millimetres,
    /// Positions are in centimetres.
    Centimetres,
    /// Positions are in feet.
    Feet,
    /// Positions are in inches.
    Inches,
    /// Poses are `body_from_world`.
    InversePose,
    /// The columns of the position are in another order: position = axes · position as read.
    AxisOrder(SignedAxes),
    /// The world is mirrored along an axis (0, 1, 2), positions and rotations alike.
    LeftHanded(u8),
    /// The world's axes point another way: world = axes · world as read.
    WorldAxes(SignedAxes),
    /// The body's axes point another way: body = axes · body as read.
    BodyAxes(SignedAxes),
    /// Poses are those of the camera, and were read as the body's.
    CameraAsBody,
    /// Poses are those of the body, and were read as the camera's.
    BodyAsCamera,
    /// Stamps count from zero, where the frames' do not.
    StampsFromZero,
    /// Stamps are in microseconds, and were read as nanoseconds.
    StampsInMicroseconds,
    /// Stamps are in milliseconds, and were read as nanoseconds.
    StampsInMilliseconds,
    /// Stamps are in seconds, and were read as nanoseconds.
    StampsInSeconds,
    /// The rotation never changes: it was not written.
    FrozenRotation,
    /// The extrinsics are those of another camera of the rig.
    OtherCamera,
}

/// Body axes that are mistaken for others (x forward, y left, z up), by where the file's x, y and z point.
const BODY_AXES: [(&str, SignedAxes); 7] = [
    ("frd", SignedAxes([1, -2, -3])),
    ("rdf", SignedAxes([3, -1, -2])),
    ("rub", SignedAxes([-3, -1, 2])),
    ("rfu", SignedAxes([2, -1, 3])),
    ("lbu", SignedAxes([-2, 1, 3])),
    ("bru", SignedAxes([-1, -2, 3])),
    ("blu-down", SignedAxes([-1, 2, -3])),
];

/// World axes that are mistaken for others with z up.
const WORLD_AXES: [(&str, SignedAxes); 5] = [
    // North, east and down: also the way back, since it undoes itself.
    ("ned", SignedAxes([2, 1, -3])),
    ("z-down", SignedAxes([1, -2, -3])),
    ("y-up", SignedAxes([1, -3, 2])),
    ("y-down", SignedAxes([1, 3, -2])),
    ("z-forward", SignedAxes([3, -1, -2])),
];

/// Orders of the columns of a position, by the column that stands first, second and third.
const AXIS_ORDERS: [(&str, SignedAxes); 5] = [
    ("yxz", SignedAxes([2, 1, 3])),
    ("xzy", SignedAxes([1, 3, 2])),
    ("zyx", SignedAxes([3, 2, 1])),
    ("yzx", SignedAxes([3, 1, 2])),
    ("zxy", SignedAxes([2, 3, 1])),
];

const MIRRORS: [&str; 3] = ["mirror-x", "mirror-y", "mirror-z"];

impl Convention {
    /// The hypotheses a diagnosis tries, each alone: those whose cure needs nothing but the poses and the extrinsics.
    pub const TRIED: [Self; 26] = [
        Self::ConjugateQuaternion,
        Self::InversePose,
        Self::WFirst,
        Self::WLast,
        Self::CameraAsBody,
        Self::BodyAsCamera,
        Self::Millimetres,
        Self::Centimetres,
        Self::Feet,
        Self::Inches,
        Self::LeftHanded(2),
        Self::LeftHanded(1),
        Self::LeftHanded(0),
        Self::AxisOrder(AXIS_ORDERS[0].1),
        Self::AxisOrder(AXIS_ORDERS[1].1),
        Self::AxisOrder(AXIS_ORDERS[2].1),
        Self::AxisOrder(AXIS_ORDERS[3].1),
        Self::AxisOrder(AXIS_ORDERS[4].1),
        Self::BodyAxes(BODY_AXES[0].1),
        Self::BodyAxes(BODY_AXES[1].1),
        Self::BodyAxes(BODY_AXES[2].1),
        Self::BodyAxes(BODY_AXES[3].1),
        Self::BodyAxes(BODY_AXES[4].1),
        Self::BodyAxes(BODY_AXES[5].1),
        Self::BodyAxes(BODY_AXES[6].1),
        Self::Radians,
    ];

    /// World axes: they change a pixel only where the stream itself places the camera above a floor.
    pub const WORLDS: [Self; 5] = [
        Self::WorldAxes(WORLD_AXES[0].1),
        Self::WorldAxes(WORLD_AXES[1].1),
        Self::WorldAxes(WORLD_AXES[2].1),
        Self::WorldAxes(WORLD_AXES[3].1),
        Self::WorldAxes(WORLD_AXES[4].1),
    ];

    /// The name in a verdict: `convention:inverse-pose`.
    pub const fn verdict_name(self) -> &'static str {
        match self {
            Self::WFirst | Self::WLast => "convention:quaternion-order",
            Self::ConjugateQuaternion => "convention:conjugate-quaternion",
            Self::Degrees | Self::Radians => "convention:angle-unit",
            Self::Millimetres | Self::Centimetres | Self::Feet | Self::Inches => "convention:length-unit",
            Self::InversePose => "convention:inverse-pose",
            Self::AxisOrder(_) => "convention:axis-order",
            Self::LeftHanded(_) => "convention:left-handed",
            Self::WorldAxes(_) => "convention:world-axes",
            Self::BodyAxes(_) => "convention:body-axes",
            Self::CameraAsBody => "convention:camera-as-body",
            Self::BodyAsCamera => "convention:body-as-camera",
            Self::StampsFromZero => "convention:stamps-from-zero",
            Self::StampsInMicroseconds | Self::StampsInMilliseconds | Self::StampsInSeconds => {
                "convention:stamp-unit"
            }
            Self::FrozenRotation => "convention:frozen-rotation",
            Self::OtherCamera => "convention:other-camera",
        }
    }

    /// What it is, in a sentence: `the poses are body_from_world, the inverse of what they are read as`.
    pub fn words(self) -> String {
        let text = match self {
            Self::WFirst => "the quaternions are written w first, and were read w last",
            Self::WLast => "the quaternions are written w last, and were read w first",
            Self::ConjugateQuaternion => {
                "the quaternions are conjugated (body_from_world beside the right position)"
            }
            Self::Degrees => "the angles are degrees that were read as radians",
            Self::Radians => "the angles are radians that were read as degrees",
            Self::Millimetres => "the positions are in millimetres",
            Self::Centimetres => "the positions are in centimetres",
            Self::Feet => "the positions are in feet",
            Self::Inches => "the positions are in inches",
            Self::InversePose => "the poses are inverted (body_from_world)",
            Self::AxisOrder(_) => return format!("the columns of the position are in the order {self}"),
            Self::LeftHanded(axis) => {
                let name = ["x", "y", "z"].get(usize::from(axis)).copied().unwrap_or("?");
                return format!("the world is left-handed: its {name} axis is mirrored");
            }
            Self::WorldAxes(_) => return format!("the axes of the world point another way ({self})"),
            Self::BodyAxes(_) => return format!("the axes of the body point another way ({self})"),
            Self::CameraAsBody => "the poses are those of the camera, and were read as those of the body",
            Self::BodyAsCamera => "the poses are those of the body, and were read as those of the camera",
            Self::StampsFromZero => "the stamps of the poses count from zero",
            Self::StampsInMicroseconds => "the stamps are in microseconds",
            Self::StampsInMilliseconds => "the stamps are in milliseconds",
            Self::StampsInSeconds => "the stamps are in seconds",
            Self::FrozenRotation => "the rotation never changes, as if it had not been written",
            Self::OtherCamera => "the extrinsics are those of another camera of the rig",
        };
        text.to_string()
    }

    /// Metres that one unit of the positions is; `None` where it is no matter of length.
    pub const fn unit_m(self) -> Option<f64> {
        match self {
            Self::Millimetres => Some(1e-3),
            Self::Centimetres => Some(1e-2),
            Self::Feet => Some(0.3048),
            Self::Inches => Some(0.0254),
            _ => None,
        }
    }

    /// Whether there is a cure: what [`FromStr`] takes.
    pub const fn curable(self) -> bool {
        !matches!(self, Self::Degrees | Self::FrozenRotation | Self::OtherCamera)
    }

    /// All words that [`FromStr`] takes, in the order of the list that is printed.
    pub fn known_words() -> Vec<String> {
        all().filter(|c| c.curable()).map(|c| c.to_string()).collect()
    }
}

/// Every convention.
fn all() -> impl Iterator<Item = Convention> {
    let others = [
        Convention::Degrees,
        Convention::StampsFromZero,
        Convention::StampsInMicroseconds,
        Convention::StampsInMilliseconds,
        Convention::StampsInSeconds,
        Convention::FrozenRotation,
        Convention::OtherCamera,
    ];
    Convention::TRIED.into_iter().chain(Convention::WORLDS).chain(others)
}

fn name_of(axes: SignedAxes, names: &[(&'static str, SignedAxes)]) -> Option<&'static str> {
    names.iter().find(|(_, a)| *a == axes).map(|(name, _)| *name)
}

/// The word of the option `--estimate-as`.
impl fmt::Display for Convention {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match self {
            Self::WFirst => "wxyz",
            Self::WLast => "xyzw",
            Self::ConjugateQuaternion => "conjugate",
            Self::Degrees => "degrees",
            Self::Radians => "radians",
            Self::Millimetres => "mm",
            Self::Centimetres => "cm",
            Self::Feet => "ft",
            Self::Inches => "in",
            Self::InversePose => "inverse",
            Self::AxisOrder(axes) => match name_of(*axes, &AXIS_ORDERS) {
                Some(name) => name,
                None => return write!(f, "position{axes}"),
            },
            Self::LeftHanded(axis) => MIRRORS.get(usize::from(*axis)).copied().unwrap_or("mirror"),
            Self::WorldAxes(axes) => match name_of(*axes, &WORLD_AXES) {
                Some(name) => name,
                None => return write!(f, "world{axes}"),
            },
            Self::BodyAxes(axes) => match name_of(*axes, &BODY_AXES) {
                Some(name) => return write!(f, "body-{name}"),
                None => return write!(f, "body{axes}"),
            },
            Self::CameraAsBody => "camera",
            Self::BodyAsCamera => "body",
            Self::StampsFromZero => "from-zero",
            Self::StampsInMicroseconds => "stamps-us",
            Self::StampsInMilliseconds => "stamps-ms",
            Self::StampsInSeconds => "stamps-s",
            Self::FrozenRotation => "frozen",
            Self::OtherCamera => "other-camera",
        };
        f.write_str(word)
    }
}

impl FromStr for Convention {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = match text {
            // An east-north-up world read as north-east-down is undone by the same turn.
            "enu" => "ned",
            "body-optical" => "body-rdf",
            other => other,
        };
        match all().find(|c| c.to_string() == text) {
            Some(found) if found.curable() => Ok(found),
            Some(found) => Err(format!("`{text}` cannot be mended: {}", found.words())),
            None => Err(format!("unknown convention `{text}`; known: {}", Self::known_words().join(", "))),
        }
    }
}

impl TryFrom<String> for Convention {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Convention> for String {
    fn from(convention: Convention) -> Self {
        convention.to_string()
    }
}

/// `inverse,wxyz` as a list.
///
/// # Errors
/// A line that names the word that is not known or comes twice.
pub fn parse_list(text: &str) -> Result<Vec<Convention>, String> {
    let mut list = Vec::new();
    for word in text.split(',').map(str::trim).filter(|w| !w.is_empty()) {
        let convention: Convention = word.parse()?;
        if list.contains(&convention) {
            return Err(format!("`{word}` is named twice"));
        }
        list.push(convention);
    }
    if list.is_empty() { Err("no convention is named".to_string()) } else { Ok(list) }
}

/// The names of a list, as `--estimate-as` takes them.
pub fn list_text(list: &[Convention]) -> String {
    list.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_is_its_own_and_read_back() {
        let mut words: Vec<String> = all().map(|c| c.to_string()).collect();
        let count = words.len();
        words.sort();
        words.dedup();
        assert_eq!(words.len(), count, "{words:?}");
        for convention in all().filter(|c| c.curable()) {
            assert_eq!(convention.to_string().parse::<Convention>(), Ok(convention));
        }
        assert!("frozen".parse::<Convention>().unwrap_err().contains("cannot be mended"));
        assert!("upside".parse::<Convention>().unwrap_err().contains("conjugate"));
        assert_eq!(parse_list("inverse, wxyz").unwrap(), [Convention::InversePose, Convention::WFirst]);
        assert!(parse_list("mm,mm").is_err() && parse_list("").is_err());
        assert_eq!(list_text(&[Convention::InversePose, Convention::WFirst]), "inverse,wxyz");
    }
}
