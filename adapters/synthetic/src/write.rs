//! The flight as a folder in EuRoC's layout, with estimates, labels and calibrations beside it.

use std::fmt::Write as _;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use vice_core::camera::{Camera, Model};
use vice_core::dataset::Dataset;
use vice_core::error::{DataError, DataResult};
use vice_core::frames::Rigid;
use vice_core::time::Stamp;
use vice_files::atomic::{self, Overwrite};
use vice_files::calibration::{CalibrationFile, CameraOverride};
use vice_files::image_file::{encode_depth_png, encode_png};
use vice_files::labels;
use vice_files::trajectory::{InertialRow, write_euroc as write_ground_truth, write_relative, write_tum};

use crate::dataset::{CAMERA, Synthetic};
use crate::estimates::relative_motions;
use crate::sensors;

/// Depth PNGs hold counts of this many metres: 0.2 mm, up to 13.1 m.
pub const METRES_PER_COUNT: f64 = 0.0002;

/// Renders the flight into `out`: `mav0/` as EuRoC has it, `estimates/`, `labels/`, `calibration/` and a README.
///
/// A folder that is not there yet appears only when it is complete; into one that is there already every file is
/// written beside its place and renamed. `progress` is told how many frames of how many are done, from any thread.
///
/// # Errors
/// [`DataError`] if the folder holds something and `force` is not given, if a point of the labels is never in plain
/// view, or if writing fails.
pub fn write_euroc(
    synthetic: &Synthetic,
    out: &Path,
    force: bool,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> DataResult<()> {
    if fs::symlink_metadata(out).is_ok() {
        atomic::prepare_folder(out, force)?;
        return Folder { root: out.to_path_buf(), overwrite: Overwrite::from_force(force) }
            .fill(synthetic, progress);
    }
    let failed = |e: io::Error| DataError::new("the folder cannot be made").at(out).because(e);
    let parent = match out.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(parent).map_err(failed)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".vice-synth-");
    // A temporary folder is private by default; this one becomes an ordinary folder, so the umask decides.
    #[cfg(unix)]
    let builder = {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o777))
    };
    // Removes itself on every error.
    let staged = builder.tempdir_in(parent).map_err(failed)?;
    Folder { root: staged.path().to_path_buf(), overwrite: Overwrite::Refuse }
        .fill(synthetic, progress)
        .map_err(|e| DataError::new("the flight cannot be written").at(out).because(e))?;
    fs::rename(staged.path(), out).map_err(failed)?;
    // It is no longer where it was made, and must not be removed from there.
    let _ = staged.keep();
    Ok(())
}

/// The folder that is being filled.
struct Folder {
    root: PathBuf,
    overwrite: Overwrite,
}

impl Folder {
    fn fill(&self, synthetic: &Synthetic, progress: &(dyn Fn(usize, usize) + Sync)) -> DataResult<()> {
        for folder in [
            "mav0/cam0/data",
            "mav0/depth0/data",
            "mav0/imu0",
            "mav0/state_groundtruth_estimate0",
            "mav0/pointcloud0",
            "estimates",
            "labels",
            "calibration",
        ] {
            let path = self.root.join(folder);
            fs::create_dir_all(&path)
                .map_err(|e| DataError::new("the folder cannot be made").at(&path).because(e))?;
        }
        // What can fail for the flight itself comes before the long work.
        labels::write(self.root.join("labels/floor.csv"), &synthetic.floor_labels()?, self.overwrite)?;
        labels::write(self.root.join("labels/scene.csv"), &synthetic.scene_labels()?, self.overwrite)?;
        self.sensors(synthetic)?;
        self.poses(synthetic)?;
        self.calibrations(synthetic)?;
        self.cloud(synthetic)?;
        self.frames(synthetic, progress)?;
        self.text("README.md", &sensors::readme(synthetic))
    }

    fn text(&self, name: &str, text: &str) -> DataResult<()> {
        self.bytes(name, text.as_bytes())
    }

    fn bytes(&self, name: &str, bytes: &[u8]) -> DataResult<()> {
        atomic::write(self.root.join(name), self.overwrite, |w| w.write_all(bytes))
    }

    fn sensors(&self, synthetic: &Synthetic) -> DataResult<()> {
        let stamps = synthetic.frames(CAMERA)?;
        let listing = stamps.iter().fold(String::from("#timestamp [ns],filename\n"), |mut text, stamp| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{stamp},{}", image_name(*stamp));
            text
        });
        self.text("mav0/cam0/data.csv", &listing)?;
        self.text("mav0/depth0/data.csv", &listing)?;
        self.text("mav0/cam0/sensor.yaml", &sensors::camera(synthetic)?)?;
        self.text("mav0/depth0/sensor.yaml", &sensors::depth(synthetic, METRES_PER_COUNT)?)?;
        self.text("mav0/imu0/sensor.yaml", &sensors::imu(synthetic))?;
        self.text("mav0/state_groundtruth_estimate0/sensor.yaml", &sensors::ground_truth())?;
        self.text("mav0/pointcloud0/sensor.yaml", &sensors::cloud())?;
        self.text("mav0/body.yaml", "%YAML:1.0\ncomment: synthetic flight of VICE\n")?;
        let samples = synthetic.imu()?;
        atomic::write(self.root.join("mav0/imu0/data.csv"), self.overwrite, |w| {
            write!(w, "#timestamp [ns]")?;
            for (name, unit) in [("w", "rad s^-1"), ("a", "m s^-2")] {
                for axis in ["x", "y", "z"] {
                    write!(w, ",{name}_RS_S_{axis} [{unit}]")?;
                }
            }
            writeln!(w)?;
            for sample in samples.iter() {
                write!(w, "{}", sample.stamp)?;
                for value in sample.gyro_rad_s.iter().chain(sample.accel_m_s2.iter()) {
                    write!(w, ",{value}")?;
                }
                writeln!(w)?;
            }
            Ok(())
        })
    }

    fn poses(&self, synthetic: &Synthetic) -> DataResult<()> {
        let inertial: Vec<InertialRow> = synthetic
            .truth()
            .stamps()
            .iter()
            .map(|stamp| InertialRow {
                velocity_m_s: synthetic.state(*stamp).velocity_m_s,
                gyro_bias_rad_s: synthetic.options().gyro_bias_rad_s,
                accel_bias_m_s2: synthetic.options().accel_bias_m_s2,
            })
            .collect();
        let path = self.root.join("mav0/state_groundtruth_estimate0/data.csv");
        write_ground_truth(path, synthetic.truth(), Some(&inertial), self.overwrite)?;
        for (name, estimate) in synthetic.estimates() {
            write_tum(self.root.join(format!("estimates/{name}.txt")), estimate, self.overwrite)?;
        }
        let motions = relative_motions(synthetic.truth());
        write_relative(self.root.join("estimates/exact_relative.txt"), &motions, self.overwrite)
    }

    fn calibrations(&self, synthetic: &Synthetic) -> DataResult<()> {
        let camera = synthetic.camera(CAMERA)?;
        let body_from_camera = synthetic.body_from_camera(CAMERA, synthetic.options().start)?;
        let flaws = &synthetic.options().flaws;
        let turn = UnitQuaternion::from_scaled_axis(flaws.extrinsic_rotation_rad);
        let turned = Rigid::from_parts(body_from_camera.translation(), turn * body_from_camera.rotation());
        let scaled = scaled_focal_length(&camera, flaws.focal_scale)?;
        for (name, camera, body_from_camera) in [
            ("exact", &camera, body_from_camera),
            ("wrong_extrinsic", &camera, turned),
            ("wrong_focal", &scaled, body_from_camera),
        ] {
            let mut file = CalibrationFile::new();
            file.insert(CAMERA, CameraOverride::of(camera, Some(body_from_camera)));
            file.write(self.root.join(format!("calibration/{name}.toml")), self.overwrite)?;
        }
        Ok(())
    }

    fn cloud(&self, synthetic: &Synthetic) -> DataResult<()> {
        let points = synthetic.points();
        atomic::write(self.root.join("mav0/pointcloud0/data.ply"), self.overwrite, |w| {
            write!(
                w,
                "ply\nformat binary_little_endian 1.0\ncomment surfaces of the synthetic room, metres\n"
            )?;
            write!(w, "element vertex {}\n", points.len())?;
            write!(w, "property float x\nproperty float y\nproperty float z\nend_header\n")?;
            for point in points.iter() {
                for value in point.iter() {
                    w.write_all(&value.to_le_bytes())?;
                }
            }
            Ok(())
        })
    }

    fn frames(&self, synthetic: &Synthetic, progress: &(dyn Fn(usize, usize) + Sync)) -> DataResult<()> {
        let stamps = synthetic.frames(CAMERA)?;
        let done = AtomicUsize::new(0);
        progress(0, stamps.len());
        stamps.par_iter().enumerate().try_for_each(|(index, stamp)| {
            let (image, depth) = synthetic.frame(index)?;
            let name = image_name(*stamp);
            self.bytes(&format!("mav0/cam0/data/{name}"), &encode_png(&image)?)?;
            self.bytes(&format!("mav0/depth0/data/{name}"), &encode_depth_png(&depth, METRES_PER_COUNT)?)?;
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, stamps.len());
            Ok(())
        })
    }
}

fn image_name(stamp: Stamp) -> String {
    format!("{stamp}.png")
}

/// The same camera with both focal lengths multiplied.
fn scaled_focal_length(camera: &Camera, scale: f64) -> DataResult<Camera> {
    let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
    let model: Model = *camera.model();
    Camera::new(camera.width(), camera.height(), [fx * scale, fy * scale, cx, cy], model)
        .map_err(|e| DataError::new("the calibration with the wrong focal length").because(e))
}
