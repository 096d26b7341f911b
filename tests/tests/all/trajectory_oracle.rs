//! Trajectory metrics against evo and SciPy.
#![allow(clippy::unwrap_used, clippy::panic)] // The helpers fail their test.

use std::path::Path;

use serde_json::Value;
use vice_core::metrics::align::{Alignment, align};
use vice_core::metrics::associate::{Matching, PosePairs};
use vice_core::metrics::plane::Plane;
use vice_core::metrics::rotation_offset::RotationOffset;
use vice_core::metrics::rpe::{Delta, DeltaUnit, PairMode, PairsFrom, Rpe, RpeErrors, RpeOptions};
use vice_core::metrics::trajectory::{Ape, ApeErrors, Statistics, Summary};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{PoseRow, Trajectory};

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Rows of numbers; `order` are the columns of the quaternion, w first.
fn read(path: &Path, separator: char, stamp: fn(&str) -> Stamp, order: [usize; 4]) -> Trajectory {
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty()).map(|line| {
        let columns: Vec<&str> = line.split(separator).collect();
        let number = |i: usize| columns[i].trim().parse::<f64>().unwrap();
        PoseRow {
            stamp: stamp(columns[0]),
            position_m: [number(1), number(2), number(3)],
            rotation_wxyz: order.map(number),
        }
    });
    Trajectory::from_rows(rows.collect::<Vec<_>>()).unwrap()
}

/// Reference and estimate, paired as the oracle did.
fn paired(case: &str) -> Option<PosePairs> {
    let data = vice_tests::shared("data/euroc_v1_01")?;
    let reference = read(
        &data.join("mav0/state_groundtruth_estimate0/data.csv"),
        ',',
        |t| Stamp::parse_nanos(t).unwrap(),
        [4, 5, 6, 7],
    );
    let file = data.join(format!("estimates/{case}.txt"));
    let estimate = read(&file, ' ', |t| Stamp::parse_seconds(t).unwrap(), [7, 4, 5, 6]);
    let t_max_diff = Span::from_millis(if case == "imu_euler" { 1 } else { 10 });
    Some(PosePairs::match_up(&reference, &estimate, Matching::Nearest { t_max_diff }, Span::ZERO).unwrap())
}

fn aligned(pairs: &PosePairs, alignment: Alignment) -> PosePairs {
    align(pairs, alignment, None).unwrap().apply_to(pairs)
}

fn ape(pairs: &PosePairs) -> Ape {
    ApeErrors::of(pairs).statistics().unwrap()
}

fn rpe(pairs: &PosePairs, delta: f64, unit: DeltaUnit, mode: PairMode) -> Rpe {
    let delta = Delta::new(delta, unit).unwrap();
    let options = RpeOptions { delta, mode, pairs_from: PairsFrom::Estimate };
    RpeErrors::of(pairs, &options).unwrap().statistics().unwrap()
}

fn close(got: f64, expected: f64, what: &str) {
    let off = (got - expected).abs();
    assert!(off <= 1e-9 || off <= 1e-6 * expected.abs(), "{what}: {got}, not {expected}");
}

/// Compares all seven figures; `unit` is how many of the oracle's units one of ours is.
fn same(got: &Statistics, unit: f64, expected: &Value, what: &str) -> usize {
    let figures = [
        ("rmse", got.rmse * unit),
        ("mean", got.mean * unit),
        ("median", got.median * unit),
        ("std", got.std * unit),
        ("min", got.min * unit),
        ("max", got.max * unit),
        ("sse", got.sse * unit * unit),
    ];
    for (name, value) in figures {
        close(value, expected[name].as_f64().unwrap(), &format!("{what} {name}"));
    }
    figures.len()
}

/// One block of the oracle, by its name; gives how many figures were compared.
fn compare_block(pairs: &PosePairs, name: &str, expected: &Value, what: &str) -> usize {
    if name == "seed" {
        let summary = Summary::of(pairs).unwrap();
        close(summary.rmse_3d_m, expected["rmse_3d_m"].as_f64().unwrap(), what);
        close(summary.aoe_rad, expected["aoe_rad"].as_f64().unwrap(), what);
        close(summary.roe_rad.unwrap(), expected["roe_mean_rad"].as_f64().unwrap(), what);
        return 3;
    }
    let ape = ape(pairs);
    match name {
        "ape_translation_part" => return same(&ape.translation_m, 1.0, expected, what),
        "ape_rotation_angle_deg" => return same(&ape.rotation_rad, DEGREES, expected, what),
        "ape_full_transformation" => return same(&ape.full, 1.0, expected, what),
        _ => {}
    }
    let (delta, unit) = if name.starts_with("rpe_1frame_") {
        (1.0, DeltaUnit::Frames)
    } else if name.starts_with("rpe_10frames_") {
        (10.0, DeltaUnit::Frames)
    } else if name.starts_with("rpe_1meters_") {
        (1.0, DeltaUnit::Meters)
    } else if name.starts_with("rpe_10degrees_") {
        (10.0, DeltaUnit::Degrees)
    } else {
        panic!("{what}: a block nobody compares");
    };
    let mode = if name.contains("all_pairs") { PairMode::All } else { PairMode::Consecutive };
    let rpe = rpe(pairs, delta, unit, mode);
    let counted = expected.get("pairs").map_or(0, |n| {
        assert_eq!(n.as_u64(), Some(rpe.pairs as u64), "{what} pairs");
        1
    });
    counted
        + if name.ends_with("translation_part") {
            same(&rpe.translation_m, 1.0, expected, what)
        } else {
            same(&rpe.rotation_rad, DEGREES, expected, what)
        }
}

#[test]
fn trajectory_metrics_agree_with_evo() {
    let Some(oracle) = vice_tests::shared_json("oracle/trajectory_metrics.json") else { return };
    let cases = oracle["cases"].as_object().unwrap();
    assert_eq!(cases.len(), 3);
    let mut figures = 0;
    for (case, blocks) in cases {
        let Some(pairs) = paired(case) else { return };
        assert_eq!(blocks["matched_poses"].as_u64(), Some(pairs.len() as u64), "{case}");
        for alignment in Alignment::ALL {
            let name = if alignment == Alignment::FirstPose { "origin" } else { alignment.name() };
            let moved = aligned(&pairs, alignment);
            for (block, expected) in blocks[name].as_object().unwrap() {
                figures += compare_block(&moved, block, expected, &format!("{case} {name} {block}"));
            }
        }
    }
    // Three estimates, five alignments of 5 * 7 + 3 figures, and at SE3 twelve blocks of 7 and a count.
    assert_eq!(figures, 3 * (5 * (5 * 7 + 3) + 12 * 8));
}

/// What evo 1.38.1 gives for options that the oracle has no block for.
#[test]
fn fewer_poses_planes_and_pairs_of_the_reference_agree_with_evo() {
    let Some(pairs) = paired("svo_ba") else { return };
    for (n, rmse) in [(10, 0.11659095254197736), (50, 0.06526669241769982)] {
        let moved = align(&pairs, Alignment::Se3, Some(n)).unwrap().apply_to(&pairs);
        close(ape(&moved).translation_m.rmse, rmse, &format!("aligned on {n}"));
    }
    let moved = aligned(&pairs, Alignment::Se3);
    for (plane, translation, rotation) in [
        (Plane::Xy, 0.040576691665882375, 0.02022027151973704),
        (Plane::Xz, 0.034952428518913926, 0.005614177912266416),
        (Plane::Yz, 0.025285703082026465, 0.02384701442594756),
    ] {
        let flat = ape(&plane.project_pairs(&moved));
        close(flat.translation_m.rmse, translation, plane.name());
        close(flat.rotation_rad.rmse, rotation, plane.name());
    }
    for (delta, unit, mode, count, rmse) in [
        (1.0, DeltaUnit::Meters, PairMode::Consecutive, 39, 0.023276869133566875),
        (1.0, DeltaUnit::Meters, PairMode::All, 68, 0.019906036685475186),
        (10.0, DeltaUnit::Degrees, PairMode::Consecutive, 78, 0.016017834537855883),
        (10.0, DeltaUnit::Degrees, PairMode::All, 207, 0.07492207711426513),
    ] {
        let delta = Delta::new(delta, unit).unwrap();
        let options = RpeOptions { delta, mode, pairs_from: PairsFrom::Reference };
        let rpe = RpeErrors::of(&moved, &options).unwrap().statistics().unwrap();
        assert_eq!(rpe.pairs, count, "{options:?}");
        close(rpe.translation_m.rmse, rmse, &format!("{options:?}"));
    }
}

#[test]
fn real_estimates_are_not_suspected_of_a_turned_body_until_it_is_turned() {
    use nalgebra::{UnitQuaternion, Vector3};
    use vice_core::frames::{Body, Rigid};
    for case in ["svo_ba", "svo_ba_run1", "imu_euler"] {
        let Some(pairs) = paired(case) else { return };
        let found = RotationOffset::find(&pairs).unwrap();
        assert!(!found.is_suspicious(), "{case}: {found:?}");
        // The extrinsics of a camera forgotten: 90 degrees about z and a little more.
        let offset = UnitQuaternion::from_scaled_axis(Vector3::new(0.02, 0.03, 1.55));
        let body_from_wrong = Rigid::<Body, Body>::from_parts(Vector3::zeros(), offset);
        let wrong = pairs.map_estimate(|pose| *pose * body_from_wrong);
        let found_wrong = RotationOffset::find(&wrong).unwrap();
        assert!(found_wrong.is_suspicious(), "{case}: {found_wrong:?}");
        let expected = found.reference_body_from_estimate_body * offset;
        assert!(expected.angle_to(&found_wrong.reference_body_from_estimate_body) < 1e-3, "{case}");
    }
}
