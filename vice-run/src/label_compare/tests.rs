use super::*;
use vice_core::label::LabelRow;

/// A stamp in seconds, a place, and whether a segment starts.
type Row = (f64, f64, f64, bool);

/// Points by name.
fn labels(points: &[(&str, &[Row])]) -> LabelSet {
    let rows = points.iter().flat_map(|(name, rows)| {
        rows.iter().map(|(s, u, v, keyframe)| {
            let stamp = Stamp::from_nanos((s * 1e9) as i64);
            let observation =
                Observation { keyframe: *keyframe, ..Observation::manual(stamp, Pixel::new(*u, *v)) };
            LabelRow { point: (*name).to_string(), observation }
        })
    });
    LabelSet::from_rows(rows).unwrap()
}

fn compared(a: &LabelSet, b: &LabelSet) -> LabelComparison {
    compare((Path::new("a.csv"), a), (Path::new("b.csv"), b)).unwrap()
}

#[test]
fn distances_gaps_and_drift_are_told() {
    let a = labels(&[(
        "p",
        &[
            (0.0, 10.0, 10.0, true),
            (1.0, 20.0, 10.0, false),
            (2.0, 30.0, 10.0, false),
            (3.0, 40.0, 10.0, false),
        ],
    )]);
    // One pixel off from the start, four at the end; one label less, one more.
    let b = labels(&[(
        "p",
        &[
            (0.0, 11.0, 10.0, true),
            (1.0, 22.0, 10.0, false),
            (3.0, 44.0, 10.0, false),
            (4.0, 9.0, 9.0, false),
        ],
    )]);
    let found = compared(&a, &b);
    let all = &found.all;
    assert_eq!((all.compared, all.missing_in_a, all.missing_in_b, all.segments), (3, 1, 1, 1));
    assert_eq!((all.median_px, all.worst_px, all.drift_median_px), (Some(2.0), Some(4.0), Some(3.0)));
    // Since the key frame they moved apart by 1 and by 3 px.
    let floor = (10.0_f64 / 2.0).sqrt() / std::f64::consts::SQRT_2;
    assert!((found.floor_px.unwrap() - floor).abs() < 1e-12);
    assert_eq!(found.by_time.iter().map(|b| b.from_s).collect::<Vec<_>>(), [0.0, 1.0, 3.0]);
    let text = found.text();
    assert!(text.contains("floor under RMSE_2D: 1.581 px"), "{text}");
    let svg = found.svg();
    assert!(
        svg.starts_with("<svg")
            && svg.trim_end().ends_with("</svg>")
            && svg.matches("<polyline").count() == 2,
        "{svg}"
    );
}

#[test]
fn the_same_labels_have_no_distance_and_a_constant_offset_no_floor() {
    let a = labels(&[("p", &[(0.0, 10.0, 10.0, true), (1.0, 20.0, 10.0, false)])]);
    let found = compared(&a, &a);
    assert_eq!((found.all.worst_px, found.floor_px), (Some(0.0), Some(0.0)));
    let b = labels(&[("p", &[(0.0, 13.0, 14.0, true), (1.0, 23.0, 14.0, false)])]);
    let found = compared(&a, &b);
    // Another spot of the same thing: further off, but it moves alike.
    assert_eq!((found.all.median_px, found.floor_px), (Some(5.0), Some(0.0)));
}

#[test]
fn points_of_other_names_are_found_by_where_they_are() {
    let row = |u: f64| [(0.0, u, 10.0, true), (1.0, u + 5.0, 10.0, false), (2.0, u + 9.0, 10.0, false)];
    let a = labels(&[("one", &row(10.0)), ("two", &row(100.0)), ("far", &row(300.0))]);
    let b = labels(&[("x", &row(101.0)), ("y", &row(9.5))]);
    let found = compared(&a, &b);
    let names: Vec<(&str, &str)> = found.points.iter().map(|p| (p.a.as_str(), p.b.as_str())).collect();
    assert_eq!(names, [("one", "y"), ("two", "x")]);
    assert_eq!((found.only_in_a.as_slice(), found.only_in_b.len()), (&["far".to_string()][..], 0));
    let elsewhere = labels(&[("z", &row(600.0))]);
    let error = compare((Path::new("a.csv"), &a), (Path::new("b.csv"), &elsewhere)).unwrap_err();
    assert!(error.to_string().contains("neither by its name nor by where it is"), "{error}");
}

#[test]
fn a_new_segment_of_either_ends_the_drift() {
    let a = labels(&[(
        "p",
        &[(0.0, 0.0, 0.0, true), (1.0, 1.0, 0.0, false), (2.0, 50.0, 0.0, true), (3.0, 51.0, 0.0, false)],
    )]);
    let b = labels(&[(
        "p",
        &[(0.0, 0.0, 0.0, true), (1.0, 2.0, 0.0, false), (2.0, 57.0, 0.0, true), (3.0, 58.0, 0.0, false)],
    )]);
    let found = compared(&a, &b);
    assert_eq!((found.all.segments, found.all.drift_median_px), (2, Some(0.5)));
}
