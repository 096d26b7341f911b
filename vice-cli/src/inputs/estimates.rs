//! Pose streams and depth for the annotator: its labels change while it runs.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use vice_annotate::estimates::{Dot, Estimates, ProjectedStream, Projections, SkipCount, StreamKind};
use vice_core::camera::Pixel;
use vice_core::dataset::{Dataset, Floor, GROUND_TRUTH};
use vice_core::depth::{DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult};
use vice_core::evaluate::{EvaluateError, Evaluation, Selection, Window, evaluate};
use vice_core::frames::{BodyFromCamera, WorldFromCamera};
use vice_core::label::{LabelRow, LabelSet, Observation};
use vice_core::metrics::align::Alignment;
use vice_core::result::{ResultDocument, Role, Settings};
use vice_core::time::Stamp;
use vice_core::track::{lift, track};
use vice_files::calibration::CalibrationFile;

use super::open::UsedCamera;
use super::streams::{IMU_EULER, LoadedStreams};
use super::{DepthArgs, StreamArgs, load_streams, split_list};
use crate::terminal::usage;

/// Streams that belong to the labels' first key frame and last label.
type LoadedFor = (Option<Stamp>, Option<Stamp>, Arc<LoadedStreams>);

/// The program's options, asked again whenever the labels change.
pub(crate) struct SceneEstimates {
    dataset: Arc<dyn Dataset>,
    used: UsedCamera,
    args: StreamArgs,
    calibration: Option<CalibrationFile>,
    floor: Option<Floor>,
    depth: Box<dyn DepthSource>,
    /// Whether dots are wanted: otherwise only depth is.
    projects: bool,
    /// Streams before anything is labelled.
    first: Arc<LoadedStreams>,
    loaded: Mutex<Option<LoadedFor>>,
    depths: Mutex<BTreeMap<(usize, u64, u64), Option<f64>>>,
}

impl SceneEstimates {
    /// `None` where neither a reference nor an estimate is there, nor a depth camera.
    pub(crate) fn open(
        dataset: &Arc<dyn Dataset>,
        used: UsedCamera,
        chosen: &[usize],
        args: StreamArgs,
        depth: Option<&str>,
        depth_args: &DepthArgs,
        calibration: Option<CalibrationFile>,
    ) -> anyhow::Result<Option<Self>> {
        let has_truth = dataset.streams().iter().any(|s| s == GROUND_TRUTH);
        let has_reference = match args.reference.as_deref() {
            Some("none") => false,
            Some(_) => true,
            None => has_truth,
        };
        let asked = !split_list(&args.estimate).is_empty();
        if !(asked || has_reference) {
            return match depth {
                Some(depth) => Err(usage(format!(
                    "--depth {depth}: the data set has no reference; name a pose stream with --estimate or --reference"
                ))),
                None => Ok(None),
            };
        }
        let name = depth.unwrap_or("floor");
        let sources = depth_args.sources("--depth", &[name.to_string()], dataset, &used.name)?;
        let [source] = <[_; 1]>::try_from(sources)
            .map_err(|_| usage("--depth: the annotator takes one depth source".to_string()))?;
        let floor = depth_args.floor()?;
        let labels = stand_in(dataset.as_ref(), &used, chosen, has_truth)?;
        let selection = Selection::new(&labels, &used.frames, &used.camera, &Window::default())?;
        let world_depth = needs_world(source.as_ref(), floor, dataset.as_ref(), &selection)?;
        let first =
            load_streams(&args, dataset.as_ref(), &used, &selection, calibration.as_ref(), world_depth)?;
        drop(selection);
        Ok(Some(Self {
            dataset: Arc::clone(dataset),
            used,
            args,
            calibration,
            floor,
            depth: source,
            projects: asked || depth.is_some(),
            first: Arc::new(first),
            loaded: Mutex::default(),
            depths: Mutex::default(),
        }))
    }

    /// The streams for a selection: the same ones, unless they start at its first key frame.
    fn streams_for(&self, selection: &Selection<'_>) -> DataResult<Arc<LoadedStreams>> {
        let starts = split_list(&self.args.estimate).iter().any(|e| e == IMU_EULER);
        if !starts && self.args.initial_pose.is_none() {
            return Ok(Arc::clone(&self.first));
        }
        let last = selection.stamp_range(&self.used.frames).map(|(_, last)| last);
        let mut loaded = self.loaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((first, end, streams)) = loaded.as_ref()
            && (*first, *end) == (selection.first_keyframe(), last)
        {
            return Ok(Arc::clone(streams));
        }
        let calibration = self.calibration.as_ref();
        let streams =
            load_streams(&self.args, self.dataset.as_ref(), &self.used, selection, calibration, false)
                .map_err(|e| DataError::new(format!("{e:#}")))?;
        let streams = Arc::new(streams);
        *loaded = Some((selection.first_keyframe(), last, Arc::clone(&streams)));
        Ok(streams)
    }

    fn evaluate(&self, labels: &LabelSet) -> Result<ResultDocument, EvaluateError> {
        let selection = Selection::new(labels, &self.used.frames, &self.used.camera, &Window::default())?;
        let streams = self.streams_for(&selection)?;
        evaluate(
            &Evaluation {
                dataset: self.dataset.as_ref(),
                camera_name: &self.used.name,
                camera: &self.used.camera,
                body_from_camera: self.used.body_from_camera,
                frames: &self.used.frames,
                selection: &selection,
                streams: &streams.list,
                anchor: streams.anchor,
                depths: &[self.depth.as_ref()],
                floor: self.floor,
                max_gap: self.args.max_gap,
                subsets: None,
                align: Alignment::None,
                keep_samples: true,
                settings: Settings::default(),
            },
            &|_, _| {},
        )
    }

    fn kind(role: Role) -> StreamKind {
        match role {
            Role::Reference => StreamKind::Reference,
            Role::Estimate => StreamKind::OnBoard,
        }
    }

    fn projections(&self, document: &ResultDocument) -> Projections {
        let mut projections = Projections::default();
        let mut skips: BTreeMap<String, usize> = BTreeMap::new();
        for (stream, part) in document.pixel.iter().enumerate() {
            let means = part.rmse_px.iter().filter_map(|(n, rmse)| Some((*n, rmse.as_ref()?.mean)));
            projections.streams.push(ProjectedStream {
                name: part.stream.clone(),
                kind: Self::kind(part.role),
                rmse_px: (part.scored > 0).then(|| means.collect()),
            });
            for (reason, count) in part.skips_by_reason() {
                let most = skips.entry(reason.to_string()).or_default();
                *most = count.max(*most);
            }
            projections.dots.extend(part.samples.iter().filter_map(|s| {
                Some(Dot {
                    stream,
                    point: s.point.0.to_string(),
                    frame: self.used.frames.binary_search(&s.timestamp_ns).ok()?,
                    u: s.tracked_px.u,
                    v: s.tracked_px.v,
                    error_px: Some(s.error_px),
                })
            }));
        }
        projections.skips = skips.into_iter().map(|(reason, count)| SkipCount { reason, count }).collect();
        projections
    }

    fn body_from_camera(&self, stamp: Stamp) -> DataResult<BodyFromCamera> {
        match self.used.body_from_camera {
            Some(fixed) => Ok(fixed),
            None => self.dataset.body_from_camera(&self.used.name, stamp),
        }
    }

    /// Where a stream has the camera at a frame.
    fn world_from_camera(&self, stream: usize, frame: usize) -> Option<WorldFromCamera> {
        let stamp = self.used.frames[frame];
        let pose = self.first.list.get(stream)?.trajectory.pose_at(stamp, self.args.max_gap).ok()?;
        Some(pose * self.body_from_camera(stamp).ok()?)
    }
}

impl Estimates for SceneEstimates {
    fn streams(&self) -> Vec<String> {
        if self.projects { self.first.list.iter().map(|s| s.name.clone()).collect() } else { vec![] }
    }

    fn uses_floor(&self) -> bool {
        self.depth.name() == "floor"
    }

    fn project(&self, labels: &LabelSet) -> DataResult<Projections> {
        match self.evaluate(labels) {
            Ok(document) => Ok(self.projections(&document)),
            // Labelling has just begun.
            Err(
                EvaluateError::NoLabels
                | EvaluateError::NoKeyframe
                | EvaluateError::EmptyWindow
                | EvaluateError::NoOverlap { .. },
            ) => Ok(Projections {
                streams: self
                    .first
                    .list
                    .iter()
                    .map(|s| ProjectedStream {
                        name: s.name.clone(),
                        kind: Self::kind(s.role),
                        rmse_px: None,
                    })
                    .collect(),
                ..Projections::default()
            }),
            Err(EvaluateError::Data(error)) => Err(error),
            Err(error) => Err(DataError::new(error.to_string())),
        }
    }

    fn depths(&self, frame: usize, pixels: &[Pixel]) -> DataResult<Vec<Option<f64>>> {
        let stamp = self.used.frames[frame];
        let keyframe = Keyframe {
            stamp,
            frame,
            camera: &self.used.camera,
            body_from_camera: self.body_from_camera(stamp)?,
            world_from_camera: self.world_from_camera(self.first.anchor, frame),
            floor: match self.floor {
                Some(floor) => floor,
                None => self.dataset.floor(stamp)?,
            },
        };
        let depths = self.depth.depths(&keyframe, pixels)?;
        Ok(depths.into_iter().map(|d| d.ok().map(|d| d.z_m)).collect())
    }

    /// By the first stream, which is the reference where there is one.
    fn expect(&self, from: usize, px: Pixel, to: usize) -> Option<Pixel> {
        let key = (from, px.u.to_bits(), px.v.to_bits());
        let known = self.depths.lock().unwrap_or_else(PoisonError::into_inner).get(&key).copied();
        let z_m = match known {
            Some(z_m) => z_m,
            None => {
                let z_m = self.depths(from, &[px]).ok().and_then(|z| z.first().copied().flatten());
                self.depths.lock().unwrap_or_else(PoisonError::into_inner).insert(key, z_m);
                z_m
            }
        };
        let (at, now) = (self.world_from_camera(0, from)?, self.world_from_camera(0, to)?);
        let point = lift(&self.used.camera, px, z_m?).ok()?;
        track(&self.used.camera, &at, &now, &point).ok()
    }
}

/// Labels that stand for those to come: streams that start at the first key frame need one.
fn stand_in(
    dataset: &dyn Dataset,
    used: &UsedCamera,
    chosen: &[usize],
    has_truth: bool,
) -> anyhow::Result<LabelSet> {
    let stamps: Vec<Stamp> = chosen.iter().map(|f| used.frames[*f]).collect();
    // The reference may start after the images do.
    let from = if has_truth { dataset.trajectory(GROUND_TRUTH)?.start() } else { Stamp::MIN };
    let first = stamps.iter().find(|s| **s >= from).or(stamps.first()).copied().unwrap_or_default();
    let last = stamps.last().copied().unwrap_or_default().max(first);
    let px = Pixel::new(0.0, 0.0);
    let mut rows = vec![Observation::manual(first, px).as_keyframe()];
    if last > first {
        rows.push(Observation::manual(last, px));
    }
    let rows = rows.into_iter().map(|observation| LabelRow { point: "0".to_string(), observation });
    Ok(LabelSet::from_rows(rows)?)
}

fn needs_world(
    source: &dyn DepthSource,
    floor: Option<Floor>,
    dataset: &dyn Dataset,
    selection: &Selection<'_>,
) -> anyhow::Result<bool> {
    Ok(match (source.name(), selection.first_keyframe()) {
        ("zcam", _) => false,
        ("floor", Some(stamp)) => floor.is_some() || matches!(dataset.floor(stamp)?, Floor::World(_)),
        _ => true,
    })
}
