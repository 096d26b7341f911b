//! Films whose index promises more than there is.

use super::{Flight, refused, within_limits};

fn boxed(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    [&((content.len() + 8) as u32).to_be_bytes()[..], kind, content].concat()
}

fn words(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_be_bytes()).collect()
}

/// A film of 64 x 48 pixels whose frames all have one byte count, with as many as it claims.
fn film(frame_bytes: u32, frames: u32) -> Vec<u8> {
    let mut entry = vec![0; 70];
    entry[24..28].copy_from_slice(&[0, 64, 0, 48]);
    let stbl = [
        boxed(b"stsd", &[words(&[0, 1]), boxed(b"mp4v", &entry)].concat()),
        boxed(b"stts", &words(&[0, 1, frames, 10])),
        boxed(b"stsz", &words(&[0, frame_bytes, frames])),
    ]
    .concat();
    let handler = boxed(b"hdlr", &[&[0; 8], &b"vide"[..], &[0; 12]].concat());
    let mdhd = boxed(b"mdhd", &words(&[0, 0, 0, 100, 40, 0]));
    let minf = boxed(b"minf", &boxed(b"stbl", &stbl));
    let track = [boxed(b"tkhd", &[0; 84]), boxed(b"mdia", &[mdhd, handler, minf].concat())].concat();
    [boxed(b"ftyp", b"qt  "), boxed(b"moov", &boxed(b"trak", &track))].concat()
}

const DESCRIPTION: &str = "film = \"film.mov\"\nstamps = \"stamps.txt\"\n[camera]\nsize = [64, 48]\nintrinsics = [50.0, 50.0, 31.5, 23.5]\n";

fn flight(film: &[u8], length: u64) -> Flight {
    let flight = Flight::new();
    flight.write("film/vice-video.toml", DESCRIPTION.as_bytes());
    flight.write("film/stamps.txt", b"1700000000000000000\n1700000000050000000\n");
    flight.write_sparse("film/film.mov", film, length);
    flight
}

#[test]
fn resources_of_a_sparse_film_of_two_billion_frames() {
    // What follows the index is one box that goes on to the end of the file.
    let bytes = [film(12, 2_000_000_000), [0, 0, 0, 0].to_vec(), b"mdat".to_vec()].concat();
    let flight = flight(&bytes, 24_000_001_000);
    refused(
        "two billion frames",
        &["info", &flight.text("film")],
        &["film.mov", "2000000000 frames", "VICE_BUDGET"],
    );
}

#[test]
fn resources_of_films_within_the_budget() {
    let bytes = [film(12, 3_900_000), [0, 0, 0, 0].to_vec(), b"mdat".to_vec()].concat();
    let many = flight(&bytes, 47_000_000);
    let ran = within_limits("3.9 million frames", &["info", &many.text("film")]);
    assert!(ran.run.code != 0 && ran.run.stderr.contains("3900000"), "{}{}", ran.run.stdout, ran.run.stderr);
    // An index that is one hole.
    let bytes =
        [boxed(b"ftyp", b"qt  "), (3_000_000_000_u32).to_be_bytes().to_vec(), b"moov".to_vec()].concat();
    let hole = flight(&bytes, 4_000_000_000);
    refused(
        "an index of 3 GB",
        &["info", &hole.text("film")],
        &["film.mov", "bytes of an index", "VICE_BUDGET"],
    );
}
