use std::fs::{self, File};
use std::path::PathBuf;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical};
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type,
};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use proptest::prelude::*;
use vice_core::camera::Pixel;
use vice_core::label::{LabelRow, LabelSet, Observation};
use vice_core::time::Stamp;

use super::super::tests::any_labels;
use super::super::{LabelFile, read_file, read_points, write};
use crate::atomic::Overwrite;

fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("labels.parquet");
    (folder, path)
}

/// Labels of some points at 20 Hz, a key frame each 50.
fn many(points: usize, labels: usize) -> LabelSet {
    let rows = (0..points).flat_map(|p| {
        (0..labels).map(move |i| {
            let px = Pixel::new(1.0 + i as f64 * 0.125, p as f64 + 0.1);
            let mut observation = Observation::manual(Stamp::from_nanos(50_000_000 * i as i64), px);
            observation.keyframe = i % 50 == 0;
            LabelRow { point: format!("p{p}"), observation }
        })
    });
    LabelSet::from_rows(rows).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn everything_is_kept_to_the_last_bit(
        mut labels in any_labels(), dataset in prop::option::of("\\PC*"), camera in prop::option::of("\\PC+"),
    ) {
        (labels.dataset, labels.camera) = (dataset, camera);
        let (_folder, path) = folder();
        write(&path, &labels, Overwrite::Refuse).unwrap();
        let first = fs::read(&path).unwrap();
        let read = read_file(&path, None).unwrap();
        prop_assert_eq!(&read.labels, &labels);
        prop_assert!(read.suspicions.is_empty());
        write(&path, &read.labels, Overwrite::Replace).unwrap();
        prop_assert!(fs::read(&path).unwrap() == first, "the same labels are the same bytes");
    }

    #[test]
    fn no_damage_is_worse_than_an_error(at in 0.0..1.0_f64, value in any::<u8>(), cut in 0.0..1.0_f64) {
        let (_folder, path) = folder();
        write(&path, &many(3, 60), Overwrite::Refuse).unwrap();
        let mut bytes = fs::read(&path).unwrap();
        let place = (at * bytes.len() as f64) as usize % bytes.len();
        bytes[place] ^= value;
        bytes.truncate(bytes.len() - (cut * cut * cut * bytes.len() as f64) as usize);
        fs::write(&path, &bytes).unwrap();
        if let Err(error) = read_file(&path, None) {
            let error = error.to_string();
            prop_assert!(!error.contains('\n') && error.contains("labels.parquet"), "{}", error);
        }
    }
}

#[test]
fn large_points_have_row_groups_of_their_own_and_small_ones_share() {
    for (points, labels, groups) in [(3, 20_000, 3), (200, 100, 2), (1, 1, 1)] {
        let (_folder, path) = folder();
        let all = many(points, labels);
        write(&path, &all, Overwrite::Refuse).unwrap();
        let file = File::open(&path).unwrap();
        let reader = parquet::file::reader::SerializedFileReader::new(file).unwrap();
        assert_eq!(parquet::file::reader::FileReader::num_row_groups(&reader), groups);
        assert_eq!(read_file(&path, None).unwrap().labels, all);
        let chosen = ["p0".to_string()];
        let some = read_points(&path, None, &chosen).unwrap().labels;
        assert_eq!(some, all.select(&chosen).unwrap());
        // Whoever asks for a point that is not there is told of all.
        let other = ["p0".to_string(), "q".to_string()];
        assert_eq!(read_points(&path, None, &other).unwrap().labels, all);
    }
}

/// A column as other programs write it.
enum Written {
    Text(Vec<Option<&'static str>>),
    Double(Vec<Option<f64>>),
    Float(Vec<f32>),
    Whole(Vec<Option<i64>>),
    Short(Vec<i32>),
    Flag(Vec<bool>),
    Stamps(TimeUnit, Vec<i64>),
}

/// A file of these columns, by name.
fn written(path: &PathBuf, columns: &[(&str, Written)]) {
    let described = |(name, column): &(&str, Written)| {
        let (physical, logical, repetition) = match column {
            Written::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::OPTIONAL),
            Written::Double(_) => (Physical::DOUBLE, None, Repetition::OPTIONAL),
            Written::Float(_) => (Physical::FLOAT, None, Repetition::REQUIRED),
            Written::Whole(_) => (Physical::INT64, None, Repetition::OPTIONAL),
            Written::Short(_) => (Physical::INT32, None, Repetition::REQUIRED),
            Written::Flag(_) => (Physical::BOOLEAN, None, Repetition::REQUIRED),
            Written::Stamps(unit, _) => {
                (Physical::INT64, Some(LogicalType::timestamp(false, *unit)), Repetition::REQUIRED)
            }
        };
        let builder = Type::primitive_type_builder(name, physical).with_repetition(repetition);
        Arc::new(builder.with_logical_type(logical).build().unwrap())
    };
    let schema = Type::group_type_builder("schema")
        .with_fields(columns.iter().map(described).collect())
        .build()
        .unwrap();
    let settings = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let out = File::create(path).unwrap();
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(settings)).unwrap();
    let mut group = file.next_row_group().unwrap();
    for (_, column) in columns {
        let mut writer = group.next_column().unwrap().unwrap();
        macro_rules! put {
            ($kind:ty, $values:expr) => {
                writer.typed::<$kind>().write_batch($values, None, None).unwrap()
            };
        }
        macro_rules! put_some {
            ($kind:ty, $values:expr, $make:expr) => {{
                let levels: Vec<i16> = $values.iter().map(|v| i16::from(v.is_some())).collect();
                let there: Vec<<$kind as DataType>::T> = $values.iter().flatten().map($make).collect();
                writer.typed::<$kind>().write_batch(&there, Some(&levels), None).unwrap()
            }};
        }
        match column {
            Written::Text(v) => put_some!(ByteArrayType, v, |t: &&str| ByteArray::from(*t)),
            Written::Double(v) => put_some!(DoubleType, v, |x| *x),
            Written::Whole(v) => put_some!(Int64Type, v, |x| *x),
            Written::Float(v) => put!(FloatType, v),
            Written::Short(v) => put!(Int32Type, v),
            Written::Flag(v) => put!(BoolType, v),
            Written::Stamps(_, v) => put!(Int64Type, v),
        };
        writer.close().unwrap();
    }
    group.close().unwrap();
    file.close().unwrap();
}

fn read(columns: &[(&str, Written)]) -> Result<LabelFile, String> {
    let (_folder, path) = folder();
    written(&path, columns);
    read_file(&path, None).map_err(|e| e.to_string().split_once(": ").unwrap().1.to_string())
}

#[test]
fn tables_of_other_programs_are_labels_too() {
    use Written::{Double, Flag, Float, Short, Stamps, Text, Whole};
    let file = read(&[
        ("__index_level_0__", Whole(vec![Some(0), Some(1), Some(2)])),
        ("landmark", Whole(vec![Some(7), Some(7), Some(12)])),
        ("time", Stamps(TimeUnit::MICROS, vec![3_000, 1_000, 2_000])),
        ("u", Float(vec![1.5, 2.5, 3.5])),
        ("v", Short(vec![4, 5, 6])),
        ("is_keyframe", Short(vec![0, 1, 1])),
        ("source", Text(vec![Some("auto"), None, Some("")])),
        ("flags", Text(vec![Some("occluded+uncertain"), None, Some("uncertain")])),
        ("weight", Double(vec![None, Some(1.0), Some(2.0)])),
    ])
    .unwrap();
    let points = file.labels.points();
    assert_eq!(points.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["7", "12"]);
    let o = points[0].observations.get(1).unwrap();
    assert_eq!((o.stamp.as_nanos(), o.px, o.source.name()), (3_000_000, Pixel::new(1.5, 4.0), "auto"));
    assert!(o.occluded && o.uncertain && !o.keyframe && points[0].observations.first().unwrap().keyframe);
    assert_eq!(file.suspicions.iter().map(|s| s.evidence.as_str()).collect::<Vec<_>>(), ["weight"]);
    // A row without a pixel holds no label.
    let file = read(&[
        ("point", Text(vec![Some("a"); 3])),
        ("timestamp_ns", Whole(vec![Some(1), Some(2), Some(3)])),
        ("u_px", Double(vec![Some(1.0), None, Some(f64::NAN)])),
        ("v_px", Double(vec![Some(1.0), Some(2.0), Some(2.0)])),
        ("keyframe", Flag(vec![true, false, false])),
    ])
    .unwrap();
    assert_eq!((file.labels.observation_count(), file.suspicions.iter().count()), (1, 1));
}

#[test]
fn what_is_wrong_is_said_in_a_line() {
    use Written::{Double, Flag, Text, Whole};
    let good = || -> Vec<(&str, Written)> {
        vec![
            ("point", Text(vec![Some("a"), Some("a")])),
            ("timestamp_ns", Whole(vec![Some(1), Some(2)])),
            ("u_px", Double(vec![Some(1.0), Some(2.0)])),
            ("v_px", Double(vec![Some(1.0), Some(2.0)])),
            ("keyframe", Flag(vec![true, false])),
        ]
    };
    assert_eq!(read(&good()).unwrap().labels.observation_count(), 2);
    let with = |index: usize, column: (&'static str, Written)| {
        let mut columns = good();
        columns[index] = column;
        read(&columns).unwrap_err()
    };
    for (error, expected) in [
        (with(0, ("points", Text(vec![None, None]))), "the column point is missing"),
        (with(0, ("point", Text(vec![Some("a"), None]))), "row 2: a point at 2 ns has an empty name"),
        (
            with(1, ("stamp", Double(vec![Some(1.0), Some(2.0)]))),
            "holds numbers, not whole numbers (stamps are",
        ),
        (with(1, ("timestamp_ns", Whole(vec![Some(1), None]))), "row 2: timestamp_ns is missing"),
        (
            with(1, ("t_s", Whole(vec![Some(1), Some(i64::MAX)]))),
            "row 2: t_s 9223372036854775807 does not fit",
        ),
        (with(1, ("timestamp_ns", Whole(vec![Some(5), Some(5)]))), "point a is labelled twice at 5 ns"),
        (with(2, ("u_px", Text(vec![Some("1"), Some("2")]))), "the column u_px holds text, not numbers"),
        (
            with(2, ("u_px", Double(vec![Some(f64::INFINITY), Some(2.0)]))),
            "row 1: point a at 1 ns has a pixel",
        ),
        (
            with(3, ("v_px", Double(vec![None, Some(2.0)]))),
            "row 1: point a at 1 ns has a pixel that is not finite",
        ),
        (with(4, ("keyframe", Whole(vec![Some(1), Some(2)]))), "row 2: keyframe is neither yes nor no"),
        (with(4, ("keyframe", Whole(vec![Some(1), None]))), "row 2: keyframe is neither yes nor no"),
    ] {
        assert!(error.contains(expected) && !error.contains('\n'), "{error}, not {expected}");
    }
    let more = |name, column| {
        let mut columns = good();
        columns.push((name, column));
        read(&columns).unwrap_err()
    };
    assert!(more("source", Text(vec![Some("me"), None])).contains("row 1: source: `me` is not known"));
    assert!(more("flags", Text(vec![None, Some("odd")])).contains("row 2: flags: `odd` is not known"));
    assert!(
        more("confidence", Double(vec![Some(2.0), None]))
            .contains("row 1: point a at 1 ns has the confidence 2")
    );
    assert!(
        more("tracker_version", Whole(vec![None, Some(-7)])).contains("row 2: tracker_version: -7 is none")
    );
}

#[test]
fn a_file_that_is_no_parquet_or_half_of_one_is_said_to_be() {
    let (_folder, path) = folder();
    write(&path, &many(2, 100), Overwrite::Refuse).unwrap();
    let whole = fs::read(&path).unwrap();
    let half = &whole[..whole.len() / 2];
    for bytes in [&b""[..], b"PAR1", b"point,timestamp_ns,u_px,v_px,keyframe\na,1,1,2,1\n", half] {
        fs::write(&path, bytes).unwrap();
        let error = read_file(&path, None).unwrap_err().to_string();
        assert!(error.contains("labels.parquet: is no Parquet file, or a damaged one"), "{error}");
    }
    // Found by its first bytes under another name, and not by those of half of it.
    let other = path.with_extension("labels");
    fs::write(&other, &whole).unwrap();
    assert_eq!(read_file(&other, None).unwrap().labels, many(2, 100));
    fs::write(&other, half).unwrap();
    assert!(read_file(&other, None).unwrap_err().to_string().contains("damaged"));
    fs::remove_file(&path).unwrap();
    let error = read_file(&path, None).unwrap_err();
    assert!(
        error.to_string().contains("no such file") && error.kind() == vice_core::error::ErrorKind::Missing
    );
}
