//! Pose streams and depth for the annotator, as a request asks for them: its labels change while it runs.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use vice_core::camera::Pixel;
use vice_core::dataset::GROUND_TRUTH;
use vice_core::depth::{DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult};
use vice_core::evaluate::{EvaluateError, Evaluation, Observations, Selection, Window, evaluate};
use vice_core::frames::WorldFromCamera;
use vice_core::label::{LabelRow, LabelSet, Observation};
use vice_core::metrics::align::Alignment;
use vice_core::result::{Evaluated, Role};
use vice_core::time::Stamp;
use vice_core::track::{lift, track};
use vice_run::error::{RunError, RunResult};
use vice_run::open::Opened;
use vice_run::request::DepthName;
use vice_run::request::{EstimateSpec, ReferenceSpec, Request};
use vice_run::streams::LoadedStreams;

use crate::estimates::{Dot, Estimates, ProjectedStream, Projections, SkipCount, StreamKind};

/// Streams that belong to the labels' first key frame and last label.
type LoadedFor = (Option<Stamp>, Option<Stamp>, Arc<LoadedStreams>);

/// How far a surface may be from the floor to be taken for it: a share of the depth, and metres.
const ON_FLOOR: (f64, f64) = (0.02, 0.03);

/// What a request asks for, asked again whenever the labels change.
pub(crate) struct SceneEstimates {
    request: Request,
    opened: Opened,
    depth: Box<dyn DepthSource>,
    /// What is seen, where something knows; made when it is first asked.
    surface: OnceLock<Option<Box<dyn DepthSource>>>,
    /// Whether dots are wanted: otherwise only depth is.
    projects: bool,
    /// Streams before anything is labelled.
    first: Arc<LoadedStreams>,
    loaded: Mutex<Option<LoadedFor>>,
    depths: Mutex<BTreeMap<(usize, u64, u64), Option<f64>>>,
}

impl SceneEstimates {
    /// `None` where neither a reference nor an estimate is there, nor a depth camera.
    pub(crate) fn open(request: &Request, opened: &Opened, chosen: &[usize]) -> RunResult<Option<Self>> {
        let dataset = opened.dataset.as_ref();
        let has_truth = dataset.streams().iter().any(|s| s == GROUND_TRUTH);
        let has_reference = match request.streams.reference {
            ReferenceSpec::None => false,
            ReferenceSpec::Named(_) => true,
            ReferenceSpec::Default => has_truth,
        };
        let asked = !request.streams.estimates.is_empty();
        let chosen_depth = request.depth.sources.first();
        if !(asked || has_reference) {
            return match chosen_depth {
                Some(depth) => {
                    Err(RunError::usage("depth", format!("{depth}: the data set has no reference"))
                        .advise("name a pose stream with `estimate` or `reference`"))
                }
                None => Ok(None),
            };
        }
        let source = request.depth.make(chosen_depth.copied().unwrap_or(DepthName::Floor), opened)?;
        let labels = stand_in(opened, chosen, has_truth)?;
        let selection = Selection::new(&labels, &opened.frames, &opened.camera, &Window::default())?;
        let mut first = request.streams.load(opened, &selection)?;
        request.streams.check_world(opened, &mut first, &selection, &[source.as_ref()])?;
        for suspicion in first.suspicions.iter() {
            tracing::warn!("{}", suspicion.line());
        }
        drop(selection);
        Ok(Some(Self {
            request: request.clone(),
            opened: opened.clone(),
            projects: asked || chosen_depth.is_some(),
            depth: source,
            surface: OnceLock::new(),
            first: Arc::new(first),
            loaded: Mutex::default(),
            depths: Mutex::default(),
        }))
    }

    /// The streams for a selection: the same ones, unless they start at its first key frame.
    fn streams_for(&self, selection: &Selection<'_>) -> DataResult<Arc<LoadedStreams>> {
        let spec = &self.request.streams;
        if !spec.estimates.contains(&EstimateSpec::ImuEuler) && spec.initial_pose.is_none() {
            return Ok(Arc::clone(&self.first));
        }
        let last = selection.stamp_range(&self.opened.frames).map(|(_, last)| last);
        let mut loaded = self.loaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((first, end, streams)) = loaded.as_ref()
            && (*first, *end) == (selection.first_keyframe(), last)
        {
            return Ok(Arc::clone(streams));
        }
        let streams = spec.load(&self.opened, selection).map_err(|e| {
            DataError::of_kind(e.kind(), "the pose streams cannot be loaded for these labels").because(e)
        })?;
        let streams = Arc::new(streams);
        *loaded = Some((selection.first_keyframe(), last, Arc::clone(&streams)));
        Ok(streams)
    }

    fn evaluate(&self, labels: &LabelSet) -> Result<Evaluated, EvaluateError> {
        let opened = &self.opened;
        // While labels are placed the doubtful ones are what one looks at.
        let window = Window { observations: Observations::All, ..Window::default() };
        let selection = Selection::new(labels, &opened.frames, &opened.camera, &window)?;
        let streams = self.streams_for(&selection)?;
        let (rig, depths) = (opened.rig(), [self.depth.as_ref()]);
        let evaluation = Evaluation::builder(&rig, &opened.camera, &opened.frames, &selection)
            .streams(&streams.list)
            .anchor(streams.anchor)
            .own_anchors(streams.own_anchors)
            .depths(&depths)
            .max_gap(self.request.streams.max_gap)
            .align(Alignment::None)
            .keep_samples(true)
            .build();
        evaluate(&evaluation, &|_, _| {})
    }

    fn ask(&self, source: &dyn DepthSource, frame: usize, pixels: &[Pixel]) -> DataResult<Vec<Option<f64>>> {
        let opened = &self.opened;
        let camera = (opened.camera_name.as_str(), &opened.camera);
        let pose = self.first.list.get(self.first.anchor).and_then(|anchor| {
            anchor.trajectory.pose_at(opened.frames[frame], self.request.streams.max_gap).ok()
        });
        let keyframe = Keyframe::at(opened.dataset.as_ref(), camera, (frame, opened.frames[frame]), pose)?;
        let depths = source.depths(&keyframe, pixels)?;
        Ok(depths.into_iter().map(|d| d.ok().map(|d| d.z_m)).collect())
    }

    /// The depth camera, else the scan.
    fn surface(&self) -> Option<&dyn DepthSource> {
        let made = self.surface.get_or_init(|| {
            let dataset = self.opened.dataset.as_ref();
            let has_depth = dataset.has_depth(&self.opened.camera_name);
            let name = if has_depth { DepthName::ZCam } else { DepthName::ZMap };
            if !has_depth && !dataset.cloud().is_ok_and(|c| c.is_some()) {
                return None;
            }
            match self.request.depth.make(name, &self.opened) {
                Ok(source) => Some(source),
                Err(error) => {
                    let why = vice_core::error::one_line(&error);
                    tracing::warn!("suggested points may lie off the floor: {why}");
                    None
                }
            }
        });
        made.as_deref()
    }

    fn kind(role: Role) -> StreamKind {
        match role {
            Role::Reference => StreamKind::Reference,
            Role::Estimate => StreamKind::OnBoard,
        }
    }

    fn projections(&self, document: &Evaluated) -> Projections {
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
                    frame: self.opened.frames.binary_search(&s.timestamp_ns).ok()?,
                    u: s.tracked_px.u,
                    v: s.tracked_px.v,
                    error_px: Some(s.error_px),
                })
            }));
        }
        projections.skips = skips.into_iter().map(|(reason, count)| SkipCount { reason, count }).collect();
        projections
    }

    /// Where a stream has the camera at a frame.
    fn world_from_camera(&self, stream: usize, frame: usize) -> Option<WorldFromCamera> {
        let stamp = self.opened.frames[frame];
        let pose =
            self.first.list.get(stream)?.trajectory.pose_at(stamp, self.request.streams.max_gap).ok()?;
        Some(pose * self.opened.dataset.body_from_camera(&self.opened.camera_name, stamp).ok()?)
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
            Err(error) => Err(DataError::new("the labels cannot be evaluated").because(error)),
        }
    }

    fn depths(&self, frame: usize, pixels: &[Pixel]) -> DataResult<Vec<Option<f64>>> {
        self.ask(self.depth.as_ref(), frame, pixels)
    }

    fn on_floor(&self, frame: usize, pixels: &[Pixel]) -> Option<Vec<bool>> {
        let surface = self.uses_floor().then(|| self.surface()).flatten()?;
        let floor = self.depths(frame, pixels).ok()?;
        let seen = self.ask(surface, frame, pixels).ok()?;
        let near = |(floor, seen): (Option<f64>, Option<f64>)| match (floor, seen) {
            (Some(floor), Some(seen)) => (floor - seen).abs() <= ON_FLOOR.0 * floor + ON_FLOOR.1,
            _ => false,
        };
        Some(floor.into_iter().zip(seen).map(near).collect())
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
        let point = lift(&self.opened.camera, px, z_m?).ok()?;
        track(&self.opened.camera, &at, &now, &point).ok()
    }
}

/// Labels that stand for those to come: streams that start at the first key frame need one.
fn stand_in(opened: &Opened, chosen: &[usize], has_truth: bool) -> RunResult<LabelSet> {
    let stamps: Vec<Stamp> = chosen.iter().map(|f| opened.frames[*f]).collect();
    // The reference may start after the images do.
    let from = if has_truth { opened.dataset.trajectory(GROUND_TRUTH)?.start() } else { Stamp::MIN };
    let first = stamps.iter().find(|s| **s >= from).or(stamps.first()).copied().unwrap_or_default();
    let last = stamps.last().copied().unwrap_or_default().max(first);
    let px = Pixel::new(0.0, 0.0);
    let mut rows = vec![Observation::manual(first, px).as_keyframe()];
    if last > first {
        rows.push(Observation::manual(last, px));
    }
    let rows = rows.into_iter().map(|observation| LabelRow { point: "0".to_string(), observation });
    LabelSet::from_rows(rows).map_err(|e| RunError::usage("labels", "cannot begin here").because(e))
}
