//! What a journal asks of the disk: little enough that a test can lose power at any moment.

use std::fs::File;
use std::io::{Result, Seek, SeekFrom, Write};

/// A file that grows at its end.
pub(crate) trait Disk {
    /// Writes bytes at a place.
    fn write_at(&mut self, at: u64, bytes: &[u8]) -> Result<()>;
    /// Cuts the file off behind so many bytes.
    fn cut(&mut self, len: u64) -> Result<()>;
    /// Waits until all that was written is on the disk.
    fn sync(&mut self) -> Result<()>;
}

impl Disk for File {
    fn write_at(&mut self, at: u64, bytes: &[u8]) -> Result<()> {
        self.seek(SeekFrom::Start(at))?;
        self.write_all(bytes)
    }

    fn cut(&mut self, len: u64) -> Result<()> {
        self.set_len(len)
    }

    fn sync(&mut self) -> Result<()> {
        self.sync_data()
    }
}
