use super::*;
use std::fs;

const TOML: &str = r#"
film = "film.mov"
stamps = "stamps.txt"
imu = "imu.csv"
[camera]
size = [64, 48]
intrinsics = [50.0, 50.0, 31.5, 23.5]
[trajectories]
slam = "slam.tum"
ground-truth = "gt.tum"
a-first = "slam.tum"
"#;

fn folder(toml: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(FILE, toml);
    let stamps: Vec<String> =
        (0..10).map(|i| (1_700_000_000_000_000_000_i64 + i * 33_000_000).to_string()).collect();
    write("stamps.txt", &stamps.join("\n"));
    let poses: String = (0..50).map(|i| format!("{}.{:02} {} 0 1 0 0 0 1\n", 1_700_000_000, i, i)).collect();
    write("gt.tum", &poses);
    write("slam.tum", &poses.replace("1700000000.", "1700000000000."));
    write("imu.csv", "# ns,gx,gy,gz,ax,ay,az\n5,1,2,3,4,5,9.81\n6,1,2,3,4,5,9.81\n");
    folder
}

fn open(folder: &tempfile::TempDir) -> DataResult<Box<dyn Dataset>> {
    Video.open(folder.path(), &OpenOptions::default())
}

#[test]
fn a_folder_or_its_file_is_recognised() {
    let folder = folder(TOML);
    assert_eq!(Video.probe(folder.path()), Probe::Yes);
    assert_eq!(Video.probe(&folder.path().join(FILE)), Probe::Yes);
    assert_eq!(Video.probe(&folder.path().join("stamps.txt")), Probe::No);
    assert_eq!(Video.probe(Path::new("/no/such")), Probe::No);
    let by_file = Video.open(&folder.path().join(FILE), &OpenOptions::default()).unwrap();
    assert_eq!(by_file.streams(), ["ground-truth", "a-first", "slam"]);
    assert_eq!(by_file.cameras(), ["camera"]);
    assert_eq!(by_file.name(), folder.path().file_name().unwrap().to_str().unwrap());
}

#[test]
fn paths_stay_below_the_folder() {
    for (from, to) in [
        ("film.mov", "../film.mov"),
        ("stamps.txt", "/etc/passwd"),
        ("gt.tum", "../gt.tum"),
        ("imu.csv", "a/../../imu.csv"),
    ] {
        let folder = folder(&TOML.replace(from, to));
        let error = open(&folder).err().unwrap().to_string();
        assert!(error.contains(FILE) && error.contains("stay below the file's folder"), "{error}");
    }
}

#[test]
fn what_is_not_there_is_named() {
    let folder = folder(TOML);
    let dataset = open(&folder).unwrap();
    let film = dataset.frames("camera").unwrap_err().to_string();
    assert!(film.contains("film.mov: no such film"), "{film}");
    let stream = dataset.trajectory("odom").unwrap_err().to_string();
    assert!(stream.contains("no pose stream `odom` (it has: ground-truth, a-first, slam)"), "{stream}");
    assert!(dataset.camera("left").unwrap_err().to_string().contains("it has: camera"));
    let imu = dataset.imu().unwrap();
    assert_eq!((imu.len(), imu[1].accel_m_s2.z), (2, 9.81));
    fs::write(folder.path().join("imu.csv"), "5,1,2,3,4,5\n").unwrap();
    assert!(dataset.imu().unwrap_err().to_string().contains("imu.csv:1: expected 7 columns"));
    fs::write(folder.path().join("imu.csv"), "5,1,2,3,4,5,6\n5,1,2,3,4,5,6\n").unwrap();
    assert!(dataset.imu().unwrap_err().to_string().contains("imu.csv:2: stamp 5 ns appears twice"));
    fs::remove_file(folder.path().join("stamps.txt")).unwrap();
    let stamps = dataset.frames("camera").unwrap_err().to_string();
    assert!(stamps.contains("stamps.txt: no such file"), "{stamps}");
}

#[test]
fn a_phone_film_gives_frames_and_upright_pictures() {
    use std::process::Command;
    if let Err(e) = Ffmpeg::default().check() {
        assert!(std::env::var("VICE_REQUIRE_DATA").map_or(true, |v| v != "1"), "{e}");
        eprintln!("skipped: {e}");
        return;
    }
    let folder = folder(TOML);
    let ffmpeg = |args: &[&str]| {
        let status = Command::new("ffmpeg")
            .current_dir(folder.path())
            .args(["-v", "error", "-nostdin", "-y"])
            .args(args)
            .status()
            .unwrap();
        assert!(status.success());
    };
    let pattern = "testsrc2=size=48x64:rate=30,trim=end_frame=10";
    ffmpeg(&["-f", "lavfi", "-i", pattern, "-c:v", "mpeg4", "-q:v", "2", "lying.mov"]);
    // What a phone held the other way does: the pictures lie, and the film says how to turn them.
    let mut film = fs::read(folder.path().join("lying.mov")).unwrap();
    let matrix = film.windows(4).position(|w| w == b"tkhd").unwrap() + 4 + 40;
    for (i, value) in [0, 0x0001_0000, 0, -0x0001_0000, 0_i32].into_iter().enumerate() {
        film[matrix + 4 * i..matrix + 4 * i + 4].copy_from_slice(&value.to_be_bytes());
    }
    fs::write(folder.path().join("film.mov"), film).unwrap();
    let dataset = open(&folder).unwrap();
    assert_eq!(dataset.frames("camera").unwrap().len(), 10);
    let image = dataset.image("camera", 9).unwrap();
    assert_eq!((image.width(), image.height(), image.format()), (64, 48, PixelFormat::Rgb8));
    assert!(dataset.trajectory("ground-truth").is_ok());
    let slam = dataset.trajectory("slam").unwrap_err().to_string();
    assert!(slam.contains("slam.tum:") && slam.contains("milliseconds"), "{slam}");
    let state = dataset.inertial_state(Stamp::from_nanos(1_700_000_000_100_000_000)).unwrap().unwrap();
    assert!((state.velocity_m_s.x - 100.0).abs() < 1e-6, "{:?}", state.velocity_m_s);
    assert_eq!(dataset.inertial_state(Stamp::from_nanos(5)).unwrap(), None);

    fs::copy(folder.path().join("lying.mov"), folder.path().join("film.mov")).unwrap();
    let size = open(&folder).unwrap().frames("camera").unwrap_err().to_string();
    assert!(size.contains("the film is 48x64 pixels, its calibration is for 64x48"), "{size}");
    fs::write(folder.path().join("stamps.txt"), "1\n2\n").unwrap();
    let count = open(&folder).unwrap().frames("camera").unwrap_err().to_string();
    assert!(count.contains("stamps.txt: fewer stamps than frames: 2 stamps"), "{count}");
}
