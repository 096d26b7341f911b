//! `vice formats`.

use std::fmt::Write;

use crate::formats;
use crate::terminal::{self, Outcome};

pub(crate) fn run() -> anyhow::Result<Outcome> {
    let mut text = String::new();
    for format in formats::registry().formats() {
        writeln!(text, "{} {}  {}", format.name, format.version, format.description)?;
        writeln!(text, "    offers: {}", format.offers.join(", "))?;
        for setting in &format.settings {
            writeln!(text, "    --set {}=...  {}", setting.key, setting.description)?;
        }
    }
    terminal::print(&text)?;
    Ok(Outcome::Done)
}
