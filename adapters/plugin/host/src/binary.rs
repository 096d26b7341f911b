//! Whether a file is a shared library for this machine. The loader's own words for this are few, and mapping a file that was
//! cut off ends in a signal.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use vice_core::error::{DataError, DataResult};

const ELF: [u8; 4] = [0x7f, b'E', b'L', b'F'];
const SHARED_OBJECT: u16 = 3;
/// Program headers of a library are a dozen.
const MAX_SEGMENTS: u16 = 512;

/// Looks at the first bytes.
///
/// # Errors
/// [`DataError`] if it is no library, one for another machine, or cut off.
pub(crate) fn check(path: &Path) -> DataResult<()> {
    let mut file = File::open(path).map_err(|e| DataError::new("cannot be opened").at(path).because(e))?;
    let length = file.metadata().map_or(0, |m| m.len());
    if cfg!(all(unix, not(target_os = "macos"))) {
        elf(&mut file, length).map_err(|e| e.at(path))
    } else {
        // Mach-O and PE are left to the loader.
        Ok(())
    }
}

fn elf(file: &mut (impl Read + Seek), length: u64) -> DataResult<()> {
    let cut_off = || DataError::new("the library is cut off").hint("copy or build it again");
    let mut head = Vec::new();
    file.by_ref().take(64).read_to_end(&mut head).map_err(|e| DataError::new("cannot be read").because(e))?;
    if !head.starts_with(&ELF) {
        return Err(
            DataError::new("is no shared library").hint("a plugin is one, with the symbol vice_plugin")
        );
    }
    if head.len() < 64 {
        return Err(cut_off());
    }
    let little = head[5] == 1;
    let number = |bytes: &[u8]| {
        let fold = |n: u64, b: &u8| n << 8 | u64::from(*b);
        if little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) }
    };
    let (kind, machine) = (number(&head[16..18]), number(&head[18..20]));
    let bits = if head[4] == 2 { 64 } else { 32 };
    let ours = machine_of(std::env::consts::ARCH);
    if bits != usize::BITS
        || little != cfg!(target_endian = "little")
        || ours.is_some_and(|m| u64::from(m) != machine)
    {
        return Err(DataError::new(format!(
            "is built for {} ({bits} bit), this program for {}",
            name_of(machine),
            std::env::consts::ARCH
        ))
        .hint("build it for this machine"));
    }
    if kind != u64::from(SHARED_OBJECT) {
        return Err(
            DataError::new("is an object or a program, no shared library").hint("link it with -shared")
        );
    }
    if bits != 64 {
        return Ok(());
    }
    let (table, size, count) = (number(&head[32..40]), number(&head[54..56]), number(&head[56..58]));
    if size < 56 || count == 0 || count > u64::from(MAX_SEGMENTS) {
        return Err(DataError::new("is no shared library that can be loaded"));
    }
    for place in 0..count {
        let at = table.checked_add(place * size).ok_or_else(cut_off)?;
        let mut segment = [0; 56];
        file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut segment)).map_err(|_| cut_off())?;
        let end = number(&segment[8..16]).checked_add(number(&segment[32..40])).ok_or_else(cut_off)?;
        if end > length {
            return Err(cut_off());
        }
    }
    Ok(())
}

/// ELF's number of a machine, by the name Rust gives it.
fn machine_of(arch: &str) -> Option<u16> {
    MACHINES.iter().find(|(_, name)| *name == arch).map(|(number, _)| *number)
}

fn name_of(machine: u64) -> String {
    let known = MACHINES.iter().find(|(number, _)| u64::from(*number) == machine);
    known.map_or_else(|| format!("machine {machine}"), |(_, name)| (*name).to_string())
}

const MACHINES: [(u16, &str); 8] = [
    (3, "x86"),
    (8, "mips"),
    (20, "powerpc"),
    (21, "powerpc64"),
    (22, "s390x"),
    (40, "arm"),
    (62, "x86_64"),
    (183, "aarch64"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn why(bytes: &[u8]) -> String {
        let length = bytes.len() as u64;
        elf(&mut Cursor::new(bytes), length).map_or_else(|e| e.to_string(), |()| "good".to_string())
    }

    /// A header for this machine with one segment.
    fn library() -> Vec<u8> {
        let mut b = vec![0; 64 + 56];
        b[..4].copy_from_slice(&ELF);
        (b[4], b[5], b[16]) = (2, 1, 3);
        b[18..20].copy_from_slice(&machine_of(std::env::consts::ARCH).unwrap().to_le_bytes());
        (b[32], b[54], b[56]) = (64, 56, 1);
        b
    }

    #[test]
    #[cfg(all(target_endian = "little", target_pointer_width = "64"))]
    fn headers_say_what_a_file_is() {
        assert_eq!(why(&library()), "good");
        assert!(why(b"").contains("is no shared library"));
        assert!(why(b"#!/bin/sh\n").contains("is no shared library"));
        assert!(why(&library()[..40]).contains("cut off"));
        assert!(why(&library()[..100]).contains("cut off"));
        let with = |place: usize, value: u8| {
            let mut b = library();
            b[place] = value;
            why(&b)
        };
        assert!(with(18, 40).contains("is built for arm (64 bit)"));
        assert!(with(4, 1).contains("32 bit"));
        assert!(with(16, 1).contains("no shared library"));
        assert!(with(64 + 32, 200).contains("cut off"));
        assert!(with(64 + 15, 255).contains("cut off"));
        assert!(with(56, 0).contains("can be loaded"));
    }
}
