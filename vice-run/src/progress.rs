//! How long work tells how far it is.

/// Called with what is being done, and (done, total) of it.
pub type Progress<'a> = dyn Fn(&'static str, usize, usize) + Sync + 'a;

/// Progress for those who do not show it.
pub fn silent(_: &'static str, _: usize, _: usize) {}
