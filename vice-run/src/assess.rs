//! The diagnosis and the checks that a report begins with.

use vice_core::error::one_line;

use crate::check::{CheckRequest, check_opened};
use crate::diagnosis::{Looking, diagnose_all};
use crate::open::Opened;
use crate::progress::{Progress, silent};
use crate::report::assessment::{Assessment, Diagnosed};
use crate::request::{EstimateSpec, Request};
use crate::text::with_options;

impl Request {
    /// Diagnoses each estimate with the first depth source and checks the recording, without its images. Never fails: what
    /// could not be found out says why.
    pub fn assess(&self, opened: &Opened, progress: &Progress<'_>) -> Assessment {
        let mut request = self.clone();
        let mut names = request.depth.names();
        names.truncate(1);
        request.depth.sources = names;
        let mut assessment = Assessment { diagnoses: vec![], findings: None, not_run: vec![] };
        match diagnose_all(&request, opened, &Looking::default(), progress) {
            Ok(answers) => {
                assessment.diagnoses = answers
                    .list
                    .into_iter()
                    .map(|answer| Diagnosed {
                        stream: answer.stream,
                        depth: answer.depth,
                        outcome: match answer.outcome {
                            Ok((result, _)) => Ok(result.diagnosis),
                            Err(error) => Err(with_options(&one_line(&error))),
                        },
                    })
                    .collect();
            }
            Err(error) => {
                assessment
                    .not_run
                    .push(format!("no diagnosis could be made: {}", with_options(&one_line(&error))));
            }
        }
        self.add_checks(&mut assessment, opened);
        assessment
    }

    /// Adds what the checks find in a recording that is open.
    pub(crate) fn add_checks(&self, assessment: &mut Assessment, opened: &Opened) {
        let mut streams = self.streams.clone();
        // The integration starts at a key frame, of which a check knows nothing; it looks at the IMU itself.
        let integrated: Vec<bool> = streams.estimates.iter().map(|e| *e == EstimateSpec::ImuEuler).collect();
        let mut which = integrated.iter();
        streams.names.retain(|_| which.next() != Some(&true));
        streams.estimates.retain(|estimate| *estimate != EstimateSpec::ImuEuler);
        let request = CheckRequest { dataset: self.dataset.clone(), streams, images: false, before: None };
        match check_opened(&request, opened, &silent) {
            Ok(document) => assessment.findings = Some(document.findings),
            Err(error) => {
                assessment.not_run.push(format!("no checks: {}", with_options(&one_line(&error))));
            }
        }
    }
}
