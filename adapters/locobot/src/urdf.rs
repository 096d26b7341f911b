//! URDF: the joints of a robot, for recordings whose tf lacks some of them.

use nalgebra::{Unit, UnitQuaternion, Vector3};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::Rigid;

use crate::tf::Transform;

/// A joint between two links, which are frames of tf.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) parent: String,
    pub(crate) child: String,
    origin: Transform,
    kind: Kind,
    /// Follows another joint: its name, multiplier and offset.
    mimic: Option<(String, f64, f64)>,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Fixed,
    Turning(Unit<Vector3<f64>>),
    Sliding(Unit<Vector3<f64>>),
    /// Floating and planar joints, which have no single position.
    Free,
}

impl Joint {
    /// `parent_from_child` of a joint that does not move.
    pub(crate) fn fixed(&self) -> Option<Transform> {
        matches!(self.kind, Kind::Fixed).then_some(self.origin)
    }

    /// The joint whose position moves this one.
    pub(crate) fn driver(&self) -> &str {
        self.mimic.as_ref().map_or(&self.name, |(name, _, _)| name)
    }

    /// `parent_from_child` at a position of its driver (rad or m); `None` where a position says nothing.
    pub(crate) fn at(&self, position: f64) -> Option<Transform> {
        let position = self.mimic.as_ref().map_or(position, |(_, by, plus)| position * by + plus);
        let moved = match self.kind {
            Kind::Turning(axis) => {
                Rigid::from_parts(Vector3::zeros(), UnitQuaternion::from_axis_angle(&axis, position))
            }
            Kind::Sliding(axis) => {
                Rigid::from_parts(axis.into_inner() * position, UnitQuaternion::identity())
            }
            Kind::Fixed | Kind::Free => return None,
        };
        position.is_finite().then(|| self.origin * moved)
    }
}

/// The joints of a URDF.
///
/// # Errors
/// [`DataError`] with the line of what is not as it should be.
pub(crate) fn parse(text: &str) -> DataResult<Vec<Joint>> {
    let document = roxmltree::Document::parse(text).map_err(|e| {
        let line = u64::from(e.pos().row);
        DataError::new("the URDF is not XML").line(line).because(e)
    })?;
    let root = document.root_element();
    let joints = root.children().filter(|n| n.has_tag_name("joint"));
    joints
        .map(|node| joint(&node).map_err(|e| e.line(u64::from(document.text_pos_at(node.range().start).row))))
        .collect()
}

fn joint(node: &roxmltree::Node<'_, '_>) -> DataResult<Joint> {
    let name = node.attribute("name").unwrap_or_default().to_string();
    let child_of = |tag: &str| node.children().find(|n| n.has_tag_name(tag));
    let link = |tag: &str| {
        let link = child_of(tag).and_then(|n| n.attribute("link"));
        link.map(str::to_string).ok_or_else(|| DataError::new(format!("joint {name} has no <{tag} link>")))
    };
    let vector = |tag: &str, attribute: &str, default: [f64; 3]| -> DataResult<Vector3<f64>> {
        let Some(text) = child_of(tag).and_then(|n| n.attribute(attribute)) else {
            return Ok(default.into());
        };
        let wrong = || DataError::new(format!("joint {name}: <{tag} {attribute}> is not three numbers"));
        let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        match numbers.map_err(|_| wrong())?.as_slice() {
            [x, y, z] if x.is_finite() && y.is_finite() && z.is_finite() => Ok(Vector3::new(*x, *y, *z)),
            _ => Err(wrong()),
        }
    };
    let (xyz, rpy) = (vector("origin", "xyz", [0.0; 3])?, vector("origin", "rpy", [0.0; 3])?);
    let origin = Rigid::from_parts(xyz, UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z));
    let axis = || {
        let axis = vector("axis", "xyz", [1.0, 0.0, 0.0])?;
        Unit::try_new(axis, 1e-9).ok_or_else(|| DataError::new(format!("joint {name} has a zero axis")))
    };
    let kind = match node.attribute("type").unwrap_or_default() {
        "fixed" => Kind::Fixed,
        "revolute" | "continuous" => Kind::Turning(axis()?),
        "prismatic" => Kind::Sliding(axis()?),
        _ => Kind::Free,
    };
    let mimic = match child_of("mimic") {
        None => None,
        Some(mimic) => {
            let number = |attribute: &str, default: f64| match mimic.attribute(attribute) {
                None => Ok(default),
                Some(text) => text
                    .trim()
                    .parse()
                    .map_err(|_| DataError::new(format!("joint {name}: <mimic {attribute}> is no number"))),
            };
            let leader = mimic.attribute("joint").unwrap_or_default().to_string();
            Some((leader, number("multiplier", 1.0)?, number("offset", 0.0)?))
        }
    };
    let (parent, child) = (link("parent")?, link("child")?);
    Ok(Joint { name, parent, child, origin, kind, mimic })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Point3;

    #[test]
    fn joints_move_along_and_about_their_axes() {
        let joints = parse(
            r#"<robot name="r">
              <link name="a"/>
              <joint name="f" type="fixed"><parent link="a"/><child link="b"/><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/></joint>
              <joint name="t" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 2"/></joint>
              <joint name="s" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="0 1 0"/><mimic joint="t" multiplier="2" offset="1"/></joint>
              <joint name="x" type="floating"><parent link="d"/><child link="e"/></joint>
            </robot>"#,
        )
        .unwrap();
        let x = Point3::new(1.0, 0.0, 0.0);
        assert_relative_eq!(
            joints[0].fixed().unwrap().transform_point(&x),
            Point3::new(1.0, 1.0, 0.0),
            epsilon = 1e-12
        );
        let quarter = joints[1].at(std::f64::consts::FRAC_PI_2).unwrap();
        assert_relative_eq!(quarter.transform_point(&x), Point3::new(0.0, 1.0, 0.0), epsilon = 1e-12);
        assert_eq!((joints[2].driver(), joints[2].at(0.5).unwrap().translation().y), ("t", 2.0));
        assert!(joints[3].at(0.0).is_none() && joints[3].fixed().is_none());
        assert!(joints[1].at(f64::NAN).is_none());
    }

    #[test]
    fn mistakes_have_a_line() {
        let error = |text: &str| parse(text).unwrap_err().to_string();
        assert!(error("<robot>\n</joint>").starts_with("line 2: the URDF is not XML"));
        let zero = "<robot>\n\n<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 0'/></joint></robot>";
        assert_eq!(error(zero), "line 3: joint j has a zero axis");
        assert!(
            error("<robot><joint name='j' type='fixed'><parent link='a'/></joint></robot>")
                .contains("<child link>")
        );
        assert!(
            error("<robot><joint name='j' type='fixed'><parent link='a'/><child link='b'/><origin xyz='1 x'/></joint></robot>")
                .contains("three numbers")
        );
    }
}
