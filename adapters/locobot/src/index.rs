//! The index pass: what is small is decoded, what is large is found again.

use std::collections::BTreeMap;

use vice_core::error::DataError;
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;

use crate::container::{Encoding, Locator, Message, Recording, Topic, Visitor, Want};
use crate::doubts::DAMAGED;
use crate::message::{
    PoseKind, camera_info, compressed_head, framed_pose, image_head, path, pose_covariance, tf_message,
};
use crate::namespaces::Spaces;
use crate::pixels::Packing;
use crate::series::{Delays, ImageTopic, InfoTopic, PoseTopic};
use crate::settings::Stamps;
use crate::wire::{Reader, WireResult};

/// Bytes beyond which a robot description is refused.
const MAX_DESCRIPTION_BYTES: usize = 16 << 20;

/// What the index pass collects; topics by their number.
#[derive(Debug, Default)]
pub(crate) struct Index {
    pub(crate) images: BTreeMap<usize, ImageTopic>,
    pub(crate) poses: BTreeMap<usize, PoseTopic>,
    pub(crate) infos: BTreeMap<usize, InfoTopic>,
    /// The last message of each topic with paths.
    paths: BTreeMap<usize, LastPath>,
    /// The tf of each namespace that has some.
    pub(crate) spaces: Spaces,
    /// The URDFs that robots published.
    pub(crate) descriptions: BTreeMap<usize, String>,
    pub(crate) delays: Delays,
    /// The first message of a topic that could not be decoded, and how many.
    broken: BTreeMap<usize, (String, Locator, u64)>,
    /// By the number of the topic, of those that can be read.
    roles: BTreeMap<usize, Role>,
    stamps: Stamps,
}

/// The last message of a topic with paths, not decoded before it is known to be the last: each repeats the one before.
#[derive(Debug, Default)]
struct LastPath {
    bytes: Vec<u8>,
    encoding: Option<Encoding>,
    locator: Option<Locator>,
}

/// A pass over the messages of some topics.
pub(crate) struct Only<W, E> {
    /// Which topics.
    pub(crate) wanted: W,
    /// What to do with each message.
    pub(crate) each: E,
}

impl<W: FnMut(&Topic) -> bool, E: FnMut(&Message<'_>)> Visitor for Only<W, E> {
    fn want(&mut self, _: usize, info: &Topic) -> Want {
        if (self.wanted)(info) { Want::All } else { Want::Nothing }
    }

    fn message(&mut self, message: &Message<'_>) {
        (self.each)(message);
    }
}

#[derive(Clone, Copy, Debug)]
enum Role {
    None,
    Tf {
        fixed: bool,
        /// Which of the namespaces.
        space: usize,
    },
    Pose(PoseKind),
    Info,
    Image(Packing),
    Description,
}

impl Role {
    fn of(topic: &Topic, spaces: &mut Spaces) -> Self {
        let name = topic.name.as_str();
        match topic.kind.as_str() {
            "tf2_msgs/TFMessage" | "tf/tfMessage" => {
                Self::Tf { fixed: name.ends_with("tf_static"), space: spaces.of_topic(name) }
            }
            "sensor_msgs/CameraInfo" => Self::Info,
            "std_msgs/String" if name.ends_with("robot_description") => Self::Description,
            kind => match (Packing::of(kind), PoseKind::of(kind)) {
                (Some(packing), _) => Self::Image(packing),
                (_, Some(pose)) => Self::Pose(pose),
                _ => Self::None,
            },
        }
    }
}

impl Index {
    /// An empty index.
    pub(crate) fn new(stamps: Stamps) -> Self {
        Self { stamps, ..Self::default() }
    }

    fn decode(&mut self, message: &Message<'_>) -> WireResult<()> {
        let mut reader = Reader::new(message.bytes, message.encoding)?;
        let r = &mut reader;
        let by_record = self.stamps == Stamps::Record;
        let stamp_of = |header: Stamp| if by_record { message.recorded } else { header };
        match self.roles.get(&message.topic).copied().unwrap_or(Role::None) {
            Role::None => {}
            Role::Tf { fixed, space } => {
                let (tf, delays) = (&mut self.spaces.all[space].tf, &mut self.delays);
                tf_message(r, |t| match fixed {
                    true => tf.fix_raw(t.header.frame, t.child, &t.parent_from_child),
                    false => {
                        let stamp = stamp_of(t.header.stamp);
                        delays.add(message.topic, stamp, message.recorded);
                        tf.sample_raw(t.header.frame, t.child, stamp, &t.parent_from_child);
                    }
                })?;
            }
            // The last one holds the way as its author saw it in the end.
            Role::Pose(PoseKind::Path) => {
                let path = self.paths.entry(message.topic).or_default();
                path.bytes.clear();
                path.bytes.extend_from_slice(message.bytes);
                (path.encoding, path.locator) = (Some(message.encoding), Some(message.locator));
            }
            Role::Pose(kind) => {
                let pose = framed_pose(r, kind)?;
                let said = pose_covariance(r);
                let topic = self.poses.entry(message.topic).or_insert_with(|| PoseTopic::new(&pose));
                let stamp = stamp_of(pose.header.stamp);
                self.delays.add(message.topic, stamp, message.recorded);
                if topic.add(stamp, &pose) {
                    topic.says(stamp, said);
                }
            }
            Role::Info => {
                let info = camera_info(r)?;
                match self.infos.get_mut(&message.topic) {
                    Some(topic) => topic.add(info),
                    None => {
                        self.infos.insert(message.topic, InfoTopic::new(info));
                    }
                }
            }
            Role::Image(packing) => {
                let (header, encoding, size_px) = match packing {
                    Packing::Raw => image_head(r)
                        .map(|head| (head.header, head.encoding, Some((head.width, head.height))))?,
                    Packing::Compressed => {
                        compressed_head(r).map(|(header, format)| (header, format, None))?
                    }
                };
                let new = || ImageTopic::new(packing, &header, encoding);
                let topic = self.images.entry(message.topic).or_insert_with(new);
                let stamp = stamp_of(header.stamp);
                self.delays.add(message.topic, stamp, message.recorded);
                topic.add(stamp, header.frame, size_px, message.locator);
            }
            Role::Description => {
                if message.bytes.len() <= MAX_DESCRIPTION_BYTES {
                    self.descriptions.insert(message.topic, r.str()?.to_string());
                }
            }
        }
        Ok(())
    }

    /// Takes in what only the last message of a topic says. Asked once, after the pass.
    pub(crate) fn finish(&mut self) {
        for (topic, last) in std::mem::take(&mut self.paths) {
            let (Some(encoding), Some(locator)) = (last.encoding, last.locator) else { continue };
            let poses = &mut self.poses;
            let read = Reader::new(&last.bytes, encoding).and_then(|mut r| {
                path(&mut r, |pose| {
                    poses.entry(topic).or_insert_with(|| PoseTopic::new(&pose)).add(pose.header.stamp, &pose);
                })
            });
            if let Err(e) = read {
                self.broken.entry(topic).or_insert((e.0, locator, 1));
            }
        }
    }

    /// One doubt for each topic with messages that could not be decoded.
    pub(crate) fn broken(&self, recording: &Recording, topics: &[Topic]) -> Vec<Suspicion> {
        let doubt = |(topic, (problem, locator, n)): (&usize, &(String, Locator, u64))| {
            let name = &topics[*topic].name;
            let problem = format!("topic {name}: {n} messages are left out, the first since {problem}");
            let line = recording.place(locator, DataError::new(problem)).to_string();
            Suspicion::new(DAMAGED, "", line).times(1)
        };
        self.broken.iter().map(doubt).collect()
    }
}

impl Visitor for Index {
    fn want(&mut self, topic: usize, info: &Topic) -> Want {
        let role = Role::of(info, &mut self.spaces);
        self.roles.insert(topic, role);
        match role {
            Role::None => Want::Nothing,
            Role::Image(_) => Want::Head,
            _ => Want::All,
        }
    }

    fn message(&mut self, message: &Message<'_>) {
        if let Err(e) = self.decode(message) {
            let first = self.broken.entry(message.topic).or_insert_with(|| (e.0, message.locator, 0));
            first.2 += 1;
        }
    }
}
