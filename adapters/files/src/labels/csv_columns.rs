//! Which column of a table of labels holds what, by its name.

use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::Suspicion;
use vice_core::time::{Stamp, TimeError};

use crate::columns::{ColumnName, Quantity, TimeUnit};

const EXPECTED: &str = "a heading `point,timestamp_ns,u_px,v_px,keyframe[,source,flags,camera]` is expected";

/// Where the columns are.
pub(super) struct Columns {
    pub(super) point: usize,
    pub(super) timestamp: usize,
    /// `None` until the first row shows it.
    unit: Option<TimeUnit>,
    pub(super) u_px: usize,
    pub(super) v_px: usize,
    pub(super) keyframe: usize,
    pub(super) source: Option<usize>,
    pub(super) flags: Option<usize>,
    pub(super) camera: Option<usize>,
    /// Names that are not known.
    pub(super) unknown: Vec<String>,
}

/// Names of each column beside its own, in lower case and without `_`.
const NAMES: [(&str, &[&str]); 7] = [
    ("point", &["point", "pointid", "pointname", "label", "landmark", "feature"]),
    ("u_px", &["upx", "u", "pxu", "pixelu", "x", "xpx", "px", "pixelx", "imagex", "col", "column"]),
    ("v_px", &["vpx", "v", "pxv", "pixelv", "y", "ypx", "py", "pixely", "imagey", "row"]),
    ("keyframe", &["keyframe", "iskeyframe", "key", "iskey"]),
    ("source", &["source"]),
    ("flags", &["flags", "flag"]),
    ("camera", &["camera", "cameraname"]),
];

impl Columns {
    pub(super) fn find<'h>(heading: impl Iterator<Item = &'h str>) -> DataResult<Self> {
        let names: Vec<&str> = heading.map(|n| n.trim().trim_start_matches('#').trim()).collect();
        if names.iter().all(|n| n.is_empty()) {
            return Err(DataError::new("the file is empty").hint(EXPECTED));
        }
        let compact = |name: &str| -> String {
            let plain = name.split(['[', '(']).next().unwrap_or_default();
            plain.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect()
        };
        let mut used = vec![false; names.len()];
        let mut find = |name: &str| -> DataResult<Option<usize>> {
            let known = NAMES.iter().find(|(n, _)| *n == name).map_or(&[][..], |(_, known)| known);
            let found: Vec<usize> = (0..names.len())
                .filter(|i| names[*i] == name || known.contains(&compact(names[*i]).as_str()))
                .collect();
            match found[..] {
                [] => Ok(None),
                [only] => {
                    used[only] = true;
                    Ok(Some(only))
                }
                [a, b, ..] if names[a] == names[b] => {
                    Err(DataError::new(format!("the column {} appears twice", names[a])))
                }
                [a, b, ..] => Err(DataError::new(format!(
                    "the columns `{}` and `{}` could both be {name}: which of them is meant?",
                    names[a], names[b]
                ))),
            }
        };
        let required = |name: &str, found: Option<usize>| {
            found.ok_or_else(|| DataError::new(format!("the column {name} is missing")).hint(EXPECTED))
        };
        let point = required("point", find("point")?)?;
        let columns: Vec<ColumnName> = names.iter().map(|n| ColumnName::new(n)).collect();
        let is_time = |i: &usize| columns[*i].meaning.is_some_and(|(q, _)| q == Quantity::Time);
        let times: Vec<usize> = (0..names.len()).filter(is_time).collect();
        let exact = names.iter().filter(|n| **n == "timestamp_ns").count();
        let timestamp = match times[..] {
            _ if exact > 1 => return Err(DataError::new("the column timestamp_ns appears twice")),
            [] => return Err(DataError::new("the column timestamp_ns is missing").hint(EXPECTED)),
            [only] => only,
            _ if exact == 1 => names.iter().position(|n| *n == "timestamp_ns").unwrap_or(times[0]),
            [a, b, ..] => {
                return Err(DataError::new(format!(
                    "the columns `{}` and `{}` could both be the stamps: which of them is meant?",
                    names[a], names[b]
                )));
            }
        };
        let (u_px, v_px) = (required("u_px", find("u_px")?)?, required("v_px", find("v_px")?)?);
        let keyframe = required("keyframe", find("keyframe")?)?;
        let (source, flags, camera) = (find("source")?, find("flags")?, find("camera")?);
        used[timestamp] = true;
        let unknown =
            names.iter().zip(&used).filter(|(_, used)| !**used).map(|(n, _)| (*n).to_string()).collect();
        let unit = columns[timestamp].time_unit();
        Ok(Self { point, timestamp, unit, u_px, v_px, keyframe, source, flags, camera, unknown })
    }

    /// A stamp in the unit of the column.
    pub(super) fn stamp(&mut self, text: &str) -> Result<Stamp, TimeError> {
        let by_size = || match text.parse::<f64>().map_or(TimeUnit::Nanos, TimeUnit::of_magnitude) {
            // Labels are in nanoseconds, which those of a simulation count from zero.
            TimeUnit::Seconds if text.bytes().all(|b| b.is_ascii_digit()) => TimeUnit::Nanos,
            shown => shown,
        };
        self.unit.get_or_insert_with(by_size);
        self.stamp_in_unit(text)
    }

    /// A stamp in the unit that is known by now.
    pub(super) fn stamp_in_unit(&self, text: &str) -> Result<Stamp, TimeError> {
        match self.unit {
            Some(TimeUnit::Seconds) => Stamp::parse_seconds(text),
            Some(TimeUnit::Millis) => Stamp::parse_millis(text),
            Some(TimeUnit::Micros) => Stamp::parse_micros(text),
            Some(TimeUnit::Nanos) | None => Stamp::parse_nanos(text),
        }
    }

    /// What is to be said of columns that are not known.
    pub(super) fn unknown_said(&self) -> Option<Suspicion> {
        let names = self.unknown.join(", ");
        (!names.is_empty()).then(|| {
            Suspicion::new("label-columns", "", "columns that are not known are passed over").evidence(names)
        })
    }

    /// The unit of the stamps, where the name of their column says it or a row has shown it.
    pub(super) const fn unit(&self) -> Option<TimeUnit> {
        self.unit
    }

    /// What the unit is called in messages.
    pub(super) fn unit_name(&self) -> &'static str {
        match self.unit {
            Some(TimeUnit::Seconds) => "s",
            Some(TimeUnit::Millis) => "ms",
            Some(TimeUnit::Micros) => "us",
            _ => "ns",
        }
    }
}
