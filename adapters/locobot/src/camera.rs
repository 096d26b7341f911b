//! A camera of a recording: its images, its calibration, and whether the two belong together.

use std::sync::Arc;

use vice_core::camera::Camera;
use vice_core::error::{DataError, DataResult, ErrorKind, one_line};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;

use crate::calibration;
use crate::choose::is_rectified;
use crate::container::{Encoding, Locator, Recording, Topic};
use crate::doubts::{Doubts, LEFT_OUT, REPEATED, TWO_SOURCES};
use crate::image_size::image_size_px;
use crate::message::compressed_head;
use crate::pixels::Packing;
use crate::series::{ImageTopic, InfoTopic};
use crate::tf::{clock_jump, list};
use crate::wire::Reader;

/// The images of a topic that is in use.
#[derive(Debug)]
pub(crate) struct Images {
    pub(crate) topic: String,
    pub(crate) wire: Encoding,
    pub(crate) packing: Packing,
    pub(crate) frame: String,
    pub(crate) encoding: String,
    /// Columns and rows of the first image, where it says them.
    pub(crate) size_px: Option<(u32, u32)>,
    pub(crate) stamps: Arc<[Stamp]>,
    pub(crate) locators: Vec<Locator>,
}

impl Images {
    /// The images of a topic, sorted in time.
    ///
    /// # Errors
    /// [`DataError`] if its clock jumps back or no image has a stamp.
    pub(crate) fn new(
        recording: &Recording,
        topic: &Topic,
        found: ImageTopic,
        doubts: &Doubts,
    ) -> DataResult<Self> {
        let ImageTopic { packing, mut frames, frame, encoding, unstamped, other_frames, jump, jumps, .. } =
            found;
        let (first_size_px, sizes_px) = (found.size_px, found.sizes_px);
        let name = &topic.name;
        let about = format!("topic {name}");
        if let Some((before, after, locator)) = jump {
            let error = clock_jump(&format!("{about}: the clock"), (before, after), jumps);
            return Err(recording.place(&locator, error));
        }
        if frames.is_empty() {
            return Err(DataError::new(format!("{about}: all {unstamped} stamps are zero")).hint(
                "a robot on simulated time without a clock; `set` stamps=record takes the time of recording",
            ));
        }
        if unstamped > 0 {
            let message = format!("{unstamped} images with a zero stamp are left out");
            doubts.say(Suspicion::new(LEFT_OUT, about.as_str(), message).times(unstamped));
        }
        if other_frames > 0 {
            let message =
                format!("{other_frames} of {} images name another frame than {frame}", frames.len());
            doubts.say(
                Suspicion::new(TWO_SOURCES, about.as_str(), message)
                    .advice("two cameras publish the topic: record only one of them")
                    .times(other_frames),
            );
        }
        if sizes_px.len() > 1 {
            let each = sizes_px.iter().map(|((w, h), n)| format!("{n} of {w}x{h}"));
            doubts.say(
                Suspicion::new("image-sizes", about.as_str(), "the images have several sizes")
                    .evidence(list(&each.collect::<Vec<_>>()))
                    .advice("one calibration cannot be right for all of them: cut the recording where they change"),
            );
        }
        frames.sort_by_key(|(stamp, _)| *stamp);
        let n = frames.len();
        frames.dedup_by_key(|(stamp, _)| *stamp);
        if frames.len() < n {
            let again = (n - frames.len()) as u64;
            let message = format!("{again} images repeat a stamp: the first of each is kept");
            doubts.say(Suspicion::new(REPEATED, about, message).times(again));
        }
        let size_px = match packing {
            Packing::Raw => first_size_px,
            Packing::Compressed => frames.first().and_then(|f| compressed_size_px(recording, topic, &f.1)),
        };
        let (stamps, locators): (Vec<Stamp>, Vec<_>) = frames.into_iter().unzip();
        let (topic, wire) = (name.clone(), topic.encoding);
        Ok(Self { topic, wire, packing, frame, encoding, size_px, stamps: Arc::from(stamps), locators })
    }
}

/// The size of a compressed image; one that cannot be read is for its decoder to complain about.
fn compressed_size_px(recording: &Recording, topic: &Topic, locator: &Locator) -> Option<(u32, u32)> {
    let payload = recording.read(locator).ok()?;
    let mut reader = Reader::new(payload.bytes(), topic.encoding).ok()?;
    compressed_head(&mut reader).ok()?;
    image_size_px(reader.bytes().ok()?)
}

/// A camera.
pub(crate) struct RosCamera {
    /// The name that `--camera` takes.
    pub(crate) name: String,
    pub(crate) images: Images,
    /// Its calibration, with the topic it came from.
    pub(crate) info: Option<(String, InfoTopic)>,
}

impl RosCamera {
    /// Whether it is meant by a name: its own, or that of its topic.
    pub(crate) fn is(&self, name: &str) -> bool {
        name == self.name || name == self.images.topic
    }

    /// The calibration, for images of the size that the topic has.
    ///
    /// # Errors
    /// [`DataError`] if there is none or it cannot be used; `topics` are named where there are some to choose from.
    pub(crate) fn camera(&self, topics: &[Topic]) -> DataResult<Camera> {
        let Some((topic, info)) = &self.info else {
            let infos = topics.iter().filter(|t| t.kind == "sensor_msgs/CameraInfo" && t.is_read());
            let infos: Vec<&str> = infos.map(|t| t.name.as_str()).collect();
            let problem = format!("topic {} has no camera_info that belongs to it", self.images.topic);
            return Err(DataError::of_kind(ErrorKind::Missing, problem).hint(format!(
                "set camera_info_topic, or give a calibration file; there are: {}",
                list(&infos)
            )));
        };
        let camera = calibration::camera(&info.info, is_rectified(&self.images.topic))
            .map_err(|e| DataError::of_kind(e.kind(), format!("topic {topic}: {}", one_line(&e))))?;
        match self.images.size_px {
            // Labels and depth are in the pixels of the images, so that their size is the camera's.
            Some((width, height)) if (width, height) != (camera.width(), camera.height()) => {
                Camera::new(width, height, camera.fx_fy_cx_cy(), *camera.model())
                    .map_err(|e| DataError::new(format!("topic {}: {e}", self.images.topic)))
            }
            _ => Ok(camera),
        }
    }

    /// What is wrong between the images and their calibration.
    pub(crate) fn doubts(&self) -> Vec<Suspicion> {
        let Some((topic, info)) = &self.info else { return Vec::new() };
        let about = format!("topic {topic}");
        let mut doubts: Vec<Suspicion> = info.doubt(topic).into_iter().collect();
        let images = &self.images;
        let info = &info.info;
        let rectified = is_rectified(&images.topic);
        doubts.extend(calibration::padding(info, rectified).map(|s| Suspicion { about: about.clone(), ..s }));
        if let (Some((width, height)), Ok(camera)) = (images.size_px, calibration::camera(info, rectified))
            && (width, height) != (camera.width(), camera.height())
        {
            let window = match (info.binning, info.roi) {
                ([0 | 1, 0 | 1], [_, _, 0, _] | [_, _, _, 0]) => String::new(),
                (binning, roi) => format!(
                    ": {}x{} with binning {}x{} and region of interest x {} y {} {}x{}",
                    info.width, info.height, binning[0], binning[1], roi[0], roi[1], roi[3], roi[2]
                ),
            };
            let (by_x, by_y) = (
                f64::from(width) / f64::from(camera.width()),
                f64::from(height) / f64::from(camera.height()),
            );
            let advice = match by_x == by_y {
                true => format!(
                    "if the driver scales its images, fx fy cx cy have to be multiplied by {by_x}: give them by \
                     --calibration"
                ),
                false => {
                    "if the driver cuts its images, cx cy have to be moved: give them by --calibration".into()
                }
            };
            let message = format!(
                "the calibration is for images of {}x{} pixels, those of {} have {width}x{height}",
                camera.width(),
                camera.height(),
                images.topic
            );
            doubts.push(
                Suspicion::new("image-size", about.as_str(), format!("{message}{window}")).advice(advice),
            );
        }
        if !info.frame.is_empty() && !images.frame.is_empty() && info.frame != images.frame {
            let message = format!("the calibration is of {}, the images are of {}", info.frame, images.frame);
            doubts.push(
                Suspicion::new("camera-info-frame", about, message)
                    .advice("set camera_info_topic if it is another camera's"),
            );
        }
        doubts
    }
}

/// How to say which of several cameras is meant.
pub(crate) fn way_out(cameras: &[RosCamera]) -> String {
    let each: Vec<String> = cameras.iter().map(|c| format!("--camera {}", c.name)).collect();
    let topic = cameras.first().map_or("TOPIC", |c| c.images.topic.as_str());
    format!("{}, or --set color_topic={topic}", list(&each))
}
