//! The first step: the points of the cloud that are in view, found through the index.
//!
//! A window of the image is a pyramid of rays. Its sides follow from the rays along the window's border, so that
//! whole boxes of the index are passed over; what a key frame costs is what is in view, not what was scanned.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::frames::{self, Rigid};

use crate::cloud::{Bounds, Cloud, Leaf, Overlap, Patch};

/// Points nearer than this do not count as seen, metres.
pub(crate) const NEAREST_M: f64 = 0.1;

/// Rays along each side of a window.
const SIDE_RAYS: u32 = 32;

/// A point of the cloud as the camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Pixels.
    pub(crate) u: f64,
    /// Pixels.
    pub(crate) v: f64,
    /// Metres along the optical axis.
    pub(crate) z_m: f64,
    /// Its ray `(x, y, 1)`.
    pub(crate) ray: [f32; 2],
    /// The leaf it is of.
    pub(crate) leaf: u32,
}

/// A patch of the cloud in the camera frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    pub(crate) centre: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
    pub(crate) spacing_m: f64,
    pub(crate) thickness_m: f64,
}

/// A part of the image, pixels: from `low`, included, to `high`, not included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    pub(crate) low: Pixel,
    pub(crate) high: Pixel,
}

impl Window {
    /// The image with a margin around it.
    pub(crate) fn image(camera: &Camera, margin_px: f64) -> Self {
        let side = |n: u32| f64::from(n) - 0.5 + margin_px;
        Self {
            low: Pixel::new(-0.5 - margin_px, -0.5 - margin_px),
            high: Pixel::new(side(camera.width()), side(camera.height())),
        }
    }

    /// What lies within `half_px` of a pixel, widened to whole cells of `cell_px`.
    pub(crate) fn around(at: Pixel, half_px: f64, cell_px: f64) -> Self {
        let low = |px: f64| ((px - half_px + 0.5) / cell_px).floor() * cell_px - 0.5;
        let high = |px: f64| ((px + half_px + 0.5) / cell_px).ceil() * cell_px - 0.5;
        Self { low: Pixel::new(low(at.u), low(at.v)), high: Pixel::new(high(at.u), high(at.v)) }
    }

    /// With a margin around it.
    pub(crate) fn grown(&self, margin_px: f64) -> Self {
        let (low, high) = (self.low, self.high);
        Self {
            low: Pixel::new(low.u - margin_px, low.v - margin_px),
            high: Pixel::new(high.u + margin_px, high.v + margin_px),
        }
    }

    /// The part of it that lies in another.
    pub(crate) fn within(&self, other: &Self) -> Self {
        Self {
            low: Pixel::new(self.low.u.max(other.low.u), self.low.v.max(other.low.v)),
            high: Pixel::new(self.high.u.min(other.high.u), self.high.v.min(other.high.v)),
        }
    }

    pub(crate) fn contains(&self, px: Pixel) -> bool {
        px.u >= self.low.u && px.v >= self.low.v && px.u < self.high.u && px.v < self.high.v
    }

    pub(crate) fn area_px2(&self) -> f64 {
        (self.high.u - self.low.u) * (self.high.v - self.low.v)
    }

    fn at(&self, u: f64, v: f64) -> Pixel {
        let (low, high) = (self.low, self.high);
        Pixel::new(low.u + (high.u - low.u) * u, low.v + (high.v - low.v) * v)
    }
}

/// A cloud before a camera.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    cloud: &'a Cloud,
    camera: &'a Camera,
    rotation: Matrix3<f64>,
    /// Where the origin of stored points is, metres.
    translation: Vector3<f64>,
}

impl<'a> View<'a> {
    pub(crate) fn new(
        cloud: &'a Cloud,
        camera: &'a Camera,
        camera_from_cloud: &Rigid<frames::Camera, frames::Cloud>,
    ) -> Self {
        let (rotation, translation) = camera_from_cloud.to_matrix_and_translation();
        Self { cloud, camera, rotation, translation: translation + rotation * cloud.origin_m() }
    }

    pub(crate) const fn camera(&self) -> &'a Camera {
        self.camera
    }

    /// Leaves that may have points in a window, in the order of the index.
    pub(crate) fn leaves(&self, window: &Window) -> Vec<Leaf> {
        let sides = self.sides(window);
        self.cloud.leaves(|bounds| overlap(bounds, &sides))
    }

    /// The points of a leaf that lie in a window.
    pub(crate) fn seen(&self, leaf: Leaf, window: Window) -> impl Iterator<Item = Seen> + use<'a> {
        let view = *self;
        view.cloud.stored(&leaf).iter().filter_map(move |p| {
            let p = Vector3::from(p.map(f64::from));
            let in_camera = Point3::from(view.rotation * p + view.translation);
            if in_camera.z <= NEAREST_M {
                return None;
            }
            let px = view.camera.project(&in_camera).ok().filter(|px| window.contains(*px))?;
            let ray = [(in_camera.x / in_camera.z) as f32, (in_camera.y / in_camera.z) as f32];
            Some(Seen { u: px.u, v: px.v, z_m: in_camera.z, ray, leaf: leaf.index })
        })
    }

    /// Leaves that may have points in the windows that `window_of` gives for them: one of `windows` by its place.
    pub(crate) fn leaves_in(&self, windows: &[Window], window_of: impl Fn(&Leaf) -> usize) -> Vec<Leaf> {
        let sides: Vec<_> = windows.iter().map(|w| self.sides(w)).collect();
        let Some(largest) = windows.last() else { return Vec::new() };
        let mut leaves = self.leaves(largest);
        leaves
            .retain(|leaf| overlap(self.cloud.bounds_of(leaf), &sides[window_of(leaf)]) != Overlap::Outside);
        leaves
    }

    /// Depth that no point of a leaf is nearer than, metres.
    pub(crate) fn nearest_m(&self, leaf: &Leaf) -> f64 {
        let (centre, half) = middle(self.cloud.bounds_of(leaf));
        let axis = Vector3::from(self.rotation.row(2).transpose());
        (axis.dot(&centre) + self.translation.z - axis.abs().dot(&half)).max(NEAREST_M)
    }

    /// All points in a window, in the order of the index.
    pub(crate) fn all_seen(&self, window: &Window) -> Vec<Seen> {
        let leaves = self.leaves(window);
        leaves.par_iter().flat_map_iter(|leaf| self.seen(*leaf, *window)).collect()
    }

    /// The patch of a leaf in the camera frame.
    pub(crate) fn patch(&self, leaf: u32) -> Facing {
        let Patch { centre, normal, spacing_m, thickness_m } = *self.cloud.patch(leaf);
        Facing {
            centre: self.rotation * Vector3::from(centre.map(f64::from)) + self.translation,
            normal: self.rotation * Vector3::from(normal.map(f64::from)),
            spacing_m: spacing_m.into(),
            thickness_m: thickness_m.into(),
        }
    }

    /// Planes `n·p + d` of the stored frame that are positive outside of all that a window can show.
    fn sides(&self, window: &Window) -> Vec<(Vector3<f64>, f64)> {
        let mut in_camera = vec![(-Vector3::z(), NEAREST_M)];
        if let Some([low, high]) = self.ray_bounds(window) {
            in_camera.extend([
                (Vector3::new(1.0, 0.0, -high[0]), 0.0),
                (Vector3::new(-1.0, 0.0, low[0]), 0.0),
                (Vector3::new(0.0, 1.0, -high[1]), 0.0),
                (Vector3::new(0.0, -1.0, low[1]), 0.0),
            ]);
        }
        let stored =
            |(n, d): (Vector3<f64>, f64)| (self.rotation.transpose() * n, d + n.dot(&self.translation));
        in_camera.into_iter().map(stored).collect()
    }

    /// Box around the rays `(x, y, 1)` of a window; `None` where nothing bounds them.
    ///
    /// Distortion is one to one within its valid radius, so that a window's rays lie within those of its border.
    fn ray_bounds(&self, window: &Window) -> Option<[[f64; 2]; 2]> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut widest_step = 0.0_f64;
        for side in 0..4 {
            let mut previous: Option<Vector3<f64>> = None;
            for i in 0..=SIDE_RAYS {
                let t = f64::from(i) / f64::from(SIDE_RAYS);
                let (u, v) = [(t, 0.0), (t, 1.0), (0.0, t), (1.0, t)][side];
                let Ok(ray) = self.camera.unproject(window.at(u, v)) else {
                    let radius = self.camera.max_radius();
                    return radius.is_finite().then_some([[-radius; 2], [radius; 2]]);
                };
                for axis in 0..2 {
                    (low[axis], high[axis]) = (low[axis].min(ray[axis]), high[axis].max(ray[axis]));
                }
                widest_step = previous.map_or(widest_step, |p| widest_step.max((ray - p).norm()));
                previous = Some(ray);
            }
        }
        // Between two rays the border may bulge, by far less than their distance.
        Some([low.map(|v| v - widest_step / 4.0), high.map(|v| v + widest_step / 4.0)])
    }
}

fn overlap(bounds: &Bounds, sides: &[(Vector3<f64>, f64)]) -> Overlap {
    let (centre, half) = middle(bounds);
    let mut result = Overlap::Inside;
    for (normal, d) in sides {
        let (at_centre, reach) = (normal.dot(&centre) + d, normal.abs().dot(&half));
        if at_centre - reach > 0.0 {
            return Overlap::Outside;
        }
        if at_centre + reach > 0.0 {
            result = Overlap::Partly;
        }
    }
    result
}

/// Centre and half the size of a box.
fn middle(bounds: &Bounds) -> (Vector3<f64>, Vector3<f64>) {
    let (low, high) = (Vector3::from(bounds.low.map(f64::from)), Vector3::from(bounds.high.map(f64::from)));
    ((low + high) / 2.0, (high - low) / 2.0)
}
