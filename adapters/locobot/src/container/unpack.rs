//! Files that cannot be read where they are: compressed as a whole, or left by a recorder that was killed with messages
//! in sqlite's log. They are copied into the temporary folder, which nobody but this program writes to, and the copy goes
//! when the recording is closed. Nothing is written beside the recording, and memory does not grow with the file.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use vice_core::budget::Budget;
use vice_core::error::{DataError, DataResult};

/// What a file starts with that is compressed with zstd.
pub(super) const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
/// Endings of such files.
const ZSTD_ENDINGS: [&str; 2] = [".zstd", ".zst"];
/// How many times its own size a file may unpack to, beyond [`UNPACKED_BYTES`].
const UNPACKED_TIMES: u64 = 100;
/// Bytes that any file may unpack to.
const UNPACKED_BYTES: u64 = 256 << 20;
/// Bytes that any message may unpack to, and how many times its size a larger one may.
const MESSAGE_BYTES: u64 = 64 << 20;
const MESSAGE_TIMES: u64 = 64;
/// Bytes of a data base beyond which it is not copied for the sake of its log.
const MAX_COPY_BYTES: u64 = 16 << 30;
/// What sqlite puts behind the name of a data base: the log of what is not in it yet, and that of what is to be undone.
const LOGS: [&str; 2] = ["-wal", "-journal"];

/// A copy, and where it is.
#[derive(Debug)]
pub(super) struct Copy {
    /// The copied file.
    pub(super) path: PathBuf,
    /// Removed with everything in it when this is dropped.
    _folder: TempDir,
    /// What went wrong at the end of the file, where it could be read up to there.
    pub(super) damage: Option<String>,
}

/// The name of a file without an ending that says that it is compressed.
pub(super) fn unpacked_name(name: &str) -> &str {
    ZSTD_ENDINGS.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name)
}

/// The names under which a file may lie that was packed or unpacked since it was named.
pub(super) fn other_names(name: &str) -> Vec<String> {
    match unpacked_name(name) {
        plain if plain != name => vec![plain.to_string()],
        plain => ZSTD_ENDINGS.iter().map(|ending| format!("{plain}{ending}")).collect(),
    }
}

/// The first bytes of what a compressed file holds.
pub(super) fn head(path: &Path, bytes: u64) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    zstd::stream::read::Decoder::new(File::open(path)?)?.take(bytes).read_to_end(&mut head)?;
    Ok(head)
}

/// Unpacks a file that is compressed as a whole. One that breaks off is unpacked as far as it goes.
///
/// # Errors
/// [`DataError`] if it cannot be unpacked, or to much more than such files hold.
pub(super) fn unpack(path: &Path) -> DataResult<Copy> {
    let failed = |e: io::Error| {
        DataError::new("the file is compressed as a whole and cannot be unpacked into the temporary folder")
            .at(path)
            .hint("unpack it with `zstd -d`, or set TMPDIR to a folder with room")
            .because(e)
    };
    let stored = path.metadata().map_err(failed)?.len();
    let usual = UNPACKED_BYTES.max(stored.saturating_mul(UNPACKED_TIMES));
    let limit = Budget::in_use().most(usual);
    let folder = tempfile::tempdir().map_err(failed)?;
    let copy = folder.path().join("unpacked");
    let mut out = File::create(&copy).map_err(failed)?;
    let decoder = zstd::stream::read::Decoder::new(File::open(path).map_err(failed)?).map_err(failed)?;
    let mut decoder = decoder.take(limit + 1);
    let mut buffer = vec![0; 1 << 20];
    let mut done = 0_u64;
    let damage = loop {
        match decoder.read(&mut buffer) {
            Ok(0) => break None,
            Ok(n) => {
                out.write_all(&buffer[..n]).map_err(failed)?;
                done += n as u64;
            }
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) if done == 0 => return Err(failed(e)),
            Err(e) => {
                break Some(format!(
                    "the compressed file is damaged or cut off: read as far as it goes: {e}"
                ));
            }
        }
    };
    if done > limit {
        let problem =
            format!("the compressed file of {stored} bytes unpacks to more than the budget of {limit} bytes");
        let raised = Budget::raised(2 * limit, usual);
        return Err(DataError::new(problem)
            .at(path)
            .hint(format!("if that is right, unpack it with `zstd -d`, or {raised}")));
    }
    Ok(Copy { path: copy, _folder: folder, damage })
}

/// Whether sqlite has left something beside a data base that is not merged into it.
pub(super) fn has_log(path: &Path) -> bool {
    LOGS.iter().any(|log| beside(path, log).metadata().is_ok_and(|m| m.is_file() && m.len() > 0))
}

/// The log of a data base, for a message.
pub(super) fn log_of(path: &Path) -> PathBuf {
    let logs = LOGS.iter().map(|log| beside(path, log));
    logs.into_iter().find(|log| log.exists()).unwrap_or_else(|| path.to_path_buf())
}

/// Copies a data base with what sqlite left beside it, so that sqlite can merge them there.
pub(super) fn with_log(path: &Path) -> io::Result<Copy> {
    let bytes = path.metadata()?.len();
    if bytes > MAX_COPY_BYTES {
        return Err(io::Error::other(format!("its {bytes} bytes are too many to be copied")));
    }
    let folder = tempfile::tempdir()?;
    let copy = folder.path().join("copy.db3");
    io::copy(&mut File::open(path)?, &mut File::create(&copy)?)?;
    for log in LOGS {
        let from = beside(path, log);
        if from.is_file() {
            io::copy(&mut File::open(from)?, &mut File::create(beside(&copy, log))?)?;
        }
    }
    if bytes == 0 {
        // Beside an empty file sqlite takes the log for a leftover and deletes it.
        first_page(&copy)?;
    }
    Ok(Copy { path: copy, _folder: folder, damage: None })
}

/// Writes the first page of a data base that its log has.
fn first_page(path: &Path) -> io::Result<()> {
    const HEADER: u64 = 32;
    const FRAME_HEADER: u64 = 24;
    let mut log = File::open(beside(path, "-wal"))?;
    let word = |log: &mut File, at: u64| -> io::Result<u32> {
        let mut bytes = [0; 4];
        log.seek(SeekFrom::Start(at))?;
        log.read_exact(&mut bytes)?;
        Ok(u32::from_be_bytes(bytes))
    };
    let page_bytes = word(&mut log, 8)?;
    if !page_bytes.is_power_of_two() || !(512..=65_536).contains(&page_bytes) {
        return Ok(());
    }
    let mut at = HEADER;
    while let Ok(page) = word(&mut log, at) {
        if page == 1 {
            let mut bytes = vec![0; page_bytes as usize];
            log.seek(SeekFrom::Start(at + FRAME_HEADER))?;
            log.read_exact(&mut bytes)?;
            return std::fs::write(path, bytes);
        }
        at += FRAME_HEADER + u64::from(page_bytes);
    }
    Ok(())
}

fn beside(path: &Path, log: &str) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(log);
    PathBuf::from(name)
}

/// A message as it was before it was compressed by itself, where it was: CDR never starts with these bytes.
pub(super) fn message(bytes: &[u8], limit: u64) -> io::Result<Option<Vec<u8>>> {
    if !bytes.starts_with(ZSTD_MAGIC) {
        return Ok(None);
    }
    let mut plain = Vec::new();
    let most = most_of_message(bytes.len() as u64);
    let mut decoder = zstd::stream::read::Decoder::new(bytes)?.take(limit.min(most + 1));
    decoder.read_to_end(&mut plain)?;
    if plain.len() as u64 > most {
        return Err(io::Error::other(too_much(bytes.len() as u64)));
    }
    Ok(Some(plain))
}

/// The most bytes that a message of so many compressed ones may unpack to.
pub(super) fn most_of_message(stored: u64) -> u64 {
    Budget::in_use().most(usual_of_message(stored))
}

/// Bytes of messages beyond the usual after which none of a file is unpacked any more.
pub(super) fn most_beyond_usual() -> u64 {
    Budget::in_use().most(UNPACKED_BYTES)
}

/// How much of what a message of so many bytes unpacked to is beyond the usual.
pub(super) fn beyond_usual(stored: u64, unpacked: u64) -> u64 {
    unpacked.saturating_sub(stored.saturating_mul(MESSAGE_TIMES))
}

/// What is said of a message that unpacks to more.
pub(super) fn too_much(stored: u64) -> String {
    let (most, usual) = (most_of_message(stored), usual_of_message(stored));
    let raised = Budget::raised(most.saturating_mul(2), usual);
    format!("a message of {stored} bytes unpacks to more than the budget of {most} ({raised})")
}

fn usual_of_message(stored: u64) -> u64 {
    MESSAGE_BYTES.max(stored.saturating_mul(MESSAGE_TIMES))
}
