//! What looks wrong but does not stop the work: said once, with evidence and with what to do about it.
//!
//! A reader that repairs, leaves out or doubts something adds a [`Suspicion`]; the pipeline collects them into the
//! result document, so that a warning is never only a log line.

/// Something in the data that may make the numbers wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Suspicion {
    /// A stable name in kebab-case, such as `quaternion-order` or `rows-left-out`, for programs.
    pub code: String,
    /// What it is about: a file, a stream, a topic or a camera; empty where it is the whole data set.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "String::is_empty"))]
    pub about: String,
    /// What looks wrong, in a sentence.
    pub message: String,
    /// The numbers that make it look so.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "String::is_empty"))]
    pub evidence: String,
    /// What to do about it.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "String::is_empty"))]
    pub advice: String,
    /// How often the same was seen.
    pub count: u64,
}

impl Suspicion {
    /// A suspicion that was seen once.
    pub fn new(code: &str, about: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            code: code.to_string(),
            about: about.into(),
            message: message.into(),
            evidence: String::new(),
            advice: String::new(),
            count: 1,
        }
    }

    /// Adds the numbers that make it look so.
    #[must_use]
    pub fn evidence(mut self, evidence: impl Into<String>) -> Self {
        self.evidence = evidence.into();
        self
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn advice(mut self, advice: impl Into<String>) -> Self {
        self.advice = advice.into();
        self
    }

    /// Says that the same was seen this often.
    #[must_use]
    pub const fn times(mut self, count: u64) -> Self {
        self.count = count;
        self
    }

    /// The suspicion on one line: `about: message: evidence (advice)`.
    pub fn line(&self) -> String {
        let mut line = if self.about.is_empty() { String::new() } else { format!("{}: ", self.about) };
        line.push_str(&self.message);
        if !self.evidence.is_empty() {
            line.push_str(": ");
            line.push_str(&self.evidence);
        }
        // A message that counts for itself does not need it again.
        let is_count = |word: &str| word.parse() == Ok(self.count);
        if self.count > 1 && !self.message.split_whitespace().any(is_count) {
            line.push_str(&format!(", {} times", self.count));
        }
        if !self.advice.is_empty() {
            line.push_str(&format!(" ({})", self.advice));
        }
        line
    }
}

/// A list of suspicions that holds each one once, in the order in which they were first seen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(transparent))]
pub struct Suspicions(Vec<Suspicion>);

impl Suspicions {
    /// An empty list.
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// Adds one. The same code, subject and message once more only counts.
    pub fn add(&mut self, suspicion: Suspicion) {
        let same = |s: &&mut Suspicion| {
            s.code == suspicion.code && s.about == suspicion.about && s.message == suspicion.message
        };
        match self.0.iter_mut().find(same) {
            Some(known) => known.count += suspicion.count,
            None => self.0.push(suspicion),
        }
    }

    /// Adds all of another list.
    pub fn extend(&mut self, others: impl IntoIterator<Item = Suspicion>) {
        others.into_iter().for_each(|s| self.add(s));
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The suspicions, as first seen.
    pub fn iter(&self) -> std::slice::Iter<'_, Suspicion> {
        self.0.iter()
    }
}

impl FromIterator<Suspicion> for Suspicions {
    fn from_iter<I: IntoIterator<Item = Suspicion>>(suspicions: I) -> Self {
        let mut list = Self::new();
        list.extend(suspicions);
        list
    }
}

impl IntoIterator for Suspicions {
    type Item = Suspicion;
    type IntoIter = std::vec::IntoIter<Suspicion>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_said_once_and_counted() {
        let mut list = Suspicions::new();
        list.add(Suspicion::new("rows-left-out", "a.tum", "rows without a pose are left out").times(10));
        list.add(Suspicion::new("rows-left-out", "b.tum", "rows without a pose are left out"));
        list.add(Suspicion::new("rows-left-out", "a.tum", "rows without a pose are left out").times(2));
        let counts: Vec<u64> = list.iter().map(|s| s.count).collect();
        assert_eq!(counts, [12, 1]);
    }

    #[test]
    fn a_count_is_said_once() {
        let counted = |message: &str| Suspicion::new("rows-left-out", "", message).times(10).line();
        assert_eq!(counted("10 rows are left out"), "10 rows are left out");
        assert_eq!(counted("rows of 100 are left out"), "rows of 100 are left out, 10 times");
    }

    #[test]
    fn a_line_says_what_why_and_what_to_do() {
        let suspicion = Suspicion::new("quaternion-order", "est.tum", "the quaternions fit better w first")
            .evidence("AOE 0.01 rad instead of 2.4 rad")
            .advice("--estimate-as wxyz");
        assert_eq!(
            suspicion.line(),
            "est.tum: the quaternions fit better w first: AOE 0.01 rad instead of 2.4 rad (--estimate-as wxyz)"
        );
    }
}
