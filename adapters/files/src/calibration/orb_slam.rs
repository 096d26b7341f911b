//! Settings of ORB-SLAM3 with two cameras: `Camera1.fx`, `Camera2.fx`, and `Stereo.T_c1_c2`, which takes the second to the first.

use serde_json::{Map, Value};

/// The keys of a second camera, in lower case.
const SECOND: &str = "camera2.";
const FIRST: &str = "camera1.";
/// Its place.
const PLACE: &str = "stereo.t_c1_c2";
/// What the settings say of both cameras.
const SHARED: &str = "camera.";

/// The settings of each of two cameras, the second as if it were the first; and the place of the second in the first.
pub(super) struct Pair {
    pub(super) cameras: [Map<String, Value>; 2],
    pub(super) first_from_second: Option<(String, Value)>,
}

/// The two cameras, where there is a second one.
pub(super) fn pair(root: &Map<String, Value>) -> Option<Pair> {
    let starts = |key: &str, with: &str| key.to_lowercase().starts_with(with);
    if !root.keys().any(|key| starts(key, SECOND)) {
        return None;
    }
    let (mut first, mut second, mut first_from_second) = (Map::new(), Map::new(), None);
    for (key, value) in root {
        if key.to_lowercase() == PLACE {
            first_from_second = Some((key.clone(), value.clone()));
        } else if starts(key, SECOND) {
            let rest = key.get(SECOND.len()..).unwrap_or_default();
            second.insert(format!("Camera1.{rest}"), value.clone());
        } else {
            first.insert(key.clone(), value.clone());
            if starts(key, SHARED) && !starts(key, FIRST) {
                second.insert(key.clone(), value.clone());
            }
        }
    }
    Some(Pair { cameras: [first, second], first_from_second })
}
