use super::*;
use nalgebra::{Rotation3, Vector3};
use vice_core::camera::Model;
use vice_core::dataset::PixelFormat;
use vice_core::error::DataError;
use vice_core::time::Stamp;

const SIZE: [u32; 2] = [320, 240];
const RATE_HZ: i64 = 10;

fn camera() -> Camera {
    Camera::new(SIZE[0], SIZE[1], [260.0, 260.0, 159.5, 119.5], Model::Pinhole).unwrap()
}

/// Gray of a surface at a place in metres: no two places look the same.
fn paint(x: f64, y: f64) -> f64 {
    128.0
        + 30.0 * (17.0 * x + 5.0 * y).sin()
        + 28.0 * (9.0 * x - 14.0 * y + 1.0).sin()
        + 25.0 * (23.0 * y + 1.6 * (7.0 * x).cos()).sin()
        + 22.0 * (4.0 * x + 2.3 * (9.0 * y).sin() * (3.0 * x).cos()).cos()
}

/// A room of a floor (y = 1 m below the first camera) and a wall, with a poster on the wall that may move by itself.
struct Room {
    /// Metres that the poster moves to the left between two frames; none: there is no poster.
    poster_step: Option<f64>,
    /// Positions of frames that cannot be decoded.
    broken: Vec<usize>,
    /// Whether the camera turns on its place.
    turns_only: bool,
}

const WALL_Z: f64 = 4.0;

impl Room {
    fn still() -> Self {
        Self { poster_step: None, broken: vec![], turns_only: false }
    }

    /// `world = turn · camera + place`.
    fn pose(&self, position: usize) -> (Rotation3<f64>, Vector3<f64>) {
        let t = position as f64 / RATE_HZ as f64;
        let turn = Rotation3::new(Vector3::new(0.03 * t.sin(), 0.06 * (1.3 * t).sin(), 0.05 * t));
        let place = Vector3::new(0.35 * t, 0.08 * (2.0 * t).sin(), 0.12 * t);
        (turn, if self.turns_only { Vector3::zeros() } else { place })
    }

    /// The point of the world that a pixel shows, and whether that is the poster.
    fn seen(&self, position: usize, px: Pixel) -> (Vector3<f64>, bool) {
        let (turn, place) = self.pose(position);
        let ray = turn * camera().unproject(px).unwrap();
        let to_floor = (1.0 - place.y) / ray.y;
        let to_wall = (WALL_Z - place.z) / ray.z;
        let on_floor = to_floor > 0.0 && to_floor < to_wall;
        let at = place + ray * if on_floor { to_floor } else { to_wall };
        let left = self.poster_step.map(|step| 0.2 - step * position as f64);
        let poster =
            !on_floor && left.is_some_and(|l| (l..l + 1.2).contains(&at.x) && (-1.0..0.2).contains(&at.y));
        (at, poster)
    }

    fn gray(&self, position: usize, px: Pixel) -> f64 {
        let (at, poster) = self.seen(position, px);
        match self.poster_step {
            Some(step) if poster => paint(at.x + step * position as f64 + 5.0, at.y + 3.0),
            _ => paint(at.x + 0.37 * at.z, at.y - 0.61 * at.z),
        }
    }

    /// Where what a pixel of one frame shows is in another one.
    fn carried(&self, from: usize, px: Pixel, to: usize) -> Pixel {
        let (turn, place) = self.pose(to);
        let there = turn.inverse() * (self.seen(from, px).0 - place);
        camera().project(&there.into()).unwrap()
    }
}

impl Footage for Room {
    fn picture(&self, position: usize) -> DataResult<Image> {
        if self.broken.contains(&position) {
            return Err(DataError::new("no picture"));
        }
        let [width, height] = SIZE;
        let pixels =
            (0..height).flat_map(|v| (0..width).map(move |u| Pixel::new(f64::from(u), f64::from(v))));
        let gray = pixels.map(|px| self.gray(position, px).round().clamp(0.0, 255.0) as u8).collect();
        Image::new(width, height, PixelFormat::Gray8, gray)
    }

    fn ground(&self, position: usize, pixels: &[Pixel]) -> DataResult<Vec<Ground>> {
        let depth = |px: &Pixel| {
            let (turn, place) = self.pose(position);
            (turn.inverse() * (self.seen(position, *px).0 - place)).z
        };
        Ok(pixels.iter().map(|px| Ground::Fit(Some(depth(px)))).collect())
    }
}

fn timeline(frames: usize) -> Timeline {
    let stamps: Vec<Stamp> =
        (0..frames as i64).map(|i| Stamp::from_nanos(1_000_000_000 + i * 1_000_000_000 / RATE_HZ)).collect();
    Timeline::new(&stamps, &vec![true; frames])
}

fn label(room: &Room, frames: usize, points: usize, given: &[Given]) -> Auto {
    let options = AutoOptions { points, given, progress: &|_, _| {} };
    auto_labels(room, &camera(), &timeline(frames), &options).unwrap()
}

/// How far each label that is scored is off where its key frame's point is.
fn errors(room: &Room, auto: &Auto) -> Vec<f64> {
    let mut errors = Vec::new();
    for labels in &auto.points {
        let mut start: Option<AutoLabel> = None;
        for label in labels {
            if label.keyframe {
                start = Some(*label);
            } else if let Some(start) = start {
                errors.push(room.carried(start.position, start.px, label.position).distance_px(label.px));
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn labels_lie_where_the_scene_has_them_on_any_number_of_threads() {
    let room = Room::still();
    let auto = label(&room, 40, 20, &[]);
    let errors = errors(&room, &auto);
    let at_95 = errors[errors.len() * 95 / 100];
    assert!(at_95 < 1.0, "95 %: {at_95} px, worst {:?}", errors.last());
    let report = &auto.report;
    assert!(report.made * 10 > report.possible * 8, "{report:?}");
    assert_eq!(report.made, auto.points.iter().map(Vec::len).sum::<usize>());
    assert!(report.agreement.unwrap()[0] > 0.9, "{report:?}");
    for labels in &auto.points {
        assert!(labels.windows(2).all(|w| w[0].position < w[1].position));
        assert!(labels.first().is_none_or(|l| l.keyframe), "a point starts with a key frame");
        assert!(labels.iter().all(|l| (0.0..=1.0).contains(&l.confidence)));
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| label(&room, 40, 20, &[])), auto, "{threads} threads");
    }
}

#[test]
fn what_moves_by_itself_is_left_out() {
    let room = Room { poster_step: Some(0.06), ..Room::still() };
    let auto = label(&room, 40, 20, &[]);
    let all: Vec<&AutoLabel> = auto.points.iter().flatten().collect();
    let on_poster = all.iter().filter(|l| room.seen(l.position, l.px).1).count();
    assert!(auto.report.ends.apart > 0, "{:?}", auto.report);
    assert!(on_poster * 20 < all.len(), "{on_poster} of {} labels are on what moves", all.len());
    assert!(all.len() > 300, "{}", all.len());
}

#[test]
fn a_camera_that_only_turns_is_labelled_as_well() {
    let room = Room { turns_only: true, ..Room::still() };
    let auto = label(&room, 30, 12, &[]);
    let errors = errors(&room, &auto);
    assert!(
        errors.len() > 200 && errors[errors.len() * 95 / 100] < 0.5,
        "{} {:?}",
        errors.len(),
        errors.last()
    );
    assert!(auto.report.agreement.unwrap()[0] > 0.9, "{:?}", auto.report);
}

#[test]
fn what_a_person_placed_is_gone_on_from_and_kept() {
    let room = Room::still();
    let start = Pixel::new(180.0, 150.0);
    let places = [
        GivenPlace { position: 8, px: start, keyframe: true, occluded: false },
        GivenPlace { position: 20, px: room.carried(8, start, 20), keyframe: false, occluded: false },
    ];
    let given = [Given { places: places.to_vec(), continues: false }];
    let auto = label(&room, 30, 1, &given);
    let labels = &auto.points[0];
    assert!(labels.iter().all(|l| l.position != 8 && l.position != 20), "{labels:?}");
    let own: Vec<&AutoLabel> = labels.iter().filter(|l| (9..20).contains(&l.position)).collect();
    assert_eq!(own.len(), 11);
    for label in own {
        assert!(!label.keyframe);
        assert!(room.carried(8, start, label.position).distance_px(label.px) < 0.3, "{label:?}");
    }
    // Ahead of the key frame a segment of its own leads to it.
    let ahead: Vec<&AutoLabel> = labels.iter().filter(|l| l.position < 8).collect();
    assert!(!ahead.is_empty() && ahead[0].keyframe && ahead[1..].iter().all(|l| !l.keyframe), "{ahead:?}");
    assert!(ahead.iter().all(|l| room.carried(8, start, l.position).distance_px(l.px) < 0.5), "{ahead:?}");
    assert!(labels.iter().any(|l| l.position > 20));

    // A place that is not where the point went: nothing is made up between where the ways part.
    let wrong = GivenPlace { px: Pixel::new(places[1].px.u + 30.0, places[1].px.v - 20.0), ..places[1] };
    let given = [Given { places: vec![places[0], wrong], continues: false }];
    let auto = label(&room, 30, 1, &given);
    let between = auto.points[0].iter().filter(|l| (9..20).contains(&l.position)).count();
    assert_eq!(between, 0, "{:?}", auto.points[0]);
    // Nor does a new segment take over what belongs to the person's one.
    assert!(auto.points[0].iter().filter(|l| l.keyframe).all(|l| !(9..=20).contains(&l.position)));
}

#[test]
fn frames_that_cannot_be_decoded_are_counted_and_bridged() {
    let room = Room { broken: vec![0, 7, 8, 15], ..Room::still() };
    let auto = label(&room, 24, 10, &[]);
    let left_out: Vec<usize> = auto.report.undecoded.iter().map(|u| u.0).collect();
    assert_eq!(left_out, [0, 7, 8, 15]);
    assert!(auto.points.iter().flatten().all(|l| !room.broken.contains(&l.position)));
    let errors = errors(&room, &auto);
    assert!(
        errors.len() > 80 && errors[errors.len() * 95 / 100] < 0.5,
        "{} {:?}",
        errors.len(),
        errors.last()
    );
    let room = Room { broken: (0..24).collect(), ..Room::still() };
    let options = AutoOptions { points: 4, given: &[], progress: &|_, _| {} };
    let error = auto_labels(&room, &camera(), &timeline(24), &options).unwrap_err();
    assert!(error.to_string().contains("no frame can be decoded: no picture"), "{error}");
}

#[test]
fn checks_are_a_fifth_of_a_second_apart_on_labelled_frames() {
    let line = timeline(10);
    assert_eq!(line.checks(), [0, 2, 4, 6, 8, 9]);
    let stamps: Vec<Stamp> = (0..9).map(|i| Stamp::from_nanos(i * 200_000_000)).collect();
    assert_eq!(Timeline::new(&stamps, &[true; 9]).checks(), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    assert!(Timeline::new(&[], &[]).checks().is_empty());
}
