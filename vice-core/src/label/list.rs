//! Observations of a point in columns: 25 bytes each, and next to nothing for their lines and for what machines say.

use std::ops::Range;

use super::{Observation, ObservationSource, Provenance};
use crate::camera::Pixel;
use crate::time::Stamp;

/// Observations of a point.
///
/// Kept in columns, which labels by the million need: an [`Observation`] is put together where one is asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservationList {
    stamps: Vec<Stamp>,
    u_px: Vec<f64>,
    v_px: Vec<f64>,
    marks: Vec<Marks>,
    lines: Lines,
    /// What machines say, by the place of the observation, ascending.
    said: Vec<(usize, Said)>,
}

/// Who made an observation, and what is so or not of it, in a byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Marks(u8);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Said {
    confidence: Option<f64>,
    tracker_version: Option<u32>,
}

const SOURCES: [ObservationSource; 4] = [
    ObservationSource::Manual,
    ObservationSource::Auto,
    ObservationSource::Detected,
    ObservationSource::Interpolated,
];

impl Marks {
    const SOURCE: u8 = 0b11;
    const KEYFRAME: u8 = 1 << 2;
    const OCCLUDED: u8 = 1 << 3;
    const UNCERTAIN: u8 = 1 << 4;
    const SEEDED: u8 = 1 << 5;

    /// Those of an observation.
    #[inline]
    pub const fn of(observation: &Observation) -> Self {
        Self(observation.source as u8)
            .with(Self::KEYFRAME, observation.keyframe)
            .with(Self::OCCLUDED, observation.occluded)
            .with(Self::UNCERTAIN, observation.uncertain)
            .with(Self::SEEDED, observation.provenance.seeded)
    }

    const fn with(self, mark: u8, is_so: bool) -> Self {
        if is_so { Self(self.0 | mark) } else { self }
    }

    const fn has(self, mark: u8) -> bool {
        self.0 & mark != 0
    }

    /// Starts a segment.
    #[inline]
    pub const fn keyframe(self) -> bool {
        self.has(Self::KEYFRAME)
    }

    /// The point is hidden.
    #[inline]
    pub const fn occluded(self) -> bool {
        self.has(Self::OCCLUDED)
    }

    /// The annotator is not sure.
    #[inline]
    pub const fn uncertain(self) -> bool {
        self.has(Self::UNCERTAIN)
    }

    /// Who made it.
    #[inline]
    pub const fn source(self) -> ObservationSource {
        SOURCES[(self.0 & Self::SOURCE) as usize]
    }
}

impl ObservationList {
    /// Observations without lines of which no machine says more than that it was told where to look.
    ///
    /// `None` if the columns differ in length.
    pub fn from_columns(stamps: Vec<Stamp>, [u_px, v_px]: [Vec<f64>; 2], marks: Vec<Marks>) -> Option<Self> {
        let n = stamps.len();
        if [u_px.len(), v_px.len(), marks.len()] != [n; 3] {
            return None;
        }
        let mut lines = Lines::default();
        lines.extend(0, &Lines::none(n), n);
        Some(Self { stamps, u_px, v_px, marks, lines, said: Vec::new() })
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// Whether no machine says how sure it is.
    pub(super) fn says_nothing(&self) -> bool {
        self.said.is_empty()
    }

    /// Adds one.
    #[inline]
    pub fn push(&mut self, observation: Observation) {
        let Observation { stamp, px, provenance, line, .. } = observation;
        let Provenance { confidence, tracker_version, .. } = provenance;
        let at = self.stamps.len();
        if confidence.is_some() || tracker_version.is_some() {
            self.said.push((at, Said { confidence, tracker_version }));
        }
        self.stamps.push(stamp);
        self.u_px.push(px.u);
        self.v_px.push(px.v);
        self.marks.push(Marks::of(&observation));
        self.lines.push(at, line);
    }

    /// Adds those of another list.
    pub fn append(&mut self, other: Self) {
        if self.is_empty() {
            *self = other;
            return;
        }
        let at = self.stamps.len();
        self.lines.extend(at, &other.lines, other.len());
        self.said.extend(other.said.into_iter().map(|(place, said)| (at + place, said)));
        self.stamps.extend_from_slice(&other.stamps);
        self.u_px.extend_from_slice(&other.u_px);
        self.v_px.extend_from_slice(&other.v_px);
        self.marks.extend_from_slice(&other.marks);
    }

    /// The same observations, of lines that so many come before.
    #[must_use]
    pub fn lines_later(mut self, by: u64) -> Self {
        self.lines.runs.iter_mut().filter(|run| run.first > 0).for_each(|run| run.first += by);
        self
    }

    /// One of them.
    #[inline]
    pub fn get(&self, at: usize) -> Option<Observation> {
        let stamp = *self.stamps.get(at)?;
        let marks = self.marks[at];
        let said = self.said.binary_search_by_key(&at, |(place, _)| *place).ok().map(|i| self.said[i].1);
        Some(Observation {
            stamp,
            px: Pixel::new(self.u_px[at], self.v_px[at]),
            source: marks.source(),
            keyframe: marks.keyframe(),
            occluded: marks.occluded(),
            uncertain: marks.uncertain(),
            provenance: Provenance {
                confidence: said.and_then(|s| s.confidence),
                tracker_version: said.and_then(|s| s.tracker_version),
                seeded: marks.has(Marks::SEEDED),
            },
            line: self.lines.get(at),
        })
    }

    /// The first one.
    pub fn first(&self) -> Option<Observation> {
        self.get(0)
    }

    /// The last one.
    pub fn last(&self) -> Option<Observation> {
        self.get(self.len().checked_sub(1)?)
    }

    /// All of them, in order.
    pub const fn iter(&self) -> Iter<'_> {
        Iter { list: self, range: 0..self.stamps.len() }
    }

    /// Some of them, in order.
    pub fn some(&self, range: Range<usize>) -> Iter<'_> {
        let end = range.end.min(self.len());
        Iter { list: self, range: range.start.min(end)..end }
    }

    /// The stamps.
    #[inline]
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// The pixels, to the right.
    #[inline]
    pub fn u_px(&self) -> &[f64] {
        &self.u_px
    }

    /// The pixels, downwards.
    #[inline]
    pub fn v_px(&self) -> &[f64] {
        &self.v_px
    }

    /// Marks.
    #[inline]
    pub fn marks(&self) -> &[Marks] {
        &self.marks
    }

    /// Sorts by stamp, and by line where stamps are the same.
    pub(super) fn sort(&mut self) {
        if self.stamps.is_sorted_by(|a, b| a < b) {
            return;
        }
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by_key(|at| (self.stamps[*at], self.lines.get(*at)));
        let mut sorted = Self::default();
        order.into_iter().filter_map(|at| self.get(at)).for_each(|o| sorted.push(o));
        *self = sorted;
    }
}

impl<'a> IntoIterator for &'a ObservationList {
    type Item = Observation;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Goes through observations.
#[derive(Clone, Debug)]
pub struct Iter<'a> {
    list: &'a ObservationList,
    range: Range<usize>,
}

impl Iterator for Iter<'_> {
    type Item = Observation;

    fn next(&mut self) -> Option<Observation> {
        self.list.get(self.range.next()?)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.range.size_hint()
    }
}

impl DoubleEndedIterator for Iter<'_> {
    fn next_back(&mut self) -> Option<Observation> {
        self.list.get(self.range.next_back()?)
    }
}

impl ExactSizeIterator for Iter<'_> {}

impl FromIterator<Observation> for ObservationList {
    fn from_iter<I: IntoIterator<Item = Observation>>(all: I) -> Self {
        let mut list = Self::default();
        all.into_iter().for_each(|o| list.push(o));
        list
    }
}

/// Lines of a file as runs of even steps: files list points one after the other or frame by frame.
#[derive(Clone, Debug, Default, PartialEq)]
struct Lines {
    runs: Vec<Run>,
    count: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    /// Place of the first observation of the run.
    at: usize,
    first: u64,
    /// Lines from one to the next; not known of a run of one.
    step: u64,
}

impl Run {
    fn line(&self, at: usize) -> u64 {
        self.first + self.step * (at - self.at) as u64
    }
}

impl Lines {
    /// Of so many observations without lines.
    fn none(count: usize) -> Self {
        let runs = if count > 0 { vec![Run { at: 0, first: 0, step: 0 }] } else { vec![] };
        Self { runs, count }
    }

    #[inline]
    fn push(&mut self, at: usize, line: u64) {
        self.count = at + 1;
        if let Some(run) = self.runs.last_mut() {
            // Those without a line stay apart from those with one.
            if at == run.at + 1 && line >= run.first && (run.first > 0 || line == 0) {
                run.step = line - run.first;
                return;
            }
            if at > run.at + 1 && line == run.line(at) {
                return;
            }
        }
        self.runs.push(Run { at, first: line, step: 0 });
    }

    /// Adds those of other observations, of which there are so many, from a place on.
    fn extend(&mut self, at: usize, other: &Self, count: usize) {
        for (i, run) in other.runs.iter().enumerate() {
            let end = other.runs.get(i + 1).map_or(count, |next| next.at);
            // The first two tell whether a run goes on; the rest follows from them.
            for place in run.at..end.min(run.at + 2) {
                self.push(at + place, run.line(place));
            }
            let goes_on = self.runs.last().is_some_and(|last| {
                end <= run.at + 2 || (last.step == run.step && last.line(at + end - 1) == run.line(end - 1))
            });
            if !goes_on {
                (run.at + 2..end).for_each(|place| self.push(at + place, run.line(place)));
            }
        }
        self.count = at + count;
    }

    fn get(&self, at: usize) -> u64 {
        let run = self.runs.partition_point(|run| run.at <= at);
        run.checked_sub(1).map_or(0, |i| self.runs[i].line(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn observation(line: u64) -> Observation {
        let mut o = Observation::manual(Stamp::from_nanos(line as i64), Pixel::new(line as f64, -0.5));
        o.source = SOURCES[line as usize % 4];
        (o.keyframe, o.occluded, o.uncertain) =
            (line.is_multiple_of(3), line.is_multiple_of(5), line.is_multiple_of(7));
        o.provenance = Provenance {
            confidence: line.is_multiple_of(11).then_some(0.5),
            tracker_version: line.is_multiple_of(13).then_some(u32::MAX),
            seeded: line.is_multiple_of(2),
        };
        Observation { line, ..o }
    }

    proptest! {
        #[test]
        fn what_is_put_in_comes_out(lines in prop::collection::vec(0_u64..60, 0..40), cut in 0_usize..40, by in 1_u64..9) {
            let all: Vec<Observation> = lines.iter().copied().map(observation).collect();
            let list: ObservationList = all.iter().copied().collect();
            prop_assert_eq!(list.iter().collect::<Vec<_>>(), all.clone());
            prop_assert_eq!(list.some(cut..cut + 3).count(), all.len().saturating_sub(cut).min(3));
            // In two parts it is the same list.
            let (first, second) = all.split_at(cut.min(all.len()));
            let mut both: ObservationList = first.iter().copied().collect();
            both.append(second.iter().copied().collect());
            prop_assert_eq!(both.iter().collect::<Vec<_>>(), all.clone());
            let later = list.clone().lines_later(by);
            prop_assert!(later.iter().zip(&all).all(|(a, b)| b.line == 0 || a.line == b.line + by));
            let mut sorted = list;
            sorted.sort();
            let mut expected = all;
            expected.sort_by_key(|o| (o.stamp, o.line));
            prop_assert_eq!(sorted.iter().collect::<Vec<_>>(), expected);
        }
    }

    #[test]
    fn lines_of_a_table_take_no_room() {
        let mut list: ObservationList = (0..1000).map(|i| observation(2 + 4 * i)).collect();
        assert_eq!(list.lines.runs.len(), 1);
        list.append((1000..2000).map(|i| observation(2 + 4 * i)).collect());
        assert_eq!((list.lines.runs.len(), list.get(1999).map(|o| o.line)), (1, Some(2 + 4 * 1999)));
        assert_eq!(ObservationList::from_columns(vec![], [vec![1.0], vec![]], vec![]), None);
    }
}
