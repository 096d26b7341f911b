//! Pictures of planes whose depth is known, by two cameras with other lenses and a turn between them.

use nalgebra::{UnitQuaternion, Vector3};
use vice_core::camera::Model;
use vice_core::dataset::{Image, PixelFormat, Plane};
use vice_core::frames::BodyFromCamera;
use vice_core::trajectory::Trajectory;

use super::*;

/// A wall: where a ray meets it, and how bright it is there.
#[derive(Clone, Copy)]
struct Wall {
    normal: Vector3<f64>,
    distance_m: f64,
    stripes: bool,
}

impl Wall {
    fn meets(&self, from: &Vector3<f64>, ray: &Vector3<f64>) -> Vector3<f64> {
        from + ray * ((self.distance_m - self.normal.dot(from)) / self.normal.dot(ray))
    }

    fn gray(&self, p: &Vector3<f64>) -> f64 {
        let wave = |fx: f64, fy: f64, phase: f64| (fx * p.x + fy * p.y + phase).sin();
        match self.stripes {
            true => 128.0 + 90.0 * wave(40.0, 0.0, 0.0),
            false => {
                128.0
                    + 25.0 * wave(31.0, 7.3, 0.4)
                    + 25.0 * wave(-11.7, 29.1, 1.9)
                    + 20.0 * wave(53.9, -47.3, 2.2)
                    + 20.0 * wave(17.3, 61.7, 0.1)
                    + 15.0 * wave(-5.1, 3.7, 0.9)
            }
        }
    }
}

struct Rig {
    cameras: [Camera; 2],
    poses: [BodyFromCamera; 2],
    wall: Wall,
}

impl Rig {
    fn new(wall: Wall) -> Self {
        let lens = |name: &str, c: &[f64]| Model::from_name(name, c).unwrap();
        let first =
            Camera::new(320, 240, [210.0, 211.0, 160.5, 119.0], lens("radtan", &[-0.2, 0.05, 1e-4, -2e-4]));
        let second = Camera::new(320, 240, [190.0, 190.0, 158.0, 121.0], lens("ds", &[-0.1, 0.55]));
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.03, -0.05, 0.09));
        Self {
            cameras: [first.unwrap(), second.unwrap()],
            poses: [
                BodyFromCamera::identity(),
                BodyFromCamera::from_parts(Vector3::new(0.12, 0.01, -0.02), turn),
            ],
            wall,
        }
    }
}

impl Dataset for Rig {
    fn name(&self) -> &str {
        "rig"
    }
    fn format(&self) -> &str {
        "memory"
    }
    fn cameras(&self) -> Vec<String> {
        vec!["0".to_string(), "1".to_string()]
    }
    fn camera(&self, camera: &str) -> DataResult<Camera> {
        Ok(self.cameras[camera.parse::<usize>().unwrap()])
    }
    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        let late = if camera == "1" { 1_000_000 } else { 0 };
        Ok(Arc::new([Stamp::from_nanos(late), Stamp::from_nanos(50_000_000 + 100 * late)]))
    }
    fn image(&self, camera: &str, _: usize) -> DataResult<Image> {
        let which = camera.parse::<usize>().unwrap();
        let (lens, pose) = (&self.cameras[which], &self.poses[which]);
        let mut data = Vec::new();
        for v in 0..240 {
            for u in 0..320 {
                let ray = lens.unproject(Pixel::new(f64::from(u), f64::from(v)));
                let gray = ray.map_or(0.0, |ray| {
                    self.wall.gray(&self.wall.meets(&pose.translation(), &pose.rotate(&ray)))
                });
                data.push(gray.round().clamp(0.0, 255.0) as u8);
            }
        }
        Image::new(320, 240, PixelFormat::Gray8, data)
    }
    fn body_from_camera(&self, camera: &str, _: Stamp) -> DataResult<BodyFromCamera> {
        Ok(self.poses[camera.parse::<usize>().unwrap()])
    }
    fn streams(&self) -> Vec<String> {
        Vec::new()
    }
    fn trajectory(&self, _: &str) -> DataResult<Trajectory> {
        Err(DataError::new("none"))
    }
}

fn keyframe(rig: &Rig, frame: usize) -> Keyframe<'_> {
    Keyframe {
        stamp: rig.frames("0").unwrap()[frame],
        frame,
        camera: &rig.cameras[0],
        body_from_camera: rig.poses[0],
        world_from_camera: None,
        floor: Floor::World(Plane::z_zero()),
    }
}

fn grid() -> Vec<Pixel> {
    (0..9)
        .flat_map(|i| (0..7).map(move |j| Pixel::new(30.3 + 32.0 * f64::from(i), 25.7 + 31.0 * f64::from(j))))
        .collect()
}

#[test]
fn depths_of_a_slanted_wall_are_those_of_its_plane() {
    let normal = Vector3::new(0.25, -0.15, 1.0).normalize();
    // Farther away the finest waves of the pattern are as short as two pixels.
    for distance_m in [0.8, 1.5] {
        let rig = Arc::new(Rig::new(Wall { normal, distance_m, stripes: false }));
        let source = StereoDepth::new(rig.clone(), "0", "1").unwrap();
        let pixels = grid();
        let found = source.depths(&keyframe(&rig, 0), &pixels).unwrap();
        let mut matched = 0;
        for (px, depth) in pixels.iter().zip(&found) {
            let Ok(depth) = depth else { continue };
            matched += 1;
            let ray = rig.cameras[0].unproject(*px).unwrap();
            let exact = rig.wall.meets(&Vector3::zeros(), &ray).z;
            // Half a pixel of the second image.
            let bound = 0.5 * exact * exact / (190.0 * 0.12);
            assert!((depth.z_m - exact).abs() < bound, "{px:?}: {} instead of {exact}", depth.z_m);
            let unsure = 0.3 * exact / (190.0 * 0.12);
            assert!(depth.on_edge || unsure < 0.015, "{px:?} at {exact} m is not sure");
        }
        println!("{distance_m} m: {matched} of {} pixels", pixels.len());
        assert!(2 * matched > pixels.len(), "{distance_m} m: {matched}");
        assert!(source.suspicions().is_empty());
    }
}

#[test]
fn what_is_seen_again_and_again_or_not_at_all_has_no_depth() {
    let wall = Wall { normal: Vector3::z(), distance_m: 1.5, stripes: true };
    let rig = Arc::new(Rig::new(wall));
    let source = StereoDepth::new(rig.clone(), "0", "1").unwrap();
    let found = source.depths(&keyframe(&rig, 0), &grid()).unwrap();
    let answered = found.iter().filter(|d| d.is_ok()).count();
    assert!(answered * 10 < found.len(), "{answered} of {} on stripes", found.len());
    let outside = source.depths(&keyframe(&rig, 0), &[Pixel::new(-9.0, 5.0), Pixel::new(2.0, 5.0)]).unwrap();
    assert_eq!(outside, [Err(DepthMiss::OutsideImage), Err(DepthMiss::NoMatch)]);
    // The second camera's other frame is 100 ms late.
    let alone = source.depths(&keyframe(&rig, 1), &[Pixel::new(100.0, 100.0)]).unwrap();
    assert_eq!(alone, [Err(DepthMiss::NoMatch)]);
    assert!(
        source.suspicions()[0].line().contains("1 key frames without one"),
        "{}",
        source.suspicions()[0].line()
    );
    assert!(StereoDepth::new(rig, "0", "0").is_err());
}

#[test]
fn cameras_at_one_place_are_no_pair() {
    let mut rig = Rig::new(Wall { normal: Vector3::z(), distance_m: 1.5, stripes: false });
    rig.poses[1] = rig.poses[0];
    let rig = Arc::new(rig);
    let source = StereoDepth::new(rig.clone(), "0", "1").unwrap();
    let error = source.depths(&keyframe(&rig, 0), &grid()).unwrap_err().to_string();
    assert!(error.contains("no pair that sees depth"), "{error}");
}
