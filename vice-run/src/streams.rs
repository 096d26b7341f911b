//! Pose streams: the reference and the estimates, by the data set's names or from files.

mod checked;
mod given;

use std::collections::BTreeSet;
use std::path::Path;

use nalgebra::Vector3;
use vice_core::conventions::{Convention, Given, cure};
use vice_core::dataset::{Dataset, GROUND_TRUTH};
use vice_core::depth::DepthSource;
use vice_core::diagnose::InertialRun;
use vice_core::evaluate::{Selection, Stream};
use vice_core::frames::{Body, Rigid, Sensor, WorldFromBody, WorldFromCamera};
use vice_core::metrics::align::Alignment;
use vice_core::metrics::associate::{Matching, PosePairs};
use vice_core::metrics::quaternion_order;
use vice_core::metrics::rotation_offset::RotationOffset;
use vice_core::result::Role;
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{Trajectory, in_other_world};
use vice_files::rigid_file;
use vice_files::trajectory::{ReadOptions, TrajectoryFormat};

use crate::error::{RunError, RunResult};
use crate::imu_start::ImuStart;
use crate::in_memory::own_name;
use crate::open::Opened;
use crate::place::Place;
use crate::request::{Anchor, EstimateFrame, EstimateSpec, IMU_EULER, ReferenceSpec, StreamsSpec};

/// The streams, the reference first, and which of them is the anchor.
pub struct LoadedStreams {
    /// The streams.
    pub list: Vec<Stream>,
    /// Index of the one that places the camera for depth.
    pub anchor: usize,
    /// Each stream places the camera for its own depth.
    pub own_anchors: bool,
    /// What was added to the stamps of the estimates.
    pub time_offset: Span,
    /// What looks wrong with them.
    pub suspicions: Suspicions,
    /// The integration behind a stream, by its index.
    inertial: Option<(usize, InertialRun)>,
}

impl LoadedStreams {
    /// How a stream was integrated, where it was.
    pub fn inertial_run(&self, stream: usize) -> Option<&InertialRun> {
        self.inertial.as_ref().filter(|(index, _)| *index == stream).map(|(_, run)| run)
    }
}

impl StreamsSpec {
    /// Loads the streams for the labels of a selection.
    ///
    /// # Errors
    /// [`RunError`] if a stream is not there, cannot be read or started, or a setting fits none of them.
    pub fn load(&self, opened: &Opened, selection: &Selection<'_>) -> RunResult<LoadedStreams> {
        let mut loader = Loader::new(self, opened, Some(selection));
        let time_offset = loader.time_offset;
        loader.reference = loader.load_reference()?;
        let mut list: Vec<Stream> = loader.reference.iter().cloned().collect();
        let mut inertial = None;
        for (place, spec) in self.estimates.iter().enumerate() {
            let integrates = *spec == EstimateSpec::ImuEuler && !loader.is_stream(IMU_EULER);
            let trajectory = if integrates {
                let run = loader.imu_euler()?;
                let trajectory = run
                    .integrate(Span::ZERO, Vector3::zeros())
                    .map_err(|e| RunError::usage("estimate", IMU_EULER.to_string()).because(e))?;
                inertial = Some((list.len(), run));
                trajectory
            } else {
                loader.estimate(spec)?
            };
            let name = self.names.get(place).cloned().unwrap_or_else(|| stream_name(spec, &list));
            // What starts in the reference's own state is in its world: moving it there would hide its drift.
            let align = integrates.then_some(Alignment::FirstPose);
            let stream = Stream { name, role: Role::Estimate, trajectory, time_offset, align };
            if let (Some(reference), false) = (&loader.reference, integrates) {
                loader.suspicions.extend(turned_body(reference, &stream, self.max_gap));
            }
            list.push(stream);
        }
        loader.check_used()?;
        let integrated = inertial.as_ref().map(|(index, _)| *index);
        loader.suspicions.extend(checked::wrong(opened, &list, integrated));
        let (anchor, own_anchors) = loader.anchor(&mut list)?;
        // An initial pose moves the anchor to another world than it was integrated in.
        let inertial = inertial.filter(|(index, _)| self.initial_pose.is_none() || *index != anchor);
        let suspicions = loader.suspicions;
        Ok(LoadedStreams { list, anchor, own_anchors, time_offset, suspicions, inertial })
    }

    /// Whether the estimates place the camera by themselves where a source asks for the world: refused where they cannot
    /// know it, and doubted where they may not.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage.
    pub fn check_world(
        &self,
        opened: &Opened,
        streams: &mut LoadedStreams,
        selection: &Selection<'_>,
        sources: &[&dyn DepthSource],
    ) -> RunResult<()> {
        let Some(stamp) = selection.first_keyframe() else { return Ok(()) };
        let floor = opened.dataset.floor(stamp)?;
        if self.initial_pose.is_some() || !sources.iter().any(|s| s.needs_world(&floor)) {
            return Ok(());
        }
        let placing = |index: usize| streams.own_anchors || index == streams.anchor;
        let list = streams.list.iter().enumerate();
        let estimates = list.filter(|(_, s)| s.role == Role::Estimate).zip(&self.estimates);
        let placing: Vec<&EstimateSpec> =
            estimates.filter(|((index, _), _)| placing(*index)).map(|(_, spec)| spec).collect();
        for spec in placing {
            streams.suspicions.add(own_world(opened, spec)?);
        }
        Ok(())
    }
}

/// What is to be said of an estimate that places the camera by itself.
fn own_world(opened: &Opened, spec: &EstimateSpec) -> RunResult<Suspicion> {
    if matches!(spec, EstimateSpec::Relative(_)) || opened.dataset.is_relative(&spec.to_string()) {
        return Err(RunError::usage(
            "depth",
            format!("{spec} places the camera for depth, but relative motions have no place in the world"),
        )
        .advise("give `initial-pose`, or `depth` zcam"));
    }
    Ok(Suspicion::new(
        "own-world",
        own_name(&spec.to_string()),
        "it places the camera for depth by itself: the floor or cloud must be in its world",
    )
    .advice("else give `initial-pose`"))
}

struct Loader<'a> {
    spec: &'a StreamsSpec,
    opened: &'a Opened,
    /// The labels, where something is scored.
    selection: Option<&'a Selection<'a>>,
    time_offset: Span,
    reference: Option<Stream>,
    /// Formats of the files that were read.
    formats: BTreeSet<&'static str>,
    suspicions: Suspicions,
}

impl<'a> Loader<'a> {
    fn new(spec: &'a StreamsSpec, opened: &'a Opened, selection: Option<&'a Selection<'a>>) -> Self {
        Self {
            spec,
            opened,
            selection,
            time_offset: spec.time_offset.or(opened.calibrated_time_offset()).unwrap_or(Span::ZERO),
            reference: None,
            formats: BTreeSet::new(),
            suspicions: Suspicions::new(),
        }
    }

    fn dataset(&self) -> &dyn Dataset {
        self.opened.dataset.as_ref()
    }

    fn load_reference(&mut self) -> RunResult<Option<Stream>> {
        let truth = EstimateSpec::Named(GROUND_TRUTH.to_string());
        let spec = match &self.spec.reference {
            ReferenceSpec::None => return Ok(None),
            ReferenceSpec::Named(spec) => spec.clone(),
            ReferenceSpec::Default if self.is_stream(GROUND_TRUTH) => truth,
            ReferenceSpec::Default => return Ok(None),
        };
        let trajectory = self.as_given(&spec, "reference")?;
        Ok(Some(Stream::new(stream_name(&spec, &[]), Role::Reference, trajectory)))
    }

    fn estimate(&mut self, spec: &EstimateSpec) -> RunResult<Trajectory> {
        let given = self.as_given(spec, "estimate")?;
        let trajectory = self.to_body(self.mended(given)?)?;
        trajectory
            .shifted(self.time_offset)
            .map_err(|e| RunError::usage("time-offset", format!("moves {spec} out of time")).because(e))
    }

    fn is_stream(&self, name: &str) -> bool {
        self.dataset().streams().iter().any(|s| s == name)
    }

    /// A stream of the data set, or else a file.
    fn as_given(&mut self, spec: &EstimateSpec, field: &'static str) -> RunResult<Trajectory> {
        let name = spec.to_string();
        if self.is_stream(&name) {
            return Ok(self.dataset().trajectory(&name)?);
        }
        if let Some(trajectory) = self.opened.in_memory.trajectory(&name)? {
            return Ok(trajectory.clone());
        }
        if !spec.is_file() {
            let streams = self.dataset().streams();
            let streams = if streams.is_empty() { "none".to_string() } else { streams.join(", ") };
            return Err(RunError::missing(format!(
                "{spec} is neither a file nor a stream of the data set (streams: {streams}, {IMU_EULER})"
            ))
            .of(field));
        }
        let options = ReadOptions { times: self.spec.times.clone(), ..ReadOptions::default() };
        let read = spec.read_file(&options)?;
        if read.format == TrajectoryFormat::Kitti {
            self.formats.insert("kitti");
        }
        self.suspicions.extend(read.suspicions);
        Ok(read.trajectory)
    }

    /// Poses of another convention as those that were meant.
    fn mended(&self, trajectory: Trajectory) -> RunResult<Trajectory> {
        if self.spec.estimate_as.is_empty() {
            return Ok(trajectory);
        }
        let camera = self.opened.camera_name.as_str();
        let extrinsics = |stamp| self.dataset().body_from_camera(camera, stamp).ok();
        let given =
            Given { body_from_camera: Some(&extrinsics), first_frame: self.opened.frames.first().copied() };
        cure(&self.spec.estimate_as, &trajectory, given).map_err(|e| RunError::from(e).of("estimate-as"))
    }

    /// Poses of a camera or another frame as poses of the body. Said by the user, never guessed.
    fn to_body(&self, trajectory: Trajectory) -> RunResult<Trajectory> {
        match &self.spec.estimate_frame {
            EstimateFrame::Body => Ok(trajectory),
            EstimateFrame::Camera => {
                let camera = self.opened.camera_name.as_str();
                let poses: Vec<(Stamp, WorldFromBody)> = trajectory
                    .iter()
                    .map(|(stamp, pose)| {
                        let world_from_camera: WorldFromCamera = pose.reinterpret();
                        let body_from_camera = self.dataset().body_from_camera(camera, stamp)?;
                        Ok((stamp, world_from_camera * body_from_camera.inverse()))
                    })
                    .collect::<RunResult<_>>()?;
                Trajectory::from_poses(poses).map_err(|e| {
                    RunError::usage("estimate-frame", "gives poses that cannot be used").because(e)
                })
            }
            EstimateFrame::File(file) => {
                let place = Place::of_file(file)?;
                let body_from_estimate: Rigid<Body, Sensor> = place.told(rigid_file::read(place.path()))?;
                let estimate_from_body = body_from_estimate.inverse();
                Ok(trajectory.map_poses(|_, pose| pose.reinterpret() * estimate_from_body))
            }
        }
    }

    /// Euler integration of the IMU from the reference state at the first key frame to the last evaluated frame.
    fn imu_euler(&mut self) -> RunResult<InertialRun> {
        let reference = self.reference.as_ref().ok_or_else(|| {
            RunError::usage("estimate", format!("{IMU_EULER} starts from a reference state"))
                .advise("give `reference`")
        })?;
        let selection = self.selection.ok_or_else(|| {
            RunError::usage(
                "estimate",
                format!("{IMU_EULER} starts at the first key frame, and there are no labels"),
            )
            .advise("the IMU itself is looked at without being named")
        })?;
        let start = ImuStart {
            dataset: self.opened.dataset.as_ref(),
            reference,
            time_offset: self.time_offset,
            max_gap: self.spec.max_gap,
        };
        let nothing = |what: &str| RunError::usage("estimate", format!("{IMU_EULER}: {what}"));
        let first =
            selection.first_keyframe().ok_or_else(|| nothing("there is no key frame to start from"))?;
        let (_, last) = selection
            .stamp_range(&self.opened.frames)
            .ok_or_else(|| nothing("there is no frame to integrate to"))?;
        let (run, gap) = start.run(first, last)?;
        self.suspicions.extend(gap);
        Ok(run)
    }

    /// Settings that changed nothing are mistakes.
    fn check_used(&self) -> RunResult<()> {
        if self.spec.times.is_some() && !self.formats.contains("kitti") {
            return Err(RunError::usage(
                "times",
                "no KITTI file is read, so that these times are of nothing",
            ));
        }
        let of_camera = self.spec.estimate_as.contains(&Convention::CameraAsBody);
        if of_camera && self.spec.estimate_frame != EstimateFrame::Body {
            return Err(RunError::usage(
                "estimate-as",
                "camera says what the frame of the estimates says already",
            )
            .advise("leave out one of `estimate-as` and `estimate-frame`"));
        }
        let all_integrated = self.spec.estimates.iter().all(|e| *e == EstimateSpec::ImuEuler);
        let moved = [
            ("estimate-frame", self.spec.estimate_frame != EstimateFrame::Body),
            ("estimate-as", !self.spec.estimate_as.is_empty()),
        ];
        if let Some((field, _)) = moved.into_iter().find(|(_, given)| *given && all_integrated) {
            return Err(RunError::usage(
                field,
                format!("{IMU_EULER} gives poses of the body, and no other estimate is asked for"),
            ));
        }
        Ok(())
    }

    /// Which stream places the camera, and whether each does so for itself; an initial pose moves its world.
    fn anchor(&self, list: &mut [Stream]) -> RunResult<(usize, bool)> {
        let has_reference = self.reference.is_some();
        let anchor = match &self.spec.anchor {
            Some(Anchor::Reference) if !has_reference => {
                return Err(RunError::usage("anchor", "there is no reference")
                    .advise("give `reference`, or `anchor` estimate"));
            }
            Some(Anchor::Estimate) => usize::from(has_reference),
            Some(Anchor::Stream(name)) => list.iter().position(|s| s.name == *name).ok_or_else(|| {
                let names: Vec<&str> = list.iter().map(|s| s.name.as_str()).collect();
                RunError::usage(
                    "anchor",
                    format!("there is no stream {name}; there are {}", names.join(", ")),
                )
            })?,
            Some(Anchor::Reference) | None => 0,
        };
        // Without a reference no estimate is better known than the others, and their order must not matter.
        let own = self.spec.anchor.is_none() && !has_reference && list.len() > 1;
        if anchor >= list.len() {
            return Err(RunError::usage(
                "estimate",
                "no pose stream is named and the data set has no ground truth",
            ));
        }
        let Some([x, y, z, qx, qy, qz, qw]) = self.spec.initial_pose else { return Ok((anchor, own)) };
        if list[anchor].role == Role::Reference {
            return Err(RunError::usage("initial-pose", "places an estimate")
                .advise("it needs `anchor` estimate or `reference` none"));
        }
        let wanted = WorldFromBody::try_from_parts([x, y, z], [qw, qx, qy, qz])
            .map_err(|e| RunError::usage("initial-pose", e.to_string()))?;
        let start = self
            .selection
            .and_then(Selection::first_keyframe)
            .ok_or_else(|| RunError::usage("initial-pose", "there is no key frame to put it at"))?;
        let moved = if own { &mut list[..] } else { &mut list[anchor..=anchor] };
        for stream in moved {
            let now = stream.trajectory.pose_at(start, self.spec.max_gap).map_err(|e| {
                RunError::usage("initial-pose", format!("{} has no pose at the first key frame", stream.name))
                    .because(e)
            })?;
            stream.trajectory = in_other_world(&(wanted * now.inverse()), &stream.trajectory);
        }
        Ok((anchor, own))
    }
}

/// What a stream is called where nothing else is said: a file's stem, or the stream's own name.
pub fn plain_name(spec: &EstimateSpec) -> String {
    let word = own_name(&spec.word()).to_string();
    let path = Path::new(&word);
    match path.extension() {
        Some(_) if spec.is_file() => path.file_stem().and_then(|s| s.to_str()).unwrap_or(&word).to_string(),
        _ => word,
    }
}

/// The same, told apart by a number where two are alike.
fn stream_name(spec: &EstimateSpec, taken: &[Stream]) -> String {
    let stem = plain_name(spec);
    let is_taken = |name: &str| taken.iter().any(|s| s.role == Role::Estimate && s.name == name);
    (1_usize..)
        .map(|n| if n == 1 { stem.clone() } else { format!("{stem}-{n}") })
        .find(|name| !is_taken(name))
        .unwrap_or_else(|| stem.clone())
}

/// A constant rotation between the bodies is never corrected, but said.
fn turned_body(reference: &Stream, estimate: &Stream, max_gap: Span) -> Option<Suspicion> {
    let matching = Matching::Interpolate { max_gap };
    let pairs =
        PosePairs::match_up(&reference.trajectory, &estimate.trajectory, matching, Span::ZERO).ok()?;
    if let Some(order) = quaternion_order::suspicion(&pairs, &estimate.name) {
        return Some(order);
    }
    let offset = RotationOffset::find(&pairs).filter(RotationOffset::is_suspicious)?;
    let axis = offset.axis().unwrap_or_else(Vector3::z);
    Some(
        Suspicion::new(
            "body-turned",
            &estimate.name,
            format!("its body seems to be turned against that of {}", reference.name),
        )
        .evidence(format!(
            "by {:.2} degrees about [{:.3}, {:.3}, {:.3}]",
            offset.angle_rad().to_degrees(),
            axis.x,
            axis.y,
            axis.z
        ))
        .advice("if its poses are not those of the body, say so with `estimate-frame`"),
    )
}
