//! Times by round, and their ratios as a table.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;
use vice_core::statistics::{quantile, sorted};

use crate::sizes::Sizes;

/// Who was timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    Ours,
    /// OpenCV from C++.
    Cpp,
    /// Plain loops in C++ for the same formulas.
    Strong,
    Python,
}

/// A row of the table: a case of ours against one of theirs, and the ratio that is asked for.
struct Row {
    case: &'static str,
    ours: (Side, &'static str),
    theirs: (Side, &'static str),
    what: &'static str,
    goal: Option<f64>,
}

const fn row(
    case: &'static str,
    ours: &'static str,
    theirs: (Side, &'static str),
    what: &'static str,
    goal: Option<f64>,
) -> Row {
    Row { case, ours: (Side::Ours, ours), theirs, what, goal }
}

const ROWS: [Row; 18] = [
    row(
        "project, radtan",
        "project",
        (Side::Cpp, "project"),
        "C++ `cv::projectPoints`, no Jacobian",
        Some(12.0),
    ),
    row(
        "move and project, radtan",
        "project moved",
        (Side::Cpp, "project moved"),
        "the same with a rotation",
        Some(12.0),
    ),
    row(
        "move and project, radtan",
        "project moved",
        (Side::Python, "project moved"),
        "Python `cv2.projectPoints`",
        None,
    ),
    row("unproject, radtan", "unproject", (Side::Cpp, "unproject"), "C++ `cv::undistortPoints`", Some(30.0)),
    row("unproject, radtan", "unproject", (Side::Python, "unproject"), "Python `cv2.undistortPoints`", None),
    row("equation 1, radtan", "track", (Side::Cpp, "track"), "C++ OpenCV, both and a loop", None),
    row("equation 1, radtan", "track", (Side::Python, "track"), "OpenCV with NumPy", Some(40.0)),
    row("project, radtan", "project", (Side::Strong, "project"), "plain C++ loop", Some(0.95)),
    row(
        "unproject, radtan",
        "unproject",
        (Side::Strong, "unproject"),
        "plain C++ loop: seed and two steps",
        Some(0.87),
    ),
    row(
        "unproject, equidistant",
        "unproject equidistant",
        (Side::Strong, "unproject equidistant"),
        "plain C++ loop, `-ffast-math`: three steps",
        Some(0.87),
    ),
    row(
        "equation 1, radtan",
        "track",
        (Side::Strong, "sum"),
        "the plain loops' unproject and project",
        Some(0.83),
    ),
    row(
        "`vice trajectory --align se3`",
        "trajectory",
        (Side::Python, "trajectory"),
        "`evo_ape tum --align`",
        Some(20.0),
    ),
    row(
        "`vice trajectory --align se3`",
        "trajectory",
        (Side::Python, "trajectory in process"),
        "evo's functions, imports not counted",
        None,
    ),
    row("whole depth image of a scan", "zmap", (Side::Python, "zmap"), "SciPy `LinearNDInterpolator`", None),
    row(
        "reading a binary PLY",
        "ply",
        (Side::Python, "ply"),
        "plyfile, copied into an array of doubles",
        None,
    ),
    row("the same", "ply", (Side::Python, "ply mapped"), "plyfile, mapped and not yet read", None),
    row(
        "tracking a corner, 21x21",
        "pyrlk",
        (Side::Cpp, "pyrlk"),
        "C++ `cv::calcOpticalFlowPyrLK`",
        Some(1.0),
    ),
    row(
        "tracking a corner, 21x21",
        "pyrlk",
        (Side::Python, "pyrlk"),
        "Python `cv2.calcOpticalFlowPyrLK`",
        Some(1.0),
    ),
];

/// Points of a case and its time in each round.
type Times = BTreeMap<(Side, String), (usize, Vec<Option<f64>>)>;

/// All that was measured.
#[derive(Default)]
pub(crate) struct Rounds {
    count: usize,
    times: Times,
    pub(crate) sizes: Sizes,
    machines: BTreeMap<u64, f64>,
}

impl Rounds {
    pub(crate) fn start(&mut self) {
        self.count += 1;
    }

    /// The time of a case in this round.
    pub(crate) fn add(&mut self, side: Side, name: &str, n: usize, seconds: f64) {
        let (points, times) = self.times.entry((side, name.to_string())).or_default();
        *points = n;
        times.resize(self.count, None);
        times[self.count - 1] = Some(seconds);
    }

    /// The machine's limits with a number of threads; the best of the rounds.
    pub(crate) fn machine(&mut self, machine: &Value) {
        let Some(threads) = machine["threads"].as_u64() else { return };
        let best = self.machines.entry(threads).or_default();
        *best = best.max(machine["memcpy_bytes_per_second"].as_f64().unwrap_or(0.0));
    }

    fn ratios(&self, theirs: (Side, &str), ours: (Side, &str)) -> Vec<f64> {
        let get = |(side, name): (Side, &str)| self.times.get(&(side, name.to_string()));
        let (Some((n, theirs)), Some((m, ours))) = (get(theirs), get(ours)) else { return vec![] };
        let ratios = theirs
            .iter()
            .zip(ours)
            .filter_map(|(t, o)| Some(((*t)? / *n as f64) / ((*o)? / *m as f64)))
            .collect();
        sorted(ratios)
    }

    /// The best time of a point, nanoseconds.
    fn best_ns(&self, side: Side, name: &str) -> Option<f64> {
        let (n, times) = self.times.get(&(side, name.to_string()))?;
        let best = times.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        Some(best * 1e9 / *n as f64)
    }

    /// The tables, in Markdown.
    pub(crate) fn render(&self, points: usize, missing: &[String]) -> String {
        let mut text = format!(
            "{} rounds of {points} points; times are of one point or pose in one thread, the best of all rounds; ratios are \
             taken within a round: median (least to largest). Instructions: {}.\n\n",
            self.count,
            vice_core::lanes::instruction_set()
        );
        text.push_str("| case | ours ns | peer | peer ns | times faster | asked |\n| --- | --- | --- | --- | --- | --- |\n");
        for row in &ROWS {
            let ratios = self.ratios(row.theirs, row.ours);
            if ratios.is_empty() {
                continue;
            }
            let ns = |(side, name)| self.best_ns(side, name).map_or_else(String::new, significant);
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} |",
                row.case,
                ns(row.ours),
                row.what,
                ns(row.theirs),
                spread(&ratios),
                row.goal.map_or_else(String::new, |g| g.to_string()),
            );
        }
        let _ = write!(text, "\n{}", self.sizes.render());
        text.push('\n');
        for (threads, copy) in &self.machines {
            let _ = writeln!(
                text,
                "- {threads} thread{}: memcpy {:.1} GB/s (read and written)",
                if *threads == 1 { "" } else { "s" },
                copy / 1e9,
            );
        }
        for missing in missing {
            let _ = writeln!(text, "- missing: {missing}");
        }
        text
    }
}

pub(crate) fn significant(value: f64) -> String {
    if value < 10.0 {
        format!("{value:.2}")
    } else if value < 100.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

/// The median of sorted values, and their range.
pub(crate) fn spread(sorted: &[f64]) -> String {
    match (quantile(sorted, 0.5), sorted.first(), sorted.last()) {
        (Some(median), Some(least), Some(most)) => {
            format!("{} ({} to {})", significant(median), significant(*least), significant(*most))
        }
        _ => String::new(),
    }
}

const BEGIN: &str = "<!-- peers: begin -->\n";
const END: &str = "<!-- peers: end -->\n";

/// Puts the tables between the markers of a page.
pub(crate) fn replace(path: &Path, text: &str) -> Result<(), Box<dyn Error + Send + Sync>> {
    let page = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let parts = page.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
    let (before, after) = parts.ok_or_else(|| format!("{}: the markers are missing", path.display()))?;
    std::fs::write(path, format!("{before}{BEGIN}{text}{END}{after}"))?;
    Ok(())
}
