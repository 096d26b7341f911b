use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use proptest::prelude::*;
use vice_core::camera::{Camera, Model};
use vice_core::label::ObservationSource;
use vice_core::time::Stamp;

use super::save::lock;
use super::*;

const FRAMES: usize = 20;

struct Desk {
    folder: tempfile::TempDir,
    camera: Camera,
    frames: Vec<Stamp>,
}

impl Desk {
    fn new() -> Self {
        let frames =
            (0..FRAMES as i64).map(|i| Stamp::from_nanos(1_403_715_273_262_142_976 + i * 50_000_000));
        Self {
            folder: tempfile::tempdir().unwrap(),
            camera: Camera::new(100, 80, [90.0, 90.0, 50.0, 40.0], Model::Pinhole).unwrap(),
            frames: frames.collect(),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn target(&self) -> Target<'_> {
        Target { dataset: "flight", camera: "cam0", frames: &self.frames }
    }

    fn open(&self, name: &str) -> vice_core::error::DataResult<Store> {
        Store::open(&self.path(name), &self.target())
    }

    fn edit(&self, store: &mut Store, edit: Edit) -> Result<Changed, StoreError> {
        let known = store.revision();
        store.edit(known, &[edit], &Checks { camera: &self.camera, frames: &self.frames })
    }

    fn place(&self, store: &mut Store, point: &str, frame: usize, u: f64) {
        self.edit(store, Edit::Place { point: point.into(), frame, u, v: 7.5 }).unwrap();
    }

    fn save(&self, store: Store) -> Store {
        let store = Arc::new(Mutex::new(store));
        Saver::start(Arc::clone(&store), Duration::from_secs(60), Box::new(|_| {}))
            .unwrap()
            .finish()
            .unwrap();
        Arc::into_inner(store).unwrap().into_inner().unwrap()
    }

    fn says(&self, name: &str, words: &[&str]) {
        let error = self.open(name).unwrap_err().to_string();
        assert!(words.iter().all(|w| error.contains(w)), "{error}");
    }
}

#[test]
fn edits_are_checked_and_do_what_they_say() {
    let desk = Desk::new();
    let mut store = desk.open("a.json").unwrap();
    desk.place(&mut store, "1", 3, 10.25);
    desk.place(&mut store, "1", 5, 12.0);
    desk.place(&mut store, "1", 8, 14.0);
    let observation = |store: &Store, frame: usize| store.document().get("1", desk.frames[frame]).copied();
    assert!(observation(&store, 3).unwrap().keyframe && !observation(&store, 5).unwrap().keyframe);
    let mark = Edit::Mark {
        point: "1".into(),
        frame: 5,
        occluded: Some(true),
        uncertain: Some(true),
        keyframe: None,
    };
    assert_eq!(desk.edit(&mut store, mark).unwrap().label, "mark 1 in frame 5");
    desk.place(&mut store, "1", 5, 13.0);
    let moved = observation(&store, 5).unwrap();
    assert_eq!((moved.px.u, moved.occluded, moved.uncertain), (13.0, true, true), "marks by hand stay");
    let refused = |store: &mut Store, edit: Edit, word: &str| {
        let before = (store.revision(), store.document().clone());
        let error = desk.edit(store, edit).unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
        assert_eq!((store.revision(), store.document().clone()), before);
    };
    let place = |point: &str, frame, u, v| Edit::Place { point: point.into(), frame, u, v };
    refused(&mut store, place("1", FRAMES, 1.0, 1.0), "frame 20 does not exist");
    refused(&mut store, place("1", 0, 99.6, 1.0), "outside the 100x80 image");
    refused(&mut store, place("1", 0, f64::NAN, 1.0), "outside");
    for name in ["", "a\nb", " a", "a,b", "#1"] {
        refused(&mut store, place(name, 0, 1.0, 1.0), "name");
    }
    refused(&mut store, Edit::Delete { point: "2".into(), frame: 0 }, "no point 2");
    refused(&mut store, Edit::Delete { point: "1".into(), frame: 0 }, "not labelled in frame 0");
    desk.place(&mut store, "2", 0, 1.0);
    refused(&mut store, Edit::Rename { point: "1".into(), to: "2".into() }, "already");
    desk.edit(&mut store, Edit::Rename { point: "1".into(), to: "one".into() }).unwrap();
    desk.edit(&mut store, Edit::DeleteAfter { point: "one".into(), frame: 5 }).unwrap();
    let left: Vec<_> = store.document().point("one").unwrap().keys().copied().collect();
    assert_eq!(left, [desk.frames[3], desk.frames[5]]);
    let removed = desk.edit(&mut store, Edit::RemovePoint { point: "one".into() }).unwrap();
    assert_eq!(removed.points, ["one"]);
    assert!(store.document().point("one").is_none());
    let nothing = store.revision();
    desk.place(&mut store, "2", 0, 1.0);
    assert_eq!(store.revision(), nothing, "what changes nothing is no step");
    // A list of edits holds as a whole or not at all.
    let checks = Checks { camera: &desk.camera, frames: &desk.frames };
    let list = [place("3", 0, 1.0, 1.0), place("3", 1, 1.0, 1.0), place("3", 2, -5.0, 1.0)];
    assert!(store.edit(nothing, &list, &checks).is_err() && store.document().point("3").is_none());
    let made = store.edit(nothing, &list[..2], &checks).unwrap();
    assert_eq!((made.revision, store.document().point("3").unwrap().len()), (nothing + 1, 2));
    assert!(store.document().get("3", desk.frames[0]).unwrap().keyframe);
    assert!(!store.document().get("3", desk.frames[1]).unwrap().keyframe);
}

#[test]
fn a_suggestion_taken_as_one_of_many_is_the_trackers_until_it_is_touched() {
    let desk = Desk::new();
    let mut store = desk.open("a.json").unwrap();
    let spawn = |frame, suggested| Edit::Spawn { point: "1".into(), frame, u: 20.5, v: 30.25, suggested };
    assert_eq!(desk.edit(&mut store, spawn(4, true)).unwrap().label, "begin 1 in frame 4");
    let there = |store: &Store, frame: usize| *store.document().get("1", desk.frames[frame]).unwrap();
    let taken = there(&store, 4);
    assert!(taken.source == ObservationSource::Auto && taken.keyframe && !taken.uncertain);
    assert_eq!(taken.provenance.tracker_version, vice_track::tracker_version());
    assert_eq!(taken.provenance.confidence, None, "nothing was tracked to there");
    // To say that it is right is to touch it.
    desk.edit(&mut store, Edit::Place { point: "1".into(), frame: 4, u: 20.5, v: 30.25 }).unwrap();
    let touched = there(&store, 4);
    assert!(touched.source == ObservationSource::Manual && touched.keyframe);
    desk.edit(&mut store, spawn(9, false)).unwrap();
    assert!(there(&store, 9).source == ObservationSource::Manual && there(&store, 9).keyframe);
    let refused =
        desk.edit(&mut store, Edit::Spawn { point: "a,b".into(), frame: 0, u: 1.0, v: 1.0, suggested: true });
    assert!(refused.unwrap_err().to_string().contains("name"));
    let reversed = desk.edit(&mut store, Edit::DeleteRange { point: "1".into(), frame: 9, to: 4 });
    assert!(reversed.unwrap_err().to_string().contains("after frame 4"));
    let cut = desk.edit(&mut store, Edit::DeleteRange { point: "1".into(), frame: 5, to: 9 }).unwrap();
    assert_eq!(cut.label, "delete 1 from frame 5 to 9");
    assert_eq!(store.document().point("1").unwrap().len(), 1);
}

#[test]
fn a_writer_must_know_what_others_did_except_the_tracker() {
    let desk = Desk::new();
    let mut store = desk.open("a.json").unwrap();
    desk.place(&mut store, "1", 0, 10.0);
    let known = store.revision();
    let job = store.new_job();
    let tracked = |store: &Store, frame: usize| {
        let mut o = vice_core::label::Observation::manual(
            desk.frames[frame],
            vice_core::camera::Pixel::new(3.0, 3.0),
        );
        o.source = ObservationSource::Auto;
        store.document().cell("1", desk.frames[frame], Some(o)).unwrap()
    };
    for frame in 1..4 {
        let cell = tracked(&store, frame);
        store.commit(By::Track, "track 1".into(), Some(job), vec![cell]).unwrap();
    }
    let checks = Checks { camera: &desk.camera, frames: &desk.frames };
    let place = |frame| [Edit::Place { point: "1".into(), frame, u: 5.0, v: 5.0 }];
    store.edit(known, &place(2), &checks).unwrap();
    let error = store.edit(known, &place(3), &checks).unwrap_err();
    assert!(matches!(error, StoreError::Stale { revision } if revision == store.revision()), "{error}");
    assert!(matches!(store.undo(known), Err(StoreError::Stale { .. })));
    assert!(matches!(store.edit(store.revision() + 1, &place(3), &checks), Err(StoreError::Stale { .. })));
    // The hand's step, then all of the job as one.
    store.undo(store.revision()).unwrap();
    store.undo(store.revision()).unwrap();
    assert_eq!(store.document().point("1").unwrap().len(), 1);
    store.redo(store.revision()).unwrap();
    assert_eq!(store.document().point("1").unwrap().len(), 4);
}

#[test]
fn what_was_done_is_there_after_reopening_with_its_history() {
    let desk = Desk::new();
    let mut store = desk.open("a.json").unwrap();
    desk.place(&mut store, "1", 0, 10.0);
    desk.place(&mut store, "1", 1, 11.0);
    desk.place(&mut store, "1", 2, 12.0);
    store.undo(store.revision()).unwrap();
    let (document, revision) = (store.document().clone(), store.revision());
    assert!(!desk.path("a.json").exists());
    drop(store);
    // As after a kill: only the journal is there.
    let mut store = desk.open("a.json").unwrap();
    assert_eq!((store.document(), store.revision()), (&document, revision));
    store.redo(revision).unwrap();
    store.undo(revision + 1).unwrap();
    let store = desk.save(store);
    let file = vice_files::labels::read(desk.path("a.json"), None).unwrap();
    assert_eq!(Document::from_labels(&file), document);
    assert_eq!((file.dataset.as_deref(), file.camera.as_deref()), (Some("flight"), Some("cam0")));
    drop(store);
    let mut store = desk.open("a.json").unwrap();
    assert_eq!(store.document(), &document);
    store.undo(store.revision()).unwrap();
    store.undo(store.revision()).unwrap();
    assert_eq!(store.document().points().len(), 0);
    assert!(matches!(store.undo(store.revision()), Err(StoreError::Nothing("undo"))));
    let store = desk.save(store);
    drop(store);
    assert!(desk.open("a.json").unwrap().can_redo(), "an empty file is opened again");
}

/// Flips a bit in a line of a journal.
fn damage(path: &Path, line: usize) {
    let bytes = fs::read(path).unwrap();
    let mut each: Vec<Vec<u8>> = bytes.split_inclusive(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    let middle = each[line].len() / 2;
    each[line][middle] ^= 1;
    fs::write(path, each.concat()).unwrap();
}

#[test]
fn a_damaged_journal_costs_no_label_that_the_file_or_another_line_has() {
    let desk = Desk::new();
    let mut store = desk.open("a.json").unwrap();
    for frame in 0..4 {
        desk.place(&mut store, "1", frame, frame as f64);
    }
    let mut store = desk.save(store);
    drop(store);
    store = desk.open("a.json").unwrap();
    desk.place(&mut store, "1", 4, 4.0);
    let whole = store.document().clone();
    drop(store);
    let journal = desk.path("a.json.journal");
    let before = fs::read(&journal).unwrap();
    // Lines: head, four places, saving, saved, a place. The file was saved behind the damage.
    damage(&journal, 2);
    let store = desk.open("a.json").unwrap();
    assert_eq!(store.document(), &whole);
    drop(desk.save(store));
    assert!(desk.path("a.json.journal.damaged").exists() && !desk.path("a.json.damaged").exists());
    assert_eq!(desk.open("a.json").unwrap().document(), &whole, "the journal is whole again");

    // Without the file only the damaged change is missing.
    fs::write(&journal, &before).unwrap();
    fs::remove_file(desk.path("a.json")).unwrap();
    damage(&journal, 3);
    let store = desk.open("a.json").unwrap();
    let frames: Vec<usize> =
        store.document().point("1").unwrap().keys().map(|s| desk.frames.binary_search(s).unwrap()).collect();
    assert_eq!(frames, [0, 1, 3, 4]);
    assert!(desk.path("a.json.journal.damaged-2").exists());
}

#[cfg(unix)]
#[test]
fn one_file_has_one_writer_whatever_it_is_called() {
    let desk = Desk::new();
    let mut store = desk.open("a.json").unwrap();
    desk.place(&mut store, "1", 0, 1.0);
    let store = desk.save(store);
    drop(store);
    std::os::unix::fs::symlink(desk.path("a.json"), desk.path("link.json")).unwrap();
    fs::hard_link(desk.path("a.json"), desk.path("hard.json")).unwrap();
    let mut store = desk.open("a.json").unwrap();
    for name in ["link.json", "hard.json"] {
        let other = desk.open(name).unwrap();
        assert!(other.read_only().is_some(), "{name}");
        assert_eq!(other.document(), store.document());
    }
    assert!(!desk.path("hard.json.journal").exists() && !desk.path("link.json.journal").exists());
    // Saved, the names part: the hard link is another file from then on.
    desk.place(&mut store, "1", 1, 2.0);
    let work = store.begin_save().unwrap().unwrap();
    let result = work.run();
    store.end_save(&work, result);
    assert!(desk.open("hard.json").unwrap().read_only().is_none());
    assert!(desk.open("link.json").unwrap().read_only().is_some());
    drop(store);
    let mut through = desk.open("link.json").unwrap();
    desk.place(&mut through, "1", 2, 3.0);
    drop(desk.save(through));
    assert_eq!(desk.open("a.json").unwrap().document().point("1").unwrap().len(), 3);
    assert!(fs::symlink_metadata(desk.path("link.json")).unwrap().is_symlink());
}

#[test]
fn looking_leaves_no_trace() {
    let desk = Desk::new();
    let store = desk.open("a.json").unwrap();
    drop(desk.save(store));
    assert_eq!(fs::read_dir(desk.folder.path()).unwrap().count(), 0);
    fs::write(desk.path("other.json"), r#"{"schema": "vice.labels/1", "camera": "cam1", "points": []}"#)
        .unwrap();
    desk.says("other.json", &["other.json", "camera cam1, not of cam0"]);
    assert_eq!(fs::read_dir(desk.folder.path()).unwrap().count(), 1);
}

#[test]
fn a_csv_goes_on_in_a_json() {
    let desk = Desk::new();
    let csv = format!("point,timestamp_ns,u_px,v_px,keyframe\na b,{},1,2,1\n", desk.frames[4]);
    fs::write(desk.path("a.csv"), &csv).unwrap();
    let mut store = desk.open("a.csv").unwrap();
    assert_eq!(store.document().point("a b").unwrap().len(), 1);
    desk.place(&mut store, "1", 0, 10.0);
    drop(store);
    let store = desk.open("a.csv").unwrap();
    assert_eq!(store.document().points().len(), 2);
    drop(desk.save(store));
    assert_eq!(fs::read_to_string(desk.path("a.csv")).unwrap(), csv);
    assert_eq!(vice_files::labels::read(desk.path("a.json"), None).unwrap().points().len(), 2);
    assert_eq!(desk.open("a.csv").unwrap().document().points().len(), 2);
    desk.says("none/b.json", &["folder"]);
    desk.says("b.txt", &[".csv, .json or .parquet"]);
}

#[test]
fn labels_of_something_else_are_refused() {
    let desk = Desk::new();
    let write = |name: &str, text: String| fs::write(desk.path(name), text).unwrap();
    let labels = |dataset: &str, stamp: Stamp| {
        format!(
            r#"{{"schema": "vice.labels/1", "dataset": "{dataset}", "points": [{{"name": "0", "observations": [{{"timestamp_ns": {stamp}, "px": [1, 2]}}]}}]}}"#
        )
    };
    let elsewhere = Stamp::from_nanos(5);
    write("other.json", labels("other", elsewhere));
    desk.says("other.json", &["data set other, not of flight"]);
    write("none.json", labels("flight", elsewhere));
    desk.says("none.json", &["none of the labels is at a frame"]);
    write("renamed.json", labels("other", desk.frames[0]));
    assert_eq!(desk.open("renamed.json").unwrap().document().dataset.as_deref(), Some("other"));
    write("newer.json", r#"{"schema": "vice.labels/2", "points": []}"#.into());
    desk.says("newer.json", &["newer.json", "newer than this program"]);
    write("broken.json", "{\"schema\": ".into());
    desk.says("broken.json", &["broken.json", "not the JSON expected"]);
    write("empty.json", String::new());
    desk.says("empty.json", &["empty.json"]);
    write("locked.json", labels("flight", desk.frames[0]));
    let mut permissions = fs::metadata(desk.path("locked.json")).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(desk.path("locked.json"), permissions).unwrap();
    desk.says("locked.json", &["locked.json", "read-only"]);
}

#[test]
fn another_program_is_not_written_over() {
    let desk = Desk::new();
    let mut store = desk.open("a.json").unwrap();
    desk.place(&mut store, "1", 0, 10.0);
    drop(desk.save(store));
    // Nothing is unsaved: the other program's file counts.
    let other = fs::read_to_string(desk.path("a.json")).unwrap().replace("10.0", "20.0");
    fs::write(desk.path("a.json"), &other).unwrap();
    let mut store = desk.open("a.json").unwrap();
    assert_eq!(store.document().get("1", desk.frames[0]).unwrap().px.u, 20.0);
    assert!(!store.can_undo());
    desk.place(&mut store, "1", 0, 30.0);
    // Changed while it is open: not written over, and nothing is lost.
    let changed = other.replace("20.0", "40.0");
    fs::write(desk.path("a.json"), &changed).unwrap();
    let store = Arc::new(Mutex::new(store));
    let finished =
        Saver::start(Arc::clone(&store), Duration::from_secs(60), Box::new(|_| {})).unwrap().finish();
    assert!(finished.unwrap_err().to_string().contains("another program"));
    assert!(lock(&store).save_problem().is_some());
    drop(store);
    assert_eq!(fs::read_to_string(desk.path("a.json")).unwrap(), changed);
    desk.says("a.json", &["changed by another program", "1 changes"]);
    fs::remove_file(desk.path("a.json")).unwrap();
    let store = desk.open("a.json").unwrap();
    assert_eq!(store.document().get("1", desk.frames[0]).unwrap().px.u, 30.0);
    drop(desk.save(store));
    assert!(fs::read_to_string(desk.path("a.json")).unwrap().contains("30.0"));
}

#[test]
fn the_second_only_reads() {
    let desk = Desk::new();
    let mut first = desk.open("a.json").unwrap();
    desk.place(&mut first, "1", 0, 10.0);
    let mut second = desk.open("a.json").unwrap();
    assert!(second.read_only().unwrap().contains("another vice annotate"));
    assert_eq!(second.document(), first.document());
    let refused = desk.edit(&mut second, Edit::RemovePoint { point: "1".into() });
    assert!(matches!(refused, Err(StoreError::ReadOnly(_))));
    assert!(matches!(second.undo(1), Err(StoreError::ReadOnly(_))));
    drop(first);
    assert!(desk.open("a.json").unwrap().read_only().is_none());
}

#[derive(Clone, Debug)]
enum Act {
    Edit(Edit),
    Undo,
    Redo,
    Reopen,
    Save,
}

fn any_act() -> impl Strategy<Value = Act> {
    let point = || prop::sample::select(vec!["1", "2", "x"]).prop_map(str::to_string);
    let frame = || 0..FRAMES;
    prop_oneof![
        6 => (point(), frame(), 0.0..99.0_f64, 0.0..79.0_f64)
            .prop_map(|(point, frame, u, v)| Act::Edit(Edit::Place { point, frame, u, v })),
        1 => (point(), frame()).prop_map(|(point, frame)| Act::Edit(Edit::Delete { point, frame })),
        1 => (point(), frame()).prop_map(|(point, frame)| Act::Edit(Edit::DeleteAfter { point, frame })),
        2 => (point(), frame(), 0.0..99.0_f64, any::<bool>())
            .prop_map(|(point, frame, u, suggested)| Act::Edit(Edit::Spawn { point, frame, u, v: 7.0, suggested })),
        1 => (point(), frame(), frame())
            .prop_map(|(point, frame, to)| Act::Edit(Edit::DeleteRange { point, frame, to })),
        1 => point().prop_map(|point| Act::Edit(Edit::RemovePoint { point })),
        1 => (point(), point()).prop_map(|(point, to)| Act::Edit(Edit::Rename { point, to })),
        3 => Just(Act::Undo),
        2 => Just(Act::Redo),
        1 => Just(Act::Reopen),
        1 => Just(Act::Save),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn undo_and_redo_walk_the_same_way_whenever_it_is_reopened(acts in prop::collection::vec(any_act(), 1..40)) {
        let desk = Desk::new();
        let mut store = desk.open("a.json").unwrap();
        // The model: all states, and which of them holds.
        let (mut states, mut at) = (vec![store.document().clone()], 0);
        for act in acts {
            let known = store.revision();
            match act {
                Act::Edit(edit) => {
                    if desk.edit(&mut store, edit).is_ok_and(|c| c.revision > known) {
                        states.truncate(at + 1);
                        states.push(store.document().clone());
                        at += 1;
                    }
                }
                Act::Undo => if store.undo(known).is_ok() { at -= 1 } else { prop_assert_eq!(at, 0) },
                Act::Redo => if store.redo(known).is_ok() { at += 1 } else { prop_assert_eq!(at, states.len() - 1) },
                Act::Reopen => {
                    drop(store);
                    store = desk.open("a.json").unwrap();
                    prop_assert_eq!(store.revision(), known);
                }
                Act::Save => {
                    drop(desk.save(store));
                    store = desk.open("a.json").unwrap();
                }
            }
            prop_assert_eq!(store.document(), &states[at]);
        }
    }
}
