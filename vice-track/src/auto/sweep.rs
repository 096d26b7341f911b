//! All points through all frames, a few frames in memory at a time.
//!
//! Frames come in blocks between two checks. Points are followed through a block each for itself, on all threads, then
//! back again; at the end of the block new points take the places of those that ended. The next frames are decoded
//! meanwhile.

use std::sync::Arc;

use rayon::prelude::*;
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult, ErrorKind};

use super::path::{End, Ground, Path, Seen};
use super::{Footage, Timeline};
use crate::point_track::{DOUBT_CONFIDENCE, Outcome, PointTrack, TrackOptions};
use crate::pyramid::Pyramid;
use crate::suggest::{SuggestOptions, suggest};

/// Bytes of pictures that are decoded ahead of the block that is looked at.
const AHEAD_BYTES: usize = 48 << 20;
/// And frames: no more of small ones, and at least a block.
const AHEAD_FRAMES: usize = 32;
/// Where the way back ends further off than this, the way was no good, pixels.
const BACK_PX: f64 = 1.0;
/// Points start no nearer to the border: what surrounds them has to fit in, for a while.
const BORDER_PX: f64 = 24.0;

/// Where to follow a given point from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Start {
    pub(super) position: usize,
    pub(super) px: Pixel,
    /// The last position to go to.
    pub(super) until: usize,
    /// Which given point, and which of its places.
    pub(super) given: (usize, usize),
}

/// What a sweep is made with.
pub(super) struct Sweep<'a> {
    pub(super) footage: &'a dyn Footage,
    pub(super) timeline: &'a Timeline,
    /// So many points are followed at any time, where there are as many to choose.
    pub(super) pool: usize,
    /// From the last frame to the first: positions count from the end.
    pub(super) backward: bool,
    pub(super) progress: &'a (dyn Fn(usize) + Sync),
}

/// What a sweep found.
pub(super) struct Swept {
    pub(super) paths: Vec<Path>,
    pub(super) undecoded: Vec<(usize, String)>,
    pub(super) groundless: Vec<(usize, String)>,
}

/// A path under way.
struct Runner {
    path: Path,
    track: Option<PointTrack>,
    until: usize,
}

type Picture = Result<Arc<Pyramid>, String>;

impl Sweep<'_> {
    /// # Errors
    /// [`DataError`] if no frame can be decoded.
    pub(super) fn run(&self, starts: &[Start]) -> DataResult<Swept> {
        let mut swept = Swept { paths: Vec::new(), undecoded: Vec::new(), groundless: Vec::new() };
        let checks = self.checks();
        let (Some(first), Some(last)) = (checks.first().copied(), checks.last().copied()) else {
            return Ok(swept);
        };
        let mut pictures = self.decode(first, first);
        let per_picture = pictures[0].as_ref().map_or(1 << 20, |p| 4 * p.width() * p.height() / 3);
        let ahead = (AHEAD_BYTES / per_picture.max(1)).clamp(1, AHEAD_FRAMES);
        let mut live: Vec<Runner> = Vec::new();
        self.note(first, &pictures, &mut swept);
        self.begin(first, first, &pictures, starts, &mut live);
        self.choose(first, &pictures[0], &mut live, &mut swept);
        let chunks = chunks(&checks, ahead);
        let mut next = chunks.first().map(|c| self.decode(c[0] + 1, c[c.len() - 1]));
        for (i, chunk) in chunks.iter().enumerate() {
            let Some(decoded) = next.take() else { break };
            // The frame that ended the chunk before begins this one.
            let carried = pictures.pop();
            pictures = carried.into_iter().chain(decoded).collect();
            let ((), decoded) = rayon::join(
                || self.chunk(chunk, &pictures, starts, &mut live, &mut swept),
                || chunks.get(i + 1).map(|c| self.decode(c[0] + 1, c[c.len() - 1])),
            );
            next = decoded;
        }
        swept.paths.extend(live.into_iter().map(|r| r.path));
        // In an order that does not depend on when they ended.
        swept.paths.sort_by(|a, b| {
            let key = |p: &Path| (p.start, p.given);
            let px = |p: &Path| p.seen.first().copied().flatten().map_or([0.0; 2], |s| s.px.into());
            key(a).cmp(&key(b)).then(px(a)[0].total_cmp(&px(b)[0])).then(px(a)[1].total_cmp(&px(b)[1]))
        });
        match swept.undecoded.first() {
            Some((_, reason)) if swept.undecoded.len() > last - first => {
                Err(DataError::of_kind(ErrorKind::Missing, format!("no frame can be decoded: {reason}")))
            }
            _ => Ok(swept),
        }
    }

    fn checks(&self) -> Vec<usize> {
        let checks = self.timeline.checks();
        match self.backward {
            true => checks.iter().rev().map(|c| self.timeline.len() - 1 - c).collect(),
            false => checks.to_vec(),
        }
    }

    /// The timeline's position.
    fn there(&self, position: usize) -> usize {
        if self.backward { self.timeline.len() - 1 - position } else { position }
    }

    /// Frames, both ends among them.
    fn decode(&self, from: usize, to: usize) -> Vec<Picture> {
        let one = |position: usize| {
            let image = self.footage.picture(self.there(position))?;
            Pyramid::for_tracking(&image)
        };
        (from..=to)
            .into_par_iter()
            .map(|position| one(position).map(Arc::new).map_err(|e| vice_core::error::one_line(&e)))
            .collect()
    }

    /// Blocks one after the other: from each check to the next one.
    fn chunk(
        &self,
        checks: &[usize],
        pictures: &[Picture],
        starts: &[Start],
        live: &mut Vec<Runner>,
        swept: &mut Swept,
    ) {
        let first = checks[0];
        for block in checks.windows(2) {
            let (from, to) = (block[0], block[1]);
            let pictures = &pictures[from - first..=to - first];
            self.note(from + 1, &pictures[1..], swept);
            // What starts at the block's first frame was begun with it.
            self.begin(from + 1, to, &pictures[1..], starts, live);
            live.par_iter_mut().for_each(|runner| runner.follow(from, pictures));
            let (over, on): (Vec<Runner>, Vec<Runner>) =
                live.drain(..).partition(|r| r.path.end != End::Open || r.until <= to);
            swept.paths.extend(over.into_iter().map(|r| r.path));
            *live = on;
            self.choose(to, &pictures[pictures.len() - 1], live, swept);
            (self.progress)(to + 1);
        }
    }

    fn note(&self, from: usize, pictures: &[Picture], swept: &mut Swept) {
        for (i, picture) in pictures.iter().enumerate() {
            if let Err(reason) = picture {
                swept.undecoded.push((self.there(from + i), reason.clone()));
            }
        }
    }

    /// Given points that start in these frames.
    fn begin(&self, from: usize, to: usize, pictures: &[Picture], starts: &[Start], live: &mut Vec<Runner>) {
        for start in starts.iter().filter(|s| (from..=to).contains(&s.position)) {
            let Ok(picture) = &pictures[start.position - from] else { continue };
            live.extend(Runner::start(start.position, start.px, picture, start.until, Some(start.given)));
        }
    }

    /// Asks about the ground below all points, and starts new ones.
    fn choose(&self, position: usize, picture: &Picture, live: &mut Vec<Runner>, swept: &mut Swept) {
        let Ok(picture) = picture else { return };
        if self.pool == 0 {
            return;
        }
        let taken: Vec<Pixel> = live.iter().filter_map(|r| Some(r.path.at(position)?.px)).collect();
        let missing = self.pool.saturating_sub(taken.len());
        let apart_px = 0.6 * ((picture.width() * picture.height()) as f64 / self.pool as f64).sqrt();
        let options = SuggestOptions {
            min_distance_px: apart_px.max(12.0),
            border_px: BORDER_PX,
            taken: &taken,
            accept: &|_| true,
        };
        // Some of them will have no ground.
        let found = if missing > 0 { suggest(picture, 2 * missing + 8, &options) } else { vec![] };
        let asked: Vec<Pixel> = taken.iter().copied().chain(found.iter().map(|s| s.px)).collect();
        let grounds = match self.footage.ground(self.there(position), &asked) {
            Ok(grounds) => grounds,
            Err(error) => {
                swept.groundless.push((self.there(position), vice_core::error::one_line(&error)));
                return;
            }
        };
        let is_start = |ground: &Ground| match ground {
            Ground::Fit(z_m) => Some(*z_m),
            Ground::Unfit => None,
        };
        let there = live.iter_mut().filter(|r| r.path.at(position).is_some());
        for (runner, ground) in there.zip(&grounds) {
            runner.path.fit.extend(is_start(ground).map(|z_m| (position, z_m)));
        }
        let fit = found
            .iter()
            .zip(grounds.iter().skip(taken.len()))
            .filter_map(|(s, g)| Some((s.px, is_start(g)?)));
        let new = fit.filter_map(|(px, z_m)| {
            let mut runner = Runner::start(position, px, picture, usize::MAX, None)?;
            runner.path.fit.push((position, z_m));
            Some(runner)
        });
        live.extend(new.take(missing));
    }
}

impl Runner {
    fn start(
        position: usize,
        px: Pixel,
        picture: &Arc<Pyramid>,
        until: usize,
        given: Option<(usize, usize)>,
    ) -> Option<Self> {
        let track = PointTrack::start(picture, px, TrackOptions::default()).ok()?;
        let seen = vec![Some(Seen { px, confidence: 1.0, back_px: f32::NAN })];
        let path = Path { start: position, seen, end: End::Open, given, fit: Vec::new() };
        Some(Self { path, track: Some(track), until })
    }

    /// Through a block, and back again.
    fn follow(&mut self, from: usize, pictures: &[Picture]) {
        let Some(track) = &mut self.track else { return };
        let entry = self.path.start.max(from);
        for (i, picture) in pictures.iter().enumerate() {
            let position = from + i;
            if position <= entry || position > self.until {
                continue;
            }
            let Ok(picture) = picture else {
                self.path.seen.push(None);
                continue;
            };
            let step = track.step(picture, None);
            let end = match step.outcome {
                Outcome::LeftImage => Some(End::Left),
                outcome if !outcome.is_found() => Some(End::Lost),
                _ if step.confidence < DOUBT_CONFIDENCE => Some(End::Doubtful),
                _ => None,
            };
            if let Some(end) = end {
                self.path.end = end;
                break;
            }
            let confidence = step.confidence as f32;
            self.path.seen.push(Some(Seen { px: step.px, confidence, back_px: f32::NAN }));
        }
        self.return_to(entry, from, pictures);
    }

    /// Goes back from the last place of the block to the one where the point came in.
    fn return_to(&mut self, entry: usize, from: usize, pictures: &[Picture]) {
        let places: Vec<usize> = (entry..=self.path.last()).filter(|p| self.path.at(*p).is_some()).collect();
        let (Some(last), Some(first)) = (places.last(), places.first()) else { return };
        if first == last {
            return;
        }
        let back_px = self.way_back(&places, from, pictures);
        match back_px {
            Some(off_px) if off_px <= BACK_PX => {
                for position in places.iter().skip(1) {
                    if let Some(Some(seen)) = self.path.seen.get_mut(position - self.path.start) {
                        seen.back_px = off_px as f32;
                    }
                }
            }
            // Where in the block it went astray is not known.
            _ => {
                self.path.cut_after(*first);
                self.path.end = End::NoWayBack;
            }
        }
    }

    /// How far off the way back ends; `None` where it is lost.
    fn way_back(&self, places: &[usize], from: usize, pictures: &[Picture]) -> Option<f64> {
        let picture = |position: usize| pictures.get(position - from)?.as_ref().ok();
        let (last, rest) = places.split_last()?;
        let start = self.path.at(*last)?.px;
        let mut track = PointTrack::start(picture(*last)?, start, TrackOptions::default()).ok()?;
        for position in rest.iter().rev() {
            if !track.step(picture(*position)?, None).outcome.is_found() {
                return None;
            }
        }
        Some(track.px().distance_px(self.path.at(*rest.first()?)?.px))
    }
}

/// Checks in groups whose blocks have at most so many frames together, or one block each: each group begins with the
/// check that ends the one before.
fn chunks(checks: &[usize], frames: usize) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for pair in checks.windows(2) {
        match groups.last_mut() {
            Some(group) if pair[1] - group[0] <= frames => group.push(pair[1]),
            _ => groups.push(pair.to_vec()),
        }
    }
    groups
}
