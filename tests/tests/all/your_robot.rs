//! The five paths of docs/your-robot.md, as they stand there. The one in Python is run by the tests of the module.

use std::fs;
use std::path::Path;

use vice_tests::{root, shared, vice, vice_in};

/// The commands of a section.
fn commands(section: &str) -> Vec<String> {
    let page = fs::read_to_string(root().join("docs/your-robot.md")).unwrap();
    let from = page.split(&format!("## {section}")).nth(1).unwrap_or_else(|| panic!("{section}"));
    let from = from.split("\n## ").next().unwrap();
    let blocks = from.split("```").skip(1).step_by(2);
    let lines = blocks.flat_map(|b| b.lines()).filter_map(|l| l.strip_prefix("vice "));
    lines.map(str::to_string).collect()
}

/// Runs the commands of a section in a folder; the last one has to print a number of pixels.
fn walk(section: &str, folder: &Path) {
    let commands = commands(section);
    assert!(commands.len() >= 2, "{section}: {commands:?}");
    let mut last = String::new();
    for command in commands {
        let words: Vec<&str> = command.split_whitespace().collect();
        let run = vice_in(folder, &words);
        // A check may have something to say.
        let fine = run.code == 0 || (words[0] == "check" && run.code == 3);
        assert!(fine, "vice {command}: {}{}", run.stdout, run.stderr);
        last = run.stdout;
    }
    assert!(last.contains("RMSE_2D"), "{section}: {last}");
}

fn link(from: &Path, to: &Path) {
    #[cfg(unix)]
    std::os::unix::fs::symlink(from, to).unwrap();
}

#[test]
fn a_bag() {
    let Some(bag) = shared("data/locobot/locobot_ros1.bag") else { return };
    let folder = tempfile::tempdir().unwrap();
    link(&bag.canonicalize().unwrap(), &folder.path().join("run.bag"));
    walk("1. ", folder.path());
    assert!(folder.path().join("run.bag").exists());
}

#[test]
fn a_folder_of_images() {
    let Some(recording) = shared("data/visp_tags_rgbd") else { return };
    let folder = tempfile::tempdir().unwrap();
    crate::init::plain(&recording, &folder.path().join("my_images"), "poses.txt");
    walk("2. ", folder.path());
}

#[test]
fn a_folder_like_that_of_euroc() {
    let folder = tempfile::tempdir().unwrap();
    walk("3. ", folder.path());
}

#[test]
fn a_film() {
    if std::process::Command::new("ffmpeg").arg("-version").output().is_err() {
        assert!(std::env::var("VICE_REQUIRE_DATA").is_err(), "FFmpeg is missing");
        eprintln!("skipped: FFmpeg is missing");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (flight, film) = (folder.path().join("flight"), folder.path().join("my_film"));
    let path = |p: &Path| p.to_str().unwrap().to_string();
    let run = vice(&["synth", &path(&flight), "--duration", "3", "--rate", "10"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    fs::create_dir(&film).unwrap();
    let frames = flight.join("mav0/cam0/data");
    let mut stamps: Vec<String> = fs::read_dir(&frames)
        .unwrap()
        .map(|e| e.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    stamps.sort();
    let done = std::process::Command::new("ffmpeg")
        .args(["-v", "error", "-framerate", "10", "-pattern_type", "glob", "-i"])
        .arg(frames.join("*.png"))
        .args(["-c:v", "libx264", "-crf", "10", "-pix_fmt", "yuv420p"])
        .arg(film.join("film.mov"))
        .status()
        .unwrap();
    assert!(done.success());
    fs::write(film.join("stamps.txt"), stamps.join("\n") + "\n").unwrap();
    fs::copy(flight.join("estimates/drift.txt"), film.join("slam.txt")).unwrap();
    let run = vice(&["convert", &path(&flight), "--to", "tum", &path(&film.join("truth.txt"))]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let sensor = fs::read_to_string(flight.join("mav0/cam0/sensor.yaml")).unwrap();
    let list = |key: &str| {
        let from = sensor.split(key).nth(1).unwrap();
        let (start, end) = (from.find('[').unwrap(), from.find(']').unwrap());
        from[start..=end].replace('\n', " ")
    };
    let description = format!(
        "film = \"film.mov\"\nstamps = \"stamps.txt\"\ngray = true\n[camera]\nsize = {}\nintrinsics = {}\nmodel = \"radtan\"\ndistortion = {}\n\
         body_from_camera = {}\n[trajectories]\nground-truth = \"truth.txt\"\nslam = \"slam.txt\"\n",
        list("resolution:"),
        list("intrinsics:"),
        list("distortion_coefficients:"),
        list("data:")
    );
    fs::write(film.join("vice-video.toml"), description).unwrap();
    walk("4. ", folder.path());
}

#[test]
fn the_readme_leads_there_in_its_first_screen() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let screen: Vec<&str> = readme.lines().take(30).collect();
    assert!(screen.iter().any(|line| line.contains("docs/your-robot.md")));
}
