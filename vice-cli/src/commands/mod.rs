//! One file a command.

pub(crate) mod annotate;
pub(crate) mod batch;
pub(crate) mod batch_collect;
pub(crate) mod bench;
pub(crate) mod calibration;
pub(crate) mod check;
pub(crate) mod clock;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod depth;
pub(crate) mod depth_compare;
pub(crate) mod diagnose;
pub(crate) mod evaluate;
pub(crate) mod floor;
pub(crate) mod formats;
pub(crate) mod info;
pub(crate) mod labels;
pub(crate) mod overlay;
pub(crate) mod plugin;
pub(crate) mod report;
pub(crate) mod sensitivity;
pub(crate) mod synth;
pub(crate) mod table;
pub(crate) mod trajectory;
