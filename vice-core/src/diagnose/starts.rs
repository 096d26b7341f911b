//! Where fits begin: a wrong clock is a valley of its own, so that many values are looked at first. No grid is left in
//! the answer: it only says where Gauss-Newton starts.

use super::fit::Work;
use super::flaw::Flaw;
use super::scene::Residual;
use super::theta::Theta;

/// Errors beyond this count less and less, pixels.
const ROBUST_PX: f64 = 3.0;

/// Factors of which one logarithm is taken, and products that are made side by side.
const FACTORS: usize = 8;
const SIDE_BY_SIDE: usize = 8;

/// Mean of `log(1 + |r|² / (3 px)²)`.
pub(super) fn robust_cost(residuals: &[Residual]) -> f64 {
    let of_some = |some: &[Residual]| -> f64 {
        // 1 + p times 1 + x is 1 + (p + x + p x), which keeps what is far below one.
        let mut products = [0.0; SIDE_BY_SIDE];
        for side_by_side in some.chunks(SIDE_BY_SIDE) {
            for (p, r) in products.iter_mut().zip(side_by_side) {
                let x = r.norm_squared() / (ROBUST_PX * ROBUST_PX);
                *p += x + *p * x;
            }
        }
        products.into_iter().map(f64::ln_1p).sum()
    };
    let sum: f64 = residuals.chunks(FACTORS * SIDE_BY_SIDE).map(of_some).sum();
    sum / residuals.len().max(1) as f64
}

/// Offsets that are looked at, seconds, both ways.
const OFFSETS_S: [f64; 14] =
    [0.005, 0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.13, 0.18, 0.25, 0.35, 0.5, 0.8, 1.2];
const RATES: [f64; 9] = [5e-4, 2e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5];
const STEPS_S: [f64; 4] = [0.03, 0.08, 0.15, 0.4];
const STEP_TIMES: usize = 12;
/// Shares of the span next to its ends in which no step is looked for.
const EDGE: f64 = 0.1;
const SINKS_M_S: [f64; 5] = [0.01, 0.03, 0.06, 0.12, 0.25];

/// The best start of a flaw beside other values; those values where nothing is better.
pub(super) fn start(work: &Work<'_, '_>, flaw: Flaw, beside: &Theta) -> Theta {
    let cost = |theta: &Theta| work.residuals(theta).map_or(f64::INFINITY, |r| robust_cost(&r));
    let mut best = (cost(beside), *beside);
    let try_it = |theta: Theta, best: &mut (f64, Theta)| {
        let cost = cost(&theta);
        if cost < best.0 {
            *best = (cost, theta);
        }
    };
    let both = |sizes: &[f64]| -> Vec<f64> { sizes.iter().flat_map(|s| [*s, -*s]).collect() };
    match flaw {
        Flaw::ClockOffset | Flaw::ClockRate => {
            let sizes = if flaw == Flaw::ClockOffset { both(&OFFSETS_S) } else { both(&RATES) };
            let index = flaw.parameters().start;
            for size in sizes {
                let mut theta = *beside;
                theta[index] += size;
                try_it(theta, &mut best);
            }
            // Between the neighbours of the best one.
            for share in [0.8, 0.9, 1.1, 1.25] {
                let mut theta = best.1;
                theta[index] = beside[index] + share * (best.1[index] - beside[index]);
                try_it(theta, &mut best);
            }
        }
        Flaw::ClockStep => {
            let (first, last) = span(work);
            for i in 1..=STEP_TIMES {
                let at = first
                    + (last - first) * (EDGE + (1.0 - 2.0 * EDGE) * (i as f64) / (STEP_TIMES + 1) as f64);
                for size in both(&STEPS_S) {
                    try_it(beside.with(Flaw::ClockStep, &[size, at]), &mut best);
                }
            }
            if best.1 == *beside {
                let middle = 0.5 * (first + last);
                return beside.with(Flaw::ClockStep, &[0.0, middle]);
            }
            let mut width = (last - first) / (STEP_TIMES + 1) as f64;
            while width > 0.04 {
                width *= 0.5;
                for sign in [-1.0, 1.0] {
                    let [size, at] = [best.1.of(flaw)[0], best.1.of(flaw)[1]];
                    // A step before all labels is an offset.
                    let inside =
                        |at: f64| at.clamp(first + EDGE * (last - first), last - EDGE * (last - first));
                    try_it(beside.with(flaw, &[size, inside(at + sign * width)]), &mut best);
                    try_it(beside.with(flaw, &[size * (1.0 + 0.2 * sign), at]), &mut best);
                }
            }
        }
        Flaw::Drift if work.scene.own_anchor => {
            let up = flaw.parameters().start + 2;
            for size in both(&SINKS_M_S) {
                let mut theta = *beside;
                theta[up] += size;
                try_it(theta, &mut best);
            }
        }
        _ => {}
    }
    best.1
}

/// First and last frame, seconds.
pub(super) fn span(work: &Work<'_, '_>) -> (f64, f64) {
    let frames = &work.scene.frames;
    (frames.first().map_or(0.0, |f| f.t_s), frames.last().map_or(0.0, |f| f.t_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn logarithms_of_products_are_sums_of_logarithms(lengths in prop::collection::vec(-9.0..6.0_f64, 0..300)) {
            let residuals: Vec<Residual> = lengths.iter().map(|l| Residual::new(10_f64.powf(*l), 0.5)).collect();
            let one = |r: &Residual| (r.norm_squared() / (ROBUST_PX * ROBUST_PX)).ln_1p();
            let expected = residuals.iter().map(one).sum::<f64>() / residuals.len().max(1) as f64;
            prop_assert!((robust_cost(&residuals) - expected).abs() <= 1e-13 * expected);
        }
    }

    #[test]
    fn tiny_and_huge_residuals_cost_what_they_should() {
        let of = |px: f64| robust_cost(&[Residual::new(px, 0.0); 64]);
        assert!((of(1e-9) / (1e-18 / 9.0) - 1.0).abs() < 1e-12);
        assert!((of(1e12) / (24.0 * 10_f64.ln() - 9_f64.ln()) - 1.0).abs() < 1e-12);
    }
}
