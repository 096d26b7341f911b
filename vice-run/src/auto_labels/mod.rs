//! Labels without a hand: points of a recording are chosen, followed and checked against each other ([`vice_track::auto`]).
//!
//! No estimate is asked. A reference places the camera where the depth source needs that, only to tell where labels may
//! start.

mod cache;
mod given;
mod ground;
mod summary;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::label::{LabelRow, LabelSet, Observation, ObservationSource, Provenance};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::Span;
use vice_files::atomic::Overwrite;
use vice_files::labels;
use vice_track::auto::{Auto, AutoOptions, AutoReport, Timeline, auto_labels};
use vice_track::{DOUBT_CONFIDENCE, tracker_version};

use crate::error::{RunError, RunResult};
use crate::progress::Progress;
use crate::request::{
    DEFAULT_MAX_GAP, DEFAULT_POINTS, DatasetSpec, DepthSpec, MOST_POINTS, Protocol, ReferenceSpec,
};
use crate::scene::Scene;

pub(crate) use cache::{Remembered, labels_of};

use given::Givens;
use ground::{Film, Grounds};

/// Where fewer points follow one motion (the median over the pairs of frames) something else moves, or nothing holds.
const LOW_AGREEMENT: f64 = 0.75;
/// Where more of the pairs have too few points that is said.
const MANY_UNCHECKED: f64 = 0.2;

/// What is labelled, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackingSpec {
    /// The recording.
    pub dataset: DatasetSpec,
    /// The part of it that is labelled.
    #[serde(default)]
    pub protocol: Protocol,
    /// Points at any time; `None`: those of `from`, or [`DEFAULT_POINTS`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    /// Labels that are gone on from, and kept as they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<PathBuf>,
    /// The depth that is to be known where a label starts; no source: what the recording has, a depth camera before a scan.
    #[serde(default)]
    pub depth: DepthSpec,
    /// What places the camera for depth that needs it.
    #[serde(default)]
    pub reference: ReferenceSpec,
    /// Widest gap between two of its poses that is interpolated, seconds.
    #[serde(default = "default_max_gap", rename = "max_gap_s", with = "crate::request::seconds")]
    pub max_gap: Span,
}

const fn default_max_gap() -> Span {
    DEFAULT_MAX_GAP
}

impl Default for TrackingSpec {
    fn default() -> Self {
        Self {
            dataset: DatasetSpec::default(),
            protocol: Protocol::default(),
            points: None,
            from: None,
            depth: DepthSpec::default(),
            reference: ReferenceSpec::default(),
            max_gap: DEFAULT_MAX_GAP,
        }
    }
}

/// Labels, and how they came about.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// All labels: those that were gone on from, unchanged, and the new ones with the source `auto`.
    pub labels: LabelSet,
    /// How many points there are at any time.
    pub points: usize,
    /// Frames that are labelled.
    pub frames: usize,
    /// Where labels may start.
    pub ground: String,
    /// How it went.
    pub report: AutoReport,
    /// What a user should know before trusting them.
    pub suspicions: Suspicions,
}

impl TrackingSpec {
    /// Refuses what makes no sense, whatever the data.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage.
    pub fn check(&self) -> RunResult<()> {
        self.protocol.check()?;
        self.depth.check(&[])?;
        if self.depth.sources.len() > 1 {
            return Err(RunError::usage("depth", "labels start where one source has depth; name one"));
        }
        if let Some(points) = self.points.filter(|n| !(1..=MOST_POINTS).contains(n)) {
            return Err(RunError::usage("points", format!("{points} is not within 1 to {MOST_POINTS}")));
        }
        Ok(())
    }

    /// Labels the recording.
    ///
    /// # Errors
    /// [`RunError`] if something cannot be read, the window is empty, or nothing can be followed.
    pub fn run(&self, progress: &Progress<'_>) -> RunResult<Tracked> {
        self.check()?;
        let scene = Scene::open(&self.dataset, &self.reference, self.max_gap)?;
        self.run_on(&scene, progress)
    }

    /// The same, of a recording that is open.
    ///
    /// # Errors
    /// As [`TrackingSpec::run`].
    pub fn run_on(&self, scene: &Scene, progress: &Progress<'_>) -> RunResult<Tracked> {
        let opened = &scene.opened;
        let chosen = self.protocol.frames(opened)?;
        let (Some(first), Some(last)) = (chosen.first().copied(), chosen.last().copied()) else {
            return Err(RunError::missing("no frame is chosen"));
        };
        let stamps = &opened.frames[first..=last];
        let is_chosen: Vec<bool> = (first..=last).map(|f| chosen.binary_search(&f).is_ok()).collect();
        let timeline = Timeline::new(stamps, &is_chosen);
        let from = self.from.as_ref().map(|file| Givens::read(file, opened)).transpose()?;
        let given = from.as_ref().map(|g| g.in_window(stamps)).unwrap_or_default();
        let points = self.point_count(given.len())?;
        let grounds = Grounds::new(&self.depth, scene)?;
        let film = Film { opened, first, grounds: &grounds };
        let options = AutoOptions {
            points,
            given: &given,
            progress: &|done, total| progress("following", done, total),
        };
        let auto = auto_labels(&film, &opened.camera, &timeline, &options)
            .map_err(|e| RunError::from(e.at(vice_files::address::shown_path(&self.dataset.path))))?;
        // What was gone on from may have been all there is.
        if from.is_none() && auto.points.iter().all(Vec::is_empty) {
            return Err(RunError::missing(format!(
                "{}: no point could be followed in {} frames{}",
                opened.dataset.name(),
                chosen.len(),
                grounds.why_nothing()
            ))
            .advise("see `depth`, `start` and `duration`"));
        }
        let labels = merged(from.as_ref(), &auto, stamps, opened)?;
        let mut suspicions = suspicions(&auto.report, &film, opened.dataset.name());
        suspicions.extend(grounds.suspicions());
        suspicions.extend(from.into_iter().flat_map(|g| g.suspicions));
        let (frames, ground) = (chosen.len(), grounds.name());
        Ok(Tracked { labels, points, frames, ground, report: auto.report, suspicions })
    }

    fn point_count(&self, given: usize) -> RunResult<usize> {
        match (self.points, given) {
            (Some(points), given) if points < given => Err(RunError::usage(
                "points",
                format!("{points} is less than the {given} points of the labels that are gone on from"),
            )),
            (Some(points), _) => Ok(points),
            (None, 0) => Ok(DEFAULT_POINTS),
            (None, given) => Ok(given),
        }
    }

    /// Labels the recording and writes them, all or nothing. A file that is there is refused unless `overwrite` says so.
    ///
    /// # Errors
    /// As [`TrackingSpec::run`], and if the file cannot be written.
    pub fn run_to_file(
        &self,
        out: &Path,
        overwrite: Overwrite,
        progress: &Progress<'_>,
    ) -> RunResult<Tracked> {
        self.check()?;
        labels::LabelFormat::for_writing(out)?;
        if overwrite == Overwrite::Refuse && out.exists() {
            return Err(RunError::usage("out", format!("{} exists already", out.display()))
                .advise("`force` replaces it; or name another file"));
        }
        if self.from.as_ref().is_some_and(|from| is_same(from, out)) {
            return Err(RunError::usage("out", format!("{} is what is gone on from", out.display()))
                .advise("name another file"));
        }
        let scene = Scene::open(&self.dataset, &self.reference, self.max_gap)?;
        let tracked = self.run_on(&scene, progress)?;
        labels::write_with_frames(out, &tracked.labels, Some(&scene.opened.frames), overwrite)?;
        Ok(tracked)
    }
}

fn is_same(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// What was there, and what is new.
fn merged(
    from: Option<&Givens>,
    auto: &Auto,
    stamps: &[vice_core::time::Stamp],
    opened: &crate::open::Opened,
) -> RunResult<LabelSet> {
    let names = names(from, auto.points.len());
    let new = auto.points.iter().zip(&names).flat_map(|(labels, name)| {
        labels.iter().filter(|l| opened.camera.contains(l.px)).map(|label| LabelRow {
            point: name.clone(),
            observation: Observation {
                source: ObservationSource::Auto,
                keyframe: label.keyframe,
                uncertain: label.confidence < DOUBT_CONFIDENCE,
                provenance: Provenance {
                    confidence: Some(label.confidence.clamp(0.0, 1.0)),
                    tracker_version: tracker_version(),
                    seeded: false,
                },
                ..Observation::manual(stamps[label.position], label.px)
            },
        })
    });
    let there = from.into_iter().flat_map(|g| g.labels.points()).flat_map(|p| {
        p.observations
            .iter()
            .map(|o| LabelRow { point: p.name.clone(), observation: Observation { line: 0, ..o } })
    });
    let mut labels = LabelSet::from_rows(there.chain(new))
        .map_err(|e| RunError::usage("from", "the labels do not fit together").because(e))?;
    labels.dataset = Some(opened.dataset.name().to_string());
    labels.camera = Some(opened.camera_name.clone());
    Ok(labels)
}

/// Names of the points: those of the file, then `auto1` and so on, as far as they are free.
fn names(from: Option<&Givens>, count: usize) -> Vec<String> {
    let given: Vec<String> = from.map(Givens::names).unwrap_or_default();
    let free = (1..).map(|n| format!("auto{n}")).filter(|name| !given.contains(name));
    given.iter().cloned().chain(free).take(count.max(given.len())).collect()
}

/// What should be known before the labels are trusted.
fn suspicions(report: &AutoReport, film: &Film<'_>, name: &str) -> Suspicions {
    let mut suspicions = Suspicions::new();
    if let Some([median, least]) = report.agreement.filter(|[median, _]| *median < LOW_AGREEMENT) {
        suspicions.add(
            Suspicion::new("labels-disagree", name, "many points do not move as one rigid scene does")
                .evidence(format!(
                    "{:.0} % of the points follow one motion (median over {} pairs of frames; {:.0} % at worst)",
                    100.0 * median,
                    report.pairs,
                    100.0 * least
                ))
                .advice("something else than the camera may move, and labels lie on what most points are on: look at them"),
        );
    }
    if report.pairs > 0 && report.pairs_unchecked as f64 > MANY_UNCHECKED * report.pairs as f64 {
        suspicions.add(
            Suspicion::new(
                "labels-unchecked",
                name,
                "too few points are in view to hold them against each other",
            )
            .evidence(format!("{} of {} pairs of frames", report.pairs_unchecked, report.pairs))
            .advice("what moves in the scene cannot be told from a wrong pose there: look at the labels"),
        );
    }
    for (what, list) in
        [("could not be decoded", &report.undecoded), ("have no depth that can be read", &report.groundless)]
    {
        if let Some((position, reason)) = list.first() {
            suspicions.add(
                Suspicion::new("frames-left-out", name, format!("{} frames {what}", list.len()))
                    .evidence(format!("the first is frame {}: {reason}", film.first + position)),
            );
        }
    }
    suspicions
}
