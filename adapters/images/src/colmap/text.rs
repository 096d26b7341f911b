//! `cameras.txt`, `images.txt` and `points3D.txt`. Comments start with `#`; fields are separated by blanks.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::str::FromStr;

use nalgebra::Point3;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_files::calibration::ColmapModel;

use super::camera::ModelCamera;
use super::{ModelImage, pose};

/// Bytes beyond which a line is none: an image of a model has some ten thousand points in one line.
const MAX_LINE_BYTES: usize = 64 << 20;

/// Lines with their numbers, comments left out. An empty line stands for an image without points.
fn lines(path: &Path, mut work: impl FnMut(u64, &str) -> DataResult<()>) -> DataResult<()> {
    let file = File::open(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file"),
        _ => DataError::new("cannot be read").because(e),
    })?;
    let mut reader = BufReader::new(file);
    let (mut text, mut line) = (String::new(), 0);
    loop {
        text.clear();
        line += 1;
        let read = reader
            .read_line(&mut text)
            .map_err(|e| DataError::new("cannot be read as text").line(line).because(e))?;
        if read == 0 {
            return Ok(());
        }
        if text.len() > MAX_LINE_BYTES {
            return Err(DataError::new("the line is longer than 64 MiB").line(line));
        }
        let row = text.trim();
        if !row.starts_with('#') {
            work(line, row).map_err(|e| e.line(line))?;
        }
    }
}

fn field<T: FromStr>(fields: &mut dyn Iterator<Item = &str>, what: &str) -> DataResult<T> {
    let text = fields.next().ok_or_else(|| DataError::new(format!("the line ends before {what}")))?;
    text.parse().map_err(|_| DataError::new(format!("{what}: `{text}` is not what is expected")))
}

fn number(fields: &mut dyn Iterator<Item = &str>, what: &str) -> DataResult<f64> {
    let value: f64 = field(fields, what)?;
    if value.is_finite() { Ok(value) } else { Err(DataError::new(format!("{what} is not finite"))) }
}

pub(super) fn cameras(path: &Path) -> DataResult<BTreeMap<u32, ModelCamera>> {
    let mut found = BTreeMap::new();
    lines(path, |_, row| {
        if row.is_empty() {
            return Ok(());
        }
        let fields = &mut row.split_whitespace();
        let id: u32 = field(fields, "CAMERA_ID")?;
        let model = ColmapModel::by_name(&field::<String>(fields, "MODEL")?)?;
        let size = [field(fields, "WIDTH")?, field(fields, "HEIGHT")?];
        let mut parameters = Vec::new();
        for text in fields.by_ref() {
            parameters.push(number(&mut std::iter::once(text), "a parameter")?);
        }
        match found.insert(id, ModelCamera::new(model, size, parameters)?) {
            None => Ok(()),
            Some(_) => Err(DataError::new(format!("camera {id} stands here a second time"))),
        }
    })?;
    Ok(found)
}

pub(super) fn images(path: &Path) -> DataResult<Vec<ModelImage>> {
    let mut found = Vec::new();
    // Every other line lists the points of the image before it, and may be empty.
    let mut points = false;
    lines(path, |_, row| {
        if std::mem::take(&mut points) || row.is_empty() {
            return Ok(());
        }
        points = true;
        let fields = &mut row.split_whitespace();
        let _: u32 = field(fields, "IMAGE_ID")?;
        let (mut q, mut t) = ([0.0; 4], [0.0; 3]);
        for value in &mut q {
            *value = number(fields, "a part of the quaternion")?;
        }
        for value in &mut t {
            *value = number(fields, "a part of the translation")?;
        }
        let camera = field(fields, "CAMERA_ID")?;
        // A name may have blanks in it.
        let name = fields.collect::<Vec<_>>().join(" ");
        if name.is_empty() {
            return Err(DataError::new("the image has no name"));
        }
        found.push(ModelImage { name, camera, world_from_camera: pose(q, t)? });
        Ok(())
    })?;
    Ok(found)
}

pub(super) fn points(path: &Path) -> DataResult<Vec<Point3<f64>>> {
    let mut found = Vec::new();
    lines(path, |_, row| {
        if row.is_empty() {
            return Ok(());
        }
        let fields = &mut row.split_whitespace();
        let _: u64 = field(fields, "POINT3D_ID")?;
        found.push(Point3::new(number(fields, "X")?, number(fields, "Y")?, number(fields, "Z")?));
        Ok(())
    })?;
    Ok(found)
}
