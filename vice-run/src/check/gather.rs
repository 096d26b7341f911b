//! What a recording has, read as far as it can be, and the checks on it.

use std::sync::Arc;

use vice_core::check::clock::{ClockDoubt, ClockOffset, clock_offset};
use vice_core::check::moved::{self, Seen};
use vice_core::check::turning::Turning;
use vice_core::check::{
    Finding, State, clock, covariance, coverage, inertial, loops, motion, optics, path, stamps,
};
use vice_core::conventions::Given;
use vice_core::dataset::{Dataset, GROUND_TRUTH};
use vice_core::error::{ErrorKind, one_line};
use vice_core::frames::BodyFromCamera;
use vice_core::imu::ImuSample;
use vice_core::result::Role;
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;

use super::CheckRequest;
use super::cloud::World3d;
use super::{cloud, images, stereo, turns};
use crate::error::{RunError, RunResult};
use crate::formats;
use crate::open::Opened;
use crate::progress::Progress;

/// The name of findings about what was repaired, left out or cannot be read.
const READING: &str = "reading";
/// Clocks are compared pair by pair for this many sources, and with the first source beyond.
const ALL_PAIRS: usize = 6;
/// The word for the inertial samples.
pub(super) const IMU: &str = "imu";

/// What there is to look at.
pub(super) struct Gathered {
    dataset: Arc<dyn Dataset>,
    camera: Option<String>,
    cameras: Vec<String>,
    imu: Arc<[ImuSample]>,
    /// Pose streams, the reference first where there is one.
    streams: Vec<PoseStream>,
    max_gap: Span,
    /// What cannot be read, and what readers say.
    read: Vec<Finding>,
    suspicions: Suspicions,
    /// An earlier recording of the same rig.
    earlier: Option<Box<Gathered>>,
}

/// How cameras lie in the body, by their names.
type Seens = Vec<(String, Seen)>;

struct PoseStream {
    name: String,
    trajectory: Trajectory,
    is_reference: bool,
    /// Whether floor and cloud are in its world: the data set's own ground truth.
    is_truth: bool,
}

/// Reads what is small of a recording that is open.
pub(super) fn gather(request: &CheckRequest, raw: Arc<dyn Dataset>) -> RunResult<Gathered> {
    let spec = &request.dataset;
    let mut read = Vec::new();
    let opened = match spec.apply_to(Arc::clone(&raw)) {
        Ok(opened) => Some(opened),
        // What the user says is not to be passed over.
        Err(error) if error.kind() == ErrorKind::Usage || spec.calibration.is_some() => return Err(error),
        Err(error) => {
            // The data set says by itself why it has none.
            if !raw.suspicions().iter().any(|s| s.code == "no-camera") {
                read.push(unread("camera", &error));
            }
            None
        }
    };
    let dataset = opened.as_ref().map_or(raw, |o| Arc::clone(&o.dataset));
    gather_of(request, dataset, opened.as_ref(), read)
}

/// Reads what is small of a recording that is open with its overrides.
pub(super) fn gather_opened(request: &CheckRequest, opened: &Opened) -> RunResult<Gathered> {
    gather_of(request, Arc::clone(&opened.dataset), Some(opened), Vec::new())
}

fn gather_of(
    request: &CheckRequest,
    dataset: Arc<dyn Dataset>,
    opened: Option<&Opened>,
    read: Vec<Finding>,
) -> RunResult<Gathered> {
    let spec = &request.dataset;
    let camera = opened.map(|o| o.camera_name.clone());
    let mut gathered = Gathered {
        cameras: match &camera {
            Some(camera) if spec.camera.is_some() => vec![camera.clone()],
            _ => dataset.cameras(),
        },
        camera,
        imu: Arc::new([]),
        streams: Vec::new(),
        max_gap: request.streams.max_gap,
        read,
        suspicions: Suspicions::new(),
        earlier: None,
        dataset,
    };
    match gathered.dataset.imu() {
        Ok(imu) => gathered.imu = imu,
        Err(error) => gathered.read.push(unread(IMU, &error)),
    }
    gathered.streams(request, opened)?;
    if let Some(opened) = opened {
        gathered.suspicions.extend(opened.suspicions());
    }
    if let Some(spec) = &request.before {
        let raw = spec.open_raw(&formats::registry(&spec.plugins)?).map_err(|e| e.of("before"))?;
        let earlier = CheckRequest { dataset: spec.clone(), ..CheckRequest::default() };
        gathered.earlier = Some(Box::new(gather(&earlier, raw)?));
    }
    Ok(gathered)
}

/// Something that cannot be read.
fn unread(about: &str, error: &dyn std::error::Error) -> Finding {
    Finding::new(READING, about, State::Look, format!("cannot be used: {}", one_line(error)))
}

impl Gathered {
    pub(super) fn name(&self) -> &str {
        self.dataset.name()
    }

    pub(super) fn format(&self) -> &str {
        self.dataset.format()
    }

    fn streams(&mut self, request: &CheckRequest, opened: Option<&Opened>) -> RunResult<()> {
        let mut named = Vec::new();
        match opened {
            Some(opened) => {
                let mut spec = request.streams.clone();
                // A ground truth that cannot be read is a finding, unless someone asked for it.
                let truth_fails = spec.reference == crate::request::ReferenceSpec::Default
                    && self.dataset.streams().iter().any(|s| s == GROUND_TRUTH)
                    && self.dataset.trajectory(GROUND_TRUTH).is_err();
                if truth_fails {
                    spec.reference = crate::request::ReferenceSpec::None;
                }
                let given = spec.load_given(opened)?;
                self.suspicions.extend(given.suspicions);
                for stream in given.list {
                    let is_reference = stream.role == Role::Reference;
                    named.push(PoseStream {
                        is_truth: is_reference && stream.name == GROUND_TRUTH,
                        is_reference,
                        name: stream.name,
                        trajectory: stream.trajectory,
                    });
                }
            }
            None if request.streams.estimates.is_empty() => {}
            None => {
                return Err(RunError::missing(
                    "the recording has no camera that can be used, so that no estimate is loaded for it",
                )
                .of("estimate")
                .advise("leave `estimate` out, or compare two files with `vice clock`"));
            }
        }
        // Names as they were asked for: a stream that is named is there already.
        let asked: Vec<String> = request.streams.estimates.iter().map(ToString::to_string).collect();
        for name in self.dataset.streams() {
            if named.iter().any(|s| s.name == name) || asked.contains(&name) {
                continue;
            }
            match self.dataset.trajectory(&name) {
                Ok(trajectory) => named.push(PoseStream {
                    is_truth: name == GROUND_TRUTH,
                    is_reference: name == GROUND_TRUTH && !named.iter().any(|s| s.is_reference),
                    name,
                    trajectory,
                }),
                Err(error) => self.read.push(unread(&name, &error)),
            }
        }
        named.sort_by_key(|s| !s.is_reference);
        self.streams = named;
        Ok(())
    }

    /// All findings; those that need pictures where there is someone to tell how far that is.
    pub(super) fn findings(&self, images: Option<&Progress<'_>>) -> Vec<Finding> {
        let mut found = self.read.clone();
        self.stamps(&mut found);
        self.calibration(&mut found);
        for stream in &self.streams {
            found.extend(path::path(&stream.name, &stream.trajectory));
        }
        let offsets = self.clocks(&mut found);
        self.motions(&mut found, &offsets);
        self.inertial(&mut found, &offsets);
        found.extend(self.dataset.checks());
        if let Some(progress) = images {
            self.pictures(&mut found, progress);
        }
        // Asked last: readers doubt while they read.
        let mut suspicions: Suspicions = self.dataset.suspicions().into_iter().collect();
        suspicions.extend(self.suspicions.iter().cloned());
        found.extend(suspicions.iter().map(doubted));
        found
    }

    fn stamps(&self, found: &mut Vec<Finding>) {
        for camera in &self.cameras {
            match self.dataset.frames(camera) {
                Ok(frames) => found.push(stamps::stamps(camera, "frame", &frames)),
                Err(error) => found.push(unread(camera, &error)),
            }
        }
        if !self.imu.is_empty() {
            let own: Vec<Stamp> = self.imu.iter().map(|s| s.stamp).collect();
            found.push(stamps::stamps(IMU, "sample", &own));
        }
        for stream in &self.streams {
            found.push(stamps::stamps(&stream.name, "pose", stream.trajectory.stamps()));
        }
        let Some(camera) = &self.camera else { return };
        let Ok(frames) = self.dataset.frames(camera) else { return };
        for stream in &self.streams {
            let poses = (stream.name.as_str(), &stream.trajectory);
            found.push(coverage::coverage((camera, &frames), poses, self.max_gap));
        }
    }

    fn calibration(&self, found: &mut Vec<Finding>) {
        for camera in &self.cameras {
            match self.dataset.camera(camera) {
                Ok(model) => found.extend(optics::intrinsics(camera, &model)),
                Err(error) => found.push(unread(camera, &error)),
            }
            let first = self.dataset.frames(camera).ok().and_then(|f| f.first().copied());
            match first.map(|stamp| self.dataset.body_from_camera(camera, stamp)) {
                Some(Ok(pose)) => found.push(optics::extrinsics(camera, &pose)),
                Some(Err(error)) => found.push(unread(camera, &error)),
                None => {}
            }
        }
    }

    fn pictures(&self, found: &mut Vec<Finding>, progress: &Progress<'_>) {
        if self.cameras.is_empty() {
            found.push(Finding::new("images", "", State::Unknown, "there is no camera"));
        }
        let anchor = self.streams.iter().find(|s| s.is_reference).map(|s| &s.trajectory);
        let world = World3d { anchor, max_gap: self.max_gap };
        let scan = cloud::read(self.dataset.as_ref(), found);
        for camera in &self.cameras {
            found.extend(images::look(self.dataset.as_ref(), camera, &world, scan.as_ref()));
        }
        let seen = self.turns(found, progress);
        if let Some(earlier) = &self.earlier {
            // Its other findings are its own.
            let before = earlier.turns(&mut Vec::new(), progress);
            for camera in &self.cameras {
                let of = |seen: &Seens| seen.iter().find(|(name, _)| name == camera).map(|(_, s)| s.clone());
                found.push(moved::moved(camera, of(&before).as_ref(), of(&seen).as_ref()));
            }
        }
        // Each against the first one: others follow.
        if let Some((first, others)) = self.cameras.split_first() {
            found.extend(others.iter().filter_map(|c| stereo::look(self.dataset.as_ref(), first, c)));
        }
    }

    /// Findings about how the cameras turn by their images, and how each lies in the body, where that is told.
    fn turns(&self, found: &mut Vec<Finding>, progress: &Progress<'_>) -> Seens {
        let turnings: Vec<Option<Turning>> =
            self.streams.iter().map(|s| Turning::of_poses(&s.trajectory)).collect();
        let gyro = Turning::of_gyro(&self.imu);
        let gyro =
            gyro.as_ref().map(|turning| turns::Source { name: IMU, turning, is_body: true, is_gyro: true });
        let streams = self.streams.iter().zip(&turnings).filter_map(|(stream, turning)| {
            let turning = turning.as_ref()?;
            Some(turns::Source { name: &stream.name, turning, is_body: stream.is_truth, is_gyro: false })
        });
        let sources: Vec<turns::Source<'_>> = gyro.into_iter().chain(streams).collect();
        let mut all = Seens::new();
        for camera in &self.cameras {
            let (said, seen) = turns::look(self.dataset.as_ref(), camera, &sources, progress);
            found.extend(said);
            all.extend(seen.map(|seen| (camera.clone(), seen)));
        }
        all
    }

    /// Findings about clocks, and the offset of each stream to the reference and to the IMU, where it is known.
    fn clocks(&self, found: &mut Vec<Finding>) -> Offsets {
        let mut sources: Vec<(&str, Turning)> = Vec::new();
        for stream in self.streams.iter().filter(|s| s.is_reference) {
            sources.extend(Turning::of_poses(&stream.trajectory).map(|t| (stream.name.as_str(), t)));
        }
        sources.extend(Turning::of_gyro(&self.imu).map(|t| (IMU, t)));
        for stream in self.streams.iter().filter(|s| !s.is_reference) {
            sources.extend(Turning::of_poses(&stream.trajectory).map(|t| (stream.name.as_str(), t)));
        }
        let mut offsets = Offsets::default();
        for (i, (a, reference)) in sources.iter().enumerate() {
            for (b, estimate) in &sources[i + 1..] {
                if i > 0 && sources.len() > ALL_PAIRS {
                    continue;
                }
                let answer = clock_offset(reference, estimate, None);
                found.push(clock::finding(a, b, &answer));
                offsets.0.push((a.to_string(), b.to_string(), answer));
            }
        }
        if sources.len() < 2 {
            let says = match sources.len() {
                0 => "there is no motion source: neither poses nor IMU".to_string(),
                _ => format!("{} is the only motion source: its clock cannot be compared", sources[0].0),
            };
            found.push(Finding::new(clock::CHECK.name, "", State::Unknown, says));
        }
        offsets
    }

    fn given<'a>(&'a self, extrinsics: &'a (dyn Fn(Stamp) -> Option<BodyFromCamera> + Sync)) -> Given<'a> {
        let first = self.camera.as_ref().and_then(|c| self.dataset.frames(c).ok()?.first().copied());
        Given { body_from_camera: self.camera.is_some().then_some(extrinsics), first_frame: first }
    }

    fn extrinsics(&self, stamp: Stamp) -> Option<BodyFromCamera> {
        self.dataset.body_from_camera(self.camera.as_ref()?, stamp).ok()
    }

    fn motions(&self, found: &mut Vec<Finding>, offsets: &Offsets) {
        let extrinsics = |stamp| self.extrinsics(stamp);
        let given = self.given(&extrinsics);
        let Some(reference) = self.streams.iter().find(|s| s.is_reference) else {
            if self.streams.len() > 1 || (self.streams.len() == 1 && self.imu.is_empty()) {
                let says = "there is no reference to compare the motion of pose streams with";
                found.push(
                    Finding::new(motion::CHECK.name, "", State::Unknown, says).mend("`reference` names one"),
                );
            }
            return;
        };
        for stream in self.streams.iter().filter(|s| !s.is_reference) {
            let offset = offsets.of(&reference.name, &stream.name);
            let (truth, own) =
                ((&*reference.name, &reference.trajectory), (&*stream.name, &stream.trajectory));
            found.extend(motion::motion(truth, own, offset, given));
            found.extend(loops::loops(truth, own, offset));
            let said = self.dataset.pose_covariances(&stream.name).unwrap_or_default();
            if !said.is_empty() {
                found.push(covariance::covariance(truth, own, &said, offset, self.max_gap));
            }
        }
    }

    fn inertial(&self, found: &mut Vec<Finding>, offsets: &Offsets) {
        if self.imu.is_empty() {
            found.push(Finding::new(
                inertial::CHECK.name,
                "",
                State::Unknown,
                "there are no inertial samples",
            ));
            return;
        }
        let extrinsics = |stamp| self.extrinsics(stamp);
        for stream in &self.streams {
            let offset = offsets.of(IMU, &stream.name);
            let poses = (stream.name.as_str(), &stream.trajectory);
            found.extend(inertial::inertial(
                &self.imu,
                poses,
                offset,
                stream.is_truth,
                self.given(&extrinsics),
            ));
        }
    }
}

/// Offsets of pairs of sources.
#[derive(Default)]
struct Offsets(Vec<(String, String, Result<ClockOffset, ClockDoubt>)>);

impl Offsets {
    /// What is added to the second one's stamps for the first one's clock; nothing where it is not known.
    fn of(&self, first: &str, second: &str) -> Span {
        let found = self.0.iter().find_map(|(a, b, answer)| {
            let offset = answer.as_ref().ok()?.span();
            match () {
                () if a == first && b == second => Some(offset),
                () if a == second && b == first => Some(-offset),
                () => None,
            }
        });
        found.unwrap_or(Span::ZERO)
    }
}

/// What a reader doubted, as a finding.
fn doubted(suspicion: &Suspicion) -> Finding {
    let mut says = format!("{}: {}", suspicion.code, suspicion.message);
    if !suspicion.evidence.is_empty() {
        says.push_str(&format!(": {}", suspicion.evidence));
    }
    Finding::new(READING, suspicion.about.as_str(), State::Look, says)
        .number("count", suspicion.count as f64, "")
        .mend(suspicion.advice.as_str())
}
