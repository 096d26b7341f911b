//! Recordings as a recorder that was killed leaves them, and as users unpack them.

use super::*;
use std::path::Path;

/// Two parts of the run in a folder, in one of the storages, and what a description says of them.
struct Parts {
    folder: tempfile::TempDir,
    ending: &'static str,
}

impl Parts {
    fn new(ending: &'static str) -> Self {
        let parts = Self { folder: tempfile::tempdir().unwrap(), ending };
        for (i, messages) in run().chunks(run().len().div_ceil(2)).enumerate() {
            write(&parts.file(i), messages, ending);
        }
        parts
    }

    fn file(&self, i: usize) -> PathBuf {
        self.folder.path().join(format!("run_{i}.{}", self.ending))
    }

    fn describe(&self, files: &[&str], more: &str) {
        let files: String = files.iter().map(|f| format!("  - {f}\n")).collect();
        let files = if files.is_empty() {
            "  relative_file_paths: []\n".into()
        } else {
            format!("  relative_file_paths:\n{files}")
        };
        let text = format!("rosbag2_bagfile_information:\n{more}{files}");
        std::fs::write(self.folder.path().join("metadata.yaml"), text).unwrap();
    }

    fn open(&self) -> DataResult<Box<dyn Dataset>> {
        Locobot.open(self.folder.path(), &OpenOptions::default())
    }

    /// Opens it, and checks that all of the run is there.
    fn whole(&self) -> String {
        assert_eq!(Locobot.probe(self.folder.path()), Probe::Yes);
        let data = self.open().unwrap();
        let expected = open(&run());
        assert_eq!(data.frames("color").unwrap(), expected.frames("color").unwrap());
        for stream in expected.streams() {
            assert_eq!(data.trajectory(&stream).unwrap(), expected.trajectory(&stream).unwrap());
        }
        assert_eq!(data.image("color", 4).unwrap(), expected.image("color", 4).unwrap());
        doubts(data.as_ref())
    }
}

fn write(path: &Path, messages: &[Msg], ending: &str) {
    match ending {
        "db3" => db3(path, messages, false),
        "mcap" => std::fs::write(path, mcap(messages)).unwrap(),
        _ => std::fs::write(path, bag(messages, "lz4", 10, true)).unwrap(),
    }
}

fn pack(path: &Path, ending: &str) {
    let packed = zstd::encode_all(std::fs::File::open(path).unwrap(), 1).unwrap();
    std::fs::write(format!("{}.{ending}", path.display()), packed).unwrap();
    std::fs::remove_file(path).unwrap();
}

#[test]
fn parts_that_the_description_does_not_list_are_read() {
    for ending in ["db3", "mcap"] {
        let parts = Parts::new(ending);
        let names: Vec<String> = (0..2).map(|i| format!("run_{i}.{ending}")).collect();
        for listed in [&[names[0].as_str()][..], &[names[1].as_str()]] {
            parts.describe(listed, "");
            let text = parts.whole();
            assert!(text.contains("files-not-listed") && text.contains("read as well"), "{text}");
        }
        parts.describe(&[&names[0], &names[1]], "");
        assert_eq!(parts.whole(), "");
        write(&parts.folder.path().join(format!("other.{ending}")), &run(), ending);
        let text = parts.whole();
        assert!(text.contains(&format!("other.{ending} not listed and of another name: left out")), "{text}");
    }
}

#[test]
fn without_a_usable_description_the_parts_are_found() {
    for ending in ["db3", "mcap", "bag"] {
        let parts = Parts::new(ending);
        assert_eq!(parts.whole(), "");
        parts.describe(&[], "");
        assert!(parts.whole().contains("lists no file: left aside"));
        std::fs::write(parts.folder.path().join("metadata.yaml"), "").unwrap();
        assert!(parts.whole().contains("metadata-left-aside"));
    }
    // Messages that are compressed by themselves say so.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    db3(&path, &run(), true);
    assert_eq!(Locobot.open(&path, &OpenOptions::default()).unwrap().frames("color").unwrap().len(), 5);
}

#[test]
fn messages_that_are_compressed_by_themselves_are_read_from_mcap_too() {
    let pack = |m: Msg| {
        let packed = zstd::bulk::compress(&m.bytes[1], 1).unwrap();
        Msg { bytes: [Vec::new(), packed], ..m }
    };
    let packed: Vec<Msg> = run().into_iter().map(pack).collect();
    let data = Opened::new("run.mcap", &mcap(&packed)).open(&[]).unwrap();
    let plain = open(&run());
    assert_eq!(data.image("color", 3).unwrap(), plain.image("color", 3).unwrap());
    for stream in plain.streams() {
        assert_eq!(data.trajectory(&stream).unwrap(), plain.trajectory(&stream).unwrap());
    }
    assert_eq!(doubts(data.as_ref()), "");
}

#[test]
fn files_that_were_unpacked_or_packed_since_are_found() {
    let compressed = "  compression_format: zstd\n  compression_mode: FILE\n";
    for ending in ["db3", "mcap"] {
        for packed in ["zstd", "zst"] {
            let parts = Parts::new(ending);
            let names: Vec<String> = (0..2).map(|i| format!("run/run_{i}.{ending}.{packed}")).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            parts.describe(&names, compressed);
            assert_eq!(parts.whole(), "", "unpacked, as the hint says");
            pack(&parts.file(1), packed);
            assert_eq!(parts.whole(), "", "one of them only");
            pack(&parts.file(0), packed);
            assert_eq!(parts.whole(), "", "as it was recorded");
            parts.describe(&names[..1], compressed);
            assert!(parts.whole().contains("read as well"), "and not all listed");
            let plain = names[0].trim_end_matches(&format!(".{packed}")).to_string();
            parts.describe(&[&plain], "");
            assert!(parts.whole().contains("read as well"), "packed by hand afterwards");
            std::fs::remove_file(parts.folder.path().join("metadata.yaml")).unwrap();
            assert_eq!(parts.whole(), "");
        }
    }
    let parts = Parts::new("bag");
    pack(&parts.file(0), "zst");
    pack(&parts.file(1), "zst");
    assert_eq!(parts.whole(), "");
}

#[test]
fn a_packed_file_that_breaks_off_is_read_as_far_as_it_goes() {
    let messages: Vec<Msg> = run().into_iter().cycle().take(4000).collect();
    let packed = zstd::encode_all(mcap(&messages).as_slice(), 1).unwrap();
    let whole = Opened::new("run.mcap.zstd", &packed).open(&[]).unwrap();
    assert_eq!(doubts(whole.as_ref()).matches("recording-damaged").count(), 0);
    let cut = Opened::new("run.mcap.zstd", &packed[..packed.len() - 9]);
    let data = cut.open(&[]).unwrap();
    let text = doubts(data.as_ref());
    assert!(text.contains("run.mcap.zstd: the compressed file is damaged or cut off"), "{text}");
    assert!(!text.contains("unpacked:"), "no name of a copy: {text}");
    assert_eq!(data.frames("color").unwrap().len(), 5);
    // Zeros without end.
    let bomb = zstd::encode_all(std::io::Read::take(std::io::repeat(0), 64 << 20), 1).unwrap();
    let error = Opened::new("run.mcap.zstd", &bomb).open(&[]).err().unwrap().to_string();
    assert!(error.contains("run.mcap.zstd"), "{error}");
}

/// A data base whose recorder was killed: what sqlite had not merged is beside it.
fn killed(path: &Path, merged: &[Msg], log: &[Msg]) {
    let folder = tempfile::tempdir().unwrap();
    let live = folder.path().join("live.db3");
    let connection = rusqlite::Connection::open(&live).unwrap();
    connection.execute_batch("PRAGMA journal_mode = WAL; PRAGMA wal_autocheckpoint = 0").unwrap();
    crate::testing::fill_db3(&connection, merged, false);
    if !merged.is_empty() {
        connection.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)").unwrap();
    }
    crate::testing::fill_db3(&connection, log, false);
    std::fs::copy(&live, path).unwrap();
    let beside = |p: &Path| format!("{}-wal", p.display());
    std::fs::copy(beside(&live), beside(path)).unwrap();
}

#[test]
fn what_sqlite_had_not_merged_is_read() {
    let messages = run();
    for merged in [0, 1, 20, 30] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run_0.db3");
        killed(&path, &messages[..merged], &messages[merged..]);
        let before: Vec<Vec<u8>> = files(folder.path()).iter().map(|p| std::fs::read(p).unwrap()).collect();
        for place in [path.as_path(), folder.path()] {
            assert_eq!(Locobot.probe(place), Probe::Yes, "{merged} merged");
            let data = Locobot.open(place, &OpenOptions::default()).unwrap();
            assert_eq!(data.frames("color").unwrap().len(), 5, "{merged} merged");
            assert_eq!(data.trajectory("odom").unwrap(), open(&messages).trajectory("odom").unwrap());
            let text = doubts(data.as_ref());
            assert!(text.contains("run_0.db3-wal: the recorder was not stopped properly"), "{text}");
        }
        let after: Vec<Vec<u8>> = files(folder.path()).iter().map(|p| std::fs::read(p).unwrap()).collect();
        assert_eq!(before, after, "nothing beside the recording is written");
    }
    // All of it in the log, and a file that was never written to.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run_0.db3");
    killed(&path, &[], &messages);
    std::fs::write(&path, b"").unwrap();
    let data = Locobot.open(&path, &OpenOptions::default()).unwrap();
    assert_eq!(data.frames("color").unwrap().len(), 5);
    // A log that ends in the middle of a message is read up to the last whole one.
    let log = folder.path().join("run_0.db3-wal");
    let bytes = std::fs::read(&log).unwrap();
    std::fs::write(&log, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let n = Locobot.open(&path, &OpenOptions::default()).unwrap().frames("color").unwrap().len();
    assert!((1..5).contains(&n), "{n}");
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}
