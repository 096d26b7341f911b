//! Plugins: shared libraries that read a format of robot data, behind the core's traits.
//!
//! ```text
//! search       where plugins lie that nobody named
//! place        whose file it is, and who may write to it
//! binary       whether it is a library for this machine
//! library      loading, and the table: versions, sizes, null pointers
//! border       texts and lists read from the other side
//! ask          one call: its turn, its code, its answer
//! values       the contract's values as the core's, checked
//! handle       what a path is, and an open data set as the plugin calls it
//! description  what it says that it has
//! dataset      a data set of a plugin
//! factory      a plugin as a format
//! isolated     plugins in processes of their own
//! conformance  what an adapter is expected to do, as a suite that anyone can run
//! ```
//!
//! A plugin is native code and can do whatever the program can, and end it: in a process of its own ([`isolated`]) it ends
//! that process only. What is checked is what an honest plugin gets wrong: all that it
//! hands over is validated before the core sees it, and calls of a plugin that is not thread-safe never overlap.
//! Libraries are never unloaded: their thread-locals and static variables have destructors that would run later.

mod ask;
mod binary;
mod border;
pub mod conformance;
mod dataset;
mod description;
mod factory;
mod handle;
mod host_log;
pub mod isolated;
mod library;
mod place;
pub mod search;
mod values;

pub use library::{LoadOptions, Plugin};
