//! One Kalman pass over the frames that makes residuals independent: what each label adds to those before it.
//!
//! State: the error of the current pose (position, rotation about the world's axes, and velocity of an inertial
//! estimate), the same with the jitter of this frame, and for each point that is followed the error of its place in the world
//! (made by the pose error, jitter and label noise of its key frame and by its depth) and the walk of its label. All
//! labels of a frame share its pose, all labels of a segment its key frame. Cost: frames times the square of the state.

#![expect(clippy::needless_range_loop, reason = "indices of matrices are clearer as indices")]
#![expect(clippy::manual_memcpy, reason = "a copy of a slice is a call, and takes registers through memory")]

mod means;
mod state;
mod update;

use pulp::{Simd, WithSimd};

use super::geometry::{FrameEvents, Geometry};
use super::noise::Sizes;
use super::scene::Residual;
use crate::lanes::ARCH;
use state::{POSE, SLOT, State};
use update::{AT_ONCE, Row, Update};

/// Roll and pitch forget in this time, seconds.
const LEAN_S: f64 = 2.5;
const GRAVITY_M_S2: f64 = 9.81;
/// How well the velocity is known that an integration starts with.
const START_M_S: f64 = 0.005;
/// A shift is followed for so many frames after its segment, or its label.
const AFTER: usize = 30;
const AFTER_LABEL: usize = 12;

/// Frames at which the pose may have jumped: more process noise over the steps up to these frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    /// First and last step.
    pub(super) from: usize,
    pub(super) to: usize,
    /// Deviation in all, metres and radians.
    pub(super) m: f64,
    pub(super) rad: f64,
}

/// What is not the same for all labels.
#[derive(Clone, Debug, Default)]
pub(super) struct Weights {
    /// Variance of each label over that of a usual one.
    pub(super) labels: Vec<f64>,
    /// Variance of each key label over that of a usual one.
    pub(super) keys: Vec<f64>,
}

/// Residuals and columns made independent, of unit variance.
#[derive(Clone, Debug, Default)]
pub(super) struct Whitened {
    /// Number of columns, the residuals first.
    pub(super) width: usize,
    /// Row by row: two rows a label, in the order of the frames.
    pub(super) rows: Vec<f64>,
    /// First row of each frame.
    pub(super) frame_rows: Vec<usize>,
    /// Sum of the logarithms of variances, by frame.
    pub(super) log_variances: Vec<f64>,
    /// By segment or by label: what a shift of it would do, if asked for.
    pub(super) shifts: Vec<Shift>,
}

impl Whitened {
    /// The residuals and columns at some places, in this order, as if they had been made independent by themselves.
    pub(super) fn of_columns(&self, places: &[usize]) -> Self {
        let rows = self.rows.chunks_exact(self.width).flat_map(|row| places.iter().map(|place| row[*place]));
        Self {
            width: places.len(),
            rows: rows.collect(),
            frame_rows: self.frame_rows.clone(),
            log_variances: self.log_variances.clone(),
            shifts: Vec::new(),
        }
    }
}

/// Whose shifts are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shifts {
    Nobodys,
    Keys,
    Labels,
}

/// How whitened rows answer to a shift of one label or key label by a pixel: products with itself and with the columns.
#[derive(Clone, Debug)]
pub(super) struct Shift {
    pub(super) own: [[f64; 2]; 2],
    pub(super) with: [Vec<f64>; 2],
}

/// A label or key label whose shift is being followed.
struct Following {
    of: usize,
    /// Where its two columns stand among the means.
    columns: [usize; 2],
    until: usize,
}

/// Makes columns independent: `columns[0]` the residuals, then derivatives. With `shifts`, also what a shift of each
/// label or key label would do.
pub(super) fn whiten(
    geometry: &Geometry,
    columns: &[&[Residual]],
    sizes: &Sizes,
    weights: &Weights,
    jumps: &[Jump],
    shifts: Shifts,
) -> Whitened {
    // The same sums in the same order, with the widest registers that there are.
    ARCH.dispatch(Whiten { geometry, columns, sizes, weights, jumps, shifts })
}

/// All that it calls is inlined, and its loops hold no closures: what is not inlined is compiled for the smallest
/// instruction set.
struct Whiten<'p> {
    geometry: &'p Geometry,
    columns: &'p [&'p [Residual]],
    sizes: &'p Sizes,
    weights: &'p Weights,
    jumps: &'p [Jump],
    shifts: Shifts,
}

impl WithSimd for Whiten<'_> {
    type Output = Whitened;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Whitened {
        let mut pass = Pass::new(self.geometry, self.columns, self.sizes, self.weights, self.shifts);
        for (f, frame) in self.geometry.frames.iter().enumerate() {
            if f > 0 {
                pass.predict(f, frame, self.jumps);
            }
            pass.look(simd, f, frame);
            pass.change(f, frame);
        }
        pass.out.frame_rows.push(pass.out.rows.len() / self.columns.len());
        pass.out
    }
}

struct Pass<'p> {
    geometry: &'p Geometry,
    columns: &'p [&'p [Residual]],
    sizes: &'p Sizes,
    weights: &'p Weights,
    shifts: Shifts,
    state: State,
    update: Update,
    /// The slot of each segment that is followed.
    slots: Vec<usize>,
    following: Vec<Following>,
    /// Columns of shifts that are no longer followed.
    spare: Vec<usize>,
    /// Columns that were ever taken.
    used: usize,
    /// What is measured of a frame, row by row in all columns.
    measured: Vec<f64>,
    lean: f64,
    out: Whitened,
}

impl<'p> Pass<'p> {
    #[inline(always)]
    fn new(
        geometry: &'p Geometry,
        columns: &'p [&'p [Residual]],
        sizes: &'p Sizes,
        weights: &'p Weights,
        shifts: Shifts,
    ) -> Self {
        let width = columns.len();
        let now = if geometry.inertial { 9 } else { POSE };
        let mut state = State::new(now, geometry.most_followed, width);
        let lean = if geometry.inertial { 0.0 } else { sizes.lean_rad * sizes.lean_rad };
        for i in 3..5 {
            state.widen(i, sizes.lean_rad * sizes.lean_rad);
        }
        if geometry.own_anchor {
            state.widen(2, (2.0 * sizes.position_m).powi(2));
        }
        if geometry.inertial {
            for i in 6..9 {
                state.widen(i, START_M_S * START_M_S);
            }
        }
        let followed = match shifts {
            Shifts::Nobodys => 0,
            Shifts::Keys => geometry.segments.len(),
            Shifts::Labels => geometry.labels.len(),
        };
        let nothing = Shift { own: [[0.0; 2]; 2], with: [vec![0.0; width], vec![0.0; width]] };
        let out = Whitened { width, shifts: vec![nothing; followed], ..Whitened::default() };
        Self {
            geometry,
            columns,
            sizes,
            weights,
            shifts,
            update: Update::new(state.stride),
            state,
            slots: vec![usize::MAX; geometry.segments.len()],
            following: Vec::new(),
            spare: Vec::new(),
            used: width,
            measured: Vec::new(),
            lean,
            out,
        }
    }

    /// From the frame before to this one.
    #[inline(always)]
    fn predict(&mut self, f: usize, frame: &FrameEvents, jumps: &[Jump]) {
        let Self { state, sizes, .. } = self;
        let dt = frame.dt_s;
        if self.geometry.inertial {
            for i in 0..3 {
                state.add(i, 6 + i, dt);
            }
            state.add(6, 4, GRAVITY_M_S2 * dt);
            state.add(7, 3, -GRAVITY_M_S2 * dt);
            for i in 0..3 {
                state.widen(i, sizes.position_m.powi(2) * dt + sizes.accel.powi(2) * dt.powi(3) / 3.0);
                state.widen(3 + i, sizes.gyro.powi(2) * dt);
                state.widen(6 + i, sizes.accel.powi(2) * dt);
            }
        } else {
            state.add(0, 5, -frame.step.y);
            state.add(1, 5, frame.step.x);
            let keep = (-dt / LEAN_S).exp();
            for i in 3..5 {
                state.scale(i, keep);
                state.widen(i, self.lean * (1.0 - keep * keep));
            }
            for i in 0..3 {
                state.widen(i, sizes.position_m.powi(2) * dt);
            }
            state.widen(5, sizes.yaw_rad.powi(2) * dt);
        }
        for jump in jumps.iter().filter(|j| (j.from..=j.to).contains(&f)) {
            let share = 1.0 / (jump.to - jump.from + 1) as f64;
            for i in 0..3 {
                state.widen(i, jump.m * jump.m * share);
                state.widen(3 + i, jump.rad * jump.rad * share);
            }
        }
        for s in &frame.followed {
            for i in 3..SLOT {
                state.widen(self.slots[*s] + i, sizes.walk_px.powi(2) * dt);
            }
        }
    }

    /// Takes the labels of a frame in.
    #[inline(always)]
    fn look<S: Simd>(&mut self, simd: S, f: usize, frame: &FrameEvents) {
        let Sizes { jitter_m: m, jitter_rad: rad, .. } = *self.sizes;
        self.state.look([m, m, m, rad, rad, rad]);
        self.out.frame_rows.push(self.out.rows.len() / self.out.width);
        let mut log_variances = 0.0;
        let last = frame.labels.len().div_ceil(AT_ONCE);
        for (chunk, labels) in frame.labels.chunks(AT_ONCE).enumerate() {
            // More labels, and segments that begin, start from the pose with its jitter.
            let looked_at = chunk + 1 < last || !frame.begins.is_empty();
            log_variances += self.take(simd, f, labels, looked_at);
        }
        self.out.log_variances.push(log_variances);
    }

    /// Takes some labels in; the sum of the logarithms of their variances.
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, f: usize, labels: &[usize], looked_at: bool) -> f64 {
        let mut rows = [Row { terms: [(0, 0.0); POSE + 4], variance: 0.0 }; 2 * AT_ONCE];
        let rows = &mut rows[..2 * labels.len()];
        let now = self.state.now;
        for (l, pair) in labels.iter().zip(rows.chunks_exact_mut(2)) {
            let label = &self.geometry.labels[*l];
            let slot = self.slots[label.segment];
            for (axis, row) in pair.iter_mut().enumerate() {
                let (h, turn) = (&label.by_place[axis], &label.by_turn[axis]);
                for i in 0..3 {
                    row.terms[i] = (now + i, -h[i]);
                    row.terms[3 + i] = (now + 3 + i, turn[i]);
                    row.terms[POSE + i] = (slot + i, h[i]);
                }
                row.terms[POSE + 3] = (slot + 3 + axis, 1.0);
                row.variance = self.sizes.white_px.powi(2) * self.weights.labels[*l];
            }
            if self.shifts == Shifts::Labels {
                let columns = [0, 1].map(|_| self.another());
                self.following.push(Following { of: *l, columns, until: f + AFTER_LABEL });
            }
        }
        let log_variances = self.update.covariance(simd, &mut self.state, rows, looked_at);
        let (width, m) = (self.out.width, rows.len());
        let all = self.state.means.width();
        self.measured.clear();
        self.measured.resize(m * all, 0.0);
        for (c, column) in self.columns.iter().enumerate() {
            for (i, l) in labels.iter().enumerate() {
                let value = &column[*l];
                self.measured[2 * i * all + c] = value.x;
                self.measured[(2 * i + 1) * all + c] = value.y;
            }
        }
        if self.shifts == Shifts::Labels {
            for one in &self.following {
                if let Some(i) = labels.iter().position(|l| *l == one.of) {
                    self.measured[2 * i * all + one.columns[0]] = 1.0;
                    self.measured[(2 * i + 1) * all + one.columns[1]] = 1.0;
                }
            }
        }
        self.update.mean(simd, &mut self.state, rows, &mut self.measured);
        for row in self.measured.chunks_exact(all) {
            self.out.rows.extend_from_slice(&row[..width]);
        }
        for one in &self.following {
            let shift = &mut self.out.shifts[one.of];
            for row in self.measured.chunks_exact(all) {
                let own = [row[one.columns[0]], row[one.columns[1]]];
                for a in 0..2 {
                    for b in 0..2 {
                        shift.own[a][b] += own[a] * own[b];
                    }
                    let with = &mut shift.with[a][..width];
                    for c in 0..width {
                        with[c] += own[a] * row[c];
                    }
                }
            }
        }
        log_variances
    }

    /// Segments that end and begin at a frame.
    #[inline(always)]
    fn change(&mut self, f: usize, frame: &FrameEvents) {
        for s in &frame.ends {
            let slot = self.slots[*s];
            self.state.clear(slot, SLOT);
            self.state.free.push(slot);
        }
        let Self { following, spare, state, .. } = self;
        following.retain(|one| {
            let goes_on = one.until > f;
            if !goes_on {
                spare.extend(one.columns);
                one.columns.iter().for_each(|c| state.means.clear_column(*c));
            }
            goes_on
        });
        for s in &frame.begins {
            let Some(slot) = self.state.free.pop() else { continue };
            self.slots[*s] = slot;
            self.state.n = self.state.n.max(slot + SLOT);
            let segment = &self.geometry.segments[*s];
            self.state.begin(segment, slot, self.sizes.white_px.powi(2) * self.weights.keys[*s]);
            if self.shifts == Shifts::Keys {
                let columns = [0, 1].map(|_| self.another());
                for (a, c) in columns.into_iter().enumerate() {
                    // The filter predicts the shift's effect from here on: a residual of the opposite sign.
                    for i in 0..3 {
                        self.state.means.set(slot + i, c, -segment.by_pixel[(i, a)]);
                    }
                }
                self.following.push(Following { of: *s, columns, until: segment.last_frame + AFTER });
            }
        }
    }

    /// A column of zeros.
    fn another(&mut self) -> usize {
        self.spare.pop().unwrap_or_else(|| {
            let column = self.used;
            self.used += 1;
            if self.used > self.state.means.width() {
                self.state.means.widen();
            }
            column
        })
    }
}

#[cfg(test)]
mod tests;
