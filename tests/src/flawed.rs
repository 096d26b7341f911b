//! Flights in memory with one known flaw each, for the diagnosis: no image is rendered.
//!
//! The flight is that of the synthetic adapter, 40 s in an empty room whose depth is known exactly; an estimate that is
//! not inertial turns about all axes besides, as something carried by hand does. Labels have
//! 0.5 px of noise and one in fifty is off by 10 px, key frames too. The estimate has the errors of a visual-inertial
//! odometry: position and yaw wander at random, roll and pitch sway about the truth, all of it jitters. With 4 mm and
//! 0.05° a root second a minute of flight ends about 3 cm and 0.4° off, as good ones do on EuRoC.

use std::sync::Arc;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use vice_core::camera::{Camera, Model, Pixel};
use vice_core::dataset::{Dataset, Floor, Image};
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::diagnose::{DiagnoseError, Diagnosed, Diagnosis, Flaw, InertialRun, Options, Theta, diagnose};
use vice_core::error::{DataError, DataResult};
use vice_core::evaluate::{DatasetRig, Evaluation, Selection, Stream, Window};
use vice_core::frames::{BodyFromCamera, Rigid, WorldFromCamera};
use vice_core::imu::{GRAVITY_Z_UP_M_S2, ImuSample, InertialState};
use vice_core::label::{LabelRow, LabelSet, Observation};
use vice_core::random::SplitMix;
use vice_core::result::Role;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_synthetic::Flight;

/// Noise of a label, pixels a coordinate.
pub const LABEL_NOISE_PX: f64 = 0.5;
/// One label in so many is an outlier ...
pub const OUTLIER_EVERY: f64 = 50.0;
/// ... by so much, pixels.
pub const OUTLIER_PX: f64 = 10.0;

const CAMERA: &str = "cam0";
const FRAME_HZ: f64 = 10.0;
const POSE_HZ: f64 = 100.0;
const IMU_HZ: f64 = 200.0;
const POINTS: usize = 6;
/// A point is followed for so long at most, seconds.
const LONGEST_SEGMENT_S: f64 = 4.0;
/// Half the side of the room and its height, metres.
const ROOM_M: (f64, f64) = (5.0, 3.5);

/// A flight with one flaw.
pub struct Flawed {
    /// What is wrong; zero where nothing is.
    pub truth: Theta,
    camera: Camera,
    body_from_camera: BodyFromCamera,
    room: Room,
    frames: Arc<[Stamp]>,
    labels: LabelSet,
    estimate: Trajectory,
    inertial: Option<InertialRun>,
}

impl Flawed {
    /// A flight of a seed with a flaw of the size that the numbers to reach are stated for, in a random direction.
    ///
    /// # Panics
    /// If the flight is not what it should be.
    pub fn new(flaw: Option<Flaw>, seed: u64) -> Self {
        let mut rng = SplitMix::for_purpose(seed, 71);
        let mut truth = Theta::zero();
        let sign = if rng.uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let direction = Vector3::from_fn(|_, _| rng.normal()).normalize();
        let angle = rng.uniform(0.0, std::f64::consts::TAU);
        if let Some(flaw) = flaw {
            let values = match flaw {
                Flaw::ClockOffset => vec![sign * 0.04],
                Flaw::ExtrinsicRotation => (direction * 2.0_f64.to_radians()).as_slice().to_vec(),
                Flaw::ExtrinsicTranslation => (direction * 0.06).as_slice().to_vec(),
                Flaw::FocalLength => vec![sign * 0.03],
                Flaw::PrincipalPoint => vec![12.0 * angle.cos(), 12.0 * angle.sin()],
                Flaw::InitialTilt => [angle.cos(), angle.sin()].map(|v| v * 0.5_f64.to_radians()).to_vec(),
                Flaw::Scale => vec![sign * 0.05],
                Flaw::Drift => {
                    let v = direction * 0.05;
                    vec![v.x, v.y, v.z, sign * 0.4_f64.to_radians()]
                }
                Flaw::Distortion => vec![sign * 0.04, 0.0, 0.0, 0.0],
                Flaw::Aspect => vec![sign * 0.02],
                Flaw::ClockRate => vec![sign * 0.001],
                Flaw::ClockStep => vec![sign * 0.1, 18.0],
                Flaw::RollingShutter => vec![0.02],
                other => panic!("{other} has no size here"),
            };
            truth = truth.with(flaw, &values);
        }
        Self::with(truth, flaw == Some(Flaw::InitialTilt), seed)
    }

    /// A flight whose estimate and calibration have the errors given.
    ///
    /// # Panics
    /// If the flight is not what it should be.
    pub fn with(truth: Theta, inertial: bool, seed: u64) -> Self {
        let flight = Flight::new(seed);
        let seconds = if inertial { 10.0 } else { 40.0 };
        let camera = Camera::new(
            752,
            480,
            [458.654, 457.296, 367.215, 248.375],
            Model::from_name("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05])
                .expect("a model"),
        )
        .expect("a camera");
        let body_from_camera = body_from_camera();
        let frames: Arc<[Stamp]> =
            (0..(seconds * FRAME_HZ) as i64).map(|i| stamp(i as f64 / FRAME_HZ)).collect();
        let hand = Hand::new(!inertial, &mut SplitMix::for_purpose(seed, 74));
        let reference = trajectory(seconds, |t| flight.at(t).world_from_body * hand.at(t));
        let room = Room { camera, body_from_camera, reference };
        let labels =
            labels(&room, &frames, truth.of(Flaw::RollingShutter)[0], &mut SplitMix::for_purpose(seed, 72));
        let inertial = inertial.then(|| run(&flight, seconds, &truth, &mut SplitMix::for_purpose(seed, 73)));
        let estimate = match &inertial {
            Some(run) => run.integrate(Span::ZERO, Vector3::zeros()).expect("it can be integrated"),
            None => odometry(&room.reference, &truth, &mut SplitMix::for_purpose(seed, 73)),
        };
        // In use is what the truth makes of it when its errors are added: the correction of the negated errors.
        let wrong = truth.negated();
        Self {
            truth,
            camera: add_to_camera(&camera, &truth),
            body_from_camera: add_to_extrinsics(&body_from_camera, &wrong),
            room,
            frames,
            labels,
            estimate,
            inertial,
        }
    }

    /// How far a flaw, fitted alone, is from the truth: the length of the difference of the vectors. That of the yaw
    /// rate of a drift stands apart.
    pub fn errors(&self, flaw: Flaw, diagnosed: &Diagnosed) -> Vec<f64> {
        let found = diagnosed.document.flaws.iter().find(|p| p.flaw == flaw);
        let values = found.map(|p| p.parameters.iter().map(|e| e.value)).into_iter().flatten();
        let errors: Vec<f64> = values.zip(self.truth.of(flaw)).map(|(value, truth)| value - truth).collect();
        let length = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>().sqrt();
        match errors.split_at_checked(3) {
            Some((velocity, [yaw])) => vec![length(velocity), yaw.abs()],
            _ => vec![length(&errors)],
        }
    }

    /// The diagnosis: with the true trajectory as a reference that places the camera for depth, or without any
    /// reference but with a depth camera.
    ///
    /// # Errors
    /// [`DiagnoseError`] if there is nothing to fit to.
    ///
    /// # Panics
    /// If the labels are not at the frames.
    pub fn diagnose(&self, with_reference: bool) -> Result<Diagnosed, DiagnoseError> {
        let selection = Selection::new(&self.labels, &self.frames, &self.camera, &Window::default())
            .expect("labels at frames");
        let stream = |name: &str, role, trajectory: &Trajectory| Stream::new(name, role, trajectory.clone());
        let mut streams = vec![stream("estimate", Role::Estimate, &self.estimate)];
        if with_reference {
            streams.insert(0, stream("reference", Role::Reference, &self.room.reference));
        }
        let depth_camera = DepthCamera(&self.room);
        let source: &dyn DepthSource = if with_reference { &self.room } else { &depth_camera };
        let (rig, depths) = (DatasetRig::new(self, CAMERA), [source]);
        let evaluation = Evaluation::builder(&rig, &self.camera, &self.frames, &selection)
            .streams(&streams)
            .depths(&depths)
            .build();
        let diagnosis = Diagnosis {
            evaluation: &evaluation,
            stream: streams.len() - 1,
            depth: 0,
            inertial: self.inertial.as_ref(),
            flaws: &Flaw::ALL,
            options: Options::default(),
        };
        diagnose(&diagnosis, &|_, _| {})
    }
}

fn stamp(seconds: f64) -> Stamp {
    Stamp::from_nanos(1_600_000_000_000_000_000 + (seconds * 1e9).round() as i64)
}

/// A quarter turn about the optical axis and some degrees, as cameras are mounted.
fn body_from_camera() -> BodyFromCamera {
    let quarter = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
    let mounting = UnitQuaternion::from_euler_angles(0.016, -0.024, 0.01);
    Rigid::from_parts(Vector3::new(-0.0216, -0.0647, 0.0098), quarter * mounting)
}

fn add_to_camera(camera: &Camera, truth: &Theta) -> Camera {
    let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
    let longer = 1.0 + truth.of(Flaw::FocalLength)[0];
    let shift = truth.of(Flaw::PrincipalPoint);
    let wider = 1.0 + truth.of(Flaw::Aspect)[0];
    let wrong = [fx * longer * wider, fy * longer, cx + shift[0], cy + shift[1]];
    let mut lens = camera.model().coefficients();
    lens.iter_mut().zip(truth.of(Flaw::Distortion)).for_each(|(c, off)| *c += off);
    let lens = Model::from_name(camera.model().name(), &lens).expect("a model");
    Camera::new(camera.width(), camera.height(), wrong, lens).expect("a camera")
}

fn add_to_extrinsics(body_from_camera: &BodyFromCamera, negated: &Theta) -> BodyFromCamera {
    negated.correct_extrinsics(body_from_camera)
}

fn trajectory(seconds: f64, pose: impl Fn(f64) -> vice_core::frames::WorldFromBody) -> Trajectory {
    let poses = (-50..((seconds + 0.5) * POSE_HZ) as i64).map(|i| i as f64 / POSE_HZ);
    Trajectory::from_poses(poses.map(|t| (stamp(t), pose(t)))).expect("a trajectory")
}

/// Turns about the axes of the body on top of a flight.
struct Hand([(f64, f64, f64); 3]);

impl Hand {
    /// Amplitude (rad), frequency (rad/s) and phase by axis: up, right and forward.
    fn new(moves: bool, rng: &mut SplitMix) -> Self {
        let size = f64::from(u8::from(moves));
        Self([(0.25, 1.9), (0.12, 2.3), (0.2, 1.5)].map(|(amplitude, frequency)| {
            (size * amplitude, frequency, rng.uniform(0.0, std::f64::consts::TAU))
        }))
    }

    fn at(&self, t_s: f64) -> Rigid<vice_core::frames::Body, vice_core::frames::Body> {
        let turn = self.0.map(|(amplitude, frequency, phase)| amplitude * (frequency * t_s + phase).sin());
        Rigid::from_parts(Vector3::zeros(), UnitQuaternion::from_scaled_axis(Vector3::from(turn)))
    }
}

/// Points that are followed from a random pixel until they leave the image or for four seconds.
fn labels(room: &Room, frames: &[Stamp], readout_s: f64, rng: &mut SplitMix) -> LabelSet {
    let camera = &room.camera;
    // A row is exposed a share of the read-out time before or after the stamp.
    let at_row = |i: usize, px: Pixel| {
        let later =
            Span::from_secs_f64(readout_s * (px.v / f64::from(camera.height()) - 0.5)).expect("a span");
        room.world_from_camera(frames[i] + later)
    };
    let at = |i: usize| room.world_from_camera(frames[i]).expect("the truth covers the frames");
    let mut rows = Vec::new();
    for point in 0..POINTS {
        let mut frame = point % 4;
        while frame + 5 < frames.len() {
            let px = Pixel::new(rng.uniform(30.0, 722.0), rng.uniform(30.0, 450.0));
            let ray = at(frame).rotate(&camera.unproject(px).expect("inside the model"));
            let p = Point3::from(
                at(frame).translation() + ray * cast(&at(frame), &ray).expect("inside the room"),
            );
            let last = (frame + (LONGEST_SEGMENT_S * FRAME_HZ) as usize).min(frames.len());
            let seen = |i: usize| {
                let mut px = camera.project(&at(i).inverse().transform_point(&p)).ok()?;
                for _ in 0..if readout_s == 0.0 { 0 } else { 4 } {
                    px = camera.project(&at_row(i, px)?.inverse().transform_point(&p)).ok()?;
                }
                Some(px)
            };
            let mut end = frame;
            for (i, stamp) in frames.iter().enumerate().take(last).skip(frame) {
                let Some(true_px) = seen(i) else { break };
                let off = match rng.uniform(0.0, OUTLIER_EVERY) < 1.0 {
                    true => {
                        let a = rng.uniform(0.0, std::f64::consts::TAU);
                        (OUTLIER_PX * a.cos(), OUTLIER_PX * a.sin())
                    }
                    false => (LABEL_NOISE_PX * rng.normal(), LABEL_NOISE_PX * rng.normal()),
                };
                let px = Pixel::new(true_px.u + off.0, true_px.v + off.1);
                if !camera.contains(px) {
                    break;
                }
                let observation = Observation::manual(*stamp, px);
                let observation = if i == frame { observation.as_keyframe() } else { observation };
                rows.push(LabelRow { point: point.to_string(), observation });
                end = i;
            }
            frame = end + 1;
        }
    }
    LabelSet::from_rows(rows).expect("labels")
}

/// The truth with a drift, a scale, a late clock and the errors of a visual-inertial odometry.
fn odometry(reference: &Trajectory, truth: &Theta, rng: &mut SplitMix) -> Trajectory {
    const POSITION_WALK_M: f64 = 0.004;
    const YAW_WALK_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;
    const SWAY_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;
    const SWAY_S: f64 = 2.0;
    const JITTER_M: f64 = 0.0005;
    const JITTER_RAD: f64 = 0.005 * std::f64::consts::PI / 180.0;
    let drift = truth.of(Flaw::Drift);
    let (velocity, yaw_rate) = (Vector3::new(drift[0], drift[1], drift[2]), drift[3]);
    let longer = 1.0 + truth.of(Flaw::Scale)[0];
    let late = Span::from_secs_f64(truth.of(Flaw::ClockOffset)[0]).expect("a span");
    let vector = |rng: &mut SplitMix, sigma: f64| Vector3::from_fn(|_, _| sigma * rng.normal());
    let (mut position, mut yaw, mut sway) = (reference.poses()[0].translation(), 0.0, Vector3::zeros());
    let mut before = (reference.start(), reference.poses()[0].translation());
    let mut poses = Vec::with_capacity(reference.len());
    for (stamp, pose) in reference.iter() {
        let dt = stamp.since(before.0).as_secs_f64();
        let yaw_before = yaw;
        yaw += yaw_rate * dt + YAW_WALK_RAD * dt.sqrt() * rng.normal();
        let turn = |yaw: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
        let step = turn(0.5 * (yaw_before + yaw)) * (pose.translation() - before.1) * longer;
        position += step + velocity * dt + vector(rng, POSITION_WALK_M * dt.sqrt());
        sway += -sway * (dt / SWAY_S) + vector(rng, SWAY_RAD * (2.0 * dt / SWAY_S).sqrt());
        let tilted = UnitQuaternion::from_scaled_axis(Vector3::new(sway.x, sway.y, 0.0));
        let jitter = UnitQuaternion::from_scaled_axis(vector(rng, JITTER_RAD));
        let rotation = turn(yaw) * tilted * pose.rotation() * jitter;
        let since_s = stamp.since(self::stamp(0.0)).as_secs_f64();
        let [step_s, step_at_s] = [truth.of(Flaw::ClockStep)[0], truth.of(Flaw::ClockStep)[1]];
        let step_s = if since_s >= step_at_s { step_s } else { 0.0 };
        let later = Span::from_secs_f64(truth.of(Flaw::ClockRate)[0] * since_s + step_s).expect("a span");
        let read = stamp + late + later;
        let pose = Rigid::from_parts(position + vector(rng, JITTER_M), rotation);
        // A step back leaves out what it overlaps.
        if poses.last().is_none_or(|(last, _)| *last < read) {
            poses.push((read, pose));
        }
        before = (stamp, pose.translation());
    }
    Trajectory::from_poses(poses).expect("a trajectory")
}

/// Samples with the white noise of a good MEMS sensor, and a start that is tilted.
fn run(flight: &Flight, seconds: f64, truth: &Theta, rng: &mut SplitMix) -> InertialRun {
    const GYRO_RAD_S: f64 = 1.7e-4;
    const ACCEL_M_S2: f64 = 2.0e-3;
    let mut white = |density: f64| Vector3::from_fn(|_, _| density * IMU_HZ.sqrt() * rng.normal());
    let samples = (-200..((seconds + 1.0) * IMU_HZ) as i64).map(|i| {
        // A held sample says what happens until the next one: the middle of that time.
        let state = flight.at((i as f64 + 0.5) / IMU_HZ);
        ImuSample {
            stamp: stamp(i as f64 / IMU_HZ),
            gyro_rad_s: state.angular_rate_rad_s + white(GYRO_RAD_S),
            accel_m_s2: state.specific_force_m_s2() + white(ACCEL_M_S2),
        }
    });
    let samples = samples.collect();
    let start = flight.at(0.0);
    let tilt = truth.of(Flaw::InitialTilt);
    let pose = start.world_from_body;
    let turned = UnitQuaternion::from_scaled_axis(Vector3::new(tilt[0], tilt[1], 0.0)) * pose.rotation();
    let start = InertialState {
        stamp: stamp(0.0),
        world_from_body: Rigid::from_parts(pose.translation(), turned),
        velocity_m_s: start.velocity_m_s,
        gyro_bias_rad_s: Vector3::zeros(),
        accel_bias_m_s2: Vector3::zeros(),
    };
    InertialRun { samples, start, end: stamp(seconds), gravity_m_s2: GRAVITY_Z_UP_M_S2 }
}

/// The room as a depth source: a ray from inside a box, exact wherever the camera is thought to be.
struct Room {
    camera: Camera,
    body_from_camera: BodyFromCamera,
    reference: Trajectory,
}

impl Room {
    /// Where the camera truly is.
    fn world_from_camera(&self, stamp: Stamp) -> Option<WorldFromCamera> {
        Some(self.reference.pose_at(stamp, Span::from_millis(100)).ok()? * self.body_from_camera)
    }
}

impl DepthSource for Room {
    fn name(&self) -> &str {
        "room"
    }

    fn needs_world(&self, _: &Floor) -> bool {
        true
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let pose = keyframe.world_from_camera.ok_or(DepthMiss::NoAnchor);
        Ok(pixels.iter().map(|px| depth(keyframe.camera, &pose?, *px)).collect())
    }
}

/// A depth camera in the room: what it measures does not depend on what anyone thinks of the calibration.
struct DepthCamera<'a>(&'a Room);

impl DepthSource for DepthCamera<'_> {
    fn name(&self) -> &str {
        "depth-camera"
    }

    fn needs_world(&self, _: &Floor) -> bool {
        false
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let pose = self.0.world_from_camera(keyframe.stamp).ok_or(DepthMiss::NoDepth);
        Ok(pixels.iter().map(|px| depth(&self.0.camera, &pose?, *px)).collect())
    }
}

fn depth(camera: &Camera, pose: &WorldFromCamera, px: Pixel) -> Result<DepthSample, DepthMiss> {
    let ray = pose.rotate(&camera.unproject(px).map_err(|_| DepthMiss::OutsideModel)?);
    cast(pose, &ray).map(DepthSample::new).ok_or(DepthMiss::NoSurface)
}

/// How far along a ray in the world the room ends, in lengths of the ray; `None` from outside.
fn cast(world_from_camera: &WorldFromCamera, ray: &Vector3<f64>) -> Option<f64> {
    let from = world_from_camera.translation();
    let (half, height) = ROOM_M;
    let (low, high) = (Vector3::new(-half, -half, 0.0), Vector3::new(half, half, height));
    let leave = (0..3)
        .map(|axis| ((low[axis] - from[axis]) / ray[axis]).max((high[axis] - from[axis]) / ray[axis]))
        .fold(f64::INFINITY, f64::min);
    let inside = (0..3).all(|axis| from[axis] > low[axis] && from[axis] < high[axis]);
    (inside && leave.is_finite()).then_some(leave)
}

impl Dataset for Flawed {
    fn name(&self) -> &str {
        "flawed"
    }
    fn format(&self) -> &str {
        "test"
    }
    fn cameras(&self) -> Vec<String> {
        vec![CAMERA.to_string()]
    }
    fn camera(&self, _: &str) -> DataResult<Camera> {
        Ok(self.camera)
    }
    fn frames(&self, _: &str) -> DataResult<Arc<[Stamp]>> {
        Ok(Arc::clone(&self.frames))
    }
    fn image(&self, _: &str, _: usize) -> DataResult<Image> {
        Err(DataError::new("there are no images"))
    }
    fn body_from_camera(&self, _: &str, _: Stamp) -> DataResult<BodyFromCamera> {
        Ok(self.body_from_camera)
    }
    fn streams(&self) -> Vec<String> {
        vec![]
    }
    fn trajectory(&self, _: &str) -> DataResult<Trajectory> {
        Err(DataError::new("there are no streams"))
    }
}
