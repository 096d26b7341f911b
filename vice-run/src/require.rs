//! Limits that a result must keep, for continuous integration: `rmse_2d<2px`, `age5s<3px`.
//!
//! ```text
//! REQUIREMENT = QUANTITY [".low"] "<" NUMBER UNIT
//! QUANTITY    = "rmse_2d" | "age" NUMBER "s" | "moved" NUMBER "m"
//! UNIT        = "px" | "mrad" | "mm"
//! ```
//! `rmse_2d` is that of the labels that hold, `age5s` at five seconds since the key frame, `moved1m` after a metre of motion.
//! The upper end of the 95 % interval has to be below the limit: the value is shown to be small enough. With `.low` the lower
//! end has to: it is not shown to be too large. A number or interval that could not be had shows nothing and breaks either.

use std::fmt;
use std::str::FromStr;

use vice_core::metrics::by_age::{AGES_S, MOTIONS_M};
use vice_core::result::{Figure, PixelPart, Role, WindowPart};

/// A limit that a result must keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Requirement {
    quantity: Quantity,
    end: End,
    unit: Unit,
    limit: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    All,
    AgeS(f64),
    MovedM(f64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    High,
    Low,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Unit {
    Px,
    Mrad,
    Mm,
}

const UNITS: [(&str, Unit); 3] = [("px", Unit::Px), ("mrad", Unit::Mrad), ("mm", Unit::Mm)];

impl FromStr for Requirement {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let grammar = "expected such as rmse_2d<2px, age5s<3px or moved1m.low<40mm";
        let plain: String = text.split_whitespace().collect();
        let (name, limit) = plain.split_once('<').ok_or(grammar)?;
        let (name, end) = name.strip_suffix(".low").map_or((name, End::High), |name| (name, End::Low));
        let quantity = if name == "rmse_2d" {
            Quantity::All
        } else {
            let at =
                |prefix: &str, unit: &str| name.strip_prefix(prefix)?.strip_suffix(unit)?.parse::<f64>().ok();
            let known = |list: &[f64]| list.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
            match (at("age", "s"), at("moved", "m")) {
                (Some(s), _) if AGES_S.contains(&s) => Quantity::AgeS(s),
                (_, Some(m)) if MOTIONS_M.contains(&m) => Quantity::MovedM(m),
                (Some(s), _) => {
                    return Err(format!("no error is told at {s} s; ages are {} s", known(&AGES_S)));
                }
                (_, Some(m)) => {
                    return Err(format!("no error is told after {m} m; motions are {} m", known(&MOTIONS_M)));
                }
                _ => return Err(format!("`{name}` is no quantity; {grammar}")),
            }
        };
        let unit = UNITS.iter().find(|(suffix, _)| limit.ends_with(suffix));
        let (suffix, unit) = unit.ok_or("the limit needs a unit: px, mrad or mm")?;
        let limit =
            limit[..limit.len() - suffix.len()].parse::<f64>().map_err(|e| format!("`{limit}`: {e}"))?;
        if !(limit > 0.0 && limit.is_finite()) {
            return Err("the limit must be a number above zero".to_string());
        }
        Ok(Self { quantity, end, unit: *unit, limit })
    }
}

impl fmt::Display for Requirement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.quantity {
            Quantity::All => f.write_str("rmse_2d")?,
            Quantity::AgeS(s) => write!(f, "age{s}s")?,
            Quantity::MovedM(m) => write!(f, "moved{m}m")?,
        }
        let low = if self.end == End::Low { ".low" } else { "" };
        write!(f, "{low}<{}{}", self.limit, self.unit.name())
    }
}

impl Unit {
    fn name(self) -> &'static str {
        UNITS.iter().find(|(_, unit)| *unit == self).map_or("", |(name, _)| name)
    }
}

impl Requirement {
    /// Why a part breaks it, in a sentence; `None` where it is kept.
    pub fn broken_by(&self, part: &PixelPart) -> Option<String> {
        let about = format!("{} ({} depth) breaks {self}", part.stream, part.depth);
        let figure = match self.quantity {
            Quantity::All => self.overall(part).ok_or_else(|| "no label holds".to_string()),
            Quantity::AgeS(s) => self.at(part.by_age.iter().find(|w| w.age_s == Some(s))),
            Quantity::MovedM(m) => self.at(part.by_distance.iter().find(|w| w.moved_m == Some(m))),
        };
        let unit = self.unit.name();
        match figure {
            Err(why) => Some(format!("{about}: there is no number: {why}")),
            Ok(Figure { rmse, interval_95: None }) => {
                let why = part.held.as_ref().and_then(|h| h.note.clone());
                let why = why.map_or_else(String::new, |w| format!(": {w}"));
                Some(format!("{about}: {rmse:.3} {unit} has no interval{why}"))
            }
            Ok(Figure { rmse, interval_95: Some([low, high]) }) => {
                let end = if self.end == End::Low { low } else { high };
                let kept = end < self.limit;
                (!kept).then(|| format!("{about}: {rmse:.3} {unit}, 95 % from {low:.3} to {high:.3}"))
            }
        }
    }

    fn overall(&self, part: &PixelPart) -> Option<Figure> {
        match self.unit {
            Unit::Px => part.held_rmse_px.map(|rmse| Figure { rmse, interval_95: part.interval_95 }),
            Unit::Mrad => part.held.as_ref()?.mrad,
            Unit::Mm => part.held.as_ref()?.mm,
        }
    }

    fn at(&self, window: Option<&WindowPart>) -> Result<Figure, String> {
        let window = window.ok_or("nothing was scored")?;
        if let Some(refused) = &window.refused {
            return Err(refused.clone());
        }
        let figure = match self.unit {
            Unit::Px => window.px,
            Unit::Mrad => window.mrad,
            Unit::Mm => window.mm,
        };
        figure.ok_or_else(|| "a label has no ray".to_string())
    }
}

/// What breaks the requirements: a sentence for each, of the estimates, or of the reference where there is no estimate.
pub fn broken(requirements: &[Requirement], pixel: &[PixelPart]) -> Vec<String> {
    let any_estimate = pixel.iter().any(|p| p.role == Role::Estimate);
    let judged = pixel.iter().filter(|p| !any_estimate || p.role == Role::Estimate);
    judged.flat_map(|part| requirements.iter().filter_map(move |r| r.broken_by(part))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::part;

    fn read(text: &str) -> Result<Requirement, String> {
        text.parse()
    }

    #[test]
    fn a_requirement_is_read_back_as_it_is_written() {
        for text in ["rmse_2d<2px", "age5s<3px", "moved0.5m.low<40mm", "age10s.low<1.5mrad"] {
            assert_eq!(read(text).unwrap().to_string(), text);
        }
        assert_eq!(read(" rmse_2d < 2 px ").unwrap().to_string(), "rmse_2d<2px");
        for (text, why) in [
            ("rmse_2d>2px", "expected such as"),
            ("rmse<2px", "is no quantity"),
            ("age3s<2px", "ages are 1, 2, 5, 10 s"),
            ("moved7m<2px", "motions are 0.5, 1, 2 m"),
            ("rmse_2d<2", "needs a unit"),
            ("rmse_2d<xpx", "invalid float"),
            ("rmse_2d<-2px", "above zero"),
            ("rmse_2d<NaNpx", "above zero"),
            ("", "expected such as"),
        ] {
            assert!(read(text).unwrap_err().contains(why), "{text}: {}", read(text).unwrap_err());
        }
    }

    #[test]
    fn the_upper_end_must_be_below_and_what_is_not_known_breaks() {
        let mut one = part("e", &[]);
        one.held_rmse_px = Some(1.8);
        one.interval_95 = Some([1.5, 2.1]);
        let broken = |text: &str, part: &PixelPart| read(text).unwrap().broken_by(part);
        assert_eq!(
            broken("rmse_2d<2px", &one).unwrap(),
            "e (floor depth) breaks rmse_2d<2px: 1.800 px, 95 % from 1.500 to 2.100"
        );
        assert_eq!(broken("rmse_2d<2.2px", &one), None);
        assert_eq!(broken("rmse_2d.low<2px", &one), None);
        assert!(broken("rmse_2d.low<1.5px", &one).is_some());
        assert!(broken("rmse_2d<2mm", &one).unwrap().contains("there is no number"));
        assert!(broken("age1s<2px", &one).unwrap().contains("nothing was scored"));
        one.by_age = vec![WindowPart {
            age_s: Some(1.0),
            moved_m: None,
            px: None,
            mrad: None,
            mm: None,
            segments: 0,
            samples: 0,
            refused: Some("3 segments reach 1.2 s, 5 are needed".to_string()),
        }];
        assert!(broken("age1s<2px", &one).unwrap().contains("3 segments reach"));
        one.interval_95 = None;
        assert!(broken("rmse_2d.low<9px", &one).unwrap().contains("has no interval"));
    }

    #[test]
    fn estimates_are_judged_and_the_reference_only_alone() {
        let mut reference = part("gt", &[]);
        reference.role = Role::Reference;
        let requirements = [read("rmse_2d<2px").unwrap()];
        let mut good = part("e", &[]);
        good.held_rmse_px = Some(1.0);
        good.interval_95 = Some([0.9, 1.1]);
        assert!(broken(&requirements, &[reference.clone(), good]).is_empty());
        assert_eq!(broken(&requirements, &[reference]).len(), 1);
    }
}
