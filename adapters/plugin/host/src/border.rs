//! Reading what a plugin hands over: texts and lists in its memory. A fault is what its author got wrong, in words.
#![allow(unsafe_code)]

use std::path::PathBuf;

use vice_abi::contract::{Message, Text};
use vice_abi::path_from_bytes;
use vice_core::error::{DataError, ErrorKind};

/// What a plugin's author got wrong.
pub(crate) type Fault = String;

/// Bytes of a list that is believed: more than any recording has in one list, less than memory has.
const MAX_LIST_BYTES: usize = 1 << 34;

/// Longest text that is believed, bytes.
const MAX_TEXT: usize = 1 << 20;

/// A list in the plugin's memory.
///
/// # Safety
/// Where `data` is not null and aligned, it points at `count` readable values that nobody changes during `'a`.
pub(crate) unsafe fn list<'a, T>(data: *const T, count: usize, what: &str) -> Result<&'a [T], Fault> {
    if count == 0 {
        return Ok(&[]);
    }
    if data.is_null() {
        return Err(format!("the pointer to {what} is null, though {count} are announced"));
    }
    if !data.is_aligned() {
        return Err(format!("the pointer to {what} is not aligned to {} bytes", align_of::<T>()));
    }
    match count.checked_mul(size_of::<T>()) {
        // SAFETY: not null, aligned, of a possible size; the rest is the caller's promise.
        Some(bytes) if bytes <= MAX_LIST_BYTES => Ok(unsafe { std::slice::from_raw_parts(data, count) }),
        _ => Err(format!("{count} {what} are announced, more than can be")),
    }
}

/// Text in the plugin's memory, UTF-8.
///
/// # Safety
/// As [`Text::bytes`].
pub(crate) unsafe fn text(text: Text, what: &str) -> Result<String, Fault> {
    // SAFETY: the caller's promise.
    let bytes = unsafe { raw(text, what) }?;
    String::from_utf8(bytes.to_vec()).map_err(|e| {
        let shown = String::from_utf8_lossy(bytes).into_owned();
        format!("{what} is not UTF-8 at byte {}: `{shown}`", e.utf8_error().valid_up_to())
    })
}

/// A name: text that is not empty, on one line.
///
/// # Safety
/// As [`Text::bytes`].
pub(crate) unsafe fn name(from: Text, what: &str) -> Result<String, Fault> {
    // SAFETY: the caller's promise.
    let name = unsafe { text(from, what) }?;
    if name.trim().is_empty() {
        return Err(format!("{what} is empty"));
    }
    if name.chars().any(char::is_control) {
        return Err(format!("{what} has a control character: {name:?}"));
    }
    Ok(name)
}

/// A path in the plugin's memory.
///
/// # Safety
/// As [`Text::bytes`].
pub(crate) unsafe fn path(text: Text, what: &str) -> Result<PathBuf, Fault> {
    // SAFETY: the caller's promise.
    let bytes = unsafe { raw(text, what) }?;
    if bytes.is_empty() || bytes.contains(&0) {
        return Err(format!("{what} is empty or has a zero byte"));
    }
    path_from_bytes(bytes).ok_or_else(|| format!("{what} is not UTF-8"))
}

unsafe fn raw<'a>(text: Text, what: &str) -> Result<&'a [u8], Fault> {
    if text.length > MAX_TEXT {
        return Err(format!("{what} is announced with {} bytes, more than can be", text.length));
    }
    // SAFETY: the caller's promise.
    unsafe { text.bytes() }
        .ok_or_else(|| format!("{what} is null, though {} bytes are announced", text.length))
}

/// Memory for the message of a call.
pub(crate) struct MessageBuffer {
    bytes: [u8; Self::CAPACITY],
}

impl MessageBuffer {
    const CAPACITY: usize = 2048;

    pub(crate) const fn new() -> Self {
        Self { bytes: [0; Self::CAPACITY] }
    }

    pub(crate) const fn message(&mut self) -> Message {
        Message {
            data: self.bytes.as_mut_ptr(),
            capacity: Self::CAPACITY,
            length: 0,
            hint_start: 0,
            hint_length: 0,
        }
    }

    /// What was written as an error, its hint told apart; `None` where nothing was.
    pub(crate) fn error(&self, written: &Message, kind: ErrorKind) -> Option<DataError> {
        let text = self.text(written)?;
        Some(match with_hint(&text, written) {
            Some((problem, hint, "")) => DataError::of_kind(kind, problem).hint(hint),
            Some((problem, hint, cause)) => {
                DataError::of_kind(kind, problem).hint(hint).because(DataError::new(cause))
            }
            None => DataError::of_kind(kind, text),
        })
    }

    /// What was written, `None` where nothing was. Cut or broken text is shown as far as it goes.
    pub(crate) fn text(&self, written: &Message) -> Option<String> {
        let bytes = &self.bytes[..written.length.min(Self::CAPACITY)];
        let mut text = match std::str::from_utf8(bytes) {
            Ok(text) => text.to_string(),
            // Cut within a character.
            Err(e) if written.length > Self::CAPACITY && e.error_len().is_none() => {
                String::from_utf8_lossy(&bytes[..e.valid_up_to()]).into_owned()
            }
            Err(_) => format!("{} (its message is not UTF-8)", String::from_utf8_lossy(bytes)),
        };
        text.truncate(text.trim_end_matches(|c: char| c == '\0' || c.is_whitespace()).len());
        if written.length > Self::CAPACITY {
            text.push('…');
        }
        (!text.trim().is_empty()).then_some(text)
    }
}

/// A text in three parts, `problem (hint): cause`; `None` where the hint is not where it is said to be.
fn with_hint<'a>(text: &'a str, written: &Message) -> Option<(&'a str, &'a str, &'a str)> {
    let (start, length) = (written.hint_start, written.hint_length);
    let end = start.checked_add(length).filter(|_| length > 0)?;
    let (problem, hint, rest) = (text.get(..start)?, text.get(start..end)?, text.get(end..)?);
    let cause = match rest.strip_prefix(')')? {
        "" => "",
        rest => rest.strip_prefix(": ")?,
    };
    Some((problem.strip_suffix(" (")?, hint, cause))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(bytes: &[u8]) -> Result<String, Fault> {
        // SAFETY: the bytes are there.
        unsafe { name(Text::from_bytes(bytes), "the name") }
    }

    #[test]
    fn lists_and_texts_are_looked_at_before_they_are_read() {
        // SAFETY: nothing of these is read.
        unsafe {
            let null = list::<f64>(std::ptr::null(), 3, "poses");
            assert_eq!(null.unwrap_err(), "the pointer to poses is null, though 3 are announced");
            assert!(list::<f64>(std::ptr::null(), 0, "poses").unwrap().is_empty());
            let odd = std::ptr::without_provenance::<f64>(4097);
            assert!(list(odd, 1, "poses").unwrap_err().contains("not aligned"));
            let even = std::ptr::without_provenance::<f64>(4096);
            assert!(list(even, usize::MAX, "poses").unwrap_err().contains("more than can be"));
            let null = Text { data: std::ptr::null(), length: 4 };
            assert!(text(null, "the name").unwrap_err().contains("null"));
            let long = Text { data: std::ptr::without_provenance(4096), length: usize::MAX };
            assert!(text(long, "the name").unwrap_err().contains("more than can be"));
        }
        assert_eq!(of(b"cam0").unwrap(), "cam0");
        assert!(of(b"caf\xe9").unwrap_err().contains("not UTF-8 at byte 3"));
        assert!(of(b" ").unwrap_err().contains("empty"));
        assert!(of(b"a\nb").unwrap_err().contains("control"));
    }

    #[test]
    fn messages_are_read_as_far_as_they_go() {
        let said = |bytes: &[u8], length: usize| {
            let mut buffer = MessageBuffer::new();
            let n = bytes.len().min(MessageBuffer::CAPACITY);
            buffer.bytes[..n].copy_from_slice(&bytes[..n]);
            let message = Message { length, ..buffer.message() };
            buffer.text(&message)
        };
        assert_eq!(said(b"wrong", 5).unwrap(), "wrong");
        assert_eq!(said(b"", 0), None);
        assert_eq!(said(b" \n", 2), None);
        assert!(said(b"\xff!", 2).unwrap().contains("not UTF-8"));
        let long = "é".repeat(2000);
        assert!(said(long.as_bytes(), long.len()).unwrap().ends_with("é…"));
        assert!(said(b"x", usize::MAX).unwrap().ends_with('…'));
    }

    #[test]
    fn hints_are_told_apart_where_they_are_what_they_should_be() {
        let said = |text: &str, hint_start: usize, hint_length: usize| {
            let mut buffer = MessageBuffer::new();
            buffer.bytes[..text.len()].copy_from_slice(text.as_bytes());
            let message = Message { length: text.len(), hint_start, hint_length, ..buffer.message() };
            let error = buffer.error(&message, ErrorKind::Usage).unwrap();
            assert_eq!(vice_core::error::one_line(&error), text);
            assert_eq!(error.kind(), ErrorKind::Usage);
            error.hint_text().map(str::to_string)
        };
        assert_eq!(said("a: é (do b)", 7, 4).as_deref(), Some("do b"));
        assert_eq!(said("a: é (do b): why", 7, 4).as_deref(), Some("do b"));
        for (start, length) in [(0, 0), (3, 2), (4, 2), (7, 5), (7, 400), (usize::MAX, 2), (2, usize::MAX)] {
            assert_eq!(said("a: é (do b)", start, length), None, "{start} {length}");
        }
    }
}
