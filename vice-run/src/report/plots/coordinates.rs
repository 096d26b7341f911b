//! Position and orientation of the streams over time, coordinate by coordinate.

use nalgebra::{Quaternion, UnitQuaternion};
use vice_core::result::{PathPart, PathPose};

use super::Plot;
use super::axis::Axis;
use super::timeline::Timeline;
use crate::report::keys::{Key, of};
use crate::result::ResultDocument;

/// Paths that can be drawn into one plot.
pub(crate) struct Placed<'a> {
    /// The paths with their keys.
    pub(crate) paths: Vec<(&'a Key, &'a PathPart)>,
    /// Whether they share the reference's world; else each is drawn from its own start.
    pub(crate) common: bool,
    /// Names of those that share no world with the others, and so are not drawn.
    pub(crate) left_out: Vec<&'a str>,
}

/// Paths in the reference's world; where there is no reference, all of them.
pub(crate) fn placed<'a>(document: &'a ResultDocument, keys: &'a [Key]) -> Placed<'a> {
    let all: Vec<(&Key, &PathPart)> = document
        .paths
        .iter()
        .filter(|p| !p.poses.is_empty())
        .filter_map(|p| Some((of(keys, &p.stream, p.role)?, p)))
        .collect();
    let common = all.iter().any(|(_, p)| p.in_reference_world);
    let (paths, others): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|(_, p)| p.in_reference_world || !common);
    Placed { paths, common, left_out: others.into_iter().map(|(key, _)| key.name.as_str()).collect() }
}

impl Placed<'_> {
    /// What the numbers are of, and who is missing, as the end of a sentence.
    pub(crate) fn words(&self, document: &ResultDocument) -> String {
        let mut ways: Vec<&str> =
            document.trajectory.iter().filter(|t| t.problem.is_none()).map(|t| t.align.as_str()).collect();
        ways.dedup();
        let mut text = match (self.common, ways.as_slice()) {
            (true, []) => "in the world of the reference".to_string(),
            (true, ways) => format!("estimates aligned by {}", crate::text::printable(&ways.join(", "))),
            (false, _) => "each from its own start, since there is no reference".to_string(),
        };
        if !self.left_out.is_empty() {
            text.push_str(&format!("; not drawn, since it shares no world: {}", self.left_out.join(", ")));
        }
        text
    }
}

/// A stream, times in seconds, and six coordinates at each of them.
type Curve<'a> = (&'a Key, Vec<f64>, Vec<[f64; 6]>);

/// Position and orientation, a plot each.
pub(crate) fn coordinates(document: &ResultDocument, keys: &[Key], timeline: &Timeline) -> Vec<Plot> {
    let placed = placed(document, keys);
    if placed.paths.iter().all(|(_, p)| p.poses.len() < 2) {
        return vec![];
    }
    let words = placed.words(document);
    let curves: Vec<Curve<'_>> = placed
        .paths
        .iter()
        .map(|(key, path)| {
            let times = path.poses.iter().map(|p| timeline.seconds(p.timestamp_ns)).collect();
            (*key, times, values(&path.poses, placed.common))
        })
        .collect();
    let plot = |title: &'static str, first: usize, names: [&str; 3], unit: &str, says: String| {
        let mut picture = Timeline::picture(3);
        for (index, name) in names.into_iter().enumerate() {
            let column = first + index;
            let y = Axis::covering(curves.iter().flat_map(|c| c.2.iter().map(|v| v[column])), 4);
            timeline.panel(&mut picture, (index, 3), (name, unit), y, |picture, panel| {
                for (key, times, values) in &curves {
                    let curve: Vec<(f64, f64)> =
                        times.iter().zip(values).map(|(t, v)| (*t, v[column])).collect();
                    panel.stream(picture, key, &curve);
                }
            });
        }
        Plot { title, svg: picture.into_svg(&says), says }
    };
    let angles = format!(
        "Roll, pitch and yaw turn about the body's x, y and z in the order yaw, pitch, roll, without jumps at ±180°; {words}."
    );
    vec![
        plot("Position over time", 0, ["x", "y", "z"], "m", format!("x, y and z of the body: {words}.")),
        plot("Orientation over time", 3, ["roll", "pitch", "yaw"], "°", angles),
    ]
}

/// x, y, z in metres, roll, pitch, yaw in degrees.
fn values(poses: &[PathPose], common: bool) -> Vec<[f64; 6]> {
    let rotation = |p: &PathPose| {
        let [w, i, j, k] = p.rotation_wxyz;
        UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k))
    };
    let Some(first) = poses.first() else { return vec![] };
    let (origin, turned) = match common {
        true => ([0.0; 3], UnitQuaternion::identity()),
        false => (first.position_m, rotation(first).inverse()),
    };
    let mut before: Option<[f64; 3]> = None;
    poses
        .iter()
        .map(|pose| {
            let (roll, pitch, yaw) = (turned * rotation(pose)).euler_angles();
            let mut angles = [roll, pitch, yaw].map(f64::to_degrees);
            if let Some(before) = before {
                for (angle, before) in angles.iter_mut().zip(before) {
                    *angle -= 360.0 * ((*angle - before) / 360.0).round();
                }
            }
            before = Some(angles);
            let at = |axis: usize| pose.position_m[axis] - origin[axis];
            [at(0), at(1), at(2), angles[0], angles[1], angles[2]]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::keys::keys;
    use crate::report::testing::{document, part};
    use vice_core::result::Role;
    use vice_core::time::Stamp;

    /// A path that turns about z by ten degrees a second.
    fn turning(stream: &str, in_reference_world: bool) -> PathPart {
        let pose = |i: i64| {
            let half = (5.0 * i as f64).to_radians();
            PathPose {
                timestamp_ns: Stamp::from_nanos(i * 1_000_000_000),
                position_m: [1.0 + i as f64, 2.0, 3.0],
                rotation_wxyz: [half.cos(), 0.0, 0.0, half.sin()],
            }
        };
        let poses = (0..60).map(pose).collect();
        PathPart { stream: stream.to_string(), role: Role::Estimate, in_reference_world, poses }
    }

    #[test]
    fn yaw_goes_on_beyond_half_a_turn() {
        let values = values(&turning("e", true).poses, true);
        assert!((values[59][5] - 590.0).abs() < 1e-9, "{:?}", values[59]);
        assert!(values.iter().all(|v| v[3].abs() < 1e-9 && v[4].abs() < 1e-9));
        let own = super::values(&turning("e", true).poses[9..], false);
        assert_eq!(own[0], [0.0; 6]);
        assert!((own[1][0] - 1.0).abs() < 1e-12 && (own[1][5] - 10.0).abs() < 1e-9);
    }

    #[test]
    fn a_stream_without_a_world_is_left_out_and_changes_nothing() {
        let mut document = document(vec![part("e", &[]), part("lost", &[])]);
        document.paths = vec![turning("e", true)];
        let known = keys(&document);
        let alone = coordinates(&document, &known, &Timeline::of(&document));
        document.paths.push(turning("lost", false));
        let both = coordinates(&document, &known, &Timeline::of(&document));
        assert!(both[0].says.contains("shares no world: lost"), "{}", both[0].says);
        // The same curves; only the words differ.
        let drawn = |plot: &Plot| plot.svg.split_once("\">").unwrap().1.to_string();
        assert_eq!(drawn(&alone[0]), drawn(&both[0]));
        document.paths.iter_mut().for_each(|p| p.in_reference_world = false);
        let apart = coordinates(&document, &known, &Timeline::of(&document));
        assert!(
            apart[0].says.contains("each from its own start") && apart[0].svg.contains("data-name=\"lost\"")
        );
    }
}
