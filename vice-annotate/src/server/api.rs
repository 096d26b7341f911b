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
use vice_core::error::one_line;

use super::App;
use super::error::ApiError;
use super::wire::{ChangeWire, FrameWire, StateWire, empty, points};
use crate::exchange::{Exchange, ImportError, import};
use crate::jobs::{Accepted, DetectRequest, JobState, Jobs, Listener, TrackRequest};
use crate::notes::Stretch;
use crate::store::{By, Changed, Edit, Store, StoreError, lock};
use vice_track::DOUBT_CONFIDENCE;

/// Edits of one request at most.
const MAX_EDITS: usize = 10_000;

pub(super) type Answer = Result<Response, ApiError>;
pub(super) type Shared = State<Arc<App>>;
pub(super) type Body = Result<Bytes, BytesRejection>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EditsRequest {
    revision: u64,
    edits: Vec<Edit>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NoteRequest {
    point: String,
    from: usize,
    to: usize,
    nothing: bool,
}

#[derive(Deserialize)]
struct RevisionRequest {
    revision: u64,
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
            empty: empty(&lock(&desk.notes), &desk.frames),
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
    app.change(move |app, store| {
        let changed = store.edit(request.revision, &request.edits, &app.desk.checks())?;
        for edit in &request.edits {
            let Edit::Rename { point, to } = edit else { continue };
            // The labels have the new name already: a note that is lost is told, and can be said again.
            if let Err(error) = lock(&app.desk.notes).rename(point, to) {
                tracing::warn!("what was said of {point} is not said of {to}: {}", one_line(&error));
            }
        }
        Ok(changed)
    })
    .await
}

/// That there is nothing to label of a point from one frame to another, or that this no longer holds.
pub(super) async fn note(State(app): Shared, body: Body) -> Answer {
    let request: NoteRequest = parse(body)?;
    app.blocking(move |app| {
        let desk = &app.desk;
        if let Some(reason) = desk.read_only() {
            return Err(StoreError::ReadOnly(reason).into());
        }
        let (from, to) = (desk.checks().stamp(request.from)?, desk.checks().stamp(request.to)?);
        let mut notes = lock(&desk.notes);
        notes.say(&request.point, Stretch { from, to }, request.nothing)?;
        let empty = json!({ "empty": empty(&notes, &desk.frames) });
        // While the notes are locked: windows hear of them in order.
        app.hub.tell("notes", &empty);
        Ok(Json(empty).into_response())
    })
    .await
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

pub(super) async fn import_labels(
    State(app): Shared,
    Query(query): Query<FormatQuery>,
    body: Body,
) -> Answer {
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

impl App {
    /// Runs what may wait for the disk or the processor apart from the server's own thread.
    pub(super) async fn blocking<F>(self: &Arc<Self>, work: F) -> Answer
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

pub(super) async fn spawn<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, ApiError> {
    tokio::task::spawn_blocking(work).await.map_err(ApiError::internal)
}

pub(super) fn parse<T: DeserializeOwned>(body: Body) -> Result<T, ApiError> {
    let bytes = body.map_err(|e| ApiError::new(e.status(), e.body_text()))?;
    serde_json::from_slice(&bytes).map_err(|e| ApiError::bad(format!("the request is not understood: {e}")))
}
