//! Recordings of the shared data in other shapes: the same messages, stored in another way.

use std::io::Cursor;

use vice_tests::shared;

/// A message with what it belongs to.
struct Message {
    topic: String,
    kind: String,
    time: u64,
    data: Vec<u8>,
}

/// How an MCAP file is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Chunks of a megabyte as messages come.
    Mixed,
    /// Chunks of one topic each.
    ByTopic,
    /// No chunks at all.
    Loose,
}

/// The shared recording of a robot: 30 frames of colour and depth, chunks of zstd.
pub(crate) fn recorded() -> Option<Vec<u8>> {
    Some(std::fs::read(shared("data/locobot/locobot_ros2_mcap/locobot_ros2.mcap")?).unwrap())
}

/// Its labels.
pub(crate) fn labels() -> Option<Vec<u8>> {
    Some(std::fs::read(shared("data/locobot/labels.csv")?).unwrap())
}

/// The messages of an MCAP file with chunks of zstd, in the order in which they are in it.
fn messages(bytes: &[u8]) -> Vec<Message> {
    let (mut schemas, mut channels) = (std::collections::BTreeMap::new(), std::collections::BTreeMap::new());
    let mut messages = Vec::new();
    let mut take = |opcode: u8, body: &[u8]| match mcap::parse_record(opcode, body).unwrap() {
        mcap::records::Record::Schema { header, .. } => {
            schemas.insert(header.id, header.name);
        }
        mcap::records::Record::Channel(channel) => {
            channels.insert(channel.id, (channel.topic, schemas[&channel.schema_id].clone()));
        }
        mcap::records::Record::Message { header, data } => {
            let (topic, kind) = channels[&header.channel_id].clone();
            messages.push(Message { topic, kind, time: header.log_time, data: data.into_owned() });
        }
        _ => {}
    };
    for (opcode, body) in records(&bytes[8..bytes.len() - 8]) {
        if let Ok(mcap::records::Record::Chunk { header, data }) = mcap::parse_record(opcode, body) {
            assert_eq!(header.compression, "zstd");
            let plain = zstd::stream::decode_all(&data[..]).unwrap();
            records(&plain).for_each(|(opcode, body)| take(opcode, body));
        }
    }
    messages
}

fn records(mut bytes: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    std::iter::from_fn(move || {
        let (head, rest) = bytes.split_at_checked(9)?;
        let len = u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
        let (body, rest) = rest.split_at(len);
        bytes = rest;
        Some((head[0], body))
    })
}

/// The same messages in an MCAP file that is not compressed.
pub(crate) fn reshaped(recording: &[u8], shape: Shape) -> Vec<u8> {
    let mut all = messages(recording);
    if shape == Shape::ByTopic {
        all.sort_by_key(|m| m.topic.clone());
    }
    let size = if shape == Shape::Mixed { 1 << 20 } else { u64::MAX };
    let options = mcap::WriteOptions::new().compression(None).chunk_size(Some(size));
    let mut writer = options.use_chunks(shape != Shape::Loose).create(Cursor::new(Vec::new())).unwrap();
    let mut last = "";
    for message in &all {
        if shape == Shape::ByTopic && message.topic != last {
            writer.flush().unwrap();
            last = &message.topic;
        }
        let schema = writer.add_schema(&message.kind, "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, &message.topic, "cdr", &Default::default()).unwrap();
        let (log_time, publish_time) = (message.time, message.time);
        let header =
            mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time, publish_time };
        writer.write_to_known_channel(&header, &message.data).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A ROS 1 bag with its chunks of bz2 unpacked, and without its index.
pub(crate) fn unpacked_bag(bytes: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let start = b"#ROSBAG V2.0\n".len();
    let (mut out, mut at) = (bytes[..start].to_vec(), start);
    while at < bytes.len() {
        let header = at + 4..at + 4 + word(at);
        let data = header.end + 4..header.end + 4 + word(header.end);
        let text = |field: &[u8]| bytes[header.clone()].windows(field.len()).any(|w| w == field);
        if text(b"op=\x05") {
            assert!(text(b"compression=bz2"));
            let mut plain = Vec::new();
            let mut unpacked = bzip2::read::BzDecoder::new(&bytes[data.clone()]);
            std::io::Read::read_to_end(&mut unpacked, &mut plain).unwrap();
            let size = (plain.len() as u32).to_le_bytes();
            let fields: [&[u8]; 3] = [b"op=\x05", b"compression=none", &[&b"size="[..], &size].concat()];
            let fields: Vec<u8> =
                fields.iter().flat_map(|f| [&(f.len() as u32).to_le_bytes()[..], f].concat()).collect();
            out.extend((fields.len() as u32).to_le_bytes());
            out.extend(fields);
            out.extend(size);
            out.extend(plain);
        } else if text(b"op=\x03") {
            out.extend(&bytes[at..data.end]);
        }
        at = data.end;
    }
    out
}
