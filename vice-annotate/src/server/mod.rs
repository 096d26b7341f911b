//! The annotator for a browser: a server on this machine, for whoever was let in by one of its addresses.
//!
//! Frames are asked for by index, never by name. Every change is on the disk before it is answered.

mod api;
mod assets;
mod connections;
mod error;
mod events;
mod frames;
mod guard;
mod review;
mod suggestions;
mod wire;

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::Router;
use axum::extract::{DefaultBodyLimit, Path, State};
use axum::http::StatusCode;
use axum::middleware;
use axum::response::{IntoResponse, Response};
use axum::routing::{delete, get, post};
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, watch};
use vice_core::error::{DataError, DataResult};

use crate::desk::Desk;
use crate::jobs::Jobs;
use crate::review::{Review, Summary};
use crate::store::lock;
use error::ApiError;
use events::Hub;
use frames::Frames;
use guard::Guard;

pub use guard::Invitations;

/// Bytes of a request, but for imports.
const MAX_BODY: usize = 1 << 20;
/// Bytes of an import.
const MAX_IMPORT: usize = 64 << 20;
/// How long after a change the labels file is written.
const SAVE_DELAY: Duration = Duration::from_millis(300);
/// How long open connections may take to end.
const GRACE: Duration = Duration::from_secs(2);

/// How the server is reached.
#[derive(Clone, Debug)]
pub struct ServerOptions {
    /// The address to listen on: loopback, unless others are meant to reach it.
    pub bind: IpAddr,
    /// The port; 0 for one that is free.
    pub port: u16,
    /// Keys that replace the page's own, by action.
    pub keys: BTreeMap<String, Vec<String>>,
    /// So many observations are reviewed, blind; `None`: labels are made.
    pub review: Option<usize>,
}

/// Everything that requests share.
struct App {
    desk: Desk,
    jobs: Jobs,
    job_permits: Semaphore,
    hub: Hub,
    frames: Frames,
    keys: BTreeMap<String, Vec<String>>,
    projections: Mutex<Option<(u64, Arc<str>)>>,
    review: Option<Mutex<Review>>,
    closing: watch::Sender<bool>,
    guard: Arc<Guard>,
}

/// Serves until the program is asked to stop (Ctrl-C, or SIGTERM), then writes the labels file. `ready` gets what makes
/// addresses that let a browser in.
///
/// # Errors
/// [`DataError`] if the address cannot be used, there is nothing to review where that is asked for, or at the end if the
/// labels file cannot be written.
pub fn serve(
    desk: Desk,
    options: &ServerOptions,
    ready: impl FnOnce(&Invitations) -> DataResult<()>,
) -> DataResult<Option<Summary>> {
    let review = options.review.map(|count| Review::open(&desk, count)).transpose()?;
    if let Some(review) = review.as_ref().filter(|r| r.outdated() > 0) {
        let (outdated, path) = (review.outdated(), review.path().display());
        tracing::warn!(
            "{path}: {outdated} of its verdicts are on labels that have changed since, and do not count"
        );
    }
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|e| DataError::new("the server cannot be started").because(e))?;
    let outcome = runtime.block_on(run(desk, review, options, ready));
    // A frame that is just being decoded is not waited for.
    runtime.shutdown_timeout(GRACE);
    outcome
}

async fn run(
    desk: Desk,
    review: Option<Review>,
    options: &ServerOptions,
    ready: impl FnOnce(&Invitations) -> DataResult<()>,
) -> DataResult<Option<Summary>> {
    let wanted = SocketAddr::new(options.bind, options.port);
    let failed = |e: std::io::Error| {
        let error = DataError::new(format!("cannot listen on {wanted}"));
        match e.kind() {
            std::io::ErrorKind::AddrInUse => {
                error.hint("another program uses this port; `port` 0 takes a free one")
            }
            _ => error,
        }
        .because(e)
    };
    // Before anything is promised: a signal that comes now must not kill us half way.
    let mut stop = StopSignal::new()?;
    let listener = TcpListener::bind(wanted).await.map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let size = (desk.camera.width(), desk.camera.height());
    let app = Arc::new(App {
        jobs: Jobs::default(),
        job_permits: Semaphore::new(1),
        hub: Hub::new(Arc::clone(&desk.store), SAVE_DELAY, Arc::clone(&desk.frames))?,
        frames: Frames::new(Arc::clone(&desk.dataset), desk.camera_name.clone(), size),
        keys: options.keys.clone(),
        projections: Mutex::default(),
        review: review.map(Mutex::new),
        closing: watch::Sender::new(false),
        guard: Arc::new(Guard::new(address)?),
        desk,
    });
    ready(&Invitations::new(&app.guard))?;
    let mut closed = app.closing.subscribe();
    let stopped = async {
        stop.wait().await;
        app.closing.send_replace(true);
        std::future::pending::<()>().await;
    };
    let over = async {
        // Fails only if the sender is gone, and it is in `app`.
        let _ = closed.wait_for(|closing| *closing).await;
        tokio::time::sleep(GRACE).await;
    };
    tokio::select! {
        () = connections::serve(listener, router(&app), app.closing.subscribe()) => {}
        () = over => {}
        () = stopped => {}
    }
    app.jobs.stop_all();
    let summary = app.review.as_ref().map(|review| lock(review).summary());
    finish(app).await?;
    Ok(summary)
}

/// Waits for the jobs to let go of the labels, and saves them.
async fn finish(app: Arc<App>) -> DataResult<()> {
    let store = Arc::clone(&app.desk.store);
    let mut app = Some(app);
    let until = tokio::time::Instant::now() + GRACE;
    while let Some(shared) = app.take() {
        match Arc::try_unwrap(shared) {
            Ok(app) => return app.hub.into_saver().finish(),
            Err(shared) if tokio::time::Instant::now() < until => {
                app = Some(shared);
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
            Err(_) => break,
        }
    }
    // Something still holds on: its saver cannot be ended, but what there is can be saved.
    crate::store::save_now(&store)
}

fn router(app: &Arc<App>) -> Router {
    // Who reviews is given no label before it has been judged: what could tell them is not even served.
    let routes = if app.review.is_some() { review_routes() } else { label_routes() };
    routes
        .route(guard::ENTRANCE, get(guard::enter).with_state(Arc::clone(&app.guard)))
        .route("/", get(page))
        .route("/{file}", get(file))
        .route("/api/frames/{frame}", get(api::frame))
        .fallback(|| async { ApiError::new(StatusCode::NOT_FOUND, "there is nothing here") })
        .method_not_allowed_fallback(|| async {
            ApiError::new(StatusCode::METHOD_NOT_ALLOWED, "this is not how it is asked for")
        })
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(middleware::from_fn_with_state(Arc::clone(&app.guard), guard::check))
        .with_state(Arc::clone(app))
}

fn review_routes() -> Router<Arc<App>> {
    Router::new().route("/api/review", get(review::review).post(review::say))
}

fn label_routes() -> Router<Arc<App>> {
    Router::new()
        .route("/api/state", get(api::state))
        .route("/api/events", get(api::events))
        .route("/api/edits", post(api::edits))
        .route("/api/notes", post(api::note))
        .route("/api/undo", post(api::undo))
        .route("/api/redo", post(api::redo))
        .route("/api/track", post(api::track))
        .route("/api/track/{job}", delete(api::stop))
        .route("/api/detect", post(api::detect))
        .route("/api/suggestions", get(suggestions::suggestions))
        .route("/api/projections", get(api::projections))
        .route("/api/export", get(api::export))
        .route("/api/import", post(api::import_labels).layer(DefaultBodyLimit::max(MAX_IMPORT)))
}

async fn page(State(app): State<Arc<App>>) -> Result<Response, ApiError> {
    asset(if app.review.is_some() { "review.html" } else { "" })
}

async fn file(Path(name): Path<String>) -> Result<Response, ApiError> {
    asset(&name)
}

fn asset(name: &str) -> Result<Response, ApiError> {
    assets::asset(name)
        .map(IntoResponse::into_response)
        .ok_or_else(|| ApiError::new(StatusCode::NOT_FOUND, "there is nothing here"))
}

/// Ctrl-C, and where there is such a thing SIGTERM.
struct StopSignal {
    #[cfg(unix)]
    signals: [tokio::signal::unix::Signal; 3],
}

impl StopSignal {
    fn new() -> DataResult<Self> {
        #[cfg(unix)]
        {
            use tokio::signal::unix::{SignalKind, signal};
            let listen =
                |kind| signal(kind).map_err(|e| DataError::new("signals cannot be listened to").because(e));
            let kinds = [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()];
            let [a, b, c] = kinds.map(listen);
            Ok(Self { signals: [a?, b?, c?] })
        }
        #[cfg(not(unix))]
        Ok(Self {})
    }

    async fn wait(&mut self) {
        #[cfg(unix)]
        {
            let [a, b, c] = &mut self.signals;
            tokio::select! {
                _ = a.recv() => {}
                _ = b.recv() => {}
                _ = c.recv() => {}
            }
        }
        #[cfg(not(unix))]
        {
            // Without a signal handler there is nothing to wait for; the program is then ended from outside.
            if tokio::signal::ctrl_c().await.is_err() {
                std::future::pending::<()>().await;
            }
        }
    }
}
