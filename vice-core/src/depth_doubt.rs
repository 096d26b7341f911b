//! Key points whose error grows with the camera's motion as that of a wrong depth does.
//!
//! A point that is lifted with a wrong depth stays on its ray: at the key frame nothing is off, and the more the camera moves
//! aside the more it is. For each point the depth is fitted that explains its labels best, together with a small shift of
//! the label at the key frame; blunders weigh little (Cauchy). The depth that was used is doubtful where that other
//! one is better by far, off by more than a tenth, leaves the error clearly smaller, and lies off by more than the fitted
//! depths of the other points do. Where nearly all points ask for the same factor it is not theirs: the motion has another
//! scale, or the camera another height.

use crate::parallel::*;
use nalgebra::{Point3, Vector3};

use crate::camera::{Camera, Pixel};
use crate::frames::WorldFromCamera;
use crate::statistics::{median, quantile, sorted};
use crate::track::{CameraPath, track_along};

/// Depths from a tenth to ten times the one that was used are tried.
const FARTHEST: f64 = 10.0;
/// On a grid of so many.
const GRID: usize = 61;
/// Then between the neighbours of the best by golden section.
const REFINE: usize = 24;
/// More views of a point than this tell nothing new.
const MOST_VIEWS: usize = 40;
/// More points than this are not needed to know the noise.
const MOST_FOR_NOISE: usize = 400;
/// Fewer views than this tell nothing.
const FEWEST_VIEWS: usize = 3;
/// Labels are not better than this, px.
const LEAST_NOISE_PX: f64 = 0.5;
/// How much the label of the key frame may be off, in deviations of the labels.
const KEYFRAME_DEVIATIONS: f64 = 2.0;
/// Where an error begins to count as a blunder, in deviations.
const BLUNDER: f64 = 3.0;
/// How much better, in -2 ln of the likelihood, the other depth has to be: five deviations.
const GAIN: f64 = 25.0;
/// Below this share of it rounding does not matter.
const SURE_SHARE: f64 = 0.999;
/// How far off, on the logarithm.
const LEAST_OFF_LOG: f64 = 0.1;
/// How many times the smaller third of the others' depths are off.
const TIMES_OTHERS: f64 = 4.0;
/// Which share of the others that is.
const OTHERS_SHARE: f64 = 0.3;
/// How much of the median error may be left.
const LEFT_SHARE: f64 = 0.7;
/// A point whose pixels move by less than this, in deviations, for a tenth of depth says nothing.
const TELLS: f64 = 2.0;
/// From this share of the points on that tell, a common factor is the motion's.
const NEARLY_ALL: f64 = 0.8;
/// As long as the factors differ by less than this, on the logarithm (from the lower to the upper quarter).
const COMMON_LOG: f64 = 0.1;
/// From so many points on.
const FEWEST_FOR_ALL: usize = 4;
/// Median length of a vector of two Gaussian components of deviation one.
const MEDIAN_LENGTH: f64 = 1.1774;

/// A key point, lifted, and its later labels.
#[derive(Clone, Debug)]
pub struct LiftedTrack {
    /// The point in the camera of the key frame, metres, with the depth that was used.
    point_camera_m: Point3<f64>,
    at_keyframe: WorldFromCamera,
    /// Where the camera is in each later frame, and where the label is there.
    cameras: CameraPath,
    label_px: [Vec<f64>; 2],
}

impl LiftedTrack {
    /// A point in the camera of its key frame, and where later cameras are and see it: of more views than tell something new
    /// some, evenly.
    pub fn new(
        point_camera_m: Point3<f64>,
        at_keyframe: WorldFromCamera,
        views: &[(WorldFromCamera, Pixel)],
    ) -> Self {
        let path = CameraPath::new(views.iter().map(|(camera, _)| Some(*camera)));
        let labels: Vec<(usize, Pixel)> = views.iter().map(|(_, label)| *label).enumerate().collect();
        Self::along(point_camera_m, at_keyframe, &path, &labels)
    }

    /// The same of places of a path.
    pub(crate) fn along(
        point_camera_m: Point3<f64>,
        at_keyframe: WorldFromCamera,
        path: &CameraPath,
        labels: &[(usize, Pixel)],
    ) -> Self {
        let n = labels.len();
        let thinned: Vec<(usize, Pixel)> = match n {
            0..=MOST_VIEWS => labels.to_vec(),
            _ => (0..MOST_VIEWS).map(|i| labels[i * (n - 1) / (MOST_VIEWS - 1)]).collect(),
        };
        let label_px = [thinned.iter().map(|l| l.1.u).collect(), thinned.iter().map(|l| l.1.v).collect()];
        let cameras = path.some(thinned.iter().map(|l| l.0));
        Self { point_camera_m, at_keyframe, cameras, label_px }
    }

    fn views(&self) -> usize {
        self.label_px[0].len()
    }
}

/// Key points that are lifted where they are asked for.
pub trait LiftedTracks: Sync {
    /// How many.
    fn count(&self) -> usize;

    /// Whether one has so many views.
    fn has_views(&self, track: usize, views: usize) -> bool;

    /// One of them.
    fn get(&self, track: usize) -> LiftedTrack;

    /// A sum of squared errors with the depth that was used that holds those of all its views, px²; `None` where it is not
    /// known.
    fn squares_px2(&self, _track: usize) -> Option<f64> {
        None
    }
}

impl LiftedTracks for [LiftedTrack] {
    fn count(&self) -> usize {
        self.len()
    }

    fn has_views(&self, track: usize, views: usize) -> bool {
        self[track].views() >= views
    }

    fn get(&self, track: usize) -> LiftedTrack {
        self[track].clone()
    }
}

/// A depth that explains a point's labels better than the one that was used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BetterDepth {
    /// The better depth over the one that was used.
    pub factor: f64,
    /// Median error with the depth that was used, px.
    pub error_px: f64,
    /// Median error with the better one, px.
    pub error_then_px: f64,
}

/// What the points say about their depths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Doubts {
    /// The doubtful points, by their place in the list.
    pub points: Vec<(usize, BetterDepth)>,
    /// The factor that nearly all points ask for, and how many of how many do: then none of them is doubtful by itself.
    pub common: Option<(f64, usize, usize)>,
}

/// The points whose depth is doubtful.
pub fn doubts(camera: &Camera, tracks: &(impl LiftedTracks + ?Sized)) -> Doubts {
    let useful: Vec<usize> = (0..tracks.count()).filter(|i| tracks.has_views(*i, FEWEST_VIEWS)).collect();
    let step = useful.len().div_ceil(MOST_FOR_NOISE).max(1);
    let sample: Vec<usize> = useful.iter().copied().step_by(step).collect();
    let fit = |noise_px: f64| move |track: &LiftedTrack| Fitter { camera, track, noise_px }.fit();
    let rough: Vec<Fit> = sample.par_iter().filter_map(|i| fit(1.0)(&tracks.get(*i))).collect();
    let Some(left) = median(&mut rough.iter().map(|f| f.error_then_px).collect::<Vec<_>>()) else {
        return Doubts::default();
    };
    let noise_px = (left / MEDIAN_LENGTH).max(LEAST_NOISE_PX);
    // What a track costs is at most its squares over the noise: the shift of its key frame's label only makes it less.
    let fits_as_it_is = |i: usize| {
        tracks.squares_px2(i).is_some_and(|squares| squares < SURE_SHARE * GAIN * noise_px * noise_px)
    };
    let fits: Vec<(usize, Fit)> = useful
        .par_iter()
        .filter(|i| **i % step == 0 || !fits_as_it_is(**i))
        .filter_map(|i| {
            let fitter = Fitter { camera, track: &tracks.get(*i), noise_px };
            // What fits as it is needs no other depth; the sample is fitted for what its depths differ by.
            let wanted = i % step == 0 || fitter.at(1.0).is_none_or(|c| c.cost > GAIN);
            if wanted { Some((*i, fitter.fit()?)) } else { None }
        })
        .filter(|(_, f)| f.tells)
        .collect();
    let off = sorted(fits.iter().map(|(_, f)| f.factor.ln().abs()).collect());
    let others = quantile(&off, OTHERS_SHARE).unwrap_or(0.0);
    let clear = |f: &Fit| f.gain > GAIN && f.error_then_px < LEFT_SHARE * f.error_px;
    if let Some(common) = common(&fits, clear) {
        return Doubts { points: vec![], common: Some(common) };
    }
    let least = LEAST_OFF_LOG.max(TIMES_OTHERS * others);
    let doubtful = fits.iter().filter(|(_, f)| clear(f) && f.factor.ln().abs() > least);
    let better =
        |f: &Fit| BetterDepth { factor: f.factor, error_px: f.error_px, error_then_px: f.error_then_px };
    Doubts { points: doubtful.map(|(i, f)| (*i, better(f))).collect(), common: None }
}

/// The factor that nearly all points ask for.
fn common(fits: &[(usize, Fit)], clear: impl Fn(&Fit) -> bool) -> Option<(f64, usize, usize)> {
    let logs = sorted(fits.iter().filter(|(_, f)| clear(f)).map(|(_, f)| f.factor.ln()).collect());
    let n = logs.len();
    if n < FEWEST_FOR_ALL || (n as f64) < NEARLY_ALL * fits.len() as f64 {
        return None;
    }
    let spread = quantile(&logs, 0.75)? - quantile(&logs, 0.25)?;
    let middle = quantile(&logs, 0.5)?;
    (middle.abs() > LEAST_OFF_LOG && spread < COMMON_LOG).then(|| (middle.exp(), n, fits.len()))
}

/// The best depth of a point.
#[derive(Clone, Copy, Debug)]
struct Fit {
    factor: f64,
    gain: f64,
    error_px: f64,
    error_then_px: f64,
    /// Whether its pixels move enough for the depth to be seen.
    tells: bool,
}

/// What a depth costs.
struct Cost {
    cost: f64,
    error_px: f64,
    residuals: Vec<[f64; 2]>,
}

struct Fitter<'a> {
    camera: &'a Camera,
    track: &'a LiftedTrack,
    noise_px: f64,
}

impl Fitter<'_> {
    fn fit(&self) -> Option<Fit> {
        let used = self.at(1.0)?;
        let nearby = self.at(1.1).or_else(|| self.at(1.0 / 1.1))?;
        let moved =
            used.residuals.iter().zip(&nearby.residuals).map(|(a, b)| length([a[0] - b[0], a[1] - b[1]]));
        let tells = moved.fold(0.0, f64::max) > TELLS * self.noise_px;
        let cost = |log: f64| self.at(log.exp()).map_or(f64::INFINITY, |c| c.cost);
        let step = 2.0 * FARTHEST.ln() / (GRID - 1) as f64;
        let log_at = |i: usize| i as f64 * step - FARTHEST.ln();
        let best = (0..GRID).map(|i| (cost(log_at(i)), i)).min_by(|a, b| a.0.total_cmp(&b.0))?.1;
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (log_at(best) - step, log_at(best) + step);
        let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
        let (mut at_a, mut at_b) = (cost(a), cost(b));
        for _ in 0..REFINE {
            if at_a < at_b {
                (high, b, at_b) = (b, a, at_a);
                a = high - golden * (high - low);
                at_a = cost(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = low + golden * (high - low);
                at_b = cost(b);
            }
        }
        let factor = f64::midpoint(low, high).exp();
        let then = self.at(factor)?;
        Some(Fit {
            factor,
            gain: used.cost - then.cost,
            error_px: used.error_px,
            error_then_px: then.error_px,
            tells,
        })
    }

    /// The cost of a depth times `factor`; `None` where a view does not see the point then.
    fn at(&self, factor: f64) -> Option<Cost> {
        let point = Point3::from(self.track.point_camera_m.coords * factor);
        let LiftedTrack { at_keyframe, cameras, label_px: [label_u, label_v], .. } = self.track;
        let n = self.track.views();
        // No more views are kept than these have room for.
        let (mut u, mut v, mut valid) = ([0.0; MOST_VIEWS], [0.0; MOST_VIEWS], [false; MOST_VIEWS]);
        let (u, v, valid) = (&mut u[..n], &mut v[..n], &mut valid[..n]);
        if track_along(self.camera, at_keyframe, &point, (cameras, 0..n), [&mut *u, &mut *v], valid) < n {
            return None;
        }
        let residual = |i: usize| [u[i] - label_u[i], v[i] - label_v[i]];
        let residuals: Vec<[f64; 2]> = (0..n).map(residual).collect();
        // The label of the key frame may be off a little, which moves all views by about as much.
        let (noise2, blunder2) = (self.noise_px.powi(2), (BLUNDER * self.noise_px).powi(2));
        let prior = 1.0 / (KEYFRAME_DEVIATIONS * KEYFRAME_DEVIATIONS);
        let mut shift = [0.0; 2];
        for _ in 0..4 {
            let mut sum = Vector3::zeros();
            for r in &residuals {
                let off = [r[0] - shift[0], r[1] - shift[1]];
                let weight = 1.0 / (1.0 + (off[0] * off[0] + off[1] * off[1]) / blunder2);
                sum += weight * Vector3::new(r[0], r[1], 1.0);
            }
            shift = [sum.x / (sum.z + prior), sum.y / (sum.z + prior)];
        }
        let mut errors: Vec<f64> =
            residuals.iter().map(|r| length([r[0] - shift[0], r[1] - shift[1]])).collect();
        let of_labels: f64 = errors.iter().map(|e| BLUNDER * BLUNDER * (e * e / blunder2).ln_1p()).sum();
        let of_keyframe = prior * (shift[0] * shift[0] + shift[1] * shift[1]) / noise2;
        Some(Cost { cost: of_labels + of_keyframe, error_px: median(&mut errors)?, residuals })
    }
}

fn length(v: [f64; 2]) -> f64 {
    // Pixels: their squares neither overflow nor vanish, and `hypot` takes ten times as long.
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

#[cfg(test)]
mod tests;
