use proptest::prelude::*;

use super::*;

/// What a reader hands on.
#[derive(Default)]
struct Points {
    points: Vec<[f64; 3]>,
    singles: usize,
    promised: u64,
}

impl PointSink for Points {
    fn expect(&mut self, promised: u64, _: Option<u64>) -> DataResult<()> {
        self.promised = promised;
        Ok(())
    }

    fn single(&mut self, point: [f32; 3]) -> DataResult<()> {
        self.singles += 1;
        self.points.push(point.map(f64::from));
        Ok(())
    }

    fn double(&mut self, point: [f64; 3]) -> DataResult<()> {
        self.points.push(point);
        Ok(())
    }
}

fn read(bytes: &[u8]) -> DataResult<Points> {
    let mut points = Points::default();
    read_points(bytes, Some(bytes.len() as u64), &mut points)?;
    Ok(points)
}

fn head(fields: &str, sizes: &str, types: &str, counts: &str, points: usize, data: &str) -> Vec<u8> {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\n\
         WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n"
    )
    .into_bytes()
}

/// LZF as plain runs, and as repetitions of the byte before wherever four or more are equal.
fn pack(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        let same = bytes[i..].iter().take(264).take_while(|b| i > 0 && **b == bytes[i - 1]).count();
        if same >= 3 {
            let count = same - 2;
            match count < 7 {
                true => out.extend([(count << 5) as u8, 0]),
                false => out.extend([7 << 5, (count - 7) as u8, 0]),
            }
            i += same;
        } else {
            out.extend([0, bytes[i]]);
            i += 1;
        }
    }
    out
}

fn compressed(points: &[[f32; 3]]) -> Vec<u8> {
    // A field before and one behind the coordinates.
    let mut columns = vec![7_u8; 2 * points.len()];
    for axis in 0..3 {
        points.iter().for_each(|p| columns.extend(p[axis].to_le_bytes()));
    }
    columns.extend(vec![1_u8; 4 * points.len()]);
    let packed = pack(&columns);
    let mut file =
        head("label x y z rgb", "2 4 4 4 4", "U F F F F", "1 1 1 1 1", points.len(), "binary_compressed");
    file.extend((packed.len() as u32).to_le_bytes());
    file.extend((columns.len() as u32).to_le_bytes());
    file.extend(packed);
    file
}

#[test]
fn fields_are_found_by_their_names_in_every_form() {
    let expected = vec![[1.0, 2.5, -3.0], [4.0, 5.0, 6.25]];
    let mut text = head("z rgb y normal x", "4 4 4 4 4", "F U F F F", "1 1 1 3 1", 2, "ascii");
    text.extend(b"-3 4278190080 2.5 0 0 1 1\n\n6.25 4278190080 5.0 0 0 1 4e0\n");
    assert_eq!(read(&text).unwrap().points, expected);
    let mut binary = head("intensity x y z", "2 8 4 2", "U F F I", "1 1 1 1", 2, "binary");
    for (x, y, z) in [(1.0_f64, 2.5_f32, -3_i16), (4.0, 5.0, 6)] {
        binary.extend(9_u16.to_le_bytes());
        binary.extend(x.to_le_bytes());
        binary.extend(y.to_le_bytes());
        binary.extend(z.to_le_bytes());
    }
    assert_eq!(read(&binary).unwrap().points, [[1.0, 2.5, -3.0], [4.0, 5.0, 6.0]]);
    let found = read(&compressed(&[[1.0, 2.5, -3.0], [4.0, 5.0, 6.25]])).unwrap();
    assert_eq!((found.points, found.singles, found.promised), (expected, 2, 2));
}

#[test]
fn a_text_with_the_coordinates_of_a_map_keeps_its_digits() {
    let mut text = head("x y z", "4 4 4", "F F F", "1 1 1", 2, "ascii");
    text.extend(b"461234.125 5428765.031 312.5\nnan nan nan\n");
    let found = read(&text).unwrap();
    assert_eq!((found.points[0], found.singles), ([461_234.125, 5_428_765.031, 312.5], 0));
    assert!(found.points[1][0].is_nan());
}

#[test]
fn what_is_no_pcd_is_refused_with_its_place() {
    let says = |bytes: &[u8], expected: &str| {
        let error = read(bytes).map(|p| p.points).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    says(b"# .PCD v0.7\nVERSION 0.7\n", "no line DATA");
    says(b"# .PCD v0.7\nVERSION 0.7\nSHAPE 3\n", "`SHAPE` is no line of a PCD header");
    says(&head("x y", "4 4", "F F", "1 1", 1, "ascii"), "no fields x, y and z");
    says(&head("x y z", "4 4", "F F F", "1 1 1", 1, "ascii"), "have 3, 2, 3 and 3 entries");
    says(&head("x y z", "3 4 4", "F F F", "1 1 1", 1, "ascii"), "the field x has TYPE F and SIZE 3");
    says(&head("x y z", "4 4 4", "F F F", "2 1 1", 1, "ascii"), "the field x has COUNT 2");
    says(&head("x y z", "4 4 4", "F F F", "1 1 1", 1, "zstd"), "DATA zstd is not known");
    says(&head("x y z", "4 4 4", "F F F", "1 1 1", 3, "binary"), "the file ends after 0 of 3 points");
    let mut text = head("x y z", "4 4 4", "F F F", "1 1 1", 2, "ascii");
    text.extend(b"1 2 3\n1 2\n");
    says(&text, "the row has 2 numbers, not 3");
    text.truncate(text.len() - 4);
    says(&text, "the file ends after 1 of 2 points");
    let contradictory = String::from_utf8(head("x y z", "4 4 4", "F F F", "1 1 1", 2, "ascii")).unwrap();
    says(contradictory.replace("POINTS 2", "POINTS 3").as_bytes(), "POINTS 3 is not WIDTH times HEIGHT, 2");
    let whole = compressed(&[[1.0, 2.0, 3.0]; 500]);
    let start = whole.len() - 200;
    for length in [start, whole.len() - 1] {
        assert!(read(&whole[..length]).is_err());
    }
    let mut early = head("x y z", "4 4 4", "F F F", "1 1 1", 1, "binary_compressed");
    early.extend(3_u32.to_le_bytes());
    early.extend(12_u32.to_le_bytes());
    early.extend([0xe0, 1, 9]);
    says(&early, "repeat bytes from before their start");
    let size = early.len() - 7;
    early[size..size + 4].copy_from_slice(&13_u32.to_le_bytes());
    says(&early, "the compressed points are 13 bytes, and 1 points are 12");
}

proptest! {
    #[test]
    fn compressed_points_come_back(points in prop::collection::vec(prop::array::uniform3(-9.0..9.0_f32), 1..3000), flat in 0..3_usize) {
        let points: Vec<[f32; 3]> = points.into_iter().map(|mut p| { p[flat] = 0.5; p }).collect();
        let found = read(&compressed(&points)).unwrap();
        prop_assert_eq!(found.points, points.iter().map(|p| p.map(f64::from)).collect::<Vec<_>>());
    }

    #[test]
    fn bytes_that_are_none_are_an_error_or_points(mut tail in prop::collection::vec(any::<u8>(), 0..400), n in 0..40_usize) {
        let mut file = head("x y z", "4 4 4", "F F F", "1 1 1", n, "binary_compressed");
        file.extend((tail.len() as u32).to_le_bytes());
        file.extend((12 * n as u32).to_le_bytes());
        file.append(&mut tail);
        let _ = read(&file);
    }
}
