//! Everything that is tested through the program or against the oracles, in one test program: it links once.
#![allow(missing_docs)]
// Helpers of tests fail their test.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod annotate;
mod annotate_detect;
mod annotate_guide;
mod annotate_kill;
mod annotate_reach;
mod annotator;
mod architecture;
mod bad_input;
mod batch;
mod blackbird_oracle;
mod camera_oracle;
mod cases;
mod check;
mod check_images;
mod commands;
mod dependencies;
mod depth_oracle;
mod detect;
mod detect_rendered;
mod diagnose;
mod doc_commands;
mod euroc_oracle;
mod evaluate_oracle;
mod fleet;
mod fleet_cluster;
mod fuzzed;
mod hostile;
mod init;
mod instructions;
mod labels_track;
mod layouts_oracle;
mod locobot_oracle;
mod plugin_check;
mod plugin_hostile;
mod plugin_new;
mod plugin_old;
mod plugin_places;
mod plugin_results;
mod plugin_tum;
mod report;
mod report_compare;
mod report_overlay;
mod rig;
mod samples;
mod scans;
mod synthetic;
mod tracker_oracle;
mod trajectory_many;
mod trajectory_oracle;
mod triangulated;
mod verdict;
mod your_robot;
