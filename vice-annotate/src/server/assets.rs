//! The page, embedded in the program.

use axum::http::header;
use axum::response::{IntoResponse, Response};
use rust_embed::Embed;

#[derive(Embed)]
#[folder = "page/"]
struct Page;

/// A file of the page, `index.html` for an empty name; `None` where there is no such file.
pub(super) fn asset(name: &str) -> Option<Response> {
    let name = if name.is_empty() { "index.html" } else { name };
    let content_type = match name.rsplit_once('.')?.1 {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "svg" => "image/svg+xml",
        _ => return None,
    };
    let bytes = Page::get(name)?.data.into_owned();
    Some(([(header::CONTENT_TYPE, content_type)], bytes).into_response())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_the_page_are_given() {
        for name in ["package.json", "../Cargo.toml", "no.js", "x", "a/b.js"] {
            assert!(asset(name).is_none(), "{name}");
        }
    }
}
