use super::*;
use proptest::prelude::*;

fn all(text: &str) -> Vec<(u64, Vec<String>)> {
    let mut rows = Rows::new(text.as_bytes());
    let mut found = Vec::new();
    while let Some(row) = rows.next_row().unwrap() {
        found.push((row.line(), (0..row.len()).map(|i| row.field(i).unwrap().to_string()).collect()));
    }
    found
}

#[test]
fn every_usual_separator_is_understood() {
    let expected = |line, fields: &[&str]| (line, fields.iter().map(ToString::to_string).collect::<Vec<_>>());
    assert_eq!(
        all("\u{feff}# head\r\n\r\n1 2\t 3\r\n  # more\n4, 5 ,6,\n7;8\n9"),
        [
            expected(3, &["1", "2", "3"]),
            expected(5, &["4", "5", "6"]),
            expected(6, &["7", "8"]),
            expected(7, &["9"]),
        ]
    );
    assert_eq!(all("1,,2"), [expected(1, &["1", "", "2"])]);
    assert!(all("").is_empty() && all("#\n\n \n").is_empty());
}

#[test]
fn numbers_are_taken_strictly() {
    let mut rows = Rows::new("1.5 nan inf x 1e400 1_000 -2e-3\n1,,3".as_bytes());
    let row = rows.next_row().unwrap().unwrap();
    assert_eq!((row.number(0).unwrap(), row.number(6).unwrap()), (1.5, -0.002));
    let says = |column, text: &str| {
        let error = row.number(column).unwrap_err().to_string();
        assert!(error.starts_with("line 1: ") && error.contains(text), "{error}");
    };
    says(1, "column 2: nan is not finite");
    says(2, "inf is not finite");
    says(3, "`x` is no number");
    says(4, "1e400 is not finite");
    says(5, "`1_000` is no number");
    says(7, "expected 8 columns, found 7");
    assert!(row.numbers::<2>(0).is_err());
    let row = rows.next_row().unwrap().unwrap();
    assert!(row.number(1).unwrap_err().to_string().contains("column 2 is empty"));
    let cut = row.expect_columns(4).unwrap_err().to_string();
    assert_eq!(cut, "line 2: expected 4 columns, found 3: the last row is cut off");
}

#[test]
fn stamps_are_exact_and_units_are_suspected() {
    let mut rows =
        Rows::new("1403715278.76214 1403715273262142976 1403715273262142 1403715273262 x".as_bytes());
    let row = rows.next_row().unwrap().unwrap();
    assert_eq!(row.seconds(0).unwrap().as_nanos(), 1_403_715_278_762_140_000);
    assert_eq!(row.nanos(1).unwrap().as_nanos(), 1_403_715_273_262_142_976);
    assert_eq!(row.micros(2).unwrap().as_nanos(), 1_403_715_273_262_142_000);
    let hint = |column| row.seconds(column).unwrap_err().to_string();
    assert!(hint(1).contains("nanoseconds") && hint(2).contains("microseconds"));
    let seconds = row.nanos(0).unwrap_err().to_string();
    assert!(seconds.contains("no whole number of nanoseconds"), "{seconds}");
    assert!(hint(3).contains("milliseconds") && hint(4).contains("`x` is no time stamp"));
}

#[test]
fn a_line_without_end_takes_no_memory() {
    let mut rows = Rows::new(BufReader::new(std::io::repeat(b'1')));
    assert!(rows.next_row().unwrap_err().to_string().contains("64 KiB"));
    let mut rows = Rows::new(&b"1 2\n\xff\xfe\n"[..]);
    assert!(rows.next_row().is_ok());
    assert!(rows.next_row().unwrap_err().to_string().contains("line 2: the line is not UTF-8"));
}

proptest! {
    #[test]
    fn any_bytes_are_rows_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut rows = Rows::new(&bytes[..]);
        while let Ok(Some(row)) = rows.next_row() {
            for i in 0..row.len() {
                let (_, _) = (row.number(i), row.seconds(i));
            }
        }
    }
}
