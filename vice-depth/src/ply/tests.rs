use super::*;
use proptest::prelude::*;

/// Points of a file as they come.
#[derive(Debug, Default, PartialEq)]
struct Points {
    single: Vec<[f32; 3]>,
    double: Vec<[f64; 3]>,
    expected: Option<(u64, Option<u64>)>,
}

impl PointSink for Points {
    fn expect(&mut self, promised: u64, at_most: Option<u64>) -> DataResult<()> {
        self.expected = Some((promised, at_most));
        Ok(())
    }
    fn single(&mut self, point: [f32; 3]) -> DataResult<()> {
        self.single.push(point);
        Ok(())
    }
    fn double(&mut self, point: [f64; 3]) -> DataResult<()> {
        self.double.push(point);
        Ok(())
    }
}

fn read(bytes: &[u8]) -> Result<Points, String> {
    let mut points = Points::default();
    points_from(bytes, Some(bytes.len() as u64), &mut points).map_err(|e| e.to_string())?;
    Ok(points)
}

fn file(header: &str, rows: &[u8]) -> Vec<u8> {
    [format!("ply\n{header}\nend_header\n").as_bytes(), rows].concat()
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z";

#[test]
fn text_in_any_order_of_columns() {
    let header = "format ascii 1.0\nelement junk 2\nproperty int a\nelement vertex 3\nproperty double z\n\
        property uchar red\nproperty double x\nproperty double y";
    let points = read(&file(header, b"7\n\n8 \n3 255 1e0 2.\r\n  nan 0 -inf .5\n\n6 1 4 5")).unwrap();
    assert_eq!(points.double[0], [1.0, 2.0, 3.0]);
    assert!(points.double[1][2].is_nan() && points.double[1][0] == f64::NEG_INFINITY);
    assert_eq!((points.double[2], points.double.len()), ([4.0, 5.0, 6.0], 3));
}

#[test]
fn lists_beside_the_coordinates() {
    let lists = "property list uchar short neighbours\nproperty float x\nproperty float y\n\
        property list int double w\nproperty float z";
    let text = read(&file(
        &format!("format ascii 1.0\nelement vertex 2\n{lists}"),
        b"2 7 8 1 2 0 3\n0 4 5 1 0.5 6\n",
    ));
    assert_eq!(text.unwrap().single, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    let mut rows = Vec::new();
    for (n, p) in [(2_u8, [1.0_f32, 2.0, 3.0]), (0, [4.0, 5.0, 6.0])] {
        rows.push(n);
        rows.extend(vec![1; 2 * usize::from(n)]);
        rows.extend([p[0].to_be_bytes(), p[1].to_be_bytes()].concat());
        rows.extend(1_i32.to_be_bytes());
        rows.extend(0.5_f64.to_be_bytes());
        rows.extend(p[2].to_be_bytes());
    }
    let big = read(&file(&format!("format binary_big_endian 1.0\nelement vertex 2\n{lists}"), &rows));
    assert_eq!(big.unwrap().single, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
}

#[test]
fn faces_name_their_corners() {
    let header = format!(
        "format ascii 1.0\nelement vertex 3\n{XYZ}\nelement face 2\nproperty list uchar int vertex_index"
    );
    let bytes = file(&header, b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n4 0 1 2 9\n");
    let (mut points, mut faces) = (Points::default(), Vec::new());
    let mut keep = |face: &[i64]| {
        faces.push(face.to_vec());
        Ok(())
    };
    mesh_from(&bytes[..], None, &mut points, &mut keep).unwrap();
    assert_eq!((points.single.len(), faces), (3, vec![vec![0, 1, 2], vec![0, 1, 2, 9]]));
    let none = |header: &str| {
        let bytes = file(header, b"");
        mesh_from(&bytes[..], None, &mut Points::default(), |_| Ok(())).unwrap_err().to_string()
    };
    assert!(
        none(&format!("format ascii 1.0\nelement vertex 0\n{XYZ}"))
            .contains("no element `face` (it has vertex)")
    );
    let floats = format!(
        "format ascii 1.0\nelement vertex 0\n{XYZ}\nelement face 0\nproperty list uchar float vertex_index"
    );
    assert!(none(&floats).contains("not a list of integers"));
    assert!(none(&floats.replace("vertex_index", "colours")).contains("no list `vertex_indices`"));
}

#[test]
fn promises_that_the_file_does_not_keep() {
    let little = |count: u64, rows: &[u8]| {
        read(&file(&format!("format binary_little_endian 1.0\nelement vertex {count}\n{XYZ}"), rows))
    };
    let huge = little(1_000_000_000_000_000_000, &[0; 40]).unwrap_err();
    assert!(huge.contains("promises 1000000000000000000 rows of `vertex`, the file ends after 3"), "{huge}");
    assert!(little(4, &[0; 40]).unwrap_err().starts_with("byte "));
    assert_eq!(little(3, &[0; 40]).unwrap().single.len(), 3, "what follows is not looked at");
    let ascii = |count: u64, rows: &[u8]| {
        read(&file(&format!("format ascii 1.0\nelement vertex {count}\n{XYZ}"), rows)).unwrap_err()
    };
    assert_eq!(
        ascii(3, b"1 2 3\n4 5 6\n"),
        "line 9: the header promises 3 rows of `vertex`, the file ends after 2 (it was cut off, or its header is wrong)"
    );
    assert_eq!(ascii(2, b"1 2 3\n4 five 6\n"), "line 9: no number for `y` of a `vertex` in `4 five 6`");
    assert_eq!(ascii(2, b"1 2\n4 5 6\n"), "line 8: no number for `z` of a `vertex` in `1 2`");
    assert_eq!(ascii(2, b"1 2 3 4\n"), "line 8: more than the 3 numbers of a `vertex` in `1 2 3 4`");
    // Elements in front may not hide the end either, and a list may claim four thousand million entries.
    let before = |element: &str, rows: &[u8]| {
        read(&file(
            &format!("format binary_little_endian 1.0\nelement a 9\n{element}\nelement vertex 1\n{XYZ}"),
            rows,
        ))
        .unwrap_err()
    };
    assert!(before("property double b", &[0; 20]).contains("promises 9 rows of `a`, the file ends after 2"));
    assert!(
        before("property list uint float b", &[255; 40])
            .contains("promises 9 rows of `a`, the file ends after 0")
    );
    assert!(before("property list int float b", &[255; 40]).contains("row 0 of `a`: "));
}

#[test]
fn coordinates_that_are_not_there() {
    let error = |properties: &str| {
        read(&file(&format!("format ascii 1.0\nelement vertex 1\n{properties}"), b"1 2 3\n")).unwrap_err()
    };
    assert_eq!(error("property float x\nproperty float y"), "`vertex` has no property `z` (it has x, y)");
    assert_eq!(
        error(&XYZ.replace("float y", "list uchar float y")),
        "`y` of `vertex` is a list, not a number"
    );
    assert_eq!(
        read(&file("format ascii 1.0", b"")).unwrap_err(),
        "the PLY file has no element `vertex` (it has none)"
    );
    let folder = tempfile::tempdir().unwrap();
    let error = read_points(folder.path(), &mut Points::default()).unwrap_err().to_string();
    assert!(error.ends_with("is a folder, not a file of points"), "{error}");
    let error = read_points(&folder.path().join("gone.ply"), &mut Points::default()).unwrap_err().to_string();
    assert!(error.ends_with("gone.ply: cannot be opened"), "{error}");
}

/// A type with a number that it holds exactly.
fn scalar() -> impl Strategy<Value = (&'static str, f64)> {
    prop_oneof![
        any::<i8>().prop_map(|v| ("char", v.into())),
        any::<u8>().prop_map(|v| ("uint8", v.into())),
        any::<i16>().prop_map(|v| ("short", v.into())),
        any::<u16>().prop_map(|v| ("ushort", v.into())),
        any::<i32>().prop_map(|v| ("int32", v.into())),
        any::<u32>().prop_map(|v| ("uint", v.into())),
        (-1e9_f32..1e9).prop_map(|v| ("float32", v.into())),
        (-1e9_f64..1e9).prop_map(|v| ("double", v)),
    ]
}

fn bytes_of(name: &str, value: f64) -> Vec<u8> {
    match name {
        "char" => (value as i8).to_le_bytes().to_vec(),
        "uint8" => (value as u8).to_le_bytes().to_vec(),
        "short" => (value as i16).to_le_bytes().to_vec(),
        "ushort" => (value as u16).to_le_bytes().to_vec(),
        "int32" => (value as i32).to_le_bytes().to_vec(),
        "uint" => (value as u32).to_le_bytes().to_vec(),
        "float32" => (value as f32).to_le_bytes().to_vec(),
        _ => value.to_le_bytes().to_vec(),
    }
}

proptest! {
    #[test]
    fn any_types_in_any_order_and_encoding(
        columns in prop::collection::vec(scalar(), 3..7),
        at in any::<prop::sample::Index>(),
        rows in 1_usize..40_000,
    ) {
        // x, y and z are three columns in a row somewhere, in that order turned around.
        let first = at.index(columns.len() - 2);
        let names: Vec<String> = (0..columns.len()).map(|i| match i.wrapping_sub(first) {
            j @ 0..3 => ["z", "x", "y"][j].to_string(),
            _ => format!("other{i}"),
        }).collect();
        let [z, x, y] = [0, 1, 2].map(|i| columns[first + i].1);
        let properties: Vec<String> =
            columns.iter().zip(&names).map(|((kind, _), name)| format!("property {kind} {name}")).collect();
        let rows = if rows % 3 == 0 { rows } else { rows % 17 + 1 };
        for (layout, big) in [("ascii", false), ("binary_little_endian", false), ("binary_big_endian", true)] {
            let header = format!("format {layout} 1.0\nelement vertex {rows}\n{}", properties.join("\n"));
            let row: Vec<u8> = if layout == "ascii" {
                let words: Vec<String> = columns.iter().map(|(_, v)| v.to_string()).collect();
                format!("{}\n", words.join(" ")).into_bytes()
            } else {
                columns.iter().flat_map(|(kind, v)| {
                    let mut bytes = bytes_of(kind, *v);
                    if big { bytes.reverse(); }
                    bytes
                }).collect()
            };
            let points = read(&file(&header, &row.repeat(rows))).unwrap();
            let single = columns[first..first + 3].iter().all(|c| c.0 == "float32");
            prop_assert_eq!(points.single.len() + points.double.len(), rows);
            prop_assert!(points.single.iter().all(|p| single && *p == [x, y, z].map(|v| v as f32)));
            prop_assert!(points.double.iter().all(|p| !single && *p == [x, y, z]));
        }
    }

    #[test]
    fn no_bytes_make_it_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..300), cut in 0_usize..400, layout in 0_usize..3) {
        let layout = ["ascii", "binary_little_endian", "binary_big_endian"][layout];
        let header = format!("format {layout} 1.0\nelement a 2\nproperty list char short l\nelement vertex 9\nproperty list uint float m\n{XYZ}");
        let mut whole = file(&header, b"");
        whole.append(&mut bytes);
        whole.truncate(whole.len().saturating_sub(cut));
        let _ = read(&whole);
    }
}

#[test]
fn byte_order_marks_are_passed_over_where_a_line_starts() {
    let header = format!("format ascii 1.0\nelement vertex 2\n{XYZ}");
    let rows: [[f32; 3]; 2] = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    let mark = "\u{feff}";
    for text in [
        format!("{mark}ply\n{header}\nend_header\n1 2 3\n4 5 6\n"),
        format!("ply\n{header}\nend_header\n{mark}1 2 3\n4 5 6\n"),
        format!("{mark}ply\n{mark}{header}\n{mark}end_header\n{mark}1 2 3\n\n{mark}4 5 6"),
    ] {
        assert_eq!(read(text.as_bytes()).unwrap().single, rows, "{text:?}");
    }
    // Rows that are skipped, rows with lists, and rows of binary numbers behind a marked header.
    let skipped = format!(
        "ply\nformat ascii 1.0\nelement junk 1\nproperty int a\nelement vertex 2\n{XYZ}\nend_header\n{mark}7\n{mark}1 2 3\n4 5 6\n"
    );
    assert_eq!(read(skipped.as_bytes()).unwrap().single, rows);
    let lists = format!(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty list uchar int n\n{XYZ}\nend_header\n{mark}0 1 2 3\n{mark}1 9 4 5 6\n"
    );
    assert_eq!(read(lists.as_bytes()).unwrap().single, rows);
    let mut binary =
        format!("{mark}ply\nformat binary_little_endian 1.0\nelement vertex 2\n{XYZ}\nend_header\n")
            .into_bytes();
    binary.extend(rows.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    assert_eq!(read(&binary).unwrap().single, rows);
}
