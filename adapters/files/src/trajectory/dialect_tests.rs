//! Tables as people and tools write them: read by their names, or refused for a true reason.

use std::path::PathBuf;

use nalgebra::Vector3;
use vice_core::suspicion::Suspicion;

use super::*;

fn read_text(name: &str, text: &str) -> DataResult<TrajectoryFile> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    read(&path, &ReadOptions::default())
}

fn lines(file: &TrajectoryFile) -> Vec<String> {
    file.suspicions.iter().map(Suspicion::line).collect()
}

/// At 1.5 s, (1, 2, 3) m, the quaternion (x 0.5, y -0.5, z 0.1, w 0.7).
fn is_the_pose(file: &TrajectoryFile, text: &str) {
    assert_eq!(file.trajectory.start().as_nanos(), 1_500_000_000, "{text}");
    let (p, q) = (file.trajectory.poses()[0].translation(), file.trajectory.poses()[0].rotation());
    assert!((p - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12, "{text}: {p}");
    let read = [q.i, q.j, q.k, q.w];
    assert!(read.iter().zip([0.5, -0.5, 0.1, 0.7]).all(|(a, b)| (a - b).abs() < 1e-9), "{text}: {read:?}");
}

#[test]
fn columns_are_read_by_name_wherever_names_are_given() {
    for text in [
        "timestamp,tx,ty,tz,qw,qx,qy,qz\n1.5,1,2,3,0.7,0.5,-0.5,0.1\n",
        "# timestamp tx ty tz qw qx qy qz\n1.5 1 2 3 0.7 0.5 -0.5 0.1\n",
        "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_x [],q_y [],q_z [],q_w []\n1500000000,1,2,3,0.5,-0.5,0.1,0.7\n",
        "num, t, x, y, z, qx, qy, qz, qw\n0, 1.5, 1, 2, 3, 0.5, -0.5, 0.1, 0.7\n",
        ",timestamp,tx,ty,tz,qx,qy,qz,qw\n0,1.5,1,2,3,0.5,-0.5,0.1,0.7\n",
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,field.pose.position.y,\
         field.pose.position.z,field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,\
         field.pose.orientation.w\n9,0,1500000000,map,1,2,3,0.5,-0.5,0.1,0.7\n"
            .replace("stamp,", "stamp [ns],")
            .as_str(),
        "qx;qy;qz;qw;pos_x (mm);pos_y (mm);pos_z (mm);time_ms\n0.5;-0.5;0.1;0.7;1000;2000;3000;1500\n",
        "t_us q_w q_x q_y q_z x y z\n1500000 0.7 0.5 -0.5 0.1 1 2 3\n",
        "header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,\
         pose.orientation.y,pose.orientation.z,pose.orientation.w\n1,500000000,1,2,3,0.5,-0.5,0.1,0.7\n",
        "\u{feff}Timestamp,PosX,PosY,PosZ,RotW,RotX,RotY,RotZ\r\n1.5,1,2,3,0.7,0.5,-0.5,0.1\r\n",
        "# made by a tool\n# x y z\n# stamp_s tx_cm ty_cm tz_cm qx qy qz qw\n1.5 100 200 300 0.5 -0.5 0.1 0.7\n",
        "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12\n1.5 1 2 3 0.5 -0.5 0.1 0.7 9 9\n",
        "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12\n1.5 1 2 3 0.5 -0.5 0.1 0.7\n",
        "timestamp,qw,qx,qy,qz,tx,ty,tz,vx,vy,vz,tracking\n1.5,0.7,0.5,-0.5,0.1,1,2,3,0,0,0,OK\n",
    ] {
        let file = read_text("t.csv", text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        is_the_pose(&file, text);
    }
    // Without names as before.
    is_the_pose(&read_text("t.txt", "1.5 1 2 3 0.5 -0.5 0.1 0.7\n").unwrap(), "TUM");
    // A heading whose names are not known names nothing.
    is_the_pose(&read_text("t.txt", "a b c d e f g h\n1.5 1 2 3 0.5 -0.5 0.1 0.7\n").unwrap(), "TUM");
}

#[test]
fn names_that_contradict_or_do_not_suffice_are_refused_with_the_facts() {
    let row = "1.5,1,2,3,0.5,-0.5,0.1,0.7";
    for (head, expected) in [
        ("timestamp,x,y,tz,x,qy,qz,qw", "`x` and `x`"),
        ("timestamp,tx,ty,tz,q0,q1,q2,q3", "is the first number w or x?"),
        ("timestamp,tx,ty,tz,roll,pitch,yaw,foo", "names angles"),
        ("frame,tx,ty,tz,qx,qy,qz,qw", "names a pose but no stamp"),
        ("timestamp,tx,ty,tz,qx,qy,qz", "x, y and z but no whole quaternion"),
        ("timestamp,tx,ty,a,qx,qy,qz,qw", "a quaternion but not x, y and z"),
        ("timestamp,tx [mm],ty [m],tz [m],qx,qy,qz,qw", "the unit of the position is not one length"),
        ("timestamp,tx [px],ty [px],tz [px],qx,qy,qz,qw", "not one length"),
        ("timestamp,tx,ty,tz,qx [deg],qy [deg],qz [deg],qw [deg]", "a part of a quaternion has no unit"),
        ("num,timestamp,tx,ty,tz,qx,qy,qz,qw", "the heading names 9 columns, the first row has 8"),
        ("t0,t1,tx,ty,tz,qx,qy,qz,qw", "rel:FILE"),
        ("timestamp [ns],tx,ty,tz,qx,qy,qz,qw", "look like seconds or milliseconds"),
        ("time,stamp,tx,ty,tz,qx,qy,qz,qw", "`time` and `stamp`"),
    ] {
        for head in [head.to_string(), format!("# {head}")] {
            let several = head.split(',').count() != 8;
            match read_text("t.csv", &format!("{head}\n{row}\n")) {
                Err(error) => {
                    let error = error.to_string();
                    assert!(
                        error.contains(expected) && error.contains("t.csv:"),
                        "{error}\nexpected {expected}"
                    );
                }
                // A comment of another number of words may be prose.
                Ok(_) => assert!(head.starts_with('#') && several, "{head}"),
            }
        }
    }
    let error = read_text("t.csv", "timestamp [s],tx,ty,tz,qx,qy,qz,qw\n1403715273262142976,1,2,3,0,0,0,1\n");
    assert!(error.unwrap_err().to_string().contains("look like nanoseconds; seconds are expected"));
    let error =
        read_text("t.csv", &format!("timestamp,tx,ty,tz,qx,qy,qz,qw\n{row},9\n")).unwrap_err().to_string();
    assert!(error.contains("names 8 columns, the first row has 9"), "{error}");
}

#[test]
fn a_column_more_or_less_is_never_guessed_away() {
    let says = |text: &str, expected: &[&str]| {
        let error = read_text("t.txt", text).unwrap_err().to_string();
        assert!(expected.iter().all(|e| error.contains(e)), "{error}\nexpected {expected:?}");
    };
    says("0 1.5 1 2 3 0 0 0 1\n1 1.6 1 2 3 0 0 0 1\n", &["9 columns, where TUM has 8", "a running number"]);
    says("1.5 1 2 3 0 0 0 1 1\n", &["9 columns", "rel:FILE"]);
    says("1403715273262142976,1,2,3,1,0,0,0,5\n", &["9 columns, where EuRoC has 8 or 17"]);
    let sixteen = format!("1403715273262142976,1,2,3,1,0,0,0{}\n", ",0".repeat(8));
    says(&sixteen, &["16 columns, where EuRoC has 8 or 17"]);
    says(&sixteen.replace(",0\n", ",0,0,0\n"), &["18 columns"]);
    says("1 2 3 0 0 0 1\n", &["a row of 7 columns is no pose"]);
    says(
        "1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0 0 0 1 9\n",
        &["t.txt:2: expected 8 columns as in the first row, found 9"],
    );
    says(
        "7 0 1.5 1 2 3 0 0 0 1\n",
        &["10 columns, where TUM has 8, and columns 5 to 8 are no unit quaternion"],
    );
    says("1 2 3 4 5 6 7 8 9 10 11 12 13 14\n", &["14 columns"]);
    // More columns behind a pose are passed over, and it is said.
    let file = read_text("t.txt", "1.5 1 2 3 0.5 -0.5 0.1 0.7 9 9 9\n").unwrap();
    is_the_pose(&file, "eleven");
    assert!(
        lines(&file)[0].contains("columns without names are passed over: 11 columns"),
        "{:?}",
        lines(&file)
    );
}

#[test]
fn matrices_stand_behind_numbers_and_stamps() {
    let matrix = "0 -1 0 5 1 0 0 6 0 0 1 7";
    let at = Vector3::new(5.0, 6.0, 7.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    let write = |text: String| std::fs::write(&path, text).unwrap();
    let counted = ReadOptions { index_as_seconds: true, times: None };
    // A running number, from wherever and with gaps; as NumPy writes it too.
    for (a, b) in [("4", "7"), ("0", "3"), ("4.000000e+00", "7.000000e+00")] {
        write(format!("{a} {matrix}\n{b} {matrix}\n"));
        let file = read(&path, &counted).unwrap();
        assert_eq!((file.format, file.trajectory.poses()[1].translation()), (TrajectoryFormat::Kitti, at));
        let spaced = file.trajectory.end().since(file.trajectory.start());
        assert_eq!(spaced.as_nanos(), 3_000_000_000, "{a} to {b}");
        let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("with a running number has no stamps of its own"), "{error}");
    }
    write(format!("1 {matrix}\n3 {matrix}\n"));
    std::fs::write(folder.path().join("times.txt"), "10\n11\n12\n13.5\n").unwrap();
    let file = read(&path, &ReadOptions::default()).unwrap();
    assert_eq!(
        (file.trajectory.start().as_nanos(), file.trajectory.end().as_nanos()),
        (11_000_000_000, 13_500_000_000)
    );
    write(format!("1 {matrix}\n4 {matrix}\n"));
    let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("4 times for the number 4 of"), "{error}");
    // Stamps of its own.
    for (first, second, nanos) in [
        ("0.5", "0.75", 500_000_000),
        ("1403715273.25", "1403715273.3", 1_403_715_273_250_000_000),
        ("1403715273262142976", "1403715273312143104", 1_403_715_273_262_142_976),
    ] {
        write(format!("{first} {matrix}\n{second} {matrix}\n"));
        let file = read(&path, &ReadOptions::default()).unwrap();
        assert_eq!(
            (file.trajectory.start().as_nanos(), file.trajectory.poses()[0].translation()),
            (nanos, at)
        );
    }
    // Whole matrices, and rows that are gaps keep their place among the times.
    write(format!("{matrix} 0 0 0 1\n{}\n{matrix} 0 0 0 1\n{matrix} 0 0 0 1\n", ["nan"; 16].join(" ")));
    let file = read(&path, &ReadOptions::default()).unwrap();
    let stamps: Vec<i64> = file.trajectory.stamps().iter().map(|s| s.as_nanos() / 100_000_000).collect();
    assert_eq!(stamps, [100, 120, 135]);
    assert!(lines(&file)[0].contains("1 of 4 rows, the first on line 2"), "{:?}", lines(&file));
    write(format!("1 {matrix}\n2 {matrix} 3\n"));
    let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("poses.txt:2: expected 13 columns as in the first row, found 14"), "{error}");
}

#[test]
fn what_the_field_writes_is_read_and_what_is_left_out_is_counted() {
    // Gaps in every spelling, with the stamp still in order.
    for gap in [
        "NaN NaN NaN NaN NaN NaN NaN",
        "nan nan nan 0 0 0 1",
        "0 0 0 -nan -nan -nan -nan",
        "NaN(ind) 0 0 0 0 0 1",
    ] {
        let text = format!("1 0 0 0 0 0 0 1\n2 {gap}\n3 {gap}\n4 0 0 0 0 0 0 1\n");
        let file = read_text("t.tum", &text).unwrap();
        assert_eq!(file.trajectory.len(), 2);
        let said = lines(&file);
        assert!(
            said.len() == 1 && said[0].contains("NaN) are left out: 2 of 4 rows, the first on line 2"),
            "{said:?}"
        );
    }
    let csv = "t_ns,x,y,z,qx,qy,qz,qw\n1,0,0,0,0,0,0,1\n2,,,,,,,\n3,null,null,null,null,null,null,null\n4,0,0,0,0,0,0,1\n";
    assert_eq!(read_text("t.csv", csv).unwrap().trajectory.len(), 2);
    let backwards = read_text("t.tum", "1 0 0 0 0 0 0 1\n3 nan 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n").unwrap_err();
    assert!(backwards.to_string().contains("t.tum:3: stamp 2000000000 ns is earlier"), "{backwards}");
    // A stamp twice: the first is kept.
    let file =
        read_text("t.tum", "1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n4 4 0 0 0 0 0 1\n").unwrap();
    let x: Vec<f64> = file.trajectory.poses().iter().map(|p| p.translation().x).collect();
    assert_eq!(x, [1.0, 2.0, 4.0]);
    assert!(lines(&file)[0].contains("left out: 1 of 4 rows, the first on line 3"), "{:?}", lines(&file));
    // Quaternions of few digits.
    let file = read_text("t.tum", "1 0 0 0 0 0 0 1.0011\n2 0 0 0 0 0 0 0.991\n3 0 0 0 0 0 0 1\n").unwrap();
    assert!(
        lines(&file)[0]
            .contains("scaled to it: 2 of 3 rows, the first on line 1, the length furthest off is 0.991")
    );
    let beyond = read_text("t.tum", "1 0 0 0 0 0 0 1.011\n").unwrap_err().to_string();
    assert!(beyond.contains("t.tum:1: the quaternion has length 1.011"), "{beyond}");
    // Parts that were put together.
    let file = read_text(
        "t.tum",
        "\u{feff}# a\n1 0 0 0 0 0 0 1\n\u{feff}2 0 0 0 0 0 0 1\n\u{feff}# b\n3 0 0 0 0 0 0 1\n",
    );
    assert_eq!(file.unwrap().trajectory.len(), 3);
    // Relative motions by their names; a motion that is missing is no gap.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rel.csv");
    let relative = |text: &str| {
        std::fs::write(&path, text).unwrap();
        read_relative(&path).map_err(|e| e.to_string())
    };
    for text in [
        "t0,t1,tx,ty,tz,qw,qx,qy,qz\n1,2,-1,0,0,1,0,0,0\n",
        "# t1 t0 qx qy qz qw x y z\n2 1 0 0 0 1 -1 0 0\n",
        "id;from_s;to_s;x [cm];y [cm];z [cm];qw;qx;qy;qz\n0;1;2;-100;0;0;1;0;0;0\n",
    ] {
        let file = relative(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert_eq!(file.trajectory.poses()[1].translation(), Vector3::new(1.0, 0.0, 0.0), "{text}");
        assert_eq!(file.trajectory.end().as_nanos(), 2_000_000_000, "{text}");
    }
    assert!(relative("1 2 nan 0 0 0 0 0 1\n").unwrap_err().contains("rel.csv:1: column 3: nan"));
    assert!(
        relative("0 1 2 0 0 0 0 0 0 1\n").unwrap_err().contains("10 columns, where a relative motion has 9")
    );
    assert!(
        relative("t0,tx,ty,tz,qw,qx,qy,qz,a\n1,2,-1,0,0,1,0,0,0\n")
            .unwrap_err()
            .contains("1 columns are named as stamps")
    );
}

#[test]
fn lengths_that_cannot_be_metres_are_suspected() {
    let file = |scale: f64, head: &str| {
        let rows: String = (0..20)
            .map(|i| format!("{} {} 0 0 0 0 0 1\n", 0.05 * f64::from(i), f64::from(i) * scale))
            .collect();
        lines(&read_text("t.tum", &format!("{head}{rows}")).unwrap())
    };
    assert!(file(0.05, "").is_empty(), "1 m/s");
    assert!(file(50.0, "")[0].contains("faster than 1000 m/s"), "millimetres");
    assert!(file(5.0, "")[0].contains("millimetres or centimetres"), "centimetres");
    assert!(file(50.0, "# t tx [mm] ty [mm] tz [mm] qx qy qz qw\n").is_empty(), "as the heading says");
}

fn shared(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("VICE_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join("data/dialects").join(name);
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var("VICE_REQUIRE_DATA").as_deref() != Ok("1"), "{} is missing", path.display());
    println!("skipped: {} is not there", path.display());
    None
}

#[test]
fn files_of_other_tools_are_read() {
    for (name, format, poses, suspicions) in [
        ("V102.txt", TrajectoryFormat::Tum, 803, 1),
        ("V102_groundtruth.csv", TrajectoryFormat::Euroc, 16702, 0),
        ("dpvo_ns_space_wxyz_V1_03.txt", TrajectoryFormat::Tum, 2094, 0),
        ("fr2_desk_ORB.txt", TrajectoryFormat::Tum, 2893, 0),
        ("fr2_desk_groundtruth.txt", TrajectoryFormat::Tum, 20_956, 1),
        ("tum_magistrale1_512_16_vinsmono.txt", TrajectoryFormat::Tum, 3759, 1),
    ] {
        let Some(path) = shared(name) else { return };
        let file = read(&path, &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let said = lines(&file);
        assert_eq!(
            (file.format, file.trajectory.len(), said.len()),
            (format, poses, suspicions),
            "{name}: {said:?}"
        );
    }
    let Some(path) = shared("idx13.txt") else { return };
    let file = read(&path, &ReadOptions { index_as_seconds: true, times: None }).unwrap();
    assert_eq!((file.format, file.trajectory.len()), (TrajectoryFormat::Kitti, 8));
    assert_eq!(file.trajectory.start().as_nanos(), 4_000_000_000, "the number in its first row");
}
