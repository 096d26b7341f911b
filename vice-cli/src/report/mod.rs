//! Result documents as text and pictures: the paper's table, CSV, LaTeX, plots, frames, and the page.

pub(crate) mod comparison;
pub(crate) mod csv;
pub(crate) mod depth_picture;
pub(crate) mod evo_zip;
pub(crate) mod film_frame;
pub(crate) mod font;
pub(crate) mod frames;
pub(crate) mod html;
pub(crate) mod latex;
pub(crate) mod marks;
pub(crate) mod npy;
pub(crate) mod numbers;
pub(crate) mod overlay;
pub(crate) mod plots;
#[cfg(feature = "rerun")]
pub(crate) mod rerun_log;
pub(crate) mod result_file;
pub(crate) mod rows;
pub(crate) mod sample_lines;
pub(crate) mod sensitivity_plot;
pub(crate) mod table;
#[cfg(test)]
pub(crate) mod testing;
