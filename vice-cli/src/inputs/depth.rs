//! How depth sources work, the calibration, and what places a camera where nothing is evaluated.

use std::path::PathBuf;

use vice_run::core::time::Span;
use vice_run::detect::TagFamily;
use vice_run::request::DepthName;
use vice_run::request::{DatasetSpec, DepthSpec, ReferenceSpec, ZMapInterpolation};

use vice_run::request::{ImageSize, LensSpec};

use super::{DatasetArgs, Numbers, numbers, positive, span_not_negative, split_list};
use crate::terminal::usage;

/// A calibration in place of the data set's.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Calibration")]
pub(crate) struct CalibrationArgs {
    /// Calibration that overrides the data set's: TOML, or that of Kalibr, OpenVINS, ROS, OpenCV, ORB-SLAM, VINS, Basalt, COLMAP.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Intrinsics in pixels, instead of the calibration's.
    #[arg(long, value_name = "FX,FY,CX,CY", allow_hyphen_values = true, value_parser = numbers::<4>)]
    intrinsics: Option<[f64; 4]>,
    /// Lens in place of the calibration's: pinhole, or a model with its coefficients: radtan, rational, equidistant, ds, eucm,
    /// omni, fov.
    #[arg(long, value_name = "MODEL:K1,...")]
    distortion: Option<LensSpec>,
    /// Columns and rows of the images that the calibration is of.
    #[arg(long, value_name = "WxH")]
    image_size: Option<ImageSize>,
    /// The camera's place in the body: x,y,z in metres and the quaternion, or a matrix row by row.
    #[arg(long, value_name = "X,Y,Z,QX,QY,QZ,QW", allow_hyphen_values = true)]
    body_from_camera: Option<Numbers>,
}

/// How depth sources work, and the calibration.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Depth")]
pub(crate) struct DepthArgs {
    /// Floor plane n·p + d = 0 in the world, instead of the data set's.
    #[arg(long, value_name = "NX,NY,NZ,D", allow_hyphen_values = true, value_parser = numbers::<4>)]
    floor_plane: Option<[f64; 4]>,
    /// Whether the Z-map leaves out cloud points that are hidden; off reproduces the paper [default: on].
    #[arg(long, value_name = "on|off", action = clap::ArgAction::Set, value_parser = on_off)]
    zmap_occlusion: Option<bool>,
    /// How the Z-map finds depth between points: linear (in triangles) or natural (natural neighbours) [default: linear].
    #[arg(long, value_name = "linear|natural")]
    zmap_interpolation: Option<ZMapInterpolation>,
    /// Thin the cloud to one point for each cube of this size, metres.
    #[arg(long, value_name = "M", value_parser = positive)]
    cloud_voxel: Option<f64>,
    /// Ignore depth camera readings outside this range, metres.
    #[arg(long, value_name = "NEAR,FAR", value_parser = numbers::<2>)]
    zcam_range: Option<[f64; 2]>,
    /// Side of the tags for the depth source tag: the dark border's outside, metres.
    #[arg(long, value_name = "M", value_parser = positive)]
    tag_size: Option<f64>,
    /// Family of the tags for the depth source tag: 36h11, 25h9 or 16h5 [default: 36h11].
    #[arg(long, value_name = "FAMILY")]
    tag_family: Option<TagFamily>,
    /// Second camera for the depth source stereo [default: the only other camera].
    #[arg(long, value_name = "NAME")]
    stereo_camera: Option<String>,
    /// Scan of the scene, instead of the data set's: PLY, PCD, LAS or LAZ, metres.
    #[arg(long, value_name = "FILE")]
    cloud: Option<PathBuf>,
    /// Mesh of the scene, instead of the data set's: a PLY file, metres.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// File with the place of cloud and mesh in the world: x y z qx qy qz qw, or a 4x4 matrix [default: they are in the world's
    /// frame].
    #[arg(long, value_name = "FILE")]
    world_from_cloud: Option<PathBuf>,
    #[command(flatten)]
    calibration: CalibrationArgs,
}

/// Depth sources by name.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct SourceArgs {
    /// Depth sources: floor, zmap, zcam, mesh, tag, stereo.
    #[arg(long, alias = "source", value_name = "SOURCE,...", required = true)]
    depth: Vec<String>,
}

/// What places the camera in the world, where nothing is evaluated.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Camera's place in the world")]
pub(crate) struct AnchorArgs {
    /// Pose stream or file that places the camera [default: ground-truth where there is one].
    #[arg(long, value_name = "NAME|FILE")]
    reference: Option<String>,
    /// Longest gap between two poses to interpolate over, seconds.
    #[arg(long, value_name = "S", default_value = "0.1", value_parser = span_not_negative)]
    pub(crate) max_gap: Span,
}

pub(crate) fn on_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("expected on or off".to_string()),
    }
}

impl DepthArgs {
    /// The sources that an option names, with how they work.
    pub(crate) fn spec(&self, option: &str, names: &[String]) -> anyhow::Result<DepthSpec> {
        let sources: Vec<DepthName> = split_list(names)
            .iter()
            .map(|name| name.parse().map_err(|e| usage(format!("{option}: {e}"))))
            .collect::<anyhow::Result<_>>()?;
        let spec = DepthSpec {
            sources,
            zmap_occlusion: self.zmap_occlusion,
            zmap_interpolation: self.zmap_interpolation,
            cloud_voxel_m: self.cloud_voxel,
            zcam_range_m: self.zcam_range,
            tag_size_m: self.tag_size,
            tag_family: self.tag_family,
            stereo_camera: self.stereo_camera.clone(),
            compare: None,
        };
        spec.check_scene(&DatasetSpec { mesh: self.mesh.clone(), ..DatasetSpec::default() })?;
        Ok(spec)
    }

    /// The data set with what overrides it.
    pub(crate) fn dataset(&self, dataset: &DatasetArgs) -> DatasetSpec {
        DatasetSpec {
            floor_plane: self.floor_plane,
            cloud: self.cloud.clone(),
            mesh: self.mesh.clone(),
            world_from_cloud: self.world_from_cloud.clone(),
            ..self.calibration.dataset(dataset)
        }
    }
}

impl CalibrationArgs {
    /// The data set with this calibration in place of its own.
    pub(crate) fn dataset(&self, dataset: &DatasetArgs) -> DatasetSpec {
        DatasetSpec {
            calibration: self.calibration.clone(),
            intrinsics: self.intrinsics,
            distortion: self.distortion.clone(),
            image_size: self.image_size,
            body_from_camera: self.body_from_camera.as_ref().map(|numbers| numbers.0.clone()),
            ..dataset.spec()
        }
    }

    /// Whether anything is given.
    pub(crate) const fn says_something(&self) -> bool {
        self.calibration.is_some()
            || self.intrinsics.is_some()
            || self.distortion.is_some()
            || self.image_size.is_some()
            || self.body_from_camera.is_some()
    }
}

impl SourceArgs {
    pub(crate) fn spec(&self, depth: &DepthArgs) -> anyhow::Result<DepthSpec> {
        let spec = depth.spec("--depth", &self.depth)?;
        spec.check(&[])?;
        Ok(spec)
    }
}

impl AnchorArgs {
    pub(crate) fn reference(&self) -> ReferenceSpec {
        ReferenceSpec::from(self.reference.clone())
    }
}
