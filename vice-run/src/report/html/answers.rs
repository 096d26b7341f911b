//! The first screen: for each estimate whether it can be trusted, how far it is off, what is wrong and what to do.

use maud::{Markup, html};
use vice_core::check::{Finding, State};
use vice_core::result::{PixelPart, Role};

use crate::report::answer::{Answer, answer, sentence, size};
use crate::report::assessment::Assessment;
use crate::report::keys::{Key, of};
use crate::result::ResultDocument;
use crate::text::{printable, with_options};

/// Findings that are told on the first screen.
const MOST_FINDINGS: usize = 6;

/// The answers, with the first depth source, and what the checks found.
pub(crate) fn answers(document: &ResultDocument, keys: &[Key], assessment: &Assessment) -> Markup {
    let depth = document.pixel.first().map(|p| p.depth.as_str());
    let parts = |role: Role| {
        let with = document.pixel.iter().filter(move |p| p.role == role && Some(p.depth.as_str()) == depth);
        with.filter_map(|p| Some((of(keys, &p.stream, p.role)?, p)))
    };
    let estimates: Vec<(&Key, &PixelPart)> = parts(Role::Estimate).collect();
    html! {
        @if document.pixel.is_empty() { p.warn { "Nothing was evaluated, so that nothing can be said." } }
        @if estimates.is_empty() && !document.pixel.is_empty() {
            p.warn { "No estimate was evaluated: the numbers below are of the reference alone." }
        }
        div.answers {
            @for (key, part) in &estimates { (card(key, part, &answer(document, part, assessment))) }
        }
        @for (key, part) in parts(Role::Reference) {
            p.soft {
                span class={ "key k-" (key.class) } {}
                (key.name) " (reference): RMSE_2D " (size(part)) " over " (part.scored) " labels, depth from " (printable(&part.depth)) "."
            }
        }
        (checks(assessment))
    }
}

fn card(key: &Key, part: &PixelPart, answer: &Answer) -> Markup {
    html! {
        article class={ "answer k-" (key.class) } {
            h3 { "Can " (key.name) " be trusted?" }
            p class={ "trust t-" (answer.trust.class()) } { (answer.trust.words()) }
            p.size { (size(part)) }
            dl {
                @for (about, line) in &answer.lines { dt { (about) } dd { (line) } }
            }
        }
    }
}

fn checks(assessment: &Assessment) -> Markup {
    let told = |state: State| assessment.findings.iter().flatten().filter(move |f| f.state == state);
    let list: Vec<&Finding> = told(State::Wrong).chain(told(State::Look)).collect();
    html! {
        @match &assessment.findings {
            Some(findings) => {
                h3 {
                    "The recording: " (told(State::Wrong).count()) " wrong, " (list.len() - told(State::Wrong).count())
                    " to look at, of " (findings.len()) " checks"
                }
                @if list.is_empty() { p { "Nothing looks wrong with clocks, conventions, gravity and calibration." } }
                ul.findings {
                    @for finding in list.iter().take(MOST_FINDINGS) {
                        li {
                            b class={ "w-" (finding.state.word()) } { (finding.state.word()) } " "
                            (printable(&finding.check))
                            @if !finding.about.is_empty() { ", " (printable(&finding.about)) }
                            ": " (sentence(&with_options(&finding.says)))
                            @if !finding.mend.is_empty() { " " (sentence(&with_options(&finding.mend))) }
                        }
                    }
                }
                @if list.len() > MOST_FINDINGS {
                    p.soft { (list.len() - MOST_FINDINGS) " more: see " code { "vice check" } "." }
                }
            }
            None => {}
        }
        @for why in &assessment.not_run { p.warn { (sentence(why)) } }
    }
}
