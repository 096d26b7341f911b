//! The plane that several tags lie on, and how sure the depth on it is.
//!
//! The four corners of one small tag say little about its tilt, and with it about the depth of each corner. Tags on one
//! board share their plane, whatever the board's layout: it is fitted to all of them together, and each tag keeps its own
//! place and turn on it.
//!
//! A plane `normal · X = distance` is held as `normal / distance`: the inverse depth of the ray `(x, y, 1)` is then
//! `a x + b y + c`, linear in what is fitted.

use nalgebra::{Matrix3, Vector2, Vector3};

/// Corners are never taken to be better than this, pixels: what is left of light, print and lens.
const CORNER_PX: f64 = 0.1;
/// Tags lie on one plane if that explains their corners about as well as a plane for each: the errors it adds for each
/// number that it saves, in squares of what a corner is off anyway, are at most this many.
const ADDED: f64 = 4.0;
/// The same where corners fit better than a board is flat and a lens is calibrated, pixels.
const FLAT_PX: f64 = 0.2;

/// The corners of a tag as rays `(x, y, 1)`.
pub(crate) type Rays = [Vector2<f64>; 4];

/// A plane in the camera's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SharedPlane {
    /// The normal over the distance, 1/m.
    per_m: Vector3<f64>,
    /// Of `per_m`.
    covariance: Matrix3<f64>,
}

impl SharedPlane {
    /// Depth along a ray and its standard deviation, metres. `None` where the ray does not meet the plane in front of the
    /// camera.
    pub(crate) fn depth_m(&self, ray: &Vector3<f64>) -> Option<(f64, f64)> {
        let inverse = self.per_m.dot(ray);
        let z_m = 1.0 / inverse;
        let deviation = ray.dot(&(self.covariance * ray)).max(0.0).sqrt() * z_m * z_m;
        (inverse > 0.0 && z_m.is_finite() && deviation.is_finite()).then_some((z_m, deviation))
    }
}

/// A tag by itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Alone {
    rays: Rays,
    /// The plane through it.
    pub(crate) plane: SharedPlane,
    /// Its squared errors on that plane, normalised coordinates.
    error: f64,
}

impl Alone {
    /// The plane through one tag, from the plane of its pose.
    pub(crate) fn new(rays: Rays, size_m: f64, start: Vector3<f64>, focal_px: f64) -> Option<Self> {
        let fitted = fit(&[rays], size_m, start)?;
        let error: f64 = fitted.errors.iter().sum();
        // Two numbers are left over to judge by, which is too few to believe that corners are better than usual.
        let plane = plane(&fitted, (error / 2.0).sqrt().max(CORNER_PX / focal_px))?;
        Some(Self { rays, plane, error })
    }
}

/// The plane that tags share, and which of them do: all, or all but some that lie elsewhere. `None` if no two do.
pub(crate) fn shared(tags: &[Alone], size_m: f64, focal_px: f64) -> Option<(SharedPlane, Vec<usize>)> {
    let mut kept: Vec<usize> = (0..tags.len()).collect();
    while kept.len() >= 2 {
        let n = kept.len() as f64;
        let chosen: Vec<Rays> = kept.iter().map(|i| tags[*i].rays).collect();
        let start = through(kept.iter().map(|i| &tags[*i]))?;
        let fitted = fit(&chosen, size_m, start)?;
        // Of 8 numbers of each tag 3 place it on the plane; the plane has 3.
        let alone: f64 = kept.iter().map(|i| tags[*i].error).sum();
        let sigma2 = (alone / (2.0 * n)).max((FLAT_PX / focal_px).powi(2));
        let together: f64 = fitted.errors.iter().sum();
        if together - alone <= ADDED * (3.0 * n - 3.0) * sigma2 {
            let sigma = (together / (5.0 * n - 3.0)).sqrt().max(CORNER_PX / focal_px);
            return Some((plane(&fitted, sigma)?, kept));
        }
        // The one that a plane of its own helps most.
        let gain = |at: usize| fitted.errors[at] - tags[kept[at]].error;
        let worst = (0..kept.len()).max_by(|a, b| gain(*a).total_cmp(&gain(*b)))?;
        kept.remove(worst);
    }
    None
}

fn plane(fitted: &Fitted, sigma: f64) -> Option<SharedPlane> {
    let covariance = fitted.normal.try_inverse()? * (sigma * sigma);
    Some(SharedPlane { per_m: fitted.per_m, covariance })
}

/// The plane nearest to the corners where each tag's own plane has them: least squares in inverse depth.
fn through<'a>(tags: impl Iterator<Item = &'a Alone>) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for tag in tags {
        for corner in &tag.rays {
            let ray = corner.push(1.0);
            normal += ray * ray.transpose();
            right += ray * tag.plane.per_m.dot(&ray);
        }
    }
    normal.cholesky().map(|c| c.solve(&right))
}

/// A least-squares plane.
struct Fitted {
    per_m: Vector3<f64>,
    /// Squared errors of each tag, normalised coordinates.
    errors: Vec<f64>,
    /// The normal matrix there.
    normal: Matrix3<f64>,
}

/// The nearest plane on which squares of one size fit the corners best. Levenberg's damping, slopes by small steps.
fn fit(tags: &[Rays], size_m: f64, start: Vector3<f64>) -> Option<Fitted> {
    let mut now = residuals(tags, size_m, &start)?;
    let mut at = start;
    let mut damping = 1e-3;
    let mut slopes = slopes(tags, size_m, &at, &now)?;
    for _ in 0..40 {
        let (normal, right) = system(&slopes, &now);
        let damped = normal + Matrix3::from_diagonal(&(normal.diagonal() * damping));
        let step = damped.cholesky().map(|c| c.solve(&right))?;
        let next = at - step;
        match residuals(tags, size_m, &next) {
            Some(there) if square(&there) < square(&now) => {
                let done = step.norm() < 1e-9 * next.norm();
                (at, now) = (next, there);
                slopes = self::slopes(tags, size_m, &at, &now)?;
                damping = (damping * 0.1_f64).max(1e-12);
                if done {
                    break;
                }
            }
            _ if damping > 1e6 => break,
            _ => damping *= 10.0,
        }
    }
    let errors = now.chunks_exact(4).map(square).collect();
    Some(Fitted { per_m: at, errors, normal: system(&slopes, &now).0 })
}

fn square(residuals: &[Vector2<f64>]) -> f64 {
    residuals.iter().map(Vector2::norm_squared).sum()
}

fn system(slopes: &[[Vector2<f64>; 3]], now: &[Vector2<f64>]) -> (Matrix3<f64>, Vector3<f64>) {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (slope, residual) in slopes.iter().zip(now) {
        for axis in 0..2 {
            let row = Vector3::new(slope[0][axis], slope[1][axis], slope[2][axis]);
            normal += row * row.transpose();
            right += row * residual[axis];
        }
    }
    (normal, right)
}

/// How the residuals change with the plane.
fn slopes(
    tags: &[Rays],
    size_m: f64,
    at: &Vector3<f64>,
    now: &[Vector2<f64>],
) -> Option<Vec<[Vector2<f64>; 3]>> {
    let step = 1e-6 * at.norm();
    let mut slopes = vec![[Vector2::zeros(); 3]; now.len()];
    for axis in 0..3 {
        let mut moved = *at;
        moved[axis] += step;
        for ((slope, there), here) in slopes.iter_mut().zip(residuals(tags, size_m, &moved)?).zip(now) {
            slope[axis] = (there - here) / step;
        }
    }
    Some(slopes)
}

/// By how much the corners of squares, each placed on the plane as its own corners say, miss the corners seen.
fn residuals(tags: &[Rays], size_m: f64, per_m: &Vector3<f64>) -> Option<Vec<Vector2<f64>>> {
    let distance = 1.0 / per_m.norm();
    let normal = per_m * distance;
    if !distance.is_finite() {
        return None;
    }
    let first = normal.cross(&if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() }).normalize();
    let second = normal.cross(&first);
    let half = size_m / 2.0;
    let square =
        [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, y)| Vector2::new(x, y));
    let mut residuals = Vec::with_capacity(4 * tags.len());
    for tag in tags {
        let mut on = [Vector2::zeros(); 4];
        for (on, corner) in on.iter_mut().zip(tag) {
            let ray = corner.push(1.0);
            let inverse = per_m.dot(&ray);
            if inverse <= 0.0 {
                return None;
            }
            let point = ray / inverse;
            *on = Vector2::new(point.dot(&first), point.dot(&second));
        }
        let centre = on.iter().sum::<Vector2<f64>>() / 4.0;
        // The turn that brings the square nearest; seen from its printed side it may be mirrored by the plane's axes.
        let turn = |mirror: f64| {
            square.iter().zip(&on).fold(Vector2::zeros(), |sum: Vector2<f64>, (s, p)| {
                let (s, p) = (Vector2::new(s.x, mirror * s.y), p - centre);
                sum + Vector2::new(s.dot(&p), s.x * p.y - s.y * p.x)
            })
        };
        let (straight, mirrored) = (turn(1.0), turn(-1.0));
        let (mirror, turn) =
            if straight.norm() >= mirrored.norm() { (1.0, straight) } else { (-1.0, mirrored) };
        let turn = turn.try_normalize(0.0)?;
        for (s, corner) in square.iter().zip(tag) {
            let s = Vector2::new(s.x, mirror * s.y);
            let placed = centre + Vector2::new(turn.x * s.x - turn.y * s.y, turn.y * s.x + turn.x * s.y);
            let point = normal * distance + first * placed.x + second * placed.y;
            if point.z <= 0.0 {
                return None;
            }
            residuals.push(point.xy() / point.z - corner);
        }
    }
    Some(residuals)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
    use vice_core::random::Congruential;

    const SIZE_M: f64 = 0.095;
    const FOCAL_PX: f64 = 460.0;

    /// Tags at places of a board one metre away (metres, right and down of its middle), corners with errors.
    fn board(tilt: f64, places: &[[f64; 3]], noise_px: f64) -> (Vec<Rays>, Isometry3<f64>) {
        let camera_from_board = Isometry3::from_parts(
            Translation3::new(0.05, -0.1, 1.0),
            UnitQuaternion::from_euler_angles(tilt, 0.3 - tilt, 0.4),
        );
        let mut numbers = Congruential::new(5);
        let mut noise = || {
            let sum: f64 = (0..12).map(|_| numbers.uniform(-0.5, 0.5)).sum();
            sum * noise_px / FOCAL_PX
        };
        let half = SIZE_M / 2.0;
        let tags = places.iter().map(|[x, y, z]| {
            [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(dx, dy)| {
                let p = camera_from_board * Point3::new(x + dx, y + dy, *z);
                Vector2::new(p.x / p.z + noise(), p.y / p.z + noise())
            })
        });
        (tags.collect(), camera_from_board)
    }

    fn grid() -> Vec<[f64; 3]> {
        (0..12).map(|i| [0.12 * f64::from(i % 4) - 0.18, 0.12 * f64::from(i / 4) - 0.12, 0.0]).collect()
    }

    fn alone(tags: &[Rays]) -> Vec<Alone> {
        // From facing the camera at the distance that the size says.
        let start =
            |t: &Rays| Vector3::new(0.0, 0.0, ((t[1] - t[0]).norm() + (t[3] - t[0]).norm()) / (2.0 * SIZE_M));
        tags.iter().map(|t| Alone::new(*t, SIZE_M, start(t), FOCAL_PX).unwrap()).collect()
    }

    fn truth(camera_from_board: &Isometry3<f64>, ray: &Vector3<f64>) -> f64 {
        let normal = camera_from_board.rotation * Vector3::z();
        normal.dot(&camera_from_board.translation.vector) / normal.dot(ray)
    }

    #[test]
    fn tags_without_errors_give_their_plane_exactly() {
        for tilt in [-0.6, 0.1, 0.7] {
            let (tags, board) = board(tilt, &grid(), 0.0);
            let (plane, kept) = shared(&alone(&tags), SIZE_M, FOCAL_PX).unwrap();
            assert_eq!(kept.len(), tags.len());
            for ray in tags.iter().flatten().map(|c| c.push(1.0)) {
                let (z_m, _) = plane.depth_m(&ray).unwrap();
                assert!((z_m - truth(&board, &ray)).abs() < 1e-7, "{tilt}: {z_m}");
            }
        }
    }

    #[test]
    fn together_they_are_better_than_alone_and_both_know_how_good_they_are() {
        let (tags, board) = board(0.4, &grid(), 0.15);
        let alone = alone(&tags);
        let (plane, _) = shared(&alone, SIZE_M, FOCAL_PX).unwrap();
        let errors = |plane: &SharedPlane, tag: &Rays| -> Vec<(f64, f64)> {
            let each = tag.iter().map(|c| c.push(1.0)).map(|ray| {
                let (z_m, sigma_m) = plane.depth_m(&ray).unwrap();
                ((z_m - truth(&board, &ray)).abs(), sigma_m)
            });
            each.collect()
        };
        let joint: Vec<_> = tags.iter().flat_map(|t| errors(&plane, t)).collect();
        let single: Vec<_> = tags.iter().zip(&alone).flat_map(|(t, alone)| errors(&alone.plane, t)).collect();
        let rms = |all: &[(f64, f64)], pick: fn(&(f64, f64)) -> f64| {
            (all.iter().map(|e| pick(e).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
        };
        assert!(rms(&joint, |e| e.0) < 0.2 * rms(&single, |e| e.0), "{joint:?} {single:?}");
        for all in [&joint, &single] {
            let (error, said) = (rms(all, |e| e.0), rms(all, |e| e.1));
            assert!((0.3..3.0).contains(&(error / said)), "errors of {error} m, said to be {said} m");
        }
    }

    #[test]
    fn a_tag_that_lies_elsewhere_is_left_out() {
        let mut places = grid();
        places[5][2] = 0.1;
        let (tags, board) = board(0.3, &places, 0.1);
        let (plane, kept) = shared(&alone(&tags), SIZE_M, FOCAL_PX).unwrap();
        assert_eq!(kept, [0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11]);
        let ray = tags[0][0].push(1.0);
        assert!((plane.depth_m(&ray).unwrap().0 - truth(&board, &ray)).abs() < 0.004);
        assert!(shared(&alone(&tags[..1]), SIZE_M, FOCAL_PX).is_none(), "one tag shares nothing");
    }
}
