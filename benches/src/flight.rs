//! A flight without images in EuRoC's layout, an estimate of it, and labels on the floor.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use vice_core::camera::{Camera, Pixel};
use vice_core::frames::WorldFromCamera;
use vice_core::random::Congruential;

use crate::radtan;

/// The first stamp, nanoseconds.
pub const START_NS: u64 = 1_600_000_000_000_000_000;
/// Between two frames: 20 a second.
pub const FRAME_NS: u64 = 50_000_000;

/// How long a flight is, and what is labelled.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Number of frames.
    pub frames: usize,
    /// Poses from one frame to the next.
    pub poses_a_frame: u64,
    /// Points with a label in every frame.
    pub points: usize,
}

/// Where the camera is: looking down at the floor, swaying a little and wandering over it.
fn world_from_camera(ns: u64) -> WorldFromCamera {
    let t = ns as f64 * 1e-9;
    let down = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
    let down = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down));
    let sway = Vector3::new(0.1 * (0.7 * t).sin(), 0.1 * (0.9 * t).cos(), 0.3 * (0.2 * t).sin());
    let place = Vector3::new(3.0 * (0.11 * t).sin(), 3.0 * (0.07 * t).cos(), 1.6 + 0.3 * (0.4 * t).sin());
    WorldFromCamera::from_parts(place, UnitQuaternion::from_scaled_axis(sway) * down)
}

/// A file to be written, through a large buffer.
///
/// # Errors
/// If it cannot be made.
pub fn create(path: &Path) -> std::io::Result<BufWriter<File>> {
    Ok(BufWriter::with_capacity(1 << 20, File::create(path)?))
}

impl Flight {
    /// Writes the folder `flight`, and beside it `estimate.txt` (TUM's format) and `labels.csv`. Each point is carried
    /// until it leaves the image and is then placed anew, as an annotator does.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Box<dyn Error + Send + Sync>> {
        let camera = radtan()?;
        let flight = folder.join("flight/mav0");
        let (images, truth) = (flight.join("cam0"), flight.join("state_groundtruth_estimate0"));
        std::fs::create_dir_all(images.join("data"))?;
        std::fs::create_dir_all(&truth)?;
        let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
        let distortion = &camera.model().coefficients()[..4];
        std::fs::write(
            images.join("sensor.yaml"),
            format!(
                "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, \
                 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: \
                 pinhole\nintrinsics: [{fx}, {fy}, {cx}, {cy}]\ndistortion_model: \
                 radial-tangential\ndistortion_coefficients: {distortion:?}\n"
            ),
        )?;
        let mut listing = create(&images.join("data.csv"))?;
        let mut poses = create(&truth.join("data.csv"))?;
        let mut estimate = create(&folder.join("estimate.txt"))?;
        let mut numbers = Congruential::new(3);
        writeln!(listing, "#timestamp [ns],filename")?;
        writeln!(poses, "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z")?;
        for i in 0..self.frames as u64 * self.poses_a_frame {
            let ns = FRAME_NS / self.poses_a_frame * i;
            let (pose, stamp) = (world_from_camera(ns), START_NS + ns);
            let ([x, y, z], q): ([f64; 3], _) = (pose.translation().into(), pose.rotation());
            writeln!(poses, "{stamp},{x:.9},{y:.9},{z:.9},{:.12},{:.12},{:.12},{:.12}", q.w, q.i, q.j, q.k)?;
            let [x, y, z] = [x, y, z].map(|v| v + numbers.uniform(-0.01, 0.01));
            let (seconds, nanos) = (stamp / 1_000_000_000, stamp % 1_000_000_000);
            write!(estimate, "{seconds}.{nanos:09} {x:.9} {y:.9} {z:.9} ")?;
            writeln!(estimate, "{:.12} {:.12} {:.12} {:.12}", q.i, q.j, q.k, q.w)?;
            if i % self.poses_a_frame == 0 {
                writeln!(listing, "{stamp},{stamp}.png")?;
            }
        }
        for mut file in [listing, poses, estimate] {
            file.flush()?;
        }
        self.write_labels(&folder.join("labels.csv"), &camera)
    }

    fn write_labels(&self, path: &Path, camera: &Camera) -> Result<(), Box<dyn Error + Send + Sync>> {
        let mut numbers = Congruential::new(5);
        let mut places: Vec<Option<Point3<f64>>> = vec![None; self.points];
        let mut labels = create(path)?;
        writeln!(labels, "point,timestamp_ns,u_px,v_px,keyframe")?;
        for frame in 0..self.frames as u64 {
            let pose = world_from_camera(FRAME_NS * frame);
            let camera_from_world = pose.inverse();
            for (name, place) in places.iter_mut().enumerate() {
                let seen = place.and_then(|p| camera.project(&camera_from_world.transform_point(&p)).ok());
                let seen = seen.map(|px| Pixel::new(px.u + numbers.uniform(-0.3, 0.3), px.v));
                // As written, with three decimals, it must still lie in the image.
                let seen = seen.filter(|px| (0.0..751.0).contains(&px.u) && (0.0..479.0).contains(&px.v));
                let px = match seen {
                    Some(px) => px,
                    None => {
                        let px = Pixel::new(numbers.uniform(100.0, 650.0), numbers.uniform(80.0, 400.0));
                        let ray = pose.rotate(&camera.unproject(px)?);
                        let eye = pose.translation();
                        *place = Some(Point3::from(eye - ray * (eye.z / ray.z)));
                        px
                    }
                };
                let (stamp, keyframe) = (START_NS + FRAME_NS * frame, u8::from(seen.is_none()));
                writeln!(labels, "{name},{stamp},{:.3},{:.3},{keyframe}", px.u, px.v)?;
            }
        }
        Ok(labels.flush()?)
    }
}
