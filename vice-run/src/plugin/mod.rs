//! Projects of new plugins.

mod project;

pub use project::{Dependency, File, cpp, rust, write};
