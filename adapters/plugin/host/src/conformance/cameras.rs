//! Cameras: calibration, frames, images.

use vice_core::camera::Camera;
use vice_core::dataset::{Dataset, Image};
use vice_core::error::one_line;
use vice_core::time::Span;

use super::{CameraLists, Check, spread};

impl Check<'_> {
    pub(super) fn camera(&mut self, dataset: &dyn Dataset, lists: &CameraLists) {
        let (name, frames) = (&lists.name, &lists.frames);
        self.step(format!("calibration of camera {name}"));
        let camera = match dataset.camera(name) {
            Ok(camera) => {
                self.calibration(name, &camera);
                Some(camera)
            }
            Err(error) => {
                self.fault(format!("camera {name}: no calibration: {}", one_line(&error)));
                None
            }
        };
        self.step(format!("frames of camera {name}"));
        if frames.is_empty() {
            self.suspicious(format!("camera {name} has no frames"));
            return;
        }
        if let Some(place) = frames.windows(2).position(|w| w[0] >= w[1]) {
            self.fault(format!("camera {name}: frame {} is not later than the one before", place + 1));
        }
        self.frame_rate(lists);
        self.step(format!("place of camera {name} in the body"));
        self.extrinsics(dataset, lists);
        self.images(dataset, lists, camera.as_ref());
    }

    fn calibration(&mut self, name: &str, camera: &Camera) {
        let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
        let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
        self.good(format!(
            "camera {name}: {}x{}, {}",
            camera.width(),
            camera.height(),
            camera.model().name()
        ));
        if !(0.1 * width..10.0 * width).contains(&fx) || (fx / fy - 1.0).abs() > 0.2 {
            self.suspicious(format!(
                "camera {name}: focal lengths {fx} and {fy} px for an image of {width} px: are they in pixels?"
            ));
        }
        if (cx / width - 0.5).abs() > 0.25 || (cy / height - 0.5).abs() > 0.25 {
            self.suspicious(format!(
                "camera {name}: the principal point ({cx}, {cy}) is far from the middle"
            ));
        }
    }

    fn frame_rate(&mut self, lists: &CameraLists) {
        let (name, frames) = (&lists.name, &lists.frames);
        let mut periods: Vec<Span> = frames.windows(2).map(|w| w[1].since(w[0])).collect();
        periods.sort_unstable();
        let Some(median) = periods.get(periods.len() / 2).copied() else {
            self.good(format!("camera {name}: 1 frame"));
            return;
        };
        self.good(format!("camera {name}: {} frames, one each {median}", frames.len()));
        if !(Span::from_millis(1)..Span::from_millis(60_000)).contains(&median) {
            self.suspicious(format!(
                "camera {name}: {} ns between frames: are the stamps in nanoseconds?",
                median.as_nanos()
            ));
        }
    }

    fn extrinsics(&mut self, dataset: &dyn Dataset, lists: &CameraLists) {
        let (name, frames) = (&lists.name, &lists.frames);
        let (mut known, mut first_error) = (0, None);
        let places = spread(frames.len(), 1000);
        for place in &places {
            match dataset.body_from_camera(name, frames[*place]) {
                Ok(pose) => {
                    known += 1;
                    let far = pose.translation().norm();
                    if far > 100.0 {
                        self.fault(format!(
                            "camera {name} is {far:.0} m from the body: is body_from_camera in metres?"
                        ));
                        return;
                    }
                }
                Err(error) => {
                    first_error.get_or_insert_with(|| one_line(&error));
                }
            }
        }
        match first_error {
            None => self.good(format!("camera {name}: its place in the body is known at all frames tried")),
            Some(error) if known == 0 => {
                self.fault(format!("camera {name}: its place in the body is never known: {error}"));
            }
            Some(error) => self.suspicious(format!(
                "camera {name}: its place in the body is unknown at {} of {} frames, first: {error}",
                places.len() - known,
                places.len()
            )),
        }
    }

    fn images(&mut self, dataset: &dyn Dataset, lists: &CameraLists, camera: Option<&Camera>) {
        let (name, count) = (&lists.name, lists.frames.len());
        self.step(format!("images of camera {name}"));
        let places = spread(count, self.thorough.images);
        let mut first: Option<Image> = None;
        let mut failed = 0;
        // From the end, since films and bags are read the other way round.
        for place in places.iter().rev() {
            self.step(format!("image {place} of camera {name}"));
            match dataset.image(name, *place) {
                Ok(image) => {
                    if let Some(camera) =
                        camera.filter(|c| (c.width(), c.height()) != (image.width(), image.height()))
                    {
                        self.fault(format!(
                            "image {place} of camera {name} is {}x{}, but its calibration is for {}x{}",
                            image.width(),
                            image.height(),
                            camera.width(),
                            camera.height()
                        ));
                        return;
                    }
                    first = Some(image);
                }
                Err(error) => {
                    failed += 1;
                    if failed == 1 {
                        self.error(&format!("image {place} of camera {name}"), &error);
                    }
                }
            }
        }
        if failed == places.len() {
            self.missing(format!("camera {name}: no image can be read; labels cannot be made or drawn"));
        } else if failed > 0 {
            self.suspicious(format!("camera {name}: {failed} of {} images cannot be read", places.len()));
        } else {
            let all = if places.len() == count { "all" } else { "spread over the recording" };
            self.good(format!(
                "camera {name}: {} images were read ({all}), of the size of the calibration",
                places.len()
            ));
        }
        self.step(format!("image 0 of camera {name} again, and one beyond the last"));
        if let (Some(first), Ok(again)) = (first, dataset.image(name, 0))
            && first != again
            && failed == 0
        {
            self.fault(format!("image 0 of camera {name} is another one when it is read again"));
        }
        for place in [count, usize::MAX] {
            if dataset.image(name, place).is_ok() {
                self.fault(format!(
                    "image {place} of camera {name} is given, though there are {count} frames"
                ));
            }
        }
    }
}
