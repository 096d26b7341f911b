//! The tf tree: which frame hangs on which, fixed or moving.
//!
//! Each moving edge is a trajectory of its own, read at the stamp asked for (linear and slerp, between samples at most
//! [`MAX_EDGE_GAP`] apart), and only then are the edges of a chain multiplied: `map -> odom` at 5 Hz and
//! `odom -> base` at 50 Hz cannot be interpolated as one.

mod build;
mod roots;

use std::collections::BTreeMap;

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{NoPose, Trajectory};

pub(crate) use build::TfBuilder;

pub(crate) use crate::names::list;
pub(crate) use crate::transform::Transform;

/// Samples of an edge further apart than this are not interpolated (method page).
pub(crate) const MAX_EDGE_GAP: Span = Span::from_millis(1000);
/// A stamp this much earlier than the one before is a jump of the clock, not a message that came late.
pub(crate) const CLOCK_JUMP: Span = Span::from_millis(1000);

#[derive(Clone, Debug)]
enum Motion {
    Fixed(Transform),
    Moving(Trajectory),
    /// The clock jumped back: there is no telling which of two times a stamp means.
    Jump {
        before: Stamp,
        after: Stamp,
        times: u64,
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
    /// Children and parents, by name.
    frames: Vec<String>,
    /// Oddities that were met while it was built, each kind once.
    pub(crate) notes: Vec<Suspicion>,
    /// Why no tf is used, where it comes from several robots and nothing says which is meant.
    pub(crate) undecided: Option<String>,
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
        self.frames.iter().map(String::as_str).collect()
    }

    fn has(&self, name: &str) -> bool {
        self.frames.binary_search_by(|frame| frame.as_str().cmp(name)).is_ok()
    }

    /// A frame by its name, or by its name behind a prefix such as `locobot/`, where only one fits.
    pub(crate) fn find(&self, name: &str) -> Option<String> {
        if self.has(name) {
            return Some(name.to_string());
        }
        match self.behind_prefixes(name)[..] {
            [frame] => Some(frame.to_string()),
            _ => None,
        }
    }

    /// All frames of a name behind a prefix.
    pub(crate) fn behind_prefixes(&self, name: &str) -> Vec<&str> {
        let behind = format!("/{name}");
        self.frames.iter().map(String::as_str).filter(|frame| frame.ends_with(&behind)).collect()
    }

    /// As [`TfTree::find`]; where several prefixes fit, the one that is `near`'s too, as of one robot of many.
    pub(crate) fn find_near(&self, name: &str, near: Option<&str>) -> Option<String> {
        self.find(name).or_else(|| {
            let mut prefix = near?;
            while let Some((outer, _)) = prefix.rsplit_once('/') {
                let own = format!("{outer}/{name}");
                if self.has(&own) {
                    return Some(own);
                }
                prefix = outer;
            }
            None
        })
    }

    /// The edges from a frame up to its root, the nearest first, and the root.
    fn ancestors<'a>(&'a self, frame: &'a str) -> DataResult<(Vec<(&'a str, &'a Edge)>, &'a str)> {
        let (mut up, mut at) = (Vec::new(), frame);
        while let Some((child, edge)) = self.edges.get_key_value(at) {
            // As many steps as there are edges only a cycle makes.
            if up.len() >= self.edges.len() {
                return Err(self.cycle(child));
            }
            up.push((child.as_str(), edge));
            at = &edge.parent;
        }
        Ok((up, at))
    }

    /// The error of a cycle, from a frame that leads into it.
    fn cycle(&self, frame: &str) -> DataError {
        let up = |at: &str| self.edges.get(at).map_or_else(String::new, |edge| edge.parent.clone());
        let mut inside = frame.to_string();
        (0..self.edges.len()).for_each(|_| inside = up(&inside));
        // The frame that comes first by name, so that it is the same from wherever it was met.
        let mut frames = vec![inside.clone()];
        let mut at = up(&inside);
        while at != inside {
            frames.push(at.clone());
            at = up(&at);
        }
        let first = frames.iter().enumerate().min_by_key(|(_, name)| name.as_str()).map_or(0, |(i, _)| i);
        frames.rotate_left(first);
        frames.push(frames[0].clone());
        let shown = match frames.len() {
            n if n > 12 => format!("{} -> ... ({} frames)", frames[..6].join(" -> "), n - 1),
            _ => frames.join(" -> "),
        };
        DataError::new(format!("tf has a cycle: {shown}"))
    }

    /// Refuses where tf comes from several robots and nothing says which is meant.
    pub(crate) fn decided(&self) -> DataResult<()> {
        let error = |why: &String| {
            DataError::of_kind(ErrorKind::Contradictory, why.as_str()).hint("set tf_namespace")
        };
        self.undecided.as_ref().map_or(Ok(()), |why| Err(error(why)))
    }

    /// The way from `source` to `target`.
    ///
    /// # Errors
    /// [`DataError`] that names the frames of a cycle, the frame that tf does not know, or the two roots that are not
    /// connected.
    pub(crate) fn chain<'a>(&'a self, target: &'a str, source: &'a str) -> DataResult<Chain<'a>> {
        self.decided()?;
        let (mut to_target, target_root) = self.ancestors(target)?;
        let (mut to_source, source_root) = self.ancestors(source)?;
        if target_root != source_root {
            let problem = format!("tf does not connect {target} and {source}");
            let frames = self.frames();
            return Err(match [target, source].into_iter().find(|f| !self.has(f)) {
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
        let parent = |frame: &str| self.edges.get(frame).map(|edge| edge.parent.as_str());
        let children = self.edges.keys().map(String::as_str);
        let roots = roots::count(children, parent).map_err(|frame| self.cycle(frame))?;
        Ok(roots.into_iter().map(|(root, n)| (root.to_string(), n)).collect())
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
        let Motion::Jump { before, after, times } = &self.motion else { return None };
        let parent = &self.parent;
        Some(clock_jump(&format!("the clock of tf {parent} -> {child}"), (*before, *after), *times))
    }
}

/// The error of a series whose clock jumps back, and how often it does.
pub(crate) fn clock_jump(what: &str, (before, after): (Stamp, Stamp), times: u64) -> DataError {
    let problem = format!("{what} jumps back from {before} ns to {after} ns");
    match times {
        0 | 1 => DataError::new(problem).hint("cut the recording at the jump"),
        // One jump is a clock that was set, many are two clocks.
        _ => DataError::new(format!("{problem}, and {} times more", times - 1))
            .hint("two sources with clocks of their own seem to publish it: record only one of them"),
    }
}

#[cfg(test)]
mod tests;
