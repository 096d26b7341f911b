//! One Kalman pass over the frames that makes residuals independent: what each label adds to those before it.
//!
//! State: the error of the current pose (position, rotation about the world's axes, and velocity of an inertial
//! estimate), its jitter (fresh at each frame), and for each point that is followed the error of its place in the world
//! (made by the pose error, jitter and label noise of its key frame and by its depth) and the walk of its label. All
//! labels of a frame share its pose, all labels of a segment its key frame. Cost: frames times the square of the state.

use super::geometry::Geometry;
use super::noise::Sizes;
use super::scene::Residual;

/// Roll and pitch forget in this time, seconds.
const LEAN_S: f64 = 2.5;
const GRAVITY_M_S2: f64 = 9.81;
/// How well the velocity is known that an integration starts with.
const START_M_S: f64 = 0.005;
/// Numbers of a followed point: its place and the walk of its label.
const SLOT: usize = 5;
const JITTER: usize = 6;

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

struct State {
    n: usize,
    stride: usize,
    p: Vec<f64>,
    /// One vector for each column.
    means: Vec<Vec<f64>>,
    free: Vec<usize>,
}

impl State {
    #[inline(always)]
    fn clear(&mut self, at: usize, count: usize) {
        for i in at..at + count {
            for k in 0..self.stride {
                self.p[i * self.stride + k] = 0.0;
                self.p[k * self.stride + i] = 0.0;
            }
            self.means.iter_mut().for_each(|m| m[i] = 0.0);
        }
    }

    /// `state[to] += times · state[from]`.
    #[inline(always)]
    fn add(&mut self, to: usize, from: usize, times: f64) {
        let s = self.stride;
        for k in 0..self.n {
            self.p[to * s + k] += times * self.p[from * s + k];
        }
        for k in 0..self.n {
            self.p[k * s + to] += times * self.p[k * s + from];
        }
        self.means.iter_mut().for_each(|m| m[to] += times * m[from]);
    }

    #[inline(always)]
    fn scale(&mut self, at: usize, times: f64) {
        let s = self.stride;
        for k in 0..self.n {
            self.p[at * s + k] *= times;
        }
        for k in 0..self.n {
            self.p[k * s + at] *= times;
        }
        self.means.iter_mut().for_each(|m| m[at] *= times);
    }

    #[inline(always)]
    fn widen(&mut self, at: usize, variance: f64) {
        self.p[at * self.stride + at] += variance;
    }
}

/// A label or key label whose shift is being followed.
struct Following {
    of: usize,
    /// Where its two columns stand among the means.
    columns: [usize; 2],
    until: usize,
}

/// Makes columns independent: `columns[0]` the residuals, then derivatives. With `shifts`, also what a shift of each
/// key label would do.
pub(super) fn whiten(
    geometry: &Geometry,
    columns: &[&[Residual]],
    sizes: &Sizes,
    weights: &Weights,
    jumps: &[Jump],
    shifts: Shifts,
) -> Whitened {
    // The same sums in the same order, with the widest registers that there are.
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || pass(geometry, columns, sizes, weights, jumps, shifts),
    )
}

/// `to += times · from`.
#[inline(always)]
fn add_times(to: &mut [f64], times: f64, from: &[f64]) {
    let n = to.len().min(from.len());
    let (to, from) = (&mut to[..n], &from[..n]);
    for i in 0..n {
        to[i] += times * from[i];
    }
}

#[inline(always)]
fn pass(
    geometry: &Geometry,
    columns: &[&[Residual]],
    sizes: &Sizes,
    weights: &Weights,
    jumps: &[Jump],
    shifts: Shifts,
) -> Whitened {
    /// A shift is followed for so many frames after its segment, or its label.
    const AFTER: usize = 30;
    const AFTER_LABEL: usize = 12;
    let width = columns.len();
    let pose = if geometry.inertial { 9 } else { 6 };
    let first_slot = pose + JITTER;
    let most = geometry.most_followed;
    let stride = (first_slot + SLOT * most).next_multiple_of(8);
    let mut state = State {
        n: first_slot,
        stride,
        p: vec![0.0; stride * stride],
        means: vec![vec![0.0; stride]; width],
        free: (0..most).rev().map(|i| first_slot + SLOT * i).collect(),
    };
    let mut slots = vec![usize::MAX; geometry.segments.len()];
    let mut out = Whitened { width, ..Whitened::default() };
    let followed = match shifts {
        Shifts::Nobodys => 0,
        Shifts::Keys => geometry.segments.len(),
        Shifts::Labels => geometry.labels.len(),
    };
    out.shifts = vec![Shift { own: [[0.0; 2]; 2], with: [vec![0.0; width], vec![0.0; width]] }; followed];
    let mut following: Vec<Following> = Vec::new();
    let mut spare: Vec<usize> = Vec::new();
    let (mut ph, mut gain) = (vec![0.0; stride], vec![0.0; stride]);
    let mut lean = sizes.lean_rad * sizes.lean_rad;
    for i in 3..5 {
        state.widen(i, lean);
    }
    if geometry.own_anchor {
        state.widen(2, (2.0 * sizes.position_m).powi(2));
    }
    if geometry.inertial {
        for i in 6..9 {
            state.widen(i, START_M_S * START_M_S);
        }
        lean = 0.0;
    }
    for (f, frame) in geometry.frames.iter().enumerate() {
        if f > 0 {
            let dt = frame.dt_s;
            if geometry.inertial {
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
                    state.widen(i, lean * (1.0 - keep * keep));
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
                    state.widen(slots[*s] + i, sizes.walk_px.powi(2) * dt);
                }
            }
        }
        state.clear(pose, JITTER);
        for i in 0..3 {
            state.widen(pose + i, sizes.jitter_m.powi(2));
            state.widen(pose + 3 + i, sizes.jitter_rad.powi(2));
        }
        out.frame_rows.push(out.rows.len() / width);
        let mut log_variance = 0.0;
        for l in &frame.labels {
            let label = &geometry.labels[*l];
            let slot = slots[label.segment];
            let variance = sizes.white_px.powi(2) * weights.labels[*l];
            let mut shifted = [usize::MAX; 2];
            if shifts == Shifts::Labels {
                shifted = [0, 1].map(|_| another(&mut spare, &mut state.means, stride));
                following.push(Following { of: *l, columns: shifted, until: f + AFTER_LABEL });
            }
            for axis in 0..2 {
                let (h, turn) = (&label.by_place[axis], &label.by_turn[axis]);
                let mut terms = [(0, 0.0); 16];
                for i in 0..3 {
                    terms[i] = (i, -h[i]);
                    terms[3 + i] = (3 + i, turn[i]);
                    terms[6 + i] = (pose + i, -h[i]);
                    terms[9 + i] = (pose + 3 + i, turn[i]);
                    terms[12 + i] = (slot + i, h[i]);
                }
                terms[15] = (slot + 3 + axis, 1.0);
                let n = state.n;
                ph[..n].fill(0.0);
                for (i, times) in terms {
                    add_times(&mut ph[..n], times, &state.p[i * stride..i * stride + n]);
                }
                let mut s = variance;
                for (i, times) in terms {
                    s += times * ph[i];
                }
                log_variance += s.ln();
                let inverse = 1.0 / s;
                for k in 0..n {
                    gain[k] = ph[k] * inverse;
                }
                for k in 0..n {
                    add_times(&mut state.p[k * stride..k * stride + n], -gain[k], &ph[..n]);
                }
                let root = inverse.sqrt();
                let first = out.rows.len();
                for (c, mean) in state.means.iter_mut().enumerate() {
                    let mut predicted = 0.0;
                    for (i, times) in terms {
                        predicted += times * mean[i];
                    }
                    let measured = match c {
                        c if c < width => columns[c][*l][axis],
                        c if c == shifted[axis] => 1.0,
                        _ => 0.0,
                    };
                    let innovation = measured - predicted;
                    if c < width {
                        out.rows.push(innovation * root);
                    } else if innovation == 0.0 {
                        continue;
                    }
                    add_times(&mut mean[..n], innovation, &gain[..n]);
                    // What is left of the shift's prediction is its own row, with the sign of the residuals.
                    if c >= width {
                        mean[stride] = innovation * root;
                    }
                }
                for one in &following {
                    let own = one.columns.map(|c| state.means[c][stride]);
                    let shift = &mut out.shifts[one.of];
                    for a in 0..2 {
                        for b in 0..2 {
                            shift.own[a][b] += own[a] * own[b];
                        }
                        for (c, sum) in shift.with[a].iter_mut().enumerate() {
                            *sum += own[a] * out.rows[first + c];
                        }
                        state.means[one.columns[a]][stride] = 0.0;
                    }
                }
            }
        }
        out.log_variances.push(log_variance);
        for s in &frame.ends {
            let slot = slots[*s];
            state.clear(slot, SLOT);
            state.free.push(slot);
        }
        following.retain(|one| {
            let goes_on = one.until > f;
            if !goes_on {
                spare.extend(one.columns);
                for c in one.columns {
                    state.means[c].fill(0.0);
                }
            }
            goes_on
        });
        for s in &frame.begins {
            let Some(slot) = state.free.pop() else { continue };
            slots[*s] = slot;
            state.n = state.n.max(slot + SLOT);
            begin(&mut state, geometry, *s, slot, pose, sizes, weights);
            if shifts == Shifts::Keys {
                let mut columns = [0; 2];
                for (a, column) in columns.iter_mut().enumerate() {
                    let c = another(&mut spare, &mut state.means, stride);
                    // The filter predicts the shift's effect from here on: a residual of the opposite sign.
                    for i in 0..3 {
                        state.means[c][slot + i] = -geometry.segments[*s].by_pixel[(i, a)];
                    }
                    *column = c;
                }
                let until = geometry.segments[*s].last_frame + AFTER;
                following.push(Following { of: *s, columns, until });
            }
        }
    }
    out.frame_rows.push(out.rows.len() / width);
    out
}

/// A column of zeros, one more than the state is long: the last number is for its row.
fn another(spare: &mut Vec<usize>, means: &mut Vec<Vec<f64>>, stride: usize) -> usize {
    spare.pop().unwrap_or_else(|| {
        means.push(vec![0.0; stride + 1]);
        means.len() - 1
    })
}

/// A key frame: the error of the point's place, from that of the pose, the label and the depth.
fn begin(
    state: &mut State,
    geometry: &Geometry,
    segment: usize,
    slot: usize,
    pose: usize,
    sizes: &Sizes,
    weights: &Weights,
) {
    let one = &geometry.segments[segment];
    let (s, n) = (state.stride, state.n);
    for i in 0..3 {
        for m in 0..6 {
            let times = one.by_pose[(i, m)];
            for k in 0..n {
                let sum = state.p[m * s + k] + state.p[(pose + m) * s + k];
                state.p[(slot + i) * s + k] += times * sum;
            }
        }
    }
    // By now the rows of the slot hold the covariance with all others; the block of the slot itself comes from them.
    let mut block = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            block[i][j] = (0..6)
                .map(|m| {
                    one.by_pose[(j, m)] * (state.p[(slot + i) * s + m] + state.p[(slot + i) * s + pose + m])
                })
                .sum();
        }
    }
    let variance = sizes.white_px.powi(2) * weights.keys[segment];
    for i in 0..3 {
        for j in 0..3 {
            let label: f64 = (0..2).map(|a| one.by_pixel[(i, a)] * one.by_pixel[(j, a)]).sum();
            block[i][j] += variance * label + one.depth_variance[(i, j)];
        }
    }
    for i in 0..3 {
        for k in 0..n {
            state.p[k * s + slot + i] = state.p[(slot + i) * s + k];
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            state.p[(slot + i) * s + slot + j] = block[i][j];
        }
    }
    for mean in &mut state.means {
        for i in 0..3 {
            mean[slot + i] = (0..6).map(|m| one.by_pose[(i, m)] * (mean[m] + mean[pose + m])).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3};

    use super::super::geometry::{FrameEvents, LabelAnswer, SegmentAnswer};
    use super::*;
    use crate::random::SplitMix;

    fn uniform(random: &mut SplitMix) -> f64 {
        (random.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Three segments over eight frames, two of one point after another.
    fn scene(random: &mut SplitMix, inertial: bool, own_anchor: bool) -> Geometry {
        let spans = [(0, 4), (0, 7), (4, 7)];
        let mut frames = vec![FrameEvents::default(); 8];
        let mut labels = Vec::new();
        for (f, frame) in frames.iter_mut().enumerate() {
            frame.dt_s = if f == 0 { 0.0 } else { 0.1 + 0.02 * f as f64 };
            frame.step = Vector3::from_fn(|_, _| 0.2 * uniform(random));
            for (s, (from, to)) in spans.iter().enumerate() {
                if f > *from && f <= *to {
                    frame.labels.push(labels.len());
                    frame.followed.push(s);
                    let mut vector = |size: f64| Vector3::from_fn(|_, _| size * uniform(random));
                    labels.push(LabelAnswer {
                        segment: s,
                        by_place: [vector(100.0), vector(100.0)],
                        by_turn: [vector(300.0), vector(300.0)],
                    });
                }
                if f == *from {
                    frame.begins.push(s);
                }
                if f == *to {
                    frame.ends.push(s);
                }
            }
        }
        let segments = spans
            .iter()
            .map(|(_, to)| {
                let along = Vector3::from_fn(|_, _| 0.02 * uniform(random));
                SegmentAnswer {
                    by_pose: SMatrix::from_fn(|_, _| uniform(random)),
                    by_pixel: SMatrix::from_fn(|_, _| 0.01 * uniform(random)),
                    depth_variance: along * along.transpose(),
                    last_frame: *to,
                }
            })
            .collect();
        Geometry { labels, segments, frames, most_followed: 4, own_anchor, inertial }
    }

    fn sizes(inertial: bool) -> Sizes {
        let with = |value: f64| if inertial { value } else { 0.0 };
        let without = |value: f64| if inertial { 0.0 } else { value };
        Sizes {
            white_px: 0.6,
            walk_px: 0.3,
            position_m: 0.005,
            yaw_rad: 0.002,
            lean_rad: without(0.003),
            jitter_m: 0.001,
            jitter_rad: 0.0005,
            accel: with(0.05),
            gyro: with(0.002),
        }
    }

    /// The covariance of all residuals, source by source: what each independent number of noise does to every label.
    fn covariance(geometry: &Geometry, sizes: &Sizes, weights: &Weights) -> DMatrix<f64> {
        let n = 2 * geometry.labels.len();
        let mut sum = DMatrix::zeros(n, n);
        let pose = if geometry.inertial { 9 } else { 6 };
        // An effect: pushes on the pose at each frame, on the jitter at each, on the places of key points.
        let effect = |push: &dyn Fn(usize) -> Vec<f64>, jitter: &dyn Fn(usize) -> Vec<f64>| -> DVector<f64> {
            let mut state = vec![0.0; pose];
            let mut places = vec![Vector3::zeros(); geometry.segments.len()];
            let mut out = DVector::zeros(n);
            for (f, frame) in geometry.frames.iter().enumerate() {
                let dt = frame.dt_s;
                if f > 0 && geometry.inertial {
                    for i in 0..3 {
                        state[i] += dt * state[6 + i];
                    }
                    state[6] += GRAVITY_M_S2 * dt * state[4];
                    state[7] -= GRAVITY_M_S2 * dt * state[3];
                } else if f > 0 {
                    state[0] -= frame.step.y * state[5];
                    state[1] += frame.step.x * state[5];
                    for i in 3..5 {
                        state[i] *= (-dt / LEAN_S).exp();
                    }
                }
                state.iter_mut().zip(push(f)).for_each(|(s, p)| *s += p);
                let jitter = jitter(f);
                let all: Vec<f64> = (0..6).map(|i| state[i] + jitter[i]).collect();
                let (moved, turned) =
                    (Vector3::from_column_slice(&all[..3]), Vector3::from_column_slice(&all[3..6]));
                for l in &frame.labels {
                    let label = &geometry.labels[*l];
                    for axis in 0..2 {
                        out[2 * l + axis] = label.by_place[axis].dot(&(places[label.segment] - moved))
                            + label.by_turn[axis].dot(&turned);
                    }
                }
                for s in &frame.begins {
                    places[*s] = geometry.segments[*s].by_pose * nalgebra::Vector6::from_column_slice(&all);
                }
            }
            out
        };
        let nothing = |_: usize| vec![0.0; 9];
        let one = |at: usize, i: usize, size: f64| {
            move |f: usize| {
                let mut v = vec![0.0; 9];
                if f == at {
                    v[i] = size;
                }
                v
            }
        };
        let mut add = |e: DVector<f64>| sum += &e * e.transpose();
        for (f, frame) in geometry.frames.iter().enumerate() {
            let dt = frame.dt_s;
            for i in 0..pose {
                let variance = match (i, f, geometry.inertial) {
                    (3 | 4, 0, false) => sizes.lean_rad.powi(2),
                    (2, 0, _) if geometry.own_anchor => (2.0 * sizes.position_m).powi(2),
                    (6..9, 0, _) => START_M_S * START_M_S,
                    (_, 0, _) => 0.0,
                    (0..3, _, _) => sizes.position_m.powi(2) * dt + sizes.accel.powi(2) * dt.powi(3) / 3.0,
                    (3 | 4, _, false) => sizes.lean_rad.powi(2) * (1.0 - (-2.0 * dt / LEAN_S).exp()),
                    (5, _, false) => sizes.yaw_rad.powi(2) * dt,
                    (3..6, _, _) => sizes.gyro.powi(2) * dt,
                    _ => sizes.accel.powi(2) * dt,
                };
                add(effect(&one(f, i, variance.sqrt()), &nothing));
            }
            for i in 0..6 {
                let size = if i < 3 { sizes.jitter_m } else { sizes.jitter_rad };
                add(effect(&nothing, &one(f, i, size)));
            }
        }
        // Key labels, depth, walks and labels.
        for (s, segment) in geometry.segments.iter().enumerate() {
            let of = |place: Vector3<f64>| {
                DVector::from_fn(n, |row, _| {
                    let label = &geometry.labels[row / 2];
                    if label.segment == s { label.by_place[row % 2].dot(&place) } else { 0.0 }
                })
            };
            let key = (sizes.white_px.powi(2) * weights.keys[s]).sqrt();
            for a in 0..2 {
                add(of(segment.by_pixel.column(a) * key));
            }
            let along: Matrix3<f64> = segment.depth_variance;
            let eigen = along.symmetric_eigen();
            for i in 0..3 {
                add(of(eigen.eigenvectors.column(i) * eigen.eigenvalues[i].max(0.0).sqrt()));
            }
            let at = |l: usize| geometry.frames.iter().position(|f| f.labels.contains(&l)).unwrap();
            for f in 1..geometry.frames.len() {
                if !geometry.frames[f].followed.contains(&s) {
                    continue;
                }
                for axis in 0..2 {
                    add(DVector::from_fn(n, |row, _| {
                        let is = geometry.labels[row / 2].segment == s && row % 2 == axis && at(row / 2) >= f;
                        if is { sizes.walk_px * geometry.frames[f].dt_s.sqrt() } else { 0.0 }
                    }));
                }
            }
        }
        for l in 0..geometry.labels.len() {
            for axis in 0..2 {
                sum[(2 * l + axis, 2 * l + axis)] += sizes.white_px.powi(2) * weights.labels[l];
            }
        }
        sum
    }

    #[test]
    fn the_pass_is_the_full_covariance() {
        let mut random = SplitMix(11);
        for (inertial, own_anchor) in [(false, false), (false, true), (true, false)] {
            let geometry = scene(&mut random, inertial, own_anchor);
            let n = geometry.labels.len();
            let mut weights = Weights { labels: vec![1.0; n], keys: vec![1.0; 3] };
            (weights.labels[2], weights.keys[1]) = (50.0, 30.0);
            let sizes = sizes(inertial);
            let columns: Vec<Vec<Residual>> = (0..3)
                .map(|_| (0..n).map(|_| Residual::new(uniform(&mut random), uniform(&mut random))).collect())
                .collect();
            let slices: Vec<&[Residual]> = columns.iter().map(Vec::as_slice).collect();
            let out = whiten(&geometry, &slices, &sizes, &weights, &[], Shifts::Nobodys);
            let full = covariance(&geometry, &sizes, &weights).cholesky().unwrap();
            let stacked = |c: usize| DVector::from_fn(2 * n, |row, _| columns[c][row / 2][row % 2]);
            for a in 0..3 {
                for b in 0..3 {
                    let dense = stacked(a).dot(&full.solve(&stacked(b)));
                    let passed: f64 = out.rows.chunks_exact(3).map(|row| row[a] * row[b]).sum();
                    assert!((dense - passed).abs() < 1e-8 * dense.abs().max(1.0), "{dense} {passed}");
                }
            }
            let dense: f64 = full.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
            let passed: f64 = out.log_variances.iter().sum();
            assert!((dense - passed).abs() < 1e-8 * dense.abs(), "{dense} {passed}");

            // A shift of a key label or of a label is a column like any other.
            for shifts in [Shifts::Keys, Shifts::Labels] {
                let out = whiten(&geometry, &slices, &sizes, &weights, &[], shifts);
                for (i, shift) in out.shifts.iter().enumerate() {
                    for axis in 0..2 {
                        let effect = DVector::from_fn(2 * n, |row, _| {
                            let label = &geometry.labels[row / 2];
                            match shifts {
                                Shifts::Keys if label.segment == i => label.by_place[row % 2]
                                    .dot(&geometry.segments[i].by_pixel.column(axis).into_owned()),
                                Shifts::Labels if row == 2 * i + axis => 1.0,
                                _ => 0.0,
                            }
                        });
                        let solved = full.solve(&effect);
                        let own = effect.dot(&solved);
                        assert!((own - shift.own[axis][axis]).abs() < 1e-8 * own.max(1.0));
                        for c in 0..3 {
                            let with = stacked(c).dot(&solved);
                            assert!((with - shift.with[axis][c]).abs() < 1e-8 * own.max(1.0), "{shifts:?}");
                        }
                    }
                }
            }
        }
    }
}
