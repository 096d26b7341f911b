//! Text from data made safe for where it is shown.

/// Text from data made safe for a terminal: control characters would move its cursor or change its colours, and those
/// that turn the direction of writing would show a name as another one.
pub fn printable(text: &str) -> String {
    let turns =
        |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let breaks = |c: char| matches!(c, '\u{2028}' | '\u{2029}');
    text.chars().map(|c| if c.is_control() || turns(c) || breaks(c) { ' ' } else { c }).collect()
}

/// Bytes as two digits each, such as those of a hash.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// A word of a command line for a POSIX shell.
pub fn shell_word(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Names of fields in back quotes as options: `max-gap` as --max-gap.
pub fn with_options(hint: &str) -> String {
    let mut text = String::new();
    for (index, part) in hint.split('`').enumerate() {
        let is_field = index % 2 == 1 && FIELDS.contains(&part);
        match (index % 2, is_field) {
            (1, true) => text.push_str(&format!("--{part}")),
            (1, false) => text.push_str(&format!("`{part}`")),
            _ => text.push_str(part),
        }
    }
    text
}

/// Whether a text in back quotes is the name of a field of a request.
pub fn is_field(text: &str) -> bool {
    FIELDS.contains(&text)
}

/// Fields that have an option of the same name.
const FIELDS: [&str; 45] = [
    "add",
    "align",
    "allow-writable-plugin",
    "anchor",
    "at",
    "body-from-camera",
    "calibration",
    "camera",
    "chessboard",
    "cloud",
    "cloud-voxel",
    "depth",
    "depth-check",
    "distortion",
    "duration",
    "estimate",
    "estimate-as",
    "estimate-frame",
    "floor-plane",
    "force",
    "format",
    "fps",
    "from",
    "image-size",
    "initial-pose",
    "interpolate",
    "intrinsics",
    "label-noise",
    "labels",
    "max-gap",
    "mend",
    "mesh",
    "observations",
    "plugin",
    "points",
    "port",
    "reference",
    "set",
    "start",
    "stereo-camera",
    "tag-size",
    "time-offset",
    "world-from-cloud",
    "zmap-interpolation",
    "zmap-occlusion",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_move_the_cursor_or_turn_the_writing() {
        assert_eq!(printable("a\u{1b}[31mb"), "a [31mb");
        assert_eq!(printable("gpj.\u{202e}txt\u{2028}"), "gpj. txt ");
    }

    #[test]
    fn a_word_stays_one_word() {
        assert_eq!(shell_word("a/b-c.csv"), "a/b-c.csv");
        assert_eq!(shell_word("it's $(x)"), "'it'\\''s $(x)'");
        assert_eq!(shell_word(""), "''");
    }
}
