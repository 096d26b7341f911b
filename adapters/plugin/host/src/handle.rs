//! What a plugin says of a path, and what it calls a data set that it has opened.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::path::Path;
use std::sync::Arc;

use vice_abi::contract::{self, Text};
use vice_core::dataset::{OpenOptions, Probe};
use vice_core::error::DataResult;

use crate::ask::must;
use crate::border;
use crate::library::Library;

/// Asks a plugin about a path.
pub(crate) fn probe(library: &Library, path: &Path) -> DataResult<Probe> {
    must(
        library,
        &|| "probe".to_string(),
        // SAFETY: the path lives during the call, the rest is as the contract says.
        |out, message| unsafe { (library.calls.probe)(Text::from_path(path), out, message) },
        |probe: &contract::Probe| match probe.answer {
            contract::PROBE_NO => Ok(Probe::No),
            contract::PROBE_YES => Ok(Probe::Yes),
            contract::PROBE_COLLECTION => {
                // SAFETY: the plugin's promise.
                let paths = unsafe { border::list(probe.paths, probe.count, "paths") }?;
                if paths.is_empty() {
                    return Err("a collection of no data sets".to_string());
                }
                // SAFETY: the plugin's promise.
                let path = |p: &Text| unsafe { border::path(*p, "a path of the collection") };
                Ok(Probe::Collection(paths.iter().map(path).collect::<Result<_, _>>()?))
            }
            other => Err(format!("the answer {other} is none of the contract's")),
        },
    )
}

/// What the plugin calls a data set.
pub(crate) struct Handle {
    library: Arc<Library>,
    dataset: *mut c_void,
}

// SAFETY: the contract lets calls on a data set come from any thread, and they overlap only where the plugin allows it.
unsafe impl Send for Handle {}
// SAFETY: as above.
unsafe impl Sync for Handle {}

impl Drop for Handle {
    fn drop(&mut self) {
        let _turn = self.library.turn();
        // SAFETY: open, and closed once; nobody else has it any more.
        unsafe { (self.library.calls.close)(self.dataset) };
    }
}

impl Handle {
    pub(crate) fn open(library: &Arc<Library>, path: &Path, options: &OpenOptions) -> DataResult<Self> {
        let settings: Vec<contract::Setting> = options
            .settings
            .iter()
            .map(|(key, value)| contract::Setting {
                key: Text::from_bytes(key.as_bytes()),
                value: Text::from_bytes(value.as_bytes()),
            })
            .collect();
        must(
            library,
            &|| format!("opening {}", path.display()),
            // SAFETY: path and settings live during the call, the rest is as the contract says.
            |out, message| unsafe {
                let path = Text::from_path(path);
                (library.calls.open)(path, settings.as_ptr(), settings.len(), out, message)
            },
            |dataset: &*mut c_void| match dataset.is_null() {
                true => Err("the data set is null".to_string()),
                false => Ok(Self { library: Arc::clone(library), dataset: *dataset }),
            },
        )
    }

    pub(crate) fn library(&self) -> &Library {
        &self.library
    }

    pub(crate) const fn raw(&self) -> *mut c_void {
        self.dataset
    }
}
