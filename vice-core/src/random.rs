//! Reproducible draws: the same seed gives the same numbers on every machine.
//!
//! [`SplitMix`] is what new code takes. [`Congruential`] stays where a stream of its numbers is part of a figure that is
//! compared from build to build, such as the rooms of the benchmarks.

/// SplitMix64 (Steele, Lea and Flood 2014): small, seeded, the same everywhere.
#[derive(Clone, Debug)]
pub struct SplitMix(u64);

impl SplitMix {
    /// The stream of a seed.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A stream of its own for each purpose, so that a number more drawn for one does not change another.
    pub const fn for_purpose(seed: u64, purpose: u64) -> Self {
        Self(seed ^ purpose.wrapping_mul(0xD6E8_FEB8_6659_FD93))
    }

    /// 64 random bits.
    pub const fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// 32 random bits.
    pub const fn bits32(&mut self) -> u32 {
        (self.bits() >> 32) as u32
    }

    /// A number below `n`, by the high half of a product.
    pub fn below(&mut self, n: u64) -> u64 {
        ((u128::from(self.bits()) * u128::from(n)) >> 64) as u64
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * unit(self.bits())
    }

    /// Normal with mean 0 and deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform(0.0, 1.0)).ln()).sqrt();
        radius * self.uniform(0.0, std::f64::consts::TAU).cos()
    }

    /// How often each of `n` is drawn in `n` draws with replacement.
    pub fn resample(&mut self, n: usize) -> Vec<u32> {
        let mut times = vec![0_u32; n];
        (0..n).for_each(|_| times[self.below(n as u64) as usize] += 1);
        times
    }
}

/// A linear congruential generator with Knuth's MMIX constants. Its low bits repeat soon.
#[derive(Clone, Debug)]
pub struct Congruential(u64);

impl Congruential {
    /// The stream of a seed.
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * unit(self.0)
    }

    /// So many uniform in `[low, high)`.
    pub fn list(&mut self, n: usize, low: f64, high: f64) -> Vec<f64> {
        (0..n).map(|_| self.uniform(low, high)).collect()
    }
}

/// In `[0, 1)`, by the upper 53 bits.
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_that_of_the_paper() {
        // The reference implementation, seed 1234567.
        let mut random = SplitMix::new(1_234_567);
        let drawn: Vec<u64> = (0..3).map(|_| random.bits()).collect();
        assert_eq!(drawn, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn draws_are_spread_and_repeat() {
        let draws = |purpose| {
            let mut random = SplitMix::for_purpose(7, purpose);
            (0..4000).map(|_| random.normal()).collect::<Vec<_>>()
        };
        let of = draws(1);
        assert_eq!(of, draws(1));
        assert_ne!(of, draws(2));
        let mean = of.iter().sum::<f64>() / 4000.0;
        let variance = of.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 4000.0;
        assert!(mean.abs() < 0.05 && (variance - 1.0).abs() < 0.08, "{mean} {variance}");
        let mut few = Congruential::new(1);
        assert!(few.list(1000, -2.0, 3.0).iter().all(|x| (-2.0..3.0).contains(x)));
    }
}
