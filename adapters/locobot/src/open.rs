//! Opening a recording: the index pass, what tf lacks, and the choice of topics and frames.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use vice_core::dataset::OpenOptions;
use vice_core::error::{DataError, DataResult};
use vice_core::time::{Span, Stamp};

use crate::choose::{Frames, Topics, camera_name};
use crate::container::{Encoding, Recording, Topic, find};
use crate::dataset::{Images, RosDataset};
use crate::index::{ImageTopic, Index, Only};
use crate::message::joint_state;
use crate::settings::{Settings, Stamps};
use crate::streams::GroundTruth;
use crate::tf::TfBuilder;
use crate::urdf;
use crate::wire::Reader;

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
    let recording = Recording::open(&found)?;
    let mut index = Index::new(settings.stamps()?);
    let scan = recording.scan(&mut index)?;
    let mut damage = Vec::new();
    warn(scan.damage, &mut damage);
    let broken = index.broken_lines(&recording, &scan.topics);
    warn(broken, &mut damage);
    let topics = scan.topics;
    check_use(&topics, path, &damage)?;
    complete_tf(&recording, &settings, &mut index)?;
    let tf = std::mem::take(&mut index.tf).finish();
    warn(tf.notes.clone(), &mut damage);
    match tf.roots() {
        Ok(roots) if roots.len() > 1 => {
            let trees: Vec<String> =
                roots.iter().map(|(root, n)| format!("{root} (with {n} under it)")).collect();
            warn(
                vec![format!("tf has {} trees that are not connected: {}", roots.len(), trees.join(", "))],
                &mut damage,
            );
        }
        Ok(_) => {}
        Err(cycle) => warn(vec![cycle.to_string()], &mut damage),
    }
    let chosen = Topics::choose(&topics, &settings).map_err(|e| e.at(path))?;
    let mut images = |topic: Option<usize>| -> DataResult<Option<Images>> {
        let Some(topic) = topic else { return Ok(None) };
        let Some(found) = index.images.remove(&topic) else { return Ok(None) };
        frames_of(&recording, &topics[topic], found, &mut damage).map(Some)
    };
    let (color, depth) = (images(chosen.color)?, images(chosen.depth)?);
    let depth_offset = depth_offset(&settings, color.as_ref())?;
    let info = chosen.info.and_then(|topic| index.infos.remove(&topic));
    if let (Some(found), Some(topic)) = (&info, chosen.info)
        && found.changes > 0
    {
        let name = &topics[topic].name;
        warn(
            vec![format!(
                "topic {name}: the calibration changes {} times: the first is taken",
                found.changes
            )],
            &mut damage,
        );
    }
    let child = index.poses.values().map(|t| t.child.as_str()).find(|c| !c.is_empty());
    let camera_frame =
        color.as_ref().map(|c| c.frame.as_str()).or(info.as_ref().map(|i| i.info.frame.as_str()));
    let frames = Frames::choose(&tf, &settings, camera_frame, child).map_err(|e| e.at(path))?;
    if let (Some(depth), Some(camera)) = (&depth, camera_frame)
        && depth.frame != camera
    {
        let topic = &depth.topic;
        warn(
            vec![format!(
                "topic {topic}: its frame is {}, the camera's is {camera}: is it registered?",
                depth.frame
            )],
            &mut damage,
        );
    }
    let poses: std::collections::BTreeMap<_, _> =
        index.poses.into_iter().map(|(topic, poses)| (topics[topic].name.clone(), poses)).collect();
    let names: Vec<&str> = poses.keys().map(String::as_str).collect();
    let ground_truth = GroundTruth::choose(&settings, &names)?;
    let camera = color.as_ref().map_or_else(|| "camera".to_string(), |c| camera_name(&c.topic));
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
        camera,
        color,
        depth,
        depth_offset,
        info,
        poses,
        ground_truth,
        damage,
        imu: OnceLock::new(),
    })
}

fn warn(lines: Vec<String>, damage: &mut Vec<String>) {
    lines.iter().for_each(|line| tracing::warn!("{line}"));
    damage.extend(lines);
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

/// Refuses a recording with nothing of use, with the reason that is nearest.
fn check_use(topics: &[Topic], path: &Path, damage: &[String]) -> DataResult<()> {
    let used = |t: &&Topic| {
        let known = ["/Image", "/CompressedImage", "/TFMessage", "/tfMessage", "/Odometry", "Stamped"];
        t.count > 0 && t.encoding != Encoding::Other && known.iter().any(|k| t.kind.ends_with(k))
    };
    if topics.iter().any(|t| used(&t)) {
        return Ok(());
    }
    let names: Vec<String> = topics.iter().map(|t| format!("{} ({})", t.name, t.kind)).collect();
    let problem = match topics.is_empty() {
        true => "there are no messages".to_string(),
        false => "no topic has images, transforms or poses".to_string(),
    };
    let error = DataError::new(problem).at(path);
    Err(match damage.first() {
        Some(first) => error.because(first.clone()),
        None if names.is_empty() => error,
        None => error.hint(format!("its topics: {}", crate::tf::list(&names))),
    })
}

/// Adds the joints of a URDF that tf lacks, with their positions from `sensor_msgs/JointState` where they move.
fn complete_tf(recording: &Recording, settings: &Settings, index: &mut Index) -> DataResult<()> {
    let joints = match (settings.get("urdf"), &index.description) {
        (Some(name), _) => {
            let path = settings.path(name);
            let text = std::fs::read_to_string(&path)
                .map_err(|e| DataError::new("cannot be read").at(&path).because(e))?;
            urdf::parse(&text).map_err(|e| e.at(&path))?
        }
        (None, Some(text)) => match urdf::parse(text) {
            Ok(joints) => joints,
            Err(e) => {
                tracing::warn!("the robot description is left aside: {e}");
                return Ok(());
            }
        },
        (None, None) => return Ok(()),
    };
    let missing: Vec<urdf::Joint> = joints.into_iter().filter(|j| !index.tf.has(&j.child)).collect();
    let mut moving = false;
    for joint in &missing {
        match joint.fixed() {
            Some(fixed) => index.tf.fix(&joint.parent, &joint.child, fixed),
            None => moving = true,
        }
    }
    if moving {
        add_joint_states(recording, settings.stamps()?, &missing, &mut index.tf)?;
    }
    Ok(())
}

fn add_joint_states(
    recording: &Recording,
    stamps: Stamps,
    joints: &[urdf::Joint],
    tf: &mut TfBuilder,
) -> DataResult<()> {
    let mut broken = 0_u64;
    let mut pass = Only {
        wanted: |topic: &Topic| topic.kind == "sensor_msgs/JointState",
        each: |message: &crate::container::Message<'_>| {
            let mut positions = Vec::new();
            let read = Reader::new(message.bytes, message.encoding)
                .and_then(|mut r| joint_state(&mut r, |name, position| positions.push((name, position))));
            let Ok(header) = read else {
                broken += 1;
                return;
            };
            let stamp = if stamps == Stamps::Record { message.recorded } else { header.stamp };
            for (name, position) in positions {
                for joint in joints.iter().filter(|j| j.driver() == name) {
                    if let Some(transform) = joint.at(position) {
                        tf.sample(&joint.parent, &joint.child, stamp, transform);
                    }
                }
            }
        },
    };
    recording.scan(&mut pass)?;
    if broken > 0 {
        tracing::warn!("{broken} messages of sensor_msgs/JointState cannot be decoded: left out");
    }
    Ok(())
}

/// The frames of a topic, sorted in time.
fn frames_of(
    recording: &Recording,
    topic: &Topic,
    found: ImageTopic,
    damage: &mut Vec<String>,
) -> DataResult<Images> {
    let ImageTopic { packing, mut frames, frame, encoding, unstamped, jump } = found;
    let name = &topic.name;
    if let Some((before, after, locator)) = jump {
        let problem = format!("topic {name}: the clock jumps back from {before} ns to {after} ns");
        return Err(recording.place(&locator, DataError::new(problem).hint("cut the recording at the jump")));
    }
    if frames.is_empty() {
        return Err(DataError::new(format!("topic {name}: all {unstamped} stamps are zero")).hint(
            "a robot on simulated time without a clock; `set` stamps=record takes the time of recording",
        ));
    }
    if unstamped > 0 {
        warn(vec![format!("topic {name}: {unstamped} images with a zero stamp are left out")], damage);
    }
    frames.sort_by_key(|(stamp, _)| *stamp);
    let n = frames.len();
    frames.dedup_by_key(|(stamp, _)| *stamp);
    if frames.len() < n {
        let again = n - frames.len();
        warn(vec![format!("topic {name}: {again} images repeat a stamp: the first of each is kept")], damage);
    }
    let (stamps, locators): (Vec<Stamp>, Vec<_>) = frames.into_iter().unzip();
    Ok(Images { topic: name.clone(), packing, frame, encoding, stamps: Arc::from(stamps), locators })
}

/// How far a depth image may be from its frame: half a frame period, or what is set.
fn depth_offset(settings: &Settings, color: Option<&Images>) -> DataResult<Span> {
    if let Some(text) = settings.get("max_depth_offset") {
        let span = Span::parse_seconds(text).map_err(|e| DataError::new(format!("max_depth_offset: {e}")))?;
        return Ok(span);
    }
    let stamps = color.map_or(&[][..], |c| &c.stamps);
    let mut periods: Vec<Span> = stamps.windows(2).map(|w| w[1].since(w[0])).collect();
    periods.sort_unstable();
    let median = periods.get(periods.len() / 2);
    Ok(median.map_or(LONE_FRAME_OFFSET, |p| Span::from_nanos(p.as_nanos() / 2)))
}
