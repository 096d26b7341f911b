//! Findings as a page.

use maud::html;
use vice_core::check::State;

use super::CheckDocument;
use crate::report::html::page_with;
use crate::text::{printable, with_options};

/// One page that needs nothing else.
pub fn page(document: &CheckDocument) -> String {
    let c = &document.counts;
    let title = format!("VICE: check of {}", printable(&document.name));
    let content = html! {
        p.brand { "VICE · Visual Inertial Correlation Estimator" }
        h1 { (printable(&document.name)) " (" (printable(&document.format)) ")" }
        p { (c.wrong) " wrong, " (c.look) " to look at, " (c.ok) " ok, " (c.unknown) " not known" }
        table {
            thead { tr { th { "state" } th { "check" } th { "about" } th { "found" } } }
            tbody {
                @for state in [State::Wrong, State::Look, State::Ok, State::Unknown] {
                    @for f in document.findings.iter().filter(|f| f.state == state) {
                        tr {
                            td { @if state == State::Wrong { strong { (state.word()) } } @else { (state.word()) } }
                            td { (f.check) }
                            td { (printable(&f.about)) }
                            td {
                                (printable(&with_options(&f.says)))
                                @if !f.numbers.is_empty() { br; small { (f.evidence()) } }
                                @if !f.mend.is_empty() { br; (printable(&with_options(&f.mend))) }
                            }
                        }
                    }
                }
            }
        }
    };
    page_with(&title, &content, "")
}
