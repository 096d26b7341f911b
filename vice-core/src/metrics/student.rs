//! Student's t: how many standard deviations hold 95 % where the deviation itself is only estimated.

/// The 97.5 % quantile of Student's t with `degrees` of freedom, which need not be whole; above 1e6 that of the normal
/// distribution to six digits. `None` where `degrees` is not above zero or no number.
///
/// P(|T| > t) is the regularised incomplete beta function I_x(degrees / 2, 1 / 2) at x = degrees / (degrees + t²)
/// (Abramowitz and Stegun 26.7.1); it falls with t, so that halving an interval finds it.
pub fn quantile_975(degrees: f64) -> Option<f64> {
    if degrees.is_nan() || degrees <= 0.0 {
        return None;
    }
    let degrees = degrees.min(1e7);
    let outside = |t: f64| incomplete_beta(0.5 * degrees, degrees / (degrees + t * t));
    let (mut low, mut high) = (1.0, 2.0);
    while outside(high) > 0.05 {
        (low, high) = (high, 2.0 * high);
        if high > 1e300 {
            return None;
        }
    }
    for _ in 0..200 {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if outside(middle) > 0.05 { low = middle } else { high = middle }
    }
    Some(f64::midpoint(low, high))
}

/// I_x(a, 1/2) by its continued fraction (Numerical Recipes, 6.4), taken on the side where that converges fast.
fn incomplete_beta(a: f64, x: f64) -> f64 {
    let b = 0.5;
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    let front = (a * x.ln() + b * (-x).ln_1p() - ln_beta_half(a)).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * continued_fraction(a, b, x) / a
    } else {
        1.0 - front * continued_fraction(b, a, 1.0 - x) / b
    }
}

/// ln B(a, 1/2).
fn ln_beta_half(a: f64) -> f64 {
    // ln Γ(1/2) is half of ln π.
    0.5 * std::f64::consts::PI.ln() - ln_gamma_step(a)
}

/// ln Γ(a + 1/2) - ln Γ(a): by Stirling's series, after both are moved to where it is exact to rounding.
fn ln_gamma_step(a: f64) -> f64 {
    let (mut a, mut moved) = (a, 0.0);
    while a < 20.0 {
        moved += (a / (a + 0.5)).ln();
        a += 1.0;
    }
    // The differences of Stirling's terms, each without the cancellation of the whole.
    let series = |z: f64| {
        let s = 1.0 / (z * z);
        (1.0 / 12.0 - s * (1.0 / 360.0 - s * (1.0 / 1260.0 - s / 1680.0))) / z
    };
    let b = a + 0.5;
    a * (0.5 / a).ln_1p() + 0.5 * a.ln() - 0.5 + series(b) - series(a) + moved
}

fn continued_fraction(a: f64, b: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let away_from_zero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    for m in 1..100_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / away_from_zero(1.0 + even * d);
        c = away_from_zero(1.0 + even / c);
        value *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / away_from_zero(1.0 + odd * d);
        c = away_from_zero(1.0 + odd / c);
        let step = d * c;
        value *= step;
        if (step - 1.0).abs() < 1e-16 {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn quantiles_are_those_of_scipy() {
        // scipy.stats.t.ppf(0.975, nu)
        for (degrees, expected) in QUANTILES {
            assert_relative_eq!(quantile_975(degrees).unwrap(), expected, max_relative = 1e-10);
        }
        assert_eq!([quantile_975(0.0), quantile_975(-1.0), quantile_975(f64::NAN)], [None; 3]);
        assert!((quantile_975(f64::INFINITY).unwrap() - 1.959964).abs() < 1e-5);
    }

    const QUANTILES: [(f64, f64); 11] = [
        (1.0, 12.706204736174694),
        (2.0, 4.302652729749462),
        (2.5, 3.5746548420036817),
        (3.3, 3.024874461840807),
        (4.0, 2.7764451051977934),
        (7.25, 2.348194849105371),
        (11.0, 2.200985160091639),
        (19.9, 2.086635638404131),
        (59.0, 2.000995378088267),
        (250.5, 1.969479272051676),
        (100000.0, 1.9599877075346095),
    ];
}
