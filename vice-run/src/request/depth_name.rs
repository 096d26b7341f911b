//! The one list of depth sources.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use vice_depth::Interpolation;

/// A depth source by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DepthName {
    /// A plane: the floor.
    Floor,
    /// A point cloud, projected and interpolated.
    ZMap,
    /// A depth camera registered to the images.
    ZCam,
    /// The faces of a scan.
    Mesh,
    /// AprilTags of a known size.
    Tag,
    /// A second camera.
    Stereo,
    /// The later labels of the point, by the motion of each stream.
    Triangulated,
}

impl DepthName {
    /// All sources.
    pub const ALL: [Self; 7] =
        [Self::Floor, Self::ZMap, Self::ZCam, Self::Mesh, Self::Tag, Self::Stereo, Self::Triangulated];

    /// The name in requests, tables and documents.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Floor => "floor",
            Self::ZMap => "zmap",
            Self::ZCam => "zcam",
            Self::Mesh => "mesh",
            Self::Tag => "tag",
            Self::Stereo => "stereo",
            Self::Triangulated => "triangulated",
        }
    }
}

impl fmt::Display for DepthName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for DepthName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|n| n.name() == text);
        found.ok_or_else(|| format!("unknown depth source {text}; known: {}", known()))
    }
}

/// How a Z-map finds depth between the points of its cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ZMapInterpolation {
    /// On the plane of the triangle around the pixel.
    #[default]
    Linear,
    /// By natural neighbours.
    Natural,
}

impl ZMapInterpolation {
    /// The name in requests and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Natural => "natural",
        }
    }
}

impl FromStr for ZMapInterpolation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = [Self::Linear, Self::Natural].into_iter().find(|i| i.name() == text);
        found.ok_or_else(|| format!("unknown interpolation {text}; known: linear, natural"))
    }
}

impl From<ZMapInterpolation> for Interpolation {
    fn from(name: ZMapInterpolation) -> Self {
        match name {
            ZMapInterpolation::Linear => Self::Linear,
            ZMapInterpolation::Natural => Self::Natural,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_found_by_its_own_name() {
        for name in DepthName::ALL {
            assert_eq!(name.name().parse(), Ok(name));
            assert_eq!(serde_json::to_string(&name).unwrap(), format!("\"{name}\""));
        }
        let error = "sonar".parse::<DepthName>().unwrap_err();
        assert!(error.contains("known: floor, zmap, zcam, mesh, tag, stereo, triangulated"), "{error}");
    }
}
