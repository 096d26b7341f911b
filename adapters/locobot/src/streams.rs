//! Pose streams: from tf, from topics with poses, and the ground truth.

use vice_core::dataset::GROUND_TRUTH;
use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use crate::choose::Frames;
use crate::doubts::{Doubts, REPEATED};
use crate::series::PoseTopic;
use crate::settings::Settings;
use crate::tf::{CLOCK_JUMP, Chain, TfTree, Transform, clock_jump};
use crate::to_and_fro;

/// The stream of the wheel encoders, `odom -> base` of tf.
pub(crate) const ODOM: &str = "odom";
/// The stream of SLAM, `map -> base` of tf.
pub(crate) const SLAM: &str = "slam";

/// Where the ground truth comes from.
#[derive(Debug)]
pub(crate) enum GroundTruth {
    /// A topic with poses, by its name.
    Topic(String),
    /// A file, read already.
    File(Trajectory),
}

impl GroundTruth {
    /// As the settings say.
    ///
    /// # Errors
    /// [`DataError`] if it is neither a topic with poses nor a trajectory file.
    pub(crate) fn choose(settings: &Settings, topics: &[&str]) -> DataResult<Option<Self>> {
        let Some(name) = settings.get("ground_truth") else { return Ok(None) };
        if topics.contains(&name) {
            return Ok(Some(Self::Topic(name.to_string())));
        }
        let path = settings.path(name);
        if !path.exists() {
            let problem =
                format!("ground_truth = {name}: there is no such topic with poses, and no such file");
            let hint = format!("topics with poses: {}", crate::tf::list(topics));
            return Err(DataError::new(problem).hint(hint));
        }
        let file = vice_files::trajectory::read(&path, &vice_files::trajectory::ReadOptions::default())?;
        Ok(Some(Self::File(file.trajectory)))
    }
}

/// The way of a stream of tf: from the base to the world frame.
pub(crate) fn tf_chain<'a>(tf: &'a TfTree, frames: &'a Frames, stream: &str) -> DataResult<Chain<'a>> {
    tf.decided()?;
    let (key, world) = if stream == ODOM { ("odom_frame", &frames.odom) } else { ("map_frame", &frames.map) };
    let (Some(world), Some(base)) = (world, &frames.base) else {
        let (key, missing) = if world.is_none() { (key, "world frame") } else { ("base_frame", "base") };
        let problem = format!("stream {stream}: tf has no {missing} for it");
        return Err(DataError::new(problem).hint(format!("set {key}")));
    };
    tf.chain(world, base)
}

/// The trajectory of a chain of tf.
///
/// Its poses are at the stamps of the moving edges, and at `frames` too: each edge is interpolated for itself there,
/// as the method wants it, and not the product of them.
pub(crate) fn tf_trajectory(chain: &Chain<'_>, frames: &[Stamp], stream: &str) -> DataResult<Trajectory> {
    if let Some(jump) = chain.jump() {
        return Err(jump);
    }
    let mut stamps = chain.stamps();
    stamps.extend_from_slice(frames);
    stamps.sort_unstable();
    stamps.dedup();
    let mut missed = None;
    let poses = stamps.iter().filter_map(|stamp| match chain.at(*stamp) {
        Ok(pose) => Some((*stamp, pose.reinterpret())),
        Err(e) => {
            missed.get_or_insert(e);
            None
        }
    });
    let trajectory = Trajectory::from_poses(poses.collect::<Vec<_>>());
    trajectory.map_err(|e| missed.unwrap_or_else(|| DataError::new(format!("stream {stream}: {e}"))))
}

/// The trajectory of a topic with poses.
///
/// Poses of a frame that tf connects to the base are moved there; others are taken as those of the base.
pub(crate) fn topic_trajectory(
    topic: &PoseTopic,
    name: &str,
    child: &str,
    tf: &TfTree,
    base: Option<&str>,
    doubts: &Doubts,
) -> DataResult<Trajectory> {
    let about = format!("topic {name}");
    let back = topic.poses.windows(2).map(|w| (w[0].0, w[1].0));
    let mut back = back.filter(|(before, after)| before.since(*after) >= CLOCK_JUMP);
    if let Some(jump) = back.next() {
        return Err(clock_jump(&format!("{about}: the clock"), jump, 1 + back.count() as u64));
    }
    let mut rows = topic.poses.clone();
    rows.sort_by_key(|(stamp, _)| *stamp);
    doubts.say_all(to_and_fro::doubt(&about, &rows.iter().map(|row| row.1).collect::<Vec<_>>()));
    // The first of several for the same stamp counts, as in files.
    let n = rows.len();
    rows.dedup_by_key(|(stamp, _)| *stamp);
    if rows.len() < n {
        let again = (n - rows.len()) as u64;
        let message = format!("{again} poses repeat a stamp: the first of each is kept");
        doubts.say(Suspicion::new(REPEATED, about.as_str(), message).times(again));
    }
    let chain = base.filter(|base| !child.is_empty() && *base != child).map(|base| tf.chain(child, base));
    let in_base = |(stamp, pose): (Stamp, Transform)| match &chain {
        Some(Ok(chain)) => chain.at(stamp).ok().map(|child_from_base| (stamp, pose * child_from_base)),
        _ => Some((stamp, pose)),
    };
    if let Some(Err(e)) = &chain {
        let message = format!("it gives poses of {child}, taken as those of the body, since {e}");
        doubts.say(
            Suspicion::new("body-not-known", format!("stream {name}"), message).advice("set base_frame"),
        );
    }
    let poses = rows.into_iter().filter_map(in_base).map(|(stamp, pose)| (stamp, pose.reinterpret()));
    Trajectory::from_poses(poses.collect::<Vec<_>>()).map_err(|e| {
        let zero = if topic.unstamped > 0 { " with a stamp that is not zero" } else { "" };
        DataError::new(format!("topic {name}: {e}{zero}"))
    })
}

/// Names of the streams, the ground truth first, then those of tf, then topics.
pub(crate) fn names<'a>(
    tf: &TfTree,
    frames: &Frames,
    topics: impl Iterator<Item = &'a str>,
    ground_truth: Option<&GroundTruth>,
) -> Vec<String> {
    let from_tf = [ODOM, SLAM].into_iter().filter(|s| match tf_chain(tf, frames, s) {
        Ok(chain) => !chain.is_fixed(),
        Err(_) => false,
    });
    let first = ground_truth.map(|_| GROUND_TRUTH);
    first.into_iter().chain(from_tf).chain(topics).map(str::to_string).collect()
}
