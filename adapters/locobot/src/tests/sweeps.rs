//! Sweeps of a scanner as a scan of the scene.

use nalgebra::Point3;
use vice_core::dataset::CloudSource;

use super::*;
use crate::testing::Out;

/// A message of points with a field before the coordinates and rows that are padded.
fn sweep(nanos: i64, frame: &str, points: &[[f32; 3]], double: bool) -> Msg {
    Msg::new("/points", "sensor_msgs/PointCloud2", nanos, |o: Out| {
        let (kind, size) = if double { (8, 8) } else { (7, 4) };
        let mut out = o.header(nanos, frame).u32(1).u32(points.len() as u32).u32(4);
        for (i, (name, kind)) in [("ring", 4), ("x", kind), ("y", kind), ("z", kind)].into_iter().enumerate()
        {
            let offset = if i == 0 { 0 } else { 4 + size * (i as u32 - 1) };
            out = out.str(name).u32(offset).u8(kind).u32(1);
        }
        let step = 4 + 3 * size;
        let mut data = Vec::new();
        for p in points {
            data.extend([7, 0, 0, 0]);
            for v in p {
                match double {
                    true => data.extend(f64::from(*v).to_le_bytes()),
                    false => data.extend(v.to_le_bytes()),
                }
            }
        }
        data.extend([0; 6]);
        out.u8(0).u32(step).u32(step * points.len() as u32 + 6).data(&data).u8(1)
    })
}

fn with(sweeps: Vec<Msg>) -> Vec<Msg> {
    run().into_iter().chain(sweeps).collect()
}

fn points(data: &dyn Dataset) -> DataResult<Vec<Point3<f32>>> {
    let cloud = data.cloud()?.expect("a cloud");
    let CloudSource::Points(points) = cloud.source else { panic!("points are in memory") };
    let origin = cloud.world_from_cloud.translation().cast::<f32>();
    Ok(points.iter().map(|p| p + origin).collect())
}

#[test]
fn sweeps_are_placed_by_the_poses_of_a_stream() {
    let own = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.5], [f32::NAN, 0.0, 0.0]];
    let sweeps = vec![
        sweep(START, "base_footprint", &own, false),
        sweep(START + TENTH, "base_footprint", &own, true),
        sweep(START + 2 * TENTH, "map", &[[9.0, 8.0, 7.0]], false),
        sweep(START + 900 * TENTH, "base_footprint", &own, false),
    ];
    for (name, bytes) in
        [("run.bag", bag(&with(sweeps.clone()), "lz4", 10, true)), ("run.mcap", mcap(&with(sweeps.clone())))]
    {
        let recording = Opened::new(name, &bytes);
        assert!(recording.open(&[]).unwrap().cloud().unwrap().is_none(), "only where it is asked for");
        let data = recording.open(&[("cloud_topic", "/points"), ("cloud_stream", "slam")]).unwrap();
        let found = points(data.as_ref()).unwrap();
        let slam = data.trajectory("slam").unwrap();
        let mut expected = Vec::new();
        for stamp in [at(0), at(TENTH)] {
            let pose = slam.pose_at(stamp, Span::ZERO).unwrap();
            for p in &own[..2] {
                expected.push(pose.transform_point(&Point3::from(p.map(f64::from))));
            }
        }
        expected.push(Point3::new(9.0, 8.0, 7.0));
        assert_eq!(found.len(), expected.len(), "{name}");
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found.cast::<f64>() - expected).norm() < 1e-6, "{name}: {found} {expected}");
        }
        assert!(
            doubts(data.as_ref()).contains("1 sweeps at stamps without a pose of slam"),
            "{}",
            doubts(data.as_ref())
        );
    }
}

#[test]
fn what_cannot_be_placed_or_read_is_said() {
    let fails = |sweeps: Vec<Msg>, settings: &[(&str, &str)], expected: &str| {
        let opened = Opened::bag(&with(sweeps)).open(settings).map(|data| points(data.as_ref()));
        let error = match opened {
            Ok(found) => found.unwrap_err().to_string(),
            Err(error) => error.to_string(),
        };
        assert!(error.contains(expected), "{error}");
    };
    let one = || vec![sweep(START, "base_footprint", &[[1.0; 3]], false)];
    fails(one(), &[("cloud_topic", "/scan")], "/scan");
    fails(one(), &[("cloud_topic", "/points"), ("cloud_stream", "vo")], "no stream `vo`");
    fails(vec![sweep(START, "roof", &[[1.0; 3]], false)], &[("cloud_topic", "/points")], "roof");
    let late = vec![sweep(START + 900 * TENTH, "base_footprint", &[[1.0; 3]], false)];
    fails(late, &[("cloud_topic", "/points")], "no sweep has points and a pose");
    let broken = Msg::new("/points", "sensor_msgs/PointCloud2", START, |o| {
        o.header(START, "map")
            .u32(1)
            .u32(5)
            .u32(1)
            .str("x")
            .u32(0)
            .u8(7)
            .u32(1)
            .u8(0)
            .u32(4)
            .u32(20)
            .data(&[0; 20])
            .u8(1)
    });
    fails(vec![broken], &[("cloud_topic", "/points")], "no fields x, y and z; they have x");
}
