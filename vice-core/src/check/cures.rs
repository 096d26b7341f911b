//! What poses would be if they were read by another convention: each that people mistake, tried in turn.

use crate::conventions::{Convention, Given, cure, list_text};
use crate::trajectory::Trajectory;

/// As many that fit as well are named.
const NAMED: usize = 3;

/// The lists of conventions that are tried, singles first.
fn hypotheses() -> Vec<Vec<Convention>> {
    let mut lists: Vec<Vec<Convention>> = Convention::TRIED.iter().map(|c| vec![*c]).collect();
    for order in [Convention::WFirst, Convention::WLast] {
        lists.push(vec![order, Convention::InversePose]);
        lists.push(vec![order, Convention::ConjugateQuaternion]);
        lists.push(vec![order, Convention::CameraAsBody]);
    }
    lists.push(vec![Convention::InversePose, Convention::CameraAsBody]);
    for unit in [Convention::Millimetres, Convention::Centimetres] {
        lists.push(vec![unit, Convention::CameraAsBody]);
    }
    lists
}

/// What each list of conventions leaves of poses as they were read, the best first: by `score` in steps of `tie`, then the
/// shorter list, then the more usual one. A list that cannot be tried, or leaves nothing to compare, is not there.
pub(super) fn cures<L>(
    read: &Trajectory,
    given: Given<'_>,
    tie: f64,
    score: impl Fn(&L) -> f64,
    left: impl Fn(&Trajectory) -> Option<L>,
) -> Vec<(Vec<Convention>, L)> {
    let mut tried: Vec<(Vec<Convention>, L)> = hypotheses()
        .into_iter()
        .filter_map(|list| {
            let left = left(&cure(&list, read, given).ok()?)?;
            Some((list, left))
        })
        .collect();
    // Stable: of those that fit alike the more usual one comes first.
    let tier = |left: &L| (score(left) / tie).round();
    tried.sort_by(|a, b| tier(&a.1).total_cmp(&tier(&b.1)).then(a.0.len().cmp(&b.0.len())));
    tried
}

/// A list of conventions in words, what becomes of the poses by it, and which others fit as well.
pub(super) fn so_read<'a>(
    list: &[Convention],
    alike: impl Iterator<Item = &'a Vec<Convention>>,
    then: &str,
) -> String {
    let words: Vec<String> = list.iter().map(|c| c.words()).collect();
    let alike: Vec<String> = alike.map(|other| list_text(other)).take(NAMED).collect();
    let or = match alike.is_empty() {
        true => String::new(),
        false => format!(" (or {}, which fit as well)", alike.join(" or ")),
    };
    format!("{}: so read, {then}{or}", words.join(", and "))
}
