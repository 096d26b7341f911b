//! From a request to what the pipeline takes, and through it to a document.

use vice_core::depth::DepthSource;
use vice_core::evaluate::{EvaluateError, Evaluation, SampleSink, Selection, evaluate, evaluate_streaming};
use vice_core::label::LabelSet;
use vice_core::suspicion::Suspicions;
use vice_files::{address, labels};

use crate::auto_labels::{Remembered, TrackingSpec, labels_of};
use crate::error::{Context, RunError, RunResult};
use crate::label_noise::{put_into, read_floor};
use crate::open::Opened;
use crate::place::Place;
use crate::progress::Progress;
use crate::request::{DepthName, DepthSpec, LabelsSpec, Request, points_asked};
use crate::result::{OWN_ANCHOR, ResultDocument, Used};
use crate::scene::Scene;
use crate::streams::LoadedStreams;
use crate::tracking_summary::TrackingSummary;

/// Evaluates a request.
///
/// # Errors
/// [`RunError`] if something that is asked for is not there, cannot be read or fits nothing else.
pub fn evaluate_request(request: &Request, progress: &Progress<'_>) -> RunResult<ResultDocument> {
    request.evaluate(&request.open()?, Samples::Keep, progress)
}

/// What becomes of the scored samples, of which a long run has millions.
pub enum Samples<'a> {
    /// The document lists them.
    Keep,
    /// They are left out.
    Drop,
    /// They go to this sink as they come, and the document has none.
    Stream(&'a mut SampleSink<'a>),
}

impl LabelsSpec {
    /// Reads the labels, or those of the chosen points; and what looks wrong in them.
    ///
    /// # Errors
    /// [`RunError`] if the file cannot be read, or has not the points that are asked for.
    pub fn read(&self, opened: &Opened) -> RunResult<(LabelSet, Suspicions)> {
        if self.file.as_os_str().is_empty() {
            return Err(RunError::usage("labels", "no file of labels is named"));
        }
        let (labels, suspicions) = match opened.in_memory.labels(&self.file)? {
            Some(labels) => {
                if let Some(camera) = labels.camera.as_ref().filter(|c| **c != opened.camera_name) {
                    let problem = format!("are of camera {camera}, not of {}", opened.camera_name);
                    return Err(RunError::usage("labels", problem));
                }
                (labels.clone(), Suspicions::new())
            }
            None => {
                let place = Place::of_file(&self.file)?;
                let frames = Some(&*opened.frames);
                let file = place.told(match self.points.as_slice() {
                    [] => labels::read_file(place.path(), frames),
                    points => labels::read_points(place.path(), frames, points),
                })?;
                let shown = address::shown_path(&self.file);
                let file = file
                    .of_camera(&opened.camera_name, &opened.dataset.cameras())
                    .map_err(|e| e.at(&shown))?;
                file.check_image_size(opened.camera.width(), opened.camera.height())
                    .map_err(|e| e.at(shown))?;
                (file.labels, file.suspicions)
            }
        };
        self.chosen(labels, suspicions)
    }

    /// Those of the points that are asked for.
    fn chosen(&self, labels: LabelSet, suspicions: Suspicions) -> RunResult<(LabelSet, Suspicions)> {
        tracing::info!("{} points with {} labels", labels.points().len(), labels.observation_count());
        let are_chosen = labels.points().iter().all(|p| self.points.contains(&p.name));
        let are_all = self.points.iter().all(|name| labels.points().iter().any(|p| p.name == *name));
        if self.points.is_empty() || (are_chosen && are_all) {
            return Ok((labels, suspicions));
        }
        let chosen = labels.select(&self.points).map_err(|unknown| {
            let names: Vec<&str> = labels.points().iter().map(|p| p.name.as_str()).collect();
            RunError::usage("points", format!("there is no point {unknown}; there are {}", names.join(", ")))
        })?;
        Ok((chosen, suspicions))
    }
}

impl Request {
    /// Opens the recording that is asked about, once the request itself makes sense.
    ///
    /// # Errors
    /// [`RunError`] if the request contradicts itself or the recording cannot be opened.
    pub fn open(&self) -> RunResult<Opened> {
        self.check()?;
        self.dataset.open()
    }

    /// The labels: those of the file, or automatic ones, from the cache where they were made before. Automatic labels ask
    /// the reference where the camera is, for depth that needs that, and never an estimate.
    ///
    /// # Errors
    /// [`RunError`] if they cannot be read or made.
    pub fn labels(&self, opened: &Opened, progress: &Progress<'_>) -> RunResult<(LabelSet, Suspicions)> {
        let (labels, suspicions, _) = self.labels_and_tracking(opened, progress)?;
        Ok((labels, suspicions))
    }

    /// The same, with how automatic ones came about.
    fn labels_and_tracking(
        &self,
        opened: &Opened,
        progress: &Progress<'_>,
    ) -> RunResult<(LabelSet, Suspicions, Option<TrackingSummary>)> {
        let Some(points) = points_asked(&self.labels.file)? else {
            let (labels, suspicions) = self.labels.read(opened)?;
            return Ok((labels, suspicions, None));
        };
        let scene = Scene::of(opened.clone(), &self.streams.reference, self.streams.max_gap)?;
        let names = self.depth.names();
        // A point on the floor has depth by all sources; one elsewhere not by the floor.
        let asked = names.iter().find(|n| **n == DepthName::Floor).or(names.first());
        // What the labels give is nowhere known before there are labels.
        let asked = asked.filter(|name| **name != DepthName::Triangulated);
        let spec = TrackingSpec {
            dataset: self.dataset.clone(),
            protocol: self.protocol,
            points: Some(points),
            from: None,
            depth: DepthSpec { sources: asked.copied().into_iter().collect(), ..self.depth.clone() },
            reference: self.streams.reference.clone(),
            max_gap: self.streams.max_gap,
        };
        let Remembered { labels, summary, suspicions } = labels_of(&spec, &scene, progress)?;
        tracing::info!("{}", summary.text().trim_end().replace('\n', "; "));
        let (labels, suspicions) = self.labels.chosen(labels, suspicions)?;
        Ok((labels, suspicions, Some(summary)))
    }

    /// Runs the pipeline on the recording.
    ///
    /// # Errors
    /// [`RunError`] if what is asked for cannot be evaluated.
    pub fn evaluate(
        &self,
        opened: &Opened,
        samples: Samples<'_>,
        progress: &Progress<'_>,
    ) -> RunResult<ResultDocument> {
        let keep = matches!(samples, Samples::Keep);
        // Before the work, so that a mistake costs nothing.
        let label_noise_px = self.labels.noise.as_deref().map(read_floor).transpose()?;
        let (checks, not_made) = self.depth.make_checks(opened);
        let checks: Vec<&dyn DepthSource> = checks.iter().map(AsRef::as_ref).collect();
        self.with_evaluation(opened, keep, progress, |evaluation, streams, tracking| {
            let step = |done, total| progress("evaluating", done, total);
            let mut evaluation = *evaluation;
            evaluation.checks = &checks;
            let evaluation = &evaluation;
            let mut found = match samples {
                Samples::Stream(sink) => evaluate_streaming(evaluation, &step, sink)?,
                _ => evaluate(evaluation, &step)?,
            };
            found.suspicions.extend(streams.suspicions.clone());
            found.suspicions.extend(not_made);
            let used = Used {
                points: evaluation.selection.point_names().map(str::to_string).collect(),
                anchor: match streams.own_anchors {
                    true => OWN_ANCHOR.to_string(),
                    false => streams.list[streams.anchor].name.clone(),
                },
                time_offset_s: streams.time_offset.as_secs_f64(),
                align: evaluation.align.name().to_string(),
                label_noise_px,
                tracking: tracking.cloned(),
            };
            if let Some(floor_px) = label_noise_px {
                found.pixel.iter_mut().for_each(|part| put_into(part, floor_px));
            }
            Ok(ResultDocument::new(self.clone(), used, found))
        })
    }

    /// Opens everything that an evaluation needs and hands it to `work`.
    ///
    /// # Errors
    /// [`RunError`] if something is not there, cannot be read or does not fit, and that of `work`.
    pub fn with_evaluation<T>(
        &self,
        opened: &Opened,
        keep_samples: bool,
        progress: &Progress<'_>,
        work: impl FnOnce(&Evaluation<'_>, &LoadedStreams, Option<&TrackingSummary>) -> RunResult<T>,
    ) -> RunResult<T> {
        let (labels, in_labels_file, tracking) = self.labels_and_tracking(opened, progress)?;
        let in_labels = |error: EvaluateError| match error {
            EvaluateError::Data(error) => RunError::from(error),
            error => match Err::<(), _>(error)
                .context(|| address::shown_path(&self.labels.file).display().to_string())
            {
                Err(error) => error,
                Ok(()) => RunError::usage("labels", "cannot be used"),
            },
        };
        let selection =
            Selection::new(&labels, &opened.frames, &opened.camera, &self.window()).map_err(in_labels)?;
        if let Some(asked) = self.scoring.subsets.iter().find(|n| **n > selection.point_count()) {
            let points = selection.point_count();
            return Err(EvaluateError::SubsetTooLarge { asked: *asked, points }.into());
        }
        let mut streams = self.streams.load(opened, &selection)?;
        streams.suspicions.extend(in_labels_file.into_iter().chain(opened.suspicions()));
        for stream in &streams.list {
            let t = &stream.trajectory;
            tracing::info!("stream {}: {} poses, {} to {} ns", stream.name, t.len(), t.start(), t.end());
        }
        let sources = self.depth.make_all(opened)?;
        let sources: Vec<&dyn DepthSource> = sources.iter().map(AsRef::as_ref).collect();
        self.streams.check_world(opened, &mut streams, &selection, &sources)?;
        if self.scoring.align.is_some() {
            // What is asked for goes before what a stream would have by itself.
            streams.list.iter_mut().for_each(|s| s.align = None);
        }
        let rig = opened.rig();
        let evaluation = Evaluation::builder(&rig, &opened.camera, &opened.frames, &selection)
            .streams(&streams.list)
            .anchor(streams.anchor)
            .own_anchors(streams.own_anchors)
            .depths(&sources)
            .max_gap(self.streams.max_gap)
            .subsets((!self.scoring.subsets.is_empty()).then_some(self.scoring.subsets.as_slice()))
            .align(self.scoring.align.unwrap_or_default())
            .keep_samples(keep_samples)
            .build();
        work(&evaluation, &streams, tracking.as_ref())
    }
}
