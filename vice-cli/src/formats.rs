//! The formats that are built in.

use vice_core::registry::Registry;

/// A registry of all built-in formats.
pub(crate) fn registry() -> Registry {
    let mut registry = Registry::new();
    registry.add(Box::new(vice_blackbird::Blackbird));
    registry.add(Box::new(vice_euroc::Euroc));
    registry.add(Box::new(vice_locobot::Locobot));
    registry.add(Box::new(vice_video::Video));
    registry
}
