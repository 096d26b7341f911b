//! Opening a data set and choosing its camera.

use std::path::PathBuf;
use std::sync::Arc;

use vice_core::camera::Camera;
use vice_core::dataset::{Dataset, OpenOptions};
use vice_core::frames::BodyFromCamera;
use vice_core::registry::Registry;
use vice_core::time::Stamp;
use vice_files::calibration::CalibrationFile;

use crate::formats::{self, PluginArgs};
use crate::terminal::usage;

/// Which data set, and which camera of it.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Data set")]
pub(crate) struct DatasetArgs {
    /// Folder or file of the data set.
    #[arg(value_name = "DATASET")]
    pub(crate) path: PathBuf,
    /// Format of the data set [default: found by looking].
    #[arg(long, value_name = "NAME")]
    pub(crate) format: Option<String>,
    /// Setting of the format; `vice formats` lists them.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting)]
    pub(crate) settings: Vec<(String, String)>,
    /// Camera [default: the first].
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
    #[command(flatten)]
    pub(crate) plugins: PluginArgs,
}

/// A camera as it is used: the data set's, with what a calibration file overrides.
pub(crate) struct UsedCamera {
    pub(crate) name: String,
    pub(crate) camera: Camera,
    pub(crate) frames: Arc<[Stamp]>,
    /// Extrinsics that replace the data set's.
    pub(crate) body_from_camera: Option<BodyFromCamera>,
}

impl DatasetArgs {
    pub(crate) fn open(&self) -> anyhow::Result<Arc<dyn Dataset>> {
        self.open_in(&formats::registry(&self.plugins)?)
    }

    /// Opens it with formats that were loaded before.
    pub(crate) fn open_in(&self, registry: &Registry) -> anyhow::Result<Arc<dyn Dataset>> {
        let options = OpenOptions { settings: self.settings.iter().cloned().collect() };
        Ok(Arc::from(registry.open(&self.path, self.format.as_deref(), &options)?))
    }

    /// The name of the camera that was asked for, or the first.
    pub(crate) fn camera_name(&self, dataset: &dyn Dataset) -> anyhow::Result<String> {
        let names = dataset.cameras();
        match &self.camera {
            Some(name) if names.contains(name) => Ok(name.clone()),
            Some(name) => {
                Err(usage(format!("--camera: there is no camera {name}; there are {}", names.join(", "))))
            }
            None => names
                .into_iter()
                .next()
                .ok_or_else(|| anyhow::anyhow!("{}: the data set has no camera", self.path.display())),
        }
    }

    pub(crate) fn used_camera(
        &self,
        dataset: &dyn Dataset,
        calibration: Option<&CalibrationFile>,
    ) -> anyhow::Result<UsedCamera> {
        let name = self.camera_name(dataset)?;
        let calibration = match calibration {
            Some(file) => Some(
                file.for_camera(&name, &dataset.cameras())
                    .map_err(|e| usage(format!("--calibration: {e}")))?,
            ),
            None => None,
        };
        let calibration = calibration.as_ref();
        let overridden = match calibration {
            // The file may hold only extrinsics, or be all there is where the data set's own is broken.
            Some(file) => file.camera(&name, dataset.camera(&name).ok().as_ref())?,
            None => None,
        };
        let camera = match overridden {
            Some(camera) => camera,
            None => dataset.camera(&name)?,
        };
        let body_from_camera = calibration.and_then(|file| file.body_from_camera(&name));
        let frames = dataset.frames(&name)?;
        Ok(UsedCamera { name, camera, frames, body_from_camera })
    }
}

pub(crate) fn setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.trim().to_string(), value.trim().to_string())),
        _ => Err("expected KEY=VALUE".to_string()),
    }
}

/// Lists repeat the option or take commas; a value that is a file keeps its commas.
pub(crate) fn split_list(values: &[String]) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for value in values {
        let whole = std::path::Path::new(value).exists();
        let parts: Vec<&str> = if whole { vec![value.as_str()] } else { value.split(',').collect() };
        for part in parts.into_iter().map(str::trim).filter(|p| !p.is_empty()) {
            if !list.iter().any(|p| p == part) {
                list.push(part.to_string());
            }
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_repeat_or_take_commas() {
        let list = |values: &[&str]| split_list(&values.iter().map(|v| (*v).to_string()).collect::<Vec<_>>());
        assert_eq!(list(&["floor,zmap", "zcam", "floor"]), ["floor", "zmap", "zcam"]);
        assert_eq!(list(&["a, b,,"]), ["a", "b"]);
    }
}
