//! Many flights by one manifest.
//!
//! A [`Manifest`] is a table of requests; [`run()`] evaluates what is not there yet into a folder, [`collect`] makes one
//! table of it, and [`fleet_table`] shows that as the paper's. The same manifest gives the same bytes on one machine, in
//! shards, and after any interruption. `docs/fleet.md` describes the folder.

mod beside;
mod cells;
pub mod collect;
mod content;
mod csv_rows;
mod field;
mod fleet;
pub mod fleet_table;
mod flights;
mod glob;
mod grid;
mod key;
mod manifest;
mod markup;
mod multiples;
mod parquet_rows;
mod paths;
pub mod results;
mod results_file;
mod run;
mod samples;
pub mod scan;
mod standings;
mod store;
mod toml_rows;

pub use content::Hashes;
pub use fleet::FleetTable;
pub use key::Key;
pub use manifest::{Manifest, Row};
pub use run::{Event, Options, Planned, Shard, State, Summary, plan, run};
pub use store::{Keep, RowRecord, Store};
