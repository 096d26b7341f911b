//! What is asked for, as plain data: a data set, labels, pose streams, depth and a protocol.
//!
//! A command line, a row of a batch, a call from Python and a result document all hold the same [`Request`]. Unknown
//! fields are refused; what is left out has the default that is stated here. Files are named as they were given, so
//! that a relative path means the folder in which the request is run; addresses are written without their secrets.

mod automatic;
mod command_line;
mod depth_name;
mod estimate;
mod plain;
mod secrets;
mod word;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::conventions::Convention;
pub use vice_core::evaluate::DEFAULT_MAX_GAP;
use vice_core::evaluate::{Observations, Window};
use vice_core::metrics::align::Alignment;
use vice_core::time::Span;
use vice_detect::TagFamily;
use vice_files::vice_toml::ViceToml;

pub use automatic::{DEFAULT_POINTS, MOST_POINTS, is_auto, labels_shown, points_asked};
pub use depth_name::{DepthName, ZMapInterpolation};
pub use estimate::{Anchor, EstimateFrame, EstimateSpec, IMU_EULER, ReferenceSpec};

pub use plain::{ImageSize, LensSpec};

pub(crate) use word::{seconds, seconds_option};

use crate::error::{RunError, RunResult};
use crate::in_memory::is_in_memory;

/// Everything that says what is evaluated, and how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// The recording.
    pub dataset: DatasetSpec,
    /// The labels.
    #[serde(default)]
    pub labels: LabelsSpec,
    /// The part of the run that is looked at.
    #[serde(default)]
    pub protocol: Protocol,
    /// The pose streams.
    #[serde(default)]
    pub streams: StreamsSpec,
    /// The depth sources.
    #[serde(default)]
    pub depth: DepthSpec,
    /// How it is scored.
    #[serde(default)]
    pub scoring: Scoring,
}

/// A recording, and what replaces parts of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetSpec {
    /// Folder or file, or the address of one.
    #[serde(serialize_with = "word::path::serialize")]
    pub path: PathBuf,
    /// Format; `None`: found by looking.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// Settings of the format, by key.
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        serialize_with = "word::settings::serialize"
    )]
    pub set: BTreeMap<String, String>,
    /// Camera; `None`: the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Calibration file that overrides the data set's: TOML, or what another tool wrote.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        serialize_with = "word::path_option::serialize"
    )]
    pub calibration: Option<PathBuf>,
    /// Intrinsics that override the calibration's: fx, fy, cx, cy in pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<[f64; 4]>,
    /// Lens that overrides the calibration's, such as `radtan:k1,k2,p1,p2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<LensSpec>,
    /// Columns and rows of the images that the calibration is of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image_size: Option<ImageSize>,
    /// The camera's place in the body: x, y, z in metres and the quaternion x, y, z, w, or a matrix row by row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<Vec<f64>>,
    /// Scan of the scene in place of the data set's: PLY, PCD, LAS or LAZ.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        serialize_with = "word::path_option::serialize"
    )]
    pub cloud: Option<PathBuf>,
    /// Faces of the scene in place of the data set's: a PLY file.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        serialize_with = "word::path_option::serialize"
    )]
    pub mesh: Option<PathBuf>,
    /// File with the place of the cloud and the mesh in the world; `None`: they are in the world's frame, or what the data
    /// set says of its own.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        serialize_with = "word::path_option::serialize"
    )]
    pub world_from_cloud: Option<PathBuf>,
    /// Floor plane `n·p + d = 0` in the world in place of the data set's: nx, ny, nz, d in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_plane: Option<[f64; 4]>,
    /// Plugins beside those that are found by themselves.
    #[serde(default, skip_serializing_if = "PluginsSpec::is_default")]
    pub plugins: PluginsSpec,
}

/// Which plugins are loaded beside those in `VICE_PLUGIN_PATH` and the user's folder.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PluginsSpec {
    /// Shared libraries; each goes before a built-in format of the same name.
    #[serde(default)]
    pub files: Vec<PathBuf>,
    /// Load plugins even from files or folders that others may write to.
    #[serde(default)]
    pub allow_writable: bool,
    /// Whether plugins run in processes of their own; by default those outside of the user's own folders do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub isolate: Option<bool>,
}

impl PluginsSpec {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// The labels that are scored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelsSpec {
    /// CSV, JSON, CVAT's XML, or the authors' pickle; or `auto` for labels that are made, `auto:4` with four points.
    #[serde(serialize_with = "word::path::serialize")]
    pub file: PathBuf,
    /// Only these points; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<String>,
    /// Whose labels count.
    #[serde(default)]
    pub observations: Observations,
    /// How far off labels are: a comparison of labels, `vice.label-compare/1`, whose floor goes into the intervals.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        serialize_with = "word::path_option::serialize"
    )]
    pub noise: Option<PathBuf>,
}

/// The part of a run that is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Keep the frame nearest to each tick of this rate (Hz), and every key frame; `None`: every labelled frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// Seconds after the camera's first frame.
    #[serde(default, rename = "start_s", with = "seconds")]
    pub start: Span,
    /// Seconds from there; `None`: to the end.
    #[serde(
        default,
        rename = "duration_s",
        with = "seconds_option",
        skip_serializing_if = "Option::is_none"
    )]
    pub duration: Option<Span>,
}

/// Which pose streams are evaluated, and how their poses are read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StreamsSpec {
    /// What is evaluated.
    #[serde(default)]
    pub estimates: Vec<EstimateSpec>,
    /// What the result calls them, one for each; empty: the names of files and streams.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
    /// What it is compared with.
    #[serde(default)]
    pub reference: ReferenceSpec,
    /// Whose poses the estimates give.
    #[serde(default)]
    pub estimate_frame: EstimateFrame,
    /// What the estimates are, where that is not what they are read as: mended before anything else.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimate_as: Vec<Convention>,
    /// Times of KITTI files; `None`: times.txt beside each.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        serialize_with = "word::path_option::serialize"
    )]
    pub times: Option<PathBuf>,
    /// Seconds added to the stamps of the estimates; `None`: what the calibration says, or nothing.
    #[serde(
        default,
        rename = "time_offset_s",
        with = "seconds_option",
        skip_serializing_if = "Option::is_none"
    )]
    pub time_offset: Option<Span>,
    /// Widest gap between two poses that is interpolated, seconds.
    #[serde(default = "default_max_gap", rename = "max_gap_s", with = "seconds")]
    pub max_gap: Span,
    /// What places the camera in the world for depth; `None`: the reference where there is one, else each estimate for
    /// itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anchor: Option<Anchor>,
    /// Pose `world_from_body` of the anchoring estimate, or of each where each is its own anchor, at the first key frame:
    /// x, y, z in metres, then the quaternion x, y, z, w.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_pose: Option<[f64; 7]>,
}

const fn default_max_gap() -> Span {
    DEFAULT_MAX_GAP
}

impl Default for StreamsSpec {
    fn default() -> Self {
        Self {
            estimates: Vec::new(),
            names: Vec::new(),
            reference: ReferenceSpec::default(),
            estimate_frame: EstimateFrame::default(),
            estimate_as: Vec::new(),
            times: None,
            time_offset: None,
            max_gap: DEFAULT_MAX_GAP,
            anchor: None,
            initial_pose: None,
        }
    }
}

/// Which depth sources are asked, and how they work.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthSpec {
    /// The sources; empty: the floor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<DepthName>,
    /// Whether the Z-map leaves out cloud points that are hidden; `None`: yes. Off reproduces the paper.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zmap_occlusion: Option<bool>,
    /// How depth is found between the points of the cloud; `None`: linearly, in triangles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zmap_interpolation: Option<ZMapInterpolation>,
    /// Thin the cloud to one point for each cube of this size, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cloud_voxel_m: Option<f64>,
    /// Nearest and furthest reading of a depth camera that is trusted, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zcam_range_m: Option<[f64; 2]>,
    /// Side of the tags: the dark border's outside, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_size_m: Option<f64>,
    /// Family of the tags; `None`: 36h11.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_family: Option<TagFamily>,
    /// Second camera of the pair for the depth source stereo; `None`: the only other one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stereo_camera: Option<String>,
    /// Whether the depths at the key frames are compared with what a depth camera or scan of the recording says, where
    /// these are not asked for themselves; `None`: yes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compare: Option<bool>,
}

/// How it is scored.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scoring {
    /// Numbers of points whose subsets are averaged over; empty: those up to 3 that exist.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub subsets: Vec<usize>,
    /// Alignment of the trajectory errors; `None`: SE3, and the first pose for a stream that starts in the reference's own
    /// state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub align: Option<Alignment>,
}

impl Request {
    /// A request for estimates of a data set, with the defaults for all else.
    pub fn new(
        dataset: impl Into<PathBuf>,
        labels: impl Into<PathBuf>,
        estimates: impl IntoIterator<Item = EstimateSpec>,
    ) -> Self {
        Self {
            dataset: DatasetSpec { path: dataset.into(), ..DatasetSpec::default() },
            labels: LabelsSpec { file: labels.into(), ..LabelsSpec::default() },
            streams: StreamsSpec { estimates: estimates.into_iter().collect(), ..StreamsSpec::default() },
            ..Self::default()
        }
    }

    /// The command line of `vice evaluate` that asks for the same.
    pub fn command_line(&self) -> String {
        command_line::of(self)
    }

    /// Whether a command line can ask for it: one names files, and takes their names for the estimates.
    pub fn has_command_line(&self) -> bool {
        let estimates = self.streams.estimates.iter().map(ToString::to_string);
        let reference: Option<String> = self.streams.reference.clone().into();
        let labels = self.labels.file.display().to_string();
        let mut all = estimates.chain(reference).chain([labels, self.dataset.path.display().to_string()]);
        self.streams.names.is_empty() && !all.any(|name| is_in_memory(&name))
    }

    /// The frames and labels that take part.
    pub fn window(&self) -> Window {
        self.protocol.window(self.labels.observations)
    }

    /// All that is read, and so must not be written over: files, and the whole data set.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let mut files = vec![self.dataset.path.clone()];
        files.extend(Some(&self.labels.file).filter(|file| !is_auto(file)).cloned());
        files.extend(self.labels.noise.clone());
        files.extend(self.streams.estimates.iter().filter_map(|e| e.path().map(Path::to_path_buf)));
        if let ReferenceSpec::Named(EstimateSpec::Named(name)) = &self.streams.reference {
            files.push(PathBuf::from(name));
        }
        let DatasetSpec { calibration, cloud, mesh, world_from_cloud, .. } = &self.dataset;
        files.extend(
            [calibration, cloud, mesh, world_from_cloud, &self.streams.times].into_iter().flatten().cloned(),
        );
        files.extend(beside(&self.dataset.path));
        if let EstimateFrame::File(file) = &self.streams.estimate_frame {
            files.push(file.clone());
        }
        files
    }

    /// Refuses what contradicts itself or would do nothing, whatever the data.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage.
    pub fn check(&self) -> RunResult<()> {
        self.protocol.check()?;
        self.depth.check(&[])?;
        self.depth.check_scene(&self.dataset)?;
        self.streams.check_names()?;
        points_asked(&self.labels.file)?;
        if self.streams.max_gap < Span::ZERO {
            return Err(RunError::usage("max-gap", "must not be negative"));
        }
        if let Some(zero) = self.scoring.subsets.iter().find(|n| **n == 0) {
            return Err(RunError::usage("subsets", format!("{zero} points make no subset")));
        }
        Ok(())
    }
}

/// The `vice.toml` of a data set, and what it names.
fn beside(data_set: &Path) -> Vec<PathBuf> {
    let Some(file) = ViceToml::place(data_set) else { return Vec::new() };
    let told = ViceToml::read(&file).unwrap_or_default();
    let labels = told.labels.file.filter(|file| !is_auto(file));
    let streams = told.streams.into_values().flat_map(|s| std::iter::once(s.file).chain(s.times));
    let named = told.calibration.into_iter().chain(told.cloud).chain(told.mesh).chain(labels);
    std::iter::once(file).chain(named).chain(streams).collect()
}

impl StreamsSpec {
    /// Names that do not tell the estimates apart are no names.
    fn check_names(&self) -> RunResult<()> {
        let (names, estimates) = (&self.names, self.estimates.len());
        if !names.is_empty() && names.len() != estimates {
            return Err(RunError::usage("names", format!("{} names for {estimates} estimates", names.len())));
        }
        let empty = names.iter().find(|name| name.trim().is_empty());
        let twice = names.iter().enumerate().find(|(place, name)| names[..*place].contains(name));
        match empty.or(twice.map(|(_, name)| name)) {
            Some(name) => Err(RunError::usage("names", format!("`{name}` names no estimate of its own"))),
            None => Ok(()),
        }
    }
}

impl Protocol {
    /// The window of a run, for some labels.
    pub const fn window(&self, observations: Observations) -> Window {
        Window { fps: self.fps, start: self.start, duration: self.duration, observations }
    }

    /// Refuses negative times and rates.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage.
    pub fn check(&self) -> RunResult<()> {
        if self.fps.is_some_and(|fps| !(fps > 0.0 && fps.is_finite())) {
            return Err(RunError::usage("fps", "must be a number above zero"));
        }
        for (field, span) in [("start", Some(self.start)), ("duration", self.duration)] {
            if span.is_some_and(|s| s < Span::ZERO) {
                return Err(RunError::usage(field, "must not be negative"));
            }
        }
        Ok(())
    }
}

impl DepthSpec {
    /// The sources that are asked: the floor where none is named.
    pub fn names(&self) -> Vec<DepthName> {
        if self.sources.is_empty() { vec![DepthName::Floor] } else { self.sources.clone() }
    }

    /// Refuses a mesh that no source looks at.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage.
    pub fn check_scene(&self, dataset: &DatasetSpec) -> RunResult<()> {
        if dataset.mesh.is_some() && !self.names().contains(&DepthName::Mesh) {
            return Err(RunError::usage("mesh", "is of the depth source mesh, which is not asked")
                .advise("add mesh to `depth`, or leave it out"));
        }
        Ok(())
    }

    /// Whether the labels give the depth.
    pub fn is_triangulated(&self) -> bool {
        self.sources.contains(&DepthName::Triangulated)
    }

    /// Refuses a source that needs labels and a pose stream, where frames are asked for their depth by themselves.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage.
    pub fn check_of_frames(&self) -> RunResult<()> {
        if !self.is_triangulated() {
            return Ok(());
        }
        let problem = "triangulated depth is fitted to labels and to the stream under test: only `vice evaluate` has it";
        Err(RunError::usage("depth", problem).advise("choose another source here"))
    }

    /// Refuses triangulated depth beside any other: it takes a part of the error for depth, and so is no depth to compare.
    fn check_unmixed(&self) -> RunResult<()> {
        if self.is_triangulated() && (self.sources.len() > 1 || self.compare == Some(true)) {
            let problem = "triangulated depth takes a part of the error for depth, and cannot stand beside other depths";
            return Err(RunError::usage("depth", problem).advise("ask for it alone, in a run of its own"));
        }
        Ok(())
    }

    /// Refuses settings of sources that nobody asks for, here or in `also`.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage.
    pub fn check(&self, also: &[DepthName]) -> RunResult<()> {
        use DepthName::{Stereo, Tag, ZCam, ZMap};
        self.check_unmixed()?;
        let settings = [
            ("zmap-occlusion", self.zmap_occlusion.is_some(), ZMap),
            ("zmap-interpolation", self.zmap_interpolation.is_some(), ZMap),
            ("cloud-voxel", self.cloud_voxel_m.is_some(), ZMap),
            ("zcam-range", self.zcam_range_m.is_some(), ZCam),
            ("tag-size", self.tag_size_m.is_some(), Tag),
            ("tag-family", self.tag_family.is_some(), Tag),
            ("stereo-camera", self.stereo_camera.is_some(), Stereo),
        ];
        let names = self.names();
        for (field, given, source) in settings {
            if given && !names.contains(&source) && !also.contains(&source) {
                let asked: Vec<&str> = names.iter().map(|n| n.name()).collect();
                return Err(RunError::usage(
                    field,
                    format!(
                        "is of the depth source {}, and only {} is asked",
                        source.name(),
                        asked.join(", ")
                    ),
                )
                .advise(format!("add {} to `depth`, or leave it out", source.name())));
            }
        }
        if let Some([near, far]) = self.zcam_range_m.filter(|[near, far]| !(0.0 <= *near && near < far)) {
            return Err(RunError::usage("zcam-range", format!("{near} to {far} m holds no depth")));
        }
        Ok(())
    }
}

#[cfg(test)]
pub(crate) mod tests;
