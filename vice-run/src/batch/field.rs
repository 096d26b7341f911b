//! The columns of a manifest: fields of a request by the name of their option, or by their place in the request.

use serde_json::{Map, Value, json};

use crate::request::Request;

/// What a cell holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Cell {
    /// Text; commas part it where the field is a list.
    Text(String),
    /// A list that is parted already.
    List(Vec<String>),
}

impl Cell {
    /// The parts of a list.
    pub(super) fn parts(&self) -> Vec<String> {
        match self {
            Self::List(parts) => parts.clone(),
            Self::Text(text) => {
                text.split(',').map(str::trim).filter(|p| !p.is_empty()).map(str::to_string).collect()
            }
        }
    }

    /// The one text.
    fn text(&self) -> Result<&str, String> {
        match self {
            Self::Text(text) => Ok(text),
            Self::List(_) => Err("is one value, not a list".to_string()),
        }
    }

    /// The cell with other texts.
    pub(super) fn map(&self, change: impl Fn(&str) -> String) -> Self {
        match self {
            Self::Text(text) => Self::Text(change(text)),
            Self::List(parts) => Self::List(parts.iter().map(|p| change(p)).collect()),
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Text,
    Texts,
    Number,
    Numbers,
    Counts,
    Switch,
    Settings,
}

/// Options, where they stand in a request, and what they hold.
const FIELDS: [(&str, &str, Kind); 41] = [
    ("dataset", "dataset.path", Kind::Text),
    ("format", "dataset.format", Kind::Text),
    ("set", "dataset.set", Kind::Settings),
    ("camera", "dataset.camera", Kind::Text),
    ("calibration", "dataset.calibration", Kind::Text),
    ("intrinsics", "dataset.intrinsics", Kind::Numbers),
    ("distortion", "dataset.distortion", Kind::Text),
    ("image-size", "dataset.image_size", Kind::Text),
    ("body-from-camera", "dataset.body_from_camera", Kind::Numbers),
    ("cloud", "dataset.cloud", Kind::Text),
    ("mesh", "dataset.mesh", Kind::Text),
    ("world-from-cloud", "dataset.world_from_cloud", Kind::Text),
    ("floor-plane", "dataset.floor_plane", Kind::Numbers),
    ("plugin", "dataset.plugins.files", Kind::Texts),
    ("allow-writable-plugin", "dataset.plugins.allow_writable", Kind::Switch),
    ("isolate-plugins", "dataset.plugins.isolate", Kind::Switch),
    ("labels", "labels.file", Kind::Text),
    ("points", "labels.points", Kind::Texts),
    ("observations", "labels.observations", Kind::Text),
    ("fps", "protocol.fps", Kind::Number),
    ("start", "protocol.start_s", Kind::Number),
    ("duration", "protocol.duration_s", Kind::Number),
    ("estimate", "streams.estimates", Kind::Texts),
    ("reference", "streams.reference", Kind::Text),
    ("estimate-frame", "streams.estimate_frame", Kind::Text),
    ("estimate-as", "streams.estimate_as", Kind::Texts),
    ("times", "streams.times", Kind::Text),
    ("time-offset", "streams.time_offset_s", Kind::Number),
    ("max-gap", "streams.max_gap_s", Kind::Number),
    ("anchor", "streams.anchor", Kind::Text),
    ("initial-pose", "streams.initial_pose", Kind::Numbers),
    ("depth", "depth.sources", Kind::Texts),
    ("zmap-occlusion", "depth.zmap_occlusion", Kind::Switch),
    ("zmap-interpolation", "depth.zmap_interpolation", Kind::Text),
    ("cloud-voxel", "depth.cloud_voxel_m", Kind::Number),
    ("zcam-range", "depth.zcam_range_m", Kind::Numbers),
    ("tag-size", "depth.tag_size_m", Kind::Number),
    ("tag-family", "depth.tag_family", Kind::Text),
    ("stereo-camera", "depth.stereo_camera", Kind::Text),
    ("depth-check", "depth.compare", Kind::Switch),
    ("subsets", "scoring.subsets", Kind::Counts),
];
const ALIGN: (&str, &str, Kind) = ("align", "scoring.align", Kind::Text);

/// Columns that are no field of a request.
pub(super) const RUN_ID: &str = "run_id";
pub(super) const GROUP: &str = "group";
pub(super) const FLIGHT: &str = "flight";
pub(super) const ESTIMATOR: &str = "estimator";
const NAMES: [&str; 4] = [RUN_ID, GROUP, FLIGHT, ESTIMATOR];
/// The field that globs are looked for in.
pub(super) const DATASET: &str = "dataset.path";

fn fields() -> impl Iterator<Item = (&'static str, &'static str, Kind)> {
    FIELDS.into_iter().chain([ALIGN])
}

/// Where the cells of a column go: a name that is no field of a request, or a place in one.
///
/// # Errors
/// What is wrong, in words.
pub(super) fn place(column: &str) -> Result<String, String> {
    if NAMES.contains(&column) {
        return Ok(column.to_string());
    }
    for start in ["set.", "dataset.set."] {
        if let Some(key) = column.strip_prefix(start).filter(|k| !k.is_empty()) {
            return Ok(format!("dataset.set.{key}"));
        }
    }
    let option = column.replace('_', "-");
    let found = fields().find(|(name, place, _)| *name == option || *place == column);
    found.map(|(_, place, _)| place.to_string()).ok_or_else(|| {
        let known: Vec<&str> = NAMES.into_iter().chain(fields().map(|f| f.0)).collect();
        format!("there is no column `{column}`; known: {}", known.join(", "))
    })
}

/// The option that a place is known by.
pub(super) fn option(place: &str) -> String {
    let found = fields().find(|(_, p, _)| *p == place);
    found.map_or_else(|| place.to_string(), |(name, ..)| name.to_string())
}

/// What a request cannot do without, still empty.
pub(super) fn start() -> Map<String, Value> {
    Map::from_iter([
        ("dataset".to_string(), json!({"path": ""})),
        ("labels".to_string(), json!({"file": ""})),
    ])
}

/// Puts a cell into the request that is being made.
///
/// # Errors
/// What is wrong, in words.
pub(super) fn put(request: &mut Map<String, Value>, place: &str, cell: &Cell) -> Result<(), String> {
    if let Some(key) = place.strip_prefix("dataset.set.") {
        return insert(request, &["dataset", "set", key], json!(cell.text()?));
    }
    let kind = fields().find(|(_, p, _)| *p == place).map(|f| f.2).ok_or("is no field of a request")?;
    if let Kind::Settings = kind {
        for part in cell.parts() {
            let (key, value) = part.split_once('=').ok_or_else(|| format!("`{part}` is not KEY=VALUE"))?;
            insert(request, &["dataset", "set", key.trim()], json!(value.trim()))?;
        }
        return Ok(());
    }
    let value = value(kind, cell)?;
    let path: Vec<&str> = place.split('.').collect();
    // Asked for by itself, so that what is wrong is known to be this field.
    let mut alone = start();
    insert(&mut alone, &path, value.clone())?;
    serde_json::from_value::<Request>(Value::Object(alone)).map_err(|e| e.to_string())?;
    insert(request, &path, value)
}

fn value(kind: Kind, cell: &Cell) -> Result<Value, String> {
    let number = |text: &str| match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is no number")),
    };
    let count = |text: &str| text.trim().parse::<usize>().map_err(|_| format!("`{text}` is no count"));
    Ok(match kind {
        Kind::Text | Kind::Settings => json!(cell.text()?),
        Kind::Texts => json!(cell.parts()),
        Kind::Number => json!(number(cell.text()?)?),
        Kind::Numbers => json!(cell.parts().iter().map(|p| number(p)).collect::<Result<Vec<_>, _>>()?),
        Kind::Counts => json!(cell.parts().iter().map(|p| count(p)).collect::<Result<Vec<_>, _>>()?),
        Kind::Switch => json!(match cell.text()? {
            "on" | "true" => true,
            "off" | "false" => false,
            other => return Err(format!("`{other}` is neither on nor off")),
        }),
    })
}

fn insert(object: &mut Map<String, Value>, path: &[&str], value: Value) -> Result<(), String> {
    match path {
        [] => Ok(()),
        [name] => {
            object.insert((*name).to_string(), value);
            Ok(())
        }
        [name, rest @ ..] => {
            let inner = object.entry(*name).or_insert_with(|| Value::Object(Map::new()));
            inner.as_object_mut().map_or(Ok(()), |inner| insert(inner, rest, value))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::tests::everything;

    #[test]
    fn a_column_is_named_as_the_option_or_as_the_request_has_it() {
        for name in ["max-gap", "max_gap", "streams.max_gap_s"] {
            assert_eq!(place(name).unwrap(), "streams.max_gap_s");
        }
        assert_eq!(place("set.urdf").unwrap(), "dataset.set.urdf");
        assert!(
            place("fsp")
                .unwrap_err()
                .contains("no column `fsp`; known: run_id, group, flight, estimator, dataset")
        );
    }

    #[test]
    fn each_field_is_one_of_a_request() {
        let sample = |place: &str, kind: Kind| match (place, kind) {
            ("labels.observations", _) => "all",
            ("streams.estimate_as", _) => "wxyz",
            ("depth.sources", _) => "floor",
            ("depth.zmap_interpolation", _) => "natural",
            ("depth.tag_family", _) => "36h11",
            ("scoring.align", _) => "yaw",
            ("dataset.floor_plane" | "dataset.intrinsics", _) => "1,1,1,0",
            ("dataset.distortion", _) => "fov:0.9",
            ("dataset.image_size", _) => "640x480",
            ("streams.initial_pose", _) => "0,0,0,0,0,0,1",
            ("depth.zcam_range_m", _) => "1,2",
            (_, Kind::Number | Kind::Numbers | Kind::Counts) => "1",
            (_, Kind::Switch) => "on",
            (_, Kind::Settings) => "a=b",
            (_, Kind::Text | Kind::Texts) => "x",
        };
        let mut request = start();
        for (option, place, kind) in fields() {
            let cell = Cell::Text(sample(place, kind).to_string());
            put(&mut request, place, &cell).unwrap_or_else(|e| panic!("{option}: {e}"));
        }
        let request: Request = serde_json::from_value(Value::Object(request)).unwrap();
        assert_eq!(request.dataset.set["a"], "b");
        // Whatever a command line can say, a column can: each option of the one is a field of the other.
        for words in [request.command_line(), everything().command_line()] {
            for option in words.split(" --").skip(1).filter_map(|w| w.split(' ').next()) {
                assert!(fields().any(|f| f.0 == option), "{option}");
            }
        }
    }
}
