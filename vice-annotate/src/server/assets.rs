//! The page, embedded in the program. What it loads from here carries the token along.

use axum::http::header;
use axum::response::{IntoResponse, Response};
use rust_embed::Embed;

#[derive(Embed)]
#[folder = "page/"]
struct Page;

/// A file of the page, `index.html` for an empty name; `None` where there is no such file.
pub(super) fn asset(name: &str, token: &str) -> Option<Response> {
    let name = if name.is_empty() { "index.html" } else { name };
    let content_type = match name.rsplit_once('.')?.1 {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "svg" => "image/svg+xml",
        _ => return None,
    };
    let bytes = Page::get(name)?.data;
    let body = match std::str::from_utf8(&bytes) {
        Ok(text) if name.ends_with(".html") => with_token(text, &["src=\"", "href=\""], token).into_bytes(),
        Ok(text) if name.ends_with(".js") => {
            with_token(text, &["from \"", "import \"", "import(\""], token).into_bytes()
        }
        _ => bytes.into_owned(),
    };
    Some(([(header::CONTENT_TYPE, content_type)], body).into_response())
}

/// Adds the token to each relative address that stands after one of the marks and before the next quote.
fn with_token(text: &str, marks: &[&str], token: &str) -> String {
    let mut out = String::with_capacity(text.len() + 512);
    let mut rest = text;
    loop {
        let found = marks.iter().filter_map(|m| rest.find(m).map(|at| at + m.len())).min();
        let Some((start, end)) = found.and_then(|start| Some((start, start + rest[start..].find('"')?)))
        else {
            out.push_str(rest);
            return out;
        };
        let address = &rest[start..end];
        out.push_str(&rest[..end]);
        if is_file_of_page(address) {
            out.push_str("?token=");
            out.push_str(token);
        }
        rest = &rest[end..];
    }
}

fn is_file_of_page(address: &str) -> bool {
    let name = address.strip_prefix("./").unwrap_or(address);
    let known = [".js", ".css", ".svg"].iter().any(|ext| name.ends_with(ext));
    known && !name.contains([':', '/', '?', '#'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_addresses_carry_the_token() {
        let html = r##"<link href="style.css"><script src="./main.js"></script><a href="#top"><a href="https://x/y.js">"##;
        assert_eq!(
            with_token(html, &["src=\"", "href=\""], "T"),
            r##"<link href="style.css?token=T"><script src="./main.js?token=T"></script><a href="#top"><a href="https://x/y.js">"##
        );
        let js = "import { a } from \"./a.js\";\nimport \"./b.js\";\nconst s = \"./c.js\";";
        assert_eq!(
            with_token(js, &["from \"", "import \"", "import(\""], "T"),
            "import { a } from \"./a.js?token=T\";\nimport \"./b.js?token=T\";\nconst s = \"./c.js\";"
        );
        assert_eq!(with_token("src=\"", &["src=\""], "T"), "src=\"");
    }

    #[test]
    fn only_files_of_the_page_are_given() {
        for name in ["package.json", "../Cargo.toml", "no.js", "x", "a/b.js"] {
            assert!(asset(name, "T").is_none(), "{name}");
        }
    }
}
