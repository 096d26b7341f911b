//! What the format says of itself, and what it takes for its own.

use std::path::Path;

use vice_abi::contract::ABI_VERSION;
use vice_core::dataset::{Dataset, Probe};
use vice_core::error::one_line;

use super::{CameraLists, Check, Lists};

impl Check<'_> {
    pub(super) fn format(&mut self) {
        self.step("what the format says of itself");
        let info = self.subject.factory.info();
        let mut wrong = Vec::new();
        if info.name.is_empty()
            || !info.name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c))
        {
            wrong.push(format!("its name `{}` should be a word of a-z, 0-9, - and _", info.name));
        }
        for (what, text) in [("version", &info.version), ("description", &info.description)] {
            if text.trim().is_empty() || text.chars().any(char::is_control) {
                wrong.push(format!("its {what} should be a line of text"));
            }
        }
        let mut keys: Vec<&str> = info.settings.iter().map(|s| s.key.as_str()).collect();
        keys.sort_unstable();
        if let Some(twice) = keys.windows(2).find(|w| w[0] == w[1]) {
            wrong.push(format!("the setting `{}` is described twice", twice[0]));
        }
        if let Some(odd) = keys.iter().find(|k| k.is_empty() || k.contains('=')) {
            wrong.push(format!("the setting `{odd}` cannot be given as --set key=value"));
        }
        match wrong.is_empty() {
            true => self.good(format!("it is {} {}: {}", info.name, info.version, info.description)),
            false => wrong.into_iter().for_each(|text| self.fault(text)),
        }
        if info.offers.is_empty() {
            self.missing("it does not say what it offers; `vice formats` will show nothing");
        }
        if let Some(plugin) = self.subject.plugin {
            let (safe, whole) = (plugin.thread_safe(), plugin.complete_table());
            if !safe {
                self.missing("it is not thread-safe: calls are made one after another, which is slower");
            }
            let version = plugin.abi_version();
            if version < ABI_VERSION {
                self.missing(format!(
                    "it is built for version {version} of the contract, this program's is {ABI_VERSION}: stored images, suspicions and kinds of errors need that one"
                ));
            } else if !whole {
                self.missing("its table is shorter than this program's: newer calls are not used");
            }
        }
    }

    /// Paths that no format should claim or open.
    pub(super) fn wrong_folders(&mut self) {
        self.step("an empty folder, a text file and a path that does not exist");
        let Ok(folder) = tempfile::tempdir() else {
            self.suspicious("no folder for temporary files: wrong folders were not tried");
            return;
        };
        let (empty, notes) = (folder.path().join("empty"), folder.path().join("notes"));
        if std::fs::create_dir(&empty).is_err() || std::fs::write(&notes, "no data\n").is_err() {
            self.suspicious("the folder for temporary files cannot be written: wrong folders were not tried");
            return;
        }
        let before = self.faults;
        let no_such = folder.path().join("no_such");
        for (what, path) in
            [("an empty folder", &empty), ("a text file", &notes), ("a path that does not exist", &no_such)]
        {
            self.wrong_folder(what, path);
        }
        if self.faults == before {
            self.good("it claims no wrong path, and says why it cannot open one");
        }
    }

    fn wrong_folder(&mut self, what: &str, path: &Path) {
        if self.subject.factory.probe(path) != Probe::No {
            self.fault(format!("it claims {what}: `vice` could not tell which format a data set is of"));
        }
        match self.subject.factory.open(path, self.subject.options) {
            Ok(_) => self.fault(format!("it opens {what} without an error")),
            Err(error) if error.problem().trim().is_empty() => {
                self.fault(format!("it does not say why it cannot open {what}"));
            }
            Err(error) => {
                let line = one_line(&error);
                if !line.contains(&path.display().to_string()) {
                    self.suspicious(format!("the error for {what} does not name the path: `{line}`"));
                }
            }
        }
    }

    /// Whether there is a data set to go on with.
    pub(super) fn claims_the_path(&mut self) -> bool {
        self.step("finding the data set");
        match self.subject.factory.probe(self.subject.path) {
            Probe::Yes => self.good("it recognises the data set"),
            Probe::Collection(paths) => {
                let Some(first) = paths.first() else {
                    self.fault("it finds a collection of no data sets");
                    return false;
                };
                self.path = first.clone();
                self.good(format!(
                    "it finds {} data sets; the first is checked: {}",
                    paths.len(),
                    first.display()
                ));
                if self.subject.factory.probe(first) != Probe::Yes {
                    self.fault(format!("it lists {}, but does not recognise it by itself", first.display()));
                }
            }
            _ => self
                .fault("it does not recognise the data set: users would have to name the format each time"),
        }
        true
    }

    pub(super) fn opens(&mut self) -> Option<Box<dyn Dataset>> {
        self.step("opening the data set");
        match self.subject.factory.open(&self.path, self.subject.options) {
            Ok(dataset) => {
                self.good(format!("it opens {}", dataset.name()));
                Some(dataset)
            }
            Err(error) => {
                self.fault(format!("it cannot open the data set: {}", one_line(&error)));
                None
            }
        }
    }

    pub(super) fn lists(&mut self, dataset: &dyn Dataset) -> Lists {
        self.step("names of cameras and pose streams");
        let format = self.subject.factory.info().name;
        if dataset.name().trim().is_empty() || dataset.name().chars().any(char::is_control) {
            self.fault("the data set's name should be a line of text: tables show it");
        }
        if dataset.format() != format {
            self.fault(format!(
                "the data set says it is of `{}`, the format is `{format}`",
                dataset.format()
            ));
        }
        let (cameras, streams) = (dataset.cameras(), dataset.streams());
        for (what, names) in [("camera", &cameras), ("pose stream", &streams)] {
            let mut sorted: Vec<&String> = names.iter().collect();
            sorted.sort_unstable();
            if let Some(twice) = sorted.windows(2).find(|w| w[0] == w[1]) {
                self.fault(format!("two {what}s have the name `{}`", twice[0]));
            }
            if sorted.iter().any(|n| n.trim().is_empty() || n.contains(',')) {
                self.fault(format!(
                    "the name of a {what} is empty or has a comma, which separates names in options"
                ));
            }
        }
        if cameras.is_empty() {
            self.fault("it has no camera: there is nothing to evaluate with");
        }
        let mut lists = Lists { cameras: Vec::new(), streams };
        for name in cameras {
            self.step(format!("frames of camera {name}"));
            match dataset.frames(&name) {
                Ok(frames) => lists.cameras.push(CameraLists { name, frames }),
                Err(error) => self.fault(format!("frames of camera {name}: {}", one_line(&error))),
            }
        }
        lists
    }
}
