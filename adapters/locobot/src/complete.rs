//! Joints that tf lacks: from a URDF, with their positions from `sensor_msgs/JointState` where they move.

use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::Suspicion;

use crate::container::{Message, Recording, Topic};
use crate::doubts::{DAMAGED, Doubts, SEVERAL_TOPICS};
use crate::index::{Index, Only};
use crate::message::joint_state;
use crate::namespaces::{holds, namespace};
use crate::settings::{Settings, Stamps};
use crate::tf::{TfBuilder, list};
use crate::urdf::{self, Joint};
use crate::wire::Reader;

/// Adds the joints of a URDF that tf lacks. Of several robots that of the namespace `place` counts.
///
/// # Errors
/// [`DataError`] if the URDF that was set cannot be used, or the recording cannot be read again.
pub(crate) fn complete(
    recording: &Recording,
    settings: &Settings,
    topics: &[Topic],
    index: &Index,
    place: &str,
    tf: &mut TfBuilder,
    doubts: &Doubts,
) -> DataResult<()> {
    let joints = match settings.get("urdf") {
        Some(name) => {
            let path = settings.path(name);
            let text = std::fs::read_to_string(&path)
                .map_err(|e| DataError::new("cannot be read").at(&path).because(e))?;
            urdf::parse(&text).map_err(|e| e.at(&path))?
        }
        None => {
            let Some((topic, text)) = description(topics, index, place, doubts) else { return Ok(()) };
            match urdf::parse(text) {
                Ok(joints) => joints,
                Err(e) => {
                    let message = format!("the robot description is left aside: {e}");
                    doubts.say(Suspicion::new(DAMAGED, format!("topic {topic}"), message));
                    return Ok(());
                }
            }
        }
    };
    let missing: Vec<Joint> = joints.into_iter().filter(|j| !tf.has(&j.child)).collect();
    let mut moving = false;
    for joint in &missing {
        match joint.fixed() {
            Some(fixed) => tf.fix(&joint.parent, &joint.child, fixed),
            None => moving = true,
        }
    }
    if moving {
        add_joint_states(recording, settings.stamps()?, &missing, (topics, place), tf, doubts)?;
    }
    Ok(())
}

/// The description of the robot in a namespace, with its topic; the only one, where there is one.
fn description<'a>(
    topics: &'a [Topic],
    index: &'a Index,
    place: &str,
    doubts: &Doubts,
) -> Option<(&'a str, &'a str)> {
    let named = index.descriptions.iter().map(|(topic, text)| (topics[*topic].name.as_str(), text.as_str()));
    let all: Vec<(&str, &str)> = named.collect();
    let around = all.iter().filter(|(topic, _)| holds(namespace(topic), place));
    let nearest = around.max_by_key(|(topic, _)| topic.len());
    if nearest.is_none() && all.iter().any(|(_, text)| *text != all[0].1) {
        let names: Vec<&str> = all.iter().map(|(topic, _)| *topic).collect();
        let message =
            format!("several robots describe themselves: {}: that of the first is used", list(&names));
        doubts.say(Suspicion::new(SEVERAL_TOPICS, "", message).advice("set urdf"));
    }
    nearest.or(all.first()).copied()
}

fn add_joint_states(
    recording: &Recording,
    stamps: Stamps,
    joints: &[Joint],
    (topics, place): (&[Topic], &str),
    tf: &mut TfBuilder,
    doubts: &Doubts,
) -> DataResult<()> {
    let is_state = |topic: &Topic| topic.kind == "sensor_msgs/JointState";
    // Joints of another robot have the same names.
    let is_own = |topic: &Topic| holds(namespace(&topic.name), place) || holds(place, namespace(&topic.name));
    let any_own = topics.iter().any(|t| is_state(t) && is_own(t));
    let mut broken = 0_u64;
    let mut pass = Only {
        wanted: |topic: &Topic| is_state(topic) && (!any_own || is_own(topic)),
        each: |message: &Message<'_>| {
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
        let message = format!("{broken} messages of sensor_msgs/JointState cannot be decoded: left out");
        doubts.say(Suspicion::new(DAMAGED, "", message).times(broken));
    }
    Ok(())
}
