//! Poses and labels that a caller hands over instead of naming files.
//!
//! A request stays plain data: it names what was handed over as `in-memory:NAME@HASH`, where the hash is the SHA-256 of
//! the content. So a result says what it is of, two results of the same content say the same, and who runs the request
//! again without handing over the same content is told so.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use vice_core::label::LabelSet;
use vice_core::trajectory::Trajectory;

use crate::error::{RunError, RunResult};
use crate::text::hex;

/// Starts the name of what was handed over.
pub const PREFIX: &str = "in-memory:";

/// What was handed over, by the names that a request has for it.
#[derive(Clone, Debug, Default)]
pub struct InMemory {
    trajectories: BTreeMap<String, Trajectory>,
    labels: BTreeMap<PathBuf, LabelSet>,
}

impl InMemory {
    /// Hands over poses `world_from_body`; the answer is how a request names them as an estimate or reference.
    pub fn add_trajectory(&mut self, name: &str, trajectory: Trajectory) -> String {
        let text = format!("{PREFIX}{name}@{}", hash_of_poses(&trajectory));
        self.trajectories.insert(text.clone(), trajectory);
        text
    }

    /// Hands over labels; the answer is what a request has in the place of their file.
    pub fn add_labels(&mut self, labels: LabelSet) -> PathBuf {
        let text = PathBuf::from(format!("{PREFIX}labels@{}", hash_of_labels(&labels)));
        self.labels.insert(text.clone(), labels);
        text
    }

    /// The poses that a request names, where it names some of memory.
    ///
    /// # Errors
    /// [`RunError`] of the kind missing if they are not at hand.
    pub(crate) fn trajectory(&self, name: &str) -> RunResult<Option<&Trajectory>> {
        match self.trajectories.get(name) {
            None if name.starts_with(PREFIX) => Err(gone(name)),
            found => Ok(found),
        }
    }

    /// The labels that a request names, where it names some of memory.
    ///
    /// # Errors
    /// [`RunError`] of the kind missing if they are not at hand.
    pub(crate) fn labels(&self, file: &Path) -> RunResult<Option<&LabelSet>> {
        match self.labels.get(file) {
            None if file.to_string_lossy().starts_with(PREFIX) => Err(gone(&file.to_string_lossy())),
            found => Ok(found),
        }
    }
}

fn gone(name: &str) -> RunError {
    RunError::missing(format!("{name} was handed over in memory, and is not at hand"))
        .advise("hand the same over again, or name a file in its place")
}

/// Whether a text names something that was handed over.
pub fn is_in_memory(name: &str) -> bool {
    name.starts_with(PREFIX)
}

/// The name by which something was handed over; of any other text the whole.
pub fn own_name(text: &str) -> &str {
    let inside = text.strip_prefix(PREFIX).and_then(|rest| rest.rsplit_once('@'));
    inside.map_or(text, |(name, _)| name)
}

fn hash_of_poses(trajectory: &Trajectory) -> String {
    let mut hasher = Sha256::new();
    for (stamp, pose) in trajectory.iter() {
        hasher.update(stamp.as_nanos().to_le_bytes());
        let (t, q) = (pose.translation(), pose.rotation());
        for number in [t.x, t.y, t.z, q.i, q.j, q.k, q.w] {
            hasher.update(number.to_le_bytes());
        }
    }
    hex(&hasher.finalize())
}

fn hash_of_labels(labels: &LabelSet) -> String {
    let mut hasher = Sha256::new();
    for point in labels.points() {
        hasher.update((point.name.len() as u64).to_le_bytes());
        hasher.update(point.name.as_bytes());
        hasher.update((point.observations.len() as u64).to_le_bytes());
        for o in &point.observations {
            hasher.update(o.stamp.as_nanos().to_le_bytes());
            hasher.update(o.px.u.to_le_bytes());
            hasher.update(o.px.v.to_le_bytes());
            hasher.update([u8::from(o.keyframe), u8::from(o.occluded), u8::from(o.uncertain)]);
            hasher.update(o.source.name().as_bytes());
        }
    }
    hex(&hasher.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::camera::Pixel;
    use vice_core::error::ErrorKind;
    use vice_core::label::{LabelRow, Observation};
    use vice_core::time::Stamp;
    use vice_core::trajectory::PoseRow;

    fn trajectory(x: f64) -> Trajectory {
        let row = PoseRow {
            stamp: Stamp::from_nanos(7),
            position_m: [x, 0.0, 0.0],
            rotation_wxyz: [1.0, 0.0, 0.0, 0.0],
        };
        Trajectory::from_rows([row]).unwrap()
    }

    fn labels(u: f64) -> LabelSet {
        let observation = Observation::manual(Stamp::from_nanos(7), Pixel::new(u, 2.0)).as_keyframe();
        LabelSet::from_rows([LabelRow { point: "a".to_string(), observation }]).unwrap()
    }

    #[test]
    fn what_is_handed_over_is_named_by_its_content() {
        let mut memory = InMemory::default();
        let one = memory.add_trajectory("mine", trajectory(1.0));
        assert_eq!(one, memory.add_trajectory("mine", trajectory(1.0)));
        assert_ne!(one, memory.add_trajectory("mine", trajectory(2.0)));
        assert_ne!(memory.add_labels(labels(1.0)), memory.add_labels(labels(1.5)));
        assert_eq!(memory.trajectory(&one).unwrap(), Some(&trajectory(1.0)));
        assert_eq!((own_name(&one), own_name("odom.txt")), ("mine", "odom.txt"));
        assert!(is_in_memory(&one) && !is_in_memory("odom.txt"));
    }

    #[test]
    fn what_is_not_at_hand_is_missing_and_files_are_no_business_of_this() {
        let memory = InMemory::default();
        let error = memory.trajectory("in-memory:mine@00").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Missing);
        assert!(error.to_string().contains("not at hand (hand the same over"), "{error}");
        assert!(memory.labels(Path::new("in-memory:labels@00")).is_err());
        assert_eq!(memory.trajectory("odom.txt").unwrap(), None);
        assert_eq!(memory.labels(Path::new("floor.csv")).unwrap(), None);
    }
}
