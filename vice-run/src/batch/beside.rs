//! What a table of flights shows beside its rows.

use super::samples::Samples;

/// What a table shows beside the numbers of its rows.
#[derive(Clone, Copy)]
pub(super) struct Beside<'a> {
    /// Where the samples come from, which comparisons over flights need.
    pub(super) samples: Samples<'a>,
    /// Put before the links of a page to the reports, which lie in the batch's folder; `None` where there are none.
    pub(super) links: Option<&'a str>,
}
