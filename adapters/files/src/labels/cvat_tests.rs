use super::super::write_cvat;
use super::*;
use proptest::prelude::*;

fn stamps(n: i64) -> Vec<Stamp> {
    (0..n).map(|i| Stamp::from_nanos(1_403_715_273_262_142_976 + 50_000_000 * i)).collect()
}

/// As CVAT writes it: no attributes of ours.
const FROM_CVAT: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<annotations>
  <version>1.1</version>
  <meta><task><size>20</size></task></meta>
  <track id="0" label="corner" source="manual">
    <points frame="2" outside="0" occluded="0" keyframe="1" points="100.50,200.75" z_order="0"></points>
    <points frame="3" outside="0" occluded="1" keyframe="0" points="102.50,201.00" z_order="0"></points>
    <points frame="4" outside="1" occluded="0" keyframe="1" points="104.50,201.25" z_order="0"></points>
    <points frame="9" outside="0" occluded="0" keyframe="1" points="50.00,60.00" z_order="0"></points>
  </track>
  <track id="4" label="tip" source="semi-auto">
    <points frame="0" outside="0" occluded="0" keyframe="1" points="0.5,0.5" z_order="0"></points>
  </track>
  <track id="7" label="corner" source="manual">
    <points frame="2" outside="0" occluded="0" keyframe="1" points="1,2" z_order="0">
      <attribute name="uncertain">true</attribute>
    </points>
  </track>
  <track id="8" label="door"><box frame="2" outside="0" keyframe="1" xtl="1" ytl="2" xbr="3" ybr="4"/></track>
</annotations>"#;

#[test]
fn what_cvat_exports_is_read() {
    let frames = stamps(20);
    let labels = read_cvat(FROM_CVAT.as_bytes(), &frames).unwrap();
    let names: Vec<&str> = labels.points().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["corner-0", "corner-7", "tip"]);
    let corner = &labels.points()[0].observations;
    let seen: Vec<_> =
        corner.iter().map(|o| (o.stamp, o.px.u, o.source.name(), o.keyframe, o.occluded, o.line)).collect();
    assert_eq!(
        seen,
        [
            (frames[2], 100.0, "manual", true, false, 6),
            (frames[3], 102.0, "interpolated", false, true, 7),
            (frames[9], 49.5, "manual", true, false, 9),
        ]
    );
    assert!(labels.points()[1].observations.first().unwrap().uncertain);
    let tip = labels.points()[2].observations.first().unwrap();
    assert_eq!((tip.px, tip.source.name()), (Pixel::new(0.0, 0.0), "auto"));
}

#[test]
fn the_line_at_fault_is_named() {
    let frames = stamps(20);
    for (from, to, expected) in [
        (
            "frame=\"9\"",
            "frame=\"20\"",
            "line 9: point corner-0: frame 20 is not among the camera's 20 frames",
        ),
        ("frame=\"9\"", "frame=\"x\"", "line 9: point corner-0: the frame is `x`, not a number"),
        ("frame=\"9\"", "frame=\"3\"", "line 9: point corner-0 is labelled twice"),
        ("50.00,60.00", "50.00,60.00;1,2", "line 9: point corner-0: `points` is `50.00,60.00;1,2`"),
        ("50.00,60.00", "NaN,2", "line 9: point corner-0 at"),
        ("occluded=\"1\"", "occluded=\"yes\"", "line 7: point corner-0: occluded is `yes`"),
        (">true<", ">maybe<", "line 15: point corner-7: the attribute uncertain is `maybe`"),
        ("</meta>", "</mota>", "line 4: the labels are not XML"),
        ("annotations>", "boxes>", "line 2: the XML is <boxes>"),
    ] {
        assert!(FROM_CVAT.contains(from));
        let error = read_cvat(FROM_CVAT.replace(from, to).as_bytes(), &frames).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}\nexpected {expected}");
    }
    let images = "<annotations><image id='0' name='a.png'><points points='1,2'/></image></annotations>";
    let error = read_cvat(images.as_bytes(), &frames).unwrap_err().to_string();
    assert!(error.contains("CVAT for video 1.1"), "{error}");
    // Entities that multiply are no XML here, and a deep nest is an error, not a stack overflow.
    let bomb = "<!DOCTYPE a [<!ENTITY b 'bbbb'>]><annotations>&b;</annotations>";
    assert!(read_cvat(bomb.as_bytes(), &frames).is_err());
    let deep = format!("<annotations>{}", "<track>".repeat(200_000));
    assert!(read_cvat(deep.as_bytes(), &frames).is_err());
    assert!(read_cvat(b"<annotations/>", &frames).is_err());
}

#[test]
fn a_point_ends_where_its_labels_do() {
    let frames = stamps(30);
    let rows = [2, 4, 6, 8, 16, 18].map(|f| LabelRow {
        point: "a<\"&".to_string(),
        observation: Observation::manual(frames[f], Pixel::new(1.0, 2.0)),
    });
    let labels = LabelSet::from_rows(rows).unwrap();
    let mut bytes = Vec::new();
    write_cvat(&mut bytes, &labels, &frames).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let outside: Vec<&str> =
        text.lines().filter(|l| l.contains("outside=\"1\"")).map(|l| l.split('"').nth(1).unwrap()).collect();
    assert_eq!(outside, ["9", "19"]);
    assert_eq!(read_cvat(text.as_bytes(), &frames).unwrap().points()[0].name, "a<\"&");
    assert!(write_cvat(&mut Vec::new(), &labels, &frames[..10]).is_err());
}

proptest! {
    #[test]
    fn everything_comes_back(rows in prop::collection::vec(("[^\\p{C}]{1,4}", 0..30_usize, -1e4..1e4_f64, any::<[bool; 3]>(), 0..4_usize), 1..20)) {
        let frames = stamps(30);
        let sources = ["manual", "auto", "detected", "interpolated"];
        let rows: Vec<LabelRow> = rows.into_iter().map(|(point, frame, u, [keyframe, occluded, uncertain], source)| {
            let source = ObservationSource::from_name(sources[source]).unwrap();
            let px = Pixel::new(u, -u / 3.0);
            LabelRow { point, observation: Observation { source, keyframe, occluded, uncertain, ..Observation::manual(frames[frame], px) } }
        }).collect();
        prop_assume!(LabelSet::from_rows(rows.clone()).is_ok());
        let labels = LabelSet::from_rows(rows).unwrap();
        let mut bytes = Vec::new();
        write_cvat(&mut bytes, &labels, &frames).unwrap();
        let read = read_cvat(&bytes, &frames).unwrap();
        prop_assert_eq!(read.points().len(), labels.points().len());
        for (a, b) in read.points().iter().zip(labels.points()) {
            prop_assert_eq!(&a.name, &b.name);
            prop_assert_eq!(a.observations.len(), b.observations.len());
            for (a, b) in a.observations.iter().zip(&b.observations) {
                prop_assert!(a.px.distance_px(b.px) < 1e-9);
                prop_assert_eq!(Observation { px: b.px, line: 0, ..a }, b);
            }
        }
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..40), at in any::<prop::sample::Index>()) {
        let mut xml = FROM_CVAT.as_bytes().to_vec();
        let from = at.index(xml.len());
        for (place, byte) in xml[from..].iter_mut().zip(&bytes) {
            *place = *byte;
        }
        let _ = read_cvat(&xml, &stamps(5));
    }
}

fn with_meta(meta: &str, frames: &[usize], task: &str) -> String {
    let points: String = frames
        .iter()
        .map(|f| {
            format!("<points frame=\"{f}\" keyframe=\"1\" outside=\"0\" occluded=\"0\" points=\"1,2\"/>")
        })
        .collect();
    format!(
        "<annotations><meta>{meta}</meta><track id=\"0\" label=\"p\" source=\"manual\"{task}>{points}</track></annotations>"
    )
}

#[test]
fn frame_numbers_are_the_cameras_or_refused() {
    let frames = stamps(20);
    let task = |more: &str| format!("<task><id>7</id><name>desk</name>{more}</task>");
    let read = |meta: &str, numbers: &[usize], of: &str| {
        read_cvat_file(with_meta(meta, numbers, of).as_bytes(), &frames).map_err(|e| e.to_string())
    };
    let indices = |file: LabelFile| -> Vec<usize> {
        let stamps = file.labels.points()[0].observations.iter().map(|o| o.stamp);
        stamps.map(|s| frames.binary_search(&s).unwrap()).collect()
    };
    let error = read(&task("<size>10</size>"), &[0, 9], "").unwrap_err();
    assert!(error.contains("the task has 10 frames, the camera 20") && error.contains("step=2"), "{error}");
    // As CVAT writes a video of every second frame, and as others do.
    let stepped = task(
        "<size>10</size><start_frame>0</start_frame><stop_frame>19</stop_frame><frame_filter>step=2</frame_filter>",
    );
    assert_eq!(indices(read(&stepped, &[0, 2, 18], "").unwrap()), [0, 2, 18]);
    assert_eq!(indices(read(&stepped, &[0, 1, 9], "").unwrap()), [0, 2, 18]);
    let doubtful = read(&stepped, &[0, 2, 4], "").unwrap();
    assert!(doubtful.suspicions.iter().any(|s| s.code == "frame-numbers"));
    // A project's export, in which tracks name their task.
    let project = |more: &str| {
        format!(
            "<project><id>1</id><name>both</name><tasks>{}{more}</tasks></project>",
            task("<size>20</size>")
        )
    };
    assert_eq!(indices(read(&project(""), &[3], " task_id=\"7\"").unwrap()), [3]);
    let other = "<task><id>8</id><name>hall</name><size>90</size></task>";
    assert_eq!(indices(read(&project(other), &[3], " task_id=\"7\"").unwrap()), [3]);
    let error = read(&project(other), &[3], " task_id=\"8\"").unwrap_err();
    assert!(error.contains("the task has 90 frames, the camera 20"), "{error}");
    let error = read(&project(other), &[3], "").unwrap_err();
    assert!(error.contains("2 tasks (`desk`, `hall`)"), "{error}");
    // A job of the second half.
    let job = "<job><id>3</id><size>10</size><start_frame>10</start_frame><stop_frame>19</stop_frame></job>";
    assert_eq!(indices(read(job, &[10, 19], "").unwrap()), [10, 19]);
    let error = read(&task("<size>10</size><frame_filter>every other</frame_filter>"), &[0], "").unwrap_err();
    assert!(error.contains("only step=N is read"), "{error}");
    let sized = task("<size>20</size><original_size><width>320</width><height>240</height></original_size>");
    let file = read(&sized, &[1], "").unwrap();
    assert!(file.check_image_size(320, 240).is_ok());
    let error = file.check_image_size(640, 480).unwrap_err().to_string();
    assert!(error.contains("320x240") && error.contains("640x480"), "{error}");
}

#[test]
fn points_of_skeletons_have_their_own_names() {
    let skeleton = |frame: usize, more: &str| {
        format!(
            "<skeleton frame=\"{frame}\" keyframe=\"1\" z_order=\"0\"{more}>\
             <points label=\"a\" keyframe=\"1\" outside=\"0\" occluded=\"0\" points=\"1.5,2.5\"/>\
             <points label=\"b\" keyframe=\"1\" outside=\"{}\" occluded=\"1\" points=\"3.5,4.5\"/></skeleton>",
            usize::from(frame == 1)
        )
    };
    let track = |id: usize| {
        format!(
            "<track id=\"{id}\" label=\"board\">{}{}{}</track>",
            skeleton(0, ""),
            skeleton(1, ""),
            skeleton(2, "")
        )
    };
    let read = |tracks: &str| {
        let labels =
            read_cvat(format!("<annotations>{tracks}</annotations>").as_bytes(), &stamps(5)).unwrap();
        let names: Vec<String> = labels.points().iter().map(|p| p.name.clone()).collect();
        (names, labels)
    };
    let (names, labels) = read(&track(0));
    assert_eq!(names, ["a", "b"]);
    let b: Vec<(bool, bool)> =
        labels.points()[1].observations.iter().map(|o| (o.keyframe, o.occluded)).collect();
    assert_eq!(b, [(true, true), (true, true)], "outside in between, so that it starts again");
    assert_eq!(labels.points()[0].observations.iter().filter(|o| o.keyframe).count(), 1);
    assert_eq!(read(&format!("{}{}", track(0), track(3))).0, ["a-0", "a-3", "b-0", "b-3"]);
    // Beside a track of points of the same label.
    let alone = "<track id=\"9\" label=\"a\"><points frame=\"0\" outside=\"0\" keyframe=\"1\" points=\"1,1\"/></track>";
    assert_eq!(read(&format!("{}{alone}", track(0))).0, ["a-0", "a-9", "b"]);
}
