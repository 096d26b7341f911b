//! Recordings that lie elsewhere read as those that are here, and are not fetched as a whole.

use std::io::Cursor;
use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use vice_core::error::ErrorKind;
use vice_files::elsewhere::{Elsewhere, Ranged, mount};

use super::*;
use crate::testing::{Msg, START, bag, image, mcap, run, tf};

/// A file in memory that counts what is read of it; bytes that were announced are counted once.
struct Counted {
    bytes: Vec<u8>,
    read: AtomicU64,
    announced: Mutex<Vec<Range<u64>>>,
    gone: AtomicBool,
}

impl Ranged for Counted {
    fn size_bytes(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> DataResult<()> {
        if self.gone.load(Ordering::SeqCst) {
            return Err(DataError::of_kind(ErrorKind::Missing, "the server is gone"));
        }
        let end = offset + bytes.len() as u64;
        bytes.copy_from_slice(&self.bytes[offset as usize..end as usize]);
        if !self.announced.lock().unwrap().iter().any(|r| r.start <= offset && end <= r.end) {
            self.read.fetch_add(bytes.len() as u64, Ordering::SeqCst);
        }
        Ok(())
    }

    fn will_read(&self, ranges: &[Range<u64>]) -> DataResult<()> {
        self.read.fetch_add(ranges.iter().map(|r| r.end - r.start).sum(), Ordering::SeqCst);
        self.announced.lock().unwrap().extend_from_slice(ranges);
        Ok(())
    }
}

struct One(Arc<Counted>);

impl Elsewhere for One {
    fn open(&self, path: &Path) -> DataResult<Option<Arc<dyn Ranged>>> {
        Ok(path.ends_with("far").then(|| Arc::clone(&self.0) as Arc<dyn Ranged>))
    }

    fn bring(&self, _: &Path) -> DataResult<()> {
        Ok(())
    }
}

/// Everything that a walk finds: topics with their counts, damage, messages.
type Told = (Vec<String>, Vec<String>, Vec<(usize, Stamp, Vec<u8>)>);

/// Keeps transforms whole and heads of images, as the index pass does.
#[derive(Default)]
struct Keep(Vec<(usize, Stamp, Vec<u8>)>);

impl Visitor for Keep {
    fn want(&mut self, _: usize, info: &Topic) -> Want {
        match info.kind.as_str() {
            "sensor_msgs/Image" => Want::Head,
            "sensor_msgs/PointCloud2" => Want::Nothing,
            _ => Want::All,
        }
    }

    fn message(&mut self, m: &Message<'_>) {
        // More than the promised head may be there.
        let len = m.bytes.len().min(HEAD_BYTES);
        self.0.push((m.topic, m.recorded, m.bytes[..len].to_vec()));
    }
}

fn found(path: &Path) -> DataResult<Told> {
    let recording = Recording::open(&Found { files: vec![path.to_path_buf()], ..Found::default() })?;
    let mut keep = Keep::default();
    let scan = recording.scan(&mut keep)?;
    let topics = scan.topics.iter().map(|t| format!("{} {} {} {:?}", t.name, t.kind, t.count, t.recorded));
    let named = path.display().to_string();
    let damage = scan.damage.iter().map(|d| d.replace(&named, "FILE"));
    Ok((topics.collect(), damage.collect(), keep.0))
}

/// Reads bytes here and elsewhere, which must find the same; gives how many were read elsewhere.
fn both(bytes: &[u8]) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    let (near, far) = (folder.path().join("near"), folder.path().join("far"));
    std::fs::write(&near, bytes).unwrap();
    std::fs::write(&far, b"").unwrap();
    let counted = counted(bytes);
    let _held = mount(folder.path(), Arc::new(One(Arc::clone(&counted))));
    assert_eq!(found(&far).unwrap(), found(&near).unwrap());
    counted.read.load(Ordering::SeqCst)
}

fn counted(bytes: &[u8]) -> Arc<Counted> {
    let (read, announced, gone) = (AtomicU64::new(0), Mutex::default(), AtomicBool::new(false));
    Arc::new(Counted { bytes: bytes.to_vec(), read, announced, gone })
}

/// A run with large images and a scanner: 200 kB each, 10 of both.
fn large() -> Vec<Msg> {
    let mut messages = run();
    for i in 0..10_i64 {
        let t = START + i * 100_000_000;
        let mut picture = image("/camera/color/image_raw", t, "optical", "mono8", i as u8);
        picture.bytes.iter_mut().for_each(|b| b.extend(vec![7; 200_000]));
        messages.push(picture);
        messages.push(Msg::new("/scan", "sensor_msgs/PointCloud2", t, |o| {
            o.header(t, "laser").data(&vec![9; 200_000])
        }));
        messages.push(tf("/tf", t, "odom", "base_footprint", crate::testing::At(0.0, 0.0, 0.0, 0.0)));
    }
    messages
}

/// An MCAP file with chunks of a topic each, or of all topics.
fn chunked(messages: &[Msg], by_topic: bool) -> Vec<u8> {
    let options = ::mcap::WriteOptions::new().compression(None).chunk_size(Some(u64::MAX));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let mut sorted: Vec<&Msg> = messages.iter().collect();
    if by_topic {
        sorted.sort_by_key(|m| m.topic.clone());
    }
    let mut last = "";
    for (count, message) in sorted.into_iter().enumerate() {
        if (by_topic && message.topic != last) || (!by_topic && count % 8 == 0) {
            writer.flush().unwrap();
            last = &message.topic;
        }
        let schema = writer.add_schema(&message.kind.replace('/', "/msg/"), "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, &message.topic, "cdr", &Default::default()).unwrap();
        let (time, sequence) = (message.nanos as u64, 0);
        let header = ::mcap::records::MessageHeader {
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

#[test]
fn an_index_spares_images_and_what_nobody_wants() {
    for by_topic in [false, true] {
        let bytes = chunked(&large(), by_topic);
        let read = both(&bytes);
        assert!(read * 20 < bytes.len() as u64, "{read} of {} bytes, by topic: {by_topic}", bytes.len());
    }
}

/// The same file with its chunks compressed, and its index as it is then.
fn compressed(bytes: &[u8]) -> Vec<u8> {
    let put = |out: &mut Vec<u8>, opcode: u8, body: &[u8]| {
        out.push(opcode);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
    };
    let word = |body: &[u8], at: usize| u64::from_le_bytes(body[at..at + 8].try_into().unwrap());
    let (mut out, mut at) = (bytes[..8].to_vec(), 8);
    // By where a chunk started: where it starts now, its bytes, and those of its messages.
    let mut moved = std::collections::BTreeMap::new();
    let mut summary_at = 0;
    while at < bytes.len() - 8 {
        let len = word(bytes, at + 1) as usize;
        let (opcode, body) = (bytes[at], &bytes[at + 9..at + 9 + len]);
        match opcode {
            // Times, size and check sum; then the name of the compression, which is empty, and the records.
            0x06 => {
                let packed = zstd::bulk::compress(&body[40..], 1).unwrap();
                let mut new = body[..28].to_vec();
                new.extend(4_u32.to_le_bytes());
                new.extend(b"zstd");
                new.extend((packed.len() as u64).to_le_bytes());
                new.extend(&packed);
                moved.insert(at as u64, (out.len() as u64, 9 + new.len() as u64, packed.len() as u64));
                put(&mut out, opcode, &new);
            }
            0x08 => {
                let (start, chunk_len, packed) = moved[&word(body, 16)];
                let offsets = u32::from_le_bytes(body[32..36].try_into().unwrap()) as usize;
                let rest = 36 + offsets;
                let mut new = [&body[..16], &start.to_le_bytes(), &chunk_len.to_le_bytes()].concat();
                new.extend(&body[32..rest + 8]);
                new.extend(4_u32.to_le_bytes());
                new.extend(b"zstd");
                new.extend(packed.to_le_bytes());
                new.extend(&body[rest + 20..rest + 28]);
                put(&mut out, opcode, &new);
            }
            0x02 => put(&mut out, opcode, &[&(summary_at as u64).to_le_bytes()[..], &[0; 12]].concat()),
            // Places in the summary, which are others now.
            0x0e => {}
            _ => put(&mut out, opcode, body),
        }
        if opcode == 0x0f {
            summary_at = out.len();
        }
        at += 9 + len;
    }
    out.extend(&bytes[at..]);
    out
}

#[test]
fn of_what_is_compressed_only_chunks_that_nobody_wants_are_left() {
    let mut messages = large();
    let mut state = 1_u64;
    for byte in
        messages.iter_mut().filter(|m| m.bytes[1].len() > 100_000).flat_map(|m| &mut m.bytes[1][1024..])
    {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        *byte = (state >> 56) as u8;
    }
    // Images and scans are half of the file each.
    let by_topic = compressed(&chunked(&messages, true));
    let (read, len) = (both(&by_topic), by_topic.len() as u64);
    assert!(len > 4_000_000 && 2 * read < len + 100_000, "{read} of {len}");
    let mixed = compressed(&chunked(&messages, false));
    let (read, len) = (both(&mixed), mixed.len() as u64);
    assert!(read <= len + len / 20, "once: {read} of {len}");
}

#[test]
fn without_an_index_it_is_walked() {
    let bytes = chunked(&large(), false);
    // Cut off in the last chunk, the index is gone.
    let read = both(&bytes[..bytes.len() - 30_000]);
    assert!(read * 20 < bytes.len() as u64, "{read}");
    let options = ::mcap::WriteOptions::new().use_chunks(false);
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    for message in large() {
        let schema = writer.add_schema(&message.kind.replace('/', "/msg/"), "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, &message.topic, "cdr", &Default::default()).unwrap();
        let (log_time, publish_time) = (message.nanos as u64, message.nanos as u64);
        let header =
            ::mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time, publish_time };
        writer.write_to_known_channel(&header, &message.bytes[1]).unwrap();
    }
    writer.finish().unwrap();
    let bytes = writer.into_inner().into_inner();
    let read = both(&bytes);
    assert!(read * 20 < bytes.len() as u64, "{read}");
    for compression in ["none", "bz2", "lz4"] {
        let bytes = bag(&large(), compression, 4, true);
        let read = both(&bytes);
        assert!(compression != "none" || read * 20 < bytes.len() as u64, "{read}");
    }
}

#[test]
fn an_index_that_lies_changes_nothing_or_is_damage_never_a_panic() {
    let bytes = mcap(&run());
    for at in (bytes.len() - 4000..bytes.len() - 8).step_by(41) {
        let mut wrong = bytes.clone();
        wrong[at] ^= 0x41;
        let folder = tempfile::tempdir().unwrap();
        let far = folder.path().join("far");
        std::fs::write(&far, b"").unwrap();
        let _held = mount(folder.path(), Arc::new(One(counted(&wrong))));
        let _ = found(&far);
    }
}

#[test]
fn bytes_that_cannot_be_had_are_an_error_and_no_damage() {
    for bytes in [mcap(&run()), bag(&run(), "lz4", 4, true), bag(&run(), "none", 4, true)] {
        let folder = tempfile::tempdir().unwrap();
        let far = folder.path().join("far");
        std::fs::write(&far, b"").unwrap();
        let counted = counted(&bytes);
        let _held = mount(folder.path(), Arc::new(One(Arc::clone(&counted))));
        let files = vec![far.clone()];
        let recording = Recording::open(&Found { files, ..Found::default() }).unwrap();
        counted.gone.store(true, Ordering::SeqCst);
        let error = recording.scan(&mut Keep::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Missing);
        assert!(error.to_string().contains("the server is gone"), "{error}");
    }
}
