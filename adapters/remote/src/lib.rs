//! Recordings in object stores and on web servers, by their address: `s3://bucket/key`, `gs://bucket/key`,
//! `https://host/path`.
//!
//! Bags, MCAP files and images are read by ranges, where they lie; everything else is staged into a cache folder, and a
//! second run finds it there. `docs/remote.md` says what is fetched and what is not.
//!
//! Without the feature `store` there is nothing here: the clients are some 150 crates.
#![forbid(unsafe_code)]

#[cfg(feature = "store")]
mod client;
#[cfg(feature = "store")]
mod data_set;
#[cfg(feature = "store")]
mod failure;
#[cfg(feature = "store")]
mod limits;
#[cfg(feature = "store")]
mod object;
#[cfg(feature = "store")]
mod segments;
#[cfg(feature = "store")]
mod source;
#[cfg(feature = "store")]
mod stage;
#[cfg(feature = "store")]
mod waiting;

#[cfg(feature = "store")]
pub use data_set::{Identity, Staged, data_set, file, identity};
