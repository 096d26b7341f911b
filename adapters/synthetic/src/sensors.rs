//! The texts beside the data: EuRoC's `sensor.yaml` files, and the README that says what is what.

use vice_core::dataset::Dataset;
use vice_core::error::DataResult;

use crate::dataset::{CAMERA, Synthetic};

const IDENTITY: [f64; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

fn matrix(name: &str, row_major: &[f64; 16]) -> String {
    let rows: Vec<String> = row_major.chunks(4).map(list).collect();
    let rows = rows.join(",\n         ");
    format!("{name}:\n  cols: 4\n  rows: 4\n  data: [{rows}]\n")
}

/// Numbers as YAML reads floats: always with a point, every digit kept.
fn list(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ")
}

fn head(sensor_type: &str, comment: &str) -> String {
    format!("%YAML:1.0\n# General sensor definitions.\nsensor_type: {sensor_type}\ncomment: {comment}\n\n")
}

fn camera_matrix(synthetic: &Synthetic) -> DataResult<String> {
    let body_from_camera = synthetic.body_from_camera(CAMERA, synthetic.options().start)?;
    Ok(format!(
        "# Sensor extrinsics wrt. the body-frame.\n{}\n",
        matrix("T_BS", &body_from_camera.to_row_major())
    ))
}

/// `cam0/sensor.yaml`.
pub(crate) fn camera(synthetic: &Synthetic) -> DataResult<String> {
    let camera = synthetic.camera(CAMERA)?;
    let coefficients = camera.model().coefficients();
    Ok(format!(
        "{}{}# Camera specific definitions.\nrate_hz: {:?}\nresolution: [{}, {}]\ncamera_model: pinhole\n\
         intrinsics: [{}] #fu, fv, cu, cv\ndistortion_model: radial-tangential\ndistortion_coefficients: [{}]\n",
        head("camera", "rendered"),
        camera_matrix(synthetic)?,
        synthetic.options().rate_hz,
        camera.width(),
        camera.height(),
        list(&camera.fx_fy_cx_cy()),
        // k3 is zero, and EuRoC has four.
        list(&coefficients[..coefficients.len().min(4)]),
    ))
}

/// `depth0/sensor.yaml`.
pub(crate) fn depth(synthetic: &Synthetic, metres_per_count: f64) -> DataResult<String> {
    Ok(format!(
        "{}{}registered_to: {CAMERA}\nmetres_per_count: {metres_per_count:?}\n",
        head("depth", "exact depth along the optical axis, 0 is none"),
        camera_matrix(synthetic)?,
    ))
}

/// `imu0/sensor.yaml`. There is no noise: the numbers are those that a filter wants to divide by.
pub(crate) fn imu(synthetic: &Synthetic) -> String {
    format!(
        "{}{}rate_hz: {:?}\ngyroscope_noise_density: 1.0e-04     # [ rad / s / sqrt(Hz) ]\n\
         gyroscope_random_walk: 1.0e-06       # [ rad / s^2 / sqrt(Hz) ]\n\
         accelerometer_noise_density: 1.0e-03 # [ m / s^2 / sqrt(Hz) ]\n\
         accelerometer_random_walk: 1.0e-05   # [ m / s^3 / sqrt(Hz) ]\n",
        head("imu", "exact samples with a constant bias and no noise"),
        matrix("T_BS", &IDENTITY),
        synthetic.options().imu_rate_hz,
    )
}

/// `state_groundtruth_estimate0/sensor.yaml`.
pub(crate) fn ground_truth() -> String {
    head("visual-inertial", "exact") + &matrix("T_BS", &IDENTITY)
}

/// `pointcloud0/sensor.yaml`.
pub(crate) fn cloud() -> String {
    head("pointcloud", "points on all surfaces that can be seen") + &matrix("T_WR", &IDENTITY)
}

/// `README.md`.
pub(crate) fn readme(synthetic: &Synthetic) -> String {
    let o = synthetic.options();
    let f = &o.flaws;
    format!(
        "# A synthetic flight\n\n\
         Rendered by VICE: seed {}, {} s, {} Hz, {}x{} pixels. Everything in it is known exactly. The layout is EuRoC's; \
         the world's z points up and the floor is z = 0.\n\n\
         | path | what |\n| --- | --- |\n\
         | `mav0/cam0` | images, radial-tangential lens |\n\
         | `mav0/depth0` | depth along the optical axis for each image, 16 bit PNG, 0.2 mm a count |\n\
         | `mav0/imu0` | inertial samples at {} Hz, constant bias, no noise |\n\
         | `mav0/state_groundtruth_estimate0` | exact poses, velocities and biases |\n\
         | `mav0/pointcloud0` | points on all surfaces, {} m apart |\n\
         | `labels/floor.csv` | four points on the floor, exact in every frame |\n\
         | `labels/scene.csv` | six points: 0 and 3 on the floor, 1 and 4 on boxes, 2 and 5 on walls |\n\
         | `estimates/exact.txt` | the truth |\n\
         | `estimates/exact_relative.txt` | the truth as relative motions, for `rel:FILE` |\n\
         | `estimates/drift.txt` | velocity off by ({}) m/s and yaw by {:.3} degrees/s, both constant in the world |\n\
         | `estimates/clock-offset.txt` | the truth, its stamps {} ms late |\n\
         | `estimates/wrong-extrinsic.txt` | the truth of a body turned by {:.3} degrees about ({}) |\n\
         | `estimates/white-noise.txt` | each pose off by {} m and {:.3} degrees an axis (standard deviation) |\n\
         | `calibration/exact.toml` | the true calibration |\n\
         | `calibration/wrong_extrinsic.toml` | the camera turned in the body by the same rotation |\n\
         | `calibration/wrong_focal.toml` | both focal lengths times {} |\n\n\
         For example:\n\n```\n\
         vice evaluate . --labels labels/floor.csv --estimate estimates/exact.txt,estimates/drift.txt --depth floor,zmap\n\
         ```\n",
        o.seed,
        o.duration_s,
        o.rate_hz,
        o.width,
        o.height,
        o.imu_rate_hz,
        o.cloud_spacing_m,
        three(&f.drift_m_s),
        f.yaw_drift_rad_s.to_degrees(),
        f.clock_offset_ns as f64 * 1e-6,
        f.extrinsic_rotation_rad.norm().to_degrees(),
        three(&f.extrinsic_rotation_rad.try_normalize(0.0).unwrap_or_default()),
        f.noise_position_m,
        f.noise_rotation_rad.to_degrees(),
        f.focal_scale,
    )
}

fn three(v: &nalgebra::Vector3<f64>) -> String {
    format!("{:.3}, {:.3}, {:.3}", v.x, v.y, v.z)
}
