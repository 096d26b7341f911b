//! What is fuzzed: each parser, and whole small recordings, as functions of bytes.
//!
//! `fuzz/` calls them from libFuzzer, where a nightly compiler is there; the tests replay its stored inputs with any
//! compiler, and change them a little by themselves ([`mutate`]). A target must not panic, and must not take longer or
//! more memory than `fuzz/run` allows, whatever the bytes are.

use std::fs;
use std::path::Path;

use vice_core::dataset::{Dataset, DatasetFactory, OpenOptions, Probe};
use vice_core::random::SplitMix;
use vice_core::time::Stamp;
use vice_depth::CloudOptions;
use vice_files::calibration::CalibrationFile;
use vice_files::labels::{self, TracksOptions};
use vice_files::vice_toml::ViceToml;
use vice_files::{image_file, imu_file, rigid_file, tables, trajectory};

/// A parser.
pub struct Target {
    /// Its name, which is that of its folder of stored inputs.
    pub name: &'static str,
    /// The name of the file that the bytes are put into, which some formats are told by.
    file: &'static str,
    read: fn(&Path, &[u8]),
}

/// All targets, by name.
pub const TARGETS: [Target; 21] = [
    Target { name: "bag", file: "a.bag", read: |path, _| recording(&vice_locobot::Locobot, path) },
    Target { name: "calibration", file: "a.yaml", read: |path, _| drop(CalibrationFile::read(path)) },
    Target { name: "calibration_toml", file: "a.toml", read: |path, _| drop(CalibrationFile::read(path)) },
    Target { name: "colmap", file: "a.bin", read: colmap },
    Target { name: "db3", file: "a.db3", read: |path, _| recording(&vice_locobot::Locobot, path) },
    Target { name: "film", file: "film.mov", read: film },
    Target { name: "imu", file: "a.csv", read: |path, _| drop(imu_file::read(path)) },
    Target { name: "labels", file: "a.csv", read: |path, _| drop(labels::read_file(path, Some(&STAMPS))) },
    Target { name: "labels_cvat", file: "a.xml", read: |_, bytes| drop(labels::read_cvat(bytes, &STAMPS)) },
    Target { name: "labels_json", file: "a.json", read: |_, bytes| drop(labels::read_json(bytes)) },
    Target { name: "labels_parquet", file: "a.parquet", read: |path, _| drop(labels::read_file(path, None)) },
    Target {
        name: "labels_pickle",
        file: "a.pickle",
        read: |_, bytes| drop(labels::read_pickle(bytes, &STAMPS)),
    },
    Target { name: "mcap", file: "a.mcap", read: |path, _| recording(&vice_locobot::Locobot, path) },
    Target { name: "mesh", file: "a.ply", read: |path, _| drop(vice_depth::Mesh::read(path)) },
    Target { name: "picture", file: "a.png", read: picture },
    Target { name: "rigid", file: "a.yaml", read: |path, _| drop(rigid_file::read_world_from_cloud(path)) },
    Target {
        name: "scan",
        file: "a.ply",
        read: |path, _| drop(vice_depth::read_scan_points(path, &cloud_options())),
    },
    Target { name: "table", file: "a.parquet", read: |path, _| drop(tables::read(path)) },
    Target { name: "tracks", file: "a.npz", read: tracks },
    Target { name: "trajectory", file: "a.txt", read: poses },
    Target {
        name: "vice_toml",
        file: "vice.toml",
        read: |_, bytes| drop(ViceToml::parse(&String::from_utf8_lossy(bytes))),
    },
];

/// Stamps of the frames that labels count.
const STAMPS: [Stamp; 4] = [
    Stamp::from_nanos(0),
    Stamp::from_nanos(50_000_000),
    Stamp::from_nanos(100_000_000),
    Stamp::from_nanos(150_000_000),
];

/// The target of a name.
///
/// # Panics
/// Where there is none.
pub fn target(name: &str) -> &'static Target {
    TARGETS.iter().find(|t| t.name == name).expect("a target of the list")
}

impl Target {
    /// Reads bytes, and whatever can be read then.
    ///
    /// # Panics
    /// Where the temporary folder cannot be written to, and where the parser panics: that is what is looked for.
    pub fn run(&self, bytes: &[u8]) {
        thread_local! {
            static FOLDER: tempfile::TempDir = tempfile::tempdir().expect("a temporary folder");
        }
        FOLDER.with(|folder| {
            let place = folder.path().join(self.name);
            fs::create_dir_all(&place).expect("a folder");
            let path = place.join(self.file);
            fs::write(&path, bytes).expect("a file");
            (self.read)(&path, bytes);
        });
    }
}

fn cloud_options() -> CloudOptions {
    CloudOptions { max_bytes: Some(64 << 20), ..CloudOptions::default() }
}

fn poses(path: &Path, _: &[u8]) {
    drop(trajectory::read(path, &trajectory::ReadOptions { index_as_seconds: true, ..Default::default() }));
    drop(trajectory::read_euroc(path));
    drop(trajectory::read_relative(path));
}

fn tracks(_: &Path, bytes: &[u8]) {
    if labels::is_tracks(bytes) {
        drop(labels::read_tracks(bytes, &STAMPS, [64, 48], &TracksOptions::default()));
    }
}

fn picture(_: &Path, bytes: &[u8]) {
    drop(image_file::decode_size(bytes));
    drop(image_file::decode(bytes));
    drop(image_file::decode_depth_png(bytes, Stamp::from_nanos(0), 0.001));
}

/// The bytes as each of the three files of a model, beside good ones of no entries.
fn colmap(path: &Path, bytes: &[u8]) {
    let Some(folder) = path.parent() else { return };
    for which in ["cameras.bin", "images.bin", "points3D.bin"] {
        for name in ["cameras.bin", "images.bin", "points3D.bin"] {
            let content: &[u8] = if name == which { bytes } else { &[0; 8] };
            fs::write(folder.join(name), content).expect("a file");
        }
        recording(&vice_images::Images, folder);
    }
}

fn film(path: &Path, _: &[u8]) {
    const DESCRIPTION: &str = "film = \"film.mov\"\nstamps = \"stamps.txt\"\n[camera]\nsize = [64, 48]\nintrinsics = [50.0, 50.0, 31.5, 23.5]\n";
    let Some(folder) = path.parent() else { return };
    fs::write(folder.join("vice-video.toml"), DESCRIPTION).expect("a file");
    fs::write(folder.join("stamps.txt"), "10\n20\n30\n40\n").expect("a file");
    // What decodes the pictures is FFmpeg, which is not looked at here: it would be asked about each film that is refused.
    let options = OpenOptions { settings: [("ffmpeg".to_string(), "no-such-program".to_string())].into() };
    if let Ok(film) = vice_video::Video.open(folder, &options) {
        drop(film.frames("camera"));
    }
}

/// Opens a recording and reads all that it has.
fn recording(format: &dyn DatasetFactory, path: &Path) {
    if format.probe(path) == Probe::No {
        return;
    }
    let Ok(dataset) = format.open(path, &OpenOptions::default()) else { return };
    read_all(dataset.as_ref());
}

fn read_all(dataset: &dyn Dataset) {
    for camera in dataset.cameras() {
        drop(dataset.camera(&camera));
        let Ok(frames) = dataset.frames(&camera) else { continue };
        for (index, stamp) in frames.iter().enumerate().take(4) {
            drop(dataset.image(&camera, index));
            drop(dataset.image_file(&camera, index));
            drop(dataset.depth_image(&camera, index));
            drop(dataset.body_from_camera(&camera, *stamp));
            drop(dataset.inertial_state(*stamp));
            drop(dataset.floor(*stamp));
        }
    }
    for stream in dataset.streams() {
        drop(dataset.trajectory(&stream));
    }
    drop((
        dataset.imu(),
        dataset.cloud(),
        dataset.mesh(),
        dataset.facts(),
        dataset.checks(),
        dataset.suspicions(),
    ));
}

/// An input that is a little different, the same for the same dice: bits, bytes and whole words are changed, parts are cut
/// out, doubled or put in from another input or from the words of a dictionary.
pub fn mutate(seed: &[u8], other: &[u8], words: &[Vec<u8>], dice: &mut SplitMix) -> Vec<u8> {
    const ODD: [u64; 9] = [0, 1, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, u64::MAX];
    let mut bytes = seed.to_vec();
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len() as u64 + 1) as usize;
        let rest = bytes.len() - at;
        let part = |bytes: &[u8], dice: &mut SplitMix| {
            let from = dice.below(bytes.len() as u64 + 1) as usize;
            let length = dice.below(64).min((bytes.len() - from) as u64) as usize;
            bytes[from..from + length].to_vec()
        };
        match dice.below(9) {
            0 if rest > 0 => bytes[at] ^= 1 << dice.below(8),
            1 if rest > 0 => bytes[at] = dice.below(256) as u8,
            2 | 3 => {
                let value = ODD[dice.below(ODD.len() as u64) as usize];
                let (long, size) = (value.to_le_bytes(), 1 << dice.below(4));
                let mut word = long[..size].to_vec();
                if dice.below(2) == 1 {
                    word.reverse();
                }
                let end = bytes.len().min(at + size);
                bytes.splice(at..end, word);
            }
            4 => bytes.truncate(at),
            5 => {
                let end = at + dice.below(64).min(rest as u64) as usize;
                drop(bytes.drain(at..end));
            }
            6 => {
                let again = part(&bytes, dice);
                bytes.splice(at..at, again);
            }
            7 => {
                let foreign = part(other, dice);
                bytes.splice(at..at, foreign);
            }
            _ => {
                let word =
                    words.get(dice.below(words.len().max(1) as u64) as usize).cloned().unwrap_or_default();
                let end = at + (word.len() * dice.below(2) as usize).min(rest);
                bytes.splice(at..end, word);
            }
        }
    }
    bytes
}
