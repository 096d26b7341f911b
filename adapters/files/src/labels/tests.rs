use proptest::prelude::*;
use vice_core::camera::Pixel;
use vice_core::error::Place;
use vice_core::label::{Observation, ObservationSource, Provenance};

use super::*;

const PICKLES: [(&str, &[u8]); 7] = [
    ("protocol 0", include_bytes!("../../tests/data/labels_p0.pkl")),
    ("protocol 0, NumPy 1", include_bytes!("../../tests/data/labels_numpy1_p0.pkl")),
    ("protocol 1", include_bytes!("../../tests/data/labels_p1.pkl")),
    ("protocol 2", include_bytes!("../../tests/data/labels_p2.pkl")),
    ("protocol 3", include_bytes!("../../tests/data/labels_p3.pkl")),
    ("protocol 4", include_bytes!("../../tests/data/labels_p4.pkl")),
    ("protocol 5", include_bytes!("../../tests/data/labels_p5.pkl")),
];

fn stamps(n: i64) -> Vec<Stamp> {
    (0..n).map(|i| Stamp::from_nanos(1_000 + i)).collect()
}

fn csv(text: &str) -> DataResult<LabelSet> {
    read_csv(text.as_bytes())
}

#[test]
fn columns_are_found_by_name() {
    let labels = csv("\u{feff}flags,v_px,u_px,keyframe,timestamp_ns,point,source\r\n\
                      ,2.5,1.5,1,1403715280562142976,p 10,\r\n# a comment\r\n\
                      \r\nuncertain|occluded,4,3,0,1403715280612143104,p 10,auto\r\n\
                      uncertain , 4, 3, 0, 7,\"a,b\", detected\r\n")
    .unwrap();
    let names: Vec<&str> = labels.points().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["a,b", "p 10"]);
    let [first, second] = labels.points()[1].observations.iter().collect::<Vec<_>>()[..] else { panic!() };
    assert_eq!(
        (first.px, first.keyframe, first.source),
        (Pixel::new(1.5, 2.5), true, ObservationSource::Manual)
    );
    assert_eq!((second.occluded, second.uncertain, second.source), (true, true, ObservationSource::Auto));
    assert_eq!((first.line, second.line), (2, 5));
    assert!(labels.points()[0].observations.first().unwrap().uncertain);
    assert_eq!(labels.points()[0].observations.first().unwrap().line, 6);
}

#[test]
fn bad_rows_are_named() {
    let head = "point,timestamp_ns,u_px,v_px,keyframe,source,flags\n0,1,2,3,1,,\n";
    let says = |row: &str, line: u64, expected: &str| {
        let error = csv(&format!("{head}{row}\n")).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert_eq!(error.place(), Some(Place::Line(line)), "{error}");
    };
    says("0,2,nan,3,1,,", 3, "not finite");
    says("0,2,2,inf,0,,", 3, "not finite");
    says("0,1,2,3,0,,", 3, "twice");
    says("0,x,2,3,0,,", 3, "timestamp_ns: `x`");
    says("0,2,2,,0,,", 3, "v_px: `` is no number");
    says("0,2,2,3,maybe,,", 3, "keyframe: `maybe`");
    says("0,2,2,3,0,dreamt,", 3, "source: `dreamt`");
    says("0,2,2,3,0,,hidden", 3, "flags: `hidden`");
    says("0,2,2,3,0,", 3, "expected 7 columns, found 6");
    says(",2,2,3,0,,", 3, "empty name");
    let missing = csv("point,timestamp_ns,u_px,v_px\n").unwrap_err().to_string();
    assert!(missing.contains("column keyframe is missing"), "{missing}");
    assert!(csv("").unwrap_err().to_string().contains("empty"));
    assert!(csv("point,timestamp_ns,u_px,v_px,keyframe\n").unwrap_err().to_string().contains("no labels"));
    let twice = csv("point,point,timestamp_ns,u_px,v_px,keyframe\n").unwrap_err().to_string();
    assert!(twice.contains("appears twice"), "{twice}");
    assert!(read_csv(b"point,timestamp_ns,u_px,v_px,keyframe\n\xff,1,1,1,1\n").is_err());
}

#[test]
fn schemas_are_told_apart() {
    let read = |text: &str| read_json(text.as_bytes());
    let labels = read(
        r#"{"schema": "vice.labels/1", "camera": "cam0", "later": [1], "points": [
            {"name": "0", "colour": "red", "observations": [{"timestamp_ns": 5, "px": [1, 2.5], "by": "me"}]}]}"#,
    )
    .unwrap();
    assert_eq!((labels.camera.as_deref(), labels.dataset.as_deref()), (Some("cam0"), None));
    let o = labels.points()[0].observations.first().unwrap();
    assert_eq!((o.px, o.keyframe, o.source), (Pixel::new(1.0, 2.5), false, ObservationSource::Manual));

    let says = |text: &str, expected: &str| {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    says(r#"{"schema": "vice.labels/2", "points": "other"}"#, "newer than this program");
    says(r#"{"schema": "vice.result/1"}"#, "not `vice.labels/1`");
    says(r#"{"schema": "vice.labels/x"}"#, "not `vice.labels/1`");
    says(r#"{"points": []}"#, "no `schema`");
    says(r#"{"schema": "vice.labels/1", "points": []}"#, "no labels");
    let none = r#"{"schema": "vice.labels/1", "camera": "cam0", "points": []}"#;
    assert_eq!(read_json_or_none(none.as_bytes()).unwrap().camera.as_deref(), Some("cam0"));
    says(
        r#"{"schema": "vice.labels/1", "points": [{"name": "0", "observations": [{"timestamp_ns": 5, "px": [1, 2], "confidence": 1.5}]}]}"#,
        "not between 0 and 1",
    );
    says("{\"schema\": \"vice.labels/1\",\n \"points\": [{}]}", "line 2: ");
    says("{", "is not the JSON expected");
    says(
        r#"{"schema": "vice.labels/1", "points": [{"name": "0", "observations": [{"timestamp_ns": 5, "px": [1e999, 2]}]}]}"#,
        "JSON",
    );
}

#[test]
fn the_format_is_found_by_content() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("labels.txt");
    std::fs::write(&path, "point,timestamp_ns,u_px,v_px,keyframe\n0,1000,1,2,1\n").unwrap();
    assert_eq!(read(&path, None).unwrap().observation_count(), 1);
    std::fs::write(&path, PICKLES[0].1).unwrap();
    assert!(read(&path, None).unwrap_err().to_string().contains("name the data set"));
    let labels = read(&path, Some(&stamps(4))).unwrap();
    assert_eq!(labels.observation_count(), 8);
    assert!(
        write(&path, &labels, Overwrite::Replace)
            .unwrap_err()
            .to_string()
            .contains(".csv, .json or .parquet")
    );
    let json = folder.path().join("labels.JSON");
    write(&json, &labels, Overwrite::Refuse).unwrap();
    assert!(write(&json, &labels, Overwrite::Refuse).unwrap_err().to_string().contains("`force`"));
    assert_eq!(read(&json, None).unwrap(), labels);
    let missing = read(folder.path().join("none.csv"), None).unwrap_err().to_string();
    assert!(missing.ends_with("none.csv: no such file"), "{missing}");
}

#[test]
fn pickles_of_every_protocol_are_read() {
    for (name, bytes) in PICKLES {
        let labels = read_pickle(bytes, &stamps(4)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let found: Vec<Vec<(i64, f64, f64, bool)>> = labels
            .points()
            .iter()
            .map(|p| {
                p.observations.iter().map(|o| (o.stamp.as_nanos(), o.px.u, o.px.v, o.keyframe)).collect()
            })
            .collect();
        let expected = [
            vec![(1000, 657.0, 383.0, true), (1003, 654.449, 382.878, false)],
            vec![(1000, 10.0, 20.0, true), (1001, 11.0, 21.0, false)],
            vec![(1001, 1.5, -2.25, true), (1002, 11.5, 12.5, false)],
            vec![(1002, 11.5, 12.5, true), (1003, 3.0, 4.0, false)],
        ];
        assert_eq!(found, expected, "{name}");
        let names: Vec<&str> = labels.points().iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["0", "1", "2", "3"]);
        let short = read_pickle(bytes, &stamps(3)).unwrap_err().to_string();
        assert!(short.contains("frame 3 is not among the camera's 3 frames"), "{short}");
        for cut in 0..bytes.len() {
            assert!(read_pickle(&bytes[..cut], &stamps(4)).is_err(), "{name} cut at {cut}");
        }
    }
}

#[test]
fn text_of_python_2_is_read() {
    // {'p': {1L: (array('<f4', [1.0, 2.0]), 1)}} as Python 2 wrote it in protocol 0.
    let pickle = b"(dp0\nS'p'\np1\n(dp2\nL1L\n(cnumpy.core.multiarray\n_reconstruct\np3\n(cnumpy\nndarray\np4\n(I0\ntS'b'\ntRp5\n\
                   (I1\n(I2\ntcnumpy\ndtype\np6\n(S'f4'\nI0\nI1\ntRp7\n(I3\nS'<'\nNNNI-1\nI-1\nI0\ntbI00\n\
                   S'\\x00\\x00\\x80?\\x00\\x00\\x00@'\ntbI1\ntss.";
    let labels = read_pickle(pickle, &stamps(2)).unwrap();
    assert_eq!(labels.points()[0].name, "p");
    assert_eq!(labels.points()[0].observations.first().unwrap().px, Pixel::new(1.0, 2.0));
}

#[test]
fn nothing_in_a_pickle_is_run() {
    let says = |bytes: &[u8], expected: &str| {
        let error = read_pickle(bytes, &stamps(4)).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    says(b"cos\nsystem\n(S'true'\ntR.", "the pickle asks for os.system");
    says(b"\x80\x04\x8c\x08builtins\x8c\x04eval\x93.", "the pickle asks for builtins.eval");
    says(b"(dp0\nI0\nI1\ns.", "holds no dictionary of frames");
    says(b"\x80\x04]\x94.", "the pickle holds no dictionary");
    says(b"}.", "no labels");
    says(b"", "cut off");
    // A dictionary that holds itself.
    says(b"}q\x00K\x00h\x00s.", "no pixel with a key frame mark");
    // Claims four gigabytes.
    says(b"\x80\x04B\xff\xff\xff\xff", "cut off");
    // A thousand nested tuples are no reason to recurse.
    let mut deep = vec![b')'];
    deep.extend(std::iter::repeat_n(0x85, 1_000_000));
    deep.push(b'.');
    says(&deep, "the pickle holds no dictionary");
    // The same text encoded over and over.
    let mut bomb = b"c_codecs\nencode\nq\x00X\x00\x00\x01\x00".to_vec();
    bomb.extend(std::iter::repeat_n(b'a', 1 << 16));
    bomb.extend(b"q\x01X\x06\x00\x00\x00latin1q\x02");
    bomb.extend(b"h\x00h\x01h\x02\x86R".repeat(100_000));
    says(&bomb, "over and over");
    // One dictionary of frames for very many points.
    let mut many = b"}q\x00(".to_vec();
    for frame in 0..1000_u16 {
        many.extend([b'M', frame as u8, (frame >> 8) as u8]);
        many.extend(b"K\x01K\x02\x86\x88\x86");
    }
    many.extend(b"u0}(");
    for point in 0..20_000_u16 {
        many.extend([b'M', point as u8, (point >> 8) as u8, b'h', 0]);
    }
    many.extend(b"u.");
    let error = read_pickle(&many, &stamps(1000)).unwrap_err().to_string();
    assert!(error.contains("more labels than it has bytes"), "{error}");
}

fn any_provenance() -> impl Strategy<Value = Provenance> {
    (prop::option::of(0.0..=1.0_f64), prop::option::of(any::<u32>()), any::<bool>())
        .prop_map(|(confidence, tracker_version, seeded)| Provenance { confidence, tracker_version, seeded })
}

pub(super) fn any_labels() -> impl Strategy<Value = LabelSet> {
    let source = prop::sample::select(vec![
        ObservationSource::Manual,
        ObservationSource::Auto,
        ObservationSource::Detected,
        ObservationSource::Interpolated,
    ]);
    let observation =
        ((0..50_i64), (-1e4..1e4_f64), (-1e4..1e4_f64), source, any::<[bool; 3]>(), any_provenance());
    let row =
        ("[^\\s#][^\\s]{0,4}", observation).prop_map(|(point, (at, u, v, source, [k, o, n], provenance))| {
            LabelRow {
                point,
                observation: Observation {
                    stamp: Stamp::from_nanos(1_403_715_273_262_142_976 + at),
                    px: Pixel::new(u, v),
                    source,
                    keyframe: k,
                    occluded: o,
                    uncertain: n,
                    provenance,
                    line: 0,
                },
            }
        });
    prop::collection::vec(row, 1..20)
        .prop_filter_map("a point is labelled once a frame", |rows| LabelSet::from_rows(rows).ok())
}

fn without_lines(labels: &LabelSet) -> Vec<(String, Vec<Observation>)> {
    let bare = |o: Observation| Observation { line: 0, provenance: Provenance::default(), ..o };
    labels.points().iter().map(|p| (p.name.clone(), p.observations.iter().map(bare).collect())).collect()
}

proptest! {
    #[test]
    fn csv_keeps_everything(labels in any_labels()) {
        let mut bytes = Vec::new();
        write_csv(&mut bytes, &labels).unwrap();
        prop_assert_eq!(without_lines(&read_csv(&bytes).unwrap()), without_lines(&labels));
    }

    #[test]
    fn json_keeps_everything(mut labels in any_labels(), dataset in prop::option::of("\\PC*")) {
        labels.dataset = dataset;
        let mut bytes = Vec::new();
        write_json(&mut bytes, &labels).unwrap();
        prop_assert_eq!(read_json(&bytes).unwrap(), labels);
    }

    #[test]
    fn no_bytes_make_a_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), at in any::<prop::sample::Index>()) {
        let (_, _, _) = (read_csv(&bytes), read_json(&bytes), read_pickle(&bytes, &stamps(4)));
        let mut pickle = PICKLES[at.index(PICKLES.len())].1.to_vec();
        let from = at.index(pickle.len());
        for (place, byte) in pickle[from..].iter_mut().zip(&bytes) {
            *place = *byte;
        }
        let _ = read_pickle(&pickle, &stamps(4));
    }
}

#[test]
fn columns_of_labels_have_other_names_and_units_too() {
    for text in [
        "point,timestamp_ns,u_px,v_px,keyframe\na,1500000000,1.5,2.5,1\n",
        "Point;t_s;u;v;key_frame\na;1.5;1.5;2.5;1\n",
        "label\ttimestamp [us]\tx [px]\ty [px]\tis_keyframe\na\t1500000\t1.5\t2.5\ttrue\n",
        "\u{feff}# made by hand\nid_of_nothing,point_id,stamp_ms,pixel_x,pixel_y,keyframe\n7,a,1500,1.5,2.5,1\n",
        "point,timestamp,u_px,v_px,keyframe\n\u{feff}a,1.5,1.5,2.5,1\n",
    ] {
        let file = read_csv_file(text.as_bytes()).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let point = &file.labels.points()[0];
        let o = point.observations.first().unwrap();
        assert_eq!(
            (point.name.as_str(), o.stamp.as_nanos(), o.px),
            ("a", 1_500_000_000, Pixel::new(1.5, 2.5)),
            "{text}"
        );
        assert_eq!(file.suspicions.iter().any(|s| s.evidence == "id_of_nothing"), text.contains("nothing"));
    }
    for (heading, expected) in [
        ("point,timestamp_ns,u,x,v,keyframe", "`u` and `x` could both be u_px"),
        ("point,stamp_ns,time_s,u,v,keyframe", "could both be the stamps"),
        ("point,u,v,keyframe", "the column timestamp_ns is missing"),
    ] {
        let error = csv(&format!("{heading}\n")).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn labels_without_a_pixel_are_gaps_and_rounded_stamps_are_named() {
    let head = "point,timestamp_ns,u_px,v_px,keyframe\n";
    let file = read_csv_file(format!("{head}a,1,1,2,1\na,2,nan,NaN,0\na,3,NaN,1,0\na,4,1,2,0\n").as_bytes())
        .unwrap();
    assert_eq!(file.labels.observation_count(), 2);
    assert_eq!(
        file.suspicions.iter().map(|s| (s.code.as_str(), s.count)).collect::<Vec<_>>(),
        [("rows-left-out", 2)]
    );
    for rows in [
        "a,1.60000E+18,1,2,1\na,1.60000E+18,1,2,0\n",
        "a,1.60000E+18,1,2,1\nb,1.60000E+18,1,2,0\n",
        "a,1.60000e+18,1,2,1\nb,1.6e+18,1,2,0\na,1.6E18,1,2,0\n",
    ] {
        let error = csv(&format!("{head}{rows}")).unwrap_err().to_string();
        assert!(error.contains("rounded to 6 digits, as a spreadsheet does"), "{error}");
    }
    // Fifteen digits, and those of a double, beside the camera's frames.
    let folder = tempfile::tempdir().unwrap();
    let frames: Vec<Stamp> =
        (0..5).map(|i| Stamp::from_nanos(1_403_715_280_562_142_976 + 50_000_064 * i)).collect();
    for (name, text, digits) in [
        ("a.csv", format!("{head}a,1403715280562140000,1,2,1\na,1403715280612140000,1,2,0\n"), 15),
        ("a.csv", format!("{head}a,1.40371528056214E+18,1,2,1\n"), 15),
        (
            "a.json",
            r#"{"schema": "vice.labels/1", "points": [{"name": "a", "observations": [{"timestamp_ns": 1403715280562143000, "px": [1, 2], "keyframe": true}]}]}"#.to_string(),
            16,
        ),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, &text).unwrap();
        let error = read(&path, Some(&frames)).unwrap_err().to_string();
        assert!(error.contains(&format!("rounded to {digits} digits")) && error.contains(name), "{error}");
        assert!(read(&path, None).is_ok());
    }
    std::fs::write(folder.path().join("a.csv"), b"PK\x03\x04rest").unwrap();
    let error = read(folder.path().join("a.csv"), None).unwrap_err().to_string();
    assert!(error.contains("ZIP archive (also .npz and .xlsx are)"), "{error}");
}

/// Lines of three points, ordinary and less so.
fn any_line() -> impl Strategy<Value = (usize, i64, usize)> {
    (0..3_usize, 1..5_i64, 0..60_usize)
}

proptest! {
    #[test]
    fn chosen_points_are_read_as_they_are_selected_from_the_whole(
        lines in prop::collection::vec(any_line(), 1..30),
        chosen in prop::sample::subsequence(vec!["a", "b 1", "c"], 1..3),
        tabs in any::<bool>(),
        known_frames in 0..3_usize,
    ) {
        let mut text = "point,timestamp_ns,u_px,v_px,keyframe,source,flags,more\n".to_string();
        let mut stamp = 1_403_715_280_000_000_000_i64;
        for (point, later, kind) in lines {
            stamp += later;
            let name = ["a", "b 1", "c"][point];
            let row = match kind {
                0 => "# a remark, by hand".to_string(),
                1 => String::new(),
                2 => format!("{name},{},1,2,0,,,", stamp - 3),
                3 => format!("{name},{stamp},nan,2,0,,,"),
                4 => format!("\"{name}\",{stamp},1,2,0,,,"),
                5 => format!("{name},{stamp},1e3,+2,1,,,"),
                6 => format!("{name},{stamp},1,2,0,auto,occluded+uncertain,x"),
                7 => format!("{name},{stamp},1,2,0,auto\r"),
                8 => format!("{name},{stamp},1,oops,0,,,"),
                9 => format!("{name},{stamp},1,2,0,,,\r"),
                10 => format!("{name},1.403715280E18,1,2,0,,,"),
                11 => format!(",{stamp},1,2,0,,,"),
                _ => format!(" {name} ,{stamp} , {}.25,-2,{},detected,,", kind, kind % 2),
            };
            text += &row;
            text.push('\n');
        }
        if tabs {
            text = text.replace(',', "\t");
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("labels.csv");
        std::fs::write(&path, &text).unwrap();
        let at_frame = Stamp::from_nanos(stamp);
        let frames: Option<Vec<Stamp>> = [None, Some(vec![at_frame]), Some(vec![Stamp::from_nanos(7)])][known_frames].clone();
        let points: Vec<String> = chosen.iter().map(|p| (*p).to_string()).collect();
        let whole = read_file(&path, frames.as_deref());
        let some = read_points(&path, frames.as_deref(), &points);
        match (whole, some) {
            (Ok(whole), Ok(some)) => {
                let labels = whole.labels.select(&points).unwrap_or_else(|_| whole.labels.clone());
                prop_assert_eq!(some, LabelFile { labels, ..whole });
            }
            (Err(whole), Err(some)) => prop_assert_eq!(whole.to_string(), some.to_string()),
            (whole, some) => prop_assert!(false, "{whole:?} is not {some:?} of\n{text}"),
        }
    }
}
