//! Labels without a hand: corners of calibration targets, found in every frame and named over time.
//!
//! [`detect_labels`] looks for AprilTags ([`TagFamily`], borders of one or two cells) and for a chessboard
//! ([`BoardSize`]) in the frames of a [`vice_core::dataset::Dataset`] and gives a [`vice_core::label::LabelSet`] whose
//! points are the targets' corners, with key frames and respawns set. [`find_tags`] and [`find_board`] look at one
//! picture. [`TagDepth`] is the depth source `tag`: the pose of a tag of known size says how far its corners are, so
//! that a target alone is enough to evaluate an estimate.
//!
//! Tags: dark patches (dark, quads) whose outline is a quadrangle, whose edges are placed between pixels along
//! undistorted lines (edges), and whose cells read as a code of the family (tag). Chessboards: saddles of the brightness
//! (saddle) that are each other's neighbours (links) and make up a grid (board).
#![forbid(unsafe_code)]

mod associate;
mod board;
mod codes;
mod dark;
mod depth;
mod detect;
mod edges;
mod family;
mod gray;
mod links;
mod plane;
mod pose;
mod quads;
mod saddle;
mod select;
mod tag;

pub use board::{Board, BoardSize};
pub use depth::TagDepth;
pub use detect::{DetectOptions, DetectReport, Detection, additions, detect_labels, find_board, find_tags};
pub use family::TagFamily;
pub use pose::{TagPose, tag_pose};
pub use tag::{Tag, TagOptions};
