//! How fast recordings are read, against the bare decompression of their chunks and against Python's `rosbags`.
//!
//! ```text
//! python3 -m venv /tmp/venv && /tmp/venv/bin/pip install rosbags numpy
//! VICE_PYTHON=/tmp/venv/bin/python cargo bench -p vice-benches --bench bags
//! ```
//!
//! Not a criterion benchmark: what counts are ratios of times taken in turn in one run, of which the best is taken.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout)]

use std::hint::black_box;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use vice_core::dataset::{Dataset, DatasetFactory, OpenOptions};
use vice_locobot::Locobot;

const RECORDINGS: [&str; 5] = [
    "locobot_ros1.bag",
    "locobot_ros1_compressed.bag",
    "locobot_raw3.bag",
    "locobot_ros2_mcap/locobot_ros2.mcap",
    "locobot_ros2_db3/locobot_ros2_db3.db3",
];
/// Rounds and seconds of a recording at least: the best of many survives a machine that others use too.
const ROUNDS: usize = 15;
const SECONDS: f64 = 8.0;

/// Decodes all small messages, and decompresses all chunks and nothing else; prints both times in seconds.
const PYTHON: &str = r#"
import bz2, struct, sys, time
from pathlib import Path
import lz4.frame
try:
    from compression import zstd
except ImportError:
    from backports import zstd
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
path = Path(sys.argv[1])
source = path.parent if path.suffix in ('.mcap', '.db3') else path
topics = {'/tf', '/tf_static', '/odom', '/camera/color/camera_info'}
def small():
    t = time.perf_counter()
    with AnyReader([source], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        chosen = [c for c in reader.connections if c.topic in topics]
        n = 0
        for connection, _, raw in reader.messages(connections=chosen):
            reader.deserialize(raw, connection.msgtype)
            n += 1
    return time.perf_counter() - t, n
def chunks():
    data, found, at = path.read_bytes(), [], 13
    if path.suffix == '.db3':
        return found
    if path.suffix == '.mcap':
        at = 8
        while at < len(data) - 8:
            op, size = struct.unpack_from('<BQ', data, at)
            if op == 6:
                name = struct.unpack_from('<I', data, at + 37)[0]
                found.append((zstd.decompress, data[at + 49 + name:at + 9 + size]))
            at += 9 + size
        return found
    while at < len(data):
        head = struct.unpack_from('<I', data, at)[0]
        fields, body = data[at + 4:at + 4 + head], at + 8 + head
        size = struct.unpack_from('<I', data, body - 4)[0]
        if b'op=\x05' in fields:
            how = bz2.decompress if b'=bz2' in fields else lz4.frame.decompress
            found.append((how, data[body:body + size]))
        at = body + size
    return found
found = chunks()
def bare():
    t = time.perf_counter()
    for how, chunk in found:
        how(chunk)
    return time.perf_counter() - t
rounds = [(small(), bare()) for _ in range(12)]
print(min(s[0] for s, _ in rounds), min(b for _, b in rounds), rounds[0][0][1])
"#;

/// A chunk and the decompressor it needs.
enum Chunk {
    Bz2(Vec<u8>),
    Lz4(Vec<u8>),
    Zstd(Vec<u8>, usize),
}

impl Chunk {
    fn decompress(&self, out: &mut Vec<u8>) {
        out.clear();
        match self {
            Self::Bz2(bytes) => {
                bzip2::read::BzDecoder::new(&bytes[..]).read_to_end(out).unwrap();
            }
            Self::Lz4(bytes) => {
                lz4::Decoder::new(&bytes[..]).unwrap().read_to_end(out).unwrap();
            }
            Self::Zstd(bytes, size) => {
                out.reserve(*size);
                zstd::bulk::Decompressor::new().unwrap().decompress_to_buffer(bytes, out).unwrap();
            }
        }
    }
}

/// The compressed chunks of a file, found without the adapter.
fn chunks(path: &Path) -> Vec<Chunk> {
    let data = std::fs::read(path).unwrap();
    let word = |at: usize| u32::from_le_bytes(data[at..at + 4].try_into().unwrap()) as usize;
    let long = |at: usize| u64::from_le_bytes(data[at..at + 8].try_into().unwrap()) as usize;
    let mut chunks = Vec::new();
    match path.extension().and_then(|e| e.to_str()) {
        Some("mcap") => {
            let mut at = 8;
            while at + 17 < data.len() {
                let end = at + 9 + long(at + 1);
                if data[at] == 6 {
                    let content = at + 49 + word(at + 37);
                    chunks.push(Chunk::Zstd(data[content..end].to_vec(), long(at + 25)));
                }
                at = end;
            }
        }
        Some("bag") => {
            let mut at = 13;
            while at < data.len() {
                let fields = &data[at + 4..at + 4 + word(at)];
                let body = at + 8 + word(at);
                let end = body + word(body - 4);
                let has = |needle: &[u8]| fields.windows(needle.len()).any(|w| w == needle);
                if has(b"op=\x05") {
                    let bytes = data[body..end].to_vec();
                    chunks.push(if has(b"=bz2") { Chunk::Bz2(bytes) } else { Chunk::Lz4(bytes) });
                }
                at = end;
            }
        }
        _ => {}
    }
    chunks
}

fn seconds(mut work: impl FnMut()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn open(path: &Path) -> Box<dyn Dataset> {
    Locobot.open(path, &OpenOptions::default()).unwrap()
}

fn python(path: &Path) -> Option<[f64; 3]> {
    let program = std::env::var_os("VICE_PYTHON")?;
    let output =
        Command::new(program).args(["-c", PYTHON]).arg(path).output().expect("VICE_PYTHON can be run");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let numbers: Vec<f64> = text.split_whitespace().map(|w| w.parse().unwrap()).collect();
    Some(numbers.try_into().unwrap())
}

fn main() {
    // As criterion does: a filter on the command line leaves out what it does not name.
    let filters: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    if !filters.iter().all(|f| "bags".contains(f.as_str())) {
        return;
    }
    // One thread, so that the time of decompression can be taken off that of the index pass.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let shared = std::env::var_os("VICE_SHARED").map_or_else(|| PathBuf::from("../../shared"), PathBuf::from);
    for name in RECORDINGS {
        let path = shared.join("data/locobot").join(name);
        if !path.exists() {
            println!("skipped: {} is missing", path.display());
            continue;
        }
        let (chunks, mut out) = (chunks(&path), Vec::new());
        let data = open(&path);
        let camera = data.cameras().remove(0);
        let n = data.frames(&camera).unwrap().len();
        let mut best = [f64::INFINITY; 4];
        let start = Instant::now();
        for _ in (0..).take_while(|round| *round < ROUNDS || start.elapsed().as_secs_f64() < SECONDS) {
            let times = [
                seconds(|| chunks.iter().for_each(|c| c.decompress(black_box(&mut out)))),
                seconds(|| drop(black_box(open(&path)))),
                seconds(|| (0..n).for_each(|i| drop(black_box(data.image(&camera, i).unwrap())))),
                seconds(|| {
                    for i in 0..n {
                        black_box(data.image(&camera, i).unwrap());
                        black_box(data.depth_image(&camera, i).unwrap());
                    }
                }),
            ];
            best = std::array::from_fn(|i| best[i].min(times[i]));
        }
        let [bare, open_s, color, both] = best.map(|s| s * 1e3);
        println!("{name}");
        println!("  bare decompression of all chunks  {bare:9.3} ms");
        println!("  index pass                        {open_s:9.3} ms");
        println!(
            "  all {n:2} colour images              {color:9.3} ms, {:6.2} of the bare speed",
            bare / color
        );
        println!(
            "  all {n:2} colour and depth images    {both:9.3} ms, {:6.2} of the bare speed",
            bare / both
        );
        if let Some([theirs, their_bare, messages]) = python(&path) {
            let (theirs, their_bare) = (theirs * 1e3, their_bare * 1e3);
            println!(
                "  rosbags: {messages} small messages {theirs:9.3} ms, {their_bare:.3} ms of it bare decompression"
            );
            let (theirs, ours) = (theirs - their_bare, open_s - bare);
            // Where decompression is nearly all of the time, the difference of two such times is noise.
            if theirs > 0.1 * their_bare && ours > 0.01 * bare {
                println!("  rosbags takes {:.1} times as long, decompression taken off both", theirs / ours);
            }
        }
    }
}
