//! The formats that are known: those built in, and those of plugins.

use std::path::Path;
use std::sync::OnceLock;

use vice_core::dataset::{DatasetFactory, FormatInfo};
use vice_core::error::{DataResult, one_line};
use vice_core::registry::Registry;
use vice_host::isolated::{self, IsolatedPlugin, isolated_by_default};
use vice_host::{LoadOptions, Plugin, search};

use crate::error::{RunError, RunResult};
use crate::request::PluginsSpec;

/// A library that is loaded, in this process or in one of its own.
#[derive(Clone)]
pub enum Loaded {
    /// In this process.
    Here(Plugin),
    /// In processes of its own.
    Isolated(IsolatedPlugin),
}

impl Loaded {
    /// Loads a library where the request, or else the place of the library, says.
    fn load(file: &Path, plugins: &PluginsSpec) -> DataResult<Self> {
        let options = LoadOptions { allow_writable: plugins.allow_writable };
        // Who uses VICE as a library may have no program that serves plugins.
        let apart = plugins.isolate.unwrap_or_else(|| isolated::can_isolate() && isolated_by_default(file));
        match apart {
            true => IsolatedPlugin::load(file, &options).map(Self::Isolated),
            false => Plugin::load(file, &options).map(Self::Here),
        }
    }

    /// What the format is.
    pub fn info(&self) -> &FormatInfo {
        match self {
            Self::Here(plugin) => plugin.info(),
            Self::Isolated(plugin) => plugin.info(),
        }
    }

    /// Where the library is, without links.
    pub fn path(&self) -> &Path {
        match self {
            Self::Here(plugin) => plugin.path(),
            Self::Isolated(plugin) => plugin.path(),
        }
    }

    /// Whether its table is that of this program's contract in full, or an older and shorter one.
    pub fn complete_table(&self) -> bool {
        match self {
            Self::Here(plugin) => plugin.complete_table(),
            Self::Isolated(plugin) => plugin.complete_table(),
        }
    }

    /// Whether it runs in processes of its own.
    pub const fn is_isolated(&self) -> bool {
        matches!(self, Self::Isolated(_))
    }

    fn factory(&self) -> Box<dyn DatasetFactory> {
        match self {
            Self::Here(plugin) => Box::new(plugin.clone()),
            Self::Isolated(plugin) => Box::new(plugin.clone()),
        }
    }
}

/// A format that came with a library.
pub struct LoadedPlugin {
    /// The library.
    pub plugin: Loaded,
    /// Whether it took the place of a built-in format.
    pub replaces: bool,
}

/// All formats, and where those of plugins came from.
pub struct Formats {
    /// All formats by name, those of plugins among them.
    pub registry: Registry,
    /// Formats of plugins.
    pub plugins: Vec<LoadedPlugin>,
    /// Why libraries that nobody named were not loaded, one line each.
    pub left_out: Vec<String>,
}

/// Makes the formats of the program that VICE is a part of, whenever formats are loaded.
type OfHost = Box<dyn Fn() -> Vec<Box<dyn DatasetFactory>> + Send + Sync>;

static OF_HOST: OnceLock<OfHost> = OnceLock::new();

/// Names the formats of the program that VICE is a part of, such as those written in Python. They stand behind what is
/// built in and take no other's place. Said once, before anything is opened; false if it was said before.
pub fn of_host(formats: impl Fn() -> Vec<Box<dyn DatasetFactory>> + Send + Sync + 'static) -> bool {
    OF_HOST.set(Box::new(formats)).is_ok()
}

/// The formats that are built in.
pub fn built_in() -> Registry {
    let mut registry = Registry::new();
    registry.add(Box::new(vice_blackbird::Blackbird));
    registry.add(Box::new(vice_euroc::Euroc));
    registry.add(Box::new(vice_images::Images));
    registry.add(Box::new(vice_locobot::Locobot));
    registry.add(Box::new(vice_video::Video));
    registry
}

/// A registry of all formats; what was left out is a warning.
///
/// # Errors
/// As [`Formats::load`].
pub fn registry(plugins: &PluginsSpec) -> RunResult<Registry> {
    let formats = Formats::load(plugins)?;
    for line in &formats.left_out {
        tracing::warn!("{line}");
    }
    Ok(formats.registry)
}

impl Formats {
    /// Loads plugins: those named, which must load, then those found where plugins lie, which may not.
    ///
    /// # Errors
    /// [`RunError`] if a named one does not load, or two named ones read the same format.
    pub fn load(plugins: &PluginsSpec) -> RunResult<Self> {
        let mut formats = Self { registry: built_in(), plugins: Vec::new(), left_out: Vec::new() };
        for file in &plugins.files {
            formats.named(Loaded::load(file, plugins)?)?;
        }
        let found = search::find();
        formats.left_out.extend(found.remarks);
        for file in found.libraries {
            match Loaded::load(&file, plugins) {
                Ok(plugin) => formats.found(plugin),
                Err(error) => formats.left_out.push(format!("plugin {}", one_line(&error))),
            }
        }
        formats.add_those_of_host();
        Ok(formats)
    }

    fn add_those_of_host(&mut self) {
        for factory in OF_HOST.get().map(|formats| formats()).unwrap_or_default() {
            let name = factory.info().name;
            if self.registry.by_name(&name).is_ok() {
                self.left_out
                    .push(format!("the host's format `{name}` is left out: there is one of that name"));
            } else {
                self.registry.add(factory);
            }
        }
    }

    /// One that the user named goes before what is built in, but two of them must not compete.
    fn named(&mut self, plugin: Loaded) -> RunResult<()> {
        let name = plugin.info().name.clone();
        match self.plugins.iter().find(|p| p.plugin.info().name == name) {
            Some(same) if same.plugin.path() == plugin.path() => Ok(()),
            Some(other) => Err(RunError::usage(
                "plugin",
                format!(
                    "{} and {} both read the format `{name}`; name one of them",
                    other.plugin.path().display(),
                    plugin.path().display()
                ),
            )),
            None => {
                self.add(plugin);
                Ok(())
            }
        }
    }

    /// One that was found takes no other's place.
    fn found(&mut self, plugin: Loaded) {
        let name = plugin.info().name.clone();
        let path = plugin.path().display().to_string();
        match self.plugins.iter().find(|p| p.plugin.info().name == name) {
            Some(same) if same.plugin.path() == plugin.path() => {}
            Some(other) => self.left_out.push(format!(
                "plugin {path} is left out: {} reads the format `{name}` as well and came first",
                other.plugin.path().display()
            )),
            None if self.registry.by_name(&name).is_ok() => self.left_out.push(format!(
                "plugin {path} is left out: the format `{name}` is built in (naming {path} as a plugin puts it first)"
            )),
            None => self.add(plugin),
        }
    }

    fn add(&mut self, plugin: Loaded) {
        let replaces = self.registry.by_name(&plugin.info().name).is_ok();
        self.registry.add(plugin.factory());
        self.plugins.push(LoadedPlugin { plugin, replaces });
    }
}
