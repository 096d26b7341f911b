//! YAML as robots write it, OpenCV's dialect included.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde::de::DeserializeOwned;
use vice_core::error::{DataError, DataResult, ErrorKind};

/// Bytes beyond which a description file is refused.
const MAX_BYTES: u64 = 4 << 20;
/// Values of a file: those of OpenCV list the points of all views that they come from, and no description has more than some ten
/// thousand.
const MAX_VALUES: usize = 60_000;
/// Values that aliases may repeat: a description says little twice, a bomb says everything again and again.
const MAX_REPEATED: usize = 100_000;

/// Reads a YAML file.
///
/// # Errors
/// [`DataError`] with path and line if the file cannot be read, is too large, or is not what `T` wants.
pub fn read<T: DeserializeOwned>(path: impl AsRef<Path>) -> DataResult<T> {
    let path = path.as_ref();
    parse(&read_text(path)?).map_err(|e| e.at(path))
}

/// Reads YAML text, OpenCV's dialect included: a first line `%YAML:1.0`, and matrices tagged `!!opencv-matrix`.
///
/// # Errors
/// [`DataError`] with the line if the text is not what `T` wants.
pub fn parse<T: DeserializeOwned>(text: &str) -> DataResult<T> {
    let text = &*crate::leniency::without_marks(text);
    // Made comments or blanks, not cut out, so that lines keep their numbers. `%YAML:1.0` is no directive of YAML.
    let text = if text.starts_with("%YAML") { format!("#{text}") } else { text.to_string() };
    let text = text.replace("!!opencv-matrix", "                ");
    let mut options = serde_saphyr::Options::default();
    options.alias_limits.max_total_replayed_events = MAX_REPEATED;
    if let Some(budget) = &mut options.budget {
        budget.max_nodes = MAX_VALUES;
    }
    serde_saphyr::from_str_with_options(&text, options).map_err(|e| {
        let error = DataError::new(format!("is not the YAML expected: {}", first_line(&e.to_string())));
        match e.location() {
            Some(at) if at.line() > 0 => error.line(at.line()),
            _ => error,
        }
    })
}

/// The bytes of a small file.
pub(crate) fn read_bytes(path: &Path) -> DataResult<Vec<u8>> {
    let failed = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    };
    let mut bytes = Vec::new();
    File::open(path).map_err(failed)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    match bytes.len() as u64 {
        0 => Err(DataError::new("the file is empty").at(path)),
        n if n > MAX_BYTES => {
            Err(DataError::new("is larger than 4 MiB, which no description of a sensor is").at(path))
        }
        _ => Ok(bytes),
    }
}

/// The text of a small file, decoded as UTF-8.
pub(crate) fn read_text(path: &Path) -> DataResult<String> {
    let failed = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file").at(path),
        std::io::ErrorKind::InvalidData => DataError::new("is not text").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    };
    let mut text = String::new();
    File::open(path).map_err(failed)?.take(MAX_BYTES + 1).read_to_string(&mut text).map_err(failed)?;
    if text.len() as u64 > MAX_BYTES {
        return Err(DataError::new("is larger than 4 MiB, which no description of a sensor is").at(path));
    }
    if text.trim().is_empty() {
        return Err(DataError::new("the file is empty").at(path));
    }
    Ok(crate::leniency::without_marks(&text).into_owned())
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    struct Sensor {
        rate_hz: f64,
        #[serde(rename = "T_BS")]
        t_bs: Matrix,
    }

    #[derive(Debug, Deserialize)]
    struct Matrix {
        data: Vec<f64>,
    }

    #[test]
    fn the_dialect_of_opencv_is_read() {
        for head in
            ["%YAML:1.0\n", "%YAML:1.0\n---\n", "%YAML:1.0\r\n", "\u{feff}%YAML 1.0\n---\n", "---\n", ""]
        {
            let text = format!(
                "{head}# comment\nrate_hz: 20\nT_BS: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: d\n   data: [ 1., -2.5e-3,\n      0 ]\n"
            );
            let sensor: Sensor = parse(&text).unwrap_or_else(|e| panic!("{head:?}: {e}"));
            assert_eq!((sensor.rate_hz, sensor.t_bs.data), (20.0, vec![1.0, -0.0025, 0.0]));
        }
    }

    #[test]
    fn errors_name_the_line() {
        let error = parse::<Sensor>("%YAML:1.0\nrate_hz: fast\nT_BS: {data: []}\n").unwrap_err();
        assert_eq!(error.place(), Some(vice_core::error::Place::Line(2)), "{error}");
        assert!(!error.to_string().contains('\n'), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sensor.yaml");
        assert!(read::<Sensor>(&path).unwrap_err().to_string().contains("no such file"));
        std::fs::write(&path, b" \n").unwrap();
        assert!(read::<Sensor>(&path).unwrap_err().to_string().contains("is empty"));
        std::fs::write(&path, [0xff, 0xfe, 0]).unwrap();
        assert!(read::<Sensor>(&path).unwrap_err().to_string().contains("not text"));
        std::fs::write(&path, vec![b'#'; 5 << 20]).unwrap();
        assert!(read::<Sensor>(&path).unwrap_err().to_string().contains("larger than"));
    }
}
