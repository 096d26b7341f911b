//! The image tracker: where a scene point of one frame is in the next ones.
