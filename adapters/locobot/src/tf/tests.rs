use approx::assert_relative_eq;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use vice_core::frames::Rigid;

use super::*;

fn at(x: f64, yaw: f64) -> Transform {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, yaw));
    Rigid::from_parts(Vector3::new(x, 0.0, 0.0), rotation)
}

fn ms(millis: i64) -> Stamp {
    Stamp::from_nanos((1_000_000 + millis) * 1_000_000)
}

fn tree(edges: &[(&str, &str, Option<i64>)]) -> TfTree {
    let mut builder = TfBuilder::default();
    for (parent, child, millis) in edges {
        match millis {
            None => builder.fix(parent, child, at(1.0, 0.0)),
            Some(millis) => builder.sample(parent, child, ms(*millis), at(*millis as f64, 0.0)),
        }
    }
    builder.finish()
}

#[test]
fn each_edge_is_interpolated_for_itself() {
    let mut builder = TfBuilder::default();
    // A slow edge that turns, and a fast one under it.
    builder.sample("map", "odom", ms(0), at(0.0, 0.0));
    builder.sample("map", "odom", ms(200), at(2.0, 1.0));
    for i in 0..=10 {
        builder.sample("odom", "base", ms(20 * i), at(i as f64, 0.0));
    }
    builder.fix("base", "camera", at(0.5, 0.0));
    let tree = builder.finish();
    let chain = tree.chain("map", "camera").unwrap();
    let expected = at(1.0, 0.5) * at(5.0, 0.0) * at(0.5, 0.0);
    assert_relative_eq!(
        chain.at(ms(100)).unwrap().isometry().to_homogeneous(),
        expected.isometry().to_homogeneous(),
        epsilon = 1e-12
    );
    assert_eq!(chain.stamps().len(), 11);
    let back = tree.chain("camera", "map").unwrap().at(ms(100)).unwrap();
    assert_relative_eq!(
        (back * expected).isometry().to_homogeneous(),
        Transform::identity().isometry().to_homogeneous(),
        epsilon = 1e-12
    );
    assert!(tree.chain("base", "base").unwrap().at(ms(-5)).unwrap() == Transform::identity());
}

#[test]
fn only_the_edges_between_two_frames_count() {
    // The base moves only for a moment, but head and camera hang on the same base all the time.
    let tree = tree(&[("odom", "base", Some(0)), ("base", "left", None), ("base", "right", None)]);
    let chain = tree.chain("left", "right").unwrap();
    assert!(chain.is_fixed());
    assert_eq!(chain.at(ms(99_999)).unwrap(), Transform::identity());
}

#[test]
fn nothing_is_extrapolated_and_the_edge_is_named() {
    let tree = tree(&[("a", "b", Some(0)), ("a", "b", Some(900)), ("a", "b", Some(2000)), ("b", "c", None)]);
    let chain = tree.chain("a", "c").unwrap();
    assert!(chain.at(ms(450)).is_ok(), "0.9 s are within the limit of an edge");
    let error = |millis| chain.at(ms(millis)).unwrap_err().to_string();
    assert!(error(-1).contains("no a -> b at") && error(-1).contains("first sample is at 1000000000000 ns"));
    assert!(error(2001).contains("last sample"));
    assert!(error(1500).contains("gap of 1.1 s"), "{}", error(1500));
}

#[test]
fn cycles_and_disconnected_frames_are_named() {
    let cycle = tree(&[("a", "b", None), ("b", "c", None), ("c", "a", None)]);
    let error = cycle.chain("a", "b").unwrap_err().to_string();
    assert!(error.contains("cycle: a -> c -> b -> a"), "{error}");
    assert!(cycle.roots().is_err());
    let two = tree(&[("a", "b", None), ("x", "y", None)]);
    let error = two.chain("b", "y").unwrap_err().to_string();
    assert_eq!(error, "tf does not connect b and y: b hangs on a, y on x");
    assert_eq!(two.roots().unwrap(), [("a".to_string(), 1), ("x".to_string(), 1)]);
    let error = two.chain("b", "camera").unwrap_err().to_string();
    assert!(error.contains("has no frame camera (its frames: a, b, x, y)"), "{error}");
}

#[test]
fn a_chain_of_thousands_of_frames_is_one_way() {
    let mut builder = TfBuilder::default();
    (0..4000).for_each(|i| builder.fix(&format!("f{i}"), &format!("f{}", i + 1), at(1.0, 0.0)));
    let long = builder.finish();
    assert_eq!(long.roots().unwrap(), [("f0".to_string(), 4000)]);
    let way = long.chain("f0", "f4000").unwrap().at(ms(0)).unwrap();
    assert_eq!(way.translation().x, 4000.0);
    let mut builder = TfBuilder::default();
    (0..4000).for_each(|i| builder.fix(&format!("f{i}"), &format!("f{}", (i + 1) % 4000), at(1.0, 0.0)));
    let ring = builder.finish();
    let [one, other] =
        [ring.roots().unwrap_err(), ring.chain("f3", "f4").unwrap_err()].map(|e| e.to_string());
    assert!(one == other && one.contains("cycle") && one.contains("(4000 frames)"), "{one}");
}

#[test]
fn frames_that_any_two_builders_hang_differently_are_found() {
    let of = |edges: &[(&str, &str, f64)]| {
        let mut builder = TfBuilder::default();
        edges.iter().for_each(|(parent, child, x)| builder.fix(parent, child, at(*x, 0.0)));
        builder
    };
    let first = of(&[("odom", "base", 1.0), ("base", "camera", 1.0), ("base", "arm", 1.0)]);
    let same = of(&[("base", "camera", 1.0)]);
    let other = of(&[("base", "camera", 1.0), ("base", "arm", 2.0), ("map", "base", 1.0)]);
    let found: Vec<&str> =
        TfBuilder::contradictions([&first, &same, &other].into_iter()).into_iter().collect();
    assert_eq!(found, ["arm", "base"]);
    assert!(first.contradicts(&other) && other.contradicts(&first));
    assert!(!first.contradicts(&same) && !same.contradicts(&other));
    assert!(TfBuilder::contradictions([&first, &same].into_iter()).is_empty());
}

#[test]
fn oddities_are_noted() {
    let mut builder = TfBuilder::default();
    builder.fix("a", "b", at(1.0, 0.0));
    builder.fix("a", "b", at(2.0, 0.0));
    builder.fix("x", "b", at(3.0, 0.0));
    builder.sample("b", "c", Stamp::default(), at(0.0, 0.0));
    builder.sample("b", "c", ms(5), at(1.0, 0.0));
    builder.sample("b", "c", ms(5), at(2.0, 0.0));
    builder.sample("c", "c", ms(5), at(2.0, 0.0));
    let tree = builder.finish();
    let notes = tree.notes.iter().map(Suspicion::line).collect::<Vec<_>>().join("\n");
    for expected in
        ["two parents in tf, a and x", "a -> b changes", "zero stamp", "repeat a stamp", "from `c` to `c`"]
    {
        assert!(notes.contains(expected), "{expected} not in {notes}");
    }
    assert_eq!(
        tree.chain("a", "c").unwrap().at(ms(5)).unwrap().translation().x,
        4.0,
        "the later of two counts"
    );
}

#[test]
fn a_clock_that_jumps_back_is_an_error_of_its_edge() {
    let tree =
        tree(&[("a", "b", Some(5000)), ("a", "b", Some(100)), ("b", "c", Some(30)), ("b", "c", Some(0))]);
    let error = tree.chain("a", "b").unwrap().at(ms(100)).unwrap_err().to_string();
    assert!(error.contains("clock of tf a -> b jumps back from 1005000000000 ns"), "{error}");
    assert!(tree.chain("a", "b").unwrap().jump().is_some());
    assert!(tree.chain("b", "c").unwrap().at(ms(15)).is_ok(), "a late message is no jump");
}

#[test]
fn a_prefix_of_frames_is_seen_through_where_only_one_fits() {
    let tree = tree(&[("locobot/odom", "locobot/base_link", None), ("other/odom", "x", None)]);
    assert_eq!(tree.find("base_link").as_deref(), Some("locobot/base_link"));
    assert_eq!((tree.find("odom"), tree.find("x").as_deref()), (None, Some("x")));
}

proptest! {
    #[test]
    fn the_way_there_and_back_is_nothing(xs in prop::collection::vec((-3.0..3.0_f64, -3.0..3.0_f64), 4), millis in 0..100_i64) {
        let mut builder = TfBuilder::default();
        for (i, (parent, child)) in [("r", "a"), ("a", "b"), ("r", "c"), ("c", "d")].iter().enumerate() {
            builder.sample(parent, child, ms(0), at(xs[i].0, xs[i].1));
            builder.sample(parent, child, ms(100), at(xs[i].1, xs[i].0));
        }
        let tree = builder.finish();
        let there = tree.chain("b", "d").unwrap().at(ms(millis)).unwrap();
        let back = tree.chain("d", "b").unwrap().at(ms(millis)).unwrap();
        assert_relative_eq!(
            (there * back).isometry().to_homogeneous(),
            Transform::identity().isometry().to_homogeneous(),
            epsilon = 1e-9
        );
    }
}
