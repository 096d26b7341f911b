//! The tf of several robots in one recording, such as `/robot1/tf` and `/robot2/tf`: each namespace is a tree of its own,
//! and that of the camera is used.

use std::collections::HashMap;

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::suspicion::Suspicion;

use crate::tf::{TfBuilder, TfTree, list};

/// The tf of one namespace.
#[derive(Debug, Default)]
pub(crate) struct Space {
    /// Such as `/robot1`; empty for topics without one.
    pub(crate) name: String,
    /// The topics it came from.
    pub(crate) topics: Vec<String>,
    pub(crate) tf: TfBuilder,
}

/// The namespace of a topic: what stands before its last part.
pub(crate) fn namespace(topic: &str) -> &str {
    topic.rsplit_once('/').map_or("", |(space, _)| space)
}

/// Whether a namespace holds a topic or another namespace.
pub(crate) fn holds(space: &str, name: &str) -> bool {
    name.strip_prefix(space).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// The namespaces so far.
#[derive(Debug, Default)]
pub(crate) struct Spaces {
    pub(crate) all: Vec<Space>,
    places: HashMap<String, usize>,
}

impl Spaces {
    /// The place of the namespace of a topic with tf, which is added where it is new.
    pub(crate) fn of_topic(&mut self, topic: &str) -> usize {
        let name = namespace(topic);
        let place = *self.places.entry(name.to_string()).or_insert_with(|| {
            self.all.push(Space { name: name.to_string(), ..Space::default() });
            self.all.len() - 1
        });
        self.all[place].topics.push(topic.to_string());
        place
    }
}

/// What says which robot is meant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Asked<'a> {
    /// The setting `tf_namespace`.
    pub(crate) set: Option<&'a str>,
    /// The image topic in use.
    pub(crate) camera_topic: Option<&'a str>,
    /// The frame that its images name.
    pub(crate) camera_frame: Option<&'a str>,
}

/// The tf in use.
#[derive(Debug, Default)]
pub(crate) struct Chosen {
    pub(crate) tf: TfBuilder,
    /// Its namespace, where one was chosen among several.
    pub(crate) space: Option<String>,
    /// Why none is used, where several contradict each other and nothing says which is meant.
    pub(crate) undecided: Option<String>,
    pub(crate) doubt: Option<Suspicion>,
}

impl Chosen {
    /// The tree.
    pub(crate) fn finish(self) -> TfTree {
        let mut tree = self.tf.finish();
        tree.undecided = self.undecided;
        tree
    }
}

/// Chooses.
///
/// Where nothing contradicts itself all is one tree, as it always was. Else the namespace that holds the camera counts,
/// with what others add to it; or the only one that knows the camera's frame; or none.
///
/// # Errors
/// [`DataError`] if the namespace that was set has no tf.
pub(crate) fn choose(mut spaces: Vec<Space>, asked: &Asked<'_>) -> DataResult<Chosen> {
    spaces.sort_by(|a, b| a.name.cmp(&b.name));
    let topics: Vec<String> = spaces.iter().flat_map(|s| s.topics.iter().cloned()).collect();
    if let Some(set) = asked.set {
        return set_by_name(spaces, set, &topics);
    }
    let shared: Vec<String> =
        TfBuilder::contradictions(spaces.iter().map(|s| &s.tf)).into_iter().map(str::to_string).collect();
    if shared.is_empty() {
        let tf = merge(spaces).unwrap_or_default();
        return Ok(Chosen { tf, ..Chosen::default() });
    }
    let comes_from = format!("tf comes from {}, which place {} differently", all(&topics), list(&shared));
    let Some(own) = own(&spaces, asked) else {
        let doubt = Suspicion::new("tf-namespaces", "", format!("{comes_from}: none of it is used"))
            .advice(format!("set tf_namespace, such as `--set tf_namespace={}`", shown(&spaces[0].name)));
        return Ok(Chosen { undecided: Some(comes_from), doubt: Some(doubt), ..Chosen::default() });
    };
    // The own one first, then those around it from the inside out, then the others.
    let own_name = spaces[own].name.clone();
    let other = spaces.iter().map(|s| s.name.clone()).find(|name| *name != own_name).unwrap_or_default();
    let mut tf = spaces.remove(own).tf;
    spaces.sort_by_key(|s| (!holds(&s.name, &own_name), std::cmp::Reverse(s.name.len()), s.name.clone()));
    let mut left = Vec::new();
    for space in spaces {
        match tf.contradicts(&space.tf) {
            false => tf.add_missing(space.tf),
            true => left.extend(space.topics),
        }
    }
    left.sort_unstable();
    let message = format!("{comes_from}: that of {} is used, as the camera's", shown(&own_name));
    let doubt = Suspicion::new("tf-namespaces", "", message)
        .evidence(format!("left out: {}", all(&left)))
        .advice(format!("`--set tf_namespace={}` takes another one", shown(&other)));
    Ok(Chosen { tf, space: Some(own_name), undecided: None, doubt: Some(doubt) })
}

fn set_by_name(spaces: Vec<Space>, set: &str, topics: &[String]) -> DataResult<Chosen> {
    let wanted = set.trim().trim_end_matches("/tf_static").trim_end_matches("/tf").trim_matches('/');
    let found = spaces.into_iter().find(|space| space.name.trim_matches('/') == wanted);
    let Some(space) = found else {
        let problem = format!("tf_namespace = {set}: there is no tf in it");
        return Err(
            DataError::of_kind(ErrorKind::Missing, problem).hint(format!("tf comes from {}", list(topics)))
        );
    };
    Ok(Chosen { tf: space.tf, space: Some(space.name), ..Chosen::default() })
}

/// The namespace that is meant: the nearest around the camera's topic, else the only one with the camera's frame.
fn own(spaces: &[Space], asked: &Asked<'_>) -> Option<usize> {
    if let Some(topic) = asked.camera_topic {
        let around = (0..spaces.len()).filter(|i| holds(&spaces[*i].name, namespace(topic)));
        if let Some(nearest) = around.max_by_key(|i| spaces[*i].name.len()) {
            return Some(nearest);
        }
    }
    let frame = asked.camera_frame.filter(|f| !f.is_empty())?;
    let mut knowing = (0..spaces.len()).filter(|i| spaces[*i].tf.knows(frame));
    match (knowing.next(), knowing.next()) {
        (Some(only), None) => Some(only),
        _ => None,
    }
}

fn merge(spaces: Vec<Space>) -> Option<TfBuilder> {
    let mut trees = spaces.into_iter().map(|space| space.tf);
    let mut tf = trees.next()?;
    trees.for_each(|other| tf.add_missing(other));
    Some(tf)
}

/// A namespace as a setting takes it.
fn shown(name: &str) -> &str {
    if name.is_empty() { "/" } else { name }
}

/// Names with commas and an `and`.
fn all(names: &[String]) -> String {
    match names {
        [rest @ .., last] if !rest.is_empty() && names.len() <= 12 => {
            format!("{} and {last}", rest.join(", "))
        }
        several => list(several),
    }
}
