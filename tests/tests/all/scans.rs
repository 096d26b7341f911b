//! Scans, faces and calibrations that a user gives in place of the data set's.

use std::fs;
use std::path::{Path, PathBuf};

use vice_tests::{shared, vice};

/// What an evaluation of the ground truth finds.
fn rmse(dataset: &Path, options: &[&str]) -> serde_json::Value {
    let labels = dataset.join("labels/board.csv");
    let mut args = vec!["evaluate".to_string(), dataset.display().to_string(), "--labels".to_string()];
    args.push(labels.display().to_string());
    args.extend(
        ["--estimate", "ground-truth", "--reference", "none", "--json", "-", "-q"].map(str::to_string),
    );
    args.extend(options.iter().map(|o| (*o).to_string()));
    let run = vice(&args);
    assert!(run.code == 0 || run.code == 3, "{}", run.stderr);
    serde_json::from_str::<serde_json::Value>(&run.stdout).unwrap()["pixel"].clone()
}

/// The points of a binary PLY whose vertices start with three floats.
fn points(ply: &Path) -> Vec<[f32; 3]> {
    let bytes = fs::read(ply).unwrap();
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let head = String::from_utf8_lossy(&bytes[..start]).into_owned();
    assert!(head.contains("binary_little_endian"), "{head}");
    let size = 4 * head.matches("property float").count();
    let at = |row: &[u8], i: usize| f32::from_le_bytes(row[4 * i..4 * i + 4].try_into().unwrap());
    bytes[start..].chunks_exact(size).map(|row| [at(row, 0), at(row, 1), at(row, 2)]).collect()
}

fn pcd(path: &Path, points: &[[f32; 3]]) {
    let n = points.len();
    let mut file = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA binary\n"
    )
    .into_bytes();
    points.iter().flatten().for_each(|v| file.extend(v.to_le_bytes()));
    fs::write(path, file).unwrap();
}

#[test]
fn a_cloud_in_another_file_gives_the_same_depths() {
    let Some(euroc) = shared("data/euroc_v1_01") else { return };
    let ply = euroc.join("mav0/pointcloud0/data.ply");
    let own = rmse(&euroc, &["--depth", "zmap"]);
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let points = points(&ply);
    pcd(&file("cloud.pcd"), &points);
    let same = |cloud: &Path, place: Option<PathBuf>| {
        let cloud = cloud.display().to_string();
        let place = place.map(|p| p.display().to_string());
        let mut options = vec!["--depth", "zmap", "--cloud", &cloud];
        options.extend(place.iter().flat_map(|place| ["--world-from-cloud", place.as_str()]));
        rmse(&euroc, &options)
    };
    assert_eq!(same(&file("cloud.pcd"), None), own);
    assert_eq!(same(&ply, None), own);
    // In the coordinates of a map, in double precision, and placed back.
    let offset = [461_000.0, 5_428_000.0, 300.0];
    let mut text = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA binary\n",
        points.len()
    )
    .into_bytes();
    for p in &points {
        (0..3).for_each(|i| text.extend((f64::from(p[i]) + offset[i]).to_le_bytes()));
    }
    fs::write(file("map.pcd"), text).unwrap();
    fs::write(file("place.txt"), "-461000 -5428000 -300 0 0 0 1\n").unwrap();
    let moved = same(&file("map.pcd"), Some(file("place.txt")));
    let number = |value: &serde_json::Value| value[0]["rmse_px"]["1"]["mean"].as_f64().unwrap();
    assert!((number(&moved) - number(&own)).abs() < 1e-4, "{} {}", number(&moved), number(&own));
}

#[test]
fn what_is_no_scan_is_refused_in_one_line() {
    let Some(euroc) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let text = file("a.ply", b"just text\n");
    let cut = file("a.laz", b"LASF\0\0");
    let place = file("place.txt", b"1 2 3\n");
    let dataset = euroc.display().to_string();
    let labels = euroc.join("labels/board.csv").display().to_string();
    for (options, expected) in [
        (vec!["--depth", "zmap", "--cloud", "nowhere.pcd"], "nowhere.pcd: no such file"),
        (
            vec!["--depth", "zmap", "--cloud", &text],
            "is no file of points that is known: PLY, PCD, LAS or LAZ",
        ),
        (vec!["--depth", "zmap", "--cloud", &cut], "the LAS or LAZ file cannot be read"),
        (vec!["--depth", "zmap", "--world-from-cloud", &place], "3 numbers are neither a pose"),
        (
            vec!["--depth", "floor", "--mesh", &text],
            "--mesh: is of the depth source mesh, which is not asked",
        ),
        (
            vec!["--depth", "floor", "--stereo-camera", "cam1"],
            "--stereo-camera: is of the depth source stereo",
        ),
        (vec!["--depth", "stereo", "--stereo-camera", "cam7"], "cam7"),
        (
            vec!["--image-size", "640x480"],
            "the calibration is of 640x480 images, the data set's have 752x480",
        ),
        (vec!["--distortion", "ds:1"], "model ds takes 2 (xi, alpha)"),
        (vec!["--body-from-camera", "1,2,3"], "3 numbers are no pose"),
    ] {
        let mut args = vec![
            "evaluate",
            &dataset,
            "--labels",
            &labels,
            "--estimate",
            "ground-truth",
            "--reference",
            "none",
        ];
        args.extend(options.clone());
        let run = vice(&args);
        assert!(run.code != 0, "{options:?}");
        assert!(run.stderr.contains(expected), "{options:?}: {}", run.stderr);
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    }
}

#[test]
fn info_shows_the_camera_that_a_calibration_makes() {
    let Some(euroc) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camchain.yaml");
    let text = "cam0:\n  camera_model: ds\n  distortion_model: none\n  distortion_coeffs: []\n  intrinsics: [-0.2, 0.6, 400.0, 401.0, 367.0, 248.0]\n  resolution: [752, 480]\n  gain: 3\n";
    fs::write(&path, text).unwrap();
    let (dataset, file) = (euroc.display().to_string(), path.display().to_string());
    let run = vice(&["info", &dataset, "--calibration", &file]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("cam0: 752x480, ds"), "{}", run.stdout);
    assert!(run.stdout.contains("fx 400 fy 401 cx 367 cy 248, distortion [-0.2, 0.6]"), "{}", run.stdout);
    assert!(run.stdout.contains("keys that are not known are not used: gain"), "{}", run.stdout);
    let run = vice(&["info", &dataset, "--distortion", "fov:0.9", "--intrinsics", "400,401,367,248"]);
    assert!(run.stdout.contains("cam0: 752x480, fov"), "{}", run.stdout);
}

/// The depth of a second camera against the cloud, at the labelled corners of the board.
#[test]
fn a_second_camera_sees_what_the_cloud_says() {
    let Some(euroc) = shared("data/euroc_v1_01") else { return };
    let (dataset, labels) =
        (euroc.display().to_string(), euroc.join("labels/board.csv").display().to_string());
    let args = ["depth", "compare", &dataset, "--labels", &labels, "--depth", "zmap,stereo", "--json", "-"];
    let run = vice(&args);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let document: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let off = |point: &serde_json::Value| {
        let z = |i: usize| point["depths"][i]["depth_z_m"].as_f64();
        Some(z(1)? / z(0)? - 1.0)
    };
    let points = document["key_points"].as_array().unwrap();
    let mut off: Vec<f64> = points.iter().filter_map(off).map(f64::abs).collect();
    off.sort_by(f64::total_cmp);
    assert!(points.len() >= 4 && off.len() == points.len(), "{} of {}", off.len(), points.len());
    // 2 % at two metres is half a pixel between the cameras; the cloud itself is made of such pairs.
    assert!(off[off.len() / 2] < 0.02 && off[off.len() - 1] < 0.04, "{off:?}");
    let run = vice(&["depth", &dataset, "--at", "0", "--depth", "stereo", "--out", "never"]);
    assert!(run.code != 0 && run.stderr.contains("is of single points"), "{}", run.stderr);
}
