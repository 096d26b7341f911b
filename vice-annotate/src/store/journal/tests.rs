use std::fs;

use proptest::prelude::*;

use super::reading::Damage;
use super::*;
use crate::store::history::By;

fn head() -> Line {
    Line::Head {
        schema: JOURNAL_SCHEMA.into(),
        dataset: None,
        camera: Some("cam0".into()),
        file: None,
        base: vec![],
    }
}

fn change(label: &str) -> Line {
    Line::Change { by: By::Edit, label: label.into(), job: None, cells: vec![] }
}

fn opened(path: &Path) -> (Journal, Reading) {
    match Journal::open(path).unwrap() {
        Opened::Locked(journal, reading) => (journal, reading),
        Opened::Taken(_) => panic!("taken"),
    }
}

fn lines(reading: &Reading) -> Vec<Line> {
    reading.entries.iter().map(|e| e.line.clone()).collect()
}

fn locked(path: &Path) -> (Journal, Vec<Line>) {
    let (journal, reading) = opened(path);
    (journal, lines(&reading))
}

/// A journal of so many changes in a folder of its own, and its lines as bytes.
fn written(changes: usize) -> (tempfile::TempDir, PathBuf, Vec<Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    let (mut journal, _) = locked(&path);
    journal.restart(&head()).unwrap();
    for i in 1..=changes {
        journal.append(&change(&format!("change {i}"))).unwrap();
    }
    drop(journal);
    let bytes = fs::read(&path).unwrap();
    let each = bytes.split_inclusive(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    (folder, path, each)
}

fn labels(reading: &Reading) -> Vec<String> {
    let label = |line: &Line| match line {
        Line::Change { label, .. } => label.trim_start_matches("change ").to_string(),
        _ => "head".to_string(),
    };
    reading.entries.iter().map(|e| label(&e.line)).collect()
}

#[test]
fn lines_come_back_and_a_torn_one_is_cut_off() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    let (mut journal, none) = locked(&path);
    assert!(none.is_empty());
    let all = [head(), change("one\ntwo"), Line::Undo, Line::Saved];
    journal.restart(&all[0]).unwrap();
    for line in &all[1..] {
        journal.append(line).unwrap();
    }
    drop(journal);
    let whole = fs::read(&path).unwrap();
    let before_last = whole[..whole.len() - 1].iter().rposition(|b| *b == b'\n').unwrap() + 1;
    for cut in before_last..whole.len() {
        fs::write(&path, &whole[..cut]).unwrap();
        let (mut journal, lines) = locked(&path);
        assert_eq!(lines, all[..3], "cut at {cut}");
        journal.append(&Line::Redo).unwrap();
        drop(journal);
        assert_eq!(locked(&path).1[3], Line::Redo);
    }
    // Zeros and noise, as a loss of power leaves them.
    for noise in [&[0_u8; 4096][..], b"\n\n\x07", b"99999999999999999999 00000000 x\n"] {
        fs::write(&path, [&whole, noise].concat()).unwrap();
        assert_eq!(locked(&path).1, all);
    }
}

#[test]
fn damage_is_named_and_kept_and_everything_else_is_read() {
    let (folder, path, each) = written(6);
    let damaged = |range: std::ops::Range<usize>| {
        let mut all = each.clone();
        for line in &mut all[range] {
            let middle = line.len() / 2;
            line[middle] ^= 0x20;
        }
        all.concat()
    };
    let gap = |bytes: Vec<u8>, says: &str, whole: &[&str]| {
        fs::write(&path, &bytes).unwrap();
        let (_, reading) = opened(&path);
        assert_eq!(labels(&reading), whole);
        let told: Vec<String> = reading.damage.iter().map(ToString::to_string).collect();
        assert!(told.len() == 1 && told[0].contains(says), "{told:?}");
        let kept = folder.path().join("a.journal.damaged");
        assert_eq!(fs::read(&kept).unwrap(), bytes);
        fs::remove_file(kept).unwrap();
        reading
    };
    let reading =
        gap(damaged(2..4), "entries 2 to 3 cannot be read (made between 20", &["head", "1", "4", "5", "6"]);
    assert!(reading.has_gap() && reading.entries[2].gap_before);
    gap(damaged(0..1), "entry 0 cannot be read", &["1", "2", "3", "4", "5", "6"]);
    // The end: half of the acknowledged lines are no line that was not finished.
    let reading = gap(
        damaged(4..7),
        "behind entry 3 cannot be read, 3 entries or more made after 20",
        &["head", "1", "2", "3"],
    );
    assert!(!reading.has_gap());
    gap(
        damaged(6..7),
        "behind entry 5 cannot be read, one entry made after",
        &["head", "1", "2", "3", "4", "5"],
    );
    // Whole lines that are gone, twice, in another order, or of another journal.
    let of = |order: &[usize]| order.iter().flat_map(|i| each[*i].clone()).collect::<Vec<u8>>();
    gap(of(&[0, 1, 2, 4, 5, 6]), "entry 3 cannot be read", &["head", "1", "2", "4", "5", "6"]);
    gap(of(&[0, 1, 2, 3, 3, 4, 5, 6]), "entry 3 stands twice", &["head", "1", "2", "3", "4", "5", "6"]);
    gap(
        of(&[0, 1, 3, 2, 4, 5, 6]),
        "entry 2 stands twice or in the wrong place",
        &["head", "1", "2", "3", "4", "5", "6"],
    );
    let (line, _) = frame(&change("of another"), Place { seq: 2, time_ms: 5, before: 77 }).unwrap();
    gap([of(&[0, 1]), line].concat(), "entry 2 cannot be read", &["head", "1", "of another"]);
    // What was put right is written right, and goes on.
    fs::write(&path, of(&[0, 2, 1])).unwrap();
    let (mut journal, _) = opened(&path);
    journal.append(&change("3")).unwrap();
    drop(journal);
    let (_, reading) = opened(&path);
    assert_eq!(
        (labels(&reading), reading.damage),
        (["head", "1", "2", "3"].map(String::from).to_vec(), vec![])
    );
}

#[test]
fn a_head_makes_damage_before_it_unneeded() {
    let (_folder, path, each) = written(3);
    let (again, _) = frame(&head(), Place { seq: 4, time_ms: 1, before: last_crc(&each) }).unwrap();
    let mut all = each.clone();
    all[2][30] ^= 1;
    all.push(again);
    fs::write(&path, all.concat()).unwrap();
    let (_, reading) = opened(&path);
    assert_eq!((labels(&reading), reading.damage), (vec!["head".to_string()], vec![]));
}

fn last_crc(each: &[Vec<u8>]) -> u32 {
    line::whole_line(each.last().unwrap()).unwrap().crc
}

#[test]
fn a_journal_of_the_old_schema_is_read_and_written_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    let old = |line: &Line| {
        let json = serde_json::to_string(line).unwrap().replace(JOURNAL_SCHEMA, "vice.journal/1");
        format!("{} {:08x} {json}\n", json.len(), crc32fast::hash(json.as_bytes()))
    };
    let all: Vec<String> = [head(), change("change 1"), change("change 2")].iter().map(old).collect();
    fs::write(&path, all.concat()).unwrap();
    let (mut journal, reading) = opened(&path);
    assert_eq!((labels(&reading), &reading.damage), (["head", "1", "2"].map(String::from).to_vec(), &vec![]));
    journal.append(&change("change 3")).unwrap();
    drop(journal);
    let (_, reading) = opened(&path);
    assert_eq!((labels(&reading).len(), reading.damage.len(), reading.next.seq), (4, 0, 4));
    fs::write(&path, [&all[0], "12 00000000 hello\n", &all[2]].concat()).unwrap();
    let (_, reading) = opened(&path);
    assert!(reading.has_gap() && matches!(reading.damage[..], [Damage::Missing { .. }]));
}

#[test]
fn what_is_no_journal_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    for other in ["{\"a\": 1}\n", "hello", "12 hello\nthere"] {
        fs::write(&path, other).unwrap();
        let Err(error) = Journal::open(&path) else { panic!("{other}") };
        assert!(error.to_string().contains("no journal of vice"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), other);
    }
    let newer = r#"{"is":"head","schema":"vice.journal/3","what":1}"#;
    fs::write(&path, format!("{} {:08x} {newer}\n", newer.len(), crc32fast::hash(newer.as_bytes()))).unwrap();
    let Err(error) = Journal::open(&path) else { panic!() };
    assert!(error.to_string().contains("vice.journal/3"), "{error}");
}

/// A disk that loses power: what was written since the last sync may be there in any order, in parts, or not at all.
#[derive(Clone, Debug, Default)]
struct Flaky {
    synced: Vec<u8>,
    /// What was asked for since then; `None` cuts.
    asked: Vec<(u64, Option<Vec<u8>>)>,
    /// Calls until one fails.
    fails_in: Option<u32>,
}

impl Flaky {
    fn fails(&mut self) -> std::io::Result<()> {
        match &mut self.fails_in {
            Some(0) => {
                self.fails_in = None;
                Err(std::io::ErrorKind::StorageFull.into())
            }
            Some(n) => {
                *n -= 1;
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn now(&self) -> Vec<u8> {
        let mut bytes = self.synced.clone();
        for (at, what) in &self.asked {
            apply(&mut bytes, *at, what.as_deref());
        }
        bytes
    }

    /// One of the states that the disk may be in after power was lost now: sectors of 512 bytes, each written or not.
    fn after_power_loss(&self, mut chance: impl FnMut() -> u32) -> Vec<u8> {
        let mut bytes = self.synced.clone();
        for (at, what) in &self.asked {
            let Some(what) = what else {
                if chance().is_multiple_of(2) {
                    apply(&mut bytes, *at, None);
                }
                continue;
            };
            let end = *at as usize + what.len();
            for sector in *at as usize / 512..=end / 512 {
                let (from, to) = ((sector * 512).max(*at as usize), ((sector + 1) * 512).min(end));
                if from < to && chance().is_multiple_of(2) {
                    apply(&mut bytes, from as u64, Some(&what[from - *at as usize..to - *at as usize]));
                }
            }
        }
        bytes
    }
}

fn apply(bytes: &mut Vec<u8>, at: u64, what: Option<&[u8]>) {
    let at = at as usize;
    match what {
        None => bytes.truncate(at),
        Some(what) => {
            bytes.resize(bytes.len().max(at + what.len()), 0);
            bytes[at..at + what.len()].copy_from_slice(what);
        }
    }
}

impl Disk for Flaky {
    fn write_at(&mut self, at: u64, bytes: &[u8]) -> std::io::Result<()> {
        // A full disk takes a part.
        let failed = self.fails();
        let taken = if failed.is_err() { &bytes[..bytes.len() / 2] } else { bytes };
        self.asked.push((at, Some(taken.to_vec())));
        failed
    }

    fn cut(&mut self, len: u64) -> std::io::Result<()> {
        self.fails()?;
        self.asked.push((len, None));
        Ok(())
    }

    fn sync(&mut self) -> std::io::Result<()> {
        self.fails()?;
        self.synced = self.now();
        self.asked.clear();
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever a loss of power leaves: each acknowledged line is read, and nothing that was not asked for.
    #[test]
    fn no_loss_of_power_takes_an_acknowledged_line(
        sizes in prop::collection::vec(0..3000_usize, 1..12),
        fails in prop::option::of(0..30_u32),
        seed in any::<u64>(),
    ) {
        let disk = Flaky { fails_in: fails, ..Flaky::default() };
        let mut journal =
            Journal { path: PathBuf::new(), disk, len: 0, next: Place::default(), broken: false, untouched: false };
        let mut state = seed | 1;
        let mut chance = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as u32
        };
        let (mut acknowledged, mut asked) = (Vec::new(), Vec::new());
        let all = std::iter::once(head()).chain(sizes.iter().map(|n| change(&"x".repeat(*n))));
        for line in all {
            asked.push(line.clone());
            // Power may be lost in the middle of a write, before it was acknowledged.
            let mut at_once = journal.disk.clone();
            if let Ok((bytes, _)) = frame(&line, journal.next) {
                let _ = at_once.write_at(journal.len, &bytes);
                check(&at_once.after_power_loss(&mut chance), &acknowledged, &asked)?;
            }
            if journal.append(&line).is_ok() {
                acknowledged.push(line);
            } else if matches!(line, Line::Head { .. }) {
                break;
            } else {
                asked.pop();
            }
            check(&journal.disk.after_power_loss(&mut chance), &acknowledged, &asked)?;
        }
    }
}

fn check(bytes: &[u8], acknowledged: &[Line], asked: &[Line]) -> Result<(), TestCaseError> {
    if acknowledged.is_empty() {
        return Ok(());
    }
    let reading = reading::read(bytes).map_err(|e| TestCaseError::fail(e.to_string()))?;
    let read = lines(&reading);
    prop_assert!(!reading.has_gap(), "{:?}", reading.damage);
    prop_assert!(read.len() >= acknowledged.len() && read[..acknowledged.len()] == *acknowledged);
    prop_assert!(read.len() <= asked.len() + 1);
    Ok(())
}

#[test]
fn one_process_writes_and_starting_anew_forgets() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.journal");
    let (mut journal, _) = locked(&path);
    journal.restart(&head()).unwrap();
    journal.append(&change("one")).unwrap();
    let Opened::Taken(reading) = Journal::open(&path).unwrap() else { panic!("not locked") };
    assert_eq!(reading.entries.len(), 2);
    journal.restart(&head()).unwrap();
    assert!(matches!(Journal::open(&path).unwrap(), Opened::Taken(reading) if reading.entries.len() == 1));
    journal.append(&change("two")).unwrap();
    drop(journal);
    let (journal, lines) = locked(&path);
    assert_eq!(lines, [head(), change("two")]);
    assert_eq!(journal.len(), fs::metadata(&path).unwrap().len());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    drop(journal);
    assert!(path.exists());
    let (mut journal, _) = locked(&path);
    journal.restart(&head()).unwrap();
    drop(journal);
    assert!(!path.exists(), "nothing has happened in it");
}
