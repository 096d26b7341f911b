//! The pose streams of a result with their colours, in the order of the document.

use vice_core::result::Role;

use super::marks::Carrier;
use super::plots::estimate_class;
use crate::result::ResultDocument;
use crate::text::printable;

/// A pose stream on a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Key {
    /// Its name, safe to be shown.
    pub(crate) name: String,
    /// Its name in the document.
    pub(crate) stream: String,
    pub(crate) role: Role,
    /// The class of its colour.
    pub(crate) class: &'static str,
    /// What tells it from the others on the page.
    pub(crate) id: usize,
}

/// All streams of a document: the reference in its own colour, the estimates in theirs.
pub(crate) fn keys(document: &ResultDocument) -> Vec<Key> {
    let parts = document.pixel.iter().map(|p| (&p.stream, p.role));
    let mut keys: Vec<Key> = Vec::new();
    let mut estimates = 0;
    for (stream, role) in parts.chain(document.paths.iter().map(|p| (&p.stream, p.role))) {
        if of(&keys, stream, role).is_some() {
            continue;
        }
        let class = match role {
            Role::Reference => "ref",
            Role::Estimate => {
                estimates += 1;
                estimate_class(estimates - 1)
            }
        };
        keys.push(Key { name: printable(stream), stream: stream.clone(), role, class, id: keys.len() });
    }
    keys
}

/// The key of a stream.
pub(crate) fn of<'a>(keys: &'a [Key], stream: &str, role: Role) -> Option<&'a Key> {
    keys.iter().find(|k| k.stream == stream && k.role == role)
}

/// The key of a stream on the images.
pub(crate) fn of_carrier<'a>(keys: &'a [Key], carrier: &Carrier) -> Option<&'a Key> {
    let role = if carrier.estimate.is_some() { Role::Estimate } else { Role::Reference };
    of(keys, &carrier.name, role)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, part};

    #[test]
    fn a_stream_has_one_key_whatever_the_depth() {
        let mut reference = part("same", &[]);
        reference.role = Role::Reference;
        let mut zmap = part("same", &[]);
        zmap.depth = "zmap".to_string();
        let keys = keys(&document(vec![reference, part("same", &[]), zmap, part("other", &[])]));
        let told: Vec<(&str, &str, usize)> = keys.iter().map(|k| (&*k.name, k.class, k.id)).collect();
        assert_eq!(told, [("same", "ref", 0), ("same", "e0", 1), ("other", "e1", 2)]);
    }
}
