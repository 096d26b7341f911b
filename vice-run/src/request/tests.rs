use vice_core::error::ErrorKind;

use super::*;

pub(crate) fn everything() -> Request {
    let mut request = Request::new(
        "my run",
        "labels.csv",
        ["odom", "rel:motions.txt", "imu-euler"].map(|e| EstimateSpec::from(e.to_string())),
    );
    request.dataset.format = Some("locobot".to_string());
    request.dataset.set.insert("stamps".to_string(), "record".to_string());
    request.dataset.calibration = Some("cal.toml".into());
    request.dataset.intrinsics = Some([500.0, 501.0, 320.5, 240.0]);
    request.dataset.distortion = Some("radtan:0.1,-0.2,0,0".parse().unwrap());
    request.dataset.image_size = Some("640x480".parse().unwrap());
    request.dataset.body_from_camera = Some(vec![0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    request.dataset.cloud = Some("hall.laz".into());
    request.dataset.mesh = Some("hall.ply".into());
    request.dataset.world_from_cloud = Some("place.txt".into());
    request.dataset.floor_plane = Some([0.0, 0.0, 1.0, -0.1]);
    request.labels.points = vec!["a".to_string()];
    request.labels.observations = Observations::Manual;
    request.protocol = Protocol {
        fps: Some(10.0),
        start: Span::parse_seconds("1.000000001").unwrap(),
        duration: Some(Span::from_millis(30_000)),
    };
    request.streams.reference = ReferenceSpec::Named(EstimateSpec::Named("truth.txt".to_string()));
    request.streams.estimate_frame = EstimateFrame::Camera;
    request.streams.time_offset = Some(Span::from_millis(-50));
    request.streams.anchor = Some(Anchor::Estimate);
    request.streams.initial_pose = Some([1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]);
    request.depth.sources = vec![DepthName::ZMap, DepthName::Tag];
    request.depth.zmap_occlusion = Some(false);
    request.depth.zmap_interpolation = Some(ZMapInterpolation::Natural);
    request.depth.tag_size_m = Some(0.1);
    request.depth.tag_family = Some(TagFamily::T25h9);
    request.depth.compare = Some(false);
    request.scoring = Scoring { subsets: vec![1, 2], align: Some(Alignment::Yaw) };
    request
}

#[test]
fn a_request_survives_its_document() {
    for request in [everything(), Request::new("a", "b", [])] {
        let text = serde_json::to_string(&request).unwrap();
        assert_eq!(serde_json::from_str::<Request>(&text).unwrap(), request, "{text}");
    }
}

#[test]
fn unknown_fields_are_refused() {
    let text = r#"{"dataset": {"path": "a"}, "labels": {"file": "b"}, "streams": {"max_gap": 1.0}}"#;
    let error = serde_json::from_str::<Request>(text).unwrap_err().to_string();
    assert!(error.contains("max_gap") && error.contains("max_gap_s"), "{error}");
}

#[test]
fn the_command_line_says_what_is_not_the_default() {
    assert_eq!(
        everything().command_line(),
        "vice evaluate 'my run' --format locobot --set stamps=record --calibration cal.toml --intrinsics 500,501,320.5,240 \
         --distortion radtan:0.1,-0.2,0,0,0 --image-size 640x480 --body-from-camera 0.1,0,0,0,0,0,1 --cloud hall.laz --mesh hall.ply \
         --world-from-cloud place.txt --floor-plane 0,0,1,-0.1 \
         --labels labels.csv --points a --observations manual --fps 10 --start 1.000000001 --duration 30 \
         --estimate odom,rel:motions.txt,imu-euler --reference truth.txt --estimate-frame camera --time-offset -0.05 \
         --anchor estimate --initial-pose 1,2,3,0,0,0,1 --depth zmap,tag --zmap-interpolation natural \
         --zmap-occlusion off --tag-size 0.1 --tag-family 25h9 --depth-check off --subsets 1,2 --align yaw"
    );
}

#[test]
fn a_setting_of_a_source_that_is_not_asked_is_refused() {
    let mut request = Request::new("a", "b", []);
    request.depth.zcam_range_m = Some([0.1, 5.0]);
    let error = request.check().unwrap_err();
    assert_eq!((error.kind(), error.field()), (ErrorKind::Usage, Some("zcam-range")));
    request.depth.sources = vec![DepthName::ZCam];
    request.check().unwrap();
    request.depth.zcam_range_m = Some([5.0, 0.1]);
    assert!(request.check().is_err());
}

#[test]
fn what_is_read_is_known_before_it_is_read() {
    let inputs = everything().inputs();
    for file in ["my run", "labels.csv", "odom", "motions.txt", "truth.txt", "cal.toml"] {
        assert!(inputs.contains(&PathBuf::from(file)), "{file}");
    }
}

#[test]
fn names_tell_the_estimates_apart() {
    let named = |names: &[&str]| {
        let estimates = ["a.txt", "imu-euler"].map(|e| EstimateSpec::from(e.to_string()));
        let mut request = Request::new("run", "l.csv", estimates);
        request.streams.names = names.iter().map(|n| (*n).to_string()).collect();
        request
    };
    assert!(named(&[]).check().is_ok() && named(&["mine", "imu"]).check().is_ok());
    for (names, problem) in [
        (&["mine"][..], "1 names for 2 estimates"),
        (&["mine", "mine"], "`mine` names no estimate of its own"),
        (&["mine", " "], "` ` names no estimate of its own"),
    ] {
        assert_eq!(named(names).check().unwrap_err().problem(), problem);
    }
    assert!(named(&[]).has_command_line() && !named(&["mine", "imu"]).has_command_line());
    let mut held = named(&[]);
    held.labels.file = "in-memory:labels@00".into();
    assert!(!held.has_command_line(), "no file holds these labels");
}
