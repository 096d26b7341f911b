//! Documents as text and pictures: the paper's table, CSV, LaTeX, plots, frames, and the page.

pub(crate) mod answer;
pub mod assessment;
pub mod comparison;
pub(crate) mod crops;
pub mod csv;
pub(crate) mod depth_picture;
pub mod diagnosis_text;
pub(crate) mod difference;
pub(crate) mod evo_zip;
pub(crate) mod film_frame;
pub(crate) mod flaw_units;
pub(crate) mod font;
pub mod frames;
pub(crate) mod held;
pub mod html;
pub(crate) mod keys;
pub mod latex;
pub(crate) mod marks;
pub(crate) mod moments;
pub(crate) mod npy;
pub(crate) mod numbers;
pub(crate) mod overlay;
pub(crate) mod plots;
pub(crate) mod rows;
pub mod sample_lines;
pub mod sensitivity_plot;
pub mod sensitivity_text;
pub mod table;
#[cfg(test)]
pub(crate) mod testing;
