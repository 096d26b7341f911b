//! Everything that is tested through the program or against the oracles, in one test program: it links once.
#![allow(missing_docs)]
// Helpers of tests fail their test.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod bad_input;
mod blackbird_oracle;
mod camera_oracle;
mod commands;
mod depth_oracle;
mod diagnose;
mod euroc_oracle;
mod evaluate_oracle;
mod locobot_oracle;
mod report;
mod report_compare;
mod report_overlay;
mod synthetic;
mod trajectory_oracle;
