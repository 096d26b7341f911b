//! The flight as a data set in memory.

use std::sync::{Arc, OnceLock};

use nalgebra::Point3;
use vice_core::camera::{Camera, Model, Radtan};
use vice_core::dataset::{CloudRef, CloudSource, Dataset, DepthImage, Fact, GROUND_TRUTH, Image};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{BodyFromCamera, Rigid, WorldFromCamera};
use vice_core::imu::{ImuSample, InertialState};
use vice_core::label::LabelSet;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;

use crate::cloud;
use crate::estimates::estimates;
use crate::flight::{Flight, State, body_from_camera};
use crate::labels::Filmed;
use crate::options::SyntheticOptions;
use crate::render::Renderer;
use crate::scene::{Scene, SurfaceKind};

/// The one camera.
pub const CAMERA: &str = "cam0";

/// Poses and inertial samples begin this long before the first frame and end as long after the last instant, so that
/// a stream whose clock is off still covers every frame.
const LEAD_NS: i64 = 200_000_000;

/// What the points of `labels/scene.csv` lie on.
const SCENE_POINTS: [SurfaceKind; 6] = [
    SurfaceKind::Floor,
    SurfaceKind::Box,
    SurfaceKind::Wall,
    SurfaceKind::Floor,
    SurfaceKind::Box,
    SurfaceKind::Wall,
];

/// A rendered flight through a furnished room, of which everything is known. Pictures are made when asked for.
pub struct Synthetic {
    options: SyntheticOptions,
    name: String,
    scene: Scene,
    flight: Flight,
    camera: Camera,
    renderer: Renderer,
    frames: Arc<[Stamp]>,
    world_from_camera: Vec<WorldFromCamera>,
    truth: Trajectory,
    imu: Arc<[ImuSample]>,
    estimates: Vec<(&'static str, Trajectory)>,
    cloud: OnceLock<Arc<[Point3<f32>]>>,
}

impl Synthetic {
    /// The flight of these options.
    ///
    /// # Errors
    /// [`DataError`] for options that cannot be flown.
    pub fn new(options: SyntheticOptions) -> DataResult<Self> {
        options.validate()?;
        let (scene, flight) = (Scene::new(options.seed), Flight::new(options.seed));
        let camera = camera(&options)?;
        let frames: Arc<[Stamp]> =
            (0..options.frame_count() as i64).map(|i| tick(options.start, i, options.rate_hz)).collect();
        let imu_stamps = inertial_stamps(&options);
        let at = |stamp: Stamp| flight.at(stamp.since(options.start).as_secs_f64());
        let mut stamps: Vec<Stamp> = imu_stamps.iter().chain(frames.iter()).copied().collect();
        stamps.sort_unstable();
        stamps.dedup();
        let truth = Trajectory::from_poses(stamps.into_iter().map(|s| (s, at(s).world_from_body)))
            .map_err(|e| DataError::new("the true poses").because(e))?;
        let imu = imu_stamps
            .iter()
            .map(|stamp| {
                let state = at(*stamp);
                ImuSample {
                    stamp: *stamp,
                    gyro_rad_s: state.angular_rate_rad_s + options.gyro_bias_rad_s,
                    accel_m_s2: state.specific_force_m_s2() + options.accel_bias_m_s2,
                }
            })
            .collect();
        Ok(Self {
            name: format!("synthetic-{}", options.seed),
            renderer: Renderer::new(camera)?,
            world_from_camera: frames.iter().map(|s| at(*s).world_from_body * body_from_camera()).collect(),
            estimates: estimates(&truth, &options.flaws, options.seed)?,
            cloud: OnceLock::new(),
            scene,
            flight,
            camera,
            frames,
            truth,
            imu,
            options,
        })
    }

    /// What it was made from.
    pub const fn options(&self) -> &SyntheticOptions {
        &self.options
    }

    /// The room.
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The true poses at every inertial sample and every frame.
    pub const fn truth(&self) -> &Trajectory {
        &self.truth
    }

    /// The exact state of the body at a stamp, also between and beyond the poses of [`Synthetic::truth`].
    pub fn state(&self, stamp: Stamp) -> State {
        self.flight.at(stamp.since(self.options.start).as_secs_f64())
    }

    /// The true place of the camera in a frame.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn world_from_camera(&self, frame: usize) -> WorldFromCamera {
        self.world_from_camera[frame]
    }

    /// The estimates with known flaws, by name: see [`crate::ESTIMATES`].
    pub fn estimates(&self) -> &[(&'static str, Trajectory)] {
        &self.estimates
    }

    /// The picture and the depth image of a frame, for less work than one after the other.
    ///
    /// # Errors
    /// [`DataError`] if there is no such frame.
    pub fn frame(&self, index: usize) -> DataResult<(Image, DepthImage)> {
        let stamp = self.frame_stamp(index)?;
        self.renderer.frame(&self.scene, &self.world_from_camera[index], stamp)
    }

    /// Exact labels of four points on the floor, in every frame.
    ///
    /// # Errors
    /// [`DataError`] if the floor is never in plain view.
    pub fn floor_labels(&self) -> DataResult<LabelSet> {
        self.labels(&[SurfaceKind::Floor; 4])
    }

    /// Exact labels of six points on floor, boxes and walls, in every frame.
    ///
    /// # Errors
    /// [`DataError`] if a point of a kind is never in plain view.
    pub fn scene_labels(&self) -> DataResult<LabelSet> {
        self.labels(&SCENE_POINTS)
    }

    /// Exact labels of one point for each kind of surface, named 0, 1, 2 and so on, with respawns.
    ///
    /// # Errors
    /// [`DataError`] if a point of a kind is never in plain view.
    pub fn labels(&self, kinds: &[SurfaceKind]) -> DataResult<LabelSet> {
        let filmed = Filmed {
            scene: &self.scene,
            camera: &self.camera,
            stamps: &self.frames,
            poses: &self.world_from_camera,
            rate_hz: self.options.rate_hz,
        };
        let mut labels = filmed.labels(kinds)?;
        labels.dataset = Some(self.name.clone());
        labels.camera = Some(CAMERA.to_string());
        Ok(labels)
    }

    /// The points of the cloud, made once.
    pub fn points(&self) -> Arc<[Point3<f32>]> {
        Arc::clone(self.cloud.get_or_init(|| cloud::sample(&self.scene, self.options.cloud_spacing_m)))
    }

    fn frame_stamp(&self, index: usize) -> DataResult<Stamp> {
        self.frames.get(index).copied().ok_or_else(|| {
            DataError::new(format!("there is no frame {index}; {CAMERA} has {}", self.frames.len()))
        })
    }

    fn check(&self, camera: &str) -> DataResult<()> {
        if camera == CAMERA {
            Ok(())
        } else {
            Err(DataError::new(format!("there is no camera `{camera}`")).hint(format!("known: {CAMERA}")))
        }
    }
}

impl Dataset for Synthetic {
    fn name(&self) -> &str {
        &self.name
    }

    fn format(&self) -> &str {
        "synthetic"
    }

    fn cameras(&self) -> Vec<String> {
        vec![CAMERA.to_string()]
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        self.check(camera)?;
        Ok(self.camera)
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        self.check(camera)?;
        Ok(Arc::clone(&self.frames))
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.check(camera)?;
        Ok(self.frame(index)?.0)
    }

    fn body_from_camera(&self, camera: &str, _stamp: Stamp) -> DataResult<BodyFromCamera> {
        self.check(camera)?;
        Ok(body_from_camera())
    }

    fn streams(&self) -> Vec<String> {
        [GROUND_TRUTH]
            .into_iter()
            .chain(self.estimates.iter().map(|(name, _)| *name))
            .map(String::from)
            .collect()
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        if stream == GROUND_TRUTH {
            return Ok(self.truth.clone());
        }
        self.estimates.iter().find(|(name, _)| *name == stream).map(|(_, t)| t.clone()).ok_or_else(|| {
            DataError::new(format!("there is no stream `{stream}`"))
                .hint(format!("known: {}", self.streams().join(", ")))
        })
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        Ok(Arc::clone(&self.imu))
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        if stamp < self.truth.start() || stamp > self.truth.end() {
            return Ok(None);
        }
        let state = self.state(stamp);
        Ok(Some(InertialState {
            stamp,
            world_from_body: state.world_from_body,
            velocity_m_s: state.velocity_m_s,
            gyro_bias_rad_s: self.options.gyro_bias_rad_s,
            accel_bias_m_s2: self.options.accel_bias_m_s2,
        }))
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        self.check(camera)?;
        let stamp = self.frame_stamp(index)?;
        self.renderer.depth(&self.scene, &self.world_from_camera[index], stamp).map(Some)
    }

    fn has_depth(&self, camera: &str) -> bool {
        camera == CAMERA
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        let source = CloudSource::Points(self.points());
        Ok(Some(CloudRef { source, world_from_cloud: Rigid::identity() }))
    }

    fn facts(&self) -> Vec<Fact> {
        let text = format!(
            "seed {}, {} s at {} Hz",
            self.options.seed, self.options.duration_s, self.options.rate_hz
        );
        vec![Fact { section: "flight".to_string(), text }]
    }
}

/// The instant of the `i`-th tick of a clock of that rate.
fn tick(start: Stamp, i: i64, rate_hz: f64) -> Stamp {
    start + Span::from_nanos((i as f64 * 1e9 / rate_hz).round() as i64)
}

fn inertial_stamps(options: &SyntheticOptions) -> Vec<Stamp> {
    let lead = (LEAD_NS as f64 * 1e-9 * options.imu_rate_hz).ceil() as i64;
    let flown = (options.duration_s * options.imu_rate_hz).ceil() as i64;
    (-lead..=flown + lead).map(|i| tick(options.start, i, options.imu_rate_hz)).collect()
}

/// EuRoC's lens, scaled to the width of the image.
fn camera(options: &SyntheticOptions) -> DataResult<Camera> {
    let (width, height) = (f64::from(options.width), f64::from(options.height));
    let lens = Radtan { k1: -0.28340811, k2: 0.07395907, p1: 0.00019359, p2: 1.76187114e-05, k3: 0.0 };
    // An image that is higher than wide would look past the end of the distortion polynomial.
    let scale = width.max(height * 4.0 / 3.0) / 752.0;
    let fx_fy_cx_cy =
        [458.654 * scale, 457.296 * scale, width / 2.0 - 8.785 * scale, height / 2.0 + 8.375 * scale];
    Camera::new(options.width, options.height, fx_fy_cx_cy, Model::Radtan(lens))
        .map_err(|e| DataError::new("the camera of the synthetic flight").because(e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::frames::rotation_angle_rad;
    use vice_core::imu::{GRAVITY_Z_UP_M_S2, integrate_euler};

    fn small(seed: u64) -> Synthetic {
        Synthetic::new(SyntheticOptions { seed, width: 160, height: 120, ..Default::default() }).unwrap()
    }

    #[test]
    fn the_inertial_samples_integrate_to_the_truth() {
        for seed in 0..3 {
            let synthetic = small(seed);
            for start_s in [0_i64, 4] {
                let from = synthetic.options().start + Span::from_millis(start_s * 1000);
                let to = from + Span::from_millis(2000);
                let start = synthetic.inertial_state(from).unwrap().unwrap();
                assert!(start.velocity_m_s.norm() > 0.4, "it flies from the first frame on");
                let imu = synthetic.imu().unwrap();
                let integrated = integrate_euler(&imu, &start, to, GRAVITY_Z_UP_M_S2).unwrap();
                assert_eq!(integrated.end(), to);
                let (got, truth) =
                    (integrated.poses()[integrated.len() - 1], synthetic.state(to).world_from_body);
                // Held samples lag by half a period, 2.5 ms: millimetres and a tenth of a degree in two seconds.
                let off = (got.translation() - truth.translation()).norm();
                let turned = rotation_angle_rad(&(got.rotation().inverse() * truth.rotation()));
                assert!(off < 0.05 && turned < 0.005, "seed {seed}: {off} m, {turned} rad");
            }
        }
    }

    #[test]
    fn finer_samples_come_closer() {
        let after_two_seconds = |imu_rate_hz| {
            let options = SyntheticOptions { width: 160, height: 120, imu_rate_hz, ..Default::default() };
            let synthetic = Synthetic::new(options).unwrap();
            let from = synthetic.options().start;
            let start = synthetic.inertial_state(from).unwrap().unwrap();
            let to = from + Span::from_millis(2000);
            let imu = synthetic.imu().unwrap();
            let last = integrate_euler(&imu, &start, to, GRAVITY_Z_UP_M_S2).unwrap();
            (last.poses()[last.len() - 1].translation() - synthetic.state(to).world_from_body.translation())
                .norm()
        };
        let (coarse, fine) = (after_two_seconds(200.0), after_two_seconds(2000.0));
        assert!(fine < 0.15 * coarse, "the error is that of the integration: {coarse} m, {fine} m");
    }

    #[test]
    fn every_frame_has_a_pose_of_its_own_in_every_stream_even_with_a_clock_that_is_off() {
        let synthetic = small(1);
        let frames = synthetic.frames(CAMERA).unwrap();
        assert_eq!(frames.len(), 200);
        for stream in synthetic.streams() {
            let trajectory = synthetic.trajectory(&stream).unwrap();
            for (index, stamp) in frames.iter().enumerate() {
                let gap = if stream == "clock-offset" { Span::from_millis(10) } else { Span::ZERO };
                let pose = trajectory.pose_at(*stamp, gap).unwrap();
                if stream == GROUND_TRUTH || stream == "exact" {
                    assert_eq!(pose * body_from_camera(), synthetic.world_from_camera(index));
                }
            }
        }
    }

    #[test]
    fn what_is_not_there_is_named() {
        let synthetic = small(1);
        assert!(synthetic.camera("cam1").unwrap_err().to_string().contains("known: cam0"));
        assert!(synthetic.trajectory("svo").unwrap_err().to_string().contains("drift"));
        assert!(synthetic.image(CAMERA, 200).unwrap_err().to_string().contains("no frame 200"));
        assert!(synthetic.inertial_state(Stamp::from_nanos(0)).unwrap().is_none());
    }

    #[test]
    fn equal_options_give_equal_flights_and_another_seed_another() {
        let (a, b, c) = (small(4), small(4), small(5));
        assert_eq!(a.truth(), b.truth());
        assert_eq!(a.estimates(), b.estimates());
        assert_eq!(a.points(), b.points());
        assert_eq!(a.scene_labels().unwrap(), b.scene_labels().unwrap());
        assert_ne!(a.truth(), c.truth());
        assert_ne!(a.points(), c.points());
    }
}
