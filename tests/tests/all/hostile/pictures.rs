//! Pictures that are larger than they look.

use super::{Flight, STAMPS, crc32, within_limits, zeros_packed};

fn png_chunk(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let named = [&kind[..], content].concat();
    [&(content.len() as u32).to_be_bytes()[..], &named, &crc32(&named).to_be_bytes()].concat()
}

/// A black PNG of eight bits gray, made without holding its pixels.
fn black_png(width: u32, height: u32) -> Vec<u8> {
    let head = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let pixels = zeros_packed(u64::from(height) * (u64::from(width) + 1));
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        png_chunk(b"IHDR", &head),
        png_chunk(b"IDAT", &pixels),
        png_chunk(b"IEND", b""),
    ]
    .concat()
}

/// A gray JPEG whose pixels end right after its head, which says its size: in one pass, or in several.
fn jpeg_head(width: u16, height: u16, in_passes: bool) -> Vec<u8> {
    let frame = if in_passes { 0xc2 } else { 0xc0 };
    let [h, w] = [height, width].map(u16::to_be_bytes);
    let mut bytes = vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0];
    bytes.extend([1; 64]);
    bytes.extend([0xff, frame, 0, 17, 8, h[0], h[1], w[0], w[1], 3, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0]);
    // One code of one bit for the first coefficient, one for the others.
    for class in [0, 0x10] {
        bytes.extend([0xff, 0xc4, 0, 20, class, 1]);
        bytes.extend([0; 16]);
    }
    let last = if in_passes { 0 } else { 63 };
    bytes.extend([0xff, 0xda, 0, 12, 3, 1, 0, 2, 0, 3, 0, 0, last, 0]);
    bytes.extend([0; 4000]);
    bytes.extend([0xff, 0xd9]);
    bytes
}

/// Has a command decode the pictures of a flight, and holds what it says against some words.
fn looked_at(what: &str, flight: &Flight, words: &[&str]) {
    let (run, out) = (flight.text("run"), flight.text("labels.json"));
    let ran = within_limits(what, &["labels", "detect", &run, "--chessboard", "6x7", "--out", &out]);
    let said = format!("{}{}", ran.run.stdout, ran.run.stderr);
    for word in words {
        assert!(said.contains(word), "{what}: `{word}` is not in: {said}");
    }
}

fn of_pictures(what: &str, picture: &[u8], words: &[&str]) {
    let flight = Flight::new();
    for stamp in STAMPS {
        flight.write(&format!("run/mav0/cam0/data/{stamp}.png"), picture);
    }
    looked_at(what, &flight, words);
}

#[test]
fn resources_of_a_picture_of_32000_by_30000() {
    of_pictures("a PNG of 960 million pixels", &black_png(32_000, 30_000), &["32000x30000"]);
}

#[test]
fn resources_of_pictures_that_claim_much() {
    let mut cut = black_png(752, 480);
    cut.truncate(60);
    of_pictures("a PNG that is cut off", &cut, &[".png"]);
    of_pictures("the sides of a PNG", &black_png(2_000_000_000, 1)[..4000], &[".png"]);
    for in_passes in [false, true] {
        let what = format!("a JPEG of 4 billion pixels, in passes: {in_passes}");
        of_pictures(&what, &jpeg_head(65_500, 65_500, in_passes), &["65500x65500"]);
        let what = format!("a JPEG of 32 million pixels, in passes: {in_passes}");
        of_pictures(&what, &jpeg_head(6_000, 5_300, in_passes), &[".png"]);
    }
    // As large as is decoded at all, of another size than the calibration.
    of_pictures("a PNG of 90 million pixels", &black_png(9_400, 9_600), &["9400x9600", "752x480"]);
}

#[test]
fn resources_of_a_picture_with_a_hole() {
    let flight = Flight::new();
    for stamp in STAMPS {
        flight.write_sparse(&format!("run/mav0/cam0/data/{stamp}.png"), b"\x89PNG\r\n\x1a\n", 1 << 40);
    }
    looked_at("a picture of a terabyte", &flight, &["1099511627776 bytes of a picture", "VICE_BUDGET"]);
}

#[test]
fn resources_of_the_size_in_a_calibration() {
    let flight = Flight::new();
    let sensor = super::SENSOR.replace("[752, 480]", "[2000000000, 2000000000]");
    flight.write("run/mav0/cam0/sensor.yaml", sensor.as_bytes());
    let (run, labels) = (flight.text("run"), flight.text("labels.csv"));
    within_limits("info", &["info", &run]);
    within_limits(
        "evaluate",
        &["evaluate", &run, "--labels", &labels, "--estimate", "ground-truth", "--reference", "none"],
    );
}
