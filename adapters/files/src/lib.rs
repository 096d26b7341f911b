//! Files that every format of VICE shares, and the one way anything is written.
//!
//! | module | what |
//! | --- | --- |
//! | [`trajectory`] | poses as TUM, EuRoC, KITTI and relative motions; found out by content |
//! | [`labels`] | labels as CSV, Parquet, JSON `vice.labels/1`, CVAT XML, and the pickle of the paper's authors |
//! | [`calibration`] | TOML or Kalibr files that override intrinsics and extrinsics |
//! | [`rigid_file`] | the place of an estimate's frame in the body |
//! | [`image_file`] | PNG and JPEG |
//! | [`imu_file`] | inertial samples in a table |
//! | [`rows`], [`heading`], [`columns`] | text in rows, and which column holds what by its name |
//! | [`tables`] | tables in columns: Parquet |
//! | [`yaml`] | YAML with OpenCV's dialect |
//! | [`leniency`] | what readers repair or leave out, one rule for all |
//! | [`not_text`] | recordings and archives given where text is expected |
//! | [`once`], [`pairing`] | what is read once, and which picture belongs to which |
//! | [`paths`] | names from files, kept below their folder |
//! | [`address`], [`elsewhere`] | data that is named by a URL, and files that are read by ranges |
//! | [`vice_toml`] | what a user says of a data set once for all |
//! | [`atomic`] | writing all or nothing |
//! | [`leftovers`] | temporary files, for a program that is asked to end |
#![forbid(unsafe_code)]

pub mod address;
pub mod atomic;
pub mod calibration;
pub mod columns;
pub mod elsewhere;
pub mod heading;
pub mod image_file;
pub mod imu_file;
pub mod labels;
pub mod leftovers;
pub mod leniency;
pub mod not_text;
pub mod once;
pub mod pairing;
pub mod paths;
pub mod rigid_file;
mod row;
pub mod rows;
pub mod tables;
pub mod trajectory;
pub mod vice_toml;
pub mod yaml;
