//! What the pass over a recording keeps of a topic: where its images are, its poses, its calibrations.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Matrix6;
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::PoseCovariance;

use crate::container::Locator;
use crate::doubts::{LEFT_OUT, TWO_SOURCES};
use crate::lenient::Tally;
use crate::message::{CameraInfo, FramedPose};
use crate::pixels::Packing;
use crate::tf::{CLOCK_JUMP, Transform};
use crate::wire::Header;

/// The images of a topic.
#[derive(Debug)]
pub(crate) struct ImageTopic {
    pub(crate) packing: Packing,
    /// Stamps and places, in the order of the recording.
    pub(crate) frames: Vec<(Stamp, Locator)>,
    /// Frame of the first image.
    pub(crate) frame: String,
    /// Encoding of the first image.
    pub(crate) encoding: String,
    /// Columns and rows of the first image, where its message says them: not where it is compressed.
    pub(crate) size_px: Option<(u32, u32)>,
    /// The sizes there are, and how many images have them.
    pub(crate) sizes_px: BTreeMap<(u32, u32), u64>,
    /// How many have a zero stamp.
    pub(crate) unstamped: u64,
    /// How many name another frame than the first.
    pub(crate) other_frames: u64,
    /// The first jump back of the clock, and how many there are.
    pub(crate) jump: Option<(Stamp, Stamp, Locator)>,
    pub(crate) jumps: u64,
}

impl ImageTopic {
    /// A topic before its first image.
    pub(crate) fn new(packing: Packing, header: &Header<'_>, encoding: &str) -> Self {
        Self {
            packing,
            frames: Vec::new(),
            frame: header.frame.to_string(),
            encoding: encoding.to_string(),
            size_px: None,
            sizes_px: BTreeMap::new(),
            unstamped: 0,
            other_frames: 0,
            jump: None,
            jumps: 0,
        }
    }

    /// Adds an image.
    pub(crate) fn add(&mut self, stamp: Stamp, frame: &str, size_px: Option<(u32, u32)>, locator: Locator) {
        if stamp.as_nanos() == 0 {
            self.unstamped += 1;
            return;
        }
        self.other_frames += u64::from(self.frame != frame);
        if let Some(size_px) = size_px {
            self.size_px.get_or_insert(size_px);
            *self.sizes_px.entry(size_px).or_default() += 1;
        }
        if let Some(&(last, _)) = self.frames.last()
            && last.since(stamp) >= CLOCK_JUMP
        {
            self.jump.get_or_insert((last, stamp, locator));
            self.jumps += 1;
        }
        self.frames.push((stamp, locator));
    }
}

/// The poses of a topic.
#[derive(Debug)]
pub(crate) struct PoseTopic {
    /// In which frame.
    pub(crate) parent: String,
    /// Whose poses; empty where the messages do not say.
    pub(crate) child: String,
    pub(crate) poses: Vec<(Stamp, Transform)>,
    pub(crate) covariances: Vec<PoseCovariance>,
    pub(crate) unstamped: u64,
    /// Poses of other frames, as `child in parent`, and how many.
    others: BTreeMap<String, u64>,
    tally: Tally,
}

impl PoseTopic {
    /// A topic before its first pose.
    pub(crate) fn new(pose: &FramedPose<'_>) -> Self {
        Self {
            parent: pose.header.frame.to_string(),
            child: pose.child.to_string(),
            poses: Vec::new(),
            covariances: Vec::new(),
            unstamped: 0,
            others: BTreeMap::new(),
            tally: Tally::default(),
        }
    }

    /// Adds a pose and says whether it is kept; one of other frames than the first is another source's, and only counted.
    pub(crate) fn add(&mut self, stamp: Stamp, pose: &FramedPose<'_>) -> bool {
        let (parent, child) = (pose.header.frame, pose.child);
        if self.parent != parent || self.child != child {
            let of = if child.is_empty() { String::new() } else { format!("{child} ") };
            *self.others.entry(format!("{of}in {parent}")).or_default() += 1;
            return false;
        }
        if stamp.as_nanos() == 0 {
            self.unstamped += 1;
            return false;
        }
        let taken = self.tally.take(&pose.parent_from_child);
        self.poses.extend(taken.map(|transform| (stamp, transform)));
        taken.is_some()
    }

    /// Keeps what a message says of its pose, where that is not what the one before said: most say one thing for ever.
    pub(crate) fn says(&mut self, stamp: Stamp, rows: Option<[f64; 36]>) {
        let Some(matrix) = rows.map(|rows| Matrix6::from_row_slice(&rows)) else { return };
        if self.covariances.last().is_none_or(|last| last.matrix != matrix) {
            self.covariances.push(PoseCovariance { stamp, matrix });
        }
    }

    /// What is wrong with a topic of this name, before anything is made of its poses.
    pub(crate) fn doubts(&self, name: &str) -> Vec<Suspicion> {
        let about = format!("topic {name}");
        let mut doubts = self.tally.doubts(&about);
        if self.unstamped > 0 {
            let message = format!("{} poses with a zero stamp are left out", self.unstamped);
            doubts.push(
                Suspicion::new(LEFT_OUT, about.as_str(), message)
                    .times(self.unstamped)
                    .advice("`--set stamps=record` takes the time of recording"),
            );
        }
        if !self.others.is_empty() {
            let n: u64 = self.others.values().sum();
            let of = if self.child.is_empty() { String::new() } else { format!("{} ", self.child) };
            let others: Vec<&str> = self.others.keys().map(String::as_str).collect();
            let message =
                format!("{n} poses of other frames are left out: those {of}in {} are kept", self.parent);
            doubts.push(
                Suspicion::new(TWO_SOURCES, about, message)
                    .evidence(crate::tf::list(&others))
                    .advice("two sources publish the topic: record only one of them")
                    .times(n),
            );
        }
        doubts
    }
}

/// The calibrations of a topic: the first that is one, and how many later ones differ from it.
#[derive(Clone, Debug)]
pub(crate) struct InfoTopic {
    pub(crate) info: CameraInfo,
    pub(crate) changes: u64,
    /// The first that differs.
    other: Option<CameraInfo>,
}

impl InfoTopic {
    pub(crate) const fn new(info: CameraInfo) -> Self {
        Self { info, changes: 0, other: None }
    }

    /// Adds a later message.
    pub(crate) fn add(&mut self, info: CameraInfo) {
        if self.info == info {
            return;
        }
        // A driver that has not read its calibration yet sends zeros.
        if !self.info.is_calibrated() && info.is_calibrated() {
            self.info = info;
            return;
        }
        if info.is_calibrated() {
            self.changes += 1;
            self.other.get_or_insert(info);
        }
    }

    /// What is wrong with a topic of this name.
    pub(crate) fn doubt(&self, name: &str) -> Option<Suspicion> {
        let other = self.other.as_ref()?;
        let message = format!("the calibration changes {} times: the first is taken", self.changes);
        let doubt = Suspicion::new("camera-info-changes", format!("topic {name}"), message);
        Some(doubt.evidence(self.info.difference(other)).times(self.changes).advice(
            "a camera that zooms or two cameras on one topic: cut the recording, or give a calibration file",
        ))
    }
}

/// How long after their stamps the messages of a topic were recorded: the least and the most.
#[derive(Debug, Default)]
pub(crate) struct Delays(BTreeMap<usize, Delay>);

impl Delays {
    /// Adds a message of a topic.
    pub(crate) fn add(&mut self, topic: usize, stamp: Stamp, recorded: Stamp) {
        if stamp.as_nanos() != 0 && recorded.as_nanos() != 0 {
            let delay = recorded.since(stamp);
            self.0.entry(topic).or_insert_with(|| Delay::new(delay)).add(stamp, delay);
        }
    }

    /// The least and the most of a topic.
    pub(crate) fn of(&self, topic: usize) -> Option<(Span, Span)> {
        self.0.get(&topic).map(|d| (d.least, d.most))
    }

    /// By how much the least delay grew from the first messages of a topic to its last ones, and the time between; `None`
    /// for few messages. The least of many is what the clocks differ by: queues only add to it.
    pub(crate) fn drift(&self, topic: usize) -> Option<(Span, Span)> {
        let delay = self.0.get(&topic).filter(|d| d.count > 4 * WINDOW)?;
        let last = delay.last.iter().min_by_key(|(_, delay)| *delay)?;
        Some((last.1 - delay.first.1, last.0.since(delay.first.0)))
    }
}

/// Messages at either end of a topic whose least delays are compared.
const WINDOW: usize = 50;

/// How long after its stamp a topic's messages were recorded.
#[derive(Debug)]
struct Delay {
    least: Span,
    most: Span,
    count: usize,
    /// Stamp and delay of the least of the first ones.
    first: (Stamp, Span),
    /// Stamps and delays of the last ones.
    last: VecDeque<(Stamp, Span)>,
}

impl Delay {
    fn new(delay: Span) -> Self {
        Self {
            least: delay,
            most: delay,
            count: 0,
            first: (Stamp::from_nanos(0), delay),
            last: VecDeque::new(),
        }
    }

    fn add(&mut self, stamp: Stamp, delay: Span) {
        self.least = self.least.min(delay);
        self.most = self.most.max(delay);
        if self.count == 0 || (self.count < WINDOW && delay < self.first.1) {
            self.first = (stamp, delay);
        }
        self.count += 1;
        if self.last.len() == WINDOW {
            self.last.pop_front();
        }
        self.last.push_back((stamp, delay));
    }
}
