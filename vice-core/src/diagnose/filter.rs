//! One Kalman pass over the frames that makes residuals independent: what each label adds to those before it.
//!
//! State: the error of the current pose (position, rotation about the world's axes, and velocity of an inertial
//! estimate), its jitter (fresh at each frame), and for each point that is followed the error of its place in the world
//! (made by the pose error, jitter and label noise of its key frame and by its depth) and the walk of its label. All
//! labels of a frame share its pose, all labels of a segment its key frame. Cost: frames times the square of the state.

#![expect(clippy::needless_range_loop, reason = "indices of matrices are clearer as indices")]

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
mod tests;
