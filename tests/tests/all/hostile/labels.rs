//! Labels and tracks in files that unpack to much, or claim it.

use super::{Flight, crc32, refused, within_limits, zeros_packed};

/// An archive of one file, deflated, whose directory says what sizes it has.
fn zip(name: &str, deflated: &[u8], crc: u32, size: u32) -> Vec<u8> {
    let [packed, length] = [deflated.len() as u32, name.len() as u32];
    let common = [
        &[20, 0, 0, 0, 8, 0, 0, 0, 0, 0][..],
        &crc.to_le_bytes(),
        &packed.to_le_bytes(),
        &size.to_le_bytes(),
        &(length as u16).to_le_bytes(),
        &[0, 0],
    ]
    .concat();
    let local = [b"PK\x03\x04", &common[..], name.as_bytes(), deflated].concat();
    let central = [b"PK\x01\x02\x14\0", &common[..], &[0; 14], name.as_bytes()].concat();
    let end = [
        b"PK\x05\x06\0\0\0\0\x01\0\x01\0",
        &(central.len() as u32).to_le_bytes()[..],
        &(local.len() as u32).to_le_bytes(),
        &[0, 0],
    ]
    .concat();
    [local, central, end].concat()
}

fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data].concat()
}

fn converted(what: &str, name: &str, bytes: &[u8], words: &[&str]) {
    let flight = Flight::new();
    flight.write(name, bytes);
    let (file, out, run) = (flight.text(name), flight.text("out.json"), flight.text("run"));
    refused(what, &["labels", "convert", &file, &out, "--dataset", &run], &[&[name], words].concat());
    assert!(!flight.path("out.json").exists(), "{what}: labels were written");
}

#[test]
fn resources_of_arrays_of_numpy() {
    for shape in [
        "(5, 1000000000000, 2)",
        "(0, 1000000000000, 2)",
        "(1, 5, 4611686018427387904, 2)",
        "(18446744073709551615, 18446744073709551615, 2)",
    ] {
        converted(shape, "tracks.npy", &npy("<f4", shape, &[0; 40]), &["VICE_BUDGET"]);
    }
    converted(
        "a count that is cut off",
        "tracks.npy",
        &npy("<f4", "(5, 10000000, 2)", &[0; 40]),
        &["cut off"],
    );
    let huge = [b"\x93NUMPY\x02\0", &u32::MAX.to_le_bytes()[..], b"{'descr'"].concat();
    converted("a header of 4 GB", "tracks.npy", &huge, &[]);
}

#[test]
fn resources_of_archives_of_numpy() {
    let zeros = zeros_packed(1_000_000_000);
    assert!(zeros.len() < 8_000_000, "{}", zeros.len());
    // Deflate without zlib's head and sum; the check sum is looked at when all was unpacked.
    let deflated = &zeros[2..zeros.len() - 4];
    for size in [1_000_000_000, 40] {
        converted("an archive of a gigabyte", "tracks.npz", &zip("tracks.npy", deflated, 0, size), &[]);
    }
    let array = npy("<f4", "(5, 1, 2)", &[0; 40]);
    let stored =
        [&[1][..], &(array.len() as u16).to_le_bytes(), &(!(array.len() as u16)).to_le_bytes(), &array]
            .concat();
    let good = zip("tracks.npy", &stored, crc32(&array), array.len() as u32);
    // The archive itself is one: what is refused above is refused for what it holds.
    let flight = Flight::new();
    flight.write("tracks.npz", &good);
    let (file, out, run) = (flight.text("tracks.npz"), flight.text("out.json"), flight.text("run"));
    let ran = within_limits("a small archive", &["labels", "convert", &file, &out, "--dataset", &run]);
    assert_eq!(ran.run.code, 0, "{}", ran.run.stderr);
}

#[test]
fn resources_of_labels_with_holes_and_depth() {
    let flight = Flight::new();
    let run = flight.text("run");
    for (name, head) in [
        ("labels.csv", &b"point,timestamp_ns,u_px,v_px,keyframe\n"[..]),
        ("labels.parquet", b"PAR1"),
        ("labels.npy", b"\x93NUMPY\x01\0"),
    ] {
        let file = format!("sparse/{name}");
        flight.write_sparse(&file, head, 1 << 40);
        let (file, out) = (flight.text(&file), flight.text("out.json"));
        refused(name, &["labels", "convert", &file, &out, "--dataset", &run], &[name]);
    }
    let deep = |open: &str, close: &str| format!("{}{}", open.repeat(200_000), close.repeat(200_000));
    converted("nested JSON", "labels.json", format!("{{\"schema\": {}}}", deep("[", "]")).as_bytes(), &[]);
    let xml = format!("<annotations><track label=\"a\">{}</track></annotations>", deep("<b>", "</b>"));
    converted("nested XML", "labels.xml", xml.as_bytes(), &[]);
    let entities = "<!DOCTYPE a [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;\"><!ENTITY c \"&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;\">]><annotations>&c;</annotations>";
    converted("entities", "labels.xml", entities.as_bytes(), &[]);
    // A pickle that doubles a tuple 60 times: it stays one value that is referred to.
    let mut pickle = b"\x80\x02)".to_vec();
    for _ in 0..60 {
        pickle.extend(b"q\x00h\x00\x86");
    }
    pickle.push(b'.');
    converted("a pickle that doubles", "labels.pickle", &pickle, &[]);
    let claims = [&b"\x80\x04\x8e"[..], &u64::MAX.to_le_bytes(), b"x."].concat();
    converted("a pickle of 2^64 bytes", "labels.pickle", &claims, &["cut off"]);
}
