//! Where labels may start: where the depth that they will be lifted with is known, and not at an edge.

use std::sync::OnceLock;

use vice_core::camera::Pixel;
use vice_core::dataset::Image;
use vice_core::depth::{DepthSample, DepthSource, Keyframe};
use vice_core::error::{DataResult, one_line};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_track::auto::{Footage, Ground};

use crate::error::RunResult;
use crate::open::Opened;
use crate::request::{DepthName, DepthSpec};
use crate::scene::Scene;

/// How far a surface may be from the floor to be taken for it: a share of the depth, and metres.
const ON_FLOOR: (f64, f64) = (0.02, 0.03);
/// What surrounds a point is asked so far off, pixels: nearly as far as the tracker looks.
const AROUND_PX: f64 = 7.0;
/// A surface bends by no more than this share of the depth from one side of a point to the other: else there is an edge.
const BEND: f64 = 0.03;

/// The frames of a recording as the tracker asks for them.
pub(super) struct Film<'a> {
    pub(super) opened: &'a Opened,
    /// Index of the frame at position 0.
    pub(super) first: usize,
    pub(super) grounds: &'a Grounds<'a>,
}

impl Footage for Film<'_> {
    fn picture(&self, position: usize) -> DataResult<Image> {
        self.opened.dataset.image(&self.opened.camera_name, self.first + position)
    }

    fn ground(&self, position: usize, pixels: &[Pixel]) -> DataResult<Vec<Ground>> {
        self.grounds.at(self.first + position, pixels)
    }
}

/// What knows where labels may start.
pub(super) struct Grounds<'a> {
    scene: &'a Scene,
    source: Option<(DepthName, Box<dyn DepthSource>)>,
    /// What sees whether a place is on the floor, where the floor is asked.
    surface: Option<Box<dyn DepthSource>>,
    /// Why there is no depth.
    without: Option<String>,
    /// Whether any place was fit.
    any: OnceLock<()>,
}

impl<'a> Grounds<'a> {
    /// # Errors
    /// [`crate::error::RunError`] if a source is asked for that the recording has not.
    pub(super) fn new(spec: &DepthSpec, scene: &'a Scene) -> RunResult<Self> {
        spec.check_of_frames()?;
        let opened = &scene.opened;
        let mut grounds = Self { scene, source: None, surface: None, without: None, any: OnceLock::new() };
        let has_depth = opened.dataset.has_depth(&opened.camera_name);
        let has_cloud = opened.dataset.cloud().is_ok_and(|c| c.is_some());
        let name = match spec.sources.first() {
            Some(name) => *name,
            None if has_depth => DepthName::ZCam,
            None if has_cloud => DepthName::ZMap,
            None => {
                grounds.without = Some("the recording has neither a depth camera nor a scan".to_string());
                return Ok(grounds);
            }
        };
        let asked = !spec.sources.is_empty();
        let source = match spec.make(name, opened) {
            Ok(source) => source,
            Err(error) if asked => return Err(error),
            Err(error) => {
                grounds.without = Some(one_line(&error));
                return Ok(grounds);
            }
        };
        let needs_world = match opened.frames.first() {
            Some(stamp) => source.needs_world(&opened.dataset.floor(*stamp)?),
            None => false,
        };
        if needs_world && scene.anchor.is_none() {
            grounds.without = Some(format!("no reference places the camera, which {name} depth needs"));
            return Ok(grounds);
        }
        if name == DepthName::Floor {
            let seen_by = if has_depth { DepthName::ZCam } else { DepthName::ZMap };
            if has_depth || (has_cloud && scene.anchor.is_some()) {
                grounds.surface = spec.make(seen_by, opened).ok();
            }
        }
        grounds.source = Some((name, source));
        Ok(grounds)
    }

    /// In words.
    pub(super) fn name(&self) -> String {
        match &self.source {
            Some((name, _)) => format!("{name} depth"),
            None => "no depth".to_string(),
        }
    }

    /// What may be why nothing was followed.
    pub(super) fn why_nothing(&self) -> String {
        match (&self.source, self.any.get()) {
            (Some((name, _)), None) => format!(": {name} depth is nowhere known at a corner and around it"),
            _ => ": there is nothing in view that stays recognisable".to_string(),
        }
    }

    pub(super) fn suspicions(&self) -> Suspicions {
        let mut suspicions = Suspicions::new();
        let dataset = self.scene.opened.dataset.name();
        if let Some(reason) = &self.without {
            let text = "labels may start where no depth is known, or at its edges";
            suspicions.add(
                Suspicion::new("labels-without-depth", dataset, text)
                    .evidence(reason.clone())
                    .advice("name the depth that they will be evaluated with as `depth`"),
            );
        }
        let is_floor = self.source.as_ref().is_some_and(|(name, _)| *name == DepthName::Floor);
        if is_floor && self.surface.is_none() {
            let text = "points may lie on walls and things instead of the floor";
            suspicions.add(
                Suspicion::new("labels-off-floor", dataset, text)
                    .evidence("neither a depth camera nor a scan tells them apart")
                    .advice("look at the labels, or evaluate them with measured depth"),
            );
        }
        suspicions
    }

    fn at(&self, frame: usize, pixels: &[Pixel]) -> DataResult<Vec<Ground>> {
        let Some((name, source)) = &self.source else { return Ok(vec![Ground::Fit(None); pixels.len()]) };
        let opened = &self.scene.opened;
        let stamp = opened.frames[frame];
        let pose = self.scene.anchor.as_ref().and_then(|t| t.pose_at(stamp, self.scene.max_gap).ok());
        let camera = (opened.camera_name.as_str(), &opened.camera);
        let keyframe = Keyframe::at(opened.dataset.as_ref(), camera, (frame, stamp), pose)?;
        let places: Vec<Pixel> = pixels.iter().flat_map(|px| around(*px)).collect();
        let ask = |source: &dyn DepthSource, pixels: &[Pixel]| -> DataResult<Vec<Option<DepthSample>>> {
            Ok(source.depths(&keyframe, pixels)?.into_iter().map(Result::ok).collect())
        };
        let is_target = *name == DepthName::Tag;
        let grounds = match &self.surface {
            Some(surface) => {
                let (floor, seen) = (ask(source.as_ref(), &places)?, ask(surface.as_ref(), &places)?);
                floor
                    .chunks(PLACES)
                    .zip(seen.chunks(PLACES))
                    .map(|(floor, seen)| on_floor(floor, seen))
                    .collect()
            }
            // A target is small and flat, and the floor has no edges.
            None if is_target || *name == DepthName::Floor => {
                let known = ask(source.as_ref(), pixels)?;
                known.into_iter().map(|d| d.map_or(Ground::Unfit, |d| Ground::Fit(Some(d.z_m)))).collect()
            }
            None => ask(source.as_ref(), &places)?.chunks(PLACES).map(on_surface).collect::<Vec<_>>(),
        };
        if grounds.iter().any(|g| *g != Ground::Unfit) {
            let _ = self.any.set(());
        }
        Ok(grounds)
    }
}

/// A place and those around it.
const PLACES: usize = 9;

/// A place, then four pairs on either side of it.
fn around(px: Pixel) -> [Pixel; PLACES] {
    let at = |du: f64, dv: f64| Pixel::new(px.u + AROUND_PX * du, px.v + AROUND_PX * dv);
    let d = std::f64::consts::FRAC_1_SQRT_2;
    [
        at(0.0, 0.0),
        at(1.0, 0.0),
        at(-1.0, 0.0),
        at(0.0, 1.0),
        at(0.0, -1.0),
        at(d, d),
        at(-d, -d),
        at(d, -d),
        at(-d, d),
    ]
}

/// Where depth is known around a place, it is a surface without an edge.
fn on_surface(depths: &[Option<DepthSample>]) -> Ground {
    let Some((Some(here), around)) =
        depths.split_first().filter(|(here, _)| here.is_some_and(|d| !d.on_edge))
    else {
        return Ground::Unfit;
    };
    let bends: Vec<f64> = around
        .chunks(2)
        .filter_map(|pair| {
            Some((pair.first()?.as_ref()?.z_m + pair.get(1)?.as_ref()?.z_m - 2.0 * here.z_m).abs())
        })
        .collect();
    // Half of the directions at least.
    let flat = bends.len() >= 2 && bends.iter().all(|bend| *bend <= BEND * here.z_m);
    if flat { Ground::Fit(Some(here.z_m)) } else { Ground::Unfit }
}

/// What is seen is the floor, here and around.
fn on_floor(floor: &[Option<DepthSample>], seen: &[Option<DepthSample>]) -> Ground {
    let near = |(floor, seen): (&Option<DepthSample>, &Option<DepthSample>)| match (floor, seen) {
        (Some(floor), Some(seen)) => {
            Some((floor.z_m - seen.z_m).abs() <= ON_FLOOR.0 * floor.z_m + ON_FLOOR.1)
        }
        _ => None,
    };
    let all: Vec<Option<bool>> = floor.iter().zip(seen).map(near).collect();
    let known = all.iter().flatten().count();
    let here = all.first().copied().flatten() == Some(true);
    match floor.first() {
        Some(Some(sample)) if here && known >= PLACES / 2 && all.iter().flatten().all(|near| *near) => {
            Ground::Fit(Some(sample.z_m))
        }
        _ => Ground::Unfit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depths(z_m: [f64; PLACES]) -> Vec<Option<DepthSample>> {
        z_m.iter().map(|z| (*z > 0.0).then_some(DepthSample::new(*z))).collect()
    }

    #[test]
    fn edges_are_no_ground_and_slants_are() {
        let slant = depths([2.0, 2.3, 1.7, 2.0, 2.0, 2.2, 1.8, 2.2, 1.8]);
        assert_eq!(on_surface(&slant), Ground::Fit(Some(2.0)));
        let edge = depths([2.0, 2.0, 3.0, 2.0, 2.0, 2.0, 3.0, 2.0, 3.0]);
        assert_eq!(on_surface(&edge), Ground::Unfit);
        let unknown = depths([2.0, 0.0, 2.0, 0.0, 2.0, 0.0, 2.0, 2.0, 2.0]);
        assert_eq!(on_surface(&unknown), Ground::Unfit);
        assert_eq!(on_surface(&depths([0.0; PLACES])), Ground::Unfit);
    }

    #[test]
    fn a_box_on_the_floor_is_not_the_floor() {
        let floor = depths([3.0; PLACES]);
        assert_eq!(on_floor(&floor, &floor), Ground::Fit(Some(3.0)));
        assert_eq!(on_floor(&floor, &depths([3.05; PLACES])), Ground::Fit(Some(3.0)));
        assert_eq!(on_floor(&floor, &depths([2.7; PLACES])), Ground::Unfit);
        let beside = depths([3.0, 3.0, 2.7, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0]);
        assert_eq!(on_floor(&floor, &beside), Ground::Unfit);
        assert_eq!(on_floor(&floor, &depths([0.0; PLACES])), Ground::Unfit);
    }
}
