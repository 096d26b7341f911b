//! Small recordings for tests: messages in both encodings, in all containers.

use std::io::Write;
use std::path::Path;

use crate::container::Encoding;

/// The opposite of the reader.
pub(crate) struct Out {
    bytes: Vec<u8>,
    cdr: bool,
}

impl Out {
    pub(crate) fn new(encoding: Encoding) -> Self {
        Self { bytes: Vec::new(), cdr: encoding == Encoding::Cdr }
    }

    fn put(mut self, bytes: &[u8]) -> Self {
        if self.cdr {
            self.bytes.resize(self.bytes.len().next_multiple_of(bytes.len()), 0);
        }
        self.bytes.extend_from_slice(bytes);
        self
    }

    pub(crate) fn u8(self, v: u8) -> Self {
        self.put(&[v])
    }

    pub(crate) fn u32(self, v: u32) -> Self {
        self.put(&v.to_le_bytes())
    }

    pub(crate) fn f64s(self, values: &[f64]) -> Self {
        values.iter().fold(self, |out, v| out.put(&v.to_le_bytes()))
    }

    pub(crate) fn list(self, values: &[f64]) -> Self {
        self.u32(values.len() as u32).f64s(values)
    }

    pub(crate) fn data(self, bytes: &[u8]) -> Self {
        let mut out = self.u32(bytes.len() as u32);
        out.bytes.extend_from_slice(bytes);
        out
    }

    pub(crate) fn str(self, text: &str) -> Self {
        let mut bytes = text.as_bytes().to_vec();
        if self.cdr {
            bytes.push(0);
        }
        self.data(&bytes)
    }

    pub(crate) fn header(self, nanos: i64, frame: &str) -> Self {
        let out = if self.cdr { self } else { self.u32(0) };
        out.u32((nanos / 1_000_000_000) as u32).u32((nanos % 1_000_000_000) as u32).str(frame)
    }

    pub(crate) fn done(self) -> Vec<u8> {
        let mut bytes = if self.cdr { vec![0, 1, 0, 0] } else { Vec::new() };
        bytes.extend(self.bytes);
        bytes
    }
}

/// A message of a test.
#[derive(Clone, Debug)]
pub(crate) struct Msg {
    pub(crate) topic: String,
    pub(crate) kind: String,
    pub(crate) nanos: i64,
    /// In ROS 1 and in CDR.
    pub(crate) bytes: [Vec<u8>; 2],
}

impl Msg {
    /// A message recorded 10 ms after `nanos`.
    pub(crate) fn new(topic: &str, kind: &str, nanos: i64, write: impl Fn(Out) -> Out) -> Self {
        let bytes = [Encoding::Ros1, Encoding::Cdr].map(|e| write(Out::new(e)).done());
        Self { topic: topic.to_string(), kind: kind.to_string(), nanos: nanos + 10_000_000, bytes }
    }
}

/// A translation and a yaw (rad) of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct At(pub(crate) f64, pub(crate) f64, pub(crate) f64, pub(crate) f64);

impl At {
    fn write(self, out: Out) -> Out {
        let Self(x, y, z, yaw) = self;
        out.f64s(&[x, y, z, 0.0, 0.0, (yaw / 2.0).sin(), (yaw / 2.0).cos()])
    }
}

pub(crate) fn tf(topic: &str, nanos: i64, parent: &str, child: &str, at: At) -> Msg {
    Msg::new(topic, "tf2_msgs/TFMessage", nanos, |o| at.write(o.u32(1).header(nanos, parent).str(child)))
}

pub(crate) fn odometry(topic: &str, nanos: i64, parent: &str, child: &str, at: At) -> Msg {
    odometry_with(topic, nanos, (parent, child), at, &[0.0; 36])
}

/// The same with a covariance of the pose.
pub(crate) fn odometry_with(
    topic: &str,
    nanos: i64,
    (parent, child): (&str, &str),
    at: At,
    covariance: &[f64; 36],
) -> Msg {
    Msg::new(topic, "nav_msgs/Odometry", nanos, |o| {
        at.write(o.header(nanos, parent).str(child)).f64s(covariance).f64s(&[0.0; 6 + 36])
    })
}

pub(crate) fn pose(topic: &str, nanos: i64, parent: &str, at: At) -> Msg {
    Msg::new(topic, "geometry_msgs/PoseStamped", nanos, |o| at.write(o.header(nanos, parent)))
}

pub(crate) fn camera_info(topic: &str, nanos: i64, frame: &str) -> Msg {
    Msg::new(topic, "sensor_msgs/CameraInfo", nanos, |o| {
        o.header(nanos, frame)
            .u32(2)
            .u32(4)
            .str("plumb_bob")
            .list(&[0.0; 5])
            .f64s(&[100.0, 0.0, 1.5, 0.0, 100.0, 0.5, 0.0, 0.0, 1.0])
            .f64s(&[0.0; 9])
            .f64s(&[0.0; 12])
            .u32(0)
            .u32(0)
            .u32(0)
            .u32(0)
            .u32(0)
            .u32(0)
            .u8(0)
    })
}

/// What a test changes of a `sensor_msgs/CameraInfo` of 4x2 pixels with a focal length of 100.
#[derive(Clone, Debug)]
pub(crate) struct Info<'a> {
    pub(crate) size: [u32; 2],
    pub(crate) model: &'a str,
    pub(crate) distortion: &'a [f64],
    pub(crate) focal: f64,
    pub(crate) binning: u32,
}

impl Default for Info<'_> {
    fn default() -> Self {
        Self { size: [4, 2], model: "plumb_bob", distortion: &[0.0; 5], focal: 100.0, binning: 0 }
    }
}

pub(crate) fn camera_info_of(topic: &str, nanos: i64, frame: &str, info: &Info<'_>) -> Msg {
    let Info { size: [width, height], model, distortion, focal, binning } = *info;
    Msg::new(topic, "sensor_msgs/CameraInfo", nanos, |o| {
        let o = o.header(nanos, frame).u32(height).u32(width).str(model).list(distortion);
        let o = o.f64s(&[focal, 0.0, 1.5, 0.0, focal, 0.5, 0.0, 0.0, 1.0]).f64s(&[0.0; 9]);
        let o = o.f64s(&[focal, 0.0, 1.5, 0.0, 0.0, focal, 0.5, 0.0, 0.0, 0.0, 1.0, 0.0]);
        o.u32(binning).u32(binning).u32(0).u32(0).u32(0).u32(0).u8(0)
    })
}

/// A compressed image of a format that `format` names.
pub(crate) fn compressed_image(topic: &str, nanos: i64, frame: &str, format: &str, data: &[u8]) -> Msg {
    Msg::new(topic, "sensor_msgs/CompressedImage", nanos, |o| o.header(nanos, frame).str(format).data(data))
}

/// A 4x2 image whose bytes are all `value`.
pub(crate) fn image(topic: &str, nanos: i64, frame: &str, encoding: &str, value: u8) -> Msg {
    let step = if encoding == "mono8" { 4 } else { 8 };
    Msg::new(topic, "sensor_msgs/Image", nanos, |o| {
        o.header(nanos, frame)
            .u32(2)
            .u32(4)
            .str(encoding)
            .u8(0)
            .u32(step)
            .data(&vec![value; 2 * step as usize])
    })
}

pub(crate) fn imu(topic: &str, nanos: i64, frame: &str, gyro: [f64; 3], accel: [f64; 3]) -> Msg {
    Msg::new(topic, "sensor_msgs/Imu", nanos, |o| {
        let o = o.header(nanos, frame).f64s(&[0.0, 0.0, 0.0, 1.0]).f64s(&[-1.0; 9]);
        o.f64s(&gyro).f64s(&[0.0; 9]).f64s(&accel).f64s(&[0.0; 9])
    })
}

pub(crate) fn joint_state(topic: &str, nanos: i64, name: &str, position: f64) -> Msg {
    Msg::new(topic, "sensor_msgs/JointState", nanos, |o| {
        o.header(nanos, "").u32(2).str("wheel").str(name).list(&[0.0, position]).list(&[]).list(&[])
    })
}

fn field(name: &str, value: &[u8]) -> Vec<u8> {
    let mut field = format!("{name}=").into_bytes();
    field.extend(value);
    let mut bytes = (field.len() as u32).to_le_bytes().to_vec();
    bytes.extend(field);
    bytes
}

fn record(header: &[Vec<u8>], data: &[u8]) -> Vec<u8> {
    let header = header.concat();
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(header);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes
}

/// A ROS 1 bag with `per_chunk` messages a chunk; where it is not `closed` it has no index.
pub(crate) fn bag(messages: &[Msg], compression: &str, per_chunk: usize, closed: bool) -> Vec<u8> {
    let mut topics: Vec<&str> = Vec::new();
    let mut chunks = Vec::new();
    for chunk in messages.chunks(per_chunk) {
        let mut plain = Vec::new();
        for message in chunk {
            let known = topics.iter().position(|t| *t == message.topic);
            let conn = known.unwrap_or(topics.len()) as u32;
            if known.is_none() {
                topics.push(&message.topic);
                let header = [
                    field("op", &[7]),
                    field("conn", &conn.to_le_bytes()),
                    field("topic", message.topic.as_bytes()),
                ];
                let data = [field("type", message.kind.as_bytes()), field("md5sum", b"*")].concat();
                plain.extend(record(&header, &data));
            }
            let (secs, nanos) = (message.nanos / 1_000_000_000, message.nanos % 1_000_000_000);
            let time = [(secs as u32).to_le_bytes(), (nanos as u32).to_le_bytes()].concat();
            let header = [field("op", &[2]), field("conn", &conn.to_le_bytes()), field("time", &time)];
            plain.extend(record(&header, &message.bytes[0]));
        }
        let packed = match compression {
            "lz4" => {
                let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
                encoder.write_all(&plain).unwrap();
                encoder.finish().0
            }
            "bz2" => {
                let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
                encoder.write_all(&plain).unwrap();
                encoder.finish().unwrap()
            }
            _ => plain.clone(),
        };
        let header = [
            field("op", &[5]),
            field("compression", compression.as_bytes()),
            field("size", &(plain.len() as u32).to_le_bytes()),
        ];
        chunks.push(record(&header, &packed));
    }
    let head = |index_pos: u64| {
        let header = [
            field("op", &[3]),
            field("index_pos", &index_pos.to_le_bytes()),
            field("conn_count", &(topics.len() as u32).to_le_bytes()),
            field("chunk_count", &(chunks.len() as u32).to_le_bytes()),
        ];
        [b"#ROSBAG V2.0\n".to_vec(), record(&header, &[b' '; 100])].concat()
    };
    let body = chunks.concat();
    let index_pos = if closed { (head(0).len() + body.len()) as u64 } else { 0 };
    [head(index_pos), body].concat()
}

/// An MCAP file by the format's own writer, with small chunks.
pub(crate) fn mcap(messages: &[Msg]) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(None).chunk_size(Some(600));
    let mut writer = options.create(std::io::Cursor::new(Vec::new())).unwrap();
    for (sequence, message) in (0..).zip(messages) {
        // A topic may say its own encoding, `json:/topic`.
        let (encoding, topic) = message.topic.split_once(':').unwrap_or(("cdr", &message.topic));
        let kind = message.kind.replace('/', "/msg/");
        let schema = writer.add_schema(&kind, "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, topic, encoding, &Default::default()).unwrap();
        let time = message.nanos as u64;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence,
            log_time: time,
            publish_time: time,
        };
        writer.write_to_known_channel(&header, &message.bytes[1]).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A data base of rosbag2; each message compressed where asked for.
pub(crate) fn db3(path: &Path, messages: &[Msg], compressed: bool) {
    let connection = rusqlite::Connection::open(path).unwrap();
    fill_db3(&connection, messages, compressed);
}

/// Adds messages to a data base, which may be empty.
pub(crate) fn fill_db3(connection: &rusqlite::Connection, messages: &[Msg], compressed: bool) {
    connection
        .execute_batch(
            "CREATE TABLE IF NOT EXISTS topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
             serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
             CREATE TABLE IF NOT EXISTS messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
             data BLOB NOT NULL);",
        )
        .unwrap();
    let before: i64 = connection.query_row("SELECT count(*) FROM topics", [], |row| row.get(0)).unwrap();
    let mut topics: Vec<&str> = Vec::new();
    for message in messages {
        if !topics.contains(&message.topic.as_str()) {
            topics.push(&message.topic);
            let kind = message.kind.replace('/', "/msg/");
            let row = (before + topics.len() as i64, &message.topic, kind);
            connection.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')", row).unwrap();
        }
        let topic = before + 1 + topics.iter().position(|t| *t == message.topic).unwrap() as i64;
        let plain = &message.bytes[1];
        let data = if compressed { zstd::bulk::compress(plain, 1).unwrap() } else { plain.clone() };
        let row = (topic, message.nanos, data);
        connection
            .execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)", row)
            .unwrap();
    }
}

/// A robot's short run: 5 gray frames and depth images at 10 Hz, a turning head, odometry that drives along x.
///
/// Names are LoCoBot's; frame i is at `START + i` tenths of a second.
pub(crate) fn run() -> Vec<Msg> {
    let mut messages = vec![
        tf("/tf_static", START, "base_footprint", "base_link", At(0.0, 0.0, 0.1, 0.0)),
        tf("/tf_static", START, "head", "optical", At(0.05, 0.0, 0.0, 0.0)),
    ];
    for i in 0..9_i64 {
        let t = START + i * 50_000_000;
        let x = i as f64 * 0.01;
        messages.push(tf("/tf", t, "odom", "base_footprint", At(x, 0.0, 0.0, 0.0)));
        messages.push(tf("/tf", t, "base_link", "head", At(0.0, 0.0, 0.5, 0.1 * x)));
        messages.push(odometry("/odom", t, "odom", "base_footprint", At(x, 0.0, 0.0, 0.0)));
        if i % 4 == 0 {
            messages.push(tf("/tf", t, "map", "odom", At(1.0, 0.0, 0.0, 0.0)));
        }
        if i % 2 == 0 {
            messages.push(camera_info("/camera/color/camera_info", t, "optical"));
            messages.push(image("/camera/color/image_raw", t, "optical", "mono8", i as u8));
            let depth = "/camera/aligned_depth_to_color/image_raw";
            messages.push(image(depth, t + 1_000_000, "optical", "16UC1", 1 + i as u8));
        }
    }
    messages
}

/// Stamp of the first frame of [`run`], ns.
pub(crate) const START: i64 = 1_700_000_000_000_000_000;
