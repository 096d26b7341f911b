//! Which data set, which camera of it, and plugins.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_run::core::time::Stamp;
use vice_run::formats;
use vice_run::request::{DatasetSpec, PluginsSpec};

use super::on_off;

/// Which data set, and which camera of it.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Data set")]
pub(crate) struct DatasetArgs {
    /// Folder or file of the data set, or its address such as s3://bucket/run.mcap in a build with the feature `remote`.
    #[arg(value_name = "DATASET", required = true)]
    pub(crate) path: Option<PathBuf>,
    /// Format of the data set [default: detected].
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

/// Which plugins are loaded beside those in `VICE_PLUGIN_PATH` and the user's folder.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct PluginArgs {
    /// Plugin to load, a shared library; replaces a built-in format of the same name. May be repeated.
    #[arg(long = "plugin", value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Load plugins even from files or folders that others may write to.
    #[arg(long)]
    pub(crate) allow_writable_plugin: bool,
    /// Run plugins in processes of their own, which may crash or hang [default: on for those outside of the home folder].
    #[arg(long, value_name = "on|off", num_args = 0..=1, require_equals = true, default_missing_value = "on", value_parser = on_off)]
    pub(crate) isolate_plugins: Option<bool>,
}

impl DatasetArgs {
    /// The data set without anything that overrides it.
    pub(crate) fn spec(&self) -> DatasetSpec {
        DatasetSpec {
            path: self.path.clone().unwrap_or_default(),
            format: self.format.clone(),
            set: self.settings.iter().cloned().collect(),
            camera: self.camera.clone(),
            plugins: self.plugins.spec(),
            ..DatasetSpec::default()
        }
    }
}

impl PluginArgs {
    pub(crate) fn spec(&self) -> PluginsSpec {
        PluginsSpec {
            files: self.files.clone(),
            allow_writable: self.allow_writable_plugin,
            isolate: self.isolate_plugins,
        }
    }
}

/// The frames of a camera, which some files of labels count.
pub(crate) struct Counted {
    pub(crate) dataset: String,
    pub(crate) camera: String,
    pub(crate) stamps: Arc<[Stamp]>,
}

/// A data set that is named for its frames.
pub(crate) fn counted_spec(path: &Path, camera: Option<&str>, plugins: &PluginArgs) -> DatasetSpec {
    DatasetSpec {
        path: path.to_path_buf(),
        camera: camera.map(str::to_string),
        plugins: plugins.spec(),
        ..DatasetSpec::default()
    }
}

impl Counted {
    /// Those of a data set, which may have no calibration.
    pub(crate) fn of(spec: &DatasetSpec) -> anyhow::Result<Self> {
        let dataset = spec.open_raw(&formats::registry(&spec.plugins)?)?;
        let camera = spec.camera_name(dataset.as_ref())?;
        let stamps = dataset.frames(&camera)?;
        Ok(Self { dataset: dataset.name().to_string(), camera, stamps })
    }
}

pub(crate) fn setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.trim().to_string(), value.trim().to_string())),
        _ => Err("expected KEY=VALUE".to_string()),
    }
}
