//! Formats by name, and finding the one that a path is of.

use std::path::{Path, PathBuf};

use crate::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe};
use crate::error::{DataError, DataResult, ErrorKind};

/// The formats that are known. A plain value: there is no global state.
#[derive(Default)]
pub struct Registry {
    factories: Vec<Box<dyn DatasetFactory>>,
}

impl Registry {
    /// No formats.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a format. One added later goes before an earlier one of the same name.
    pub fn add(&mut self, factory: Box<dyn DatasetFactory>) {
        let name = factory.info().name;
        self.factories.retain(|f| f.info().name != name);
        self.factories.push(factory);
        self.factories.sort_by_key(|f| f.info().name);
    }

    /// What is known, by name.
    pub fn formats(&self) -> Vec<FormatInfo> {
        self.factories.iter().map(|f| f.info()).collect()
    }

    /// The format with this name.
    ///
    /// # Errors
    /// [`DataError`] that lists the known names.
    pub fn by_name(&self, name: &str) -> DataResult<&dyn DatasetFactory> {
        self.factories.iter().find(|f| f.info().name == name).map(AsRef::as_ref).ok_or_else(|| {
            DataError::new(format!("unknown format `{name}`")).hint(format!("known: {}", self.names()))
        })
    }

    /// The one format that claims a path.
    ///
    /// # Errors
    /// [`DataError`] if the path does not exist, or no format or more than one claims it.
    pub fn detect(&self, path: &Path) -> DataResult<(&dyn DatasetFactory, Probe)> {
        if !path.exists() {
            return Err(DataError::of_kind(ErrorKind::Missing, "no such file or folder").at(path));
        }
        let mut claims: Vec<(&dyn DatasetFactory, Probe)> = self
            .factories
            .iter()
            .map(|f| (f.as_ref(), f.probe(path)))
            .filter(|(_, probe)| *probe != Probe::No)
            .collect();
        // A format of this very robot knows better than one of folders in general.
        if claims.iter().any(|(f, _)| !f.is_general()) {
            claims.retain(|(f, _)| !f.is_general());
        }
        // A folder that is a data set is opened as one, also where data sets of another format lie below it.
        if claims.iter().filter(|(_, probe)| *probe == Probe::Yes).count() == 1 {
            claims.retain(|(_, probe)| *probe == Probe::Yes);
        }
        match claims.len() {
            1 => Ok(claims.remove(0)),
            0 => Err(DataError::new("no format recognises this")
                .at(path)
                .hint(format!("known: {}; force one with `format`", self.names()))),
            _ => {
                let names: Vec<String> = claims.iter().map(|(f, _)| f.info().name).collect();
                Err(DataError::new(format!("more than one format recognises this: {}", names.join(", ")))
                    .at(path)
                    .hint("choose with `format`"))
            }
        }
    }

    /// Opens a data set, by the named format or the one that claims the path.
    ///
    /// # Errors
    /// [`DataError`] as in [`Registry::detect`], for a setting the format does not have, for a folder of several data
    /// sets, and whatever opening meets.
    pub fn open(
        &self,
        path: &Path,
        format: Option<&str>,
        options: &OpenOptions,
    ) -> DataResult<Box<dyn Dataset>> {
        let factory = match format {
            Some(name) => {
                if !path.exists() {
                    return Err(DataError::of_kind(ErrorKind::Missing, "no such file or folder").at(path));
                }
                self.by_name(name)?
            }
            None => match self.detect(path)? {
                (factory, Probe::Collection(paths)) => {
                    return Err(collection(path, &factory.info().name, &paths));
                }
                (factory, _) => factory,
            },
        };
        let info = factory.info();
        if let Some(key) = options.settings.keys().find(|k| info.settings.iter().all(|s| s.key != **k)) {
            let known: Vec<&str> = info.settings.iter().map(|s| s.key.as_str()).collect();
            let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
            return Err(DataError::new(format!("format {} has no setting `{key}`", info.name))
                .hint(format!("its settings: {known}")));
        }
        factory.open(path, options)
    }

    fn names(&self) -> String {
        let names: Vec<String> = self.factories.iter().map(|f| f.info().name).collect();
        names.join(", ")
    }
}

fn collection(path: &Path, format: &str, paths: &[PathBuf]) -> DataError {
    let first = paths.first().map_or_else(String::new, |p| p.display().to_string());
    DataError::new(format!("this is a folder of {format} data sets ({} of them), not one", paths.len()))
        .at(path)
        .hint(format!("name one of them, such as {first}; `vice info` lists them"))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Claims(&'static str, Probe);

    impl DatasetFactory for Claims {
        fn info(&self) -> FormatInfo {
            FormatInfo {
                name: self.0.to_string(),
                description: String::new(),
                version: String::new(),
                offers: vec![],
                settings: vec![],
            }
        }
        fn is_general(&self) -> bool {
            self.0 == "general"
        }

        fn probe(&self, _: &Path) -> Probe {
            self.1.clone()
        }
        fn open(&self, _: &Path, _: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
            Err(DataError::new(format!("opened by {}", self.0)))
        }
    }

    fn open(claims: Vec<Claims>, format: Option<&str>, options: &OpenOptions) -> String {
        let mut registry = Registry::new();
        for c in claims {
            registry.add(Box::new(c));
        }
        registry.open(Path::new("."), format, options).err().map(|e| e.to_string()).unwrap_or_default()
    }

    #[test]
    fn one_claim_opens_none_or_two_do_not() {
        let none = OpenOptions::default();
        let two = || vec![Claims("a", Probe::Yes), Claims("b", Probe::Yes)];
        assert_eq!(open(vec![Claims("a", Probe::Yes), Claims("b", Probe::No)], None, &none), "opened by a");
        assert!(open(two(), None, &none).contains("more than one format recognises this: a, b"));
        assert_eq!(open(two(), Some("b"), &none), "opened by b");
        assert!(open(vec![Claims("a", Probe::No)], None, &none).contains("no format recognises this"));
        assert!(open(two(), Some("c"), &none).contains("unknown format `c` (known: a, b)"));
        let many = Probe::Collection(vec![PathBuf::from("x"), PathBuf::from("y")]);
        assert!(open(vec![Claims("a", many)], None, &none).contains("a folder of a data sets (2 of them)"));
        // A description of a film with a bag in a folder below it.
        let below = || Claims("b", Probe::Collection(vec![PathBuf::from("x")]));
        assert_eq!(open(vec![Claims("a", Probe::Yes), below()], None, &none), "opened by a");
        assert!(
            open(vec![Claims("a", Probe::Yes), below(), Claims("c", Probe::Yes)], None, &none)
                .contains("more than")
        );
        assert_eq!(open(vec![Claims("general", Probe::Yes)], None, &none), "opened by general");
        let robot = || Claims("robot", Probe::Yes);
        assert_eq!(open(vec![Claims("general", Probe::Yes), robot()], None, &none), "opened by robot");
        let set = OpenOptions { settings: [("k".to_string(), "v".to_string())].into() };
        assert!(open(two(), Some("a"), &set).contains("no setting `k`"));
        let gone = Registry::new().detect(Path::new("no/such")).err().unwrap();
        assert_eq!(gone.to_string(), "no/such: no such file or folder");
    }
}
