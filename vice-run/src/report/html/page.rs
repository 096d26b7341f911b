//! The page around the content: one file that asks nobody for anything.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest, Sha256};

use crate::report::plots::picture;

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = concat!(include_str!("frames.js"), include_str!("plots.js"));

/// A whole page. `data` is JSON for machines, already made safe for a script element.
pub(crate) fn page(title: &str, content: &Markup, data: &[String]) -> String {
    page_with(title, content, data, SCRIPT)
}

/// A whole page with the one script that may run in it.
pub(crate) fn page_with(title: &str, content: &Markup, data: &[String], script: &str) -> String {
    let style = format!("{STYLE}{}", picture::CSS);
    // Nothing is fetched, and no script runs but this one, even if some text from data slipped through.
    let policy = format!(
        "default-src 'none'; img-src data:; style-src '{}'; script-src '{}'; base-uri 'none'; form-action 'none'",
        hash(&style),
        hash(script)
    );
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(policy);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="referrer" content="no-referrer";
                meta name="color-scheme" content="light dark";
                meta name="generator" content={ "VICE " (env!("CARGO_PKG_VERSION")) };
                title { (title) }
                style { (PreEscaped(&style)) }
            }
            body {
                main { (content) }
                @for json in data {
                    script type="application/json" class="result" { (PreEscaped(json)) }
                }
                script { (PreEscaped(script)) }
            }
        }
    };
    let mut text = page.into_string();
    text.push('\n');
    text
}

/// What a policy calls an inline text.
fn hash(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text.as_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_policy_allows_our_style_and_script_and_nothing_else() {
        let text = page("<t>", &html! { p { "x" } }, &["{}".to_string()]);
        assert!(text.contains("<title>&lt;t&gt;</title>"));
        assert!(text.contains("default-src &#39;none&#39;") || text.contains("default-src 'none'"));
        assert!(!text.contains("unsafe-inline") && !text.contains("http://") && !text.contains("https://"));
        assert_eq!(text.matches("<script").count(), 2);
        // The hash of an empty text, as everyone knows it.
        assert_eq!(hash(""), "sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
        for inline in [STYLE, picture::CSS, SCRIPT] {
            assert!(!inline.contains("</") && !inline.contains("url("));
        }
    }
}
