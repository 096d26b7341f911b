//! The alphabet of the textures: edges, lines, dots and noise that know how wide a pixel is.
//!
//! Each takes the width of a pixel on the surface (`w`, metres) and answers with its mean over about that width, so
//! that a pattern finer than a pixel fades to its average instead of flickering.

use crate::hash::{hash, unit};

/// A point on a surface, with the width of a pixel there along both coordinates, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    pub(crate) s: f64,
    pub(crate) t: f64,
    pub(crate) ws: f64,
    pub(crate) wt: f64,
}

impl Spot {
    /// The width for patterns that do not run along a coordinate.
    pub(crate) fn width(&self) -> f64 {
        (self.ws * self.wt).sqrt().max(0.5 * self.ws.max(self.wt))
    }

    /// The same spot with its origin moved.
    pub(crate) fn moved(&self, s: f64, t: f64) -> Self {
        Self { s: self.s - s, t: self.t - t, ..*self }
    }

    /// The same spot with coordinates exchanged.
    pub(crate) fn turned(&self) -> Self {
        Self { s: self.t, t: self.s, ws: self.wt, wt: self.ws }
    }
}

/// 0 left of `edge`, 1 right of it, blurred over `w`.
pub(crate) fn step(x: f64, edge: f64, w: f64) -> f64 {
    ((x - edge) / w + 0.5).clamp(0.0, 1.0)
}

/// 1 between `low` and `high`, blurred over `w`.
pub(crate) fn band(x: f64, low: f64, high: f64, w: f64) -> f64 {
    (step(x, low, w) - step(x, high, w)).max(0.0)
}

/// 1 inside the rectangle.
pub(crate) fn rectangle(at: &Spot, s: [f64; 2], t: [f64; 2]) -> f64 {
    band(at.s, s[0], s[1], at.ws) * band(at.t, t[0], t[1], at.wt)
}

/// How much of a pattern of that period a pixel still resolves: 1 well below it, 0 from about half of it on.
pub(crate) fn resolved(period: f64, w: f64) -> f64 {
    let x = ((0.6 - w / period) / 0.35).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Lines of width `line` around multiples of `period`: 1 on a line.
pub(crate) fn lines(x: f64, period: f64, line: f64, w: f64) -> f64 {
    let from_line = (x / period - (x / period).round()).abs() * period;
    let sharp = step(line / 2.0, from_line, w) * (line / w).min(1.0);
    let keep = resolved(period, w);
    sharp * keep + line / period * (1.0 - keep)
}

/// 1 inside a shape, from the signed distance to its outline (negative inside).
pub(crate) fn inside(distance: f64, w: f64) -> f64 {
    step(0.0, distance, w)
}

/// Squares of side `side` in turns: 1 and 0.
pub(crate) fn checker(at: &Spot, side: f64) -> f64 {
    let wave = |x: f64, w: f64| {
        let phase = x / side;
        // Triangle wave through 0 at the edges, clipped to the pixel's width: a box-filtered square wave.
        let to_edge = (phase - phase.round()) * side;
        let sign = if (phase.round() as i64).rem_euclid(2) == 0 { 1.0 } else { -1.0 };
        (sign * (to_edge / w * 2.0)).clamp(-1.0, 1.0) * resolved(2.0 * side, w)
    };
    0.5 + 0.5 * wave(at.s, at.ws) * wave(at.t, at.wt)
}

/// The cell of a lattice: the largest whole number not above `x`. A processor without SSE 4.1 has no instruction for
/// `floor`, and this is the innermost loop of the renderer.
fn cell(x: f64) -> i32 {
    let whole = x as i32;
    whole.wrapping_sub(i32::from(x < f64::from(whole)))
}

/// Smooth noise of one scale, -1 to 1.
fn noise_octave(s: f64, t: f64, seed: u32) -> f64 {
    let (x, y) = (cell(s), cell(t));
    let (fs, ft) = (s - f64::from(x), t - f64::from(y));
    let value =
        |dx: i32, dy: i32| f64::from(hash(x.wrapping_add(dx), y.wrapping_add(dy), seed)) / 2147483648.0;
    let fade = |f: f64| f * f * (3.0 - 2.0 * f);
    let (fs, ft) = (fade(fs), fade(ft));
    let below = value(0, 0) * (1.0 - fs) + value(1, 0) * fs;
    let above = value(0, 1) * (1.0 - fs) + value(1, 1) * fs;
    below * (1.0 - ft) + above * ft - 1.0
}

/// Noise of several scales; each `(cell, amplitude)` in metres and albedo.
pub(crate) fn noise(at: &Spot, scales: &[(f64, f64)], seed: u32) -> f64 {
    let w = at.width();
    let mut sum = 0.0;
    for (i, (cell, amplitude)) in (0_u32..).zip(scales) {
        let keep = resolved(2.0 * cell, w);
        if keep > 0.0 {
            sum += amplitude * keep * noise_octave(at.s / cell, at.t / cell, seed.wrapping_add(i * 7919));
        }
    }
    sum
}

/// Small discs and turned squares, at most one a cell: corners that a tracker likes. Added to an albedo.
pub(crate) fn speckles(at: &Spot, pitch: f64, density: f64, amplitude: f64, seed: u32) -> f64 {
    let w = at.width();
    let (x, y) = (cell(at.s / pitch), cell(at.t / pitch));
    let h = hash(x, y, seed);
    let g = hash(x, y, seed ^ 0x5bd1_e995);
    let keep = resolved(0.5 * pitch, w);
    if keep == 0.0 || unit(h, 0) >= density {
        return 0.0;
    }
    let radius = pitch * (0.1 + 0.14 * unit(h, 1));
    let reach = pitch * 0.5 - radius * 1.42;
    let ds = at.s - (f64::from(x) + 0.5) * pitch - reach * (2.0 * unit(h, 2) - 1.0);
    let dt = at.t - (f64::from(y) + 0.5) * pitch - reach * (2.0 * unit(h, 3) - 1.0);
    let distance = if unit(g, 0) < 0.35 {
        ds.hypot(dt) - radius
    } else {
        let (sin, cos) = (unit(g, 1) * std::f64::consts::FRAC_PI_2).sin_cos();
        (ds * cos - dt * sin).abs().max((ds * sin + dt * cos).abs()) - radius
    };
    let tone = if unit(g, 2) < 0.6 { -1.0 } else { 0.8 };
    tone * amplitude * (0.5 + 0.5 * unit(g, 3)) * inside(distance, w) * keep
}

/// A digit 0 to 9 of seven segments in the unit square scaled to `size`: 1 on the segments.
pub(crate) fn digit(at: &Spot, value: u32, size: f64) -> f64 {
    // Segments: top, upper left, upper right, middle, lower left, lower right, bottom.
    const LIT: [u8; 10] = [0x77, 0x12, 0x5D, 0x5B, 0x3A, 0x6B, 0x6F, 0x52, 0x7F, 0x7B];
    let lit = LIT[(value % 10) as usize];
    let (wide, high, bar) = (0.55 * size, size, 0.15 * size);
    let half = high / 2.0;
    let segments = [
        ([0.0, wide], [high - bar, high]),
        ([0.0, bar], [half, high]),
        ([wide - bar, wide], [half, high]),
        ([0.0, wide], [half - bar / 2.0, half + bar / 2.0]),
        ([0.0, bar], [0.0, half]),
        ([wide - bar, wide], [0.0, half]),
        ([0.0, wide], [0.0, bar]),
    ];
    segments
        .iter()
        .enumerate()
        .filter(|(i, _)| lit & (0x40 >> i) != 0)
        .map(|(_, (s, t))| rectangle(at, *s, *t))
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(s: f64, t: f64, w: f64) -> Spot {
        Spot { s, t, ws: w, wt: w }
    }

    #[test]
    fn patterns_fade_to_their_mean_when_pixels_are_wide() {
        let at = spot(0.37, 0.11, 1.0);
        assert_eq!(checker(&at, 0.05), 0.5);
        assert!((lines(0.3, 0.1, 0.01, 1.0) - 0.1).abs() < 1e-12);
        assert_eq!(speckles(&at, 0.1, 1.0, 0.3, 5), 0.0);
        assert_eq!(noise(&at, &[(0.1, 1.0)], 5), 0.0);
    }

    #[test]
    fn patterns_are_sharp_when_pixels_are_narrow() {
        let w = 1e-4;
        assert_eq!(checker(&spot(0.02, 0.02, w), 0.05), 1.0);
        assert_eq!(checker(&spot(0.07, 0.02, w), 0.05), 0.0);
        assert_eq!(lines(0.2001, 0.1, 0.01, w), 1.0);
        assert_eq!(lines(0.25, 0.1, 0.01, w), 0.0);
        // A one is its two right segments, an eight all of them.
        assert_eq!((digit(&spot(0.5, 0.3, w), 1, 1.0), digit(&spot(0.05, 0.3, w), 1, 1.0)), (1.0, 0.0));
        assert_eq!((digit(&spot(0.05, 0.3, w), 8, 1.0), digit(&spot(0.3, 0.3, w), 8, 1.0)), (1.0, 0.0));
    }
}
