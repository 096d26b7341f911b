//! Which topics and frames are used: as set, by LoCoBot's names, else by type.

use vice_core::error::{DataError, DataResult};

use crate::container::Topic;
use crate::namespaces::holds;
use crate::settings::Settings;
use crate::tf::{TfTree, list};

/// LoCoBot's names.
pub(crate) const COLOR: &str = "/camera/color/image_raw";
pub(crate) const DEPTH: &str = "/camera/aligned_depth_to_color/image_raw";
const COLOR_INFO: &str = "/camera/color/camera_info";
const IMU: &str = "/imu";

/// Endings by which image transports mark what they send.
const TRANSPORTS: [&str; 2] = ["/compressed", "/compressedDepth"];

/// The topics in use, as indices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Topics {
    pub(crate) color: Option<usize>,
    pub(crate) depth: Option<usize>,
    pub(crate) info: Option<usize>,
    pub(crate) imu: Option<usize>,
    /// The image topics that could be the camera's, where there are several and none is taken.
    pub(crate) cameras: Vec<usize>,
    /// Why there is no camera, where there are images but none could be chosen.
    pub(crate) color_problem: Option<String>,
    /// Why there are no depth images, where several topics have some.
    pub(crate) depth_problem: Option<String>,
    /// Why there are no inertial samples, where several topics have some.
    pub(crate) imu_problem: Option<String>,
}

impl Topics {
    /// Chooses.
    ///
    /// # Errors
    /// [`DataError`] if a topic that was set does not exist.
    pub(crate) fn choose(topics: &[Topic], settings: &Settings) -> DataResult<Self> {
        let chooser = Chooser { topics, settings, beside: None };
        let mut chosen = Self::default();
        let images = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];
        match chooser.one("color_topic", COLOR, &images, |t| !is_depth(t)) {
            Pick::One(topic) => chosen.color = Some(topic),
            Pick::None => {}
            Pick::Several(cameras, problem) => {
                (chosen.cameras, chosen.color_problem) = (cameras, Some(problem));
            }
            Pick::Missing(error) => return Err(error),
        }
        // What belongs to a robot stands in its namespace.
        let chooser = Chooser { beside: chosen.color.map(|c| topics[c].name.as_str()), ..chooser };
        match chooser.one("depth_topic", DEPTH, &images, is_depth) {
            Pick::One(topic) => chosen.depth = Some(topic),
            Pick::None => {}
            Pick::Several(_, problem) => chosen.depth_problem = Some(problem),
            Pick::Missing(error) => return Err(error),
        }
        let beside = chosen.color.map_or(COLOR_INFO.to_string(), |c| info_beside(&topics[c].name));
        // One that lies near may still be another camera's: a calibration is taken by its own name or not at all.
        let anywhere = Chooser { beside: None, ..chooser };
        match anywhere.one("camera_info_topic", &beside, &["sensor_msgs/CameraInfo"], |t| !is_depth(t)) {
            Pick::One(topic) => chosen.info = Some(topic),
            Pick::None | Pick::Several(..) => {}
            Pick::Missing(error) => return Err(error),
        }
        // A driver that sends gyroscope and accelerometer apart has no topic with both.
        match chooser.one("imu_topic", IMU, &["sensor_msgs/Imu"], |t| !t.name.ends_with("/sample")) {
            Pick::One(topic) => chosen.imu = Some(topic),
            Pick::None => {}
            Pick::Several(_, problem) => chosen.imu_problem = Some(problem),
            Pick::Missing(error) => return Err(error),
        }
        Ok(chosen)
    }
}

/// The short name of a camera: what stands before `image_raw` in its topic.
pub(crate) fn camera_name(topic: &str) -> String {
    let plain = without_transport(topic);
    let mut parts = plain.rsplit('/').filter(|p| !p.is_empty());
    let last = parts.next().unwrap_or("camera");
    match last.starts_with("image") {
        true => parts.next().unwrap_or("camera").to_string(),
        false => last.to_string(),
    }
}

/// Whether the images of a topic are rectified, so that the projection matrix holds and there is no distortion.
pub(crate) fn is_rectified(topic: &str) -> bool {
    without_transport(topic).rsplit('/').next().is_some_and(|leaf| leaf.starts_with("image_rect"))
}

fn without_transport(topic: &str) -> &str {
    TRANSPORTS.iter().find_map(|t| topic.strip_suffix(t)).unwrap_or(topic)
}

/// The calibration that a driver publishes beside an image topic.
pub(crate) fn info_beside(image_topic: &str) -> String {
    let plain = without_transport(image_topic);
    format!("{}/camera_info", plain.rsplit_once('/').map_or("", |(folder, _)| folder))
}

fn is_depth(topic: &Topic) -> bool {
    topic.name.to_ascii_lowercase().contains("depth")
}

enum Pick {
    One(usize),
    None,
    Several(Vec<usize>, String),
    Missing(DataError),
}

#[derive(Clone, Copy)]
struct Chooser<'a> {
    topics: &'a [Topic],
    settings: &'a Settings,
    /// The topic of the camera, once it is chosen.
    beside: Option<&'a str>,
}

impl Chooser<'_> {
    /// By the setting, by the default name, by that name behind a prefix, and then by type where only one is left.
    fn one(&self, key: &str, default: &str, kinds: &[&str], fits: fn(&Topic) -> bool) -> Pick {
        let of_kind = |t: &&(usize, &Topic)| kinds.contains(&t.1.kind.as_str()) && t.1.is_read();
        let all: Vec<(usize, &Topic)> = self.topics.iter().enumerate().collect();
        let typed: Vec<(usize, &Topic)> = all.iter().filter(of_kind).copied().collect();
        if let Some(name) = self.settings.get(key) {
            return match named(&typed, |t| t == name) {
                Some(topic) => Pick::One(topic),
                None => {
                    let names: Vec<&str> = typed.iter().map(|(_, t)| t.name.as_str()).collect();
                    let problem =
                        format!("{key} = {name}: there is no such topic of type {}", kinds.join(" or "));
                    Pick::Missing(DataError::new(problem).hint(format!("there are: {}", list(&names))))
                }
            };
        }
        let fitting: Vec<(usize, &Topic)> = typed.into_iter().filter(|(_, t)| fits(t)).collect();
        if let Some(topic) = named(&fitting, |t| t == default) {
            return Pick::One(topic);
        }
        let behind = fitting.iter().filter(|(_, t)| without_transport(&t.name).ends_with(default));
        let behind: Vec<(usize, &Topic)> = behind.copied().collect();
        let left = self.nearest(if behind.is_empty() { fitting } else { behind });
        let mut plain: Vec<&str> = left.iter().map(|(_, t)| without_transport(&t.name)).collect();
        plain.sort_unstable();
        plain.dedup();
        match plain.as_slice() {
            [] => Pick::None,
            [only] => named(&left, |t| t == *only).map_or(Pick::None, Pick::One),
            several => {
                let each = several.iter().filter_map(|name| named(&left, |t| t == *name)).collect();
                let problem = format!("several topics could be the {key}: {}; set it", list(several));
                Pick::Several(each, problem)
            }
        }
    }

    /// Those in the innermost namespace around the camera that has any; all of them where there is no such namespace.
    fn nearest<'t>(&self, topics: Vec<(usize, &'t Topic)>) -> Vec<(usize, &'t Topic)> {
        let mut space = self.beside.unwrap_or_default();
        while let Some((outer, _)) = space.rsplit_once('/') {
            let inside: Vec<_> = topics.iter().filter(|(_, t)| holds(outer, &t.name)).copied().collect();
            if !outer.is_empty() && !inside.is_empty() {
                return inside;
            }
            space = outer;
        }
        topics
    }
}

/// The topic of a name, uncompressed where there is a choice.
fn named(topics: &[(usize, &Topic)], is: impl Fn(&str) -> bool) -> Option<usize> {
    let exact = topics.iter().find(|(_, t)| is(&t.name));
    let transported = || topics.iter().find(|(_, t)| is(without_transport(&t.name)));
    exact.or_else(transported).map(|(i, _)| *i)
}

/// The frames in use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Frames {
    pub(crate) base: Option<String>,
    pub(crate) odom: Option<String>,
    pub(crate) map: Option<String>,
    pub(crate) floor: Option<String>,
    pub(crate) camera: Option<String>,
}

impl Frames {
    /// Chooses. `camera` is the frame that the images name; `child` is the frame whose poses a topic gives, taken as the
    /// base where tf has no other.
    ///
    /// # Errors
    /// [`DataError`] if a frame that was set does not exist.
    pub(crate) fn choose(
        tf: &TfTree,
        settings: &Settings,
        camera: Option<&str>,
        child: Option<&str>,
    ) -> DataResult<Self> {
        let set = |key: &str| -> DataResult<Option<String>> {
            let Some(name) = settings.get(key) else { return Ok(None) };
            let name = name.trim_start_matches('/');
            // Without any tf the frames are but names, which tell topics apart.
            if tf.frames().is_empty() || camera == Some(name) || child == Some(name) {
                return Ok(Some(name.to_string()));
            }
            let frames = tf.frames();
            tf.find(name).map(Some).ok_or_else(|| {
                DataError::new(format!("{key} = {name}: tf has no such frame"))
                    .hint(format!("its frames: {}", list(&frames)))
            })
        };
        let base = set("base_frame")?
            .or_else(|| tf.find_near("base_footprint", camera))
            .or_else(|| tf.find_near("base_link", camera))
            .or_else(|| child.filter(|c| !c.is_empty()).map(str::to_string));
        Ok(Self {
            odom: set("odom_frame")?.or_else(|| tf.find_near("odom", camera)),
            map: set("map_frame")?.or_else(|| tf.find_near("map", camera)),
            floor: set("floor_frame")?.or_else(|| tf.find_near("base_footprint", camera)),
            camera: set("camera_frame")?.or_else(|| camera.filter(|c| !c.is_empty()).map(str::to_string)),
            base,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::Encoding;

    fn topics(names: &[(&str, &str)]) -> Vec<Topic> {
        let topic = |(name, kind): &(&str, &str)| Topic {
            name: (*name).to_string(),
            kind: format!("sensor_msgs/{kind}"),
            encoding: Encoding::Cdr,
            format: "cdr".to_string(),
            count: 1,
            recorded: None,
        };
        names.iter().map(topic).collect()
    }

    fn choose(names: &[(&str, &str)]) -> Topics {
        Topics::choose(&topics(names), &Settings::default()).unwrap()
    }

    #[test]
    fn by_name_then_behind_a_prefix_then_by_type() {
        let locobot = choose(&[
            ("/camera/depth/image_rect_raw", "Image"),
            ("/camera/color/image_raw/compressed", "CompressedImage"),
            ("/camera/color/image_raw", "Image"),
            ("/camera/aligned_depth_to_color/image_raw/compressedDepth", "CompressedImage"),
            ("/camera/depth/camera_info", "CameraInfo"),
            ("/camera/color/camera_info", "CameraInfo"),
            ("/camera/gyro/sample", "Imu"),
            ("/imu", "Imu"),
        ]);
        assert_eq!((locobot.color, locobot.depth), (Some(2), Some(3)), "raw before compressed");
        assert_eq!((locobot.info, locobot.imu), (Some(5), Some(7)));
        let prefixed = choose(&[
            ("/other/image_raw", "Image"),
            ("/locobot/camera/color/image_raw/compressed", "CompressedImage"),
            ("/locobot/camera/color/camera_info", "CameraInfo"),
        ]);
        assert_eq!((prefixed.color, prefixed.info, prefixed.depth), (Some(1), Some(2), None));
        let other = choose(&[
            ("/cam0/image_mono", "Image"),
            ("/cam0/camera_info", "CameraInfo"),
            ("/mynt/imu", "Imu"),
        ]);
        assert_eq!((other.color, other.info, other.imu), (Some(0), Some(1), Some(2)));
        let two = choose(&[("/left/image_raw", "Image"), ("/right/image_raw", "Image")]);
        assert_eq!(two.color, None);
        assert!(two.color_problem.unwrap().contains("/left/image_raw, /right/image_raw; set it"));
        assert_eq!(two.cameras, [0, 1]);
    }

    #[test]
    fn of_several_robots_that_of_the_camera_counts() {
        let robots = choose(&[
            ("/robot1/imu/data", "Imu"),
            ("/robot1/front/depth/image_raw", "Image"),
            ("/robot2/imu/data", "Imu"),
            ("/robot2/front/depth/image_raw", "Image"),
            ("/robot2/front/image_raw", "Image"),
            ("/robot2/front/camera_info", "CameraInfo"),
            ("/robot1/front/camera_info", "CameraInfo"),
        ]);
        assert_eq!(
            (robots.color, robots.info, robots.depth, robots.imu),
            (Some(4), Some(5), Some(3), Some(2))
        );
        let beside_none = choose(&[("/cam/image_raw", "Image"), ("/a/imu", "Imu"), ("/b/imu", "Imu")]);
        assert!(beside_none.imu.is_none() && beside_none.imu_problem.unwrap().contains("/a/imu, /b/imu"));
        let robots = choose(&[("/cam/image_raw", "Image"), ("/a/depth", "Image"), ("/b/depth", "Image")]);
        assert!(robots.depth_problem.unwrap().contains("several topics could be the depth_topic"));
    }

    #[test]
    fn what_cannot_be_read_is_not_chosen() {
        let mut topics =
            topics(&[("/json/image", "Image"), ("/cam/image", "Image"), ("/none/image", "Image")]);
        (topics[0].encoding, topics[2].count) = (Encoding::Other, 0);
        assert_eq!(Topics::choose(&topics, &Settings::default()).unwrap().color, Some(1));
    }

    #[test]
    fn names_of_cameras() {
        let names =
            ["/camera/color/image_raw", "/camera/color/image_raw/compressed", "/usb_cam", "/image_raw"];
        assert_eq!(names.map(camera_name), ["color", "color", "usb_cam", "camera"]);
        assert!(is_rectified("/left/image_rect_color/compressed") && !is_rectified("/left/image_raw"));
    }
}
