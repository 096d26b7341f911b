//! A `vice.toml` for a data set that nobody described: what it holds, what was guessed, and what has to be filled in.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;
use vice_core::dataset::{GROUND_TRUTH, OpenOptions, Probe};
use vice_core::error::{ErrorKind, one_line};
use vice_core::registry::Registry;
use vice_files::address::is_address;
use vice_files::atomic::{self, Overwrite};
use vice_files::vice_toml;
use vice_images::{Guess, GuessedCamera, When, guess};

use crate::error::{RunError, RunResult};
use crate::formats;
use crate::request::PluginsSpec;

/// What is looked at.
#[derive(Clone, Debug, Default)]
pub struct InitRequest {
    /// Folder or file of the data set.
    pub path: PathBuf,
    /// Pictures a second, where nothing in the folder says.
    pub fps: Option<f64>,
    /// Replace a file that exists.
    pub force: bool,
    /// Plugins beside those that are found by themselves.
    pub plugins: PluginsSpec,
}

/// The document `vice.init/1`.
#[derive(Clone, Debug, Serialize)]
pub struct InitDocument {
    /// The schema's name and version.
    pub schema: &'static str,
    /// The file that was written.
    pub file: PathBuf,
    /// The format, and the layout where it is one of a public data set.
    pub format: String,
    /// What is sure.
    pub found: Vec<String>,
    /// What was guessed, and why.
    pub guessed: Vec<String>,
    /// What has to be filled in, as far as it is needed.
    pub unknown: Vec<String>,
    /// The text of the file.
    pub text: String,
}

/// Looks at a data set and writes its `vice.toml`.
///
/// # Errors
/// [`RunError`] if it holds nothing that is known, or there is such a file already.
pub fn init(request: &InitRequest) -> RunResult<InitDocument> {
    let path = &request.path;
    if is_address(path) {
        return Err(RunError::new(
            ErrorKind::Unsupported,
            "a vice.toml is written beside data on this machine",
        )
        .advise("fetch the data, or write the file by hand: docs/formats.md has its keys"));
    }
    if !path.exists() {
        return Err(RunError::missing(format!("{}: no such file or folder", path.display())));
    }
    if request.fps.is_some_and(|fps| !(fps.is_finite() && fps > 0.0)) {
        return Err(RunError::usage("fps", "must be a number above zero"));
    }
    let file = match path.is_dir() {
        true => path.join(vice_toml::FILE),
        false => vice_toml::beside(path).unwrap_or_else(|| path.with_extension(vice_toml::FILE)),
    };
    if file.exists() && !request.force {
        return Err(RunError::new(ErrorKind::Usage, format!("{}: the file exists already", file.display()))
            .advise("replace it with `force`"));
    }
    let document = look(request, file)?;
    let overwrite = if request.force { Overwrite::Replace } else { Overwrite::Refuse };
    atomic::write(&document.file, overwrite, |out| out.write_all(document.text.as_bytes()))?;
    Ok(document)
}

fn look(request: &InitRequest, file: PathBuf) -> RunResult<InitDocument> {
    let path = &request.path;
    let registry = formats::registry(&request.plugins)?;
    match registry.detect(path) {
        Ok((factory, Probe::Collection(runs))) => Err(RunError::new(
            ErrorKind::Usage,
            format!(
                "{}: a folder of {} data sets ({} of them)",
                path.display(),
                factory.info().name,
                runs.len()
            ),
        )
        .advise(format!(
            "name one of them, such as {}",
            runs.first().map_or(String::new(), |r| r.display().to_string())
        ))),
        Ok((factory, _)) if factory.info().name != vice_images::NAME => {
            known_format(request, &registry, &factory.info().name, file)
        }
        Err(error) if !path.is_dir() => Err(error.into()),
        _ => Ok(images(&guess(path, request.fps)?, path, file)),
    }
}

/// A data set of a format that needs no description.
fn known_format(
    request: &InitRequest,
    registry: &Registry,
    format: &str,
    file: PathBuf,
) -> RunResult<InitDocument> {
    if request.fps.is_some() {
        return Err(RunError::usage(
            "fps",
            format!("a data set of the format {format} has stamps of its own"),
        ));
    }
    let dataset = registry.open(&request.path, Some(format), &OpenOptions::default())?;
    let (mut found, mut unknown) = (Vec::new(), Vec::new());
    for camera in dataset.cameras() {
        let frames = dataset.frames(&camera).map_or_else(|e| one_line(&e), |f| format!("{} frames", f.len()));
        found.push(format!("camera {camera}: {frames}"));
        if let Err(error) = dataset.camera(&camera) {
            unknown.push(format!("calibration of {camera}: {}", one_line(&error)));
        }
    }
    let streams = dataset.streams();
    for stream in &streams {
        found.push(format!("stream {stream}"));
    }
    if !streams.iter().any(|s| s == GROUND_TRUTH) {
        unknown.push("streams: there is no ground truth; where one lies in a file, name it".to_string());
    }
    let mut text = head(&format!("a data set of the format {format}, which says of itself:"));
    for line in &found {
        comment(&mut text, line);
    }
    common(&mut text, &Common::default());
    Ok(InitDocument {
        schema: "vice.init/1",
        file,
        format: format.to_string(),
        found,
        guessed: Vec::new(),
        unknown,
        text,
    })
}

fn images(guess: &Guess, folder: &Path, file: PathBuf) -> InitDocument {
    let what = match guess.layout {
        Some(layout) => format!("a folder in the layout of {layout}, which is read without a description"),
        None => "a folder of images".to_string(),
    };
    let mut text = head(&what);
    for (head, lines) in
        [("found", &guess.found), ("guessed", &guess.guessed), ("to be filled in", &guess.unknown)]
    {
        if !lines.is_empty() {
            comment(&mut text, &format!("{head}:"));
            lines.iter().for_each(|line| comment(&mut text, &format!("  {line}")));
        }
    }
    let below = |path: &PathBuf| path.strip_prefix(folder).unwrap_or(path).display().to_string();
    let own = guess.layout.is_none();
    common(
        &mut text,
        &Common {
            calibration: guess.calibration.as_ref().filter(|_| own).map(below),
            cloud: guess.cloud.as_ref().filter(|_| own).map(below),
            streams: guess
                .streams
                .iter()
                .filter(|_| own)
                .map(|(name, path)| (name.clone(), below(path)))
                .collect(),
            has_extrinsics: guess.has_extrinsics,
        },
    );
    if own {
        text.push_str("\n[images]\n");
        match &guess.imu {
            Some(imu) => line(&mut text, "imu", &quoted(&below(imu)), "GUESSED: in the body frame"),
            None => text.push_str("# imu = \"imu.csv\"                  # ns, gyro x y z (rad/s), accel x y z (m/s^2), in the body frame\n"),
        }
        guess.cameras.iter().for_each(|camera| camera_table(&mut text, camera));
    }
    InitDocument {
        schema: "vice.init/1",
        file,
        format: guess
            .layout
            .map_or_else(|| vice_images::NAME.to_string(), |l| format!("{} ({l})", vice_images::NAME)),
        found: guess.found.clone(),
        guessed: guess.guessed.clone(),
        unknown: guess.unknown.clone(),
        text,
    }
}

/// What stands in every file.
#[derive(Default)]
struct Common {
    calibration: Option<String>,
    cloud: Option<String>,
    streams: Vec<(String, String)>,
    has_extrinsics: bool,
}

fn head(what: &str) -> String {
    let mut text =
        String::from("# What VICE is told of this data set, by `vice init`; every command reads it.\n");
    text.push_str("# Lines that start with # are not read. Paths start at the folder of this file.\n#\n");
    comment(&mut text, what);
    text
}

fn comment(text: &mut String, line: &str) {
    // One line each, whatever a name has in it.
    let line = crate::text::printable(line);
    text.push_str("# ");
    text.push_str(line.trim_end());
    text.push('\n');
}

fn line(text: &mut String, key: &str, value: &str, why: &str) {
    let pair = format!("{key} = {value}");
    let _ = match why {
        "" => writeln!(text, "{pair}"),
        why => writeln!(text, "{pair:<34} # {why}"),
    };
}

/// A string as TOML has it.
fn quoted(value: &str) -> String {
    let mut text = String::from("\"");
    for c in value.chars() {
        match c {
            '"' => text.push_str("\\\""),
            '\\' => text.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(text, "\\u{:04X}", u32::from(c));
            }
            c => text.push(c),
        }
    }
    text.push('"');
    text
}

/// A key as TOML has it.
fn toml_key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { name.to_string() } else { quoted(name) }
}

fn common(text: &mut String, known: &Common) {
    text.push('\n');
    let asked = |text: &mut String, key: &str, value: &str, why: &str| {
        let pair = format!("# {key} = {value}");
        let _ = writeln!(text, "{pair:<34} # {why}");
    };
    match &known.calibration {
        Some(file) => line(text, "calibration", &quoted(file), ""),
        None => asked(
            text,
            "calibration",
            "\"calibration.yaml\"",
            "Kalibr, ROS camera_info, OpenCV, sensor.yaml and others",
        ),
    }
    asked(
        text,
        "floor",
        "[0.0, 0.0, 1.0, 0.0]",
        "nx, ny, nz, d of n.p + d = 0 in the world: `vice floor fit` finds it",
    );
    asked(text, "up", "\"z\"", "axis of the poses' world that points up: x, -y, ...");
    asked(text, "time_offset_s", "0.0", "added to the stamps of estimates: `vice clock` finds it");
    match &known.cloud {
        Some(file) => line(text, "cloud", &quoted(file), "GUESSED: in the world of the poses, metres"),
        None => asked(text, "cloud", "\"scan.ply\"", "a scan of the scene, for the depth zmap and mesh"),
    }
    asked(text, "world_from_cloud", "[0, 0, 0, 0, 0, 0, 1]", "x y z qx qy qz qw, or a 4x4 matrix row by row");
    text.push_str("\n[streams]\n");
    let whose = if known.has_extrinsics {
        "GUESSED: poses of the body"
    } else {
        "poses of the camera: it is the body"
    };
    for (name, file) in &known.streams {
        line(text, &toml_key(name), &quoted(file), whose);
    }
    asked(text, GROUND_TRUTH, "\"groundtruth.txt\"", "the stream of this name is the reference");
    asked(
        text,
        "slam",
        "{ file = \"slam.txt\", frame = \"camera\" }",
        "poses of the camera, where a calibration places it",
    );
    text.push_str("\n[labels]\n");
    asked(text, "file", "\"labels.csv\"", "taken where no --labels are named; or \"auto\"");
    asked(text, "points", "[\"a\", \"b\"]", "only these");
}

fn camera_table(text: &mut String, camera: &GuessedCamera) {
    let _ = writeln!(text, "\n[images.cameras.{}]", toml_key(&camera.name));
    line(text, "folder", &quoted(&camera.folder), "");
    match &camera.when {
        When::Names(unit) => {
            line(text, "names", &quoted(unit), "the number in a picture's name is its stamp")
        }
        When::List(list) => {
            line(text, "list", &quoted(list), "stamps, one a picture or with the names of the files")
        }
        When::Fps(fps, start) => {
            line(text, "fps", &format!("{fps:?}"), "the pictures are counted");
            if let Some(start) = start {
                line(
                    text,
                    "start_s",
                    &quoted(start),
                    "GUESSED: the first picture is taken at the first pose",
                );
            }
        }
        When::Unknown => {
            text.push_str(
                "# fps = 30.0                        # FILL IN: pictures a second; take the # away\n",
            );
            text.push_str("# start_s = \"0.0\"                    # stamp of the first picture, on the clock of the poses\n");
        }
    }
    if let Some(depth) = &camera.depth {
        line(text, "depth", &quoted(depth), "16-bit PNG, registered to the camera");
        let scale = camera.depth_scale.unwrap_or(1000.0);
        line(text, "depth_scale", &format!("{scale:?}"), "GUESSED: counts a metre");
    }
}

impl InitDocument {
    /// What was done, for people.
    pub fn summary(&self) -> String {
        let mut text = format!("{}: written ({})\n", self.file.display(), self.format);
        for (head, lines) in [
            ("found", &self.found),
            ("guessed, look at it", &self.guessed),
            ("not known, fill it in where it is needed", &self.unknown),
        ] {
            if lines.is_empty() {
                continue;
            }
            let _ = writeln!(text, "{head}");
            for line in lines {
                let _ = writeln!(text, "  {}", crate::text::printable(line));
            }
        }
        text
    }
}
