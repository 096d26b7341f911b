use super::*;
use tar::{Builder, Header};

/// An archive of entries (name, type, content); names are written as they are, climbing or not.
fn archive(entries: &[(&str, EntryType, &[u8])]) -> Vec<u8> {
    let mut builder = Builder::new(Vec::new());
    for (name, kind, content) in entries {
        let mut header = Header::new_gnu();
        header.as_old_mut().name[..name.len()].copy_from_slice(name.as_bytes());
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        header.set_entry_type(*kind);
        header.set_cksum();
        builder.append(&header, *content).unwrap();
    }
    builder.into_inner().unwrap()
}

fn index_bytes(bytes: &[u8]) -> DataResult<Vec<Entry>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lossless.tar");
    std::fs::write(&path, bytes).unwrap();
    index(&path)
}

const FILE: EntryType = EntryType::Regular;

#[test]
fn an_archive_is_indexed_in_the_order_of_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tar");
    let entries: [(&str, EntryType, &[u8]); 6] = [
        ("./", EntryType::Directory, b""),
        ("./10.png", FILE, b"ten"),
        ("./9.png", FILE, b"nine"),
        ("./._9.png", FILE, b"resource fork"),
        ("./notes.txt", FILE, b"notes"),
        ("./11.png", FILE, b""),
    ];
    std::fs::write(&path, archive(&entries)).unwrap();
    let index = index(&path).unwrap();
    let names: Vec<_> = index.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["./9.png", "./10.png", "./11.png"]);
    let contents: Vec<_> = index.iter().map(|e| read_entry(&path, e).unwrap()).collect();
    assert_eq!(contents, [&b"nine"[..], b"ten", b""]);
}

#[test]
fn a_hostile_archive_is_refused() {
    for name in ["../x.png", "a/../../x.png", "/etc/x.png"] {
        let bytes = archive(&[("0.png", FILE, b"fine"), (name, FILE, b"evil")]);
        let error = index_bytes(&bytes).unwrap_err().to_string();
        assert!(error.contains("byte 1024: the file name") && error.contains(name), "{error}");
    }
    for kind in [EntryType::Symlink, EntryType::Link, EntryType::Char, EntryType::Fifo, EntryType::GNUSparse]
    {
        let error = index_bytes(&archive(&[("0.png", kind, b"")])).unwrap_err().to_string();
        // A sparse header without its map is broken already.
        let said = error.contains("is a link or a device") || kind == EntryType::GNUSparse;
        assert!(said, "{kind:?}: {error}");
    }
}

#[test]
fn an_archive_that_is_cut_off_says_where() {
    let bytes = archive(&[("0.png", FILE, &[1; 700]), ("1.png", FILE, &[2; 700])]);
    let error = index_bytes(&bytes[..2200]).unwrap_err().to_string();
    assert!(error.contains("byte 2048: is cut off: `1.png` has 700 bytes, 152 are there"), "{error}");
    let error = index_bytes(&bytes[..1800]).unwrap_err().to_string();
    assert!(error.contains("is no tar archive that can be read"), "{error}");
    assert!(index_bytes(b"this is no archive at all").is_err());
    // Sizes that no file has, and damage anywhere, end in an error or in fewer entries.
    let mut huge = bytes.clone();
    huge[124..136].copy_from_slice(&[0x80, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff]);
    assert!(index_bytes(&huge).is_err());
    for at in (0..1024).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0xff;
        let _ = index_bytes(&damaged);
    }
}

#[test]
fn depth_is_paired_within_reach() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("images");
    std::fs::create_dir(&images).unwrap();
    let png = |z: f32| {
        let image = DepthImage::new(Stamp::default(), 2, 1, vec![z, 0.0]).unwrap();
        image_file::encode_depth_png(&image, METRES_PER_COUNT).unwrap()
    };
    for (i, z) in [1.0, 2.0].iter().enumerate() {
        std::fs::write(images.join(format!("{i}.png")), png(*z)).unwrap();
    }
    std::fs::write(folder.path().join(STAMPS), "1000\n2000\n").unwrap();
    let depth = DepthFrames::new(folder.path().to_path_buf());
    assert!(depth.is_there());
    let at = |nanos, reach| {
        let image = depth.nearest(Stamp::from_nanos(nanos), Span::from_nanos(reach), (2, 1)).unwrap();
        image.map(|i| (i.stamp.as_nanos(), i.get(0, 0).unwrap(), i.get(1, 0)))
    };
    let near = |got: Option<(i64, f32, Option<f32>)>, stamp, z: f32| {
        let (s, got, none) = got.unwrap();
        assert!(s == stamp && (got - z).abs() < 5e-4 && none.is_none());
    };
    near(at(1000, 0), 1000, 1.0);
    near(at(1400, 400), 1000, 1.0);
    near(at(1600, 400), 2000, 2.0);
    near(at(2100, 100), 2000, 2.0);
    near(at(900, 100), 1000, 1.0);
    assert_eq!((at(1500, 400), at(2101, 100), at(899, 100)), (None, None, None));
    let size = depth.nearest(Stamp::from_nanos(1000), Span::ZERO, (3, 1)).unwrap_err().to_string();
    assert!(size.contains("0.png: is 2x1 pixels, the camera's are 3x1"), "{size}");
    std::fs::write(folder.path().join(STAMPS), "1000\n2000\n3000\n").unwrap();
    let more = DepthFrames::new(folder.path().to_path_buf());
    let error = more.nearest(Stamp::default(), Span::ZERO, (2, 1)).unwrap_err().to_string();
    assert!(error.contains("more stamps than frames: 3 stamps"), "{error}");
}
