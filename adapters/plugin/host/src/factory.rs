//! A plugin as a format.

use std::path::Path;

use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe};
use vice_core::error::DataResult;

use crate::dataset::PluginDataset;
use crate::handle;
use crate::library::Plugin;

impl DatasetFactory for Plugin {
    fn info(&self) -> FormatInfo {
        Self::info(self).clone()
    }

    fn probe(&self, path: &Path) -> Probe {
        handle::probe(self.library(), path).unwrap_or_else(|error| {
            tracing::warn!("asking plugin {} about {}: {error}", Self::info(self).name, path.display());
            Probe::No
        })
    }

    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        Ok(Box::new(PluginDataset::open(self.library(), path, options)?))
    }
}
