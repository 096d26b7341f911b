//! Everything that says what is evaluated, for each command that runs the pipeline.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use vice_core::dataset::{Dataset, Floor};
use vice_core::depth::DepthSource;
use vice_core::evaluate::{
    EvaluateError, Evaluation, Observations, SampleSink, Selection, evaluate, evaluate_streaming,
};
use vice_core::metrics::align::Alignment;
use vice_core::result::{ResultDocument, Settings};

use super::{DatasetArgs, DepthArgs, LabelArgs, LoadedStreams, StreamArgs, load_streams, split_list};
use crate::terminal::{Verbosity, advance, usage};

/// Data set, labels, pose streams and depth.
#[derive(Debug, clap::Args)]
pub(crate) struct EvaluationArgs {
    #[command(flatten)]
    pub(crate) dataset: DatasetArgs,
    #[command(flatten)]
    pub(crate) labels: LabelArgs,
    #[command(flatten)]
    pub(crate) streams: StreamArgs,
    /// Depth sources: floor, zmap, zcam, mesh, tag [default: floor].
    #[arg(long, value_name = "SOURCE,...", help_heading = "Depth")]
    pub(crate) depth: Vec<String>,
    #[command(flatten)]
    pub(crate) depth_options: DepthArgs,
}

/// How it is scored.
pub(crate) struct Scoring {
    /// Subset sizes; empty for those up to 3 that exist.
    pub(crate) subsets: Vec<usize>,
    pub(crate) align: Alignment,
    pub(crate) keep_samples: bool,
}

impl EvaluationArgs {
    /// Runs the pipeline; the data set comes with it for those who show its images. With a sink the samples go there, and
    /// the document has none.
    pub(crate) fn evaluate(
        &self,
        scoring: &Scoring,
        verbosity: Verbosity,
        sink: Option<&mut SampleSink<'_>>,
    ) -> anyhow::Result<(ResultDocument, Arc<dyn Dataset>)> {
        let dataset = self.dataset.open()?;
        let document = self.with_evaluation_of(&dataset, scoring, |evaluation, _| {
            let bar = verbosity.progress("evaluating");
            let progress = |done, total| {
                advance(&bar, done, total);
            };
            let document = match sink {
                Some(sink) => evaluate_streaming(evaluation, &progress, sink)?,
                None => evaluate(evaluation, &progress)?,
            };
            bar.finish_and_clear();
            Ok(document)
        })?;
        Ok((document, dataset))
    }

    /// Opens everything that an evaluation needs and hands it to `work`.
    pub(crate) fn with_evaluation<T>(
        &self,
        scoring: &Scoring,
        work: impl FnOnce(&Evaluation<'_>, &LoadedStreams) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        self.with_evaluation_of(&self.dataset.open()?, scoring, work)
    }

    fn with_evaluation_of<T>(
        &self,
        dataset: &Arc<dyn Dataset>,
        scoring: &Scoring,
        work: impl FnOnce(&Evaluation<'_>, &LoadedStreams) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let calibration = self.depth_options.calibration()?;
        let floor = self.depth_options.floor()?;
        let used = self.dataset.used_camera(dataset.as_ref(), calibration.as_ref())?;
        tracing::info!(
            "{} ({}): camera {} with {} frames",
            dataset.name(),
            dataset.format(),
            used.name,
            used.frames.len()
        );
        let labels = self.labels.read(&used.frames)?;
        tracing::info!("{} points with {} labels", labels.points().len(), labels.observation_count());
        let in_labels = |error: EvaluateError| match error {
            EvaluateError::Data(error) => anyhow::Error::new(error),
            error => anyhow::Error::new(error).context(self.labels.labels.display().to_string()),
        };
        let selection =
            Selection::new(&labels, &used.frames, &used.camera, &self.labels.window()).map_err(in_labels)?;
        if let Some(asked) = scoring.subsets.iter().find(|n| **n > selection.point_count()) {
            let points = selection.point_count();
            return Err(usage(EvaluateError::SubsetTooLarge { asked: *asked, points }.to_string()));
        }
        let world_depth = self.asks_for_the_world(dataset.as_ref(), &selection)?;
        let calibrated = calibration.as_ref();
        let streams =
            load_streams(&self.streams, dataset.as_ref(), &used, &selection, calibrated, world_depth)?;
        for stream in &streams.list {
            let t = &stream.trajectory;
            tracing::info!("stream {}: {} poses, {} to {} ns", stream.name, t.len(), t.start(), t.end());
        }
        let sources = self.depth_options.sources("--depth", &self.depth, dataset, &used.name)?;
        let sources: Vec<&dyn DepthSource> = sources.iter().map(AsRef::as_ref).collect();
        let settings = Settings {
            dataset: Some(self.dataset.path.display().to_string()),
            labels: self.labels.labels.display().to_string(),
            points: labels.points().iter().map(|p| p.name.clone()).collect(),
            fps: self.labels.fps,
            start_s: self.labels.start.as_secs_f64(),
            duration_s: self.labels.duration.map(|d| d.as_secs_f64()),
            max_gap_s: self.streams.max_gap.as_secs_f64(),
            time_offset_s: streams.time_offset.as_secs_f64(),
            align: scoring.align.name().to_string(),
            anchor: streams.list[streams.anchor].name.clone(),
            calibration: self.depth_options.calibration.as_ref().map(|p| p.display().to_string()),
            floor_plane: self.depth_options.floor_plane,
            zmap_occlusion: self.depth_options.zmap_occlusion,
            estimate_frame: self.streams.estimate_frame.clone(),
            other: self.other_settings(&scoring.subsets),
        };
        let evaluation = Evaluation {
            dataset: dataset.as_ref(),
            camera_name: &used.name,
            camera: &used.camera,
            body_from_camera: used.body_from_camera,
            frames: &used.frames,
            selection: &selection,
            streams: &streams.list,
            anchor: streams.anchor,
            depths: &sources,
            floor,
            max_gap: self.streams.max_gap,
            subsets: (!scoring.subsets.is_empty()).then_some(scoring.subsets.as_slice()),
            align: scoring.align,
            keep_samples: scoring.keep_samples,
            settings,
        };
        work(&evaluation, &streams)
    }

    /// Whether a depth source needs the camera's place in the world: a depth camera and a floor under the body do not.
    fn asks_for_the_world(&self, dataset: &dyn Dataset, selection: &Selection<'_>) -> anyhow::Result<bool> {
        let names = split_list(&self.depth);
        let floor_in_world = || -> anyhow::Result<bool> {
            let Some(stamp) = selection.first_keyframe() else { return Ok(true) };
            let given = self.depth_options.floor_plane.is_some();
            Ok(given || matches!(dataset.floor(stamp)?, Floor::World(_)))
        };
        if names.iter().any(|n| n == "zmap" || n == "mesh") {
            return Ok(true);
        }
        Ok((names.is_empty() || names.iter().any(|n| n == "floor")) && floor_in_world()?)
    }

    /// Options that have no field of their own in the document.
    fn other_settings(&self, subsets: &[usize]) -> BTreeMap<String, String> {
        let mut other: BTreeMap<String, String> =
            self.dataset.settings.iter().map(|(key, value)| (format!("set {key}"), value.clone())).collect();
        other.insert("estimate".to_string(), split_list(&self.streams.estimate).join(","));
        if !self.labels.points.is_empty() {
            other.insert("points".to_string(), split_list(&self.labels.points).join(","));
        }
        if let Some(reference) = &self.streams.reference {
            other.insert("reference".to_string(), reference.clone());
        }
        if !self.streams.estimate_as.is_empty() {
            let list = vice_core::conventions::list_text(&self.streams.estimate_as);
            other.insert("estimate-as".to_string(), list);
        }
        if let Some(times) = &self.streams.times {
            other.insert("times".to_string(), times.display().to_string());
        }
        if let Some(pose) = &self.streams.initial_pose {
            other.insert("initial-pose".to_string(), pose.map(|v| v.to_string()).join(","));
        }
        if !subsets.is_empty() {
            let sizes: Vec<String> = subsets.iter().map(usize::to_string).collect();
            other.insert("subsets".to_string(), sizes.join(","));
        }
        if self.labels.observations != Observations::All {
            other.insert("observations".to_string(), self.labels.observations.name().to_string());
        }
        if let Some(voxel_m) = self.depth_options.cloud_voxel {
            other.insert("cloud-voxel".to_string(), voxel_m.to_string());
        }
        if let Some([near, far]) = self.depth_options.zcam_range {
            other.insert("zcam-range".to_string(), format!("{near},{far}"));
        }
        if let Some(size_m) = self.depth_options.tag_size {
            other.insert("tag-size".to_string(), size_m.to_string());
            other.insert("tag-family".to_string(), self.depth_options.tag_family.name().to_string());
        }
        other
    }

    /// What is read, and so must not be written over: files, and the whole data set.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let mut files = vec![self.dataset.path.clone(), self.labels.labels.clone()];
        let specs = split_list(&self.streams.estimate).into_iter().chain(self.streams.reference.clone());
        files.extend(specs.map(|spec| PathBuf::from(spec.strip_prefix("rel:").unwrap_or(&spec))));
        files.extend(self.streams.times.iter().chain(&self.depth_options.calibration).cloned());
        files.push(PathBuf::from(&self.streams.estimate_frame));
        files
    }
}
