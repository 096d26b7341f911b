//! Pictures and depth images of the scene, one ray a pixel.
//!
//! The rays of the pixels are found once a camera; once a frame each box gets the rectangle of normalised coordinates
//! in which it can be seen, so that most rays are tested against the room only. Pixels on an edge between two faces
//! are sampled sixteen times. Rows are independent, so that any number of threads gives the same bytes.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::{DepthImage, Image, PixelFormat};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::WorldFromCamera;
use vice_core::time::Stamp;

use crate::pattern::Spot;
use crate::scene::{Face, ROOM_HEIGHT_M, Scene, SurfaceKind};
use crate::texture::albedo;

/// Samples along each side of a pixel that lies on an edge.
const EDGE_SAMPLES: u32 = 4;
/// Where the dark rim around a box on the floor has faded below a gray level.
const SHADOW_M: f64 = 0.6;

/// A camera's rays: what stays the same from frame to frame.
#[derive(Clone, Debug)]
pub(crate) struct Renderer {
    camera: Camera,
    /// `(x, y)` of the ray `(x, y, 1)` of each pixel, row by row.
    rays: Vec<[f64; 2]>,
}

/// What a pixel sees: depth along the optical axis and the face.
#[derive(Clone, Copy)]
struct Seen {
    z_m: f64,
    face: u16,
}

/// A frame's pose, and each solid as seen from it.
struct View<'a> {
    scene: &'a Scene,
    eye: Point3<f64>,
    world_from_camera: Matrix3<f64>,
    /// Steps of a ray's world direction for a pixel to the right and one down.
    pixel_steps: [Vector3<f64>; 2],
    solids: Vec<SolidView>,
}

/// A solid in the frame of a camera.
struct SolidView {
    eye_in_solid: Vector3<f64>,
    solid_from_camera: Matrix3<f64>,
    /// Lowest and highest x and y of normalised coordinates in which it can be seen.
    x: [f64; 2],
    y: [f64; 2],
}

impl<'a> View<'a> {
    fn new(scene: &'a Scene, camera: &Camera, pose: &WorldFromCamera) -> Self {
        let (world_from_camera, eye) = pose.to_matrix_and_translation();
        let [fx, fy, ..] = camera.fx_fy_cx_cy();
        let camera_from_world = pose.inverse();
        let solids = scene
            .solids
            .iter()
            .enumerate()
            .map(|(i, solid)| {
                let solid_from_world = solid.world_from_solid().inverse();
                let (mut x, mut y) = ([f64::MAX, f64::MIN], [f64::MAX, f64::MIN]);
                for corner in solid.corners() {
                    let c = camera_from_world.transform_point(&corner);
                    // The room surrounds the camera; a box that reaches behind the image plane has no rectangle.
                    if i == 0 || c.z < 1e-3 {
                        (x, y) = ([f64::MIN, f64::MAX], [f64::MIN, f64::MAX]);
                        break;
                    }
                    let (nx, ny) = (c.x / c.z, c.y / c.z);
                    // Rounding must not cut off an outline.
                    x = [x[0].min(nx - 1e-9), x[1].max(nx + 1e-9)];
                    y = [y[0].min(ny - 1e-9), y[1].max(ny + 1e-9)];
                }
                SolidView {
                    eye_in_solid: solid_from_world.transform_point(&Point3::from(eye)).coords,
                    solid_from_camera: solid_from_world.rotation.to_rotation_matrix().into_inner()
                        * world_from_camera,
                    x,
                    y,
                }
            })
            .collect();
        Self {
            scene,
            eye: Point3::from(eye),
            pixel_steps: [world_from_camera.column(0) / fx, world_from_camera.column(1) / fy],
            world_from_camera,
            solids,
        }
    }

    /// What the ray `(x, y, 1)` meets. The camera is inside the room, so that there is always something; a ray that
    /// slips through for rounding sees the room's first face infinitely far away.
    fn cast(&self, [x, y]: [f64; 2]) -> Seen {
        let mut seen = Seen { z_m: f64::MAX, face: 0 };
        let ray = Vector3::new(x, y, 1.0);
        for (i, (solid, view)) in (0_u16..).zip(self.scene.solids.iter().zip(&self.solids)) {
            if x < view.x[0] || x > view.x[1] || y < view.y[0] || y > view.y[1] {
                continue;
            }
            let direction = view.solid_from_camera * ray;
            if let Some((z_m, face)) = solid.cast_local(&view.eye_in_solid, &direction, seen.z_m) {
                seen = Seen { z_m, face: 6 * i + face };
            }
        }
        seen
    }

    /// Brightness (0 to 1) of what a ray sees; `share` is the side of the sample in pixels.
    fn shade(&self, [x, y]: [f64; 2], seen: Seen, share: f64) -> f64 {
        let face = &self.scene.faces[usize::from(seen.face)];
        let direction = self.world_from_camera * Vector3::new(x, y, 1.0);
        let point = self.eye + direction * seen.z_m;
        let [s, t] = face.texture_m(&point);
        // How far the place on the face moves for a pixel to the right and one down: the ray turns by a pixel and is
        // cut with the face's plane again.
        let facing = face.normal.dot(&direction);
        let [right, down] = self
            .pixel_steps
            .map(|step| (step - direction * (face.normal.dot(&step) / facing)) * (seen.z_m * share));
        let width = |axis: &Vector3<f64>| (axis.dot(&right).abs() + axis.dot(&down).abs()).clamp(1e-6, 10.0);
        let at = Spot { s, t, ws: width(&face.right), wt: width(&face.up) };
        albedo(face, &at) * self.light(face, &point, [s, t])
    }

    /// Diffuse light: from everywhere, from the window side, from a lamp under the ceiling; less of it in corners.
    fn light(&self, face: &Face, point: &Point3<f64>, [s, t]: [f64; 2]) -> f64 {
        let from_window = Vector3::new(0.80, 0.22, 0.56);
        let lamp = Point3::new(-0.4, 0.3, ROOM_HEIGHT_M - 0.1) - point;
        let lamp_distance = lamp.norm();
        let lamp_share =
            (face.normal.dot(&lamp) / lamp_distance).max(0.0) / (1.0 + 0.06 * lamp_distance.powi(2));
        let window_share = face.normal.dot(&from_window).max(0.0);
        let light = 0.56 + 0.40 * window_share + 0.52 * lamp_share;
        let nook = |distance_m: f64, depth: f64, reach_m: f64| 1.0 - depth * (-distance_m / reach_m).exp();
        let [wide, high] = face.size_m;
        let corners = match face.kind {
            SurfaceKind::Box => nook(t, 0.25, 0.06),
            SurfaceKind::Floor => {
                let walls = s.min(wide - s).min(t).min(high - t);
                let boxes = self.scene.solids[1..]
                    .iter()
                    .filter(|solid| solid.stands_on_floor())
                    .map(|solid| solid.distance_on_floor_m(point, SHADOW_M))
                    .fold(f64::INFINITY, f64::min);
                nook(walls, 0.3, 0.3) * nook(boxes, 0.55, 0.10)
            }
            SurfaceKind::Wall | SurfaceKind::Ceiling => {
                nook(s.min(wide - s), 0.22, 0.35) * nook(t.min(high - t), 0.25, 0.3)
            }
        };
        light * corners
    }
}

impl Renderer {
    /// Finds the rays of all pixels.
    ///
    /// # Errors
    /// [`DataError`] if the lens does not reach the corners of the image.
    pub(crate) fn new(camera: Camera) -> DataResult<Self> {
        let (width, height) = (camera.width(), camera.height());
        let rays = (0..height)
            .into_par_iter()
            .flat_map_iter(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| ray(&camera, f64::from(column), f64::from(row)))
            .collect::<DataResult<Vec<_>>>()?;
        Ok(Self { camera, rays })
    }

    fn seen(&self, view: &View<'_>) -> Vec<Seen> {
        let mut seen = vec![Seen { z_m: 0.0, face: 0 }; self.rays.len()];
        let width = self.camera.width() as usize;
        seen.par_chunks_mut(width).zip(self.rays.par_chunks(width)).for_each(|(row, rays)| {
            for (seen, ray) in row.iter_mut().zip(rays) {
                *seen = view.cast(*ray);
            }
        });
        seen
    }

    /// The depth image alone: about a third of the work of both.
    ///
    /// # Errors
    /// Never for a camera that was built; [`DataError`] is passed on.
    pub(crate) fn depth(
        &self,
        scene: &Scene,
        pose: &WorldFromCamera,
        stamp: Stamp,
    ) -> DataResult<DepthImage> {
        let view = View::new(scene, &self.camera, pose);
        self.depth_of(&self.seen(&view), stamp)
    }

    /// The picture and its depth image.
    ///
    /// # Errors
    /// As [`Renderer::depth`], and if the lens does not reach a corner of a pixel on the image's border.
    pub(crate) fn frame(
        &self,
        scene: &Scene,
        pose: &WorldFromCamera,
        stamp: Stamp,
    ) -> DataResult<(Image, DepthImage)> {
        let view = View::new(scene, &self.camera, pose);
        let seen = self.seen(&view);
        let (width, height) = (self.camera.width() as usize, self.camera.height() as usize);
        let mut pixels = vec![0_u8; seen.len()];
        pixels.par_chunks_mut(width).enumerate().try_for_each(|(row, line)| -> DataResult<()> {
            for (column, value) in line.iter_mut().enumerate() {
                let here = row * width + column;
                let other = |at: usize| seen[at].face != seen[here].face;
                let on_edge = (column > 0 && other(here - 1))
                    || (column + 1 < width && other(here + 1))
                    || (row > 0 && other(here - width))
                    || (row + 1 < height && other(here + width));
                let brightness = if on_edge {
                    self.edge_pixel(&view, column, row)?
                } else {
                    view.shade(self.rays[here], seen[here], 1.0)
                };
                *value = (brightness * 255.0).round().clamp(0.0, 255.0) as u8;
            }
            Ok(())
        })?;
        let image = Image::new(self.camera.width(), self.camera.height(), PixelFormat::Gray8, pixels)?;
        Ok((image, self.depth_of(&seen, stamp)?))
    }

    fn edge_pixel(&self, view: &View<'_>, column: usize, row: usize) -> DataResult<f64> {
        let share = 1.0 / f64::from(EDGE_SAMPLES);
        let offset = |i: u32| (f64::from(i) + 0.5) * share - 0.5;
        let mut sum = 0.0;
        for (i, j) in (0..EDGE_SAMPLES).flat_map(|j| (0..EDGE_SAMPLES).map(move |i| (i, j))) {
            let sample = ray(&self.camera, column as f64 + offset(i), row as f64 + offset(j))?;
            sum += view.shade(sample, view.cast(sample), share);
        }
        Ok(sum * share * share)
    }

    fn depth_of(&self, seen: &[Seen], stamp: Stamp) -> DataResult<DepthImage> {
        let z_m = seen.iter().map(|s| s.z_m as f32).collect();
        DepthImage::new(stamp, self.camera.width(), self.camera.height(), z_m)
    }
}

fn ray(camera: &Camera, u: f64, v: f64) -> DataResult<[f64; 2]> {
    let ray = camera
        .unproject(Pixel::new(u, v))
        .map_err(|e| DataError::new(format!("the lens does not reach the pixel ({u}, {v})")).because(e))?;
    Ok([ray.x, ray.y])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Synthetic;
    use crate::options::SyntheticOptions;
    use approx::assert_relative_eq;
    use vice_core::dataset::Dataset;

    fn small() -> Synthetic {
        let options = SyntheticOptions { width: 160, height: 120, duration_s: 2.0, ..Default::default() };
        Synthetic::new(options).unwrap()
    }

    #[test]
    fn depth_is_that_of_a_ray_against_the_floor_plane() {
        let synthetic = small();
        let camera = synthetic.camera("cam0").unwrap();
        let mut on_floor = 0;
        for frame in [0, 17, 39] {
            let pose = synthetic.world_from_camera(frame);
            let depth = synthetic.depth_image("cam0", frame).unwrap().unwrap();
            for (row, column) in (0..120).step_by(3).flat_map(|r| (0..160).step_by(3).map(move |c| (r, c))) {
                let ray = camera.unproject(Pixel::new(f64::from(column), f64::from(row))).unwrap();
                let direction = pose.rotate(&ray);
                let eye = Point3::from(pose.translation());
                let z = f64::from(depth.get(column, row).unwrap());
                let hit = synthetic.scene().cast(&eye, &direction).unwrap();
                assert_relative_eq!(z, hit.distance, max_relative = 1e-6);
                if synthetic.scene().kind(hit.surface) == SurfaceKind::Floor {
                    on_floor += 1;
                    assert_relative_eq!(z, -eye.z / direction.z, max_relative = 1e-6);
                } else if direction.z < 0.0 {
                    assert!(z < -eye.z / direction.z, "something in front of the floor is nearer");
                }
            }
        }
        assert!(on_floor > 1500, "only {on_floor} of 6480 rays meet the floor");
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bytes() {
        let render = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| small().frame(7).unwrap())
        };
        let (image, depth) = render(1);
        for threads in [2, 5] {
            assert_eq!(render(threads), (image.clone(), depth.clone()));
        }
        let other =
            Synthetic::new(SyntheticOptions { seed: 2, width: 160, height: 120, ..Default::default() });
        assert_ne!(other.unwrap().image("cam0", 7).unwrap(), image);
    }

    #[test]
    fn pictures_have_texture_everywhere() {
        let synthetic = Synthetic::new(SyntheticOptions::default()).unwrap();
        let image = synthetic.image("cam0", 30).unwrap();
        let (width, data) = (640, image.data());
        let mut flat = 0;
        for (row, column) in (0..480).step_by(16).flat_map(|r| (0..640).step_by(16).map(move |c| (r, c))) {
            let patch: Vec<f64> =
                (0..256).map(|i| f64::from(data[(row + i / 16) * width + column + i % 16])).collect();
            let mean = patch.iter().sum::<f64>() / 256.0;
            let variance = patch.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 256.0;
            flat += usize::from(variance.sqrt() < 4.0);
        }
        assert!(flat < 60, "{flat} of 1200 patches are flat");
    }
}
