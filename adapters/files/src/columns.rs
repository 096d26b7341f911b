//! What the name of a column says: which quantity, which axis, which unit.
//!
//! Names come as people and tools write them: `tx`, `p_RS_R_x [m]`, `pos_x_mm`, `field.pose.pose.position.x`, `q_w`,
//! `orientation.w`, `#timestamp [ns]`, `t(s)`, `header.stamp.nsecs`. The first word that is known decides; words that
//! are not known behind it (names of frames) are passed over. A name that is not known has no meaning, which is safe.

/// A quantity that a column may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Quantity {
    /// A stamp.
    Time,
    /// A place.
    Position,
    /// A part of a quaternion.
    Rotation,
    /// A part of a quaternion by a number (`q0`): whether w comes first is not said.
    RotationByNumber,
    /// Euler angles or a rotation vector.
    Angles,
    /// A velocity.
    Velocity,
    /// A rate of turn.
    AngularRate,
    /// An acceleration.
    Acceleration,
    /// The bias of a gyroscope.
    GyroBias,
    /// The bias of an accelerometer.
    AccelBias,
    /// The name of a file.
    File,
}

/// An axis, or a part of a quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
    /// The scalar part.
    W,
}

/// A unit of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TimeUnit {
    /// Seconds.
    Seconds,
    /// Milliseconds.
    Millis,
    /// Microseconds.
    Micros,
    /// Nanoseconds.
    Nanos,
}

impl TimeUnit {
    /// The unit that a word names.
    pub fn of_word(word: &str) -> Option<Self> {
        Some(match word.trim().to_lowercase().as_str() {
            "s" | "sec" | "secs" | "second" | "seconds" => Self::Seconds,
            "ms" | "msec" | "msecs" | "milli" | "millis" | "millisecond" | "milliseconds" => Self::Millis,
            "us" | "µs" | "μs" | "usec" | "usecs" | "micro" | "micros" | "microsecond" | "microseconds" => {
                Self::Micros
            }
            "ns" | "nsec" | "nsecs" | "nano" | "nanos" | "nanosec" | "nanosecs" | "nanosecond"
            | "nanoseconds" => Self::Nanos,
            _ => return None,
        })
    }

    /// The unit in which a number is a time of these decades, else seconds.
    pub fn of_magnitude(value: f64) -> Self {
        match value.abs() {
            v if v < 1e11 => Self::Seconds,
            v if v < 1e14 => Self::Millis,
            v if v < 1e17 => Self::Micros,
            _ => Self::Nanos,
        }
    }
}

/// A name of a column and what it says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnName {
    /// The name as it stands in the file, without its unit.
    pub text: String,
    /// The quantity and the axis, where the name is known.
    pub meaning: Option<(Quantity, Option<Axis>)>,
    /// The unit in brackets or behind the name; empty where there is none.
    pub unit: String,
    words: Vec<String>,
}

/// Words of frames and messages in front of a bare axis.
const OWNERS: [&str; 26] = [
    "field",
    "pose",
    "header",
    "gt",
    "est",
    "groundtruth",
    "ground",
    "truth",
    "estimate",
    "estimated",
    "world",
    "body",
    "cam",
    "camera",
    "imu",
    "base",
    "link",
    "odom",
    "map",
    "vicon",
    "mocap",
    "robot",
    "msg",
    "data",
    "transform",
    "ref",
];
/// Words that make a column no quantity but the spread of one.
const SPREADS: [&str; 12] = [
    "cov",
    "covariance",
    "std",
    "stddev",
    "sigma",
    "var",
    "variance",
    "err",
    "error",
    "noise",
    "uncertainty",
    "accuracy",
];
/// Units of lengths and angles that may stand behind a name.
const UNIT_WORDS: [&str; 14] = [
    "m", "meter", "meters", "metre", "metres", "mm", "cm", "km", "rad", "radians", "deg", "degree",
    "degrees", "px",
];

impl ColumnName {
    /// Reads a name.
    pub fn new(name: &str) -> Self {
        let trimmed = name.trim().trim_start_matches(['#', '%']).trim().trim_matches(['"', '\'']).trim();
        let (text, mut unit) = split_unit(trimmed);
        let mut words = words(&text);
        if unit.is_empty()
            && words.len() > 1
            && let Some(last) = words.last().filter(|w| is_unit(w))
        {
            unit = last.clone();
            words.pop();
        }
        let meaning = meaning(&words, &mut unit);
        Self { text, meaning, unit, words }
    }

    /// Whether the name has a word.
    pub fn has_word(&self, word: &str) -> bool {
        self.words.iter().any(|w| w == word)
    }

    /// The unit of a time, where the name says one.
    pub fn time_unit(&self) -> Option<TimeUnit> {
        TimeUnit::of_word(&self.unit)
    }

    /// Metres in one of the unit; `None` where the unit is no length.
    pub fn metres(&self) -> Option<f64> {
        Some(match self.unit.to_lowercase().as_str() {
            "" | "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
            "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 1e-3,
            "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 1e-2,
            "km" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => 1e3,
            _ => return None,
        })
    }

    /// Radians a second in one of the unit; `None` where the unit is no rate of turn.
    pub fn radians_per_second(&self) -> Option<f64> {
        Some(match plain(&self.unit).as_str() {
            "" | "rad" | "rads" | "rads-1" | "rads^-1" | "rad/s" | "rad/sec" => 1.0,
            "deg" | "degs" | "degs-1" | "degs^-1" | "deg/s" | "deg/sec" | "°/s" | "dps" => {
                std::f64::consts::PI / 180.0
            }
            _ => return None,
        })
    }

    /// Metres a second squared in one of the unit; `None` where the unit is no acceleration.
    pub fn metres_per_second2(&self) -> Option<f64> {
        Some(match plain(&self.unit).as_str() {
            "" | "m" | "ms-2" | "ms^-2" | "m/s2" | "m/s^2" | "m/s²" | "m/s/s" | "m/sec^2" | "m/s**2" => 1.0,
            "g" => 9.806_65,
            "mg" => 9.806_65e-3,
            _ => return None,
        })
    }
}

/// A unit without blanks and dots of multiplication.
fn plain(unit: &str) -> String {
    unit.to_lowercase().chars().filter(|c| !c.is_whitespace() && !matches!(c, '*' | '·')).collect()
}

fn is_unit(word: &str) -> bool {
    TimeUnit::of_word(word).is_some() || UNIT_WORDS.contains(&word)
}

/// Takes `[m]` or `(m)` off the end of a name. A number in brackets is a place in a list, not a unit.
fn split_unit(name: &str) -> (String, String) {
    let Some(open) = name.find(['[', '(', '{']) else { return (name.to_string(), String::new()) };
    let (text, rest) = name.split_at(open);
    let unit: String = rest.chars().filter(|c| !matches!(c, '[' | ']' | '(' | ')' | '{' | '}')).collect();
    let unit = unit.trim().to_string();
    if !unit.is_empty() && unit.bytes().all(|b| b.is_ascii_digit()) {
        return (format!("{}_{unit}", text.trim()), String::new());
    }
    let unit = if matches!(unit.as_str(), "-" | "1") { String::new() } else { unit };
    (text.trim().to_string(), unit)
}

/// The words of a name in lower case: `posX`, `p_RS_R_x` and `position.x` are split.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![String::new()];
    let mut before_lower = false;
    for c in text.chars() {
        if !c.is_alphanumeric() {
            words.push(String::new());
        } else if c.is_uppercase() && before_lower {
            words.push(c.to_lowercase().collect());
        } else if let Some(word) = words.last_mut() {
            word.extend(c.to_lowercase());
        }
        before_lower = c.is_lowercase();
    }
    words.retain(|w| !w.is_empty());
    words
}

fn axis_of(word: &str) -> Option<Axis> {
    Some(match word {
        "x" => Axis::X,
        "y" => Axis::Y,
        "z" => Axis::Z,
        "w" => Axis::W,
        _ => return None,
    })
}

/// A word that is a quantity and an axis in one, `qx`, `posz`, `qi`.
fn split_axis(word: &str) -> Option<(&str, Axis)> {
    match word {
        "qi" => return Some(("q", Axis::X)),
        "qj" => return Some(("q", Axis::Y)),
        "qk" => return Some(("q", Axis::Z)),
        "qr" => return Some(("q", Axis::W)),
        _ => {}
    }
    let last = word.char_indices().next_back()?.0;
    let (stem, axis) = word.split_at(last);
    let known = quantity_of(stem).is_some() || matches!(stem, "bg" | "ba" | "bw");
    Some((stem, axis_of(axis)?)).filter(|_| known)
}

fn quantity_of(word: &str) -> Option<Quantity> {
    Some(match word {
        "p" | "pos" | "position" | "t" | "trans" | "translation" | "tvec" | "loc" | "location" => {
            Quantity::Position
        }
        "q" | "quat" | "quaternion" | "orientation" | "ori" | "rot" | "rotation" | "attitude" | "att" => {
            Quantity::Rotation
        }
        "v" | "vel" | "velocity" | "linear" => Quantity::Velocity,
        "w" | "g" | "gyro" | "gyr" | "gyroscope" | "omega" | "angular" => Quantity::AngularRate,
        "a" | "acc" | "accel" | "acceleration" | "accelerometer" => Quantity::Acceleration,
        "r" | "euler" | "rpy" | "angle" | "angles" | "rotvec" | "rvec" => Quantity::Angles,
        _ => return None,
    })
}

fn meaning(words: &[String], unit: &mut String) -> Option<(Quantity, Option<Axis>)> {
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    let last = words.last()?.as_str();
    if has(&SPREADS) {
        return None;
    }
    if matches!(last, "roll" | "pitch" | "yaw") {
        return Some((Quantity::Angles, None));
    }
    if let Some(of_axis) = with_axis(words) {
        return Some(of_axis);
    }
    // `q0`, `q_0`, `quat1`: whether that is w differs from tool to tool.
    let number = last.trim_start_matches(|c: char| c.is_alphabetic());
    let stem = last
        .strip_suffix(number)
        .filter(|s| !s.is_empty())
        .or_else(|| words.iter().rev().nth(1).map(String::as_str));
    if number.len() == 1 && stem.and_then(quantity_of) == Some(Quantity::Rotation) {
        return Some((Quantity::RotationByNumber, None));
    }
    let time = ["timestamp", "timestamps", "time", "times", "stamp", "stamps", "ts", "t", "epoch"];
    let beside = ["ros", "unix", "utc", "sensor", "image", "rosbag", "abs", "absolute", "system", "frame"];
    let of_time = |w: &String| time.contains(&w.as_str()) || TimeUnit::of_word(w).is_some();
    if words.iter().any(of_time)
        && words.iter().all(|w| of_time(w) || beside.contains(&w.as_str()) || OWNERS.contains(&w.as_str()))
    {
        // `secs` is its own unit.
        if unit.is_empty() && TimeUnit::of_word(last).is_some() {
            last.clone_into(unit);
        }
        return Some((Quantity::Time, None));
    }
    let file = ["filename", "file", "path", "picture", "filenames", "img", "imagename", "png", "jpg"];
    let is_file =
        has(&file) || matches!(words, [one] if one == "image" || one == "name") || words == ["image", "name"];
    is_file.then_some((Quantity::File, None))
}

fn with_axis(words: &[String]) -> Option<(Quantity, Option<Axis>)> {
    let (last, before) = words.split_last()?;
    let (stems, axis): (Vec<&str>, Axis) = match axis_of(last) {
        Some(axis) => (before.iter().map(String::as_str).collect(), axis),
        None => {
            let (stem, axis) = split_axis(last)?;
            (before.iter().map(String::as_str).chain([stem]).collect(), axis)
        }
    };
    let has = |list: &[&str]| stems.iter().any(|s| list.contains(s));
    let (turns, speeds_up) = (
        has(&["gyro", "gyr", "gyroscope", "omega", "angular", "rate", "bg", "bw"])
            // `ang_x` alone may be an angle.
            || (has(&["ang"]) && has(&["vel", "velocity"])),
        has(&["acc", "accel", "acceleration", "accelerometer", "ba"]),
    );
    let bias = has(&["bias", "bg", "ba", "bw"]) || (stems.first() == Some(&"b") && stems.len() > 1);
    let quantity = if bias {
        if turns || has(&["w", "g"]) {
            Quantity::GyroBias
        } else if speeds_up || has(&["a"]) {
            Quantity::AccelBias
        } else {
            return None;
        }
    } else if speeds_up {
        Quantity::Acceleration
    } else if turns {
        Quantity::AngularRate
    } else if let Some(first) = stems.iter().find_map(|s| quantity_of(s)) {
        first
    } else if stems.iter().all(|s| OWNERS.contains(s)) {
        // A bare axis.
        if axis == Axis::W { Quantity::Rotation } else { Quantity::Position }
    } else {
        return None;
    };
    match (quantity, axis) {
        (Quantity::Rotation, _) => {}
        (_, Axis::W) => return None,
        _ => {}
    }
    Some((quantity, Some(axis)))
}

#[cfg(test)]
mod tests;
