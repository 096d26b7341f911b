//! Films and frames with labels and carried points on them.

use std::path::Path;
use std::process::Command;

use vice_tests::{Run, shared, vice, vice_program};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn overlay(out: &Path, more: &[&str]) -> Option<Run> {
    let data = shared("data/euroc_v1_01")?;
    let labels = data.join("labels/floor.csv");
    let args =
        ["overlay", text(&data), "--labels", text(&labels), "--estimate", "imu-euler", "--out", text(out)];
    Some(vice(&[&args[..], more].concat()))
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        folder.read_dir().unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn frames_carry_the_colours_of_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("frames");
    let Some(run) = overlay(&out, &[]) else { return };
    assert_eq!(run.code, 0, "{}", run.stderr);
    let frames = names(&out);
    assert_eq!(frames.len(), 7, "one for each labelled frame: {frames:?}");
    assert_eq!(frames[0], "000000_1403715280562142976.png");
    let image = vice_files::image_file::read(out.join(&frames[3])).unwrap();
    assert_eq!((image.width(), image.height()), (752, 480));
    for (name, colour) in [("label", [0, 114, 178]), ("reference", [213, 94, 0]), ("estimate", [0, 158, 115])]
    {
        let found = image.data().chunks_exact(3).filter(|p| *p == colour).count();
        assert!(found > 40, "{found} pixels of the {name}");
    }
    let again = overlay(&out, &[]).unwrap();
    assert!(again.code == 1 && again.stderr.contains("not empty"), "{}", again.stderr);
    assert_eq!(overlay(&out, &["--force"]).unwrap().code, 0);
}

#[test]
fn a_film_has_all_its_frames_or_is_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let film = folder.path().join("film.mp4");
    let Some(run) = overlay(&film, &["--film-fps", "5"]) else { return };
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(names(folder.path()), ["film.mp4"], "nothing is left beside it");
    let probe = Command::new("ffprobe")
        .args(["-v", "error", "-count_frames", "-select_streams", "v:0", "-of", "csv=p=0"])
        .args(["-show_entries", "stream=width,height,r_frame_rate,nb_read_frames"])
        .arg(&film)
        .output();
    if let Ok(probe) = probe {
        assert_eq!(String::from_utf8_lossy(&probe.stdout).trim(), "752,480,5/1,7");
    }
    let again = overlay(&film, &[]).unwrap();
    assert!(again.code == 1 && again.stderr.contains("--force"), "{}", again.stderr);

    let data = shared("data/euroc_v1_01").unwrap();
    let labels = data.join("labels/floor.csv");
    let without = folder.path().join("other.mp4");
    let run: Run = Command::new(vice_program())
        .env("PATH", "")
        .args([
            "overlay",
            text(&data),
            "--labels",
            text(&labels),
            "--estimate",
            "imu-euler",
            "--out",
            text(&without),
        ])
        .output()
        .unwrap()
        .into();
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("FFmpeg") && run.stderr.contains("PNG frames"), "{}", run.stderr);
    assert_eq!(names(folder.path()), ["film.mp4"]);
}

#[test]
fn mistakes_cost_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |out: &str, more: &[&str], words: &str| {
        let Some(run) = overlay(&folder.path().join(out), more) else { return };
        assert!(run.code == 1 || run.code == 2, "{}", run.stderr);
        assert!(run.stderr.contains(words), "{}", run.stderr);
        assert!(names(folder.path()).is_empty());
    };
    refused("film.gif", &[], ".gif");
    refused("no/such/film.mp4", &[], "no/such");
    refused("frames", &["--depth", "floor,zmap"], "--depth");
    if let Some(data) = shared("data/euroc_v1_01") {
        let run = overlay(&data.join("frames"), &[]).unwrap();
        assert!(run.code == 2 && run.stderr.contains("data that is read"), "{}", run.stderr);
        assert!(!data.join("frames").exists());
    }
}
