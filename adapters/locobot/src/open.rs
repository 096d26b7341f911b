//! Opening a recording: the index pass, what tf lacks, and the choice of topics and frames.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use vice_core::budget::BUDGET;
use vice_core::dataset::OpenOptions;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::statistics::middle;
use vice_core::suspicion::Suspicion;
use vice_core::time::Span;

use crate::camera::{Images, RosCamera};
use crate::choose::{Frames, Topics, camera_name, info_beside};
use crate::container::{Encoding, Recording, Topic, find};
use crate::dataset::RosDataset;
use crate::doubts::{DAMAGED, Doubts, SEVERAL_TOPICS, TWO_SOURCES, group};
use crate::index::Index;
use crate::namespaces::{self, Asked};
use crate::series::PoseTopic;
use crate::settings::Settings;
use crate::streams::GroundTruth;
use crate::tf::{TfTree, list};
use crate::{clocks, complete};

/// Places of damage that are named one by one.
const SHOWN_PLACES: usize = 5;
/// How far a depth image may be from a frame where the period of the frames is not known.
const LONE_FRAME_OFFSET: Span = Span::from_millis(20);

/// Opens a recording.
///
/// # Errors
/// [`DataError`] if there is none, it has nothing of use, or a setting does not fit it.
pub(crate) fn open(path: &Path, options: &OpenOptions) -> DataResult<RosDataset> {
    if !path.exists() {
        return Err(DataError::new("no such file or folder").at(path));
    }
    let found = match find(path)?.as_slice() {
        [one] => one.clone(),
        [] => return Err(not_a_recording(path)),
        several => {
            let problem = format!("this holds {} recordings, not one", several.len());
            return Err(DataError::new(problem).at(path).hint("name one of them"));
        }
    };
    let settings = Settings::load(path, options)?;
    let depth_unit = settings.depth_unit()?;
    let doubts = Doubts::default();
    doubts.say_all(found.notes.iter().cloned());
    let recording = Recording::open(&found)?;
    let mut index = Index::new(settings.stamps()?);
    let scan = recording.scan(&mut index)?;
    doubts.say_all(damage(scan.damage));
    index.finish();
    doubts.say_all(index.broken(&recording, &scan.topics));
    let topics = scan.topics;
    doubts.say_all(unread(&topics));
    check_use(&topics, path, &doubts)?;
    let chosen = Topics::choose(&topics, &settings).map_err(|e| e.at(path))?;
    for problem in [&chosen.depth_problem, &chosen.imu_problem].into_iter().flatten() {
        doubts.say(Suspicion::new(SEVERAL_TOPICS, "", format!("none is used: {problem}")));
    }
    doubts.say_all(clocks::doubt(&topics, &chosen, &index));
    let delays = clocks::delays(&topics, &index);
    let color_topic = chosen.color.map(|t| topics[t].name.as_str());
    let image_frame = chosen.color.and_then(|t| index.images.get(&t)).map(|i| i.frame.clone());
    let tf =
        choose_tf(&recording, &settings, &topics, &mut index, color_topic, image_frame.as_deref(), &doubts)
            .map_err(|e| e.at(path))?;
    let mut images = |topic: usize| -> DataResult<Option<Images>> {
        let found = index.images.remove(&topic);
        found.map(|found| Images::new(&recording, &topics[topic], found, &doubts)).transpose()
    };
    let mut cameras = Vec::new();
    for topic in chosen.color.into_iter().chain(chosen.cameras.iter().copied()) {
        let images = match images(topic) {
            Ok(Some(images)) => images,
            Ok(None) => continue,
            Err(e) if chosen.color.is_some() => return Err(e),
            // One of several that nobody has asked for yet.
            Err(e) => {
                doubts.say(Suspicion::new(DAMAGED, "", e.to_string()));
                continue;
            }
        };
        let info = match chosen.color {
            Some(_) => chosen.info,
            None => chosen.info.filter(|_| settings.get("camera_info_topic").is_some()).or_else(|| {
                let beside = info_beside(&images.topic);
                topics
                    .iter()
                    .position(|t| t.name == beside && t.kind == "sensor_msgs/CameraInfo" && t.is_read())
            }),
        };
        let found = info.and_then(|t| Some((topics[t].name.clone(), index.infos.get(&t)?.clone())));
        let name = camera_name(&images.topic);
        cameras.push(RosCamera { name, images, info: found });
    }
    let depth = chosen.depth.map(&mut images).transpose()?.flatten();
    if depth_unit.is_some() && depth.is_none() {
        let problem = "depth_unit is set, but there are no depth images in use";
        return Err(DataError::of_kind(ErrorKind::Usage, problem)
            .at(path)
            .hint("set depth_topic, or leave it out"));
    }
    name_apart(&mut cameras);
    cameras.iter().for_each(|camera| doubts.say_all(camera.doubts()));
    let color = cameras.first().filter(|_| chosen.color.is_some());
    let depth_offset = depth_offset(&settings, color.map(|c| &c.images))?;
    let child = index.poses.values().map(|t| t.child.as_str()).find(|c| !c.is_empty());
    // Without images the calibration still names the frame.
    let info_frame = chosen.info.and_then(|t| index.infos.get(&t)).map(|i| i.info.frame.clone());
    let camera_frame = color.map(|c| c.images.frame.clone()).or(info_frame.filter(|_| cameras.is_empty()));
    let frames = Frames::choose(&tf, &settings, camera_frame.as_deref(), child).map_err(|e| e.at(path))?;
    if let (Some(depth), Some(camera)) = (&depth, &camera_frame)
        && depth.frame != *camera
    {
        let message = format!("its frame is {}, the camera's is {camera}: is it registered?", depth.frame);
        doubts.say(Suspicion::new("depth-frame", format!("topic {}", depth.topic), message));
    }
    let mut poses: BTreeMap<String, PoseTopic> = BTreeMap::new();
    for (topic, found) in index.poses {
        let Topic { name, kind, .. } = &topics[topic];
        if poses.contains_key(name) {
            let message = format!("there are messages of several types: those of {kind} are left out");
            doubts.say(Suspicion::new(TWO_SOURCES, format!("topic {name}"), message));
        } else {
            poses.insert(name.clone(), found);
        }
    }
    poses.iter().for_each(|(name, topic)| doubts.say_all(topic.doubts(name)));
    let names: Vec<&str> = poses.keys().map(String::as_str).collect();
    let ground_truth = GroundTruth::choose(&settings, &names)?;
    Ok(RosDataset {
        name: name_of(path),
        path: path.to_path_buf(),
        fixed_camera: settings.body_from_camera()?,
        settings,
        recording,
        topics,
        chosen,
        frames,
        tf,
        cameras,
        named: AtomicBool::new(false),
        depth,
        depth_offset,
        depth_unit,
        poses,
        ground_truth,
        delays,
        doubts,
        imu: OnceLock::new(),
        cloud: OnceLock::new(),
    })
}

/// Damage of the files: the first places, and how many more there are.
fn damage(mut places: Vec<String>) -> Vec<Suspicion> {
    let more = if places.len() > SHOWN_PLACES + 1 { places.split_off(SHOWN_PLACES).len() } else { 0 };
    let said = places.into_iter().map(|line| Suspicion::new(DAMAGED, "", line));
    let rest = (more > 0).then(|| {
        let message = format!("{more} more places of the recording are damaged in the same way or another");
        Suspicion::new(DAMAGED, "", message).times(more as u64)
    });
    said.chain(rest).collect()
}

/// The tree of the robot that is meant, completed by what its description has.
fn choose_tf(
    recording: &Recording,
    settings: &Settings,
    topics: &[Topic],
    index: &mut Index,
    camera_topic: Option<&str>,
    camera_frame: Option<&str>,
    doubts: &Doubts,
) -> DataResult<TfTree> {
    let asked = Asked { set: settings.get("tf_namespace"), camera_topic, camera_frame };
    let mut chosen = namespaces::choose(std::mem::take(&mut index.spaces.all), &asked)?;
    doubts.say_all(chosen.doubt.take());
    if chosen.undecided.is_none() {
        let place = chosen.space.as_deref().or(camera_topic.map(namespaces::namespace)).unwrap_or_default();
        complete::complete(recording, settings, topics, index, place, &mut chosen.tf, doubts)?;
    }
    let tf = chosen.finish();
    doubts.say_all(tf.notes.iter().cloned());
    match tf.roots() {
        Ok(roots) if roots.len() > 1 => {
            let trees: Vec<String> =
                roots.iter().map(|(root, n)| format!("{root} (with {n} under it)")).collect();
            let message = format!("tf has {} trees that are not connected: {}", roots.len(), list(&trees));
            doubts.say(Suspicion::new("tf-trees", "", message));
        }
        Ok(_) => {}
        Err(cycle) => doubts.say(Suspicion::new("tf-cycle", "", cycle.to_string())),
    }
    Ok(tf)
}

/// Topics that would be of use, were their messages in an encoding that is read.
fn unread(topics: &[Topic]) -> Option<Suspicion> {
    let others = topics.iter().filter(|t| t.encoding == Encoding::Other && t.count > 0);
    let each: Vec<(String, u64)> =
        others.map(|t| (format!("{} ({}, {})", t.name, t.kind, t.format), t.count)).collect();
    let doubt = group(
        "topic-not-read",
        &each,
        |topic, n| format!("{n} messages of {topic} are not read: neither ROS 1 nor CDR"),
        "{all} messages of {n} topics are not read: neither ROS 1 nor CDR",
    );
    // What no robot sends for VICE is no loss.
    doubt.filter(|_| topics.iter().any(|t| t.encoding == Encoding::Other && t.count > 0 && is_of_use(t)))
}

/// Cameras of the same short name go by their topics.
fn name_apart(cameras: &mut [RosCamera]) {
    let names: Vec<String> = cameras.iter().map(|c| c.name.clone()).collect();
    for camera in cameras {
        if names.iter().filter(|name| **name == camera.name).count() > 1 {
            camera.name = camera.images.topic.clone();
        }
    }
}

/// The name of a file without its ending, or that of a folder.
fn name_of(path: &Path) -> String {
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let name = if whole.is_dir() { whole.file_name() } else { whole.file_stem() };
    name.unwrap_or_default().to_string_lossy().into_owned()
}

/// Why nothing was found: the first bytes of a file say more than that it is not known.
fn not_a_recording(path: &Path) -> DataError {
    let empty = path.is_file() && path.metadata().is_ok_and(|m| m.len() == 0);
    let problem = match (empty, path.is_dir()) {
        (true, _) => "the file is empty",
        (false, true) => "the folder has no ROS 1 bag, MCAP file or rosbag2 data base",
        (false, false) => "is no ROS 1 bag, MCAP file or rosbag2 data base",
    };
    DataError::new(problem).at(path)
}

/// Whether a topic has images, transforms or poses, by its type.
fn is_of_use(topic: &Topic) -> bool {
    let known = ["/Image", "/CompressedImage", "/TFMessage", "/tfMessage", "/Odometry", "Stamped", "/Path"];
    known.iter().any(|k| topic.kind.ends_with(k))
}

/// Refuses a recording with nothing of use, with the reason that is nearest.
fn check_use(topics: &[Topic], path: &Path, doubts: &Doubts) -> DataResult<()> {
    if topics.iter().any(|t| t.is_read() && is_of_use(t)) {
        return Ok(());
    }
    let names: Vec<String> = topics.iter().map(|t| format!("{} ({})", t.name, t.kind)).collect();
    let mut unread: Vec<&str> =
        topics.iter().filter(|t| t.encoding == Encoding::Other).map(|t| t.format.as_str()).collect();
    unread.sort_unstable();
    unread.dedup();
    let problem = match (topics.is_empty(), unread.as_slice()) {
        (true, _) => "there are no messages".to_string(),
        (false, []) => "no topic has images, transforms or poses".to_string(),
        (false, formats) => format!(
            "no topic has images, transforms or poses that can be read: messages in {} are not",
            list(formats)
        ),
    };
    let error = DataError::of_kind(ErrorKind::Unsupported, problem).at(path);
    // A file that was refused for what it claims is of more use said than one that was not closed.
    let damage = doubts.damage();
    let reason = damage.iter().find(|line| line.contains(BUDGET)).or(damage.first()).cloned();
    Err(match reason {
        Some(first) => error.because(DataError::new(first)),
        None if names.is_empty() => error,
        None => error.hint(format!("its topics: {}", list(&names))),
    })
}

/// How far a depth image may be from its frame: half a frame period, or what is set.
fn depth_offset(settings: &Settings, color: Option<&Images>) -> DataResult<Span> {
    if let Some(text) = settings.get("max_depth_offset") {
        let span = Span::parse_seconds(text).map_err(|e| DataError::new(format!("max_depth_offset: {e}")))?;
        return Ok(span);
    }
    let stamps = color.map_or(&[][..], |c| &c.stamps);
    let mut periods: Vec<Span> = stamps.windows(2).map(|w| w[1].since(w[0])).collect();
    let median = middle(&mut periods, Ord::cmp);
    Ok(median.map_or(LONE_FRAME_OFFSET, |p| Span::from_nanos(p.as_nanos() / 2)))
}
