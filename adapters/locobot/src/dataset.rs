//! A recording as a [`Dataset`].

mod facts;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use nalgebra::{Point3, UnitQuaternion, Vector3};
use vice_core::camera::Camera;
use vice_core::dataset::{
    CloudRef, CloudSource, Dataset, DepthImage, Fact, Floor, GROUND_TRUTH, Image, Plane, depth_unit_doubt,
};
use vice_core::error::{DataError, DataResult, ErrorKind, one_line};
use vice_core::finding::Finding;
use vice_core::frames::{BodyFromCamera, Rigid, Sensor};
use vice_core::imu::{ImuSample, InertialState, fit_velocity};
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{PoseCovariance, Trajectory};

use crate::camera::{Images, RosCamera, way_out};
use crate::choose::{Frames, Topics};
use crate::container::{Recording, Topic};
use crate::doubts::{Doubts, NO_CAMERA};
use crate::imu;
use crate::pixels::{self, DepthUnit, Packing};
use crate::series::PoseTopic;
use crate::settings::Settings;
use crate::streams::{self, GroundTruth, ODOM, SLAM};
use crate::sweeps::{self, Placed};
use crate::tf::{TfTree, Transform, list};
use crate::wire::Reader;

/// Points of sweeps relative to a place, and that place; or why there are none.
type Swept = Result<(Vector3<f64>, Arc<[Point3<f32>]>), String>;

/// An opened recording.
pub(crate) struct RosDataset {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    pub(crate) settings: Settings,
    pub(crate) recording: Recording,
    pub(crate) topics: Vec<Topic>,
    pub(crate) chosen: Topics,
    pub(crate) frames: Frames,
    pub(crate) tf: TfTree,
    /// The camera in use; where several could be meant all of them, and none is the default.
    pub(crate) cameras: Vec<RosCamera>,
    /// Whether one of several cameras was asked for by its name.
    pub(crate) named: AtomicBool,
    pub(crate) depth: Option<Images>,
    pub(crate) depth_offset: Span,
    pub(crate) depth_unit: Option<DepthUnit>,
    pub(crate) poses: BTreeMap<String, PoseTopic>,
    pub(crate) ground_truth: Option<GroundTruth>,
    pub(crate) fixed_camera: Option<Transform>,
    pub(crate) doubts: Doubts,
    /// How long after their stamps messages were recorded.
    pub(crate) delays: Vec<Finding>,
    pub(crate) imu: OnceLock<Result<Arc<[ImuSample]>, String>>,
    pub(crate) cloud: OnceLock<Swept>,
}

impl RosDataset {
    /// The camera that is used where none is named.
    pub(crate) fn default_camera(&self) -> Option<&RosCamera> {
        self.cameras.first().filter(|_| self.chosen.color.is_some())
    }

    fn camera_of(&self, name: &str) -> DataResult<&RosCamera> {
        if let Some(camera) = self.cameras.iter().find(|c| c.is(name)) {
            self.named.store(true, Ordering::Relaxed);
            return Ok(camera);
        }
        let problem = match (&self.chosen.color_problem, self.default_camera()) {
            (_, Some(camera)) => {
                return Err(DataError::of_kind(ErrorKind::Missing, format!("no camera `{name}`"))
                    .hint(format!("there is: {}", camera.name)));
            }
            (Some(problem), None) => problem.as_str(),
            (None, None) => "no topic has colour or gray images",
        };
        let hint =
            if self.cameras.is_empty() { "set color_topic".to_string() } else { way_out(&self.cameras) };
        Err(DataError::of_kind(ErrorKind::Missing, problem).at(&self.path).hint(hint))
    }

    /// Reads and decodes a message of an image topic.
    fn decode<T>(
        &self,
        images: &Images,
        index: usize,
        decode: impl Fn(Reader<'_>, Packing) -> DataResult<T>,
    ) -> DataResult<T> {
        let Some(locator) = images.locators.get(index) else {
            let n = images.locators.len();
            return Err(DataError::new(format!("topic {}: no frame {index}, there are {n}", images.topic)));
        };
        let payload = self.recording.read(locator)?;
        let reader = Reader::new(payload.bytes(), images.wire).map_err(DataError::of);
        reader.and_then(|r| decode(r, images.packing)).map_err(|e| {
            let problem = format!("topic {}, frame {index}: {}", images.topic, one_line(&e));
            self.recording.place(locator, DataError::of_kind(e.kind(), problem))
        })
    }

    /// Looks once at the first depth image, for `vice info`: evaluating looks at each that it uses.
    fn look_at_depth(&self) {
        let Some(depth) = &self.depth else { return };
        let image = self.decode(depth, 0, |r, packing| pixels::depth(r, packing, self.depth_unit));
        if let Ok(image) = image {
            let doubt = depth_unit_doubt(&image);
            self.doubts.say_all(doubt.map(|s| Suspicion { about: format!("topic {}", depth.topic), ..s }));
        }
    }

    /// `body_from_frame` of a frame of tf.
    fn base(&self) -> DataResult<&str> {
        self.tf.decided().map_err(|e| e.at(&self.path))?;
        self.frames.base.as_deref().ok_or_else(|| {
            let several =
                [self.tf.behind_prefixes("base_footprint"), self.tf.behind_prefixes("base_link")].concat();
            let why = match several.len() {
                0 | 1 => "tf has neither base_footprint nor base_link".to_string(),
                _ => format!("it could be {}", list(&several)),
            };
            DataError::of_kind(ErrorKind::Missing, format!("the frame of the body is not known: {why}"))
                .at(&self.path)
                .hint(format!("set base_frame; frames of tf: {}", list(&self.tf.frames())))
        })
    }

    /// The sweeps of a topic in the world.
    fn sweeps(&self, topic: &Topic) -> DataResult<sweeps::Scan> {
        let streams = self.streams();
        let stream = match (self.settings.get("cloud_stream"), streams.first()) {
            (Some(stream), _) => stream.to_string(),
            (None, Some(first)) => first.clone(),
            (None, None) => {
                return Err(DataError::of_kind(
                    ErrorKind::Missing,
                    "no stream places its sweeps in the world",
                ));
            }
        };
        let trajectory = self.trajectory(&stream)?;
        let of_topic = |name: &str| self.poses.get(name).map(|topic| topic.parent.as_str());
        let world = match (stream.as_str(), &self.ground_truth) {
            (GROUND_TRUTH, Some(GroundTruth::Topic(name))) => of_topic(name),
            (GROUND_TRUTH, Some(GroundTruth::File(_))) => None,
            (ODOM, _) => self.frames.odom.as_deref(),
            (SLAM, _) => self.frames.map.as_deref(),
            (name, _) => of_topic(name),
        };
        let (tf, base, stamps) = (&self.tf, self.base()?, self.settings.stamps()?);
        let placed = Placed { trajectory: &trajectory, stream: &stream, world, tf, base, stamps };
        sweeps::read(&self.recording, topic, &placed, &self.doubts)
    }

    /// The trajectory to which inertial samples are tied.
    fn reference(&self) -> Option<Trajectory> {
        self.streams().iter().find_map(|s| self.trajectory(s).ok())
    }
}

impl Dataset for RosDataset {
    fn name(&self) -> &str {
        &self.name
    }

    fn format(&self) -> &str {
        crate::FORMAT
    }

    fn cameras(&self) -> Vec<String> {
        self.default_camera().iter().map(|camera| camera.name.clone()).collect()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        self.camera_of(camera)?.camera(&self.topics).map_err(|e| e.at(&self.path))
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        self.camera_of(camera).map(|c| Arc::clone(&c.images.stamps))
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.decode(&self.camera_of(camera)?.images, index, pixels::image)
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        self.decode(&self.camera_of(camera)?.images, index, pixels::file)
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        let camera = self.camera_of(camera)?;
        if let Some(fixed) = &self.fixed_camera {
            return Ok(fixed.reinterpret());
        }
        let of_images = Some(camera.images.frame.as_str()).filter(|frame| !frame.is_empty());
        let camera_frame = self.frames.camera.as_deref().or(of_images).ok_or_else(|| {
            DataError::new("the images do not name their frame").at(&self.path).hint("set camera_frame")
        })?;
        let base = self.base()?;
        if base == camera_frame {
            return Ok(BodyFromCamera::identity());
        }
        let chain = self.tf.chain(base, camera_frame).map_err(|e| {
            let problem = format!("the camera has no place in the body: {}", one_line(&e));
            DataError::of_kind(e.kind(), problem)
                .at(&self.path)
                .hint("set base_frame and camera_frame, urdf or body_from_camera")
        })?;
        chain.at(stamp).map(|t| t.reinterpret()).map_err(|e| e.at(&self.path))
    }

    fn streams(&self) -> Vec<String> {
        let topics = self.poses.keys().map(String::as_str);
        streams::names(&self.tf, &self.frames, topics, self.ground_truth.as_ref())
    }

    fn pose_covariances(&self, stream: &str) -> DataResult<Vec<PoseCovariance>> {
        // Other streams are of tf or a file, which say nothing of the kind.
        let mut said = self.poses.get(stream).map(|topic| topic.covariances.clone()).unwrap_or_default();
        said.sort_by_key(|each| each.stamp);
        Ok(said)
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        let base = self.frames.base.as_deref();
        let of_topic = |name: &str, child: Option<&str>| {
            let topic = self.poses.get(name)?;
            let child = child.unwrap_or(&topic.child);
            Some(streams::topic_trajectory(topic, name, child, &self.tf, base, &self.doubts))
        };
        let trajectory = match (stream, &self.ground_truth) {
            (GROUND_TRUTH, Some(GroundTruth::File(trajectory))) => Some(Ok(trajectory.clone())),
            (GROUND_TRUTH, Some(GroundTruth::Topic(name))) => {
                of_topic(name, self.settings.get("ground_truth_frame"))
            }
            (ODOM | SLAM, _) => {
                let stamps: Vec<&[Stamp]> = self.cameras.iter().map(|c| c.images.stamps.as_ref()).collect();
                let chain = streams::tf_chain(&self.tf, &self.frames, stream);
                Some(chain.and_then(|chain| streams::tf_trajectory(&chain, &stamps.concat(), stream)))
            }
            (name, _) => of_topic(name, None),
        };
        let trajectory = trajectory.unwrap_or_else(|| {
            Err(DataError::new(format!("no stream `{stream}`"))
                .hint(format!("there are: {}", list(&self.streams()))))
        });
        trajectory.map_err(|e| e.at(&self.path))
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        let Some(topic) = self.chosen.imu else {
            let problem = self.chosen.imu_problem.as_ref();
            return problem.map_or(Ok(Arc::new([])), |p| Err(DataError::new(p.clone()).at(&self.path)));
        };
        let name = &self.topics[topic].name;
        let samples = self.imu.get_or_init(|| {
            let stamps = self.settings.stamps().map_err(|e| e.to_string())?;
            let base = self.base().map_err(|e| e.to_string())?;
            imu::read(&self.recording, name, stamps, &self.tf, base, &self.doubts).map_err(|e| one_line(&e))
        });
        samples.clone().map_err(|problem| DataError::new(format!("topic {name}: {problem}")).at(&self.path))
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        // Only a robot with inertial samples can use it. Biases are not known, which zero stands for.
        if self.chosen.imu.is_none() {
            return Ok(None);
        }
        let Some(reference) = self.reference() else { return Ok(None) };
        let Ok(world_from_body) = reference.pose_at(stamp, Span::from_millis(100)) else { return Ok(None) };
        let velocity = fit_velocity(&reference, stamp);
        let velocity_m_s = velocity.map_err(|e| DataError::of(e).at(&self.path))?;
        let zero = Vector3::zeros();
        Ok(Some(InertialState {
            stamp,
            world_from_body,
            velocity_m_s,
            gyro_bias_rad_s: zero,
            accel_bias_m_s2: zero,
        }))
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        let stamps = &self.camera_of(camera)?.images.stamps;
        let Some(depth) = self.depth.as_ref().filter(|_| self.default_camera().is_some()) else {
            return Ok(None);
        };
        let Some(stamp) = stamps.get(index) else {
            return Err(DataError::new(format!("no frame {index}, there are {}", stamps.len())));
        };
        let after = depth.stamps.partition_point(|s| s < stamp);
        let beside = [after.checked_sub(1), (after < depth.stamps.len()).then_some(after)];
        let off = |i: &usize| depth.stamps[*i].since(*stamp).abs();
        let nearest = beside.into_iter().flatten().min_by_key(off).filter(|i| off(i) <= self.depth_offset);
        let decode = |r: Reader<'_>, packing: Packing| pixels::depth(r, packing, self.depth_unit);
        nearest.map(|i| self.decode(depth, i, decode)).transpose()
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.depth.is_some() && self.default_camera().is_some_and(|c| c.is(camera))
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        let Some(name) = self.settings.get("cloud_topic") else { return Ok(None) };
        let Some(topic) = self.topics.iter().find(|t| t.name == name && t.kind == sweeps::KIND) else {
            let of_kind = self.topics.iter().filter(|t| t.kind == sweeps::KIND).map(|t| t.name.as_str());
            let there: Vec<&str> = of_kind.collect();
            return Err(DataError::of_kind(ErrorKind::Missing, format!("no PointCloud2 topic {name}"))
                .at(&self.path)
                .hint(if there.is_empty() {
                    "there is none".to_string()
                } else {
                    format!("there are: {}", list(&there))
                }));
        };
        let scan = self.cloud.get_or_init(|| match self.sweeps(topic) {
            Ok(scan) => Ok((scan.origin_m, Arc::from(scan.points))),
            Err(error) => Err(one_line(&error)),
        });
        match scan {
            Ok((origin_m, points)) => Ok(Some(CloudRef {
                source: CloudSource::Points(Arc::clone(points)),
                world_from_cloud: Rigid::from_parts(*origin_m, UnitQuaternion::identity()),
            })),
            Err(problem) => Err(DataError::new(format!("topic {name}: {problem}")).at(&self.path)),
        }
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        let (Some(base), Some(floor)) = (&self.frames.base, &self.frames.floor) else {
            return Ok(Floor::World(Plane::z_zero()));
        };
        if base == floor {
            return Ok(Floor::Body(Plane::z_zero()));
        }
        let chain = match self.tf.chain(base, floor) {
            Ok(chain) => chain,
            // A base_footprint of some other tree was not asked for.
            Err(_) if self.settings.get("floor_frame").is_none() => return Ok(Floor::World(Plane::z_zero())),
            Err(e) => return Err(e.at(&self.path)),
        };
        let body_from_floor = chain.at(keyframe).map_err(|e| e.at(&self.path))?;
        Ok(Floor::Body(Plane::<Sensor>::z_zero().transformed(&body_from_floor.reinterpret())))
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let mut doubts = self.doubts.all();
        let problem = self.chosen.color_problem.as_ref();
        if let Some(problem) = problem.filter(|_| !self.named.load(Ordering::Relaxed)) {
            doubts.push(Suspicion::new(NO_CAMERA, "", problem.as_str()).advice(way_out(&self.cameras)));
        }
        doubts
    }

    fn checks(&self) -> Vec<Finding> {
        self.delays.clone()
    }

    fn facts(&self) -> Vec<Fact> {
        self.look_at_depth();
        facts::facts(self)
    }
}
