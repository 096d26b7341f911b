//! Real roots of small polynomials, to find where a distortion folds back.

/// `c[0] + c[1] s + c[2] s² + ...`
pub(crate) fn evaluate(coefficients: &[f64], s: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * s + c)
}

/// Product of two polynomials.
pub(crate) fn multiply(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            product[i + j] += x * y;
        }
    }
    product
}

/// The derivative.
pub(crate) fn derivative(coefficients: &[f64]) -> Vec<f64> {
    coefficients.iter().enumerate().skip(1).map(|(i, c)| i as f64 * c).collect()
}

/// The smallest `s > 0` at which the polynomial changes its sign.
pub(crate) fn first_sign_change(coefficients: &[f64]) -> Option<f64> {
    sign_changes(coefficients).into_iter().find(|s| *s > 0.0)
}

/// All sign changes at `s >= 0`, ascending: between two neighbouring extrema there is at most one, so the roots of
/// the derivative bracket them.
fn sign_changes(coefficients: &[f64]) -> Vec<f64> {
    let degree = match coefficients.iter().rposition(|c| *c != 0.0) {
        Some(degree) if degree > 0 => degree,
        _ => return vec![],
    };
    let c = &coefficients[..=degree];
    // Cauchy's bound: no root lies beyond it.
    let bound = 1.0 + c[..degree].iter().fold(0.0_f64, |m, x| m.max((x / c[degree]).abs()));
    if !bound.is_finite() {
        return vec![];
    }
    let mut edges = vec![0.0];
    edges.extend(sign_changes(&derivative(c)).into_iter().filter(|s| *s > 0.0 && *s < bound));
    edges.push(bound);
    edges.windows(2).filter_map(|w| bisect(c, w[0], w[1])).collect()
}

fn bisect(c: &[f64], mut lo: f64, mut hi: f64) -> Option<f64> {
    let negative_at_lo = evaluate(c, lo) < 0.0;
    if negative_at_lo == (evaluate(c, hi) < 0.0) {
        return None;
    }
    loop {
        let mid = 0.5 * (lo + hi);
        if mid <= lo || mid >= hi {
            return Some(lo);
        }
        if (evaluate(c, mid) < 0.0) == negative_at_lo { lo = mid } else { hi = mid }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn roots_of_known_polynomials() {
        // (s - 1)(s - 2)(s - 3)
        let c = multiply(&multiply(&[-1.0, 1.0], &[-2.0, 1.0]), &[-3.0, 1.0]);
        let found = sign_changes(&c);
        assert_eq!(found.len(), 3);
        for (root, expected) in found.iter().zip([1.0, 2.0, 3.0]) {
            assert_relative_eq!(*root, expected, max_relative = 1e-12);
        }
        assert_eq!(first_sign_change(&[1.0, 0.0, 1.0]), None);
        assert_eq!(first_sign_change(&[1.0]), None);
        assert_eq!(first_sign_change(&[]), None);
        // Touches zero without changing its sign: the distortion goes on growing.
        assert_eq!(first_sign_change(&[1.0, -2.0, 1.0]), None);
        assert_relative_eq!(first_sign_change(&[1.0, -0.5, 0.0]).unwrap(), 2.0, max_relative = 1e-12);
    }
}
