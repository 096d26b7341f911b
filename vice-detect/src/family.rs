//! AprilTag families: their codes, and how wrong a code may be read and still be believed.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::codes;

/// A family of AprilTags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum TagFamily {
    /// 36 cells, 587 tags, codes at least 11 cells apart.
    #[default]
    #[serde(rename = "36h11")]
    T36h11,
    /// 25 cells, 35 tags, codes at least 9 cells apart.
    #[serde(rename = "25h9")]
    T25h9,
    /// 16 cells, 30 tags, codes at least 5 cells apart.
    #[serde(rename = "16h5")]
    T16h5,
}

impl TagFamily {
    /// All families.
    pub const ALL: [Self; 3] = [Self::T36h11, Self::T25h9, Self::T16h5];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::T36h11 => "36h11",
            Self::T25h9 => "25h9",
            Self::T16h5 => "16h5",
        }
    }

    /// Cells along a side, without the border.
    pub const fn side(self) -> usize {
        match self {
            Self::T36h11 => 6,
            Self::T25h9 => 5,
            Self::T16h5 => 4,
        }
    }

    /// How many tags there are.
    pub const fn len(self) -> usize {
        self.codes().len()
    }

    /// Never: for symmetry with [`TagFamily::len`].
    pub const fn is_empty(self) -> bool {
        false
    }

    /// Cells that may be read wrongly. Far below half the distance of the codes: that limit keeps tags apart from each
    /// other, this one keeps them apart from chance. A random pattern passes with a probability of 2e-5, 1e-4 and 2e-3;
    /// it must have a clean border besides.
    pub(crate) const fn believable_errors(self) -> u32 {
        match self {
            Self::T36h11 => 2,
            Self::T25h9 => 1,
            Self::T16h5 => 0,
        }
    }

    const fn codes(self) -> &'static [u64] {
        match self {
            Self::T36h11 => &codes::T36H11,
            Self::T25h9 => &codes::T25H9,
            Self::T16h5 => &codes::T16H5,
        }
    }

    /// The cells of a tag with its border, row by row from the top left of the printed tag, true where white:
    /// `(side + 2 border)²` of them. `None` if there is no such tag.
    pub fn cells(self, id: usize, border: usize) -> Option<Vec<bool>> {
        let code = *self.codes().get(id)?;
        let (n, all) = (self.side(), self.side() + 2 * border);
        let mut cells = vec![false; all * all];
        for row in 0..n {
            for column in 0..n {
                let bit = code >> (n * n - 1 - row * n - column) & 1;
                cells[(row + border) * all + column + border] = bit == 1;
            }
        }
        Some(cells)
    }

    /// The tag of cells read in some turn: id, wrong cells, and how often the cells must be turned clockwise by a
    /// quarter to read as the printed tag.
    pub(crate) fn find(self, cells: &[bool]) -> Option<(usize, u32, usize)> {
        let n = self.side();
        let mut cells = cells.to_vec();
        let mut best: Option<(u32, usize, usize)> = None;
        for turns in 0..4 {
            let read = cells.iter().fold(0_u64, |code, white| code << 1 | u64::from(*white));
            for (id, code) in self.codes().iter().enumerate() {
                let wrong = (code ^ read).count_ones();
                if best.is_none_or(|(least, _, _)| wrong < least) {
                    best = Some((wrong, id, turns));
                }
            }
            cells = (0..n * n).map(|i| cells[(n - 1 - i % n) * n + i / n]).collect();
        }
        best.filter(|(wrong, _, _)| *wrong <= self.believable_errors())
            .map(|(wrong, id, turns)| (id, wrong, turns))
    }
}

impl FromStr for TagFamily {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let short = text.trim().to_ascii_lowercase();
        let short = short.strip_prefix("tag").or_else(|| short.strip_prefix('t')).unwrap_or(&short);
        Self::ALL.into_iter().find(|f| f.name() == short).ok_or_else(|| {
            format!("there is no family of AprilTags named `{text}` here; known: 36h11, 25h9, 16h5")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_tag_is_found_in_each_turn_and_no_other_is() {
        for family in TagFamily::ALL {
            let n = family.side();
            for id in 0..family.len() {
                let mut cells = family.cells(id, 0).unwrap();
                for turns in 0..4 {
                    assert_eq!(family.find(&cells), Some((id, 0, (4 - turns) % 4)), "{family:?} {id}");
                    let mut wrong = cells.clone();
                    for cell in wrong.iter_mut().take(family.believable_errors() as usize) {
                        *cell = !*cell;
                    }
                    assert_eq!(family.find(&wrong).unwrap().0, id);
                    cells = (0..n * n).map(|i| cells[(n - 1 - i % n) * n + i / n]).collect();
                }
            }
        }
        assert_eq!(TagFamily::T36h11.cells(587, 1), None);
    }

    #[test]
    fn codes_are_as_far_apart_as_the_names_say() {
        for (family, distance) in [(TagFamily::T36h11, 11), (TagFamily::T25h9, 9), (TagFamily::T16h5, 5)] {
            let n = family.side();
            let turned = |code: u64| {
                (0..n * n).fold(0_u64, |c, i| {
                    let from = (n - 1 - i % n) * n + i / n;
                    c << 1 | code >> (n * n - 1 - from) & 1
                })
            };
            let codes = family.codes();
            let mut least = u32::MAX;
            for (i, a) in codes.iter().enumerate() {
                let mut other = *a;
                for turn in 0..4 {
                    let rest = codes.iter().enumerate().filter(|(j, _)| *j != i || turn > 0);
                    least = rest.map(|(_, b)| (other ^ b).count_ones()).fold(least, u32::min);
                    other = turned(other);
                }
            }
            assert_eq!(least, distance, "{family:?}");
        }
    }

    #[test]
    fn names_are_read_as_people_write_them() {
        assert_eq!("tag36h11".parse(), Ok(TagFamily::T36h11));
        assert_eq!("16H5".parse(), Ok(TagFamily::T16h5));
        assert!("36h10".parse::<TagFamily>().unwrap_err().contains("36h11, 25h9, 16h5"));
    }
}
