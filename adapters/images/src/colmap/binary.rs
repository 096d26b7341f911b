//! `cameras.bin`, `images.bin` and `points3D.bin`: little endian, without padding. What a count claims is believed only
//! as far as the file goes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use nalgebra::Point3;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_files::calibration::ColmapModel;

use super::camera::ModelCamera;
use super::{ModelImage, pose};

/// Bytes beyond which an image's name is none.
const MAX_NAME_BYTES: u64 = 4096;

/// A file that is read from its start on, with the place of what was read last.
struct Bytes<R> {
    reader: R,
    at: u64,
    size: u64,
}

impl Bytes<BufReader<File>> {
    fn open(path: &Path) -> DataResult<Self> {
        let failed = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file"),
            _ => DataError::new("cannot be read").because(e),
        };
        let file = File::open(path).map_err(failed)?;
        let size = file.metadata().map_err(failed)?.len();
        Ok(Self { reader: BufReader::with_capacity(1 << 18, file), at: 0, size })
    }
}

impl<R: BufRead> Bytes<R> {
    fn take<const N: usize>(&mut self) -> DataResult<[u8; N]> {
        let mut bytes = [0; N];
        self.reader.read_exact(&mut bytes).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => self.error("the file is cut off here"),
            _ => self.error("cannot be read").because(e),
        })?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn error(&self, problem: impl Into<String>) -> DataError {
        DataError::new(problem).byte(self.at)
    }

    fn u32(&mut self) -> DataResult<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> DataResult<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self, what: &str) -> DataResult<f64> {
        let at = self.at;
        let value = self.take().map(f64::from_le_bytes)?;
        match value.is_finite() {
            true => Ok(value),
            false => Err(DataError::new(format!("{what} is not finite")).byte(at)),
        }
    }

    /// How many entries there are; each takes at least `least` bytes.
    fn count(&mut self, least: u64, what: &str) -> DataResult<u64> {
        let at = self.at;
        let count = self.u64()?;
        let rest = self.size.saturating_sub(self.at);
        if count > rest / least {
            return Err(DataError::new(format!(
                "{count} {what} do not fit into the {rest} bytes that follow"
            ))
            .byte(at)
            .hint("the file is cut off, or is no model of COLMAP"));
        }
        Ok(count)
    }

    fn skip(&mut self, bytes: u64) -> DataResult<()> {
        let skipped = std::io::copy(&mut (&mut self.reader).take(bytes), &mut std::io::sink())
            .map_err(|e| self.error("cannot be read").because(e))?;
        if skipped < bytes {
            return Err(self.error("the file is cut off in what starts here"));
        }
        self.at += bytes;
        Ok(())
    }

    fn name(&mut self) -> DataResult<String> {
        let mut bytes = Vec::new();
        let read = (&mut self.reader)
            .take(MAX_NAME_BYTES)
            .read_until(0, &mut bytes)
            .map_err(|e| self.error("cannot be read").because(e))?;
        if bytes.pop() != Some(0) || bytes.is_empty() {
            return Err(self.error("the name of an image that starts here has no end, or is empty"));
        }
        let name = String::from_utf8(bytes).map_err(|_| self.error("the name of an image is not UTF-8"))?;
        self.at += read as u64;
        Ok(name)
    }

    fn end(&self) -> DataResult<()> {
        match self.size - self.at.min(self.size) {
            0 => Ok(()),
            more => Err(self.error(format!("{more} bytes follow after the last entry"))),
        }
    }
}

pub(super) fn cameras(path: &Path) -> DataResult<BTreeMap<u32, ModelCamera>> {
    let mut bytes = Bytes::open(path)?;
    let mut found = BTreeMap::new();
    for _ in 0..bytes.count(48, "cameras")? {
        let at = bytes.at;
        let id = bytes.u32()?;
        let model = ColmapModel::by_number(bytes.u32()?).map_err(|e| e.byte(at))?;
        let size = [bytes.u64()?, bytes.u64()?];
        let mut parameters = Vec::with_capacity(model.parameters);
        for _ in 0..model.parameters {
            parameters.push(bytes.f64("a parameter of a camera")?);
        }
        found.insert(id, ModelCamera::new(model, size, parameters).map_err(|e| e.byte(at))?);
    }
    bytes.end()?;
    Ok(found)
}

pub(super) fn images(path: &Path) -> DataResult<Vec<ModelImage>> {
    let mut bytes = Bytes::open(path)?;
    let mut found = Vec::new();
    for _ in 0..bytes.count(74, "images")? {
        let at = bytes.at;
        let _id = bytes.u32()?;
        let (mut q, mut t) = ([0.0; 4], [0.0; 3]);
        for value in &mut q {
            *value = bytes.f64("a part of a quaternion")?;
        }
        for value in &mut t {
            *value = bytes.f64("a part of a translation")?;
        }
        let camera = bytes.u32()?;
        let name = bytes.name()?;
        let points = bytes.count(24, "points of an image")?;
        bytes.skip(points * 24)?;
        let world_from_camera = pose(q, t).map_err(|e| e.byte(at))?;
        found.push(ModelImage { name, camera, world_from_camera });
    }
    bytes.end()?;
    Ok(found)
}

pub(super) fn points(path: &Path) -> DataResult<Vec<Point3<f64>>> {
    let mut bytes = Bytes::open(path)?;
    let mut found = Vec::new();
    for _ in 0..bytes.count(51, "points")? {
        let _id = bytes.u64()?;
        found.push(Point3::new(bytes.f64("X")?, bytes.f64("Y")?, bytes.f64("Z")?));
        // Colour and error.
        bytes.skip(3 + 8)?;
        let track = bytes.count(8, "images of a point")?;
        bytes.skip(track * 8)?;
    }
    bytes.end()?;
    Ok(found)
}
