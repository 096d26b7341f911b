//! Where to put new points: corners with depth that are far apart and will stay in view.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Query, State};
use axum::response::IntoResponse;
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::json;
use vice_core::camera::Pixel;
use vice_core::error::DataResult;
use vice_track::{PointTrack, Pyramid, SuggestOptions, Suggestion, TrackOptions, suggest};

use super::api::{Answer, Shared};
use crate::desk::Desk;

/// Suggestions of one request at most.
const MAX_SUGGESTIONS: usize = 64;
/// So many places are compared for each that is asked for, and at least.
const POOL: (usize, usize) = (4, 24);
/// To stay in view for longer is worth no more, seconds.
const LONG_S: f64 = 8.0;
/// Places are followed so far ahead before they are suggested, seconds, and through so many frames at most.
const TRY: (f64, usize) = (1.0, 24);
/// Nearer to the border than this a point is as good as gone, pixels.
const BORDER_PX: f64 = 14.0;
/// The border of a place's own frame, pixels.
const START_BORDER_PX: f64 = 30.0;

#[derive(Deserialize)]
pub(super) struct SuggestQuery {
    frame: usize,
    count: Option<usize>,
    /// The frame where the lane goes on: to stay in view for longer is worth nothing.
    until: Option<usize>,
}

/// A place, and how long it is expected to stay in view.
struct Candidate {
    found: Suggestion,
    stays_s: Option<f64>,
}

pub(super) async fn suggestions(State(app): Shared, Query(query): Query<SuggestQuery>) -> Answer {
    let count = query.count.unwrap_or(4).min(MAX_SUGGESTIONS);
    app.blocking(move |app| {
        let desk = &app.desk;
        let stamp = desk.checks().stamp(query.frame)?;
        let image = Arc::new(picture(desk, query.frame)?);
        let taken: Vec<Pixel> = {
            let store = desk.store();
            store.document().points().filter_map(|(_, o)| Some(o.get(&stamp)?.px)).collect()
        };
        let pool = (POOL.0 * count).max(POOL.1);
        let (surface, found) = places(desk, query.frame, &image, &taken, pool);
        let ahead = Ahead::new(desk, &query);
        let candidates = ahead.candidates(&image, found);
        let far_px = 0.35 * f64::from(desk.camera.width()).hypot(f64::from(desk.camera.height()));
        let chosen = choose(candidates, count, &taken, far_px, ahead.seconds());
        let pixels: Vec<Pixel> = chosen.iter().map(|c| c.found.px).collect();
        let depths = depths(desk, query.frame, &pixels).unwrap_or_else(|| vec![None; pixels.len()]);
        let list: Vec<_> = chosen
            .iter()
            .zip(depths)
            .map(|(Candidate { found, stays_s }, z)| {
                json!({ "u": found.px.u, "v": found.px.v, "score": found.score, "depth_m": z, "stays_s": stays_s })
            })
            .collect();
        Ok(Json(json!({ "suggestions": list, "surface": surface })).into_response())
    })
    .await
}

fn picture(desk: &Desk, frame: usize) -> DataResult<Pyramid> {
    Pyramid::for_tracking(&desk.dataset.image(&desk.camera_name, frame)?)
}

fn depths(desk: &Desk, frame: usize, pixels: &[Pixel]) -> Option<Vec<Option<f64>>> {
    desk.estimates.as_ref()?.depths(frame, pixels).ok()
}

/// Corners to choose from, and where they lie: the surest that there are.
fn places(
    desk: &Desk,
    frame: usize,
    image: &Pyramid,
    taken: &[Pixel],
    count: usize,
) -> (&'static str, Vec<Suggestion>) {
    // Where no stream has a pose there is no depth either.
    let has_depth = |px: Pixel| {
        desk.estimates.is_none() || depths(desk, frame, &[px]).is_some_and(|z| z.iter().all(Option::is_some))
    };
    let floor = FloorMask::new(desk, frame);
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
    accepts
        .into_iter()
        .map(|(surface, accept)| {
            let options =
                SuggestOptions { taken, accept, border_px: START_BORDER_PX, ..SuggestOptions::default() };
            (surface, suggest(image, count, &options))
        })
        .find(|(_, found)| !found.is_empty())
        .unwrap_or(("any", vec![]))
}

/// What is known of the time after a frame: the pictures of the next moment, and how the camera moves on where a stream says so.
/// Neither places a label.
struct Ahead<'a> {
    desk: &'a Desk,
    frame: usize,
    /// The last frame that counts.
    last: usize,
    pictures: Vec<(usize, Arc<Pyramid>)>,
}

impl<'a> Ahead<'a> {
    fn new(desk: &'a Desk, query: &SuggestQuery) -> Self {
        let frame = query.frame;
        let end = desk.chosen.last().copied().unwrap_or(frame);
        let last = query.until.map_or(end, |until| until.min(end)).max(frame);
        let tried = (frame + 1..=last)
            .take_while(|f| seconds(desk, frame, *f) <= TRY.0)
            .take(TRY.1)
            .collect::<Vec<_>>();
        let pictures: Vec<(usize, Arc<Pyramid>)> =
            tried.into_par_iter().filter_map(|f| picture(desk, f).ok().map(|p| (f, Arc::new(p)))).collect();
        Self { desk, frame, last, pictures }
    }

    /// How long a place could stay at most, as far as that is worth anything.
    fn seconds(&self) -> f64 {
        seconds(self.desk, self.frame, self.last).min(LONG_S)
    }

    fn candidates(&self, image: &Arc<Pyramid>, found: Vec<Suggestion>) -> Vec<Candidate> {
        found
            .into_par_iter()
            .map(|found| {
                let lost_s = self.lost_s(image, found.px);
                Candidate { found, stays_s: lost_s.or_else(|| self.leaves_s(found.px)) }
            })
            .collect()
    }

    /// After how long the tracker loses a place; `None` where it still has it in the last picture.
    fn lost_s(&self, image: &Arc<Pyramid>, px: Pixel) -> Option<f64> {
        let Ok(mut track) = PointTrack::start(image, px, TrackOptions::default()) else { return Some(0.0) };
        let mut kept_s = 0.0;
        for (frame, picture) in &self.pictures {
            if !track.step(picture, None).outcome.is_found() {
                return Some(kept_s);
            }
            kept_s = seconds(self.desk, self.frame, *frame);
        }
        None
    }

    /// After how long a place leaves the image by the first stream; `None` where none can tell.
    fn leaves_s(&self, px: Pixel) -> Option<f64> {
        let (desk, estimates) = (self.desk, self.desk.estimates.as_ref()?);
        let (right, bottom) =
            (f64::from(desk.camera.width()) - BORDER_PX, f64::from(desk.camera.height()) - BORDER_PX);
        let mut stays_s = None;
        let ahead = desk.chosen.iter().filter(|f| **f > self.frame && **f <= self.last);
        for frame in ahead.take_while(|f| seconds(desk, self.frame, **f) <= LONG_S) {
            let there = estimates.expect(self.frame, px, *frame);
            let inside =
                there.is_some_and(|t| t.u > BORDER_PX && t.v > BORDER_PX && t.u < right && t.v < bottom);
            if !inside {
                // Without depth or a pose nothing is known, not even of the first frame.
                return if there.is_none() { stays_s } else { stays_s.or(Some(0.0)) };
            }
            stays_s = Some(seconds(desk, self.frame, *frame));
        }
        stays_s
    }
}

fn seconds(desk: &Desk, from: usize, to: usize) -> f64 {
    desk.frames[to].since(desk.frames[from]).as_secs_f64()
}

/// One after the other is chosen that stays in view for long and is far from those that are there already. Where nothing tells
/// how long, half the time is assumed.
fn choose(
    mut candidates: Vec<Candidate>,
    count: usize,
    taken: &[Pixel],
    far_px: f64,
    most_s: f64,
) -> Vec<Candidate> {
    let mut there: Vec<Pixel> = taken.to_vec();
    let mut chosen = Vec::new();
    while chosen.len() < count && !candidates.is_empty() {
        let worth = |c: &Candidate| {
            let apart_px = there.iter().map(|t| t.distance_px(c.found.px)).fold(far_px, f64::min);
            let stays = c.stays_s.map_or(0.5, |s| if most_s > 0.0 { (s / most_s).min(1.0) } else { 1.0 });
            stays * (0.3 + 0.7 * apart_px / far_px)
        };
        // The first of equals: candidates come with the best corner first.
        let best = (0..candidates.len())
            .rev()
            .max_by(|a, b| worth(&candidates[*a]).total_cmp(&worth(&candidates[*b])));
        let Some(best) = best else { break };
        let next = candidates.remove(best);
        there.push(next.found.px);
        chosen.push(next);
    }
    chosen
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

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(u: f64, stays_s: Option<f64>) -> Candidate {
        Candidate { found: Suggestion { px: Pixel::new(u, 100.0), score: 1.0 }, stays_s }
    }

    #[test]
    fn what_stays_longer_comes_first_and_others_lie_apart_from_it() {
        let all = vec![
            candidate(100.0, Some(0.3)),
            candidate(200.0, Some(4.0)),
            candidate(210.0, Some(3.9)),
            candidate(500.0, None),
        ];
        let chosen = choose(all, 3, &[], 200.0, 4.0);
        let places: Vec<f64> = chosen.iter().map(|c| c.found.px.u).collect();
        assert_eq!(places, [200.0, 500.0, 210.0]);
    }

    #[test]
    fn where_nothing_is_known_the_best_corners_keep_their_order() {
        let chosen = choose(vec![candidate(10.0, None), candidate(600.0, None)], 5, &[], 200.0, 8.0);
        assert_eq!(chosen.iter().map(|c| c.found.px.u).collect::<Vec<_>>(), [10.0, 600.0]);
        assert_eq!(choose(vec![candidate(10.0, Some(0.0))], 1, &[], 200.0, 0.0).len(), 1, "the last frame");
    }
}
