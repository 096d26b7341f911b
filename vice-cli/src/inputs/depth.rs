//! Depth sources by name, and key frames to ask them about.

use std::path::PathBuf;
use std::sync::Arc;

use vice_core::dataset::{CloudSource, Dataset, Floor, GROUND_TRUTH, Plane};
use vice_core::depth::{DepthSource, Keyframe};
use vice_core::frames::World;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_depth::{
    Cloud, CloudOptions, FloorDepth, Mesh, MeshDepth, ZCamDepth, ZCamOptions, ZMapDepth, ZMapOptions,
    load_cloud,
};
use vice_detect::{TagDepth, TagFamily, TagOptions};
use vice_files::calibration::CalibrationFile;
use vice_files::trajectory::{ReadOptions, read_spec};

use super::open::{DatasetArgs, UsedCamera};
use super::{numbers, positive, span_not_negative, split_list};
use crate::terminal::usage;

/// How depth sources work, and the calibration.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Depth")]
pub(crate) struct DepthArgs {
    /// Floor plane n·p + d = 0 in the world, instead of the data set's.
    #[arg(long, value_name = "NX,NY,NZ,D", allow_hyphen_values = true, value_parser = numbers::<4>)]
    pub(crate) floor_plane: Option<[f64; 4]>,
    /// Whether the Z-map leaves out cloud points that are hidden; off reproduces the paper.
    #[arg(long, value_name = "on|off", default_value = "on", action = clap::ArgAction::Set, value_parser = on_off)]
    pub(crate) zmap_occlusion: bool,
    /// Thin the cloud to one point for each cube of this size, metres.
    #[arg(long, value_name = "M", value_parser = positive)]
    pub(crate) cloud_voxel: Option<f64>,
    /// Depth camera readings outside of these are not trusted, metres.
    #[arg(long, value_name = "NEAR,FAR", value_parser = numbers::<2>)]
    pub(crate) zcam_range: Option<[f64; 2]>,
    /// Side of the tags for the depth source tag: the dark border's outside, metres.
    #[arg(long, value_name = "M", value_parser = positive)]
    pub(crate) tag_size: Option<f64>,
    /// Family of the tags for the depth source tag: 36h11, 25h9 or 16h5.
    #[arg(long, value_name = "FAMILY", default_value = "36h11")]
    pub(crate) tag_family: TagFamily,
    /// Calibration that overrides the data set's: TOML, or a Kalibr camchain.
    #[arg(long, value_name = "FILE")]
    pub(crate) calibration: Option<PathBuf>,
}

/// What places the camera in the world, where nothing is evaluated.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Camera's place in the world")]
pub(crate) struct AnchorArgs {
    /// Pose stream or file that places the camera [default: ground-truth where there is one].
    #[arg(long, value_name = "NAME|FILE")]
    reference: Option<String>,
    /// Widest gap between two poses that is interpolated, seconds.
    #[arg(long, value_name = "S", default_value = "0.1", value_parser = span_not_negative)]
    max_gap: Span,
}

fn on_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("expected on or off".to_string()),
    }
}

impl DepthArgs {
    pub(crate) fn calibration(&self) -> anyhow::Result<Option<CalibrationFile>> {
        let file = self.calibration.as_ref().map(CalibrationFile::read).transpose()?;
        if let Some(file) = &file {
            vice_files::leniency::log(file.suspicions());
        }
        Ok(file)
    }

    /// The floor that replaces the data set's.
    pub(crate) fn floor(&self) -> anyhow::Result<Option<Floor>> {
        let Some([nx, ny, nz, d]) = self.floor_plane else { return Ok(None) };
        let plane = Plane::<World>::new([nx, ny, nz], d).map_err(|e| usage(format!("--floor-plane: {e}")))?;
        Ok(Some(Floor::World(plane)))
    }

    pub(crate) fn cloud_options(&self) -> CloudOptions {
        CloudOptions { voxel_m: self.cloud_voxel, ..CloudOptions::default() }
    }

    /// The depth sources that are asked for, in that order; `floor` where none is.
    pub(crate) fn sources(
        &self,
        option: &str,
        names: &[String],
        dataset: &Arc<dyn Dataset>,
        camera: &str,
    ) -> anyhow::Result<Vec<Box<dyn DepthSource>>> {
        let mut names = split_list(names);
        if names.is_empty() {
            names.push("floor".to_string());
        }
        names.iter().map(|name| self.source(option, name, dataset, camera)).collect()
    }

    fn source(
        &self,
        option: &str,
        name: &str,
        dataset: &Arc<dyn Dataset>,
        camera: &str,
    ) -> anyhow::Result<Box<dyn DepthSource>> {
        match name {
            "floor" => Ok(Box::new(FloorDepth::new())),
            "zmap" => {
                let (cloud, reference) = self.cloud(name, dataset.as_ref())?;
                let options = ZMapOptions { occlusion: self.zmap_occlusion, ..ZMapOptions::default() };
                Ok(Box::new(ZMapDepth::new(cloud, reference.world_from_cloud, options)))
            }
            "zcam" => {
                let range_m = self.zcam_range.unwrap_or(ZCamOptions::default().range_m);
                let options = ZCamOptions { range_m, ..ZCamOptions::default() };
                Ok(Box::new(ZCamDepth::new(Arc::clone(dataset), camera, options)?))
            }
            "mesh" => {
                let reference = cloud_of(name, dataset.as_ref())?;
                let CloudSource::Ply(path) = &reference.source else {
                    anyhow::bail!("{}: the depth source mesh needs a PLY with faces", dataset.name());
                };
                Ok(Box::new(MeshDepth::new(Arc::new(Mesh::read_ply(path)?), reference.world_from_cloud)))
            }
            "tag" => {
                let size_m = self.tag_size.ok_or_else(|| {
                    usage(format!("{option} tag: how large the tags are is not known (give --tag-size M)"))
                })?;
                let options = TagOptions { family: self.tag_family, border: None };
                Ok(Box::new(TagDepth::new(Arc::clone(dataset), camera, options, size_m)?))
            }
            _ => Err(usage(format!(
                "{option}: unknown depth source {name}; known: floor, zmap, zcam, mesh, tag"
            ))),
        }
    }

    /// The data set's scan, read.
    pub(crate) fn cloud(
        &self,
        source: &str,
        dataset: &dyn Dataset,
    ) -> anyhow::Result<(Arc<Cloud>, vice_core::dataset::CloudRef)> {
        let reference = cloud_of(source, dataset)?;
        Ok((load_cloud(&reference, &self.cloud_options())?, reference))
    }
}

fn cloud_of(source: &str, dataset: &dyn Dataset) -> anyhow::Result<vice_core::dataset::CloudRef> {
    dataset.cloud()?.ok_or_else(|| {
        anyhow::anyhow!(
            "{} has no point cloud for the depth source {source} (use --depth floor)",
            dataset.name()
        )
    })
}

/// A data set with what is needed to ask depth sources about its frames.
pub(crate) struct Scene {
    pub(crate) dataset: Arc<dyn Dataset>,
    pub(crate) used: UsedCamera,
    pub(crate) anchor: Option<Trajectory>,
    pub(crate) max_gap: Span,
    floor: Option<Floor>,
}

impl Scene {
    pub(crate) fn open(
        dataset: &DatasetArgs,
        depth: &DepthArgs,
        anchor: &AnchorArgs,
    ) -> anyhow::Result<Self> {
        let calibration = depth.calibration()?;
        let floor = depth.floor()?;
        let opened = dataset.open()?;
        let used = dataset.used_camera(opened.as_ref(), calibration.as_ref())?;
        let streams = opened.streams();
        let trajectory = match anchor.reference.as_deref() {
            Some(name) if streams.iter().any(|s| s == name) => Some(opened.trajectory(name)?),
            Some(file) => Some(read_spec(file, &ReadOptions::default())?.trajectory),
            None if streams.iter().any(|s| s == GROUND_TRUTH) => Some(opened.trajectory(GROUND_TRUTH)?),
            None => None,
        };
        Ok(Self { dataset: opened, used, anchor: trajectory, max_gap: anchor.max_gap, floor })
    }

    /// A frame as a depth source sees it.
    pub(crate) fn keyframe(&self, frame: usize) -> anyhow::Result<Keyframe<'_>> {
        let stamp = self.used.frames[frame];
        let body_from_camera = match self.used.body_from_camera {
            Some(fixed) => fixed,
            None => self.dataset.body_from_camera(&self.used.name, stamp)?,
        };
        let pose = self.anchor.as_ref().and_then(|t| t.pose_at(stamp, self.max_gap).ok());
        let floor = match self.floor {
            Some(floor) => floor,
            None => self.dataset.floor(stamp)?,
        };
        Ok(Keyframe {
            stamp,
            frame,
            camera: &self.used.camera,
            body_from_camera,
            world_from_camera: pose.map(|world_from_body| world_from_body * body_from_camera),
            floor,
        })
    }

    /// The frame that `--at` names: an index, or the exact stamp in nanoseconds.
    pub(crate) fn frame_at(&self, text: &str) -> anyhow::Result<usize> {
        let frames = &self.used.frames;
        let number: i64 =
            text.parse().map_err(|_| usage(format!("--at: `{text}` is neither an index nor a stamp")))?;
        if let Some(index) = usize::try_from(number).ok().filter(|i| *i < frames.len()) {
            return Ok(index);
        }
        let stamp = Stamp::from_nanos(number);
        frames.binary_search(&stamp).map_err(|after| {
            let nearest = [after.checked_sub(1), Some(after)]
                .into_iter()
                .flatten()
                .filter_map(|i| frames.get(i))
                .min_by_key(|s| s.since(stamp).abs());
            let nearest = nearest.map_or_else(String::new, |s| format!("; the nearest frame is at {s} ns"));
            anyhow::anyhow!(
                "--at: camera {} has {} frames and none at {stamp} ns{nearest}",
                self.used.name,
                frames.len()
            )
        })
    }
}
