//! Lists, tables and calibrations as people have them.

use std::fs;

use vice_core::dataset::{GROUND_TRUTH, Image, PixelFormat};
use vice_core::time::Stamp;
use vice_files::image_file::{encode_depth_png, encode_png};

use super::tests::{Sequence, T0, TURNED, problem};

#[test]
fn lists_are_read_by_the_names_of_their_columns() {
    let sequence = Sequence::new();
    let rows = |head: &str, row: &dyn Fn(i64, i64) -> String| {
        let rows: String = (0..3).map(|i| row(T0 + i * 50_000_000, i)).collect();
        sequence.write("mav0/cam0/data.csv", &format!("{head}\n{rows}"));
        let dataset = sequence.dataset();
        let frames = dataset.frames("cam0").unwrap();
        assert_eq!(
            frames.iter().map(|s| s.as_nanos() - T0).collect::<Vec<_>>(),
            [0, 50_000_000, 100_000_000],
            "{head}"
        );
        assert_eq!(dataset.image("cam0", 2).unwrap().data(), [2; 8], "{head}");
    };
    rows("timestamp [ns],filename", &|t, _| format!("{t},{t}.png\n"));
    rows("\u{feff}timestamp,file_name", &|t, _| format!("{t},{t}.png\n"));
    rows("filename;t_us", &|t, _| format!("{t}.png;{}\n", t / 1000));
    rows("# index time_s image_name", &|t, i| {
        format!("{i} {}.{:09} {t}.png\n", t / 1_000_000_000, t % 1_000_000_000)
    });
    // A simulation counts from zero, and says no unit.
    sequence.write("mav0/cam0/data.csv", "timestamp,filename\n0,a.png\n50000000,b.png\n");
    assert_eq!(sequence.dataset().frames("cam0").unwrap()[1].as_nanos(), 50_000_000);
    sequence.write("mav0/cam0/data.csv", "timestamp,filename\n1,a.png,3\n");
    assert!(
        problem(sequence.dataset().frames("cam0"))
            .contains("data.csv:1: the heading names 2 columns, the first row has 3")
    );
    sequence.write("mav0/imu0/data.csv", &format!("timestamp [ns],ax,ay,az,gx,gy,gz\n{T0},0,0,9.81,1,0,0\n"));
    sequence.write("mav0/cam0/data.csv", &format!("timestamp [ns],filename\n{T0},{T0}.png\n"));
    assert_eq!(sequence.dataset().imu().unwrap()[0].gyro_rad_s.x, 1.0);
}

#[test]
fn pictures_of_another_size_than_the_calibration_are_refused_with_both() {
    for (width, height) in [(2, 1), (8, 4), (4, 3)] {
        let sequence = Sequence::new();
        let image =
            Image::new(width, height, PixelFormat::Gray8, vec![1; (width * height) as usize]).unwrap();
        // The first in the list that is there counts.
        for (i, bytes) in [vec![], encode_png(&image).unwrap()].iter().enumerate() {
            let name = format!("mav0/cam0/data/{}.png", T0 + i as i64 * 50_000_000);
            sequence.write_bytes(&name, bytes);
        }
        let error = problem(sequence.dataset().camera("cam0"));
        assert!(
            error.contains("the calibration is of 4x2 images")
                && error.contains(&format!("has {width}x{height} pixels")),
            "{error}"
        );
    }
    let sequence = Sequence::new();
    fs::remove_dir_all(sequence.0.path().join("mav0/cam0/data")).unwrap();
    let dataset = sequence.dataset();
    dataset.camera("cam0").unwrap();
    assert!(dataset.suspicions().is_empty(), "no pictures at all are no fault");
}

#[test]
fn pictures_that_are_missing_are_counted_and_their_stamps_stay() {
    let sequence = Sequence::new();
    fs::remove_file(sequence.0.path().join(format!("mav0/cam0/data/{}.png", T0 + 50_000_000))).unwrap();
    let dataset = sequence.dataset();
    assert_eq!(dataset.frames("cam0").unwrap().len(), 3);
    let said: Vec<String> = dataset.suspicions().iter().map(|s| s.line()).collect();
    assert!(
        said.len() == 1 && said[0].contains("pictures that the list names are not there: 1 of 3"),
        "{said:?}"
    );
}

#[test]
fn poses_of_a_motion_capture_are_the_reference() {
    let sequence = Sequence::new();
    let poses = format!(
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n{T0},1,2,3,1,0,0,0\n"
    );
    sequence.write("mav0/mocap0/data.csv", &poses);
    let dataset = sequence.dataset();
    assert_eq!(dataset.streams(), [GROUND_TRUTH]);
    assert_eq!(dataset.trajectory(GROUND_TRUTH).unwrap().poses()[0].translation().z, 3.0);
    // Poses in a folder of another name are not taken by themselves.
    for (folder, table) in [
        ("gt0", poses.clone()),
        ("optitrack", format!("{T0},1,2,3,1,0,0,0\n")),
        ("truth", "t tx ty tz qw qx qy qz\n1 1 2 3 1 0 0 0\n".to_string()),
    ] {
        let sequence = Sequence::new();
        sequence.write(&format!("mav0/{folder}/data.csv"), &table);
        let dataset = sequence.dataset();
        assert!(dataset.streams().is_empty());
        let said: Vec<String> = dataset.suspicions().iter().map(|s| s.line()).collect();
        assert!(said.len() == 1 && said[0].contains(folder) && said[0].contains("--reference"), "{said:?}");
        assert!(dataset.facts().iter().any(|f| f.text.contains("looks like poses")));
    }
    let sequence = Sequence::new();
    sequence.write("mav0/lidar0/data.csv", &format!("{T0},1.bin\n"));
    assert!(sequence.dataset().suspicions().is_empty());
}

#[test]
fn keys_of_the_calibration_are_used_or_refused_by_name() {
    let sequence = Sequence::new();
    let good = format!("T_BS: {{data: {TURNED}}}\nresolution: [4, 2]\nintrinsics: [3, 3, 1, 1]\n");
    let camera = |more: &str| {
        sequence.write("mav0/cam0/sensor.yaml", &format!("{good}{more}"));
        let dataset = sequence.dataset();
        let camera = dataset.camera("cam0").map_err(|e| e.to_string())?;
        Ok::<_, String>((camera, dataset.suspicions().iter().map(|s| s.line()).collect::<Vec<_>>()))
    };
    let (_, said) = camera("rate_hz: 20\ncomment: x\nsensor_type: camera\ngamma: 2.2\n").unwrap();
    assert!(said.len() == 1 && said[0].ends_with("keys that are not known are not used: gamma"), "{said:?}");
    let padded = "distortion_model: plumb_bob\ndistortion_coefficients: [-0.1, 0.01, 0, 0, 0.2, 0, 0, 0]\n";
    assert_eq!(camera(padded).unwrap().0.model().coefficients().len(), 5);
    for (more, expected) in [
        ("T_cam_imu: [[0,1,0,0],[-1,0,0,0],[0,0,1,0.5],[0,0,0,1]]\n", "contradict each other by 0.500 m"),
        ("timeshift_cam_imu: 0.003\n", "--time-offset -0.003000000"),
        ("T_sensor_rig: [1, 2]\n", "the key `T_sensor_rig` is about geometry"),
        ("binning_x: 2\n", "the key `binning_x`"),
    ] {
        let error = camera(more).unwrap_err();
        assert!(error.contains(expected) && error.contains("sensor.yaml"), "{error}");
    }
}

#[test]
fn a_scale_of_depth_that_cannot_be_is_suspected() {
    for (scale, suspected) in [("1", true), ("0.000001", true), ("0.001", false)] {
        let sequence = Sequence::new();
        let description = format!("sensor_type: depth\nregistered_to: cam0\nmetres_per_count: {scale}\n");
        sequence.write("mav0/depth0/sensor.yaml", &description);
        sequence.write("mav0/depth0/data.csv", &format!("timestamp,filename\n{T0},a.png\n"));
        let image = vice_core::dataset::DepthImage::new(Stamp::default(), 4, 2, vec![1.5; 8]).unwrap();
        sequence.write_bytes("mav0/depth0/data/a.png", &encode_depth_png(&image, 0.001).unwrap());
        let dataset = sequence.dataset();
        dataset.depth_image("cam0", 0).unwrap().unwrap();
        let said: Vec<String> = dataset.suspicions().iter().map(|s| s.line()).collect();
        assert_eq!(said.iter().any(|s| s.contains("metres_per_count")), suspected, "{said:?}");
    }
}
