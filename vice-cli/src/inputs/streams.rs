//! Pose streams: the reference and the estimates, by the data set's names or from files.

use std::path::{Path, PathBuf};

use anyhow::Context;
use nalgebra::Vector3;
use vice_core::conventions::{Convention, Given, cure, list_text};
use vice_core::dataset::{Dataset, GROUND_TRUTH};
use vice_core::diagnose::InertialRun;
use vice_core::evaluate::{Selection, Stream};
use vice_core::frames::{Body, BodyFromCamera, Rigid, Sensor, WorldFromBody, WorldFromCamera};
use vice_core::imu::{GRAVITY_Z_UP_M_S2, ImuSample, InertialState, fit_velocity};
use vice_core::metrics::associate::{Matching, PosePairs};
use vice_core::metrics::rotation_offset::RotationOffset;
use vice_core::result::Role;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{Trajectory, in_other_world};
use vice_files::calibration::CalibrationFile;
use vice_files::rigid_file;
use vice_files::trajectory::{ReadOptions, read_spec};

use super::open::UsedCamera;
use super::{numbers, span, span_not_negative, split_list};
use crate::terminal::usage;

/// The name of the estimate that integrates the data set's IMU.
pub(crate) const IMU_EULER: &str = "imu-euler";

/// Which pose streams are evaluated, and how their poses are read.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Pose streams")]
pub(crate) struct StreamArgs {
    /// Estimates to evaluate: names of streams, imu-euler, or files.
    #[arg(long, value_name = "NAME|FILE,...", required = true)]
    pub(crate) estimate: Vec<String>,
    /// What they are compared with, or none [default: ground-truth where there is one].
    #[arg(long, value_name = "NAME|FILE|none")]
    pub(crate) reference: Option<String>,
    /// Whose poses the files give: body, camera, or a file with body_from_estimate (4x4).
    #[arg(long, value_name = "body|camera|FILE", default_value = "body")]
    pub(crate) estimate_frame: String,
    /// What the estimates are, where they were read as something else: inverse, wxyz, conjugate, camera, mm, ned, ...
    #[arg(long, value_name = "WHAT,...", value_delimiter = ',')]
    pub(crate) estimate_as: Vec<Convention>,
    /// Times of KITTI files [default: times.txt beside each].
    #[arg(long, value_name = "FILE")]
    pub(crate) times: Option<PathBuf>,
    /// Seconds added to the stamps of the estimates [default: 0, or what --calibration says].
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = span)]
    pub(crate) time_offset: Option<Span>,
    /// Widest gap between two poses that is interpolated, seconds.
    #[arg(long, value_name = "S", default_value = "0.1", value_parser = span_not_negative)]
    pub(crate) max_gap: Span,
    /// What places the camera in the world for floor and Z-map depth [default: the reference where there is one].
    #[arg(long, value_name = "reference|estimate", value_parser = ["reference", "estimate"])]
    pub(crate) anchor: Option<String>,
    /// Pose world_from_body of the anchoring estimate at the first key frame, where its own world has no floor.
    #[arg(long, value_name = "X,Y,Z,QX,QY,QZ,QW", allow_hyphen_values = true, value_parser = numbers::<7>)]
    pub(crate) initial_pose: Option<[f64; 7]>,
}

/// The streams, the reference first, and which of them is the anchor.
pub(crate) struct LoadedStreams {
    pub(crate) list: Vec<Stream>,
    pub(crate) anchor: usize,
    pub(crate) time_offset: Span,
    /// The integration behind a stream, by its index.
    inertial: Option<(usize, InertialRun)>,
}

impl LoadedStreams {
    /// How a stream was integrated, where it was.
    pub(crate) fn inertial_run(&self, stream: usize) -> Option<&InertialRun> {
        self.inertial.as_ref().filter(|(index, _)| *index == stream).map(|(_, run)| run)
    }
}

pub(crate) fn load_streams(
    args: &StreamArgs,
    dataset: &dyn Dataset,
    used: &UsedCamera,
    selection: &Selection<'_>,
    calibration: Option<&CalibrationFile>,
    world_depth: bool,
) -> anyhow::Result<LoadedStreams> {
    let time_offset = args.time_offset.or(calibration.and_then(|c| c.time_offset)).unwrap_or(Span::ZERO);
    let mut loader = Loader { args, dataset, used, selection, time_offset, world_depth, reference: None };
    loader.reference = loader.load_reference()?;
    let mut list: Vec<Stream> = loader.reference.iter().cloned().collect();
    let mut inertial = None;
    for name in split_list(&args.estimate) {
        let trajectory = match name == IMU_EULER && !loader.is_stream(&name) {
            true => {
                if !args.estimate_as.is_empty() {
                    return Err(usage(format!(
                        "--estimate-as says nothing of {IMU_EULER}, which is integrated here"
                    )));
                }
                let run = loader.imu_euler()?;
                let trajectory = run
                    .integrate(Span::ZERO, Vector3::zeros())
                    .with_context(|| format!("--estimate {IMU_EULER}"))?;
                inertial = Some((list.len(), run));
                trajectory
            }
            false => loader.estimate(&name)?,
        };
        let stream = Stream { name: stream_name(&name, &list), role: Role::Estimate, trajectory };
        if let (Some(reference), false) = (&loader.reference, name == IMU_EULER) {
            warn_of_rotation(reference, &stream, args.max_gap);
        }
        list.push(stream);
    }
    // A command that does not ask for estimates may do with the reference.
    if !args.estimate.is_empty() && list.iter().all(|s| s.role == Role::Reference) {
        return Err(usage("--estimate: no estimate is named"));
    }
    let anchor = loader.anchor(&mut list)?;
    // An initial pose moves the anchor to another world than it was integrated in.
    let inertial = inertial.filter(|(index, _)| args.initial_pose.is_none() || *index != anchor);
    Ok(LoadedStreams { list, anchor, time_offset, inertial })
}

struct Loader<'a> {
    args: &'a StreamArgs,
    dataset: &'a dyn Dataset,
    used: &'a UsedCamera,
    selection: &'a Selection<'a>,
    time_offset: Span,
    /// Whether a depth source asks where the camera is in the world.
    world_depth: bool,
    reference: Option<Stream>,
}

impl Loader<'_> {
    fn load_reference(&self) -> anyhow::Result<Option<Stream>> {
        let has_truth = self.dataset.streams().iter().any(|s| s == GROUND_TRUTH);
        let name = match self.args.reference.as_deref() {
            Some("none") => return Ok(None),
            Some(name) => name,
            None if has_truth => GROUND_TRUTH,
            None => return Ok(None),
        };
        let trajectory = match self.is_stream(name) {
            true => self.dataset.trajectory(name)?,
            false => self.file(name, "--reference")?,
        };
        Ok(Some(Stream { name: stream_name(name, &[]), role: Role::Reference, trajectory }))
    }

    fn estimate(&self, name: &str) -> anyhow::Result<Trajectory> {
        let trajectory = match self.is_stream(name) {
            true => self.dataset.trajectory(name)?,
            false => self.to_body(self.file(name, "--estimate")?)?,
        };
        let trajectory = self.as_meant(trajectory)?;
        trajectory.shifted(self.time_offset).with_context(|| format!("{name} with --time-offset"))
    }

    /// The poses that were meant. Said by the user, never guessed.
    fn as_meant(&self, trajectory: Trajectory) -> anyhow::Result<Trajectory> {
        if self.args.estimate_as.is_empty() {
            return Ok(trajectory);
        }
        let extrinsics = |stamp: Stamp| self.body_from_camera(stamp).ok();
        let first_frame = self.used.frames.first().copied();
        let given = Given { body_from_camera: Some(&extrinsics), first_frame };
        cure(&self.args.estimate_as, &trajectory, given)
            .with_context(|| format!("--estimate-as {}", list_text(&self.args.estimate_as)))
    }

    fn is_stream(&self, name: &str) -> bool {
        self.dataset.streams().iter().any(|s| s == name)
    }

    fn file(&self, spec: &str, option: &str) -> anyhow::Result<Trajectory> {
        let path = Path::new(spec.strip_prefix("rel:").unwrap_or(spec));
        if !path.exists() {
            let streams = self.dataset.streams();
            let streams = if streams.is_empty() { "none".to_string() } else { streams.join(", ") };
            anyhow::bail!(
                "{option}: {spec} is neither a file nor a stream of the data set (streams: {streams}, {IMU_EULER})"
            );
        }
        let options = ReadOptions { times: self.args.times.clone(), ..ReadOptions::default() };
        Ok(read_spec(spec, &options)?.trajectory)
    }

    /// Poses of a camera or another frame as poses of the body. Said by the user, never guessed.
    fn to_body(&self, trajectory: Trajectory) -> anyhow::Result<Trajectory> {
        match self.args.estimate_frame.as_str() {
            "body" => Ok(trajectory),
            "camera" => {
                let poses: Vec<(Stamp, WorldFromBody)> = trajectory
                    .iter()
                    .map(|(stamp, pose)| {
                        let world_from_camera: WorldFromCamera = pose.reinterpret();
                        Ok((stamp, world_from_camera * self.body_from_camera(stamp)?.inverse()))
                    })
                    .collect::<anyhow::Result<_>>()?;
                Ok(Trajectory::from_poses(poses)?)
            }
            file => {
                let body_from_estimate: Rigid<Body, Sensor> = rigid_file::read(file)?;
                let estimate_from_body = body_from_estimate.inverse();
                Ok(trajectory.map_poses(|_, pose| pose.reinterpret() * estimate_from_body))
            }
        }
    }

    fn body_from_camera(&self, stamp: Stamp) -> anyhow::Result<BodyFromCamera> {
        match self.used.body_from_camera {
            Some(fixed) => Ok(fixed),
            None => Ok(self.dataset.body_from_camera(&self.used.name, stamp)?),
        }
    }

    /// Euler integration of the IMU from the reference state at the first key frame to the last evaluated frame.
    fn imu_euler(&self) -> anyhow::Result<InertialRun> {
        let samples = self.dataset.imu()?;
        anyhow::ensure!(!samples.is_empty(), "--estimate {IMU_EULER}: the data set has no inertial samples");
        let reference = self.reference.as_ref().ok_or_else(|| {
            usage(format!("--estimate {IMU_EULER} starts from a reference state: give --reference"))
        })?;
        let start = self.selection.first_keyframe().context("there is no key frame to start from")?;
        let (_, last) =
            self.selection.stamp_range(&self.used.frames).context("there is no frame to integrate to")?;
        let state = self.start_state(reference, start)?;
        // The clock of the samples is what is off: shifted afterwards, the states would miss the key frame.
        let shifted = |s: &ImuSample| ImuSample { stamp: s.stamp + self.time_offset, ..*s };
        let samples: Vec<ImuSample> = samples.iter().map(shifted).collect();
        warn_of_gap(&samples, start, last, self.args.max_gap);
        // A little beyond, so that the last frame lies between two states.
        let end = last + Span::from_millis(1000);
        Ok(InertialRun { samples, start: state, end, gravity_m_s2: GRAVITY_Z_UP_M_S2 })
    }

    fn start_state(&self, reference: &Stream, stamp: Stamp) -> anyhow::Result<InertialState> {
        if reference.name == GROUND_TRUTH
            && self.is_stream(GROUND_TRUTH)
            && let Some(state) = self.dataset.inertial_state(stamp)?
        {
            return Ok(state);
        }
        let context = || {
            format!("--estimate {IMU_EULER}: the reference has no state at the first key frame, {stamp} ns")
        };
        Ok(InertialState {
            stamp,
            world_from_body: reference.trajectory.pose_at(stamp, self.args.max_gap).with_context(context)?,
            velocity_m_s: fit_velocity(&reference.trajectory, stamp).with_context(context)?,
            gyro_bias_rad_s: Vector3::zeros(),
            accel_bias_m_s2: Vector3::zeros(),
        })
    }

    /// An estimate that places the camera by itself must know where the floor is. Chained motions start anywhere.
    fn check_own_world(&self) -> anyhow::Result<()> {
        let spec = split_list(&self.args.estimate).into_iter().next().unwrap_or_default();
        if !self.world_depth {
            return Ok(());
        }
        if spec.starts_with("rel:") || self.dataset.is_relative(&spec) {
            return Err(usage(format!(
                "{spec} places the camera for depth, but relative motions have no place in the world: give --initial-pose \
                 (or --depth zcam)"
            )));
        }
        tracing::warn!(
            "{spec} itself places the camera for depth: the floor or cloud must be in its world (else give --initial-pose)"
        );
        Ok(())
    }

    /// Which stream places the camera; an initial pose moves its world.
    fn anchor(&self, list: &mut [Stream]) -> anyhow::Result<usize> {
        let has_reference = self.reference.is_some();
        let anchor = match self.args.anchor.as_deref() {
            Some("reference") if !has_reference => {
                return Err(usage(
                    "--anchor reference: there is no reference; give --reference or --anchor estimate",
                ));
            }
            Some("estimate") => usize::from(has_reference),
            _ => 0,
        };
        let Some([x, y, z, qx, qy, qz, qw]) = self.args.initial_pose else {
            if list[anchor].role == Role::Estimate {
                self.check_own_world()?;
            }
            return Ok(anchor);
        };
        if list[anchor].role == Role::Reference {
            return Err(usage(
                "--initial-pose places an estimate: it needs --anchor estimate or --reference none",
            ));
        }
        let wanted = WorldFromBody::try_from_parts([x, y, z], [qw, qx, qy, qz])
            .map_err(|e| usage(format!("--initial-pose: {e}")))?;
        let start = self.selection.first_keyframe().context("there is no key frame for --initial-pose")?;
        let now = list[anchor].trajectory.pose_at(start, self.args.max_gap).with_context(|| {
            format!("--initial-pose: {} has no pose at the first key frame", list[anchor].name)
        })?;
        list[anchor].trajectory = in_other_world(&(wanted * now.inverse()), &list[anchor].trajectory);
        Ok(anchor)
    }
}

/// A file's stem, or the stream's own name; told apart by a number where two are alike.
fn stream_name(spec: &str, taken: &[Stream]) -> String {
    let path = Path::new(spec.strip_prefix("rel:").unwrap_or(spec));
    let stem = match path.extension() {
        Some(_) if path.exists() => path.file_stem().and_then(|s| s.to_str()).unwrap_or(spec),
        _ => spec,
    };
    let is_taken = |name: &str| taken.iter().any(|s| s.role == Role::Estimate && s.name == name);
    (1_usize..)
        .map(|n| if n == 1 { stem.to_string() } else { format!("{stem}-{n}") })
        .find(|name| !is_taken(name))
        .unwrap_or_else(|| stem.to_string())
}

/// A sample is held across a gap, which no robot does.
fn warn_of_gap(samples: &[ImuSample], start: Stamp, end: Stamp, max_gap: Span) {
    let gaps = samples.windows(2).map(|w| (w[0].stamp, w[1].stamp.since(w[0].stamp)));
    let inside = gaps.filter(|(at, gap)| *gap > max_gap && *at + *gap > start && *at < end);
    if let Some((at, gap)) = inside.max_by_key(|(_, gap)| *gap) {
        tracing::warn!(
            "{IMU_EULER}: the inertial samples have a gap of {gap} after {at} ns; a sample is held across it"
        );
    }
}

/// A constant rotation between the bodies is never corrected, but said.
fn warn_of_rotation(reference: &Stream, estimate: &Stream, max_gap: Span) {
    let matching = Matching::Interpolate { max_gap };
    let Ok(pairs) = PosePairs::match_up(&reference.trajectory, &estimate.trajectory, matching, Span::ZERO)
    else {
        return;
    };
    let Some(offset) = RotationOffset::find(&pairs).filter(RotationOffset::is_suspicious) else { return };
    let axis = offset.axis().unwrap_or_else(Vector3::z);
    tracing::warn!(
        "the body of {} seems to be turned against that of {} by {:.2} degrees about [{:.3}, {:.3}, {:.3}]; if its poses are \
         not those of the body, say so with --estimate-frame",
        estimate.name,
        reference.name,
        offset.angle_rad().to_degrees(),
        axis.x,
        axis.y,
        axis.z
    );
}
