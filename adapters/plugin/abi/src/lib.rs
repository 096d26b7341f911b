//! The contract between VICE and plugins: shared libraries that read a format of robot data.
//!
//! [`contract`] is the C header `include/vice_plugin.h` in Rust; the host reads it from one side. A format written in Rust is
//! exported from the other side by one line in a `cdylib`:
//!
//! ```
//! # use std::path::Path;
//! # use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe};
//! # use vice_core::error::{DataError, DataResult};
//! struct MyRobot;
//!
//! impl DatasetFactory for MyRobot {
//! #   fn info(&self) -> FormatInfo {
//! #       FormatInfo { name: "my".into(), description: "d".into(), version: "1".into(), offers: vec![], settings: vec![] }
//! #   }
//! #   fn probe(&self, _: &Path) -> Probe { Probe::No }
//! #   fn open(&self, _: &Path, _: &OpenOptions) -> DataResult<Box<dyn Dataset>> { Err(DataError::new("no")) }
//!     // info, probe, open
//! }
//!
//! vice_abi::export_plugin!(MyRobot);
//! # fn main() {}
//! ```
//!
//! Every call catches panics, so that a bug of the adapter ends in an error of the program; `tracing` events of the adapter
//! reach the user through the host. A library exports one format.

pub mod contract;
pub mod export;
mod text;

pub use text::path_from_bytes;

/// The contract in C, `include/vice_plugin.h`.
pub const HEADER: &str = include_str!("../include/vice_plugin.h");
/// Its wrapper for C++17, `include/vice_plugin.hpp`.
pub const CPP_HEADER: &str = include_str!("../include/vice_plugin.hpp");
/// What the wrapper is made of, `include/vice_plugin_export.hpp`.
pub const CPP_EXPORT_HEADER: &str = include_str!("../include/vice_plugin_export.hpp");
