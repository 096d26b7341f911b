//! LZF, the compression of `binary_compressed`: runs of bytes as they are, and runs that were there within the last 8 KiB.
//!
//! It is undone a piece at a time, so that no more is held than what may be repeated.

use std::io::Read;

use vice_core::error::{DataError, DataResult};

use crate::ply::Source;

/// How far back a repetition reaches at most.
const WINDOW_BYTES: usize = 1 << 13;
/// Bytes that are handed on at once.
const PIECE_BYTES: usize = 1 << 18;

/// Undoes `packed` bytes of the source; `take` gets what they make, piece by piece.
pub(super) fn unpack<R: Read>(
    source: &mut Source<R>,
    mut packed: u64,
    mut take: impl FnMut(&[u8]) -> DataResult<()>,
) -> DataResult<()> {
    let mut made: Vec<u8> = Vec::with_capacity(WINDOW_BYTES + PIECE_BYTES + 300);
    // Bytes of `made` that were handed on already.
    let mut told = 0;
    while packed > 0 {
        let control = usize::from(next(source, &mut packed)?);
        if control < 32 {
            let count = control + 1;
            if packed < count as u64 || !source.at_least(count)? {
                return Err(cut(source));
            }
            made.extend_from_slice(&source.ahead()[..count]);
            source.pass(count);
            packed -= count as u64;
        } else {
            let mut count = control >> 5;
            if count == 7 {
                count += usize::from(next(source, &mut packed)?);
            }
            let back = ((control & 31) << 8 | usize::from(next(source, &mut packed)?)) + 1;
            let Some(from) = made.len().checked_sub(back) else {
                return Err(DataError::new("the compressed points repeat bytes from before their start")
                    .byte(source.offset()));
            };
            // A run may repeat itself: bytes are copied one by one.
            for i in 0..count + 2 {
                made.push(made[from + i]);
            }
        }
        if made.len() - told >= PIECE_BYTES {
            take(&made[told..])?;
            let kept = made.len() - WINDOW_BYTES;
            made.drain(..kept);
            told = made.len();
        }
    }
    take(&made[told..])
}

fn next<R: Read>(source: &mut Source<R>, packed: &mut u64) -> DataResult<u8> {
    if *packed == 0 || !source.at_least(1)? {
        return Err(cut(source));
    }
    let byte = source.ahead()[0];
    source.pass(1);
    *packed -= 1;
    Ok(byte)
}

fn cut<R: Read>(source: &Source<R>) -> DataError {
    DataError::new("the compressed points end within a run").byte(source.offset())
}
