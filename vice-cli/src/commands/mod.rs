//! One file a command.

pub(crate) mod annotate;
pub(crate) mod bench;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod depth;
pub(crate) mod depth_compare;
pub(crate) mod evaluate;
pub(crate) mod floor;
pub(crate) mod formats;
pub(crate) mod info;
pub(crate) mod labels;
pub(crate) mod plugin;
pub(crate) mod synth;
pub(crate) mod trajectory;
