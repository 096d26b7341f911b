//! What it has to say of the data: facts and suspicions.

use std::collections::BTreeSet;

use vice_core::dataset::Dataset;

use super::Check;

/// Suspicions that are repeated in the report.
const SHOWN: usize = 5;

impl Check<'_> {
    /// Asked after the data was read, since reading is what makes suspicious.
    pub(super) fn words(&mut self, dataset: &dyn Dataset) {
        self.step("facts");
        let facts = dataset.facts();
        if facts.iter().any(|f| f.section.trim().is_empty() || f.text.trim().is_empty()) {
            self.fault("a fact for `vice info` has no heading or no text");
        }
        self.step("its own checks");
        for finding in dataset.checks() {
            if finding.check == "plugin-fault" {
                self.fault(finding.says);
                continue;
            }
            if finding.check.trim().is_empty() || finding.says.trim().is_empty() {
                self.fault("a finding of its own checks has no name or no sentence");
            }
        }
        self.step("suspicions");
        let suspicions = dataset.suspicions();
        let mut seen = BTreeSet::new();
        for (place, suspicion) in suspicions.iter().enumerate() {
            let code = &suspicion.code;
            if code == "plugin-fault" {
                self.fault(suspicion.line());
                continue;
            }
            if code.is_empty()
                || !code.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
            {
                self.fault(format!("the code `{code}` of a suspicion should be a word of a-z, 0-9 and -"));
            }
            if suspicion.message.trim().is_empty() || suspicion.count == 0 {
                self.fault(format!("the suspicion `{code}` has no message, or was seen 0 times"));
            }
            if !seen.insert((code, &suspicion.about, &suspicion.message)) {
                self.fault(format!(
                    "the suspicion `{code}` is said twice of the same: count it instead: {}",
                    suspicion.line()
                ));
            }
            if place < SHOWN {
                self.good(format!("it doubts the data: {}", suspicion.line()));
            }
        }
        if suspicions.len() > SHOWN {
            self.good(format!(
                "it doubts the data in {} ways, of which these are the first",
                suspicions.len()
            ));
        }
    }
}
