//! Which poses are meant: streams of the data set, files, relative motions, or an integration of the IMU.

use std::convert::Infallible;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use vice_core::error::DataResult;
use vice_files::address::{is_address, shown, shown_path};
use vice_files::trajectory::{ReadOptions, TrajectoryFile, read, read_relative};

use crate::place::Place;

/// Starts the name of a file of relative motions.
const RELATIVE: &str = "rel:";

/// The name of the estimate that integrates the data set's IMU.
pub const IMU_EULER: &str = "imu-euler";

/// A pose stream.
///
/// As text, which leaves secrets of an address out: a name or file as it is, `rel:FILE` for relative motions, `imu-euler`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum EstimateSpec {
    /// A stream of the data set by this name, or else a file of poses.
    Named(String),
    /// A file of relative motions, chained from where it starts.
    Relative(PathBuf),
    /// Euler integration of the data set's IMU from the reference's state at the first key frame, unless the data set has
    /// a stream of that name.
    ImuEuler,
}

impl EstimateSpec {
    /// The file that is read, where it may be one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Named(name) => Some(Path::new(name)),
            Self::Relative(path) => Some(path),
            Self::ImuEuler => None,
        }
    }

    /// Reads it as a file.
    ///
    /// # Errors
    /// [`DataError`](vice_core::error::DataError) if there is no such file, or it holds no poses.
    pub fn read_file(&self, options: &ReadOptions) -> DataResult<TrajectoryFile> {
        let Some(path) = self.path() else { return read(IMU_EULER, options) };
        let place = Place::of_file(path)?;
        let times = options.times.as_deref().map(Place::of_file).transpose()?;
        let options =
            ReadOptions { times: times.as_ref().map(|t| t.path().to_path_buf()), ..options.clone() };
        place.told(match self {
            Self::Relative(_) => read_relative(place.path()),
            _ => read(place.path(), &options),
        })
    }

    /// Whether it is a file: one that is elsewhere is looked for where it is read.
    pub fn is_file(&self) -> bool {
        self.path().is_some_and(|path| is_address(path) || path.exists())
    }

    /// What a stream is called before it is known what else is there.
    pub fn word(&self) -> String {
        match self {
            Self::Named(name) => shown(name).into_owned(),
            Self::Relative(path) => shown_path(path).display().to_string(),
            Self::ImuEuler => IMU_EULER.to_string(),
        }
    }
}

impl From<String> for EstimateSpec {
    fn from(text: String) -> Self {
        match text.strip_prefix(RELATIVE) {
            Some(path) => Self::Relative(PathBuf::from(path)),
            None if text == IMU_EULER => Self::ImuEuler,
            None => Self::Named(text),
        }
    }
}

impl FromStr for EstimateSpec {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(Self::from(text.to_string()))
    }
}

impl fmt::Display for EstimateSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => f.write_str(&shown(name)),
            Self::Relative(path) => write!(f, "{RELATIVE}{}", shown_path(path).display()),
            Self::ImuEuler => f.write_str(IMU_EULER),
        }
    }
}

impl From<EstimateSpec> for String {
    fn from(spec: EstimateSpec) -> Self {
        spec.to_string()
    }
}

/// What estimates are compared with. As text: a stream or file, or `none`; left out, the ground truth where there is one.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Option<String>", into = "Option<String>")]
pub enum ReferenceSpec {
    /// The ground truth where there is one, else nothing.
    #[default]
    Default,
    /// Nothing.
    None,
    /// This stream.
    Named(EstimateSpec),
}

impl From<Option<String>> for ReferenceSpec {
    fn from(text: Option<String>) -> Self {
        match text.as_deref() {
            None => Self::Default,
            Some("none") => Self::None,
            Some(name) => Self::Named(EstimateSpec::from(name.to_string())),
        }
    }
}

impl From<ReferenceSpec> for Option<String> {
    fn from(spec: ReferenceSpec) -> Self {
        match spec {
            ReferenceSpec::Default => None,
            ReferenceSpec::None => Some("none".to_string()),
            ReferenceSpec::Named(stream) => Some(stream.to_string()),
        }
    }
}

/// What places the camera in the world for depth. As text: `reference`, `estimate`, or the name of a stream.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum Anchor {
    /// The reference.
    Reference,
    /// The first estimate.
    Estimate,
    /// The stream of this name, as the table has it.
    Stream(String),
}

impl From<String> for Anchor {
    fn from(text: String) -> Self {
        match text.as_str() {
            "reference" => Self::Reference,
            "estimate" => Self::Estimate,
            _ => Self::Stream(text),
        }
    }
}

impl From<Anchor> for String {
    fn from(anchor: Anchor) -> Self {
        anchor.to_string()
    }
}

impl FromStr for Anchor {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(Self::from(text.to_string()))
    }
}

impl fmt::Display for Anchor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Reference => "reference",
            Self::Estimate => "estimate",
            Self::Stream(name) => name,
        })
    }
}

/// Whose poses the estimates give. As text: `body`, `camera`, or a file with `body_from_estimate` (4x4).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum EstimateFrame {
    /// The data set's body.
    #[default]
    Body,
    /// The camera's optical frame.
    Camera,
    /// A frame whose place in the body a file gives.
    File(PathBuf),
}

impl From<String> for EstimateFrame {
    fn from(text: String) -> Self {
        match text.as_str() {
            "body" => Self::Body,
            "camera" => Self::Camera,
            _ => Self::File(PathBuf::from(text)),
        }
    }
}

impl FromStr for EstimateFrame {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(Self::from(text.to_string()))
    }
}

impl fmt::Display for EstimateFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Body => f.write_str("body"),
            Self::Camera => f.write_str("camera"),
            Self::File(path) => write!(f, "{}", shown_path(path).display()),
        }
    }
}

impl From<EstimateFrame> for String {
    fn from(frame: EstimateFrame) -> Self {
        frame.to_string()
    }
}
