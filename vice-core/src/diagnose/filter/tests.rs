//! The pass against the full covariance, source by source.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, Vector3};

use super::super::geometry::{FrameEvents, LabelAnswer, SegmentAnswer};
use super::*;
use crate::random::SplitMix;

fn uniform(random: &mut SplitMix) -> f64 {
    (random.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
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
    let mut random = SplitMix::new(11);
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
