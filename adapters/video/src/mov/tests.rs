use super::*;
use proptest::prelude::*;

fn boxed(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let size = (content.len() + 8) as u32;
    [&size.to_be_bytes()[..], kind, content].concat()
}

fn words(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_be_bytes()).collect()
}

/// A film of four frames decoded as 0 2 1 3, the first and the last of which start decoding.
struct Parts {
    stts: Vec<u32>,
    ctts: Vec<u32>,
    stsz: Vec<u32>,
    stss: Option<Vec<u32>>,
    turned: bool,
}

impl Default for Parts {
    fn default() -> Self {
        Self {
            stts: vec![0, 1, 4, 10],
            ctts: vec![0, 4, 1, 10, 1, 20, 1, 0, 1, 10],
            stsz: vec![0, 0, 4, 100, 50, 50, 100],
            stss: Some(vec![0, 2, 1, 4]),
            turned: false,
        }
    }
}

fn film(parts: &Parts) -> Vec<u8> {
    let mut tkhd = vec![0; 84];
    let one = 0x0001_0000_u32.to_be_bytes();
    let places = if parts.turned { [44, 52] } else { [40, 56] };
    for at in places {
        tkhd[at..at + 4].copy_from_slice(&one);
    }
    let mut entry = vec![0; 70];
    entry[24..28].copy_from_slice(&[0, 64, 0, 48]);
    let stsd = [words(&[0, 1]), boxed(b"hvc1", &entry)].concat();
    let mut stbl = [
        boxed(b"stsd", &stsd),
        boxed(b"stts", &words(&parts.stts)),
        boxed(b"ctts", &words(&parts.ctts)),
        boxed(b"stsz", &words(&parts.stsz)),
    ]
    .concat();
    if let Some(stss) = &parts.stss {
        stbl.extend(boxed(b"stss", &words(stss)));
    }
    let handler = |kind: &[u8; 4]| boxed(b"hdlr", &[&[0; 8], &kind[..], &[0; 12]].concat());
    let mdhd = boxed(b"mdhd", &words(&[0, 0, 0, 100, 40, 0]));
    let minf = boxed(b"minf", &boxed(b"stbl", &stbl));
    let sound = boxed(b"trak", &boxed(b"mdia", &handler(b"soun")));
    let video = [boxed(b"tkhd", &tkhd), boxed(b"mdia", &[mdhd, handler(b"vide"), minf].concat())].concat();
    let moov = boxed(b"moov", &[sound, boxed(b"trak", &video)].concat());
    [boxed(b"ftyp", b"qt  "), moov, boxed(b"mdat", &[0; 300])].concat()
}

fn read_bytes(bytes: &[u8]) -> DataResult<MovIndex> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mov");
    std::fs::write(&path, bytes).unwrap();
    read(&path)
}

fn error(bytes: &[u8]) -> String {
    read_bytes(bytes).unwrap_err().to_string()
}

#[test]
fn frames_are_told_in_the_order_in_which_they_are_shown() {
    let index = read_bytes(&film(&Parts::default())).unwrap();
    assert_eq!((index.size, index.ticks_per_second), ((64, 48), 100));
    assert_eq!(index.shown, [10, 20, 30, 40]);
    assert_eq!(index.sync, [SyncFrame { shown: 10, decoded: 0 }, SyncFrame { shown: 40, decoded: 30 }]);
    let all = read_bytes(&film(&Parts { stss: None, ..Parts::default() })).unwrap();
    assert_eq!(all.sync.len(), 4, "without a list of them every frame starts decoding");
    let turned = read_bytes(&film(&Parts { turned: true, ..Parts::default() })).unwrap();
    assert_eq!(turned.size, (48, 64));
    // Offsets below zero: decoding times move back by the lowest.
    let negative = Parts { ctts: vec![0, 2, 1, 0, 3, (-10_i32) as u32], ..Parts::default() };
    let clash = error(&film(&negative));
    assert!(clash.contains("shown at the same time"), "{clash}");
    let negative = Parts { ctts: vec![0, 1, 4, (-10_i32) as u32], ..Parts::default() };
    let index = read_bytes(&film(&negative)).unwrap();
    assert_eq!((index.shown[0], index.sync[0].decoded), (-10, -10));
}

#[test]
fn a_film_that_is_cut_off_says_where() {
    let whole = film(&Parts::default());
    let text = error(&whole[..whole.len() - 1]);
    assert!(text.contains("cut off: box `mdat` has 308 bytes, only 307 are there"), "{text}");
    let moov = error(&whole[..200]);
    assert!(moov.contains("byte 12: the film is cut off: box `moov`"), "{moov}");
    let index_last = [&whole[..12], &boxed(b"mdat", &[0; 300])[..]].concat();
    assert!(error(&index_last).contains("has no index"));
    assert!(error(&whole[..whole.len() - 304]).contains("in the header of a box"));
}

#[test]
fn what_is_no_film_is_refused() {
    assert!(error(b"").contains("no index"));
    assert!(error(b"hello world, this is text").contains("no QuickTime or MP4 film"));
    let fragments = [boxed(b"ftyp", b"isom"), boxed(b"moof", b"")].concat();
    assert!(error(&fragments).contains("fragmented"));
    let short = [boxed(b"ftyp", b"qt  "), vec![0, 0, 0, 3, b'm', b'd', b'a', b't', 0, 0, 0, 0]].concat();
    assert!(error(&short).contains("shorter than its own header"));
    let folder = tempfile::tempdir().unwrap();
    assert!(read(folder.path()).unwrap_err().to_string().contains("is not a file"));
    assert!(read(&folder.path().join("x")).unwrap_err().to_string().contains("no such film"));
}

#[test]
fn an_index_that_promises_too_much_takes_no_memory() {
    let many = Parts { stsz: vec![0, 0, u32::MAX, 1], ..Parts::default() };
    assert!(error(&film(&many)).contains("promises 4294967295 frames, there is room for 1"));
    let same_size = Parts { stsz: vec![0, 2, u32::MAX], ..Parts::default() };
    assert!(error(&film(&same_size)).contains("promises 4294967295 frames"));
    let tiny = Parts { stsz: vec![0, 1, 4], ..Parts::default() };
    assert!(error(&film(&tiny)).contains("each frame has 1 bytes: too few for"), "{}", error(&film(&tiny)));
    let few_times = Parts { stts: vec![0, 1, 3, 10], ..Parts::default() };
    assert!(error(&film(&few_times)).contains("`stts` box covers 3 of 4 frames"));
    let runs = Parts { stts: vec![0, 1, u32::MAX, 10], ..Parts::default() };
    assert!(read_bytes(&film(&runs)).is_ok(), "a run beyond the last frame is only as long as the film");
}

#[cfg(unix)]
#[test]
fn a_sparse_film_of_two_billion_frames_is_refused_at_once() {
    let parts =
        Parts { stsz: vec![0, 1, 2_000_000_000], stts: vec![0, 1, 2_000_000_000, 10], ..Parts::default() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.mov");
    std::fs::write(&path, film(&parts)).unwrap();
    // The last box, the pictures, goes on to the end of the file.
    let bytes = std::fs::read(&path).unwrap();
    let sparse = [&bytes[..], &[0, 0, 0, 0], b"free"].concat();
    std::fs::write(&path, sparse).unwrap();
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(4_000_000_000).unwrap();
    let begun = std::time::Instant::now();
    let error = read(&path).unwrap_err().to_string();
    assert!(
        error.contains("2000000000 frames that its index promises are above the budget of 4000000"),
        "{error}"
    );
    assert!(error.contains("VICE_BUDGET=500"), "{error}");
    assert!(begun.elapsed().as_millis() < 500);
}

proptest! {
    #[test]
    fn no_damage_makes_it_panic(at in 0..700_usize, byte in any::<u8>(), length in 0..900_usize) {
        let mut bytes = film(&Parts::default());
        if let Some(b) = bytes.get_mut(at) {
            *b = byte;
        }
        bytes.truncate(length);
        let _ = read_bytes(&bytes);
    }
}
