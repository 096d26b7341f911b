//! Recordings: bags, MCAP files and data bases.

use std::io::Write;
use std::path::Path;

use vice_tests::{shared, vice};

use super::{refused, text, within_limits};

/// What `vice info` tells of a recording, without what differs by its name and its unread topic.
fn told(path: &Path) -> (Vec<String>, String) {
    let ran = within_limits(text(path), &["info", text(path)]);
    assert_eq!(ran.run.code, 0, "{}", ran.run.stderr);
    let name = path.file_stem().unwrap().to_str().unwrap().to_string();
    let own = |line: &&str| {
        !line.contains("json") && !line.contains(&name) && !line.trim_start().starts_with("damage")
    };
    (ran.run.stdout.lines().filter(own).map(str::to_string).collect(), ran.run.stdout.clone())
}

#[test]
fn a_recording_with_one_json_or_protobuf_topic() {
    let Some(folder) = shared("cases/hostile") else { return };
    let (without, _) = told(&folder.join("valid_no_json.mcap"));
    let (with, _) = told(&folder.join("valid_json_middle.mcap"));
    assert!(without.len() > 5, "{without:?}");
    for line in &without {
        assert!(
            with.contains(line),
            "`{line}` is not told of the recording that has a topic in JSON: {with:?}"
        );
    }
    let (_, first) = told(&folder.join("valid_json_first.mcap"));
    let topics = [
        ("color/image_raw", 2),
        ("color/camera_info", 1),
        ("/tf", 1),
        ("/imu", 1),
        ("/odom", 1),
        ("/pose", 1),
    ];
    for (topic, count) in topics {
        let said = first.lines().any(|line| {
            line.contains(topic)
                && line.contains(&format!(" {count} message"))
                && !line.contains("/tf_static")
        });
        assert!(said, "{topic} with {count}: {first}");
    }
    // The topic that is not read is told as what it is.
    assert!(first.contains("json"), "{first}");
}

#[test]
fn resources_of_the_recordings_of_the_attack() {
    let Some(folder) = shared("cases/hostile") else { return };
    let mut seen = 0;
    let mut names: Vec<_> = folder.read_dir().unwrap().map(|e| e.unwrap().path()).collect();
    names.sort();
    for path in names {
        let Some("bag" | "mcap") = path.extension().and_then(|e| e.to_str()) else { continue };
        let ran = within_limits(text(&path), &["info", text(&path)]);
        seen += 1;
        if path.file_name().unwrap().to_str().unwrap().starts_with("valid_") {
            assert_eq!(ran.run.code, 0, "{}", ran.run.stderr);
            continue;
        }
        // Read like any other, or refused in a line that says why.
        let said = format!("{}{}", ran.run.stdout, ran.run.stderr);
        let errors: Vec<&str> = ran.run.stderr.lines().filter(|l| l.starts_with("error")).collect();
        assert_eq!(errors.len(), usize::from(ran.run.code != 0), "{}: {said}", path.display());
        assert!(errors.iter().all(|line| line.split_whitespace().count() > 4), "{said}");
        if path.ends_with("bag-bomb-40x200MB.bag") {
            assert!(errors[0].contains("VICE_BUDGET"), "{said}");
        }
    }
    assert!(seen >= 7, "{seen} recordings");
}

/// A field of a record's header in a bag.
fn field(name: &str, value: &[u8]) -> Vec<u8> {
    let bytes = [name.as_bytes(), b"=", value].concat();
    [&(bytes.len() as u32).to_le_bytes()[..], &bytes].concat()
}

fn record(header: &[Vec<u8>], data: &[u8]) -> Vec<u8> {
    let header = header.concat();
    [&(header.len() as u32).to_le_bytes()[..], &header, &(data.len() as u32).to_le_bytes(), data].concat()
}

/// A chunk of a bag: what it holds, packed, and the size that it claims.
fn chunk(packed: &[u8], compression: &str, size: u32) -> Vec<u8> {
    let header =
        [field("op", &[5]), field("compression", compression.as_bytes()), field("size", &size.to_le_bytes())];
    record(&header, packed)
}

fn bag(chunks: &[Vec<u8>]) -> Vec<u8> {
    let header = [field("op", &[3]), field("index_pos", &0_u64.to_le_bytes())];
    [b"#ROSBAG V2.0\n".to_vec(), record(&header, &[b' '; 64]), chunks.concat()].concat()
}

fn bzip2_of_zeros(count: usize) -> Vec<u8> {
    let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::best());
    encoder.write_all(&vec![0; count]).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn resources_of_chunks_that_are_small_each_and_large_together() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("many.bag");
    // Each is below what a chunk may unpack to; 400 of them are 12 GB in 20 kB.
    let packed = bzip2_of_zeros(30_000_000);
    std::fs::write(&path, bag(&vec![chunk(&packed, "bz2", 30_000_000); 400])).unwrap();
    let ran = within_limits("400 chunks", &["info", text(&path)]);
    let said = format!("{}{}", ran.run.stdout, ran.run.stderr);
    assert!(ran.run.code == 1 && said.contains("VICE_BUDGET"), "{said}");
    // One alone that claims more than there could be.
    std::fs::write(&path, bag(&[chunk(&packed, "bz2", 3_000_000_000)])).unwrap();
    let ran = within_limits("a chunk of 3 GB", &["info", text(&path)]);
    assert!(ran.run.code == 1 && ran.run.stderr.contains("VICE_BUDGET"), "{}", ran.run.stderr);
}

#[test]
fn resources_of_packed_recordings_and_messages() {
    let folder = tempfile::tempdir().unwrap();
    // A file that is packed as a whole, and would fill the temporary folder.
    let path = folder.path().join("run.bag.zstd");
    let mut encoder = zstd::stream::Encoder::new(std::fs::File::create(&path).unwrap(), 1).unwrap();
    encoder.write_all(b"#ROSBAG V2.0\n").unwrap();
    let zeros = vec![0; 1 << 20];
    for _ in 0..300 {
        encoder.write_all(&zeros).unwrap();
    }
    encoder.finish().unwrap();
    refused(
        "a packed file",
        &["info", text(&path)],
        &["run.bag.zstd", "unpacks to more than the budget", "VICE_BUDGET"],
    );
    // Messages that are packed one by one.
    let path = folder.path().join("messages.mcap");
    let mut writer =
        mcap::WriteOptions::new().compression(None).create(std::fs::File::create(&path).unwrap()).unwrap();
    let schema = writer.add_schema("tf2_msgs/msg/TFMessage", "ros2msg", b"").unwrap();
    let channel = writer.add_channel(schema, "/tf", "cdr", &Default::default()).unwrap();
    let bomb = zstd::bulk::compress(&vec![0; 200 << 20], 1).unwrap();
    for sequence in 0..20 {
        let time = 1_700_000_000_000_000_000 + u64::from(sequence);
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence,
            log_time: time,
            publish_time: time,
        };
        writer.write_to_known_channel(&header, &bomb).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    within_limits("packed messages", &["info", text(&path)]);
}

#[test]
fn resources_of_counts_in_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("counts.bag");
    // A tf message that claims 2^32 - 1 transforms, an image of 2^31 columns, and a string of 4 GB.
    let connection = |number: u32, topic: &str, kind: &str| {
        let header =
            [field("op", &[7]), field("conn", &number.to_le_bytes()), field("topic", topic.as_bytes())];
        record(&header, &[field("type", kind.as_bytes()), field("md5sum", b"*")].concat())
    };
    let message = |number: u32, data: &[u8]| {
        let header = [
            field("op", &[2]),
            field("conn", &number.to_le_bytes()),
            field("time", &[1, 0, 0, 0, 2, 0, 0, 0]),
        ];
        record(&header, data)
    };
    let head = [&7_u32.to_le_bytes()[..], &[1, 0, 0, 0, 2, 0, 0, 0]].concat();
    let image = [&head[..], &[0; 4], &[0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f]].concat();
    let text_of_4_gb = [&head[..], &[0xff; 4]].concat();
    let plain = [
        connection(0, "/tf", "tf2_msgs/TFMessage"),
        connection(1, "/camera/color/image_raw", "sensor_msgs/Image"),
        connection(2, "/odom", "nav_msgs/Odometry"),
        message(0, &[0xff; 4]),
        message(1, &image),
        message(2, &text_of_4_gb),
    ]
    .concat();
    std::fs::write(&path, bag(&[chunk(&plain, "none", plain.len() as u32)])).unwrap();
    within_limits("counts in messages", &["info", text(&path)]);
    // A data base whose page count is not its own.
    let mut head = b"SQLite format 3\0".to_vec();
    head.extend([0x10, 0, 1, 1, 0, 64, 32, 32, 0, 0, 0, 1, 0xff, 0xff, 0xff, 0xff]);
    let path = folder.path().join("counts.db3");
    std::fs::write(&path, [head, vec![0xff; 8192]].concat()).unwrap();
    let ran = within_limits("a data base", &["info", text(&path)]);
    assert_eq!(ran.run.code, 1, "{}", ran.run.stdout);
}

/// Stamps that are years apart: nothing is made for each second in between.
#[test]
fn resources_of_spans_of_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("years.txt");
    std::fs::write(&path, "0.0 0 0 0 0 0 0 1\n1.0 0 0 0 0 0 0 1\n9000000000.0 1 0 0 0 0 0 1\n").unwrap();
    within_limits("three hundred years", &["trajectory", text(&path), text(&path)]);
    assert!(vice(&["trajectory", "--help"]).code == 0);
}
