//! ROS 1 bags with many frames, topics or messages.

use std::collections::HashMap;
use std::path::Path;

use crate::Result;

const SECONDS: u32 = 1_600_000_000;
/// Messages of a chunk.
const CHUNK: usize = 500;

/// A message as ROS 1 serialises it.
#[derive(Default)]
struct Message {
    topic: String,
    kind: &'static str,
    stamp: (u32, u32),
    bytes: Vec<u8>,
}

impl Message {
    fn new(topic: &str, kind: &'static str, millis: usize) -> Self {
        let stamp = (SECONDS + (millis / 1000) as u32, (millis % 1000) as u32 * 1_000_000);
        Self { topic: topic.to_string(), kind, stamp, bytes: Vec::new() }
    }

    fn u32(mut self, value: u32) -> Self {
        self.bytes.extend(value.to_le_bytes());
        self
    }

    fn text(self, text: &str) -> Self {
        let mut message = self.u32(text.len() as u32);
        message.bytes.extend(text.as_bytes());
        message
    }

    fn doubles(mut self, values: &[f64]) -> Self {
        self.bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        self
    }

    fn head(self, frame: &str) -> Self {
        let (seconds, nanos) = self.stamp;
        self.u32(0).u32(seconds).u32(nanos).text(frame)
    }

    fn edge(self, parent: &str, child: &str, x: f64) -> Self {
        self.head(parent).text(child).doubles(&[x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    }

    fn tf(topic: &str, millis: usize, edges: &[(String, String)]) -> Self {
        let message = Self::new(topic, "tf2_msgs/TFMessage", millis).u32(edges.len() as u32);
        edges.iter().fold(message, |m, (parent, child)| m.edge(parent, child, millis as f64 * 1e-3))
    }

    fn odometry(topic: &str, millis: usize) -> Self {
        let x = millis as f64 * 1e-3;
        Self::new(topic, "nav_msgs/Odometry", millis)
            .edge("odom", "base_link", x)
            .doubles(&[0.0; 36 + 6 + 36])
    }
}

fn field(name: &str, value: &[u8]) -> Vec<u8> {
    let length = (name.len() + 1 + value.len()) as u32;
    [&length.to_le_bytes()[..], name.as_bytes(), b"=", value].concat()
}

fn record(fields: &[Vec<u8>], data: &[u8]) -> Vec<u8> {
    let head = fields.concat();
    [&(head.len() as u32).to_le_bytes()[..], &head, &(data.len() as u32).to_le_bytes(), data].concat()
}

fn write(path: &Path, messages: &[Message]) -> Result<()> {
    let mut topics: HashMap<&str, u32> = HashMap::new();
    let (mut body, mut chunks) = (Vec::new(), 0_u32);
    for chunk in messages.chunks(CHUNK) {
        let mut plain = Vec::new();
        for message in chunk {
            let next = topics.len() as u32;
            let number = *topics.entry(&message.topic).or_insert(next);
            if number == next {
                let fields = [
                    field("op", &[7]),
                    field("conn", &number.to_le_bytes()),
                    field("topic", message.topic.as_bytes()),
                ];
                let data = [field("type", message.kind.as_bytes()), field("md5sum", b"*")].concat();
                plain.extend(record(&fields, &data));
            }
            let (seconds, nanos) = message.stamp;
            let time = [seconds.to_le_bytes(), nanos.to_le_bytes()].concat();
            let fields = [field("op", &[2]), field("conn", &number.to_le_bytes()), field("time", &time)];
            plain.extend(record(&fields, &message.bytes));
        }
        let size = (plain.len() as u32).to_le_bytes();
        let fields = [field("op", &[5]), field("compression", b"none"), field("size", &size)];
        body.extend(record(&fields, &plain));
        chunks += 1;
    }
    let head = |index: u64| {
        let fields = [
            field("op", &[3]),
            field("index_pos", &index.to_le_bytes()),
            field("conn_count", &(topics.len() as u32).to_le_bytes()),
            field("chunk_count", &chunks.to_le_bytes()),
        ];
        [&b"#ROSBAG V2.0\n"[..], &record(&fields, &[b' '; 100])].concat()
    };
    let index = (head(0).len() + body.len()) as u64;
    std::fs::write(path, [head(index), body].concat())?;
    Ok(())
}

/// A chain of so many frames, each on the one before.
pub(crate) fn write_chain(path: &Path, frames: usize) -> Result<()> {
    let edges: Vec<_> = (0..frames).map(|i| (format!("f{i}"), format!("f{}", i + 1))).collect();
    let base = [("odom".to_string(), "f0".to_string())];
    let moves = (0..20).map(|i| Message::tf("/tf", 50 * i, &base));
    let messages: Vec<_> = std::iter::once(Message::tf("/tf_static", 0, &edges)).chain(moves).collect();
    write(path, &messages)
}

/// So many topics with two poses each.
pub(crate) fn write_topics(path: &Path, topics: usize) -> Result<()> {
    let all = (0..2 * topics).map(|i| Message::odometry(&format!("/robot{}/odom", i / 2), i));
    write(path, &all.collect::<Vec<_>>())
}

/// So many robots, each with a tf of its own.
pub(crate) fn write_robots(path: &Path, robots: usize) -> Result<()> {
    let all = (0..2 * robots).map(|i| {
        let robot = i / 2;
        Message::tf(&format!("/r{robot}/tf"), i, &[(format!("odom{robot}"), format!("base{robot}"))])
    });
    write(path, &all.collect::<Vec<_>>())
}

/// So many messages of tf and odometry.
pub(crate) fn write_messages(path: &Path, messages: usize) -> Result<()> {
    let base = [("odom".to_string(), "base_link".to_string())];
    let all = (0..messages).map(|i| match i % 2 {
        0 => Message::tf("/tf", i, &base),
        _ => Message::odometry("/odom", i),
    });
    write(path, &all.collect::<Vec<_>>())
}
