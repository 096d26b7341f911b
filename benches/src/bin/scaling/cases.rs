//! The commands, and what grows.

use std::path::Path;

use crate::measure::Program;
use crate::{Result, bags, flight, pictures, surfaces};

const SIZES: [usize; 3] = [1_000, 10_000, 100_000];
/// Points of a flight whose frames grow.
const POINTS: usize = 4;
/// Frames of a flight whose points grow.
const FRAMES: usize = 10;

/// Makes data of a size in a folder, and says with which arguments the program runs there.
type Prepare = fn(&Path, usize, &Program) -> Result<Vec<String>>;

/// A command.
pub(crate) struct Case {
    pub(crate) command: &'static str,
    pub(crate) grows: &'static str,
    pub(crate) sizes: [usize; 3],
    pub(crate) prepare: Prepare,
    /// What a run leaves in the folder, where the next one would find it.
    pub(crate) made: &'static [&'static str],
    /// Why it may grow faster than what it is given.
    pub(crate) reason: Option<&'static str>,
}

const fn case(command: &'static str, grows: &'static str, prepare: Prepare) -> Case {
    Case { command, grows, sizes: SIZES, prepare, made: &[], reason: None }
}

fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(str::to_string).collect()
}

const EVALUATE: &str = "evaluate flight --labels labels.csv --estimate estimate.txt";

/// All of them.
pub(crate) fn all() -> Vec<Case> {
    let mut all: Vec<Case> = trajectories().into();
    all.extend(labels());
    all.extend(recordings());
    all.extend(surfaces());
    all.extend(pictures());
    all
}

fn trajectories() -> [Case; 6] {
    const TWO: &str = "trajectory reference.tum estimate.tum";
    [
        case("`trajectory`", "poses", |folder, n, _| {
            vice_benches::write_tum(&folder.join("reference.tum"), n, 0.0)?;
            vice_benches::write_tum(&folder.join("estimate.tum"), n, 0.02)?;
            Ok(words(&format!("{TWO} --align se3")))
        }),
        case("`trajectory`, all pairs by 170 degrees", "poses (30 matches each)", |folder, n, _| {
            flight::write_turning(folder, n)?;
            Ok(words(&format!("{TWO} --delta 170 --delta-unit degrees --all-pairs")))
        }),
        case("`trajectory`, all pairs by 1 metre", "poses", |folder, n, _| {
            flight::write_turning(folder, n)?;
            Ok(words(&format!("{TWO} --delta 1 --delta-unit meters --all-pairs")))
        }),
        case("`trajectory`, all pairs by 1 second", "poses", |folder, n, _| {
            flight::write_turning(folder, n)?;
            Ok(words(&format!("{TWO} --delta 1 --delta-unit seconds --all-pairs")))
        }),
        case("`trajectory`, pairs by 10 degrees", "poses", |folder, n, _| {
            flight::write_turning(folder, n)?;
            Ok(words(&format!("{TWO} --delta 10 --delta-unit degrees")))
        }),
        case("`convert`", "poses", |folder, n, _| {
            flight::write(folder, n, 0)?;
            Ok(words("convert flight out.tum --stream ground-truth --to tum --force"))
        }),
    ]
}

/// A result document of so many labels.
fn result(folder: &Path, labels: usize, program: &Program) -> Result<()> {
    flight::write(folder, labels / POINTS, POINTS)?;
    program.run(folder, &words(&format!("{EVALUATE} --json result.json")))?;
    Ok(())
}

fn labels() -> [Case; 11] {
    [
        case("`evaluate`", "labels of 4 points", |folder, n, _| {
            flight::write(folder, n / POINTS, POINTS)?;
            Ok(words(EVALUATE))
        }),
        case("`evaluate --json`", "labels of 4 points", |folder, n, _| {
            flight::write(folder, n / POINTS, POINTS)?;
            Ok(words(&format!("{EVALUATE} --json -")))
        }),
        case("`evaluate`", "points, each in 10 frames", |folder, n, _| {
            flight::write(folder, FRAMES, n)?;
            Ok(words(EVALUATE))
        }),
        case("`evaluate --points` of 4", "points, each in 100 frames", |folder, n, _| {
            flight::write(folder, 10 * FRAMES, n / 10)?;
            Ok(words(&format!("{EVALUATE} --points 0,1,2,3")))
        }),
        case("`diagnose`", "labels of 4 points", |folder, n, _| {
            flight::write(folder, n / POINTS, POINTS)?;
            Ok(words("diagnose flight --labels labels.csv --estimate estimate.txt"))
        }),
        case("`sensitivity`", "labels of 4 points", |folder, n, _| {
            flight::write(folder, n / POINTS, POINTS)?;
            Ok(words("sensitivity flight --labels labels.csv --estimate estimate.txt"))
        }),
        case("`labels convert` to JSON", "labels of 4 points", |folder, n, _| {
            flight::write(folder, n / POINTS, POINTS)?;
            Ok(words("labels convert labels.csv out.json --force"))
        }),
        case("`labels convert` to CVAT", "points, each in 10 frames", |folder, n, _| {
            flight::write(folder, FRAMES, n)?;
            Ok(words("labels convert labels.csv out.xml --dataset flight --force"))
        }),
        case("`depth compare`", "labels of 4 points", |folder, n, _| {
            flight::write(folder, n / POINTS, POINTS)?;
            surfaces::write_mesh(folder, 2_000)?;
            Ok(words("depth compare flight --labels labels.csv --depth floor,mesh"))
        }),
        case("`report`", "labels of 4 points", |folder, n, program| {
            result(folder, n, program)?;
            Ok(words("report result.json --out -"))
        }),
        case("`compare`", "labels of 4 points", |folder, n, program| {
            result(folder, n, program)?;
            std::fs::copy(folder.join("result.json"), folder.join("again.json"))?;
            Ok(words("compare result.json again.json"))
        }),
    ]
}

fn recordings() -> [Case; 7] {
    [
        case("`check`", "frames", |folder, n, _| {
            flight::write(folder, n, 0)?;
            Ok(words("check flight --estimate estimate.txt"))
        }),
        Case {
            sizes: [10, 100, 1_000],
            made: &["out"],
            ..case("`batch`", "runs of 10 labels", |folder, n, _| {
                flight::write(folder, FRAMES, 1)?;
                flight::write_manifest(&folder.join("runs.csv"), n)?;
                Ok(words("batch runs.csv --out out --samples none"))
            })
        },
        case("`info` of a folder", "frames", |folder, n, _| {
            flight::write(folder, n, 0)?;
            Ok(words("info flight"))
        }),
        Case {
            // `tf/roots.rs` of the adapter counts its steps in a test.
            reason: Some("no step is repeated, but maps of names outgrow the caches"),
            ..case("`info` of a bag", "frames of tf in a chain", |folder, n, _| {
                bags::write_chain(&folder.join("run.bag"), n)?;
                Ok(words("info run.bag"))
            })
        },
        case("`info` of a bag", "topics", |folder, n, _| {
            bags::write_topics(&folder.join("run.bag"), n)?;
            Ok(words("info run.bag"))
        }),
        case("`info` of a bag", "robots with a tf each", |folder, n, _| {
            bags::write_robots(&folder.join("run.bag"), n)?;
            Ok(words("info run.bag"))
        }),
        case("`info` of a bag", "messages", |folder, n, _| {
            bags::write_messages(&folder.join("run.bag"), n)?;
            Ok(words("info run.bag"))
        }),
    ]
}

fn surfaces() -> [Case; 3] {
    [
        case("`depth --depth mesh`", "faces", |folder, n, _| {
            flight::write(folder, FRAMES, 1)?;
            surfaces::write_mesh(folder, n)?;
            Ok(words("depth flight --at 0 --depth mesh --out out"))
        }),
        Case {
            // With fewer points the camera sees none.
            sizes: [10_000, 100_000, 1_000_000],
            ..case("`depth --depth zmap`", "points of the scan", |folder, n, _| {
                flight::write(folder, FRAMES, 1)?;
                surfaces::write_scan(folder, n)?;
                Ok(words("depth flight --at 0 --depth zmap --out out"))
            })
        },
        case("`floor fit`", "points of the scan", |folder, n, _| {
            flight::write(folder, FRAMES, 1)?;
            surfaces::write_scan(folder, n)?;
            Ok(words("floor fit flight"))
        }),
    ]
}

/// Frames with pictures.
const PICTURES: [usize; 3] = [20, 60, 180];

/// A flight with pictures, as `vice synth` makes it.
fn synthetic(folder: &Path, frames: usize, program: &Program) -> Result<()> {
    program.run(folder, &words(&format!("synth flight --duration {} --rate 20", frames as f64 / 20.0)))?;
    Ok(())
}

fn pictures() -> [Case; 4] {
    let of_pictures = |command, prepare, made| Case {
        sizes: PICTURES,
        made,
        ..case(command, "frames with pictures", prepare)
    };
    [
        of_pictures(
            "`synth`",
            |_, n, _| Ok(words(&format!("synth flight --duration {} --rate 20", n as f64 / 20.0))),
            &["flight"],
        ),
        of_pictures(
            "`overlay` to a folder",
            |folder, n, program| {
                synthetic(folder, n, program)?;
                let streams = "--labels flight/labels/floor.csv --estimate flight/estimates/drift.txt";
                Ok(words(&format!("overlay flight {streams} --depth floor --out out")))
            },
            &["out"],
        ),
        of_pictures(
            "`labels track`",
            |folder, n, program| {
                synthetic(folder, n, program)?;
                Ok(words("labels track flight --depth floor --out out.json"))
            },
            &["out.json"],
        ),
        of_pictures(
            "`labels detect` of a chessboard",
            |folder, n, _| {
                flight::write(folder, n, 0)?;
                pictures::write_boards(folder, n)?;
                Ok(words("labels detect flight --chessboard 7x5 --out out.json"))
            },
            &["out.json"],
        ),
    ]
}
