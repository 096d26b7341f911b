use std::process::Command;

use super::*;

/// Films need FFmpeg to be made and decoded: without it the reason is printed, or with `VICE_REQUIRE_DATA=1` it fails.
fn ffmpeg_is_there() -> bool {
    match Ffmpeg::default().check() {
        Ok(()) => true,
        Err(e) if std::env::var("VICE_REQUIRE_DATA").is_ok_and(|v| v == "1") => panic!("{e}"),
        Err(e) => {
            eprintln!("skipped: {e}");
            false
        }
    }
}

fn ffmpeg(args: &[&str]) -> Vec<u8> {
    let output = Command::new("ffmpeg").args(["-v", "error", "-nostdin", "-y"]).args(args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

const FRAMES: usize = 90;

/// A film of a moving pattern, with what FFmpeg decodes from it in one go.
fn make(path: &Path, encoder: &[&str], gray: bool) -> Vec<Vec<u8>> {
    let path = path.to_str().unwrap();
    let pattern = format!("testsrc2=size=64x48:rate=30,trim=end_frame={FRAMES}");
    let mut args = vec!["-f", "lavfi", "-i", &pattern];
    args.extend(encoder);
    args.push(path);
    ffmpeg(&args);
    let pixels = if gray { "gray" } else { "rgb24" };
    let flags = "+accurate_rnd+bitexact";
    let raw = ffmpeg(&["-i", path, "-sws_flags", flags, "-pix_fmt", pixels, "-f", "rawvideo", "-"]);
    let frame = 64 * 48 * if gray { 1 } else { 3 };
    assert_eq!(raw.len(), FRAMES * frame);
    raw.chunks(frame).map(<[u8]>::to_vec).collect()
}

const MPEG4: [&str; 8] = ["-c:v", "mpeg4", "-q:v", "3", "-g", "12", "-bf", "2"];

/// Encoders to try: the first is in every FFmpeg. x265 has open groups of pictures, x264 negative offsets.
fn encoders() -> Vec<Vec<&'static str>> {
    let known = String::from_utf8_lossy(&ffmpeg(&["-encoders"])).into_owned();
    let mut all = vec![MPEG4.to_vec(), vec!["-c:v", "mjpeg", "-pix_fmt", "yuvj444p"]];
    if known.contains("libx264") {
        let negative = ["-movflags", "+negative_cts_offsets+faststart"];
        all.push([&["-c:v", "libx264", "-g", "15", "-bf", "3"][..], &negative].concat());
    }
    if known.contains("libx265") {
        let open = "keyint=10:min-keyint=10:open-gop=1:bframes=4:lossless=1:log-level=error";
        all.push(vec!["-c:v", "libx265", "-x265-params", open]);
        let short = "keyint=3:min-keyint=1:open-gop=1:bframes=3:log-level=error";
        all.push(vec!["-c:v", "libx265", "-x265-params", short]);
    }
    all
}

#[test]
fn any_frame_in_any_order_is_the_one_of_a_straight_decode() {
    if !ffmpeg_is_there() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (i, encoder) in encoders().iter().enumerate() {
        // A name that would be an option, a protocol, a pattern or a command, were it taken for one.
        let path = folder.path().join(format!("-i http:%03d;$(touch x) {i}.mov"));
        let gray = i % 2 == 0;
        let expected = make(&path, encoder, gray);
        let format = if gray { PixelFormat::Gray8 } else { PixelFormat::Rgb8 };
        let film = Film::open(&path, format, Ffmpeg::default()).unwrap();
        assert_eq!((film.frame_count(), film.size()), (FRAMES, (64, 48)));
        let mut order: Vec<usize> = vec![89, 0, 1, 2, 40, 39, 12, 11, 10, 9, 75, 80, 20, 29, 30, 31, 3, 88];
        order.extend((0..12).map(|k| (k * 53 + 17) % FRAMES));
        for index in order {
            let starts = film.stats().starts;
            let image = film.frame(index).unwrap();
            assert!(image.data() == expected[index], "{encoder:?}: frame {index} is another one");
            assert!(film.stats().starts <= starts + 1, "{encoder:?}: seeking to frame {index} went past it");
        }
        let error = film.frame(FRAMES).unwrap_err().to_string();
        assert!(error.contains("no frame 90, the film has 90"), "{error}");
    }
    assert!(!folder.path().join("x").exists());
}

#[test]
fn stepping_forwards_decodes_each_frame_once() {
    if !ffmpeg_is_there() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mov");
    let expected = make(&path, &MPEG4, true);
    let film = Film::open(&path, PixelFormat::Gray8, Ffmpeg::default()).unwrap();
    for (index, frame) in expected.iter().enumerate() {
        assert!(film.frame(index).unwrap().data() == *frame);
        assert!(film.frame(index).unwrap().data() == *frame, "the same again costs nothing");
    }
    assert_eq!(film.stats(), DecodeStats { starts: 1, frames: FRAMES });
    // A step back stays in what is kept; a jump forwards over many starts of decoding seeks; a short one reads on.
    film.frame(FRAMES - 3).unwrap();
    assert_eq!(film.stats().starts, 1);
    film.frame(0).unwrap();
    film.frame(5).unwrap();
    assert_eq!(film.stats(), DecodeStats { starts: 2, frames: FRAMES + 6 });
    film.frame(80).unwrap();
    assert_eq!(film.stats(), DecodeStats { starts: 3, frames: FRAMES + 7 });
}

#[test]
fn threads_may_ask_for_neighbours_out_of_order() {
    if !ffmpeg_is_there() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mov");
    let expected = make(&path, &MPEG4, true);
    let film = Film::open(&path, PixelFormat::Gray8, Ffmpeg::default()).unwrap();
    std::thread::scope(|scope| {
        for start in 0..4 {
            let (film, expected) = (&film, &expected);
            scope.spawn(move || {
                for index in (start..FRAMES).step_by(4) {
                    assert!(film.frame(index).unwrap().data() == expected[index]);
                }
            });
        }
    });
}

#[cfg(target_os = "linux")]
#[test]
fn a_film_that_is_dropped_leaves_no_process() {
    if !ffmpeg_is_there() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mov");
    // Large enough that FFmpeg is stopped by a full pipe, in the middle of the film.
    let pattern = format!("testsrc2=size=640x480:rate=30,trim=end_frame={FRAMES}");
    ffmpeg(&["-f", "lavfi", "-i", &pattern, "-c:v", "mpeg4", path.to_str().unwrap()]);
    let film = Film::open(&path, PixelFormat::Rgb8, Ffmpeg::default()).unwrap();
    film.frame(0).unwrap();
    let id = film.state.lock().unwrap().decoder.as_ref().unwrap().running.id();
    let process = Path::new("/proc").join(id.to_string());
    assert!(process.exists());
    drop(film);
    assert!(!process.exists(), "neither running nor waiting to be waited for");
}

#[test]
fn what_ffmpeg_says_is_passed_on() {
    if !ffmpeg_is_there() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mov");
    make(&path, &MPEG4, true);
    let whole = std::fs::read(&path).unwrap();
    let open = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Film::open(&path, PixelFormat::Gray8, Ffmpeg::default())
    };
    let text = open(b"this is no film, it is a text").unwrap_err();
    let cause = std::error::Error::source(&text).unwrap().to_string();
    assert!(cause.contains("FFmpeg says: ") && cause.contains("moov atom not found"), "{cause}");
    let cut = open(&whole[..whole.len() / 2]).unwrap_err().to_string();
    assert!(cut.contains("the film is cut off"), "{cut}");

    // The index is fine, the pictures are not.
    let mdat = whole.windows(4).position(|w| w == b"mdat").unwrap();
    let moov = whole.windows(4).position(|w| w == b"moov").unwrap();
    let mut damaged = whole.clone();
    damaged[mdat + 4..moov - 4].fill(0xff);
    let film = open(&damaged).unwrap();
    for index in [0, 5] {
        let error = film.frame(index).unwrap_err().to_string();
        assert!(error.contains(&format!("FFmpeg stops before frame {index} of 90: ")), "{error}");
        assert!(!error.contains("does not say why"), "{error}");
    }
    // Half of them: what comes before the damage is still there.
    let mut half = whole.clone();
    half[(mdat + moov) / 2..moov - 4].fill(0xff);
    let film = open(&half).unwrap();
    assert!(film.frame(3).is_ok());
}

#[test]
fn without_ffmpeg_a_film_is_still_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mov");
    if ffmpeg_is_there() {
        make(&path, &MPEG4, true);
        let film = Film::open(&path, PixelFormat::Gray8, Ffmpeg::new("no-such-ffmpeg")).unwrap();
        assert_eq!(film.frame_count(), FRAMES);
        let error = film.frame(0).unwrap_err().to_string();
        assert!(error.contains("is not installed") && error.contains("apt install ffmpeg"), "{error}");
    }
    std::fs::write(&path, b"text").unwrap();
    assert!(Film::open(&path, PixelFormat::Gray8, Ffmpeg::new("no-such-ffmpeg")).is_err());
}
