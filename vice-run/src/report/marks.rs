//! What is drawn on the frames of a run: where the labels say the points are, and where the streams carried them.

use std::collections::BTreeMap;

use crate::result::ResultDocument;
use vice_core::camera::Pixel;
use vice_core::result::{PixelPart, PointName, Role};
use vice_core::time::Stamp;

/// A pose stream in the order of the document, with its place among the estimates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Carrier {
    pub(crate) name: String,
    /// `None` for the reference.
    pub(crate) estimate: Option<usize>,
}

/// A point in a frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mark {
    pub(crate) label_px: Option<Pixel>,
    /// The point starts anew here.
    pub(crate) keyframe: bool,
    /// Where each carrier carried it, by its index.
    pub(crate) carried: Vec<(usize, Pixel, f64)>,
}

/// A frame with its points by name.
pub(crate) type FrameMarks = BTreeMap<PointName, Mark>;

/// The marks of all frames with one depth source.
pub(crate) struct Marks {
    pub(crate) depth: String,
    pub(crate) carriers: Vec<Carrier>,
    pub(crate) frames: BTreeMap<Stamp, FrameMarks>,
}

impl Marks {
    /// With the first depth source of the document, or the named one; `None` where that has nothing to show.
    pub(crate) fn of(document: &ResultDocument, depth: Option<&str>) -> Option<Self> {
        let depth = depth.or_else(|| document.pixel.first().map(|p| p.depth.as_str()))?;
        let parts: Vec<&PixelPart> = document.pixel.iter().filter(|p| p.depth == depth).collect();
        let mut marks = Self { depth: depth.to_string(), carriers: vec![], frames: BTreeMap::new() };
        for (index, part) in parts.iter().enumerate() {
            let before = marks.carriers.iter().filter(|c| c.estimate.is_some()).count();
            let estimate = (part.role == Role::Estimate).then_some(before);
            marks.carriers.push(Carrier { name: part.stream.clone(), estimate });
            for keyframe in &part.keyframes {
                let Some(px) = keyframe.label_px else { continue };
                let mark = marks.mark(keyframe.timestamp_ns, &keyframe.point);
                (mark.label_px, mark.keyframe) = (Some(px), true);
            }
            for sample in &part.samples {
                let mark = marks.mark(sample.timestamp_ns, &sample.point);
                mark.label_px = Some(sample.label_px);
                mark.carried.push((index, sample.tracked_px, sample.error_px));
            }
        }
        (!marks.frames.is_empty()).then_some(marks)
    }

    fn mark(&mut self, stamp: Stamp, point: &PointName) -> &mut Mark {
        self.frames.entry(stamp).or_default().entry(point.clone()).or_default()
    }

    /// Mean error of a carrier in a frame, pixels.
    pub(crate) fn mean_error_px(&self, stamp: Stamp, carrier: usize) -> Option<f64> {
        let errors: Vec<f64> = self
            .frames
            .get(&stamp)?
            .values()
            .flat_map(|m| m.carried.iter().filter(|c| c.0 == carrier).map(|c| c.2))
            .collect();
        super::numbers::mean(&errors)
    }

    /// Places of the carriers that a page is about: the estimates, or the reference where there is none.
    pub(crate) fn shown(&self) -> Vec<usize> {
        let estimates = || self.carriers.iter().enumerate().filter(|(_, c)| c.estimate.is_some());
        match estimates().count() {
            0 => (0..self.carriers.len()).collect(),
            _ => estimates().map(|(i, _)| i).collect(),
        }
    }

    /// Stamps in the order in which they are worth a look: the frame that is furthest off, the first, the last, then
    /// ever finer between them.
    pub(crate) fn by_interest(&self) -> Vec<Stamp> {
        let stamps: Vec<Stamp> = self.frames.keys().copied().collect();
        let shown = self.shown();
        let error = |stamp: &Stamp| {
            let errors: Vec<f64> = shown.iter().filter_map(|c| self.mean_error_px(*stamp, *c)).collect();
            super::numbers::mean(&errors).unwrap_or(-1.0)
        };
        let worst = stamps.iter().copied().max_by(|a, b| error(a).total_cmp(&error(b)));
        let mut order: Vec<Stamp> = worst.into_iter().chain(stamps.first().copied()).collect();
        let last = stamps.len().saturating_sub(1);
        let mut parts = 1;
        while parts <= 2 * stamps.len() {
            order.extend((0..=parts).filter_map(|i| stamps.get(last * i / parts)));
            parts *= 2;
        }
        let mut seen = std::collections::BTreeSet::new();
        order.retain(|s| seen.insert(*s));
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, keyframe, part, sample};

    #[test]
    fn every_frame_is_in_the_order_once_and_the_worst_first() {
        let samples: Vec<_> = (1..40).map(|i| sample("a", i, if i == 17 { 99.0 } else { 1.0 })).collect();
        let mut estimate = part("e", &samples);
        estimate.keyframes.push(keyframe("a", 0));
        let marks = Marks::of(&document(vec![estimate]), None).unwrap();
        let order = marks.by_interest();
        assert_eq!(order.len(), 40);
        assert_eq!(order[..3].iter().map(|s| s.as_nanos()).collect::<Vec<_>>(), [17, 0, 39]);
        assert!(marks.frames[&Stamp::from_nanos(0)].values().all(|m| m.keyframe && m.carried.is_empty()));
        assert!(Marks::of(&document(vec![]), None).is_none());
    }
}
