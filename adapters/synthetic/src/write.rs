//! The flight as a folder in EuRoC's layout, with estimates, labels and calibrations beside it.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

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
use vice_files::leftovers;
use vice_files::trajectory::{InertialRow, write_euroc as write_ground_truth, write_relative, write_tum};

use crate::dataset::{CAMERA, Synthetic};
use crate::estimates::relative_motions;
use crate::sensors;

/// What the name of a folder starts with that is still being filled.
const STAGED: &str = ".vice-synth-";
/// Age beyond which such a folder is nobody's any more.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

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
    builder.prefix(STAGED);
    // A temporary folder is private by default; this one becomes an ordinary folder, so the umask decides.
    #[cfg(unix)]
    let builder = {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o777))
    };
    // Removes itself on every error.
    leftovers::remove_abandoned(parent, STAGED, "", ABANDONED);
    let staged = builder.tempdir_in(parent).map_err(failed)?;
    let _there = leftovers::note(staged.path());
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
            writeln!(w, "element vertex {}", points.len())?;
            writeln!(w, "property float x\nproperty float y\nproperty float z\nend_header")?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::SyntheticOptions;
    use std::sync::Mutex;
    use vice_files::image_file;
    use vice_files::trajectory::{ReadOptions, read, read_relative};

    fn small() -> Synthetic {
        let options = SyntheticOptions {
            width: 160,
            height: 120,
            duration_s: 1.0,
            cloud_spacing_m: 0.1,
            ..Default::default()
        };
        Synthetic::new(options).unwrap()
    }

    #[test]
    fn what_is_written_is_read_back() {
        let synthetic = small();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("a/flight");
        let told = Mutex::new(Vec::new());
        write_euroc(&synthetic, &out, false, &|done, total| told.lock().unwrap().push((done, total)))
            .unwrap();
        let told = told.into_inner().unwrap();
        assert!(told.len() == 21 && told.contains(&(20, 20)), "{told:?}");
        let beside: Vec<_> =
            fs::read_dir(out.parent().unwrap()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(beside, ["flight"], "nothing is left beside the folder");

        let truth = out.join("mav0/state_groundtruth_estimate0/data.csv");
        let truth = read(truth, &ReadOptions::default()).unwrap();
        assert_eq!(truth.trajectory.stamps(), synthetic.truth().stamps());
        assert_eq!(truth.inertial.unwrap()[3].gyro_bias_rad_s, synthetic.options().gyro_bias_rad_s);
        for (name, estimate) in synthetic.estimates() {
            let again = read(out.join(format!("estimates/{name}.txt")), &ReadOptions::default()).unwrap();
            for ((s, p), (t, q)) in estimate.iter().zip(again.trajectory.iter()) {
                assert_eq!((s, p.translation()), (t, q.translation()));
                assert!(p.rotation().angle_to(&q.rotation()) < 1e-12);
            }
        }
        let relative = read_relative(out.join("estimates/exact_relative.txt")).unwrap();
        assert_eq!(relative.trajectory.stamps(), synthetic.truth().stamps());
        let labels = labels::read(out.join("labels/scene.csv"), None).unwrap();
        let exact = synthetic.scene_labels().unwrap();
        assert_eq!(labels.observation_count(), exact.observation_count());
        for (a, b) in labels.points().iter().zip(exact.points()) {
            let pixels = |p: &vice_core::label::PointLabels| {
                p.observations.iter().map(|o| (o.stamp, o.px, o.keyframe)).collect::<Vec<_>>()
            };
            assert_eq!(pixels(a), pixels(b));
        }
        let (image, depth) = synthetic.frame(5).unwrap();
        let name = image_name(depth.stamp);
        assert_eq!(image_file::read(out.join("mav0/cam0/data").join(&name)).unwrap(), image);
        let counts = image_file::read_bytes(out.join("mav0/depth0/data").join(&name)).unwrap();
        let read_depth = image_file::decode_depth_png(&counts, depth.stamp, METRES_PER_COUNT).unwrap();
        for (a, b) in read_depth.z_m().iter().zip(depth.z_m()) {
            assert!((a - b).abs() < 0.000_11, "{a} {b}");
        }
        let ply = fs::read(out.join("mav0/pointcloud0/data.ply")).unwrap();
        let n = synthetic.points().len();
        let header = String::from_utf8_lossy(&ply[..ply.len() - 12 * n]).into_owned();
        assert!(
            header.contains(&format!("element vertex {n}\n")) && header.ends_with("end_header\n"),
            "{header}"
        );
    }

    #[test]
    fn calibrations_have_their_flaw() {
        let synthetic = small();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("flight");
        write_euroc(&synthetic, &out, false, &|_, _| ()).unwrap();
        let read = |name: &str| CalibrationFile::read(out.join("calibration").join(name)).unwrap();
        let camera = synthetic.camera(CAMERA).unwrap();
        let (exact, extrinsic, focal) =
            (read("exact.toml"), read("wrong_extrinsic.toml"), read("wrong_focal.toml"));
        assert_eq!(exact.camera(CAMERA, None).unwrap().unwrap(), camera);
        assert_eq!(extrinsic.camera(CAMERA, None).unwrap().unwrap(), camera);
        let turn = exact
            .body_from_camera(CAMERA)
            .unwrap()
            .rotation()
            .angle_to(&extrinsic.body_from_camera(CAMERA).unwrap().rotation());
        assert!((turn.to_degrees() - 2.0).abs() < 1e-6, "{turn}");
        let scaled = focal.camera(CAMERA, None).unwrap().unwrap().fx_fy_cx_cy();
        assert!((scaled[0] / camera.fx_fy_cx_cy()[0] - 1.03).abs() < 1e-12);
        assert_eq!(scaled[2..], camera.fx_fy_cx_cy()[2..]);
    }

    #[test]
    fn a_folder_that_holds_something_needs_force() {
        let synthetic = small();
        let folder = tempfile::tempdir().unwrap();
        let notes = folder.path().join("notes.txt");
        fs::write(&notes, "mine").unwrap();
        let error = write_euroc(&synthetic, folder.path(), false, &|_, _| ()).unwrap_err().to_string();
        assert!(error.contains("not empty"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing was written");
        write_euroc(&synthetic, folder.path(), true, &|_, _| ()).unwrap();
        write_euroc(&synthetic, folder.path(), true, &|_, _| ()).unwrap();
        assert_eq!(fs::read_to_string(&notes).unwrap(), "mine");
        assert!(folder.path().join("mav0/cam0/data.csv").is_file());
        let in_the_way = notes.join("flight");
        assert!(write_euroc(&synthetic, &in_the_way, false, &|_, _| ()).is_err());
        assert!(write_euroc(&synthetic, &notes, true, &|_, _| ()).is_err());
    }
}
