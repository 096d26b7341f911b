//! Everything that is tested through the program or against the oracles, in one test program: it links once.
#![allow(missing_docs)]

mod bad_input;
mod blackbird_oracle;
mod camera_oracle;
mod euroc_oracle;
mod evaluate_oracle;
mod locobot_oracle;
mod depth_oracle;
mod trajectory_oracle;
mod synthetic;
