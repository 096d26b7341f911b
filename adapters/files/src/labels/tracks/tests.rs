use super::*;
use std::io::Write;

fn npy(code: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let mut header = format!("{{'descr': '{code}', 'fortran_order': {order}, 'shape': {shape}, }}");
    header.push_str(&" ".repeat((64 - (11 + header.len()) % 64) % 64));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn npz(arrays: &[(&str, Vec<u8>)], method: zip::CompressionMethod) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    for (name, bytes) in arrays {
        writer.start_file(format!("{name}.npy"), options).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn stamps(count: i64) -> Vec<Stamp> {
    (0..count).map(|i| Stamp::from_nanos(1_000 + i)).collect()
}

/// Three frames of two points.
const PLACES: [f32; 12] = [10.0, 20.0, 30.0, 40.0, 11.0, 21.0, 31.0, 41.0, 12.0, 22.0, 32.0, 42.0];

fn read(bytes: &[u8], frames: i64, options: &TracksOptions<'_>) -> DataResult<(LabelSet, usize)> {
    read_tracks(bytes, &stamps(frames), [100, 80], options)
}

fn places(labels: &LabelSet, point: usize) -> Vec<(i64, f64, f64, bool)> {
    let of = &labels.points()[point].observations;
    of.iter().map(|o| (o.stamp.as_nanos() - 1_000, o.px.u, o.px.v, o.keyframe)).collect()
}

#[test]
fn an_array_alone_is_read_in_either_order() {
    let bytes = npy("<f4", false, "(3, 2, 2)", &floats(&PLACES));
    assert!(is_tracks(&bytes));
    let (labels, outside) =
        read(&bytes, 3, &TracksOptions { tool: Some("CoTracker3"), ..Default::default() }).unwrap();
    assert_eq!((labels.points().len(), outside, labels.tool.as_deref()), (2, 0, Some("CoTracker3")));
    assert_eq!(places(&labels, 0), [(0, 10.0, 20.0, true), (1, 11.0, 21.0, false), (2, 12.0, 22.0, false)]);
    assert_eq!(places(&labels, 1)[2], (2, 32.0, 42.0, false));
    assert_eq!(labels.points()[0].observations.first().unwrap().source, ObservationSource::Auto);
    // TAPIR: points first, and (0, 0) is a corner.
    let turned = [10.0, 20.0, 11.0, 21.0, 12.0, 22.0, 30.0, 40.0, 31.0, 41.0, 32.0, 42.0];
    let bytes = npy("<f4", false, "(2, 3, 2)", &floats(&turned));
    let (labels, _) = read(&bytes, 3, &TracksOptions { from_corner: true, ..Default::default() }).unwrap();
    assert_eq!(places(&labels, 1)[1], (1, 30.5, 40.5, false));
    // Fortran's order.
    let fortran: Vec<f32> = (0..12).map(|i| PLACES[(i % 3) * 4 + (i / 3 % 2) * 2 + i / 6]).collect();
    let (same, _) = read(&npy("<f4", true, "(3, 2, 2)", &floats(&fortran)), 3, &Default::default()).unwrap();
    assert_eq!(places(&same, 1)[2], (2, 32.0, 42.0, false));
}

#[test]
fn an_archive_says_what_is_seen_and_a_point_is_one_segment() {
    for method in [zip::CompressionMethod::Stored, zip::CompressionMethod::Deflated] {
        let seen = npy("|b1", false, "(1, 3, 2)", &[0, 1, 1, 0, 1, 1]);
        let names = npy("<U3", false, "(2,)", &[0; 24]);
        let tracks = npy("<f4", false, "(1, 3, 2, 2)", &floats(&PLACES));
        let bytes = npz(&[("names", names), ("pred_tracks", tracks), ("pred_visibility", seen)], method);
        let (labels, _) = read(&bytes, 3, &Default::default()).unwrap();
        assert_eq!(places(&labels, 0), [(1, 11.0, 21.0, true), (2, 12.0, 22.0, false)]);
        assert_eq!(places(&labels, 1), [(0, 30.0, 40.0, true), (2, 32.0, 42.0, false)]);
    }
    let tracks = npy("<f4", false, "(3, 2, 2)", &floats(&PLACES));
    let hidden = npy("<f4", false, "(3, 2)", &floats(&[1.0, 0.0, 0.2, 0.0, 0.0, 0.9]));
    let bytes = npz(&[("tracks", tracks), ("occluded", hidden)], zip::CompressionMethod::Stored);
    let (labels, _) = read(&bytes, 3, &Default::default()).unwrap();
    assert_eq!((places(&labels, 0).len(), places(&labels, 1).len()), (2, 2));
}

#[test]
fn places_of_smaller_pictures_and_outside_are_told() {
    let bytes = npy("<f4", false, "(3, 2, 2)", &floats(&PLACES));
    let options = TracksOptions { size_px: Some([50, 40]), ..Default::default() };
    let (labels, outside) = read(&bytes, 3, &options).unwrap();
    // The centre of the image stays the centre.
    assert_eq!(places(&labels, 0)[0], (0, 20.5, 40.5, true));
    assert_eq!(outside, 3, "the second point is below the image");
    assert_eq!(labels.points().len(), 1);
}

#[test]
fn what_does_not_fit_is_refused() {
    let bytes = npy("<f4", false, "(3, 2, 2)", &floats(&PLACES));
    let error = read(&bytes, 7, &Default::default()).unwrap_err().to_string();
    assert!(
        error.contains("3 frames") && error.contains("7 were asked for") && error.contains("`fps`"),
        "{error}"
    );
    let cut = read(&bytes[..bytes.len() - 4], 3, &Default::default()).unwrap_err().to_string();
    assert!(cut.contains("cut off"), "{cut}");
    let flat = npy("<f4", false, "(12,)", &floats(&PLACES));
    assert!(read(&flat, 3, &Default::default()).unwrap_err().to_string().contains("not (frames, points, 2)"));
    let huge = npy("<f8", false, "(99999999, 99999999, 2)", &[]);
    assert!(read(&huge, 3, &Default::default()).unwrap_err().to_string().contains("above the budget"));
    let other = npz(&[("flow", bytes.clone())], zip::CompressionMethod::Stored);
    assert!(read(&other, 3, &Default::default()).unwrap_err().to_string().contains("it has flow"));
    let seen = npy("|b1", false, "(4, 2)", &[1; 8]);
    let wrong = npz(&[("tracks", bytes), ("visibility", seen)], zip::CompressionMethod::Stored);
    assert!(read(&wrong, 3, &Default::default()).unwrap_err().to_string().contains("[4, 2]"));
    let objects = npy("|O", false, "(3, 2, 2)", &[0; 96]);
    assert!(read(&objects, 3, &Default::default()).unwrap_err().to_string().contains("float32"));
    let unseen = npy("<f4", false, "(3, 1, 2)", &floats(&[f32::NAN; 6]));
    assert!(read(&unseen, 3, &Default::default()).unwrap_err().to_string().contains("no point is seen"));
}
