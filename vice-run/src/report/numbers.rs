//! Small statistics of samples, for sentences and plots.

use std::collections::BTreeMap;

use crate::result::ResultDocument;
use vice_core::result::{PixelPart, PointName, Sample};
use vice_core::time::Stamp;

/// The mean; `None` of nothing.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Root of the mean square; `None` of nothing.
pub(crate) fn rms(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt())
}

/// Pearson's correlation of pairs; `None` for fewer than three or where one side does not vary.
pub(crate) fn correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    if pairs.len() < 3 {
        return None;
    }
    let n = pairs.len() as f64;
    let (a, b) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        ab += (x - a) * (y - b);
        aa += (x - a) * (x - a);
        bb += (y - b) * (y - b);
    }
    let r = ab / (aa.sqrt() * bb.sqrt());
    r.is_finite().then(|| r.clamp(-1.0, 1.0))
}

/// Mean error of the points at each frame, pixels.
pub(crate) fn mean_by_frame(part: &PixelPart) -> BTreeMap<Stamp, f64> {
    means(part.samples.iter().map(|sample| (sample.timestamp_ns, sample.error_px)))
}

/// The mean of the values at each stamp.
pub(crate) fn means(values: impl Iterator<Item = (Stamp, f64)>) -> BTreeMap<Stamp, f64> {
    let mut sums: BTreeMap<Stamp, (f64, u64)> = BTreeMap::new();
    for (stamp, value) in values {
        let sum = sums.entry(stamp).or_default();
        *sum = (sum.0 + value, sum.1 + 1);
    }
    sums.into_iter().map(|(stamp, (sum, count))| (stamp, sum / count as f64)).collect()
}

/// Errors of each point, by name in the order of the document.
pub(crate) fn errors_by_point(part: &PixelPart) -> Vec<(&PointName, Vec<f64>)> {
    let mut points: Vec<(&PointName, Vec<f64>)> = Vec::new();
    let mut places: BTreeMap<&PointName, usize> = BTreeMap::new();
    for sample in &part.samples {
        let place = *places.entry(&sample.point).or_insert_with(|| {
            points.push((&sample.point, vec![]));
            points.len() - 1
        });
        points[place].1.push(sample.error_px);
    }
    points
}

/// The sample with the largest error.
pub(crate) fn worst(part: &PixelPart) -> Option<&Sample> {
    part.samples.iter().max_by(|a, b| a.error_px.total_cmp(&b.error_px))
}

/// The samples of each segment in time: those of a point between one of its key frames and the next.
pub(crate) fn segments(part: &PixelPart) -> Vec<Vec<&Sample>> {
    let mut starts: BTreeMap<&PointName, Vec<Stamp>> = BTreeMap::new();
    for keyframe in &part.keyframes {
        starts.entry(&keyframe.point).or_default().push(keyframe.timestamp_ns);
    }
    starts.values_mut().for_each(|s| s.sort_unstable());
    let mut segments: BTreeMap<(&PointName, usize), Vec<&Sample>> = BTreeMap::new();
    for sample in &part.samples {
        let started =
            starts.get(&sample.point).map_or(0, |s| s.partition_point(|k| *k <= sample.timestamp_ns));
        segments.entry((&sample.point, started)).or_default().push(sample);
    }
    segments
        .into_values()
        .map(|mut samples| {
            samples.sort_by_key(|s| s.timestamp_ns);
            samples
        })
        .collect()
}

/// Mean errors in the first and in the last fifth of the segments, pixels.
pub(crate) fn first_and_last(part: &PixelPart) -> Option<(f64, f64)> {
    let (mut early, mut late) = (Vec::new(), Vec::new());
    for segment in segments(part) {
        let fifth = segment.len().div_ceil(5);
        early.extend(segment[..fifth].iter().map(|s| s.error_px));
        late.extend(segment[segment.len() - fifth..].iter().map(|s| s.error_px));
    }
    Some((mean(&early)?, mean(&late)?))
}

/// The stamp that plots count seconds from: the camera's first frame, or the first one in the document.
pub(crate) fn time_zero(document: &ResultDocument) -> Stamp {
    let stamps = || {
        let samples = document.pixel.iter().flat_map(|p| p.samples.iter().map(|s| s.timestamp_ns));
        samples.chain(document.pixel.iter().flat_map(|p| p.keyframes.iter().map(|k| k.timestamp_ns)))
    };
    document.dataset.first_frame_ns.or_else(|| stamps().min()).unwrap_or_default()
}

/// Pixels with as many digits as a person wants to read.
pub(crate) fn px(value: f64) -> String {
    // Squares of what a document from elsewhere holds may not fit a double.
    if !value.is_finite() {
        return "more px than can be counted".to_string();
    }
    format!("{} px", super::rows::pixels(value, super::rows::decimals(value)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{part, sample};

    #[test]
    fn statistics_by_hand() {
        assert_eq!((mean(&[]), mean(&[1.0, 2.0])), (None, Some(1.5)));
        let line = correlation(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]).unwrap();
        assert!((line - 1.0).abs() < 1e-12);
        assert_eq!(px(f64::INFINITY), "more px than can be counted");
        assert_eq!(correlation(&[(0.0, 1.0), (1.0, 1.0), (2.0, 1.0)]), None);
        assert_eq!(correlation(&[(0.0, 1.0), (1.0, 2.0)]), None);
    }

    #[test]
    fn a_segment_ends_where_the_point_starts_anew() {
        let mut part = part("s", &[]);
        for (stamp, error) in [(1, 1.0), (2, 2.0), (4, 9.0)] {
            part.samples.push(sample("a", stamp, error));
        }
        part.samples.push(sample("b", 2, 5.0));
        for (point, stamp) in [("a", 0), ("a", 3), ("b", 0)] {
            part.keyframes.push(crate::report::testing::keyframe(point, stamp));
        }
        let sizes: Vec<usize> = segments(&part).iter().map(Vec::len).collect();
        assert_eq!(sizes, [2, 1, 1]);
        assert_eq!(first_and_last(&part), Some(((1.0 + 9.0 + 5.0) / 3.0, (2.0 + 9.0 + 5.0) / 3.0)));
        assert_eq!(mean_by_frame(&part)[&Stamp::from_nanos(2)], 3.5);
    }
}
