//! The index of a QuickTime or MP4 film: how many frames, when each is shown, and where decoding may start.
//!
//! It lies in the `moov` box and is read without FFmpeg and without touching the pictures, so that a film's frames can
//! be counted where nothing can decode them. Layout: ISO/IEC 14496-12. Only the first video track is looked at, as with
//! FFmpeg's `0:v:0`. Edit lists are left aside here and by the decoder: every stored frame is a frame.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use vice_core::budget::Budget;
use vice_core::error::{DataError, DataResult};
use vice_files::elsewhere::{self, Reader};

/// Bytes of `moov` beyond which a film is refused; nine hours at 120 frames a second need about 80 MB.
const MAX_INDEX_BYTES: u64 = 96 << 20;
/// Frames beyond which a film is refused: nine hours at 120 frames a second.
const MAX_FRAMES: u64 = 4_000_000;
/// Pixels that a byte of a frame can stand for where all frames have one size: such films are not compressed, or little.
const MAX_PIXELS_PER_BYTE: u64 = 256;

/// A frame at which decoding may start, in ticks of the track's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SyncFrame {
    /// When it is shown.
    pub(crate) shown: i64,
    /// When it is handed to the decoder: what FFmpeg's seeking goes by.
    pub(crate) decoded: i64,
}

/// What a film's index says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MovIndex {
    /// Columns and rows as shown, a phone's quarter turn applied.
    pub(crate) size: (u32, u32),
    /// Ticks in a second.
    pub(crate) ticks_per_second: u32,
    /// When each frame is shown, in ticks, strictly increasing: the position is the frame's index.
    pub(crate) shown: Vec<i64>,
    /// Frames at which decoding may start, by the time they are shown.
    pub(crate) sync: Vec<SyncFrame>,
}

impl MovIndex {
    /// Seconds of a tick.
    pub(crate) fn seconds(&self, ticks: i64) -> f64 {
        ticks as f64 / f64::from(self.ticks_per_second)
    }
}

/// Reads the index of a film.
///
/// # Errors
/// [`DataError`] with the byte offset if the file is no regular file, is cut off, or its index contradicts itself.
pub(crate) fn read(path: &Path) -> DataResult<MovIndex> {
    let failed = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::new("no such film").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    };
    if let Some(film) = elsewhere::find(path)? {
        let length = film.size_bytes();
        return index(&mut Reader::new(film), length).map_err(failed).flatten().map_err(|e| e.at(path));
    }
    let meta = std::fs::metadata(path).map_err(failed)?;
    if !meta.is_file() {
        return Err(DataError::new("is not a file").at(path));
    }
    let mut file = File::open(path).map_err(failed)?;
    index(&mut file, meta.len()).map_err(failed).flatten().map_err(|e| e.at(path))
}

fn index(file: &mut (impl Read + Seek), length: u64) -> std::io::Result<DataResult<MovIndex>> {
    Ok(find_index(file, length)?.and_then(|moov| parse_index(&moov, length)))
}

/// Walks the outermost boxes and gives the content of `moov`.
fn find_index(file: &mut (impl Read + Seek), length: u64) -> std::io::Result<DataResult<Vec<u8>>> {
    let mut at = 0_u64;
    let mut moov = None;
    while at < length {
        if length - at < 8 {
            return Ok(Err(cut_off(at, "in the header of a box")));
        }
        file.seek(SeekFrom::Start(at))?;
        let mut head = [0_u8; 16];
        let head_length = if length - at < 16 { 8 } else { 16 };
        file.read_exact(&mut head[..head_length])?;
        let kind: [u8; 4] = [head[4], head[5], head[6], head[7]];
        if at == 0 && !matches!(&kind, b"ftyp" | b"moov" | b"mdat" | b"wide" | b"free" | b"skip" | b"pnot") {
            return Ok(Err(DataError::new("is no QuickTime or MP4 film").hint(REMUX)));
        }
        let (header, size) = match be32(&head, 0).unwrap_or_default() {
            0 => (8, length - at),
            1 if head_length == 16 => (16, be64(&head, 8).unwrap_or_default()),
            size => (8, u64::from(size)),
        };
        if size < header {
            return Ok(Err(DataError::new("a box is shorter than its own header").byte(at)));
        }
        if size > length - at {
            let name = String::from_utf8_lossy(&kind).into_owned();
            let there = length - at;
            return Ok(Err(cut_off(at, &format!("box `{name}` has {size} bytes, only {there} are there"))));
        }
        if &kind == b"moof" {
            return Ok(Err(DataError::new("is a fragmented film, whose frames have no index").hint(REMUX)));
        }
        if &kind == b"moov" && moov.is_none() {
            if let Err(error) = Budget::in_use().check(size, "bytes of an index", MAX_INDEX_BYTES) {
                return Ok(Err(error.byte(at)));
            }
            // The size is within the file, so memory is taken for what is there.
            let mut content = vec![0; (size - header) as usize];
            file.seek(SeekFrom::Start(at + header))?;
            file.read_exact(&mut content)?;
            moov = Some(content);
        }
        at += size;
    }
    Ok(moov.ok_or_else(|| {
        DataError::new("has no index (`moov`): the film is cut off, or recording was never finished")
    }))
}

const REMUX: &str = "`ffmpeg -i FILM -c copy film.mov` writes one that can be read";

fn cut_off(at: u64, what: &str) -> DataError {
    DataError::new(format!("the film is cut off: {what}")).byte(at)
}

fn parse_index(moov: &[u8], file_length: u64) -> DataResult<MovIndex> {
    let video = boxes(moov).filter(|(kind, _)| kind == b"trak").find(|(_, track)| {
        find(track, &[b"mdia", b"hdlr"]).and_then(|hdlr| hdlr.get(8..12)) == Some(b"vide")
    });
    let (_, track) = video.ok_or_else(|| DataError::new("holds no video"))?;
    let need = |path: &[&[u8; 4]]| {
        let name = path.last().map_or_else(String::new, |n| String::from_utf8_lossy(*n).into_owned());
        find(track, path).ok_or_else(|| DataError::new(format!("its video has no `{name}` box")))
    };
    let short = |name: &str| DataError::new(format!("its `{name}` box is too short"));

    let mdhd = need(&[b"mdia", b"mdhd"])?;
    let clock_at = if mdhd.first() == Some(&1) { 20 } else { 12 };
    let ticks_per_second = be32(mdhd, clock_at).ok_or_else(|| short("mdhd"))?;
    if ticks_per_second == 0 {
        return Err(DataError::new("its clock has no ticks"));
    }
    let stsd = need(&[b"mdia", b"minf", b"stbl", b"stsd"])?;
    // Count (8 bytes with version), then the first entry: size, format, 6 + 2 + 16 bytes, width, height.
    let stored = be16(stsd, 8 + 32).zip(be16(stsd, 8 + 34)).ok_or_else(|| short("stsd"))?;
    let tkhd = need(&[b"tkhd"])?;
    let matrix_at = if tkhd.first() == Some(&1) { 52 } else { 40 };
    let turned = be32(tkhd, matrix_at) == Some(0) && be32(tkhd, matrix_at + 16) == Some(0);
    let (width, height) = (u32::from(stored.0), u32::from(stored.1));
    let size = if turned { (height, width) } else { (width, height) };

    let stsz = need(&[b"mdia", b"minf", b"stbl", b"stsz"])?;
    let each = be32(stsz, 4).ok_or_else(|| short("stsz"))?;
    let count = be32(stsz, 8).ok_or_else(|| short("stsz"))? as usize;
    // Frames cannot outnumber what the file has room for: a table of sizes, or bytes of that size.
    let room = if each == 0 { (stsz.len() - 12) as u64 / 4 } else { file_length / u64::from(each) };
    if count as u64 > room {
        return Err(DataError::new(format!("its index promises {count} frames, there is room for {room}")));
    }
    // Empty room is cheap: a file may be sparse. So what is promised must be a film that somebody could have taken.
    Budget::in_use().check(count as u64, "frames that its index promises", MAX_FRAMES)?;
    if each != 0 && u64::from(each) * MAX_PIXELS_PER_BYTE < u64::from(width) * u64::from(height) {
        return Err(DataError::new(format!(
            "its index says that each frame has {each} bytes: too few for {width}x{height} pixels"
        )));
    }
    let stbl = |name| find(track, &[b"mdia", b"minf", b"stbl", name]);
    let decoded = decode_times(need(&[b"mdia", b"minf", b"stbl", b"stts"])?, count)?;
    let offsets = match stbl(b"ctts") {
        Some(ctts) => shown_offsets(ctts, count)?,
        None => vec![0; count],
    };
    // FFmpeg moves decoding times back so that none lies after its frame is shown.
    let shift = -offsets.iter().copied().min().unwrap_or(0).min(0);
    let frame = |i: usize| SyncFrame { shown: decoded[i] + offsets[i], decoded: decoded[i] - shift };
    let mut shown: Vec<i64> = (0..count).map(|i| frame(i).shown).collect();
    shown.sort_unstable();
    if let Some(i) = shown.windows(2).position(|w| w[0] == w[1]) {
        return Err(DataError::new(format!("its frames {i} and {} are shown at the same time", i + 1)));
    }
    let mut sync: Vec<SyncFrame> = match stbl(b"stss") {
        Some(stss) => entries::<4>(stss)
            .filter_map(|e| be32(e, 0)?.checked_sub(1))
            .filter(|i| (*i as usize) < count)
            .map(|i| frame(i as usize))
            .collect(),
        None => (0..count).map(frame).collect(),
    };
    sync.sort_unstable_by_key(|s| s.shown);
    Ok(MovIndex { size, ticks_per_second, shown, sync })
}

/// Decoding times from runs of (count, ticks).
fn decode_times(stts: &[u8], count: usize) -> DataResult<Vec<i64>> {
    let mut times = Vec::with_capacity(count);
    let mut now = 0_i64;
    for entry in entries::<8>(stts) {
        let (run, ticks) = (be32(entry, 0).unwrap_or(0), be32(entry, 4).unwrap_or(0));
        for _ in 0..run {
            if times.len() == count {
                break;
            }
            times.push(now);
            now += i64::from(ticks);
        }
    }
    full(times, count, "stts")
}

/// How much later than decoded each frame is shown, from runs of (count, ticks).
fn shown_offsets(ctts: &[u8], count: usize) -> DataResult<Vec<i64>> {
    let mut offsets = Vec::with_capacity(count);
    for entry in entries::<8>(ctts) {
        // Signed in version 1, and written signed by many in version 0.
        let (run, ticks) = (be32(entry, 0).unwrap_or(0) as usize, be32(entry, 4).unwrap_or(0) as i32);
        let run = run.min(count - offsets.len());
        offsets.extend(std::iter::repeat_n(i64::from(ticks), run));
    }
    full(offsets, count, "ctts")
}

fn full(values: Vec<i64>, count: usize, name: &str) -> DataResult<Vec<i64>> {
    if values.len() == count {
        Ok(values)
    } else {
        let got = values.len();
        Err(DataError::new(format!("its `{name}` box covers {got} of {count} frames")))
    }
}

/// The entries of a full box: version and flags, a count, then that many entries of `N` bytes, as far as they are there.
fn entries<const N: usize>(full_box: &[u8]) -> impl Iterator<Item = &[u8]> {
    let promised = be32(full_box, 4).unwrap_or(0) as usize;
    full_box.get(8..).unwrap_or_default().chunks_exact(N).take(promised)
}

/// The boxes that follow each other in `bytes`; stops at the first that does not fit.
fn boxes(mut bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    std::iter::from_fn(move || {
        let size = be32(bytes, 0)? as usize;
        let kind = bytes.get(4..8)?.try_into().ok()?;
        let content = bytes.get(8..size)?;
        bytes = &bytes[size..];
        Some((kind, content))
    })
}

/// The first box along a path of names.
fn find<'a>(bytes: &'a [u8], path: &[&[u8; 4]]) -> Option<&'a [u8]> {
    path.iter().try_fold(bytes, |within, name| boxes(within).find(|(kind, _)| kind == *name).map(|(_, b)| b))
}

fn be16(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}

fn be32(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

fn be64(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_be_bytes(bytes.get(at..at + 8)?.try_into().ok()?))
}

#[cfg(test)]
mod tests;
