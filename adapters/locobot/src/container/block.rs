//! Blocks: the chunks of a bag or an MCAP file, decompressed within bounds and kept while they are being used.

use std::io::Read;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rayon::prelude::*;
use vice_core::error::{DataError, DataResult};

use super::bytes::Bytes;
use super::claims::{FREE_BYTES, Unpacked, over_budget};
use super::indexed::{Indexed, Listed};
use super::{Locator, Payload, Scan, Visitor};

/// Bytes that are unpacked at once by several threads, beside the first block of them.
const BATCH_BYTES: u64 = 64 << 20;
/// Bytes reserved on the word of a header, before any data is seen: so many, or so many times those that are stored.
const TRUSTED_BYTES: u64 = 1 << 20;
const TRUSTED_TIMES: u64 = 32;
/// Blocks kept: a step forward needs those of the colour and the depth image, and their successors.
const CACHED_BLOCKS: usize = 4;
/// Bytes kept, beside the newest block.
const CACHED_BYTES: usize = 64 << 20;
/// Bytes beyond which a block is not decompressed before it is asked for.
const READ_AHEAD_BYTES: u64 = 16 << 20;
/// Bytes read at once where records are small.
const WINDOW_BYTES: usize = 64 << 10;

/// How a block is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compression {
    None,
    Bz2,
    Lz4,
    Zstd,
}

impl Compression {
    /// By the name in a header.
    pub(super) fn from_name(name: &str) -> DataResult<Self> {
        match name {
            "" | "none" => Ok(Self::None),
            "bz2" => Ok(Self::Bz2),
            "lz4" => Ok(Self::Lz4),
            "zstd" => Ok(Self::Zstd),
            other => {
                Err(DataError::new(format!("unknown compression `{other}`"))
                    .hint("known: none, bz2, lz4, zstd"))
            }
        }
    }
}

/// A run of records in a file.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Offset in the file.
    pub(super) offset: u64,
    /// Bytes in the file.
    pub(super) stored: u64,
    /// Bytes after decompression, as the header says.
    pub(super) size: u64,
    pub(super) compression: Compression,
    /// Check sum of the decompressed bytes.
    pub(super) crc: Option<u32>,
    /// The file ends before the block does.
    pub(super) cut: bool,
    /// What the file's index says of it, where that was read.
    pub(super) indexed: Option<Arc<Indexed>>,
}

impl Block {
    /// Records that stand in the file as they are, outside of chunks.
    pub(super) fn plain(from: u64, to: u64) -> Self {
        let size = to - from;
        let compression = Compression::None;
        Self { offset: from, stored: size, size, compression, crc: None, cut: false, indexed: None }
    }

    /// Whether parts of it can be read by themselves: neither compressed nor under a check sum.
    fn is_plain(&self) -> bool {
        self.compression == Compression::None && self.crc.is_none()
    }
}

/// Decompresses into `out`, whose memory is used again; gives why where that is not everything.
pub(super) fn decompress(
    compression: Compression,
    stored: Vec<u8>,
    size: u64,
    salvage: bool,
    out: &mut Vec<u8>,
) -> Option<String> {
    out.clear();
    let packed = stored.len() as u64;
    if let Some(problem) = over_budget(size, packed) {
        return Some(problem);
    }
    let trusted = TRUSTED_BYTES.max(packed.saturating_mul(TRUSTED_TIMES)).min(FREE_BYTES);
    if compression != Compression::None {
        out.reserve_exact(size.min(trusted) as usize);
    }
    let done = match compression {
        Compression::None => {
            *out = stored;
            Ok(0)
        }
        Compression::Zstd if !salvage && size <= trusted => {
            // The buffer may be larger than this block: what does not fit its header is refused below.
            zstd::bulk::Decompressor::new().and_then(|mut d| d.decompress_to_buffer(&stored, out))
        }
        Compression::Zstd => zstd::stream::read::Decoder::new(stored.as_slice())
            .and_then(|d| d.take(size + 1).read_to_end(out)),
        Compression::Lz4 => {
            lz4::Decoder::new(stored.as_slice()).and_then(|d| d.take(size + 1).read_to_end(out))
        }
        Compression::Bz2 => bzip2::read::BzDecoder::new(stored.as_slice()).take(size + 1).read_to_end(out),
    };
    match done {
        Err(e) => Some(format!("cannot be decompressed: {e}")),
        Ok(_) if out.len() as u64 != size => Some(format!("has {} bytes, its header says {size}", out.len())),
        Ok(_) => None,
    }
}

/// Random access to bytes of a file or of memory.
pub(super) trait Source {
    /// Bytes there are.
    fn len(&self) -> u64;
    /// `len` bytes from `at`; `None` where the source ends before that.
    fn get(&mut self, at: u64, len: usize) -> DataResult<Option<&[u8]>>;
}

/// A decompressed block.
pub(super) struct Memory<'a>(pub(super) &'a [u8]);

impl Source for Memory<'_> {
    fn len(&self) -> u64 {
        self.0.len() as u64
    }

    fn get(&mut self, at: u64, len: usize) -> DataResult<Option<&[u8]>> {
        let Ok(at) = usize::try_from(at) else { return Ok(None) };
        Ok(at.checked_add(len).and_then(|end| self.0.get(at..end)))
    }
}

/// A part of a file, through a window: what lies between the places asked for is not read.
pub(super) struct Window<'a> {
    file: &'a BlockFile,
    offset: u64,
    len: u64,
    window: Vec<u8>,
    window_at: u64,
}

impl Source for Window<'_> {
    fn len(&self) -> u64 {
        self.len
    }

    fn get(&mut self, at: u64, len: usize) -> DataResult<Option<&[u8]>> {
        let Some(end) = at.checked_add(len as u64).filter(|end| *end <= self.len) else { return Ok(None) };
        if at < self.window_at || end > self.window_at + self.window.len() as u64 {
            // Who fetches from elsewhere chooses how much by himself.
            let least = if self.file.bytes.is_elsewhere() { 0 } else { WINDOW_BYTES };
            let bytes = (self.len - at).min(len.max(least) as u64) as usize;
            self.window.resize(bytes, 0);
            self.window_at = at;
            self.file.read_at(self.offset + at, &mut self.window)?;
        }
        let from = (at - self.window_at) as usize;
        Ok(Some(&self.window[from..from + len]))
    }
}

/// Takes the records of a block apart; one for each of the formats that have blocks.
pub(super) trait Records: Send + Sync {
    /// Visits the messages of a block.
    ///
    /// # Errors
    /// [`DataError`] where a record is not as it should be; what came before it has been visited.
    fn walk(
        &self,
        source: &mut dyn Source,
        place: (u32, u32),
        state: &mut State,
        scan: &mut Scan,
        visitor: &mut dyn Visitor,
    ) -> DataResult<()>;

    /// The messages that the index behind a block lists; `None` where that is none.
    fn listed(&self, _index: &[u8]) -> Option<Vec<Listed>> {
        None
    }
}

/// What records of a file say of later ones: connections of a bag, schemas and channels of an MCAP file.
#[derive(Default)]
pub(super) struct State {
    /// Topic of a connection or channel.
    pub(super) topics: std::collections::HashMap<u32, usize>,
    /// Name of a schema.
    pub(super) schemas: std::collections::HashMap<u16, String>,
    /// Messages whose connection or channel was never described.
    pub(super) orphans: u64,
    /// Bytes that messages unpacked to beyond what messages usually do, all together.
    pub(super) beyond_usual: u64,
}

type Decompressed = Result<Arc<Vec<u8>>, String>;

/// A file of blocks.
pub(super) struct BlockFile {
    pub(super) bytes: Bytes,
    cache: Mutex<Vec<(u32, Arc<OnceLock<Decompressed>>)>>,
    spare: Mutex<Option<Vec<u8>>>,
}

impl BlockFile {
    /// Opens the file at `place`; `path` is the one that the user knows.
    pub(super) fn open(path: &Path, place: &Path) -> DataResult<Arc<Self>> {
        let bytes = Bytes::open(place).map_err(|e| e.at(path))?;
        Ok(Arc::new(Self { bytes, cache: Mutex::default(), spare: Mutex::default() }))
    }

    pub(super) const fn len(&self) -> u64 {
        self.bytes.len()
    }

    /// All of the file, through a window.
    pub(super) fn window(&self) -> Window<'_> {
        self.window_of(0, self.len())
    }

    fn window_of(&self, offset: u64, len: u64) -> Window<'_> {
        Window { file: self, offset, len, window: Vec::new(), window_at: 0 }
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> DataResult<()> {
        self.bytes.read_at(offset, bytes)
    }

    pub(super) fn read_vec(&self, offset: u64, len: u64) -> DataResult<Vec<u8>> {
        self.bytes.read_vec(offset, len)
    }

    /// Reads and decompresses a block into `out`; gives why where that is not everything.
    fn load(&self, block: &Block, out: &mut Vec<u8>) -> Option<String> {
        out.clear();
        if let Some(problem) = over_budget(block.size, block.stored) {
            return Some(problem);
        }
        let stored = match self.read_vec(block.offset, block.stored) {
            Ok(stored) => stored,
            Err(e) => return Some(e.to_string()),
        };
        let problem = decompress(block.compression, stored, block.size, block.cut, out);
        let mut crc = block.crc;
        if let Some(indexed) = &block.indexed {
            let mut word = [0; 4];
            match self.read_at(indexed.crc_at, &mut word) {
                Ok(()) => crc = Some(u32::from_le_bytes(word)).filter(|crc| *crc != 0),
                Err(e) => return Some(e.to_string()),
            }
        }
        if problem.is_none()
            && let Some(crc) = crc
        {
            let found = crc32fast::hash(out);
            if found != crc {
                out.clear();
                return Some(format!("has the check sum {found:08x}, its header says {crc:08x}"));
            }
        }
        problem
    }

    /// The entry of a block in the cache, and whether it is new there.
    fn entry(&self, index: u32) -> (Arc<OnceLock<Decompressed>>, bool) {
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let hit = cache.iter().position(|(i, _)| *i == index).map(|at| cache.remove(at));
        let is_new = hit.is_none();
        let (_, entry) = hit.unwrap_or_else(|| (index, Arc::default()));
        let size = |entry: &Arc<OnceLock<Decompressed>>| match entry.get() {
            Some(Ok(bytes)) => bytes.len(),
            _ => 0,
        };
        while cache.len() >= CACHED_BLOCKS
            || cache.iter().map(|(_, entry)| size(entry)).sum::<usize>() > CACHED_BYTES
        {
            let (_, oldest) = cache.remove(0);
            // The memory of a block that nobody uses any more serves the next one.
            let bytes = Arc::into_inner(oldest).and_then(OnceLock::into_inner);
            if let Some(bytes) = bytes.and_then(Result::ok).and_then(Arc::into_inner) {
                *self.spare.lock().unwrap_or_else(PoisonError::into_inner) = Some(bytes);
            }
        }
        cache.push((index, Arc::clone(&entry)));
        (entry, is_new)
    }

    fn load_into(&self, entry: &OnceLock<Decompressed>, block: &Block) -> Decompressed {
        // Decompressed outside the lock of the cache, and once where several threads want the same block.
        let loaded = entry.get_or_init(|| {
            let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).take();
            let mut bytes = spare.unwrap_or_default();
            match self.load(block, &mut bytes) {
                Some(problem) if !block.cut => Err(problem),
                _ => Ok(Arc::new(bytes)),
            }
        });
        loaded.clone()
    }

    fn holds(&self, index: u32) -> bool {
        let cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        cache.iter().any(|(i, _)| *i == index)
    }

    fn cached(self: &Arc<Self>, blocks: &[Block], index: u32) -> DataResult<Arc<Vec<u8>>> {
        let block = &blocks[index as usize];
        let stepping = index.checked_sub(1).is_some_and(|before| self.holds(before));
        let (entry, _) = self.entry(index);
        // Who steps forward will want the next block: it is decompressed while this one is being used.
        let next = blocks.get(index as usize + 1).filter(|next| stepping && !next.is_plain());
        if let Some(next) = next.filter(|next| next.size <= READ_AHEAD_BYTES) {
            let (ahead, is_new) = self.entry(index + 1);
            if is_new {
                let (file, next) = (Arc::clone(self), next.clone());
                rayon::spawn(move || drop(file.load_into(&ahead, &next)));
            }
        }
        let loaded = self.load_into(&entry, block);
        self.bytes.all_had()?;
        loaded.map_err(|problem| DataError::new(format!("the chunk {problem}")).byte(block.offset))
    }

    /// Reads a message.
    pub(super) fn read(self: &Arc<Self>, blocks: &[Block], at: &Locator) -> DataResult<Payload> {
        let block = &blocks[at.block as usize];
        if block.is_plain() {
            return Ok(Payload::Alone(self.read_vec(block.offset + at.at, u64::from(at.bytes))?));
        }
        let bytes = self.cached(blocks, at.block)?;
        let (from, to) = (at.at as usize, at.at as usize + at.bytes as usize);
        if to > bytes.len() {
            return Err(DataError::new("the file has changed since it was opened").byte(block.offset));
        }
        Ok(Payload::Part { block: bytes, from, to })
    }

    /// Walks all blocks in order; several are decompressed at once.
    pub(super) fn scan(
        &self,
        blocks: &[Block],
        records: &dyn Records,
        file: u32,
        path: &Path,
        scan: &mut Scan,
        visitor: &mut dyn Visitor,
    ) -> DataResult<()> {
        let mut state = State::default();
        let mut buffers = vec![Vec::new(); rayon::current_num_threads().min(16)];
        let (mut at, mut ahead) = (0, 0);
        let mut unpacked = Unpacked::of(self.len());
        while at < blocks.len() {
            self.bytes.all_had()?;
            if at >= ahead {
                ahead = self.look_ahead(blocks, at, records, &state, scan)?;
            }
            if self.count_only(&blocks[at], records, &state, scan)? {
                at += 1;
                continue;
            }
            if blocks[at].is_plain() {
                let block = &blocks[at];
                let mut source = self.window_of(block.offset, block.stored);
                let walked = records.walk(&mut source, (file, at as u32), &mut state, scan, visitor);
                if let Err(e) = walked {
                    scan.damaged(&inside(e, block, path));
                }
                at += 1;
                continue;
            }
            let more = blocks[at + 1..ahead]
                .iter()
                .take_while(|b| !b.is_plain() && !self.only_counts(b, &state, scan));
            let mut together = 0;
            let more = more.take_while(|b| {
                together += b.size;
                together <= BATCH_BYTES
            });
            let batch: Vec<&Block> = [&blocks[at]].into_iter().chain(more).take(buffers.len()).collect();
            let mut packed = batch.iter().filter(|b| b.compression != Compression::None);
            if let Err(error) = packed.try_for_each(|b| unpacked.add(b.size)) {
                // First, since it says why what follows is missing.
                scan.damage.insert(0, error.at(path).byte(blocks[at].offset).to_string());
                break;
            }
            let each = batch.par_iter().zip(&mut buffers);
            let problems: Vec<_> = each.map(|(block, buffer)| self.load(block, buffer)).collect();
            for ((block, bytes), problem) in batch.into_iter().zip(&buffers).zip(problems) {
                if let Some(problem) = &problem {
                    let kept = if block.cut { "read as far as it goes" } else { "its messages are left out" };
                    let problem = format!("the chunk {problem}: {kept}");
                    scan.damaged(&DataError::new(problem).at(path).byte(block.offset));
                }
                if problem.is_none() || block.cut {
                    let place = (file, at as u32);
                    let walked = records.walk(&mut Memory(bytes), place, &mut state, scan, visitor);
                    if let Err(e) = walked
                        && !block.cut
                    {
                        scan.damaged(&inside(e, block, path));
                    }
                }
                at += 1;
            }
        }
        if state.orphans > 0 {
            let problem = format!("{} messages of unknown topics are left out", state.orphans);
            scan.damaged(&DataError::new(problem).at(path));
        }
        self.bytes.all_had()
    }
}

/// The error of a record in a block, with the byte of the file that the block starts at.
fn inside(error: DataError, block: &Block, path: &Path) -> DataError {
    let problem = format!("the chunk is damaged: {error}: the rest of it is left out");
    DataError::new(problem).at(path).byte(block.offset)
}
