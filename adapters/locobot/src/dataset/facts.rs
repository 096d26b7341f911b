//! What `vice info` shows of a recording: its topics, its tf tree, what was chosen, and what is damaged.

use vice_core::dataset::Fact;

use crate::camera::Images;
use crate::container::{Encoding, Topic};
use crate::dataset::RosDataset;
use crate::streams::GroundTruth;

/// The lines.
pub(crate) fn facts(data: &RosDataset) -> Vec<Fact> {
    let mut facts = Vec::new();
    let mut add = |section: &str, text: String| facts.push(Fact { section: section.to_string(), text });
    for path in data.recording.paths() {
        let bytes = path.metadata().map_or(0, |m| m.len());
        add("files", format!("{} ({bytes} bytes)", path.display()));
    }
    let mut topics: Vec<&Topic> = data.topics.iter().collect();
    topics.sort_by(|a, b| (&a.name, &a.kind).cmp(&(&b.name, &b.kind)));
    for topic in topics {
        add("topics", topic_line(topic));
    }
    for line in data.tf.lines() {
        add("tf", line);
    }
    let name = |topic: Option<usize>| topic.map_or("none", |t| data.topics[t].name.as_str()).to_string();
    let frame = |frame: &Option<String>| frame.clone().unwrap_or_else(|| "none".to_string());
    let images = |images: Option<&Images>| match images {
        Some(i) => format!("{} ({}, frame {})", i.topic, i.encoding, i.frame),
        None => "none".to_string(),
    };
    add("chosen", format!("color_topic {}", images(data.default_camera().map(|c| &c.images))));
    add("chosen", format!("depth_topic {}", images(data.depth.as_ref())));
    add("chosen", format!("camera_info_topic {}", name(data.chosen.info)));
    add("chosen", format!("imu_topic {}", name(data.chosen.imu)));
    add("chosen", format!("base_frame {}", frame(&data.frames.base)));
    add("chosen", format!("odom_frame {}", frame(&data.frames.odom)));
    add("chosen", format!("map_frame {}", frame(&data.frames.map)));
    add("chosen", format!("floor_frame {}", frame(&data.frames.floor)));
    add("chosen", format!("camera_frame {}", frame(&data.frames.camera)));
    for (topic, poses) in &data.poses {
        let child = if poses.child.is_empty() { "a frame without a name" } else { &poses.child };
        add("poses", format!("{topic}: {} of {child} in {}", poses.poses.len(), poses.parent));
    }
    match &data.ground_truth {
        Some(GroundTruth::Topic(topic)) => add("chosen", format!("ground_truth topic {topic}")),
        Some(GroundTruth::File(t)) => add("chosen", format!("ground_truth file with {} poses", t.len())),
        None => {}
    }
    for line in data.doubts.damage() {
        add("damage", line);
    }
    facts
}

fn topic_line(topic: &Topic) -> String {
    let Topic { name, kind, count, recorded, encoding, format } = topic;
    let rate = recorded.and_then(|(first, last)| {
        let rate = (count.checked_sub(1)?) as f64 / last.since(first).as_secs_f64();
        (rate.is_finite() && rate > 0.0).then(|| format!(", {rate:.1} Hz"))
    });
    let unread = match encoding {
        Encoding::Other => format!(", {format}: not read"),
        Encoding::Ros1 | Encoding::Cdr => String::new(),
    };
    format!("{name}  {kind}  {count} messages{}{unread}", rate.unwrap_or_default())
}
