use std::path::PathBuf;

use proptest::prelude::*;

use super::*;
use crate::testing::{Msg, START, bag, db3, mcap, run};

/// Keeps everything; heads are marked by `false`.
#[derive(Default)]
struct All {
    heads: bool,
    seen: Vec<(usize, Vec<u8>, Locator)>,
}

impl Visitor for All {
    fn want(&mut self, _: usize, _: &Topic) -> Want {
        if self.heads { Want::Head } else { Want::All }
    }

    fn message(&mut self, m: &Message<'_>) {
        self.seen.push((m.topic, m.bytes.to_vec(), m.locator));
    }
}

struct Seen {
    scan: Scan,
    all: All,
    recording: Recording,
}

impl Seen {
    fn damage(&self) -> String {
        self.scan.damage.join("\n")
    }
}

fn read(found: &Found) -> DataResult<Seen> {
    let recording = Recording::open(found)?;
    let mut all = All::default();
    let scan = recording.scan(&mut all)?;
    Ok(Seen { scan, all, recording })
}

fn read_bytes(bytes: &[u8]) -> DataResult<Seen> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    std::fs::write(&path, bytes).unwrap();
    read(&Found { files: vec![path], ..Found::default() })
}

fn check(seen: &Seen, messages: &[Msg], encoding: usize) {
    assert_eq!(seen.damage(), "");
    assert_eq!(seen.all.seen.len(), messages.len());
    for ((topic, bytes, locator), message) in seen.all.seen.iter().zip(messages) {
        let info = &seen.scan.topics[*topic];
        assert_eq!((&info.name, &info.kind), (&message.topic, &message.kind));
        assert_eq!(bytes, &message.bytes[encoding]);
        assert_eq!(seen.recording.read(locator).unwrap().bytes(), bytes, "read again on demand");
    }
    let odom = seen.scan.topics.iter().find(|t| t.name == "/odom").unwrap();
    let last = START + 8 * 50_000_000 + 10_000_000;
    let recorded = (Stamp::from_nanos(START + 10_000_000), Stamp::from_nanos(last));
    assert_eq!((odom.count, odom.recorded), (9, Some(recorded)));
}

#[test]
fn all_containers_give_the_same_messages() {
    let messages = run();
    for compression in ["none", "lz4", "bz2"] {
        for per_chunk in [1, 7, 100] {
            check(&read_bytes(&bag(&messages, compression, per_chunk, true)).unwrap(), &messages, 0);
        }
    }
    check(&read_bytes(&mcap(&messages)).unwrap(), &messages, 1);
    let folder = tempfile::tempdir().unwrap();
    for compressed in [false, true] {
        let path = folder.path().join(format!("{compressed} 50%#?.db3"));
        db3(&path, &messages, compressed);
        let found = Found { files: vec![path], compressed_messages: compressed, ..Found::default() };
        check(&read(&found).unwrap(), &messages, 1);
    }
    let left: Vec<PathBuf> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(left.len(), 2, "nothing is written beside a recording: {left:?}");
}

#[test]
fn heads_are_short_and_cost_no_more() {
    let mut messages = run();
    messages[0].bytes[0] = vec![7; 100_000];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    std::fs::write(&path, bag(&messages, "none", 4, true)).unwrap();
    let recording = Recording::open(&Found { files: vec![path], ..Found::default() }).unwrap();
    let mut all = All { heads: true, ..All::default() };
    recording.scan(&mut all).unwrap();
    assert_eq!(all.seen.len(), messages.len());
    assert_eq!(all.seen[0].1.len(), HEAD_BYTES);
    assert_eq!(recording.read(&all.seen[0].2).unwrap().bytes().len(), 100_000);
}

#[test]
fn stepping_forward_and_jumping_about_read_the_same() {
    let messages = run();
    let seen = read_bytes(&bag(&messages, "lz4", 3, true)).unwrap();
    let n = messages.len();
    let orders: [Vec<usize>; 3] =
        [(0..n).collect(), (0..n).rev().collect(), (0..n).map(|i| i * 17 % n).collect()];
    std::thread::scope(|scope| {
        for order in orders.iter().cycle().take(6) {
            let seen = &seen;
            scope.spawn(move || {
                for i in order {
                    let (_, bytes, locator) = &seen.all.seen[*i];
                    assert_eq!(seen.recording.read(locator).unwrap().bytes(), bytes);
                }
            });
        }
    });
}

#[test]
fn a_cut_recording_reads_as_far_as_it_goes_and_says_how_far() {
    let messages = run();
    let full = messages.len();
    for compression in ["none", "lz4", "bz2"] {
        let bytes = bag(&messages, compression, 10, true);
        let mut before = 0;
        for cut in (200..bytes.len()).step_by(101) {
            let Ok(seen) = read_bytes(&bytes[..cut]) else { continue };
            let n = seen.all.seen.len();
            assert!(n >= before && n <= full, "{compression} cut at {cut}: {n} messages after {before}");
            // A cut right behind a chunk leaves nothing that is seen to be missing but the index.
            assert!(seen.damage().is_empty() || seen.damage().contains("byte "), "{}", seen.damage());
            before = n;
        }
        assert!(before >= full - 10, "{compression}: {before} of {full}");
    }
    let half = bag(&messages, "none", 100, true);
    let seen = read_bytes(&half[..half.len() - 700]).unwrap();
    assert!(seen.all.seen.len() > 20, "messages before the cut in an uncompressed chunk are there");
    assert!(
        seen.damage().contains(&format!("byte {}: the bag is cut off", half.len() - 700)),
        "{}",
        seen.damage()
    );
    let bytes = mcap(&messages);
    let seen = read_bytes(&bytes[..bytes.len() / 2]).unwrap();
    assert!(!seen.all.seen.is_empty() && seen.all.seen.len() < full);
    assert!(seen.damage().contains("the file is cut off"), "{}", seen.damage());
}

#[test]
fn a_bag_without_index_is_read_with_a_warning() {
    let messages = run();
    let bytes = bag(&messages, "lz4", 10, false);
    let seen = read_bytes(&bytes).unwrap();
    assert_eq!(seen.all.seen.len(), messages.len());
    let expected = format!("no index: it was not closed; read up to byte {}", bytes.len());
    assert!(seen.damage().contains(&expected), "{}", seen.damage());
}

#[test]
fn a_damaged_chunk_is_left_out_and_named() {
    let messages = run();
    let full = messages.len();
    // The check sum of an MCAP chunk: a byte of a message is changed.
    let mut bytes = mcap(&messages);
    let needle = &messages[full - 8].bytes[1];
    let at = bytes.windows(needle.len()).position(|w| w == needle).unwrap();
    bytes[at + 30] ^= 1;
    let seen = read_bytes(&bytes).unwrap();
    assert!(seen.all.seen.len() < full && seen.all.seen.len() >= full - 20, "{}", seen.all.seen.len());
    assert!(seen.damage().contains("check sum") && seen.damage().contains("byte "), "{}", seen.damage());
    // The first chunk, which has the first mention of all topics: the index has the second.
    let mut bytes = mcap(&messages);
    let needle = &messages[0].bytes[1];
    let at = bytes.windows(needle.len()).position(|w| w == needle).unwrap();
    bytes[at + 30] ^= 1;
    let seen = read_bytes(&bytes).unwrap();
    assert!(seen.all.seen.len() > full - 10, "{} of {full}: {}", seen.all.seen.len(), seen.damage());
    // A bit of compressed data.
    let mut bytes = bag(&messages, "bz2", 10, true);
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    let seen = read_bytes(&bytes).unwrap();
    assert!(seen.all.seen.len() < full && seen.all.seen.len() >= full - 20, "{}", seen.all.seen.len());
    assert!(seen.damage().contains("left out") && seen.damage().contains("byte "), "{}", seen.damage());
    // A record in an uncompressed chunk that claims to be longer than the chunk.
    let mut bytes = bag(&messages, "none", 10, true);
    let needle = &messages[4].bytes[0];
    let at = bytes.windows(needle.len()).position(|w| w == needle).unwrap();
    bytes[at - 4..at].copy_from_slice(&0x7fff_ffff_u32.to_le_bytes());
    let seen = read_bytes(&bytes).unwrap();
    assert!(seen.all.seen.len() < full && seen.damage().contains("should end at byte"), "{}", seen.damage());
}

#[test]
fn claims_of_a_header_take_no_memory() {
    let decompress = |compression, stored: &[u8], size, salvage| {
        let mut out = Vec::new();
        let problem = block::decompress(compression, stored.to_vec(), size, salvage, &mut out);
        (out, problem.unwrap())
    };
    for compression in [block::Compression::Bz2, block::Compression::Lz4, block::Compression::Zstd] {
        let (bytes, problem) = decompress(compression, b"nothing", 1 << 62, false);
        assert!(bytes.capacity() == 0 && problem.contains("claims"), "{compression:?}");
        let (bytes, problem) = decompress(compression, b"nothing", 1 << 29, false);
        assert!(bytes.capacity() == 0 && problem.contains("VICE_BUDGET=8"), "{compression:?}: {problem}");
        let (bytes, problem) = decompress(compression, b"nothing", 1 << 25, false);
        assert!(bytes.is_empty() && problem.contains("cannot be decompressed"), "{compression:?}");
        assert!(bytes.capacity() <= 1 << 20);
    }
    // A megabyte of zeros in a block that claims ten bytes.
    let bomb = zstd::bulk::compress(&vec![0; 1 << 20], 3).unwrap();
    for salvage in [false, true] {
        let (bytes, _) = decompress(block::Compression::Zstd, &bomb, 10, salvage);
        assert!(bytes.len() <= 11);
    }
}

#[test]
fn what_is_no_recording_is_refused() {
    let text = |bytes: &[u8]| read_bytes(bytes).err().unwrap().to_string();
    assert!(text(b"").contains("the file is empty"));
    assert!(text(b"hello").contains("no ROS 1 bag, MCAP file or sqlite3"));
    assert!(text(b"#ROSBAG V1.2\n....").contains("not a bag of version 2.0"));
    assert!(text(b"#ROSBAG V2.0\n").contains("no chunk"));
    assert!(text(b"\x89MCAP0\r\n").contains("no messages"));
    assert!(text(b"\x28\xb5\x2f\xfd____").contains("zstd -d"));
    assert!(text(&[b"SQLite format 3\0".as_slice(), &[0; 100]].concat()).contains("data base"));
}

#[test]
fn a_damaged_data_base_is_read_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let messages: Vec<Msg> = run().into_iter().cycle().take(3000).collect();
    db3(&path, &messages, false);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() * 2 / 3 / 4096 * 4096]).unwrap();
    let seen = read(&Found { files: vec![path], ..Found::default() }).unwrap();
    assert!((500..3000).contains(&seen.all.seen.len()), "{}", seen.all.seen.len());
    assert!(seen.damage().contains("read up to message"), "{}", seen.damage());
}

#[test]
fn parts_of_a_recording_are_one_and_sorted_as_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let messages = run();
    for (part, chunk) in messages.chunks(4).enumerate() {
        std::fs::write(path(&format!("run_{part}.bag")), bag(chunk, "lz4", 10, true)).unwrap();
    }
    let found = find(folder.path()).unwrap();
    assert_eq!(found.len(), 1);
    let names: Vec<_> = found[0].files.iter().map(|p| p.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!((names[0], names[2], names[10]), ("run_0.bag", "run_2.bag", "run_10.bag"));
    check(&read(&found[0]).unwrap(), &messages, 0);
    std::fs::write(path("other.bag"), bag(&messages, "none", 10, true)).unwrap();
    assert_eq!(find(folder.path()).unwrap().len(), 2);
    std::fs::create_dir(path("mav0")).unwrap();
    assert!(find(folder.path()).unwrap().is_empty(), "a bag beside EuRoC's own files");
}

#[test]
fn a_description_names_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let describe = |text: &str| {
        std::fs::write(path("metadata.yaml"), format!("rosbag2_bagfile_information:\n{text}")).unwrap();
    };
    let messages = run();
    db3(&path("b.db3"), &messages[..20], true);
    db3(&path("a.db3"), &messages[20..], true);
    describe(
        "  compression_format: zstd\n  compression_mode: MESSAGE\n  relative_file_paths: [b.db3, a.db3]\n",
    );
    let found = find(folder.path()).unwrap();
    assert!(found.len() == 1 && found[0].compressed_messages);
    check(&read(&found[0]).unwrap(), &messages, 1);
    assert!(find(&path("a.db3")).unwrap()[0].compressed_messages, "a file alone is described too");
    describe("  relative_file_paths: [c.db3]\n");
    assert!(find(folder.path()).unwrap_err().to_string().contains("names c.db3, which is missing"));
    describe("  compression_format: gz\n  compression_mode: message\n  relative_file_paths: [a.db3]\n");
    assert!(find(folder.path()).unwrap_err().to_string().contains("unknown compression `gz`"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn no_damage_makes_it_panic(
        which in 0..4_usize, hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let messages = run();
        let mut bytes = match which {
            0 => bag(&messages, "none", 10, true),
            1 => bag(&messages, "lz4", 10, true),
            2 => bag(&messages, "bz2", 20, false),
            _ => mcap(&messages),
        };
        for (at, value) in hits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(seen) = read_bytes(&bytes) {
            for (_, _, locator) in &seen.all.seen {
                let _ = seen.recording.read(locator);
            }
        }
    }
}
