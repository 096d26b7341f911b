//! The index pass: what is small is decoded, what is large is found again.

use std::collections::BTreeMap;

use vice_core::time::Stamp;

use crate::container::{Locator, Message, Recording, Topic, Visitor, Want};
use crate::message::{
    CameraInfo, PoseKind, camera_info, compressed_head, framed_pose, image_head, tf_message,
};
use crate::pixels::Packing;
use crate::settings::Stamps;
use crate::tf::{CLOCK_JUMP, TfBuilder, Transform};
use crate::wire::{Reader, WireResult};

/// Bytes beyond which a robot description is refused.
const MAX_DESCRIPTION_BYTES: usize = 16 << 20;

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
    /// How many have a zero stamp.
    pub(crate) unstamped: u64,
    pub(crate) jump: Option<(Stamp, Stamp, Locator)>,
}

/// The poses of a topic.
#[derive(Debug)]
pub(crate) struct PoseTopic {
    /// In which frame.
    pub(crate) parent: String,
    /// Whose poses; empty where the messages do not say.
    pub(crate) child: String,
    pub(crate) poses: Vec<(Stamp, Transform)>,
    pub(crate) unstamped: u64,
}

/// A calibration, the first of its topic, and how many later ones differ from it.
#[derive(Debug)]
pub(crate) struct InfoTopic {
    pub(crate) info: CameraInfo,
    pub(crate) changes: u64,
}

/// What the index pass collects; topics by their number.
#[derive(Debug, Default)]
pub(crate) struct Index {
    pub(crate) images: BTreeMap<usize, ImageTopic>,
    pub(crate) poses: BTreeMap<usize, PoseTopic>,
    pub(crate) infos: BTreeMap<usize, InfoTopic>,
    pub(crate) tf: TfBuilder,
    /// The URDF that the robot published.
    pub(crate) description: Option<String>,
    /// The first message of a topic that could not be decoded, and how many.
    pub(crate) broken: BTreeMap<usize, (String, Locator, u64)>,
    roles: Vec<Role>,
    stamps: Stamps,
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
    Tf { fixed: bool },
    Pose(PoseKind),
    Info,
    Image(Packing),
    Description,
}

impl Role {
    fn of(topic: &Topic) -> Self {
        let name = topic.name.as_str();
        match topic.kind.as_str() {
            "tf2_msgs/TFMessage" | "tf/tfMessage" => Self::Tf { fixed: name.ends_with("tf_static") },
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
        match self.roles[message.topic] {
            Role::None => {}
            Role::Tf { fixed: true } => tf_message(r, |t| {
                self.tf.fix(t.header.frame, t.child, t.parent_from_child);
            })?,
            Role::Tf { fixed: false } => tf_message(r, |t| {
                let stamp = stamp_of(t.header.stamp);
                self.tf.sample(t.header.frame, t.child, stamp, t.parent_from_child);
            })?,
            Role::Pose(kind) => {
                let pose = framed_pose(r, kind)?;
                let topic = self.poses.entry(message.topic).or_insert_with(|| PoseTopic {
                    parent: pose.header.frame.to_string(),
                    child: pose.child.to_string(),
                    poses: Vec::new(),
                    unstamped: 0,
                });
                let stamp = stamp_of(pose.header.stamp);
                if stamp.as_nanos() == 0 {
                    topic.unstamped += 1;
                } else {
                    topic.poses.push((stamp, pose.parent_from_child));
                }
            }
            Role::Info => {
                let info = camera_info(r)?;
                match self.infos.get_mut(&message.topic) {
                    Some(topic) => topic.changes += u64::from(topic.info != info),
                    None => {
                        self.infos.insert(message.topic, InfoTopic { info, changes: 0 });
                    }
                }
            }
            Role::Image(packing) => {
                let (header, encoding) = match packing {
                    Packing::Raw => image_head(r).map(|head| (head.header, head.encoding))?,
                    Packing::Compressed => compressed_head(r)?,
                };
                let topic = self.images.entry(message.topic).or_insert_with(|| ImageTopic {
                    packing,
                    frames: Vec::new(),
                    frame: header.frame.to_string(),
                    encoding: encoding.to_string(),
                    unstamped: 0,
                    jump: None,
                });
                let stamp = stamp_of(header.stamp);
                if stamp.as_nanos() == 0 {
                    topic.unstamped += 1;
                    return Ok(());
                }
                if let Some(&(last, _)) = topic.frames.last()
                    && last.since(stamp) >= CLOCK_JUMP
                    && topic.jump.is_none()
                {
                    topic.jump = Some((last, stamp, message.locator));
                }
                topic.frames.push((stamp, message.locator));
            }
            Role::Description => {
                if message.bytes.len() <= MAX_DESCRIPTION_BYTES {
                    self.description = Some(r.str()?.to_string());
                }
            }
        }
        Ok(())
    }

    /// One line for each topic with messages that could not be decoded.
    pub(crate) fn broken_lines(&self, recording: &Recording, topics: &[Topic]) -> Vec<String> {
        let line = |(topic, (problem, locator, n)): (&usize, &(String, Locator, u64))| {
            let name = &topics[*topic].name;
            let problem = format!("topic {name}: {n} messages are left out, the first since {problem}");
            recording.place(locator, vice_core::error::DataError::new(problem)).to_string()
        };
        self.broken.iter().map(line).collect()
    }
}

impl Visitor for Index {
    fn want(&mut self, _: usize, info: &Topic) -> Want {
        let role = Role::of(info);
        self.roles.push(role);
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
