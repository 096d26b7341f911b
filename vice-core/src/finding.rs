//! What a check says of a recording: a state, a sentence, numbers, and what mends it.

use crate::suspicion::Suspicion;

/// How bad it is. The order is that of the words: nothing is worse than `wrong`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum State {
    /// There was nothing to look at, or it does not suffice: the sentence says why. This is no praise.
    Unknown,
    /// Looked at, and as it should be.
    Ok,
    /// May make numbers wrong: a person should look.
    Look,
    /// Is wrong, or the data contradicts itself.
    Wrong,
}

impl State {
    /// The word that is printed.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Ok => "ok",
            Self::Look => "look",
            Self::Wrong => "wrong",
        }
    }
}

/// A number that a check found.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Number {
    /// What it is, in kebab-case.
    pub name: String,
    /// The number.
    pub value: f64,
    /// Its unit; empty for shares and counts.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "String::is_empty"))]
    pub unit: String,
}

/// What one check found about one subject.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Finding {
    /// Name of the check, in kebab-case: one of [`CHECKS`](crate::check::CHECKS), or a name that a format gave its own.
    pub check: String,
    /// What was looked at: a stream, a camera, a pair of them; empty for the whole data set.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "String::is_empty"))]
    pub about: String,
    /// How bad it is.
    pub state: State,
    /// What was found, in a sentence.
    pub says: String,
    /// The numbers behind it. Only finite ones.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub numbers: Vec<Number>,
    /// The option or command that mends it; fields of a request in back quotes.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "String::is_empty"))]
    pub mend: String,
}

impl Finding {
    /// A finding without numbers.
    pub fn new(check: &str, about: impl Into<String>, state: State, says: impl Into<String>) -> Self {
        Self {
            check: check.to_string(),
            about: about.into(),
            state,
            says: says.into(),
            numbers: Vec::new(),
            mend: String::new(),
        }
    }

    /// Adds a number; one that is not finite is left out.
    #[must_use]
    pub fn number(mut self, name: &str, value: f64, unit: &str) -> Self {
        if value.is_finite() {
            self.numbers.push(Number { name: name.to_string(), value, unit: unit.to_string() });
        }
        self
    }

    /// Adds what mends it.
    #[must_use]
    pub fn mend(mut self, mend: impl Into<String>) -> Self {
        self.mend = mend.into();
        self
    }

    /// The same as a suspicion of a result document; `None` for what is as it should be or not known.
    pub fn suspicion(&self) -> Option<Suspicion> {
        matches!(self.state, State::Look | State::Wrong).then(|| {
            let code = format!("check-{}", self.check);
            Suspicion::new(&code, &self.about, &self.says).evidence(self.evidence()).advice(&self.mend)
        })
    }

    /// The numbers in words: `offset -50.0 ms, correlation 0.999`.
    pub fn evidence(&self) -> String {
        let each = self.numbers.iter().map(|n| {
            let name = n.name.replace('-', " ");
            let space = if n.unit.is_empty() || n.unit == "%" { "" } else { " " };
            format!("{name} {}{space}{}", short(n.value), n.unit)
        });
        each.collect::<Vec<_>>().join(", ")
    }
}

/// Four digits that count, without an exponent; whole numbers as they are.
pub fn short(value: f64) -> String {
    if value == value.trunc() && value.abs() < 1e15 {
        return format!("{value:.0}");
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 9);
    let text = format!("{value:.*}", digits as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_finite() {
        assert_eq!(
            [-50.0, 0.99912, 123_456.0, 1234.567, 1e-3, 0.0].map(short).join(" "),
            "-50 0.9991 123456 1235 0.001 0"
        );
        let finding = Finding::new("clock", "a to b", State::Wrong, "late")
            .number("offset", -50.04, "ms")
            .number("none", f64::NAN, "");
        assert_eq!(finding.evidence(), "offset -50.04 ms");
        assert_eq!(finding.suspicion().unwrap().code, "check-clock");
        assert_eq!(Finding::new("clock", "", State::Ok, "fine").suspicion(), None);
        assert!(State::Wrong > State::Look && State::Look > State::Ok && State::Ok > State::Unknown);
    }
}
