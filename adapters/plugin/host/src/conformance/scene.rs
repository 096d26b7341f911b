//! What is known of the scene: depth images, scan, floor.

use vice_core::dataset::{CloudSource, Dataset, Floor};
use vice_core::error::one_line;

use super::{Check, Lists, spread};

impl Check<'_> {
    pub(super) fn depth(&mut self, dataset: &dyn Dataset, lists: &Lists) {
        let mut any = false;
        for camera in &lists.cameras {
            let name = &camera.name;
            self.step(format!("depth images of camera {name}"));
            let announced = dataset.has_depth(name);
            any |= announced;
            let size = dataset.camera(name).map(|c| (c.width(), c.height())).ok();
            let (mut found, mut with_values) = (0_usize, 0_usize);
            let places = spread(camera.frames.len(), self.thorough.images);
            for place in &places {
                self.step(format!("depth image {place} of camera {name}"));
                match dataset.depth_image(name, *place) {
                    Ok(Some(depth)) => {
                        found += 1;
                        with_values += usize::from(depth.z_m().iter().any(|z| !z.is_nan()));
                        if size.is_some_and(|s| s != (depth.width(), depth.height())) {
                            self.fault(format!(
                                "depth image {place} of camera {name} is {}x{}, the camera's images are not: it must be registered to them",
                                depth.width(),
                                depth.height()
                            ));
                            break;
                        }
                        let near = depth.z_m().iter().copied().fold(f32::INFINITY, f32::min);
                        if near.is_finite() && near > 100.0 {
                            self.suspicious(format!(
                                "depth image {place} of camera {name}: nothing is nearer than {near} m: is it in millimetres?"
                            ));
                        }
                    }
                    Ok(None) => {}
                    Err(error) => {
                        self.fault(format!("depth image {place} of camera {name}: {}", one_line(&error)));
                        break;
                    }
                }
            }
            match (announced, found) {
                (true, 0) => self.fault(format!("camera {name} announces depth images, but none was found")),
                (false, 1..) => self.fault(format!(
                    "camera {name} has depth images, but does not announce them: `--depth zcam` would be refused"
                )),
                (true, _) if with_values == 0 => {
                    self.suspicious(format!("camera {name}: no depth image has a value"));
                }
                (true, _) => self.good(format!(
                    "camera {name}: depth images at {found} of {} frames that were looked at",
                    places.len()
                )),
                (false, 0) => {}
            }
        }
        if !any {
            self.missing("no depth images: `--depth zcam` will not work");
        }
    }

    pub(super) fn scene(&mut self, dataset: &dyn Dataset, lists: &Lists) {
        self.step("scan of the scene");
        match dataset.cloud() {
            Ok(None) => self.missing("no point cloud: `--depth zmap` and `--depth mesh` will not work"),
            Ok(Some(cloud)) => match cloud.source {
                CloudSource::File(path) if path.is_file() => self.good(format!("a scan: {}", path.display())),
                CloudSource::File(path) => self.fault(format!("the scan {} is no file", path.display())),
                CloudSource::Points(points) if points.is_empty() => {
                    self.fault("a scan of no points: there should be none");
                }
                CloudSource::Points(points) => self.good(format!("a scan of {} points", points.len())),
                _ => {}
            },
            Err(error) => self.fault(format!("scan: {}", one_line(&error))),
        }
        match dataset.mesh().map(|mesh| mesh.map(|m| m.source)) {
            Ok(Some(CloudSource::File(path))) if !path.is_file() => {
                self.fault(format!("the faces {} are no file", path.display()));
            }
            Ok(_) => {}
            Err(error) => self.fault(format!("faces: {}", one_line(&error))),
        }
        self.step("floor");
        if let Some((first, _)) = lists.extent() {
            match dataset.floor(first) {
                Ok(floor) => {
                    let (frame, z) = match floor {
                        Floor::World(plane) => ("world", plane.normal().z),
                        Floor::Body(plane) => ("body", plane.normal().z),
                        _ => ("", 1.0),
                    };
                    match frame {
                        "" => self.good("the floor is said to be unknown".to_string()),
                        frame => self.good(format!("the floor is known in the {frame}")),
                    }
                    if frame == "world" && z.abs() < 0.7 {
                        self.suspicious("the floor is steep in the world: does its z point up?");
                    }
                }
                Err(error) => self.error("no floor at the first frame", &error),
            }
        }
    }
}
