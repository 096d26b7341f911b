//! What looks wrong in a recording: said on the way, once, and kept for `vice info` and the result document.

use std::sync::{Mutex, PoisonError};

use vice_core::suspicion::{Suspicion, Suspicions};

/// Something is left out or cannot be read since the recording is damaged.
pub(crate) const DAMAGED: &str = "recording-damaged";
/// Messages that are whole but say nothing: poses that are not numbers, stamps of zero.
pub(crate) const LEFT_OUT: &str = "rows-left-out";
/// Several messages for one stamp.
pub(crate) const REPEATED: &str = "stamps-repeated";
/// Quaternions that are not quite of length 1.
pub(crate) const NORMALISED: &str = "quaternion-normalised";
/// Two sources in one edge of tf or one topic.
pub(crate) const TWO_SOURCES: &str = "two-sources";
/// Several topics could be meant, and none is taken.
pub(crate) const SEVERAL_TOPICS: &str = "several-topics";
/// Several image topics could be the camera's, and none is taken.
pub(crate) const NO_CAMERA: &str = "no-camera";

/// The doubts about one recording.
#[derive(Debug, Default)]
pub(crate) struct Doubts(Mutex<Suspicions>);

impl Doubts {
    /// Says a doubt, unless it was said before.
    pub(crate) fn say(&self, doubt: Suspicion) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_known =
            |s: &Suspicion| s.code == doubt.code && s.about == doubt.about && s.message == doubt.message;
        if !known.iter().any(is_known) {
            known.add(doubt);
        }
    }

    /// Says several.
    pub(crate) fn say_all(&self, doubts: impl IntoIterator<Item = Suspicion>) {
        doubts.into_iter().for_each(|doubt| self.say(doubt));
    }

    /// All that was said, in that order.
    pub(crate) fn all(&self) -> Vec<Suspicion> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    /// One line each about what is damaged, missing or contradicts itself in the recording.
    pub(crate) fn damage(&self) -> Vec<String> {
        let is_damage = |s: &Suspicion| {
            [DAMAGED, LEFT_OUT, REPEATED].contains(&s.code.as_str()) || s.code.starts_with("tf-")
        };
        self.all().iter().filter(|s| is_damage(s)).map(Suspicion::line).collect()
    }
}

/// The same about several things, such as edges of tf, as one doubt: each with how often it was seen.
///
/// `one` says it of a single one; `many` of several, whose number is put in the place of `{n}` and that of what was seen
/// in the place of `{all}`.
pub(crate) fn group(
    code: &str,
    things: &[(String, u64)],
    one: impl Fn(&str, u64) -> String,
    many: &str,
) -> Option<Suspicion> {
    let all: u64 = things.iter().map(|(_, n)| n).sum();
    let message = match things {
        [] => return None,
        [(thing, n)] => return Some(Suspicion::new(code, "", one(thing, *n))),
        several => many.replace("{n}", &several.len().to_string()).replace("{all}", &all.to_string()),
    };
    let names: Vec<&str> = things.iter().map(|(thing, _)| thing.as_str()).collect();
    Some(Suspicion::new(code, "", message).evidence(crate::names::list(&names)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_said_once() {
        let doubts = Doubts::default();
        for about in ["a", "b", "a"] {
            doubts.say(Suspicion::new(LEFT_OUT, about, "rows are left out").times(3));
        }
        doubts.say(Suspicion::new(TWO_SOURCES, "a", "jumps"));
        assert_eq!(doubts.all().iter().map(|s| s.count).collect::<Vec<_>>(), [3, 3, 1]);
        assert_eq!(doubts.damage().len(), 2);
    }

    #[test]
    fn several_are_one_line() {
        let one = |name: &str, n: u64| format!("{name} has {n}");
        let things: Vec<(String, u64)> = (0..40).map(|i| (format!("e{i}"), 2)).collect();
        assert!(group("x", &[], one, "").is_none());
        assert_eq!(group("x", &things[..1], one, "").unwrap().line(), "e0 has 2");
        let line = group("x", &things, one, "{n} have {all}").unwrap().line();
        assert!(line.starts_with("40 have 80: e0, e1") && line.ends_with("and 28 more"), "{line}");
    }
}
