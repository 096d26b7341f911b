//! The formats that are known: those built in, and those of plugins.

use std::path::PathBuf;

use vice_core::error::one_line;
use vice_core::registry::Registry;
use vice_host::{LoadOptions, Plugin, search};

use crate::terminal::usage;

/// Which plugins are loaded beside those in `VICE_PLUGIN_PATH` and the user's folder.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct PluginArgs {
    /// Plugin to load, a shared library; goes before a built-in format of the same name. May be repeated.
    #[arg(long = "plugin", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Load plugins even from files or folders that others may write to.
    #[arg(long)]
    allow_writable_plugin: bool,
}

/// A format that came with a library.
pub(crate) struct LoadedPlugin {
    pub(crate) plugin: Plugin,
    /// Whether it took the place of a built-in format.
    pub(crate) replaces: bool,
}

/// All formats, and where those of plugins came from.
pub(crate) struct Formats {
    pub(crate) registry: Registry,
    pub(crate) plugins: Vec<LoadedPlugin>,
    /// Why libraries that nobody named were not loaded, one line each.
    pub(crate) left_out: Vec<String>,
}

/// The formats that are built in.
pub(crate) fn built_in() -> Registry {
    let mut registry = Registry::new();
    registry.add(Box::new(vice_blackbird::Blackbird));
    registry.add(Box::new(vice_euroc::Euroc));
    registry.add(Box::new(vice_locobot::Locobot));
    registry.add(Box::new(vice_video::Video));
    registry
}

/// A registry of all formats; what was left out is a warning.
pub(crate) fn registry(args: &PluginArgs) -> anyhow::Result<Registry> {
    let formats = Formats::load(args)?;
    for line in &formats.left_out {
        tracing::warn!("{line}");
    }
    Ok(formats.registry)
}

impl PluginArgs {
    pub(crate) fn options(&self) -> LoadOptions {
        LoadOptions { allow_writable: self.allow_writable_plugin }
    }
}

impl Formats {
    /// Loads plugins: those named, which must load, then those found where plugins lie, which may not.
    pub(crate) fn load(args: &PluginArgs) -> anyhow::Result<Self> {
        let mut formats = Self { registry: built_in(), plugins: Vec::new(), left_out: Vec::new() };
        for file in &args.files {
            formats.named(Plugin::load(file, &args.options())?)?;
        }
        let found = search::find();
        formats.left_out.extend(found.remarks);
        for file in found.libraries {
            match Plugin::load(&file, &args.options()) {
                Ok(plugin) => formats.found(plugin),
                Err(error) => formats.left_out.push(format!("plugin {}", one_line(&error))),
            }
        }
        Ok(formats)
    }

    /// One that the user named goes before what is built in, but two of them must not compete.
    fn named(&mut self, plugin: Plugin) -> anyhow::Result<()> {
        let name = plugin.info().name.clone();
        match self.plugins.iter().find(|p| p.plugin.info().name == name) {
            Some(same) if same.plugin.path() == plugin.path() => Ok(()),
            Some(other) => Err(usage(format!(
                "--plugin: {} and {} both read the format `{name}`; name one of them",
                other.plugin.path().display(),
                plugin.path().display()
            ))),
            None => {
                self.add(plugin);
                Ok(())
            }
        }
    }

    /// One that was found takes no other's place.
    fn found(&mut self, plugin: Plugin) {
        let name = plugin.info().name.clone();
        let path = plugin.path().display().to_string();
        match self.plugins.iter().find(|p| p.plugin.info().name == name) {
            Some(same) if same.plugin.path() == plugin.path() => {}
            Some(other) => self.left_out.push(format!(
                "plugin {path} is left out: {} reads the format `{name}` as well and came first",
                other.plugin.path().display()
            )),
            None if self.registry.by_name(&name).is_ok() => self.left_out.push(format!(
                "plugin {path} is left out: the format `{name}` is built in (--plugin {path} puts it first)"
            )),
            None => self.add(plugin),
        }
    }

    fn add(&mut self, plugin: Plugin) {
        let replaces = self.registry.by_name(&plugin.info().name).is_ok();
        self.registry.add(Box::new(plugin.clone()));
        self.plugins.push(LoadedPlugin { plugin, replaces });
    }
}
