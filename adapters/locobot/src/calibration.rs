//! From `sensor_msgs/CameraInfo` to a camera of the core.

use vice_core::camera::{Camera, CameraError, Model};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::suspicion::Suspicion;

use crate::message::CameraInfo;

/// How many distortion coefficients a model of ROS has, at the most.
fn most_coefficients(model: &str) -> Option<usize> {
    match model.trim().to_ascii_lowercase().as_str() {
        "plumb_bob" | "radtan" | "radial-tangential" | "brown_conrady" => Some(5),
        "rational_polynomial" | "rational" => Some(8),
        "equidistant" | "fisheye" | "kannala_brandt" => Some(4),
        "ds" | "double_sphere" | "eucm" | "extended_unified" => Some(2),
        "omni" | "omnidirectional" | "omnidir" | "mei" => Some(5),
        "fov" | "atan" | "field_of_view" => Some(1),
        _ => None,
    }
}

/// The distortion coefficients without the zeros by which drivers fill up a vector of a fixed length.
///
/// # Errors
/// [`DataError`] with the model's name if a coefficient that the model does not have is not zero.
fn unpadded(info: &CameraInfo) -> DataResult<&[f64]> {
    let CameraInfo { model, distortion, .. } = info;
    let Some(most) = most_coefficients(model).filter(|most| *most < distortion.len()) else {
        return Ok(distortion);
    };
    let (used, padding) = distortion.split_at(most);
    match padding.iter().position(|v| *v != 0.0) {
        None => Ok(used),
        Some(place) => {
            let n = distortion.len();
            let (place, value) = (most + place + 1, padding[place]);
            let problem = format!(
                "the model `{model}` has at most {most} distortion coefficients, there are {n} and number {place} is \
                 {value}, not 0"
            );
            Err(DataError::of_kind(ErrorKind::Contradictory, problem)
                .hint("the driver's name for the model may be wrong: give a calibration file"))
        }
    }
}

/// What to say of a distortion vector that was filled up with zeros.
pub(crate) fn padding(info: &CameraInfo, rectified: bool) -> Option<Suspicion> {
    let used = unpadded(info).ok().filter(|used| !rectified && used.len() < info.distortion.len())?;
    let message = format!(
        "the last {} of {} distortion coefficients are zero and left out: `{}` has {}",
        info.distortion.len() - used.len(),
        info.distortion.len(),
        info.model,
        used.len()
    );
    Some(Suspicion::new("distortion-padded", "", message))
}

/// The camera of a topic. Binning and region of interest are applied as ROS's `image_geometry` does.
///
/// # Errors
/// [`DataError`] if the camera was not calibrated or its model is unknown.
pub(crate) fn camera(info: &CameraInfo, rectified: bool) -> DataResult<Camera> {
    let [k0, _, k2, _, k4, k5, ..] = info.k;
    let [p0, _, p2, _, _, p5, p6, ..] = info.p;
    let [mut fx, mut fy, mut cx, mut cy] = if rectified { [p0, p5, p2, p6] } else { [k0, k4, k2, k5] };
    if fx == 0.0 && fy == 0.0 {
        return Err(DataError::new("the camera is not calibrated: its focal length is 0")
            .hint("give a calibration file"));
    }
    let [x, y, height, width] = info.roi;
    let (mut size_x, mut size_y) = (info.width, info.height);
    if width > 0 && height > 0 {
        (size_x, size_y) = (width, height);
        cx -= f64::from(x);
        cy -= f64::from(y);
    }
    let [by_x, by_y] = info.binning.map(|b| b.max(1));
    (size_x, size_y) = (size_x / by_x, size_y / by_y);
    (fx, cx) = (fx / f64::from(by_x), cx / f64::from(by_x));
    (fy, cy) = (fy / f64::from(by_y), cy / f64::from(by_y));
    let coefficients: &[f64] = if rectified { &[] } else { unpadded(info)? };
    let name = if rectified || coefficients.is_empty() { "pinhole" } else { &info.model };
    let model = Model::from_name(name, coefficients).map_err(|e| match e {
        // By the name that the recording has for the model, not by the core's.
        CameraError::CoefficientCount { expected, got, .. } => DataError::new(format!(
            "the model `{}` takes {expected} distortion coefficients, got {got}",
            info.model
        )),
        other => DataError::new(other.to_string()),
    })?;
    Camera::new(size_x, size_y, [fx, fy, cx, cy], model).map_err(DataError::of)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info() -> CameraInfo {
        let mut p = [0.0; 12];
        (p[0], p[2], p[5], p[6]) = (300.0, 310.0, 301.0, 230.0);
        CameraInfo {
            frame: "c".to_string(),
            height: 480,
            width: 640,
            model: "plumb_bob".to_string(),
            distortion: vec![0.1, 0.0, 0.0, 0.0, 0.0],
            k: [400.0, 0.0, 320.0, 0.0, 402.0, 240.0, 0.0, 0.0, 1.0],
            p,
            binning: [0, 0],
            roi: [0; 4],
        }
    }

    #[test]
    fn rectified_binned_and_cut_images() {
        let raw = camera(&info(), false).unwrap();
        assert_eq!((raw.fx_fy_cx_cy(), raw.model().name()), ([400.0, 402.0, 320.0, 240.0], "radtan"));
        let rectified = camera(&info(), true).unwrap();
        assert_eq!(
            (rectified.fx_fy_cx_cy(), rectified.model().name()),
            ([300.0, 301.0, 310.0, 230.0], "pinhole")
        );
        let binned = camera(&CameraInfo { binning: [2, 2], ..info() }, false).unwrap();
        assert_eq!((binned.width(), binned.fx_fy_cx_cy()), (320, [200.0, 201.0, 160.0, 120.0]));
        let cut = camera(&CameraInfo { roi: [20, 40, 100, 200], ..info() }, false).unwrap();
        assert_eq!((cut.width(), cut.height(), cut.fx_fy_cx_cy()), (200, 100, [400.0, 402.0, 300.0, 200.0]));
        let plain = CameraInfo { distortion: vec![], model: String::new(), ..info() };
        assert_eq!(camera(&plain, false).unwrap().model().name(), "pinhole");
    }

    #[test]
    fn distortion_filled_up_with_zeros_is_that_of_the_model() {
        let lens = |model: &str, used: &[f64], zeros: usize| {
            let distortion = [used, &vec![0.0; zeros]].concat();
            CameraInfo { model: model.to_string(), distortion, ..info() }
        };
        let cases: [(&str, &[f64]); 8] = [
            ("ds", &[-0.2, 0.6]),
            ("eucm", &[0.6, 1.1]),
            ("omni", &[0.9, 0.1, -0.02, 0.001, 0.002]),
            ("fov", &[0.9]),
            ("plumb_bob", &[0.1, -0.2, 0.001, 0.002, 0.03]),
            ("rational_polynomial", &[0.1, -0.2, 0.001, 0.002, 0.03, 0.3, 0.2, 0.1]),
            ("equidistant", &[0.1, -0.2, 0.01, 0.02]),
            ("Plumb_Bob", &[0.1, 0.0, 0.0, 0.0, 0.0]),
        ];
        for (model, used) in cases {
            let plain = camera(&lens(model, used, 0), false).unwrap();
            assert!(padding(&lens(model, used, 0), false).is_none());
            for zeros in [1, 3, 4, 6, 10] {
                let padded = lens(model, used, zeros);
                assert_eq!(camera(&padded, false).unwrap(), plain, "{model} with {zeros} zeros");
                assert!(padding(&padded, false).unwrap().message.contains(model));
                let mut wrong = padded;
                *wrong.distortion.last_mut().unwrap() = 0.05;
                let text = camera(&wrong, false).unwrap_err().to_string();
                assert!(text.contains(&format!("`{model}`")) && text.contains("is 0.05, not 0"), "{text}");
                assert!(
                    padding(&wrong, false).is_none() && camera(&wrong, true).is_ok(),
                    "rectified has no lens"
                );
            }
        }
    }

    #[test]
    fn what_is_no_calibration_is_refused() {
        let error = |info: CameraInfo| camera(&info, false).unwrap_err().to_string();
        assert!(error(CameraInfo { k: [0.0; 9], ..info() }).contains("not calibrated"));
        assert!(error(CameraInfo { model: "mystery".to_string(), ..info() }).contains("mystery"));
        assert!(error(CameraInfo { width: 0, ..info() }).contains("empty"));
    }
}
