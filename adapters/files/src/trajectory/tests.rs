use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use vice_core::frames::{Rigid, WorldFromBody};
use vice_core::time::Stamp;
use vice_core::trajectory::RelativeMotion;

use super::*;
use crate::atomic::Overwrite;
use crate::rows::Rows;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    fn path(&self) -> &Path {
        self.0.path()
    }
}

fn parse(text: &str) -> DataResult<Parsed> {
    read_rows(Rows::new(text.as_bytes()))
}

fn stamped(text: &str) -> TrajectoryFile {
    match parse(text).unwrap() {
        Parsed::Stamped(file) => file,
        Parsed::Kitti(..) => panic!("not a KITTI file"),
    }
}

const EUROC_ROW: &str = "1403715273262142976,0.878895,2.1834,0.948427,0.069433,-0.824237,-0.106942,-0.551702";

#[test]
fn formats_are_told_by_content() {
    let tum = stamped("# t x\n1403715278.76214 1 2 3 0 0 0 1\n1403715279 4 5 6 0 0 0 1 9 9 9\n");
    assert_eq!((tum.format, tum.trajectory.len()), (TrajectoryFormat::Tum, 2));
    assert_eq!(tum.trajectory.start().as_nanos(), 1_403_715_278_762_140_000);
    assert_eq!(tum.trajectory.poses()[1].translation(), Vector3::new(4.0, 5.0, 6.0));
    let tum = stamped("timestamp,tx,ty,tz,qx,qy,qz,qw\r\n0,1,2,3,0,0,0,1\r\n");
    assert_eq!(tum.format, TrajectoryFormat::Tum);
    // Twelve columns that hold no rotation: a pose and four more.
    assert_eq!(stamped("1 1 2 3 0 0 0 1 9 9 9 9\n").format, TrajectoryFormat::Tum);

    let euroc = stamped(&format!("#timestamp [ns],p\r\n{EUROC_ROW}\r\n"));
    assert_eq!((euroc.format, euroc.inertial), (TrajectoryFormat::Euroc, None));
    assert_eq!(euroc.trajectory.start().as_nanos(), 1_403_715_273_262_142_976);
    assert!((euroc.trajectory.poses()[0].rotation().i + 0.824_237).abs() < 1e-6);
    let full = stamped(&format!("{EUROC_ROW},1,2,3,4,5,6,7,8,9\n"));
    let inertial = full.inertial.unwrap()[0];
    assert_eq!(inertial.velocity_m_s, Vector3::new(1.0, 2.0, 3.0));
    assert_eq!(inertial.gyro_bias_rad_s, Vector3::new(4.0, 5.0, 6.0));
    assert_eq!(inertial.accel_bias_m_s2, Vector3::new(7.0, 8.0, 9.0));
    // Milliseconds by mistake are still this format: the caller compares the time ranges.
    let millis = format!("1403715273262,0,0,0,1,0,0,0,{}0\n", "0,".repeat(8));
    assert_eq!(stamped(&millis).format, TrajectoryFormat::Euroc);

    let Parsed::Kitti(found, _) = parse("0 -1 0 5 1 0 0 6 0 0 1 7\n").unwrap() else { panic!() };
    assert_eq!(found.poses[0].translation(), Vector3::new(5.0, 6.0, 7.0));
}

#[test]
fn bad_rows_are_named() {
    let folder = Folder::new();
    let good = "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n";
    let says = |text: &str, expected: &str| {
        let path = folder.file("t.txt", text);
        let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    says("# head\n\n3 0 0 nan 0 0 0 1\n", "t.txt:3: none of the 1 rows has a pose");
    says(&format!("{good}nan 0 0 0 0 0 0 1\n"), "t.txt:3: column 1");
    says(&format!("{good}inf 0 0 0 0 0 0 1\n"), "t.txt:3: column 1");
    says(&format!("{good}3 0 0 0 0 inf 0 1\n"), "t.txt:3: column 6: inf is not finite");
    says(
        "1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n",
        "t.txt:2: stamp 1000000000 ns appears twice: 2 of 3",
    );
    says(&format!("{good}1.5 0 0 0 0 0 0 1\n"), "t.txt:3: stamp 1500000000 ns is earlier");
    says(&format!("{good}3 0 0 0 0 0 0 2\n"), "t.txt:3: the quaternion has length 2");
    says(&format!("{good}3 0 0 0 0 0 0 0\n"), "t.txt:3: the quaternion has length 0");
    // What the core refuses is said where nothing else is wrong.
    says(&format!("{good}3 0 0 0 0 0 0 2\n4 x 0 0 0 0 0 1\n"), "t.txt:4: column 2");
    says(&format!("{good}3 0 0 0 0 0 0 2\n4 0 0 0 0 0 0 1\n"), "t.txt:3: the quaternion has length 2");
    says(&format!("{good}3 0 0 0 0"), "t.txt:3: expected 8 columns, found 5: the last row is cut off");
    says(&format!("{good}3 0 0 0 0\n4 0 0 0 0 0 0 1\n"), "t.txt:3: expected 8 columns, found 5");
    says("1 2 3\n", "a row of 3 columns is no pose");
    says("", "the file is empty");
    says("# only\n\n", "the file is empty");
    says("timestamp,tx,ty\n", "a heading but no poses");
    says("hello world\nfoo\n", "t.txt:2: a row of 1 columns");
    says("1403715273262142976 0 0 0 0 0 0 1\n", "look like nanoseconds; seconds are expected");
    says("0 -1 0 5 1 0 0 6 0 0 1 7\n2 -1 0 5 1 0 0 6 0 0 1 7\n", "t.txt:2: the rotation matrix");
    says(
        &format!("{EUROC_ROW},1,2,3,4,5,6,7,8,9\n{EUROC_ROW},1,2\n"),
        "t.txt:2: expected 17 columns, found 10",
    );
    let missing = read(folder.path().join("none"), &ReadOptions::default()).unwrap_err().to_string();
    assert!(missing.ends_with("none: no such file"), "{missing}");
    assert!(read(folder.path(), &ReadOptions::default()).unwrap_err().to_string().contains("is a folder"));
}

#[test]
fn a_kitti_file_needs_its_times() {
    let folder = Folder::new();
    let path = folder.file("poses.txt", "1 0 0 1 0 1 0 2 0 0 1 3\n1 0 0 4 0 1 0 5 0 0 1 6\n");
    let options = ReadOptions::default();
    assert!(read(&path, &options).unwrap_err().to_string().contains("times.txt"));
    let counted = read(&path, &ReadOptions { index_as_seconds: true, times: None }).unwrap();
    assert_eq!(counted.trajectory.end().as_nanos(), 1_000_000_000);
    folder.file("times.txt", "0.1\n1.0e-1\n");
    assert!(read(&path, &options).unwrap_err().to_string().contains("times.txt:2: stamp 100000000 ns"));
    folder.file("times.txt", "0.1\n");
    assert!(read(&path, &options).unwrap_err().to_string().contains("1 times for the 2 poses"));
    folder.file("times.txt", "0.1\n0.25\n");
    assert_eq!(read(&path, &options).unwrap().trajectory.end().as_nanos(), 250_000_000);
    let times = Some(folder.file("others.txt", "5\n6\n"));
    let file = read(&path, &ReadOptions { times, index_as_seconds: false }).unwrap();
    assert_eq!((file.format, file.trajectory.start().as_nanos()), (TrajectoryFormat::Kitti, 5_000_000_000));
}

#[test]
fn relative_motions_are_chained() {
    let folder = Folder::new();
    // The body moves 1 m along its x: points come 1 m nearer, so `T^{B_t1,B_t0}` has x = -1.
    let path = folder.file("rel.txt", "# t0 t1\n10.0 10.5 -1 0 0 0 0 0 1\n10.5 11 -1 0 0 0 0 0 1\n");
    let file = read_relative(&path).unwrap();
    assert_eq!((file.format, file.trajectory.len()), (TrajectoryFormat::Relative, 3));
    assert_eq!(file.trajectory.poses()[2].translation(), Vector3::new(2.0, 0.0, 0.0));
    let says = |text: &str, expected: &str| {
        let error = read_relative(folder.file("rel.txt", text)).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    says("1 2 0 0 0 0 0 0 1\n# x\n3 4 0 0 0 0 0 0 1\n", "rel.txt:3: the motion starts at 3000000000 ns");
    says("1 1 0 0 0 0 0 0 1\n", "rel.txt:1: stamp 1000000000 ns appears twice");
    says("1 2 0 0 0 0 0 0 1\n2 1.5 0 0 0 0 0 0 1\n", "rel.txt:2: stamp 1500000000 ns is earlier");
    says("1 2 0 0 0 0 0 1\n", "rel.txt:1: expected 9 columns, found 8");
    says("1 2 0 0 0 0 0 0 3\n", "rel.txt:1: the quaternion has length 3");
    says("1 2 0 0 nan 0 0 0 1\n", "rel.txt:1: column 5: nan");
    says("", "no poses");
}

fn any_trajectory() -> impl Strategy<Value = Trajectory> {
    let pose = (prop::array::uniform3(-1e3..1e3_f64), prop::array::uniform3(-3.0..3.0_f64));
    (any::<i32>(), prop::collection::vec((1..2_000_000_000_i64, pose), 1..20)).prop_map(|(start, steps)| {
        let mut nanos = 1_403_715_273_262_142_976 + i64::from(start);
        Trajectory::from_poses(steps.into_iter().map(|(step, (t, r))| {
            nanos += step;
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(r));
            (Stamp::from_nanos(nanos), Rigid::from_parts(t.into(), rotation))
        }))
        .unwrap()
    })
}

fn same(a: &Trajectory, b: &Trajectory) -> bool {
    let off = |p: &WorldFromBody, q: &WorldFromBody| {
        let d = p.inverse() * *q;
        (p.translation() - q.translation()).norm() + vice_core::frames::rotation_angle_rad(&d.rotation())
    };
    a.stamps() == b.stamps() && a.poses().iter().zip(b.poses()).all(|(p, q)| off(p, q) < 1e-9)
}

proptest! {
    #[test]
    fn every_format_gives_a_trajectory_back(trajectory in any_trajectory()) {
        let folder = Folder::new();
        let (tum, euroc, kitti) = (folder.path().join("a.txt"), folder.path().join("a.csv"), folder.path().join("k.txt"));
        let inertial: Vec<InertialRow> = trajectory.poses().iter().map(|p| InertialRow {
            velocity_m_s: p.translation(),
            gyro_bias_rad_s: p.translation() / 3.0,
            accel_bias_m_s2: p.translation() / 7.0,
        }).collect();
        write_tum(&tum, &trajectory, Overwrite::Refuse).unwrap();
        write_euroc(&euroc, &trajectory, Some(&inertial), Overwrite::Refuse).unwrap();
        write_kitti(&kitti, folder.path().join("times.txt"), &trajectory, Overwrite::Refuse).unwrap();
        for (path, format) in [(&tum, TrajectoryFormat::Tum), (&euroc, TrajectoryFormat::Euroc), (&kitti, TrajectoryFormat::Kitti)] {
            let again = read(path, &ReadOptions::default()).unwrap();
            prop_assert_eq!(again.format, format);
            prop_assert!(same(&again.trajectory, &trajectory), "{:?}", format);
            if format == TrajectoryFormat::Euroc {
                prop_assert_eq!(again.inertial.as_ref(), Some(&inertial));
            }
        }
        prop_assert!(write_tum(&tum, &trajectory, Overwrite::Refuse).is_err());
        prop_assert!(write_euroc(&euroc, &trajectory, Some(&[]), Overwrite::Replace).is_err());
        write_euroc(&euroc, &trajectory, None, Overwrite::Replace).unwrap();
        prop_assert!(same(&read(&euroc, &ReadOptions::default()).unwrap().trajectory, &trajectory));
    }

    #[test]
    fn relative_motions_give_a_trajectory_back(trajectory in any_trajectory()) {
        let motions: Vec<RelativeMotion> = trajectory.iter().zip(trajectory.iter().skip(1)).map(|((t0, p0), (t1, p1))| {
            RelativeMotion { from: t0, to: t1, later_from_earlier: p1.inverse() * p0 }
        }).collect();
        prop_assume!(!motions.is_empty());
        let folder = Folder::new();
        let path = folder.path().join("rel.txt");
        write_relative(&path, &motions, Overwrite::Refuse).unwrap();
        let again = read_relative(&path).unwrap().trajectory;
        let first = trajectory.poses()[0];
        let chained = again.map_poses(|_, pose| first * pose.reinterpret());
        prop_assert_eq!(chained.stamps(), trajectory.stamps());
        for (p, q) in chained.poses().iter().zip(trajectory.poses()) {
            prop_assert!((p.translation() - q.translation()).norm() < 1e-7);
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[0-9 .,;#e\\-\\n\\r\"a-z]{0,200}") {
        let (_, _) = (parse(&text), read_relative_rows(Rows::new(text.as_bytes())));
    }
}
