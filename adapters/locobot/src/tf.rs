//! The tf tree: which frame hangs on which, fixed or moving.
//!
//! Each moving edge is a trajectory of its own, read at the stamp asked for (linear and slerp, between samples at most
//! [`MAX_EDGE_GAP`] apart), and only then are the edges of a chain multiplied: `map -> odom` at 5 Hz and
//! `odom -> base` at 50 Hz cannot be interpolated as one.

use std::collections::{BTreeMap, BTreeSet};

use vice_core::error::{DataError, DataResult};
use vice_core::frames::Rigid;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{NoPose, Trajectory};

/// A frame of the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tf {}

/// A transform of the tree, named `parent_from_child` or `target_from_source`.
pub(crate) type Transform = Rigid<Tf, Tf>;

/// Samples of an edge further apart than this are not interpolated (method page).
pub(crate) const MAX_EDGE_GAP: Span = Span::from_millis(1000);
/// A stamp this much earlier than the one before is a jump of the clock, not a message that came late.
pub(crate) const CLOCK_JUMP: Span = Span::from_millis(1000);

/// An edge while the tree is being built.
#[derive(Debug)]
struct Growing {
    parent: String,
    fixed: Option<Transform>,
    samples: Vec<(Stamp, Transform)>,
    jump: Option<(Stamp, Stamp)>,
}

/// Collects edges as they come.
#[derive(Debug, Default)]
pub(crate) struct TfBuilder {
    edges: BTreeMap<String, Growing>,
    /// Oddities, each once.
    notes: BTreeSet<String>,
    unstamped: BTreeMap<String, u64>,
}

impl TfBuilder {
    fn edge(&mut self, parent: &str, child: &str) -> Option<&mut Growing> {
        if parent.is_empty() || child.is_empty() || parent == child {
            self.notes.insert(format!("tf has an edge from `{parent}` to `{child}`: left out"));
            return None;
        }
        // The look-up by &str first: names are copied for the first transform of an edge only.
        if !self.edges.contains_key(child) {
            let growing =
                Growing { parent: parent.to_string(), fixed: None, samples: Vec::new(), jump: None };
            self.edges.insert(child.to_string(), growing);
        }
        let edge = self.edges.get_mut(child)?;
        if edge.parent != parent {
            self.notes.insert(format!(
                "frame {child} has two parents in tf, {} and {parent}: the first is kept",
                edge.parent
            ));
            return None;
        }
        Some(edge)
    }

    /// Adds an edge that holds at all times.
    pub(crate) fn fix(&mut self, parent: &str, child: &str, parent_from_child: Transform) {
        let Some(edge) = self.edge(parent, child) else { return };
        let changed = edge.fixed.is_some_and(|before| before != parent_from_child);
        edge.fixed = Some(parent_from_child);
        if changed {
            self.notes.insert(format!("the fixed transform {parent} -> {child} changes: the last is taken"));
        }
    }

    /// Adds a sample of a moving edge.
    pub(crate) fn sample(&mut self, parent: &str, child: &str, stamp: Stamp, parent_from_child: Transform) {
        if stamp.as_nanos() == 0 {
            *self.unstamped.entry(format!("{parent} -> {child}")).or_default() += 1;
            return;
        }
        let Some(edge) = self.edge(parent, child) else { return };
        if let Some(&(last, _)) = edge.samples.last()
            && last.since(stamp) >= CLOCK_JUMP
            && edge.jump.is_none()
        {
            edge.jump = Some((last, stamp));
        }
        edge.samples.push((stamp, parent_from_child));
    }

    /// Whether a frame hangs on another one.
    pub(crate) fn has(&self, child: &str) -> bool {
        self.edges.contains_key(child)
    }

    /// The tree, its edges sorted in time.
    pub(crate) fn finish(self) -> TfTree {
        let mut notes: Vec<String> = self.notes.into_iter().collect();
        for (edge, n) in self.unstamped {
            notes.push(format!("{n} transforms {edge} have a zero stamp: left out"));
        }
        let mut edges = BTreeMap::new();
        for (child, growing) in self.edges {
            let Growing { parent, fixed, mut samples, jump } = growing;
            if fixed.is_some() && !samples.is_empty() {
                notes.push(format!("{parent} -> {child} is both fixed and moving in tf: taken as fixed"));
            }
            let motion = match (fixed, jump) {
                (Some(fixed), _) => Motion::Fixed(fixed),
                (None, Some((before, after))) => Motion::Jump { before, after },
                (None, None) => {
                    samples.sort_by_key(|(stamp, _)| *stamp);
                    let n = samples.len();
                    // Of two for the same stamp the later message counts, as it does in ROS.
                    samples.reverse();
                    samples.dedup_by_key(|(stamp, _)| *stamp);
                    samples.reverse();
                    if samples.len() < n {
                        let again = n - samples.len();
                        notes.push(format!("{again} transforms {parent} -> {child} repeat a stamp"));
                    }
                    let poses = samples.into_iter().map(|(stamp, t)| (stamp, t.reinterpret()));
                    match Trajectory::from_poses(poses) {
                        Ok(trajectory) => Motion::Moving(trajectory),
                        Err(_) => continue, // Nothing but zero stamps, which was noted.
                    }
                }
            };
            edges.insert(child, Edge { parent, motion });
        }
        TfTree { edges, notes }
    }
}

#[derive(Clone, Debug)]
enum Motion {
    Fixed(Transform),
    Moving(Trajectory),
    /// The clock jumped back: there is no telling which of two times a stamp means.
    Jump {
        before: Stamp,
        after: Stamp,
    },
}

#[derive(Clone, Debug)]
struct Edge {
    parent: String,
    motion: Motion,
}

/// The tree.
#[derive(Clone, Debug)]
pub(crate) struct TfTree {
    edges: BTreeMap<String, Edge>,
    /// Oddities that were met while it was built.
    pub(crate) notes: Vec<String>,
}

/// The way from one frame to another: `target_from_source` as a product of edges.
#[derive(Clone, Debug)]
pub(crate) struct Chain<'a> {
    /// From the common ancestor down to the target.
    down_to_target: Vec<(&'a str, &'a Edge)>,
    /// From the common ancestor down to the source.
    down_to_source: Vec<(&'a str, &'a Edge)>,
}

impl TfTree {
    /// All frames, by name.
    pub(crate) fn frames(&self) -> Vec<&str> {
        let all = self.edges.iter().flat_map(|(child, edge)| [child.as_str(), edge.parent.as_str()]);
        all.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// A frame by its name, or by its name behind a prefix such as `locobot/`, where only one fits.
    pub(crate) fn find(&self, name: &str) -> Option<String> {
        let frames = self.frames();
        if frames.contains(&name) {
            return Some(name.to_string());
        }
        let behind = format!("/{name}");
        let mut fitting = frames.into_iter().filter(|f| f.ends_with(&behind));
        match (fitting.next(), fitting.next()) {
            (Some(frame), None) => Some(frame.to_string()),
            _ => None,
        }
    }

    /// The edges from a frame up to its root, the nearest first, and the root.
    fn ancestors<'a>(&'a self, frame: &'a str) -> DataResult<(Vec<(&'a str, &'a Edge)>, &'a str)> {
        let (mut up, mut at) = (Vec::new(), frame);
        while let Some((child, edge)) = self.edges.get_key_value(at) {
            if up.iter().any(|(seen, _)| *seen == child.as_str()) {
                let cycle: Vec<&str> = up.iter().map(|(c, _)| *c).skip_while(|c| *c != child).collect();
                return Err(DataError::new(format!("tf has a cycle: {} -> {child}", cycle.join(" -> "))));
            }
            up.push((child.as_str(), edge));
            at = &edge.parent;
        }
        Ok((up, at))
    }

    /// The way from `source` to `target`.
    ///
    /// # Errors
    /// [`DataError`] that names the frames of a cycle, the frame that tf does not know, or the two roots that are not
    /// connected.
    pub(crate) fn chain<'a>(&'a self, target: &'a str, source: &'a str) -> DataResult<Chain<'a>> {
        let (mut to_target, target_root) = self.ancestors(target)?;
        let (mut to_source, source_root) = self.ancestors(source)?;
        if target_root != source_root {
            let problem = format!("tf does not connect {target} and {source}");
            let frames = self.frames();
            return Err(match [target, source].into_iter().find(|f| !frames.contains(f)) {
                Some(unknown) => DataError::new(format!("{problem}: it has no frame {unknown}"))
                    .hint(format!("its frames: {}", list(&frames))),
                None => DataError::new(format!(
                    "{problem}: {target} hangs on {target_root}, {source} on {source_root}"
                )),
            });
        }
        while let (Some(a), Some(b)) = (to_target.last(), to_source.last()) {
            if a.0 != b.0 {
                break;
            }
            to_target.pop();
            to_source.pop();
        }
        to_target.reverse();
        to_source.reverse();
        Ok(Chain { down_to_target: to_target, down_to_source: to_source })
    }

    /// The frames on which nothing else hangs above, with the number of frames under each; sorted.
    pub(crate) fn roots(&self) -> DataResult<Vec<(String, usize)>> {
        let mut roots: BTreeMap<String, usize> = BTreeMap::new();
        for frame in self.edges.keys() {
            let (_, root) = self.ancestors(frame)?;
            *roots.entry(root.to_string()).or_default() += 1;
        }
        Ok(roots.into_iter().collect())
    }

    /// One line an edge: frames, fixed or moving, rate.
    pub(crate) fn lines(&self) -> Vec<String> {
        let line = |(child, edge): (&String, &Edge)| {
            let how = match &edge.motion {
                Motion::Fixed(_) => "fixed".to_string(),
                Motion::Moving(t) => {
                    let seconds = t.end().since(t.start()).as_secs_f64();
                    let rate = (t.len() - 1) as f64 / seconds;
                    match rate.is_finite() {
                        true => format!("{} samples, {rate:.1} Hz", t.len()),
                        false => format!("{} samples", t.len()),
                    }
                }
                Motion::Jump { .. } => "clock jumps back".to_string(),
            };
            format!("{} -> {child}  {how}", edge.parent)
        };
        self.edges.iter().map(line).collect()
    }
}

impl Chain<'_> {
    /// `target_from_source` at a stamp.
    ///
    /// # Errors
    /// [`DataError`] that names the edge that has no sample there.
    pub(crate) fn at(&self, stamp: Stamp) -> DataResult<Transform> {
        let product = |edges: &[(&str, &Edge)]| {
            edges.iter().try_fold(Transform::identity(), |t, (child, edge)| Ok(t * edge.at(child, stamp)?))
        };
        let common_from_source = product(&self.down_to_source)?;
        if self.down_to_target.is_empty() {
            return Ok(common_from_source);
        }
        Ok(product(&self.down_to_target)?.inverse() * common_from_source)
    }

    /// Whether no edge moves.
    pub(crate) fn is_fixed(&self) -> bool {
        self.edges().all(|(_, edge)| matches!(edge.motion, Motion::Fixed(_)))
    }

    /// Stamps of the moving edges, sorted, each once.
    pub(crate) fn stamps(&self) -> Vec<Stamp> {
        let moving = self.edges().filter_map(|(_, edge)| match &edge.motion {
            Motion::Moving(trajectory) => Some(trajectory.stamps()),
            _ => None,
        });
        let mut stamps = moving.collect::<Vec<_>>().concat();
        stamps.sort_unstable();
        stamps.dedup();
        stamps
    }

    /// The error of an edge whose clock jumps back, where there is one.
    pub(crate) fn jump(&self) -> Option<DataError> {
        self.edges().find_map(|(child, edge)| edge.jump(child))
    }

    fn edges(&self) -> impl Iterator<Item = &(&str, &Edge)> {
        self.down_to_target.iter().chain(&self.down_to_source)
    }
}

impl Edge {
    fn at(&self, child: &str, stamp: Stamp) -> DataResult<Transform> {
        let trajectory = match &self.motion {
            Motion::Fixed(fixed) => return Ok(*fixed),
            Motion::Moving(trajectory) => trajectory,
            Motion::Jump { .. } => {
                return Err(self.jump(child).unwrap_or_else(|| DataError::new("the clock jumps back")));
            }
        };
        trajectory.pose_at(stamp, MAX_EDGE_GAP).map(|pose| pose.reinterpret()).map_err(|why| {
            let why = match why {
                NoPose::BeforeStart => format!("its first sample is at {} ns", trajectory.start()),
                NoPose::AfterEnd => format!("its last sample is at {} ns", trajectory.end()),
                other => format!("{other}, the limit is {MAX_EDGE_GAP}"),
            };
            DataError::new(format!("tf has no {} -> {child} at {stamp} ns: {why}", self.parent))
        })
    }

    fn jump(&self, child: &str) -> Option<DataError> {
        let Motion::Jump { before, after } = &self.motion else { return None };
        let parent = &self.parent;
        let problem =
            format!("the clock of tf {parent} -> {child} jumps back from {before} ns to {after} ns");
        Some(DataError::new(problem).hint("cut the recording at the jump"))
    }
}

/// Some names of many, for a hint.
pub(crate) fn list<S: AsRef<str>>(names: &[S]) -> String {
    const SHOWN: usize = 12;
    let shown: Vec<&str> = names.iter().take(SHOWN).map(AsRef::as_ref).collect();
    match names.len() {
        0 => "none".to_string(),
        n if n > SHOWN => format!("{} and {} more", shown.join(", "), n - SHOWN),
        _ => shown.join(", "),
    }
}

#[cfg(test)]
mod tests;
