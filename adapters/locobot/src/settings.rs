//! Settings: names of topics and frames, by `--set key=value` or a `vice.toml` beside the recording.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use vice_core::dataset::{OpenOptions, SettingInfo};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::Rigid;

use vice_files::vice_toml::{COMMON, ViceToml};

use crate::pixels::DepthUnit;
use crate::tf::Transform;

/// Its table, where it has more than the settings of one format.
const TABLE: &str = "locobot";

/// Keys and what they do.
const KEYS: [(&str, &str); 19] = [
    ("color_topic", "image topic of the camera (default /camera/color/image_raw, else found by type)"),
    ("depth_topic", "depth image registered to it (default /camera/aligned_depth_to_color/image_raw)"),
    ("camera_info_topic", "its calibration (default: camera_info beside the image topic)"),
    ("imu_topic", "inertial samples (default /imu, else found by type)"),
    (
        "ground_truth",
        "topic or trajectory file of the ground truth, such as a motion capture (default: none)",
    ),
    (
        "ground_truth_frame",
        "tf frame whose poses the ground truth gives (default: as the topic says, else the base)",
    ),
    ("tf_namespace", "robot whose tf is used, such as /robot1 (default: that of the camera's topic)"),
    (
        "depth_unit",
        "`m`, `cm`, `mm` or metres a count: what the numbers of the depth images are (default: mm in 16UC1, m in 32FC1)",
    ),
    ("map_frame", "world frame of the stream `slam` (default map)"),
    ("odom_frame", "world frame of the stream `odom` (default odom)"),
    ("base_frame", "the body (default base_footprint, else base_link)"),
    ("camera_frame", "optical frame of the camera (default: as the images say)"),
    ("floor_frame", "frame whose z = 0 is the floor (default base_footprint)"),
    ("body_from_camera", "`tx ty tz qx qy qz qw` (m), in place of tf"),
    ("urdf", "URDF with joints that tf lacks (default: the topic robot_description)"),
    ("stamps", "`header` or `record`: which time counts, where headers have none (default header)"),
    ("cloud_topic", "PointCloud2 topic whose sweeps are put together as the scan for zmap (default: none)"),
    ("cloud_stream", "stream that places the sweeps in the world (default: ground-truth, else the first)"),
    ("max_depth_offset", "seconds between a frame and its depth image (default: half a frame period)"),
];

/// Which time of a message counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Stamps {
    /// That of its header.
    #[default]
    Header,
    /// When it was recorded.
    Record,
}

/// What was set.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Settings {
    values: BTreeMap<String, String>,
    /// Where relative paths start.
    folder: PathBuf,
}

/// For [`vice_core::dataset::FormatInfo`].
pub(crate) fn infos() -> Vec<SettingInfo> {
    let info = |(key, description): &(&str, &str)| SettingInfo {
        key: (*key).to_string(),
        description: (*description).to_string(),
    };
    KEYS.iter().map(info).collect()
}

impl Settings {
    /// Settings of a recording: those of its `vice.toml`, overridden by the options.
    ///
    /// # Errors
    /// [`DataError`] if the file cannot be used or a key is not known.
    pub(crate) fn load(path: &Path, options: &OpenOptions) -> DataResult<Self> {
        let folder = if path.is_dir() { Some(path) } else { path.parent() };
        let folder = folder.unwrap_or(Path::new("")).to_path_buf();
        let mut settings = Self { values: BTreeMap::new(), folder };
        if let Some(file) = ViceToml::place(path) {
            let text = std::fs::read_to_string(&file)
                .map_err(|e| DataError::new("cannot be read").at(&file).because(e))?;
            settings.values = parse(&text).map_err(|e| e.at(&file))?;
        }
        for (key, value) in &options.settings {
            check_key(key)?;
            settings.values.insert(key.clone(), value.clone());
        }
        Ok(settings)
    }

    /// A value, where it is set.
    pub(crate) fn get(&self, key: &str) -> Option<&str> {
        debug_assert!(KEYS.iter().any(|(k, _)| *k == key), "{key} is not in the list");
        self.values.get(key).map(String::as_str)
    }

    /// A file that a setting names, from the recording's folder where it is relative.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        let beside = self.folder.join(name);
        if beside.exists() { beside } else { PathBuf::from(name) }
    }

    /// Which time of a message counts.
    pub(crate) fn stamps(&self) -> DataResult<Stamps> {
        match self.get("stamps") {
            None | Some("header") => Ok(Stamps::Header),
            Some("record") => Ok(Stamps::Record),
            Some(other) => {
                Err(DataError::new(format!("stamps = {other}")).hint("it is `header` or `record`"))
            }
        }
    }

    /// What the numbers of the depth images are, where it is set.
    pub(crate) fn depth_unit(&self) -> DataResult<Option<DepthUnit>> {
        let Some(text) = self.get("depth_unit") else { return Ok(None) };
        let unit = DepthUnit::parse(text).map(Some);
        unit.ok_or_else(|| {
            DataError::of_kind(ErrorKind::Usage, format!("depth_unit = {text}"))
                .hint("it is m, cm, mm, or how many metres a count is, such as 0.00025")
        })
    }

    /// The fixed place of the camera, where it is set.
    pub(crate) fn body_from_camera(&self) -> DataResult<Option<Transform>> {
        let Some(text) = self.get("body_from_camera") else { return Ok(None) };
        let wrong = |why: String| {
            DataError::new(format!("body_from_camera: {why}")).hint("it is `tx ty tz qx qy qz qw`")
        };
        let numbers: Result<Vec<f64>, _> =
            text.split([' ', ',']).filter(|w| !w.is_empty()).map(str::parse).collect();
        match numbers.map_err(|e| wrong(e.to_string()))?.as_slice() {
            [x, y, z, qx, qy, qz, qw] => Rigid::try_from_parts([*x, *y, *z], [*qw, *qx, *qy, *qz])
                .map(Some)
                .map_err(|e| wrong(e.to_string())),
            other => Err(wrong(format!("{} numbers, not 7", other.len()))),
        }
    }
}

fn check_key(key: &str) -> DataResult<()> {
    if KEYS.iter().any(|(k, _)| *k == key) {
        return Ok(());
    }
    let known: Vec<&str> = KEYS.iter().map(|(k, _)| *k).collect();
    Err(DataError::new(format!("there is no setting `{key}`")).hint(format!("known: {}", known.join(", "))))
}

fn parse(text: &str) -> DataResult<BTreeMap<String, String>> {
    let mut table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
        let line = e.span().map_or(0, |s| text[..s.start].lines().count().max(1));
        DataError::new(format!("is not TOML: {}", e.message())).line(line as u64)
    })?;
    let own = match table.remove(TABLE) {
        Some(toml::Value::Table(own)) => own,
        Some(_) => return Err(DataError::new(format!("[{TABLE}] is not a table"))),
        // Without a table of its own every plain value is meant for this format.
        None => table
            .into_iter()
            .filter(|(key, value)| !value.is_table() && !COMMON.contains(&key.as_str()))
            .collect(),
    };
    let mut values = BTreeMap::new();
    for (key, value) in own {
        check_key(&key)?;
        let value = match value {
            toml::Value::String(text) => text,
            toml::Value::Array(_) | toml::Value::Table(_) => {
                return Err(DataError::new(format!("{key} is not a single value")));
            }
            other => other.to_string(),
        };
        values.insert(key, value);
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_beside_the_recording_is_overridden_by_options() {
        let folder = tempfile::tempdir().unwrap();
        let toml =
            "other = 1\n[locobot]\nbase_frame = \"base\"\nodom_frame = \"o\"\nmax_depth_offset = 0.01\n";
        std::fs::write(folder.path().join("vice.toml"), toml).unwrap();
        std::fs::write(folder.path().join("a.bag"), "").unwrap();
        let options = OpenOptions { settings: [("odom_frame".to_string(), "odom2".to_string())].into() };
        let settings = Settings::load(&folder.path().join("a.bag"), &options).unwrap();
        assert_eq!((settings.get("base_frame"), settings.get("odom_frame")), (Some("base"), Some("odom2")));
        assert_eq!((settings.get("max_depth_offset"), settings.get("urdf")), (Some("0.01"), None));
        assert_eq!(settings, Settings::load(folder.path(), &options).unwrap());
    }

    #[test]
    fn mistakes_are_named() {
        assert!(parse("base_fame = \"x\"").unwrap_err().to_string().contains("no setting `base_fame`"));
        assert!(parse("a = [").unwrap_err().to_string().starts_with("line 1: is not TOML"));
        assert!(parse("urdf = [1]").is_err());
        assert!(parse("[euroc]\nx = 1").unwrap().is_empty(), "a table of another format");
        assert!(
            parse("calibration = \"c.yaml\"\nfloor = [0, 0, 1, 0]").unwrap().is_empty(),
            "keys of every format"
        );
        let set = |key: &str, value: &str| Settings {
            values: [(key.to_string(), value.to_string())].into(),
            folder: PathBuf::new(),
        };
        assert!(set("stamps", "both").stamps().is_err());
        assert!(set("body_from_camera", "1 2 3").body_from_camera().is_err());
        assert!(set("body_from_camera", "1 2 3 0 0 0 2").body_from_camera().is_err());
        let pose = set("body_from_camera", "1, 2, 3, 0, 0, 0, 1").body_from_camera().unwrap().unwrap();
        assert_eq!(pose.translation().z, 3.0);
    }
}
