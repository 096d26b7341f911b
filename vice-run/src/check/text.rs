//! Findings as a person reads them.

use std::fmt::Write;

use vice_core::check::{CHECKS, Finding, State};

use super::CheckDocument;
use crate::text::{printable, with_options};

/// What was found, the worst first; what is as it should be on a line each.
pub fn render(document: &CheckDocument) -> String {
    let c = &document.counts;
    let mut text = format!(
        "{} ({}): {} wrong, {} to look at, {} ok, {} not known\n",
        printable(&document.name),
        printable(&document.format),
        c.wrong,
        c.look,
        c.ok,
        c.unknown
    );
    for state in [State::Wrong, State::Look, State::Ok, State::Unknown] {
        for finding in document.findings.iter().filter(|f| f.state == state) {
            text.push_str(&line(finding));
        }
    }
    text
}

/// What is wrong or worth a look, a line each, for the head of another text; nothing where nothing is. What readers said
/// stands in that text by itself.
pub fn head(document: &CheckDocument) -> String {
    let mut text = String::new();
    for state in [State::Wrong, State::Look] {
        for f in document.findings.iter().filter(|f| f.state == state && f.check != "reading") {
            let about = if f.about.is_empty() { String::new() } else { format!("{}: ", f.about) };
            let line = format!("  {:6}{:12}{about}{}", state.word(), f.check, with_options(&f.says));
            text.push_str(&format!("{}\n", printable(&line)));
        }
    }
    if text.is_empty() { text } else { format!("checks (more with `vice check`)\n{text}") }
}

/// One finding, with its numbers and its cure on lines of their own where there is something to do.
pub(crate) fn line(finding: &Finding) -> String {
    let about = if finding.about.is_empty() { String::new() } else { format!("{}: ", finding.about) };
    let head =
        format!("{:8}{:12}{about}{}", finding.state.word(), finding.check, with_options(&finding.says));
    let mut text = format!("{}\n", printable(&head));
    let tell = matches!(finding.state, State::Look | State::Wrong);
    let evidence = finding.evidence();
    if tell && !evidence.is_empty() {
        text.push_str(&format!("{:20}{}\n", "", printable(&evidence)));
    }
    if tell && !finding.mend.is_empty() {
        text.push_str(&format!("{:20}{}\n", "", printable(&with_options(&finding.mend))));
    }
    text
}

/// What each check looks at, and when it says what.
pub fn list_text() -> String {
    let mut text = String::new();
    for check in CHECKS {
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}: {}\n  looks at   {}\n  says       {}\n  by         {}",
            check.name, check.title, check.looks_at, check.threshold, check.source
        );
    }
    text.push_str("reading: what readers repaired, left out or cannot use; formats add their own\n");
    text
}
