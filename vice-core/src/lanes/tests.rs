use pulp::{Simd, WithSimd};

use super::*;

struct Atan<'a>(&'a [f64], &'a mut [f64]);

impl WithSimd for Atan<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (from, to) in self.0.chunks(S::F64_LANES).zip(self.1.chunks_mut(S::F64_LANES)) {
            Lanes::load(simd, from).atan().store(to);
        }
    }
}

#[test]
fn the_arc_tangent_is_that_of_the_standard_library() {
    let mut r =
        vec![0.0, f64::MIN_POSITIVE, 0.41421356, 0.41421357, 2.41421356, 2.41421357, 1e300, f64::INFINITY];
    r.extend((0..200_000).map(|i| f64::from(i) * 1e-4));
    r.extend((-300..300).map(|e| 1.7 * 10.0_f64.powi(e)));
    let mut found = vec![0.0; r.len()];
    ARCH.dispatch(Atan(&r, &mut found));
    for (r, found) in r.iter().zip(&found) {
        let expected = r.atan();
        assert!(
            (found - expected).abs() <= 4.0 * f64::EPSILON * expected,
            "atan({r}) = {found}, not {expected}"
        );
    }
    let mut nan = [0.0];
    ARCH.dispatch(Atan(&[f64::NAN], &mut nan));
    assert!(nan[0].is_nan());
}

struct Tan<'a>(&'a [f64], &'a mut [f64]);

impl WithSimd for Tan<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (from, to) in self.0.chunks(S::F64_LANES).zip(self.1.chunks_mut(S::F64_LANES)) {
            Lanes::load(simd, from).tan().store(to);
        }
    }
}

#[test]
fn the_tangent_is_that_of_the_standard_library_and_of_one_number() {
    let right = std::f64::consts::FRAC_PI_2;
    let mut angles =
        vec![0.0, f64::MIN_POSITIVE, right / 2.0, right / 2.0 + 1e-16, right - 1e-9, right - 1e-15];
    angles.extend((0..200_000).map(|i| f64::from(i) * right / 200_000.0));
    let mut found = vec![0.0; angles.len()];
    ARCH.dispatch(Tan(&angles, &mut found));
    for (angle, found) in angles.iter().zip(&found) {
        assert_eq!(found.to_bits(), Number::tan(*angle).to_bits(), "{angle}");
        let expected = angle.tan();
        let error = (found - expected).abs();
        assert!(error <= 6.0 * f64::EPSILON * expected, "tan({angle}) = {found}, not {expected}");
    }
}

/// Doubles what is not negative.
#[derive(Clone, Copy)]
struct Double;

impl Kernel<1, 1> for Double {
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: [Lanes<S>; 1], [x]: [Lanes<S>; 1]) -> Masked<S, 1> {
        // Numbers above 100 are left to the other formula, which adds a tenth to be seen.
        Masked { numbers: [x * 2.0], valid: x.of(0.0).at_most(x), unsure: Some(x.of(100.0).below(x)) }
    }

    fn single(&self, _: [f64; 1], [x]: [f64; 1]) -> Option<[f64; 1]> {
        (x < 1000.0).then_some([2.0 * x + 0.1])
    }
}

#[test]
fn every_point_of_every_length_is_driven() {
    for n in (0..40).chain([100_000]) {
        let x: Vec<f64> = (0..n).map(|i| f64::from(i) - 3.0).collect();
        let (mut y, mut valid) = (vec![7.0; x.len()], vec![true; x.len()]);
        let count = run("double", Double, [&x], [&mut y], Some(&mut valid));
        assert_eq!(count, valid.iter().filter(|v| **v).count());
        for ((x, y), valid) in x.iter().zip(&y).zip(&valid) {
            assert_eq!(*valid, (0.0..1000.0).contains(x), "{x}");
            match *x {
                _ if !valid => assert!(y.is_nan()),
                x if x > 100.0 => assert_eq!(*y, 2.0 * x + 0.1),
                x => assert_eq!(*y, 2.0 * x),
            }
        }
        let narrow: Vec<f32> = x.iter().map(|x| *x as f32).collect();
        let mut doubled = vec![0.0_f32; x.len()];
        assert_eq!(run("double", Double, [&narrow], [&mut doubled], None), count);
        for (y, doubled) in y.iter().zip(&doubled) {
            assert!(*doubled == *y as f32 || y.is_nan() && doubled.is_nan());
        }
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let x: Vec<f64> = (0..200_001).map(|i| (f64::from(i) * 0.37) % 1500.0 - 20.0).collect();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (mut y, mut valid) = (vec![0.0; x.len()], vec![false; x.len()]);
        let count = pool.install(|| run("double", Double, [&x], [&mut y], Some(&mut valid)));
        (count, y.iter().map(|y| y.to_bits()).collect::<Vec<_>>(), valid)
    };
    let one = with(1);
    assert!(one == with(2) && one == with(7));
}

#[test]
#[should_panic(expected = "double: slices differ in length")]
fn slices_of_different_lengths_are_refused() {
    run("double", Double, [&[1.0, 2.0]], [&mut [0.0]], None);
}

#[test]
fn the_instruction_set_is_the_widest_there_is() {
    let name = instruction_set();
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") && std::arch::is_x86_feature_detected!("avx512dq") {
        assert_eq!(name, "V4, 8 doubles");
    } else if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        assert_eq!(name, "V3, 4 doubles");
    }
    assert!(name.ends_with("doubles"));
}
