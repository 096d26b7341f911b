//! Frames of a film, one at a time and in any order, each exactly the one that was asked for.
//!
//! FFmpeg runs as a child process and writes frames into a pipe as they are asked for; the pipe being full is what
//! stops it, so that a film of any length takes the memory of a few frames. Stepping forwards reads on and decodes each
//! frame once. A jump starts FFmpeg anew at the last frame before the target from which decoding can start. That the
//! frame is the right one is not a matter of trust in seeking: FFmpeg says for each frame when it is shown, in ticks of
//! the film's clock, and the film's own index says which frame that is.
//!
//! Pixels are FFmpeg's own conversion to 8 bit gray or RGB (`-pix_fmt gray`, `rgb24`). Gray is the luma plane; limited
//! range (16 to 235, what films mostly have) is stretched to 0 to 255.

use std::collections::{BTreeSet, VecDeque};
use std::ffi::OsString;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::{DataError, DataResult};
use vice_files::elsewhere;

use crate::ffmpeg::{Ffmpeg, Running};
use crate::mov::{self, MovIndex};

/// Frames ahead up to which reading on costs less than starting FFmpeg anew.
const READ_ON_FRAMES: usize = 32;
/// Frames and bytes that are kept, so that threads which ask for neighbours out of order do not send the decoder back.
const RECENT_FRAMES: usize = 8;
const RECENT_BYTES: usize = 32 << 20;
/// How long FFmpeg may take to say which frame it has written already.
const PATIENCE: Duration = Duration::from_secs(30);

/// A QuickTime or MP4 film.
#[derive(Debug)]
pub struct Film {
    path: PathBuf,
    index: MovIndex,
    format: PixelFormat,
    ffmpeg: Ffmpeg,
    state: Mutex<State>,
}

/// What decoding has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecodeStats {
    /// How often FFmpeg was started.
    pub starts: usize,
    /// How many frames came out of its pipe.
    pub frames: usize,
}

#[derive(Debug, Default)]
struct State {
    decoder: Option<Decoder>,
    recent: VecDeque<(usize, Image)>,
    stats: DecodeStats,
    said: BTreeSet<String>,
}

#[derive(Debug)]
struct Decoder {
    running: Running,
    /// Index of the frame that comes next, if none is broken.
    next: usize,
}

impl Film {
    /// Opens a film by its index; nothing is decoded, and FFmpeg is not needed yet.
    ///
    /// # Errors
    /// [`DataError`] if the file is missing, cut off, or no film of this kind. What FFmpeg has to say about the film is
    /// added where FFmpeg is installed.
    pub fn open(path: impl AsRef<Path>, format: PixelFormat, ffmpeg: Ffmpeg) -> DataResult<Self> {
        let path = path.as_ref();
        let index = mov::read(path).map_err(|e| with_words_of_ffmpeg(e, path, &ffmpeg))?;
        Ok(Self { path: path.to_path_buf(), index, format, ffmpeg, state: Mutex::default() })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.index.shown.len()
    }

    /// Columns and rows, as shown.
    pub fn size(&self) -> (u32, u32) {
        self.index.size
    }

    /// What decoding has cost so far.
    pub fn stats(&self) -> DecodeStats {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).stats
    }

    /// Decodes the frame with this index, counted from 0 in the order in which frames are shown.
    ///
    /// # Errors
    /// [`DataError`] if there is no such frame, FFmpeg is missing or too old, or cannot decode the frame: then with what
    /// it says.
    pub fn frame(&self, index: usize) -> DataResult<Image> {
        let count = self.frame_count();
        if index >= count {
            return Err(DataError::new(format!("there is no frame {index}, the film has {count}"))
                .at(&self.path)
                .hint("frames count from 0"));
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, image)) = state.recent.iter().find(|(i, _)| *i == index) {
            return Ok(image.clone());
        }
        self.decode(&mut state, index).map_err(|e| e.at(&self.path))
    }

    fn decode(&self, state: &mut State, index: usize) -> DataResult<Image> {
        // The decoder leaves its place while it is at work: after an error it is gone, and the next call starts anew.
        let (mut decoder, fresh) = match state.decoder.take() {
            Some(decoder) if self.reads_on(decoder.next, index) => (decoder, false),
            _ => (self.start(state, index, self.sync_before(index))?, true),
        };
        if fresh {
            // A seek that went past its target shows at the first frame, and then the whole film is read.
            match self.next_frame(state, &mut decoder)? {
                Some((at, _)) if at > index && self.sync_before(index) > 0 => {
                    decoder = self.start(state, index, 0)?;
                }
                Some((at, image)) if at == index => {
                    state.decoder = Some(decoder);
                    return Ok(image);
                }
                Some(_) => {}
                None => return Err(self.ended(&mut decoder, index)),
            }
        }
        while decoder.next <= index {
            match self.next_frame(state, &mut decoder)? {
                Some((at, image)) if at == index => {
                    state.decoder = Some(decoder);
                    return Ok(image);
                }
                Some(_) => {}
                None => return Err(self.ended(&mut decoder, index)),
            }
        }
        let next = decoder.next - 1;
        let words = decoder.running.take_words().join("; ");
        state.decoder = Some(decoder);
        Err(DataError::new(format!(
            "frame {index} cannot be decoded: FFmpeg goes on at frame {next}; {words}"
        )))
    }

    /// Whether a decoder that stands before `next` gets to `index` sooner than one that is started for it.
    fn reads_on(&self, next: usize, index: usize) -> bool {
        next <= index && (index - next <= READ_ON_FRAMES || self.sync_before(index) <= next)
    }

    /// Index of the last frame at or before `index` at which decoding may start.
    fn sync_before(&self, index: usize) -> usize {
        let target = self.index.shown[index];
        let after = self.index.sync.partition_point(|s| s.shown <= target);
        after.checked_sub(1).map_or(0, |i| self.frame_at(self.index.sync[i].shown).unwrap_or(0))
    }

    fn frame_at(&self, shown: i64) -> Option<usize> {
        self.index.shown.binary_search(&shown).ok()
    }

    /// Starts FFmpeg so that its first frame is `index`, decoding from the frame `from`.
    fn start(&self, state: &mut State, index: usize, from: usize) -> DataResult<Decoder> {
        let mut input: Vec<OsString> = vec!["-copyts".into()];
        if from > 0 {
            let seconds =
                self.index.seconds(self.seek_target(from)) + 0.5 / f64::from(self.index.ticks_per_second);
            let at = format!("{seconds:.6}");
            input.extend(["-seek_timestamp", "1", "-noaccurate_seek", "-ss", &at].map(OsString::from));
        }
        let (pixels, coder) = match self.format {
            PixelFormat::Gray8 => ("gray", "pgm"),
            PixelFormat::Rgb8 => ("rgb24", "ppm"),
            other => return Err(DataError::new(format!("films are not decoded to {other:?}"))),
        };
        // Frames before the target are dropped by their time; each one that is left is announced with its time. The
        // metadata filter prints frames that have metadata, so they are given some.
        let (ticks, first) = (self.index.ticks_per_second, self.index.shown[index]);
        let filter = format!(
            "settb=1/{ticks},select=gte(pts\\,{first}),metadata=mode=add:key=vice:value=1,metadata=mode=print"
        );
        // Bit-exact scaling: the same pixels on every machine.
        let output = ["-vf", &filter, "-sws_flags", "+accurate_rnd+bitexact", "-pix_fmt", pixels];
        let output = output.into_iter().chain(["-c:v", coder, "-f", "image2pipe"]).map(OsString::from);
        // FFmpeg opens nothing but files here.
        elsewhere::bring(&self.path)?;
        let running = self.ffmpeg.start(&self.path, &input, &output.collect::<Vec<_>>())?;
        state.stats.starts += 1;
        Ok(Decoder { running, next: index })
    }

    /// The time to seek to, in ticks, so that FFmpeg starts at the frame `from` or before it.
    ///
    /// FFmpeg looks for the last place whose *decoding* time is not later, newer versions then also for one that is
    /// *shown* not later. The time at which `from` is shown suits both, unless the next such place is decoded before.
    fn seek_target(&self, from: usize) -> i64 {
        let sync = &self.index.sync;
        let at = sync.partition_point(|s| s.shown < self.index.shown[from]);
        let Some(start) = sync.get(at) else { return 0 };
        match sync.get(at + 1) {
            Some(next) if next.decoded <= start.shown + 1 => start.decoded,
            _ => start.shown,
        }
    }

    /// The next frame out of the pipe and which one it is; `None` where FFmpeg has ended.
    fn next_frame(&self, state: &mut State, decoder: &mut Decoder) -> DataResult<Option<(usize, Image)>> {
        let Some(image) = self.read_image(decoder)? else { return Ok(None) };
        let silent = || DataError::new("FFmpeg does not say which frame it has decoded");
        let shown = decoder.running.shown.recv_timeout(PATIENCE).map_err(|_| silent())?;
        let index = self.frame_at(shown).ok_or_else(|| {
            DataError::new(format!("FFmpeg gives a frame at tick {shown}, where the film has none"))
        })?;
        decoder.next = index + 1;
        state.stats.frames += 1;
        for text in decoder.running.take_words() {
            if state.said.len() < 256 && state.said.insert(text.clone()) {
                tracing::warn!("{}: near frame {index}: FFmpeg: {text}", self.path.display());
            }
        }
        if image.data().len() <= RECENT_BYTES {
            while state.recent.len() == RECENT_FRAMES
                || (state.recent.len() + 1) * image.data().len() > RECENT_BYTES
            {
                state.recent.pop_front();
            }
            state.recent.retain(|(i, _)| *i != index);
            state.recent.push_back((index, image.clone()));
        }
        Ok(Some((index, image)))
    }

    /// Reads one PGM or PPM image: `P5`, columns and rows, the largest value, then the pixels.
    fn read_image(&self, decoder: &mut Decoder) -> DataResult<Option<Image>> {
        let failed = |e: std::io::Error| DataError::new("the pipe from FFmpeg broke").because(e);
        let Some(pipe) = decoder.running.stdout() else { return Ok(None) };
        let magic = if self.format == PixelFormat::Gray8 { "P5" } else { "P6" };
        let mut head = Vec::new();
        for _ in 0..3 {
            pipe.by_ref().take(32).read_until(b'\n', &mut head).map_err(failed)?;
        }
        if head.is_empty() {
            return Ok(None);
        }
        let text = String::from_utf8_lossy(&head).into_owned();
        let fields: Vec<&str> = text.split_whitespace().collect();
        let size = match fields[..] {
            [kind, columns, rows, "255"] if kind == magic => {
                columns.parse::<u32>().ok().zip(rows.parse().ok())
            }
            _ => None,
        };
        let Some((width, height)) = size else {
            return Err(DataError::new(format!("FFmpeg gives no 8 bit image but `{}`", text.trim())));
        };
        let (expected_width, expected_height) = self.index.size;
        if (width, height) != self.index.size {
            return Err(DataError::new(format!(
                "FFmpeg decodes {width}x{height} pixels where the film promises {expected_width}x{expected_height}"
            )));
        }
        // Memory for what FFmpeg has at hand, not for what a header says.
        let bytes = width as usize * height as usize * self.format.bytes();
        let mut data = Vec::new();
        pipe.by_ref().take(bytes as u64).read_to_end(&mut data).map_err(failed)?;
        if data.len() < bytes {
            let words = decoder.running.last_words();
            return Err(DataError::new(format!("FFmpeg stopped in the middle of a frame: {words}")));
        }
        Image::new(width, height, self.format, data).map(Some)
    }

    fn ended(&self, decoder: &mut Decoder, index: usize) -> DataError {
        let words = decoder.running.last_words();
        let words = if words.is_empty() { "it does not say why".to_string() } else { words };
        DataError::new(format!("FFmpeg stops before frame {index} of {}: {words}", self.frame_count()))
    }
}

/// Adds what FFmpeg says about a film whose index cannot be read, if it is there to be asked.
fn with_words_of_ffmpeg(error: DataError, path: &Path, ffmpeg: &Ffmpeg) -> DataError {
    if !path.is_file() {
        return error;
    }
    let output: Vec<OsString> = ["-frames:v", "1", "-f", "null"].map(OsString::from).to_vec();
    let Ok(mut running) = ffmpeg.start(path, &[], &output) else { return error };
    let words = running.last_words();
    if words.is_empty() { error } else { error.because(format!("FFmpeg says: {words}")) }
}

#[cfg(test)]
mod tests;
