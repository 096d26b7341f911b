//! Building the tree from transforms as they come, and noting what contradicts itself.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use vice_core::frames::rotation_angle_rad;
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use super::{CLOCK_JUMP, Edge, Motion, TfTree, Transform};
use crate::doubts::{LEFT_OUT, REPEATED, group};
use crate::lenient::{RawPose, Tally};
use crate::to_and_fro;

/// Fixed transforms that differ by no more than this, metres and radians, were only rounded otherwise.
const SAME: f64 = 1e-9;

/// An edge while the tree is being built.
#[derive(Debug, Default)]
struct Growing {
    parent: String,
    fixed: Option<Transform>,
    /// How often the fixed transform was said again, otherwise.
    changes: u64,
    samples: Vec<(Stamp, Transform)>,
    jump: Option<(Stamp, Stamp)>,
    jumps: u64,
    unstamped: u64,
    /// Transforms by the first parent, and by others.
    kept: u64,
    other_parents: BTreeMap<String, u64>,
    tally: Tally,
}

/// Collects edges as they come.
#[derive(Debug, Default)]
pub(crate) struct TfBuilder {
    edges: BTreeMap<String, Growing>,
    /// Edges from nowhere, to nowhere or from a frame to itself.
    nonsense: BTreeMap<String, u64>,
}

impl TfBuilder {
    fn edge(&mut self, parent: &str, child: &str) -> Option<&mut Growing> {
        if parent.is_empty() || child.is_empty() || parent == child {
            *self.nonsense.entry(format!("from `{parent}` to `{child}`")).or_default() += 1;
            return None;
        }
        // The look-up by &str first: names are copied for the first transform of an edge only.
        if !self.edges.contains_key(child) {
            let growing = Growing { parent: parent.to_string(), ..Growing::default() };
            self.edges.insert(child.to_string(), growing);
        }
        let edge = self.edges.get_mut(child)?;
        if edge.parent != parent {
            *edge.other_parents.entry(parent.to_string()).or_default() += 1;
            return None;
        }
        edge.kept += 1;
        Some(edge)
    }

    /// Adds an edge that holds at all times, as a message has it.
    pub(crate) fn fix_raw(&mut self, parent: &str, child: &str, raw: &RawPose) {
        let Some(edge) = self.edge(parent, child) else { return };
        if let Some(transform) = edge.tally.take(raw) {
            edge.fix(transform);
        }
    }

    /// Adds an edge that holds at all times.
    pub(crate) fn fix(&mut self, parent: &str, child: &str, parent_from_child: Transform) {
        if let Some(edge) = self.edge(parent, child) {
            edge.fix(parent_from_child);
        }
    }

    /// Adds a sample of a moving edge, as a message has it.
    pub(crate) fn sample_raw(&mut self, parent: &str, child: &str, stamp: Stamp, raw: &RawPose) {
        let Some(edge) = self.edge(parent, child) else { return };
        if let Some(transform) = edge.tally.take(raw) {
            edge.sample(stamp, transform);
        }
    }

    /// Adds a sample of a moving edge.
    pub(crate) fn sample(&mut self, parent: &str, child: &str, stamp: Stamp, parent_from_child: Transform) {
        if let Some(edge) = self.edge(parent, child) {
            edge.sample(stamp, parent_from_child);
        }
    }

    /// Whether a frame hangs on another one.
    pub(crate) fn has(&self, child: &str) -> bool {
        self.edges.get(child).is_some_and(|edge| edge.fixed.is_some() || !edge.samples.is_empty())
    }

    /// Whether a frame is known, as a child or as a parent.
    pub(crate) fn knows(&self, frame: &str) -> bool {
        self.edges.contains_key(frame) || self.edges.values().any(|edge| edge.parent == frame)
    }

    /// Whether two builders hang a frame differently: on other parents, or with transforms that are not the same.
    pub(crate) fn contradicts(&self, other: &Self) -> bool {
        // Of many robots each adds little to what is there.
        let (few, many) = if self.edges.len() < other.edges.len() { (self, other) } else { (other, self) };
        few.edges.iter().any(|(child, a)| many.edges.get(child).is_some_and(|b| a.differs(b)))
    }

    /// The frames that any two of several builders hang differently.
    pub(crate) fn contradictions<'a>(all: impl Iterator<Item = &'a Self>) -> BTreeSet<&'a str> {
        let mut first: HashMap<&str, &Growing> = HashMap::new();
        let mut found = BTreeSet::new();
        for (child, edge) in all.flat_map(|builder| &builder.edges) {
            // Where any two differ, one of them differs from the first.
            if first.entry(child).or_insert(edge).differs(edge) {
                found.insert(child.as_str());
            }
        }
        found
    }

    /// Adds the edges of another builder that this one does not have.
    pub(crate) fn add_missing(&mut self, other: Self) {
        for (child, edge) in other.edges {
            self.edges.entry(child).or_insert(edge);
        }
        for (edge, n) in other.nonsense {
            *self.nonsense.entry(edge).or_default() += n;
        }
    }

    /// The tree, its edges sorted in time.
    pub(crate) fn finish(self) -> TfTree {
        let mut notes = Notes::default();
        let nonsense: Vec<(String, u64)> = self.nonsense.into_iter().collect();
        let mut edges = BTreeMap::new();
        for (child, growing) in self.edges {
            let parent = growing.parent.clone();
            if let Some(motion) = growing.motion(&child, &mut notes) {
                edges.insert(child, Edge { parent, motion });
            }
        }
        let all = edges.iter().flat_map(|(child, edge): (&String, &Edge)| [child, &edge.parent]);
        let mut frames: Vec<String> = all.cloned().collect();
        frames.sort_unstable();
        frames.dedup();
        TfTree { edges, frames, notes: notes.all(&nonsense), undecided: None }
    }
}

impl Growing {
    /// Whether it is another edge, or moves otherwise.
    fn differs(&self, other: &Self) -> bool {
        self.parent != other.parent || self.fixed != other.fixed || self.samples != other.samples
    }

    fn fix(&mut self, transform: Transform) {
        let differs = |before: Transform| {
            let change = before.inverse() * transform;
            change.translation().norm() > SAME || rotation_angle_rad(&change.rotation()) > SAME
        };
        self.changes += u64::from(self.fixed.is_some_and(differs));
        self.fixed = Some(transform);
    }

    fn sample(&mut self, stamp: Stamp, transform: Transform) {
        if stamp.as_nanos() == 0 {
            self.unstamped += 1;
            return;
        }
        if let Some(&(last, _)) = self.samples.last()
            && last.since(stamp) >= CLOCK_JUMP
        {
            self.jump.get_or_insert((last, stamp));
            self.jumps += 1;
        }
        self.samples.push((stamp, transform));
    }

    /// How the edge moves; `None` where nothing is left of it.
    fn motion(self, child: &str, notes: &mut Notes) -> Option<Motion> {
        let Self { parent, fixed, changes, mut samples, jump, jumps, .. } = self;
        let edge = format!("{parent} -> {child}");
        notes.tally.add(&self.tally);
        if !self.other_parents.is_empty() {
            notes.parents.push((child.to_string(), parent, self.kept, self.other_parents));
        }
        let mut note = |list: fn(&mut Notes) -> &mut Vec<(String, u64)>, n: u64| {
            if n > 0 {
                list(notes).push((edge.clone(), n));
            }
        };
        note(|n| &mut n.unstamped, self.unstamped);
        note(|n| &mut n.changes, changes);
        note(|n| &mut n.both, if fixed.is_some() { samples.len() as u64 } else { 0 });
        if let Some(fixed) = fixed {
            return Some(Motion::Fixed(fixed));
        }
        if let Some((before, after)) = jump {
            return Some(Motion::Jump { before, after, times: jumps });
        }
        samples.sort_by_key(|(stamp, _)| *stamp);
        let poses: Vec<Transform> = samples.iter().map(|(_, pose)| *pose).collect();
        let two_sources = to_and_fro::doubt(&format!("tf {edge}"), &poses);
        let n = samples.len();
        // Of two for the same stamp the later message counts, as it does in ROS.
        samples.reverse();
        samples.dedup_by_key(|(stamp, _)| *stamp);
        samples.reverse();
        note(|n| &mut n.repeated, (n - samples.len()) as u64);
        notes.two_sources.extend(two_sources);
        // Nothing but zero stamps, which was noted, has no trajectory.
        let poses = samples.into_iter().map(|(stamp, t)| (stamp, t.reinterpret()));
        Trajectory::from_poses(poses).ok().map(Motion::Moving)
    }
}

/// What was noticed, by kind: each kind is said once.
#[derive(Default)]
struct Notes {
    unstamped: Vec<(String, u64)>,
    changes: Vec<(String, u64)>,
    both: Vec<(String, u64)>,
    repeated: Vec<(String, u64)>,
    /// Frame, first parent and how often, other parents and how often.
    parents: Vec<(String, String, u64, BTreeMap<String, u64>)>,
    two_sources: Vec<Suspicion>,
    tally: Tally,
}

impl Notes {
    fn all(&self, nonsense: &[(String, u64)]) -> Vec<Suspicion> {
        let mut notes: Vec<Suspicion> = self.contradictions().into_iter().collect();
        notes.extend(group(
            "tf-edge",
            nonsense,
            |edge, _| format!("tf has an edge {edge}: left out"),
            "tf has {n} edges to nowhere: left out",
        ));
        notes.extend(group(
            "tf-changes",
            &self.changes,
            |edge, _| format!("the fixed transform {edge} changes: the last is taken"),
            "{n} fixed transforms change: the last of each is taken",
        ));
        notes.extend(group(
            LEFT_OUT,
            &self.unstamped,
            |edge, n| format!("{n} transforms {edge} have a zero stamp: left out"),
            "{all} transforms of {n} edges have a zero stamp: left out",
        ));
        notes.extend(group(
            "tf-fixed-and-moving",
            &self.both,
            |edge, _| format!("{edge} is both fixed and moving in tf: taken as fixed"),
            "{n} transforms are both fixed and moving in tf: taken as fixed",
        ));
        notes.extend(group(
            REPEATED,
            &self.repeated,
            |edge, n| format!("{n} transforms {edge} repeat a stamp: the last of each is taken"),
            "{all} transforms of {n} edges repeat a stamp: the last of each is taken",
        ));
        notes.extend(self.two_sources.iter().cloned());
        notes.extend(self.tally.doubts("tf"));
        notes
    }

    /// Frames that hang on two others.
    fn contradictions(&self) -> Option<Suspicion> {
        let (child, parent, kept, others) = self.parents.first()?;
        let message = match self.parents.as_slice() {
            [_] => {
                let names: Vec<&str> = others.keys().map(String::as_str).collect();
                let count =
                    if others.len() == 1 { "two".to_string() } else { (others.len() + 1).to_string() };
                format!(
                    "frame {child} has {count} parents in tf, {parent} and {}: the first is kept",
                    names.join(", ")
                )
            }
            several => format!("{} frames have two parents in tf: the first of each is kept", several.len()),
        };
        let evidence = match self.parents.as_slice() {
            [_] => {
                let each = others.iter().map(|(name, n)| format!(", by {name} {n} times"));
                format!("by {parent} {kept} times{}", each.collect::<String>())
            }
            several => crate::tf::list(&several.iter().map(|p| p.0.as_str()).collect::<Vec<_>>()),
        };
        let advice = "two sources say where it is: record only one of them";
        Some(Suspicion::new("tf-two-parents", "", message).evidence(evidence).advice(advice))
    }
}
