//! Transforms between the frames of a recording.

use vice_core::frames::Rigid;

/// A frame of the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tf {}

/// A transform of the tree, named `parent_from_child` or `target_from_source`.
pub(crate) type Transform = Rigid<Tf, Tf>;
