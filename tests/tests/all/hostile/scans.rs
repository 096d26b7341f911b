//! Scans and models whose headers promise more than there is.

use super::{Flight, within_limits};

/// Fits the floor to a file of points, which must be refused in a line that names it.
fn fitted(what: &str, name: &str, bytes: &[u8], length: Option<u64>) {
    let flight = Flight::new();
    match length {
        Some(length) => flight.write_sparse(name, bytes, length),
        None => flight.write(name, bytes),
    }
    let (run, file) = (flight.text("run"), flight.text(name));
    let ran = within_limits(what, &["floor", "fit", &run, "--cloud", &file]);
    let errors: Vec<&str> = ran.run.stderr.lines().filter(|l| l.starts_with("error")).collect();
    assert!(
        ran.run.code != 0 && errors.len() == 1 && errors[0].contains(name),
        "{what}: {}{}",
        ran.run.stdout,
        ran.run.stderr
    );
}

#[test]
fn resources_of_ply_files() {
    let head = |element: &str, layout: &str| format!("ply\nformat {layout} 1.0\n{element}end_header\n");
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    for (what, text) in [
        ("points", head(&format!("element vertex 1000000000000000000\n{xyz}"), "binary_little_endian")),
        ("points as text", head(&format!("element vertex 1000000000000000000\n{xyz}"), "ascii")),
        (
            "an element without properties",
            head(
                &format!("element nothing 1000000000000000000\nelement vertex 3\n{xyz}"),
                "binary_little_endian",
            ),
        ),
        (
            "rows of text without properties",
            head(&format!("element nothing 1000000000000000000\nelement vertex 3\n{xyz}"), "ascii"),
        ),
        (
            "a list of 4 billion",
            head(&format!("element vertex 3\n{xyz}property list uint double w\n"), "binary_little_endian"),
        ),
    ] {
        let mut bytes = text.into_bytes();
        bytes.extend([0xff; 200]);
        fitted(what, "scan.ply", &bytes, None);
    }
}

#[test]
fn resources_of_pcd_files() {
    let head = |points: &str, data: &str| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA {data}\n"
        )
    };
    for data in ["ascii", "binary"] {
        fitted(data, "scan.pcd", head("1000000000000000000", data).as_bytes(), None);
    }
    // 4 GB that are announced in 200 bytes.
    let mut bytes = head("357913941", "binary_compressed").into_bytes();
    bytes.extend(100_u32.to_le_bytes());
    bytes.extend((357_913_941_u32 * 12).to_le_bytes());
    bytes.extend([0xff; 100]);
    fitted("binary_compressed", "scan.pcd", &bytes, None);
    // Fields that repeat 2^62 times.
    let many = head("3", "binary").replace("COUNT 1 1 1", "COUNT 1 1 4611686018427387904");
    fitted("a count of a field", "scan.pcd", many.as_bytes(), None);
}

/// The header of a LAS file of version 1.4, format 0, with a number of points and of the records that follow them.
fn las(points: u64, extended: (u64, u32), format: u8) -> Vec<u8> {
    let mut bytes = vec![0; 375];
    bytes[..4].copy_from_slice(b"LASF");
    (bytes[24], bytes[25]) = (1, 4);
    bytes[94..96].copy_from_slice(&375_u16.to_le_bytes());
    bytes[96..100].copy_from_slice(&375_u32.to_le_bytes());
    bytes[104] = format;
    bytes[105..107].copy_from_slice(&20_u16.to_le_bytes());
    for axis in 0..3 {
        bytes[131 + 8 * axis..139 + 8 * axis].copy_from_slice(&0.001_f64.to_le_bytes());
    }
    bytes[235..243].copy_from_slice(&extended.0.to_le_bytes());
    bytes[243..247].copy_from_slice(&extended.1.to_le_bytes());
    bytes[247..255].copy_from_slice(&points.to_le_bytes());
    bytes
}

#[test]
fn resources_of_las_files() {
    fitted("points", "scan.las", &las(1 << 60, (0, 0), 0), None);
    // A record of 2^40 bytes after the points.
    let mut bytes = las(1, (400, 1), 0);
    bytes.resize(400, 0);
    bytes.extend([0; 20]);
    bytes.extend((1_u64 << 40).to_le_bytes());
    bytes.extend([0; 32]);
    fitted("a record of a terabyte", "scan.las", &bytes, None);
    fitted("2^32 records", "scan.las", &las(1, (375, u32::MAX), 0), None);
    let mut records = las(1, (0, 0), 0);
    records[100..104].copy_from_slice(&u32::MAX.to_le_bytes());
    fitted("2^32 records before the points", "scan.las", &records, None);
    fitted("points that are not there", "scan.laz", &las(1 << 60, (0, 0), 0x80), None);
}

#[test]
fn resources_of_models_of_colmap() {
    let many = u64::MAX.to_le_bytes();
    for name in ["cameras.bin", "images.bin", "points3D.bin"] {
        let flight = Flight::new();
        for other in ["cameras.bin", "images.bin", "points3D.bin"] {
            flight.write(&format!("model/{other}"), &0_u64.to_le_bytes());
        }
        flight.write(&format!("model/{name}"), &[&many[..], &[0; 100]].concat());
        let ran = within_limits(name, &["info", &flight.text("model")]);
        assert!(
            ran.run.code != 0 && ran.run.stderr.contains("error"),
            "{name}: {}{}",
            ran.run.stdout,
            ran.run.stderr
        );
    }
}
