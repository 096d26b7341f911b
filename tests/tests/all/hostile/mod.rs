//! What a day of attack found, as a table of tests. Each test is named after its row:
//!
//! | row | tests |
//! | --- | --- |
//! | a recording with one JSON or protobuf topic | `recordings::a_recording_with_one_json_or_protobuf_topic` |
//! | resources | `recordings::resources_*`, `pictures::resources_*`, `films::resources_*`, `scans::resources_*`, `labels::resources_*`, `texts::resources_*` |
//! | the annotator's token | `annotator::the_annotators_token_*` |
//! | connections | `annotator::connections_*` |
//! | the journal | `journal::the_journal_*` |
//! | two writers | `journal::two_writers_*` |
//! | plugins | `plugins::plugins_*` |
//! | leftovers | `leftovers::leftovers_*` |
//!
//! Resources: an input is read or refused below [`MOST_SECONDS`] and [`MOST_MB`], with a line that says why.

mod annotator;
mod films;
mod journal;
mod labels;
mod leftovers;
mod pictures;
mod plugins;
mod recordings;
mod scans;
mod texts;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use vice_tests::measured::{Measured, measured};
use vice_tests::vice_program;

/// Longest that an input may keep the program busy.
const MOST_SECONDS: f64 = 1.0;
/// Most memory that an input may cost.
const MOST_MB: f64 = 200.0;

/// Runs the program and holds it to the limits, whatever it says.
fn within_limits(what: &str, args: &[&str]) -> Measured {
    let ran = measured(Command::new(vice_program()).args(args));
    let said = format!("{what}: {}{}", ran.run.stdout, ran.run.stderr);
    assert!(ran.seconds() < MOST_SECONDS, "{:.2} s of {:.2} s: {said}", ran.seconds(), ran.wall_s);
    assert!(ran.peak_mb.is_nan() || ran.peak_mb < MOST_MB, "{:.0} MB: {said}", ran.peak_mb);
    assert!(
        [0, 1, 2, 3].contains(&ran.run.code) && !ran.run.stderr.contains("panicked"),
        "exit {}: {said}",
        ran.run.code
    );
    ran
}

/// The same, where the input must be refused with one line of error that holds some words.
fn refused(what: &str, args: &[&str], words: &[&str]) {
    let ran = within_limits(what, args);
    let errors: Vec<&str> = ran.run.stderr.lines().filter(|l| l.starts_with("error")).collect();
    assert!(
        ran.run.code != 0 && errors.len() == 1,
        "{what}: exit {}: {}{}",
        ran.run.code,
        ran.run.stdout,
        ran.run.stderr
    );
    for word in words {
        assert!(errors[0].contains(word), "{what}: `{word}` is not in: {}", errors[0]);
    }
}

/// A run in the EuRoC layout: five frames, whose pictures are files without bytes, and a ground truth.
struct Flight {
    folder: tempfile::TempDir,
}

const STAMPS: [i64; 5] = [
    1_403_715_280_562_142_976,
    1_403_715_280_612_143_104,
    1_403_715_280_662_142_976,
    1_403_715_280_712_143_104,
    1_403_715_280_762_142_976,
];

const SENSOR: &str = "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0, -1, 0, 0, -1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]\n\
    rate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [458.6, 457.3, 367.2, 248.4]\n\
    distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]\n";

impl Flight {
    fn new() -> Self {
        let flight = Self { folder: tempfile::tempdir().unwrap() };
        flight.write("run/mav0/cam0/sensor.yaml", SENSOR.as_bytes());
        let mut list = "#timestamp [ns],filename\n".to_string();
        let mut truth = "#timestamp\n".to_string();
        let mut labels = "point,timestamp_ns,u_px,v_px,keyframe\n".to_string();
        for (i, stamp) in STAMPS.iter().enumerate() {
            list += &format!("{stamp},{stamp}.png\n");
            truth += &format!("{stamp},{},0.0,2.0,1.0,0.0,0.0,0.0\n", 0.01 * i as f64);
            labels += &format!("0,{stamp},300,{},{}\n", 200 + i, u8::from(i == 0));
            flight.write(&format!("run/mav0/cam0/data/{stamp}.png"), b"");
        }
        flight.write("run/mav0/cam0/data.csv", list.as_bytes());
        flight.write("run/mav0/state_groundtruth_estimate0/data.csv", truth.as_bytes());
        flight.write("labels.csv", labels.as_bytes());
        flight
    }

    fn path(&self, relative: &str) -> PathBuf {
        self.folder.path().join(relative)
    }

    fn text(&self, relative: &str) -> String {
        self.path(relative).to_str().unwrap().to_string()
    }

    fn write(&self, relative: &str, bytes: &[u8]) {
        let path = self.path(relative);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    /// A file with a hole up to a length: it takes no room on the disk.
    fn write_sparse(&self, relative: &str, head: &[u8], length: u64) {
        self.write(relative, head);
        let file = fs::OpenOptions::new().write(true).open(self.path(relative)).unwrap();
        file.set_len(length).unwrap();
    }
}

/// The check sum of PNG and of ZIP.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    })
}

/// Zeros as a stream of zlib, at 160 of them a byte: repetitions of the longest kind that deflate has, in its fixed code.
fn zeros_packed(count: u64) -> Vec<u8> {
    let mut bits = Bits::default();
    // Final block, fixed code; a zero as it is.
    bits.low_first(0b011, 3);
    bits.high_first(0b0011_0000, 8);
    let (runs, rest) = ((count - 1) / 258, (count - 1) % 258);
    for _ in 0..runs {
        // 258 bytes that repeat the last one.
        bits.high_first(0b1100_0101, 8);
        bits.high_first(0, 5);
    }
    for _ in 0..rest {
        bits.high_first(0b0011_0000, 8);
    }
    bits.high_first(0, 7);
    let mut stream = vec![0x78, 0x01];
    stream.extend(bits.finish());
    // Adler's sum of zeros.
    stream.extend((((count % 65_521) as u32) << 16 | 1).to_be_bytes());
    stream
}

#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    held: u32,
    count: u32,
}

impl Bits {
    fn low_first(&mut self, value: u32, count: u32) {
        self.held |= value << self.count;
        self.count += count;
        while self.count >= 8 {
            self.bytes.push(self.held as u8);
            self.held >>= 8;
            self.count -= 8;
        }
    }

    fn high_first(&mut self, value: u32, count: u32) {
        self.low_first(value.reverse_bits() >> (32 - count), count);
    }

    fn finish(mut self) -> Vec<u8> {
        if self.count > 0 {
            self.bytes.push(self.held as u8);
        }
        self.bytes
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}
