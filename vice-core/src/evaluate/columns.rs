//! The samples of a segment in columns: what is made of them before they are forgotten.

use pulp::{Simd, WithSimd};

use super::carry::{Carried, Start};
use super::select::{SelectedPoint, SelectedSegment};
use super::windows::Windows;
use crate::lanes::ARCH;
use crate::metrics::by_age::{Samples, SegmentErrors};
use crate::metrics::held::median_of;
use crate::metrics::pixel::SquaredErrors;
use crate::track::CameraPath;

/// What is kept of each sample of a point: the rest is carried once more where it is asked for.
#[derive(Default)]
pub(super) struct Columns {
    /// By how much it is off from those around it, px.
    pub(super) jumps_px: Vec<f32>,
    /// The squared error, px².
    pub(super) squares_px2: Vec<f64>,
}

impl Columns {
    /// Without what they held, and with room for so many samples.
    pub(super) fn empty(&mut self, count: usize) {
        // All at once: what grows takes twice the room on its way.
        self.jumps_px.clear();
        self.jumps_px.reserve_exact(count);
        self.squares_px2.clear();
        self.squares_px2.reserve_exact(count);
    }
}

/// Columns of one segment, used again for the next.
#[derive(Default)]
pub(super) struct Scratch {
    pub(super) carried: Carried,
    label_px: [Vec<f64>; 2],
    path: [Vec<f64>; 7],
    /// Places of the labels, then of the samples, among the selected frames.
    pub(super) places: Vec<u32>,
    /// Where the point is carried minus where the label is, px.
    pub(super) residuals: [Vec<f64>; 2],
    squares_px2: Vec<f64>,
    angle_rad: Vec<f32>,
    offset_m: Vec<f32>,
}

impl Scratch {
    /// Carries the point of a segment to all its labels.
    pub(super) fn carry(
        &mut self,
        start: &Start<'_>,
        path: &CameraPath,
        point: &SelectedPoint<'_>,
        segment: &SelectedSegment,
    ) {
        let runs = &point.runs[segment.runs.clone()];
        let Self { carried, label_px, path: gathered, places, .. } = self;
        places.clear();
        label_px.iter_mut().for_each(Vec::clear);
        for run in runs {
            let (labels, frames) = (run.label as usize.., run.frame..run.frame + run.count);
            let labels = labels.start..labels.start + run.count as usize;
            label_px[0].extend_from_slice(&point.labels.u_px()[labels.clone()]);
            label_px[1].extend_from_slice(&point.labels.v_px()[labels]);
            places.extend(frames);
        }
        let columns = match runs {
            [run] => path.columns(run.frame as usize..(run.frame + run.count) as usize),
            _ => {
                gathered.iter_mut().for_each(Vec::clear);
                for run in runs {
                    let some = path.columns(run.frame as usize..(run.frame + run.count) as usize);
                    gathered.iter_mut().zip(some).for_each(|(to, from)| to.extend_from_slice(from));
                }
                gathered.each_ref().map(Vec::as_slice)
            }
        };
        carried.fill(start, columns, label_px.each_ref().map(Vec::as_slice));
    }

    /// What was carried minus the labels, of those that have a pixel: of `which` labels, or of all.
    pub(super) fn compare(&mut self, which: Option<&[u32]>, errors: &mut SquaredErrors) {
        let Self { carried, label_px, places, residuals, squares_px2, angle_rad, offset_m, .. } = self;
        if let Some(which) = which {
            for column in carried.tracked_px.iter_mut().chain(label_px.iter_mut()) {
                keep_only(column, which);
            }
            keep_only(&mut carried.angle_rad, which);
            keep_only(&mut carried.offset_m, which);
            keep_only(places, which);
        }
        for ((residuals, tracked), label) in residuals.iter_mut().zip(&carried.tracked_px).zip(&*label_px) {
            residuals.clear();
            residuals.extend(tracked.iter().zip(label).map(|(tracked, label)| tracked - label));
        }
        squares_px2.clear();
        squares_px2.extend(residuals[0].iter().zip(&residuals[1]).map(|(du, dv)| du * du + dv * dv));
        squares_px2.iter().for_each(|square| errors.add(square.sqrt()));
        angle_rad.clear();
        angle_rad.extend(carried.angle_rad.iter().map(|v| *v as f32));
        offset_m.clear();
        offset_m.extend(carried.offset_m.iter().map(|v| *v as f32));
    }

    /// Adds what is kept of each sample to the columns of its point.
    pub(super) fn keep(&self, columns: &mut Columns) {
        columns.squares_px2.extend_from_slice(&self.squares_px2);
        jumps_px(&self.residuals, &mut columns.jumps_px);
    }

    /// The errors of the segment without some of its samples.
    pub(super) fn errors(&self, windows: &Windows<'_>, keyframe: usize, without: &[usize]) -> SegmentErrors {
        let Self { squares_px2, angle_rad, offset_m, places, .. } = self;
        let of = |squares_px2: &[f64], angle_rad: &[f32], offset_m: &[f32], places: &[u32]| {
            SegmentErrors::of(
                &Samples { squares_px2, angle_rad, offset_m },
                |sample| windows.age_s(keyframe, places[sample]),
                |sample| windows.way_m(keyframe, places[sample]),
            )
        };
        if without.is_empty() {
            return of(squares_px2, angle_rad, offset_m, places);
        }
        let kept: Vec<usize> = (0..places.len()).filter(|i| !without.contains(i)).collect();
        fn some<T: Copy>(column: &[T], kept: &[usize]) -> Vec<T> {
            kept.iter().map(|i| column[*i]).collect()
        }
        let (squares, angles) = (some(squares_px2, &kept), some(angle_rad, &kept));
        of(&squares, &angles, &some(offset_m, &kept), &some(places, &kept))
    }
}

fn keep_only<T: Copy>(column: &mut Vec<T>, which: &[u32]) {
    for (to, from) in which.iter().enumerate() {
        column[to] = column[*from as usize];
    }
    column.truncate(which.len());
}

/// The median of some residuals, by component.
pub(super) fn median_residual(residuals: &[Vec<f64>; 2], range: std::ops::Range<usize>) -> [f64; 2] {
    [0, 1].map(|axis| median_of(&residuals[axis][range.clone()]))
}

/// By how much each sample is off from the median of the five around it; zero where there are fewer than three.
fn jumps_px(residuals: &[Vec<f64>; 2], into: &mut Vec<f32>) {
    let n = residuals[0].len();
    let first = into.len();
    into.resize(first + n, 0.0);
    if n < 3 {
        return;
    }
    let into = &mut into[first..];
    let [u, v] = residuals.each_ref().map(Vec::as_slice);
    if n > 4 {
        ARCH.dispatch(Inside { u, v, into: &mut into[2..n - 2] });
    }
    for i in (0..n).filter(|i| *i < 2 || *i + 2 >= n) {
        let [a, b] = median_residual(residuals, i.saturating_sub(2)..n.min(i + 3));
        let (du, dv) = (u[i] - a, v[i] - b);
        into[i] = (du * du + dv * dv).sqrt() as f32;
    }
}

/// Those that have two before and two behind them.
struct Inside<'a> {
    u: &'a [f64],
    v: &'a [f64],
    into: &'a mut [f32],
}

impl WithSimd for Inside<'_> {
    type Output = ();

    // Loops count: an iterator's closure might be compiled for the smallest instruction set.
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { u, v, into } = self;
        let n = into.len();
        let (u, v) = (&u[..n + 4], &v[..n + 4]);
        for i in 0..n {
            let du = u[i + 2] - middle_of_five(u[i], u[i + 1], u[i + 2], u[i + 3], u[i + 4]);
            let dv = v[i + 2] - middle_of_five(v[i], v[i + 1], v[i + 2], v[i + 3], v[i + 4]);
            into[i] = (du * du + dv * dv).sqrt() as f32;
        }
    }
}

#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The middle one of five numbers.
#[inline(always)]
fn middle_of_five(a: f64, b: f64, c: f64, d: f64, e: f64) -> f64 {
    let f = most(least(a, b), least(c, d));
    let g = least(most(a, b), most(c, d));
    most(least(e, f), least(most(e, f), g))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_middle_of_five_is_the_median(v in prop::array::uniform5(-3_i32..4)) {
            let v = v.map(f64::from);
            prop_assert_eq!(middle_of_five(v[0], v[1], v[2], v[3], v[4]), median_of(&v));
        }

        #[test]
        fn jumps_are_those_against_the_median_around(values in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 0..40)) {
            let (u, v): (Vec<f64>, Vec<f64>) = values.iter().copied().unzip();
            let residuals = [u, v];
            let mut found = vec![7.0];
            jumps_px(&residuals, &mut found);
            let n = values.len();
            prop_assert_eq!(found.len(), n + 1);
            for i in 0..n {
                let around = i.saturating_sub(2)..n.min(i + 3);
                let expected = if around.len() < 3 { 0.0 } else {
                    let [a, b] = median_residual(&residuals, around);
                    let (du, dv) = (values[i].0 - a, values[i].1 - b);
                    (du * du + dv * dv).sqrt()
                };
                prop_assert_eq!(found[i + 1], expected as f32);
            }
        }
    }
}
