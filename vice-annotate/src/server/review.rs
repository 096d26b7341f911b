//! What the page of a review asks for. A label is told once it has been judged, never before.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::IntoResponse;
use serde::Deserialize;
use serde_json::{Value, json};
use vice_core::camera::Pixel;

use super::App;
use super::api::{Answer, Body, Shared, parse};
use super::error::ApiError;
use crate::review::{Review, Verdict};
use crate::store::lock;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SayRequest {
    sample: usize,
    /// Where the point is; null: it cannot be told.
    px: Option<Pixel>,
}

pub(super) async fn review(State(app): Shared) -> Answer {
    app.blocking(|app| {
        let desk = &app.desk;
        let review = under_way(app)?;
        let samples: Vec<Value> = review
            .samples()
            .iter()
            .map(|sample| {
                let (frame, px) = sample.keyframe;
                json!({
                    "point": sample.point,
                    "frame": sample.frame,
                    "keyframe": { "frame": frame, "u": px.u, "v": px.v },
                    "verdict": review.verdict(sample).map(verdict),
                })
            })
            .collect();
        Ok(Json(json!({
            "dataset": desk.dataset.name(),
            "camera": desk.camera_name,
            "width": desk.camera.width(),
            "height": desk.camera.height(),
            "labels_file": desk.labels_file().display().to_string(),
            "review_file": review.path().display().to_string(),
            "outdated": review.outdated(),
            "samples": samples,
            "summary": review.summary(),
        }))
        .into_response())
    })
    .await
}

pub(super) async fn say(State(app): Shared, body: Body) -> Answer {
    let request: SayRequest = parse(body)?;
    app.blocking(move |app| {
        let px = request.px.map(|px| app.desk.checks().pixel(px.u, px.v)).transpose()?;
        let mut review = under_way(app)?;
        let said = review.say(request.sample, px)?;
        Ok(Json(json!({ "verdict": verdict(&said), "summary": review.summary() })).into_response())
    })
    .await
}

fn under_way(app: &App) -> Result<std::sync::MutexGuard<'_, Review>, ApiError> {
    let nothing = || ApiError::new(StatusCode::NOT_FOUND, "no review is under way");
    app.review.as_ref().map(lock).ok_or_else(nothing)
}

fn verdict(verdict: &Verdict) -> Value {
    let place = |px: Pixel| json!({ "u": px.u, "v": px.v });
    json!({
        "stored": place(verdict.stored_px),
        "reviewed": verdict.reviewed_px.map(place),
        "distance_px": verdict.distance_px,
        "source": verdict.source,
    })
}
