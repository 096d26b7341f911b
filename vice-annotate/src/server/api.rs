//! What the page asks for, one function each.

use std::sync::Arc;

use axum::Json;
use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use vice_core::camera::Pixel;

use super::App;
use super::error::ApiError;
use super::wire::{ChangeWire, FrameWire, StateWire, points};
use crate::desk::Desk;
use crate::exchange::{Exchange, ImportError, import};
use crate::jobs::{Accepted, DetectRequest, JobState, Jobs, Listener, TrackRequest};
use crate::store::{By, Changed, Edit, Store, StoreError, lock};
use vice_track::{DOUBT_CONFIDENCE, Pyramid, SuggestOptions, suggest};

/// Edits of one request at most.
const MAX_EDITS: usize = 10_000;
/// Suggestions of one request at most.
const MAX_SUGGESTIONS: usize = 64;

type Answer = Result<Response, ApiError>;
type Shared = State<Arc<App>>;
type Body = Result<Bytes, BytesRejection>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EditsRequest {
    revision: u64,
    edits: Vec<Edit>,
}

#[derive(Deserialize)]
struct RevisionRequest {
    revision: u64,
}

#[derive(Deserialize)]
pub(super) struct SuggestQuery {
    frame: usize,
    count: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct FormatQuery {
    format: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ImportRequest {
    content: String,
    #[serde(default)]
    encoding: Encoding,
    #[serde(default)]
    replace: bool,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
enum Encoding {
    #[default]
    Text,
    Base64,
}

pub(super) async fn state(State(app): Shared) -> Answer {
    app.blocking(|app| {
        let desk = &app.desk;
        let first = desk.chosen.first().map(|f| desk.frames[*f]).unwrap_or_default();
        let store = desk.store();
        let frames = desk.chosen.iter().map(|frame| {
            let stamp = desk.frames[*frame];
            FrameWire { frame: *frame, stamp_ns: stamp.to_string(), time_s: stamp.since(first).as_secs_f64() }
        });
        let state = StateWire {
            revision: store.revision(),
            dataset: desk.dataset.name(),
            format: desk.dataset.format(),
            camera: &desk.camera_name,
            width: desk.camera.width(),
            height: desk.camera.height(),
            labels_file: store.path().display().to_string(),
            writable: store.read_only().is_none(),
            read_only_reason: store.read_only().map(str::to_string),
            save_problem: store.save_problem().map(str::to_string),
            frames: frames.collect(),
            points: points(store.document(), &desk.frames),
            can_undo: store.can_undo(),
            can_redo: store.can_redo(),
            floor_suggestions: desk.estimates.as_ref().is_some_and(|e| e.uses_floor()),
            depth_known: desk.estimates.is_some(),
            streams: desk.estimates.as_ref().map(|e| e.streams()).unwrap_or_default(),
            jobs: app.jobs.states(),
            doubt_below: DOUBT_CONFIDENCE,
            version: env!("CARGO_PKG_VERSION"),
            keys: &app.keys,
        };
        Ok(Json(state).into_response())
    })
    .await
}

pub(super) async fn frame(State(app): Shared, Path(frame): Path<usize>) -> Answer {
    if frame >= app.desk.frames.len() {
        let count = app.desk.frames.len();
        return Err(ApiError::new(
            StatusCode::NOT_FOUND,
            format!("frame {frame} does not exist: there are {count}"),
        ));
    }
    let picture = app.frames.get(frame).await?;
    let headers = [
        (header::CONTENT_TYPE, picture.content_type),
        (header::CACHE_CONTROL, "private, max-age=86400, immutable"),
    ];
    Ok((headers, picture.bytes).into_response())
}

pub(super) async fn events(State(app): Shared) -> Answer {
    Ok(app.hub.events(app.closing.subscribe()).into_response())
}

pub(super) async fn edits(State(app): Shared, body: Body) -> Answer {
    let request: EditsRequest = parse(body)?;
    if request.edits.len() > MAX_EDITS {
        return Err(ApiError::bad(format!("{} edits are more than {MAX_EDITS}", request.edits.len())));
    }
    app.change(move |app, store| store.edit(request.revision, &request.edits, &app.desk.checks())).await
}

pub(super) async fn undo(State(app): Shared, body: Body) -> Answer {
    let request: RevisionRequest = parse(body)?;
    app.change(move |app, store| {
        // What a job would add after this would not be what was taken back.
        app.jobs.stop_all();
        store.undo(request.revision)
    })
    .await
}

pub(super) async fn redo(State(app): Shared, body: Body) -> Answer {
    let request: RevisionRequest = parse(body)?;
    app.change(move |app, store| {
        app.jobs.stop_all();
        store.redo(request.revision)
    })
    .await
}

pub(super) async fn track(State(app): Shared, body: Body) -> Answer {
    let request: TrackRequest = parse(body)?;
    let accepting = Arc::clone(&app);
    let (accepted, state) = spawn(move || accepting.jobs.accept(&accepting.desk, request)).await??;
    Ok(app.started(accepted, state))
}

pub(super) async fn detect(State(app): Shared, body: Body) -> Answer {
    let request: DetectRequest = parse(body)?;
    let accepting = Arc::clone(&app);
    let (accepted, state) = spawn(move || accepting.jobs.accept_detect(&accepting.desk, &request)).await??;
    Ok(app.started(accepted, state))
}

pub(super) async fn stop(State(app): Shared, Path(job): Path<u64>) -> Answer {
    if app.jobs.stop(job) {
        Ok(StatusCode::NO_CONTENT.into_response())
    } else {
        Err(ApiError::new(StatusCode::NOT_FOUND, format!("there is no job {job}")))
    }
}

pub(super) async fn suggestions(State(app): Shared, Query(query): Query<SuggestQuery>) -> Answer {
    let count = query.count.unwrap_or(4).min(MAX_SUGGESTIONS);
    app.blocking(move |app| {
        let desk = &app.desk;
        let stamp = desk.checks().stamp(query.frame)?;
        let image = Pyramid::for_tracking(&desk.dataset.image(&desk.camera_name, query.frame)?)?;
        let taken: Vec<Pixel> = {
            let store = desk.store();
            store.document().points().filter_map(|(_, o)| Some(o.get(&stamp)?.px)).collect()
        };
        let depth = |pixels: &[Pixel]| -> Option<Vec<Option<f64>>> {
            desk.estimates.as_ref()?.depths(query.frame, pixels).ok()
        };
        // Where no stream has a pose there is no depth either.
        let has_depth = |px: Pixel| {
            desk.estimates.is_none() || depth(&[px]).is_some_and(|z| z.iter().all(Option::is_some))
        };
        let floor = FloorMask::new(desk, query.frame);
        let on_floor = |px: Pixel| floor.as_ref().is_none_or(|f| f.holds(px)) && has_depth(px);
        // Points off the floor are better than none, and so are those without depth: another frame may know it.
        let on_surest = match (&desk.estimates, &floor) {
            (None, _) => "any",
            (Some(_), Some(_)) => "floor",
            (Some(e), None) if e.uses_floor() => "below-horizon",
            (Some(_), None) => "depth",
        };
        let accepts: [(&str, &dyn Fn(Pixel) -> bool); 3] =
            [(on_surest, &on_floor), ("depth", &has_depth), ("any", &|_| true)];
        let (lie, found) = accepts
            .into_iter()
            .map(|(lie, accept)| {
                let options = SuggestOptions { taken: &taken, accept, ..SuggestOptions::default() };
                (lie, suggest(&image, count, &options))
            })
            .find(|(_, found)| !found.is_empty())
            .unwrap_or(("any", vec![]));
        let pixels: Vec<Pixel> = found.iter().map(|s| s.px).collect();
        let depths = depth(&pixels).unwrap_or_else(|| vec![None; pixels.len()]);
        let list: Vec<_> = found
            .iter()
            .zip(depths)
            .map(|(s, z)| json!({ "u": s.px.u, "v": s.px.v, "score": s.score, "depth_m": z }))
            .collect();
        Ok(Json(json!({ "suggestions": list, "lie": lie })).into_response())
    })
    .await
}

pub(super) async fn projections(State(app): Shared) -> Answer {
    app.blocking(|app| {
        let text = app.projections()?;
        Ok(([(header::CONTENT_TYPE, "application/json")], text.to_string()).into_response())
    })
    .await
}

pub(super) async fn export(State(app): Shared, Query(query): Query<FormatQuery>) -> Answer {
    let format = Exchange::from_name(&query.format)?;
    app.blocking(move |app| {
        let (labels, stem) = {
            let store = app.desk.store();
            let stem = store.path().file_stem().map(|s| s.to_string_lossy().into_owned());
            (store.document().labels()?, stem.unwrap_or_else(|| "labels".to_string()))
        };
        let bytes = format.write(&labels, &app.desk)?;
        let (extension, content_type) = format.kind();
        let plain: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let headers = [
            (header::CONTENT_TYPE, content_type.to_string()),
            (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{plain}.{extension}\"")),
        ];
        Ok((headers, bytes).into_response())
    })
    .await
}

pub(super) async fn bring_in(State(app): Shared, Query(query): Query<FormatQuery>, body: Body) -> Answer {
    let format = Exchange::from_name(&query.format)?;
    let request: ImportRequest = parse(body)?;
    app.blocking(move |app| {
        let bytes = match request.encoding {
            Encoding::Text => request.content.into_bytes(),
            Encoding::Base64 => STANDARD
                .decode(&request.content)
                .map_err(|e| ApiError::bad(format!("the content is no base64: {e}")))?,
        };
        let labels = format.read(&bytes, &app.desk.frames)?;
        let mut store = app.desk.store();
        let cells = import(&labels, store.document(), &app.desk, request.replace).map_err(|e| match e {
            ImportError::Clash(_) => {
                let hint = "import them as replacements, or rename the points here";
                ApiError::new(StatusCode::CONFLICT, e.to_string()).hint(hint)
            }
            ImportError::Refused(error) => error.into(),
        })?;
        let names: Vec<&str> = labels.points().iter().map(|p| p.name.as_str()).collect();
        let label = format!("import {}", names.join(", "));
        let changed = store.commit(By::Import, label, None, cells)?;
        app.told(&store, &changed)
    })
    .await
}

/// Where a frame shows the floor, on a grid: asking for each corner by itself would be slow.
struct FloorMask {
    columns: usize,
    on: Vec<bool>,
}

impl FloorMask {
    /// Pixels from one place of the grid to the next.
    const STEP: u32 = 8;

    fn new(desk: &Desk, frame: usize) -> Option<Self> {
        let steps = |side: u32| (0..side).step_by(Self::STEP as usize).map(f64::from);
        let columns = steps(desk.camera.width()).count();
        let grid: Vec<Pixel> = steps(desk.camera.height())
            .flat_map(|v| steps(desk.camera.width()).map(move |u| Pixel::new(u, v)))
            .collect();
        let on = desk.estimates.as_ref()?.on_floor(frame, &grid)?;
        Some(Self { columns, on })
    }

    /// Whether the floor is seen on all sides of a pixel.
    fn holds(&self, px: Pixel) -> bool {
        let step = f64::from(Self::STEP);
        let (column, row) = ((px.u.max(0.0) / step) as usize, (px.v.max(0.0) / step) as usize);
        let at = |c: usize, r: usize| {
            let place = r * self.columns + c.min(self.columns.saturating_sub(1));
            self.on.get(place).or(self.on.last()).copied().unwrap_or(false)
        };
        [(0, 0), (1, 0), (0, 1), (1, 1)].iter().all(|(c, r)| at(column + c, row + r))
    }
}

impl App {
    /// Runs what may wait for the disk or the processor apart from the server's own thread.
    async fn blocking<F>(self: &Arc<Self>, work: F) -> Answer
    where
        F: FnOnce(&Self) -> Answer + Send + 'static,
    {
        let app = Arc::clone(self);
        spawn(move || work(&app)).await?
    }

    /// Runs a job in the background and answers with it.
    fn started(self: &Arc<Self>, accepted: Accepted, state: JobState) -> Response {
        let running = Arc::clone(self);
        tokio::spawn(async move {
            // One job after the other: each keeps all processors busy.
            let Ok(_permit) = running.job_permits.acquire().await else { return };
            let app = Arc::clone(&running);
            let run = spawn(move || Jobs::run(&app.desk, &app.hub, &accepted)).await;
            if let Err(error) = run {
                tracing::error!("a job ended unexpectedly: {error:?}");
            }
        });
        self.hub.job(&state);
        (StatusCode::ACCEPTED, Json::<JobState>(state)).into_response()
    }

    async fn change<F>(self: &Arc<Self>, change: F) -> Answer
    where
        F: FnOnce(&Self, &mut Store) -> Result<Changed, StoreError> + Send + 'static,
    {
        self.blocking(move |app| {
            let mut store = app.desk.store();
            let changed = change(app, &mut store)?;
            app.told(&store, &changed)
        })
        .await
    }

    /// Answers with a change, and tells the other windows while the labels are still locked: in order, that is.
    fn told(&self, store: &Store, changed: &Changed) -> Answer {
        if !changed.points.is_empty() {
            self.hub.changed(store, changed);
        }
        Ok(Json(ChangeWire::new(store, changed, &self.desk.frames)).into_response())
    }

    /// The projections of the labels as they are, worked out once for each revision.
    fn projections(&self) -> Result<Arc<str>, ApiError> {
        let Some(estimates) = self.desk.estimates.as_ref().filter(|e| !e.streams().is_empty()) else {
            return Ok("null".into());
        };
        // Held while working: whoever asks meanwhile gets the same answer.
        let mut kept = lock(&self.projections);
        let (revision, labels) = {
            let store = self.desk.store();
            (store.revision(), store.document().labels()?)
        };
        if let Some((of, text)) = kept.as_ref().filter(|(of, _)| *of == revision) {
            debug_assert_eq!(*of, revision);
            return Ok(Arc::clone(text));
        }
        let projections = estimates.project(&labels)?;
        let text: Arc<str> = serde_json::to_string(&projections).map_err(ApiError::internal)?.into();
        *kept = Some((revision, Arc::clone(&text)));
        Ok(text)
    }
}

async fn spawn<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, ApiError> {
    tokio::task::spawn_blocking(work).await.map_err(ApiError::internal)
}

fn parse<T: DeserializeOwned>(body: Body) -> Result<T, ApiError> {
    let bytes = body.map_err(|e| ApiError::new(e.status(), e.body_text()))?;
    serde_json::from_slice(&bytes).map_err(|e| ApiError::bad(format!("the request is not understood: {e}")))
}
