//! What a diagnosis and the checks found, as a report shows it beside a result.

use vice_core::check::{Finding, State};
use vice_core::diagnose::DiagnosisDocument;

/// The diagnosis of one estimate with one depth source.
pub struct Diagnosed {
    /// Name of the estimate.
    pub stream: String,
    /// Name of the depth source.
    pub depth: String,
    /// What was found, or why there is no diagnosis.
    pub outcome: Result<DiagnosisDocument, String>,
}

/// What is known of a run beside its numbers.
pub struct Assessment {
    /// The diagnoses.
    pub diagnoses: Vec<Diagnosed>,
    /// What the checks of the recording found; `None` where they were not run.
    pub findings: Option<Vec<Finding>>,
    /// Why the diagnosis or the checks were not run.
    pub not_run: Vec<String>,
}

impl Assessment {
    /// Neither was run, for this reason.
    pub fn not_run(why: impl Into<String>) -> Self {
        Self { diagnoses: vec![], findings: None, not_run: vec![why.into()] }
    }

    /// The diagnosis of an estimate: with the named depth source.
    pub(crate) fn of(&self, stream: &str, depth: &str) -> Option<&Diagnosed> {
        self.diagnoses.iter().find(|d| d.stream == stream && d.depth == depth)
    }

    /// What is wrong with an estimate by the checks: alone, or against something that is no estimate itself. Where two
    /// estimates differ, either may be at fault.
    pub(crate) fn wrong_with(&self, stream: &str, estimates: &[&str]) -> Vec<&Finding> {
        let about = |f: &&Finding| {
            let mut sides = f.about.split(" / ");
            let is_other = |side: &str| side != stream && estimates.contains(&side);
            f.state == State::Wrong && sides.clone().any(|s| s == stream) && !sides.any(is_other)
        };
        self.findings.iter().flatten().filter(about).collect()
    }
}
