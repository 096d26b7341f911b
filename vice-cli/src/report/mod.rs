//! Result documents as text: the paper's table, CSV and LaTeX.

pub(crate) mod csv;
pub(crate) mod depth_picture;
pub(crate) mod font;
pub(crate) mod latex;
pub(crate) mod npy;
pub(crate) mod overlay;
pub(crate) mod rows;
pub(crate) mod sample_lines;
pub(crate) mod table;
