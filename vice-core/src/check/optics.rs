//! Whether a camera's calibration can be that of its images.

use nalgebra::Vector3;

use super::Check;
use crate::camera::{Camera, Pixel};
use crate::finding::{Finding, State, short};
use crate::frames::{BodyFromCamera, rotation_angle_rad};

/// What this check is.
pub const CHECK: Check = Check {
    name: "calibration",
    title: "calibration of a camera",
    looks_at: "principal point, focal lengths and field of view, distortion that folds back inside the image, extrinsics",
    threshold: "wrong: principal point outside the image, or scaled as that of images of half or twice the size, more than 10 % of the image behind a fold, lever arm above 50 m; look: principal point off by 15 % of the image, fx and fy 5 % apart, field of view below 10 or above 170 degrees, any fold, lever arm above 5 m",
    source: "lenses that are sold for robots; pinhole and distortion models",
};

/// Principal points off the middle by more than this share of the image are worth a look.
const OFF_MIDDLE: f64 = 0.15;
/// Focal lengths apart by more than this share are worth a look.
const APART: f64 = 0.05;
/// Fields of view that hardly any lens has, degrees.
const NARROW_DEG: f64 = 10.0;
const WIDE_DEG: f64 = 170.0;
/// More of the image behind a fold than this is wrong.
const FOLDED: f64 = 0.10;
/// Scales of images that calibrations are mixed up with.
const SCALES: [(f64, &str); 4] = [(0.5, "half"), (2.0, "twice"), (0.25, "a quarter of"), (4.0, "four times")];
/// A principal point of a scaled calibration is this near to the scaled middle, a share of the image.
const SCALED_NEAR: f64 = 0.06;
/// Lever arms beyond these are worth a look, or wrong, metres.
const FAR_M: f64 = 5.0;
const TOO_FAR_M: f64 = 50.0;

/// Whether intrinsics can be those of images of their size.
pub fn intrinsics(about: &str, camera: &Camera) -> Vec<Finding> {
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
    let mut found = Vec::new();
    let (u, v) = ((cx + 0.5) / w, (cy + 0.5) / h);
    let scaled =
        SCALES.iter().find(|(s, _)| (u - 0.5 * s).abs() < SCALED_NEAR && (v - 0.5 * s).abs() < SCALED_NEAR);
    let at = |finding: Finding| {
        finding
            .number("principal-point-u", cx, "px")
            .number("principal-point-v", cy, "px")
            .number("width", w, "px")
            .number("height", h, "px")
    };
    let calibrate = "`calibration` gives another one";
    if let Some((_, size)) = scaled {
        let says = format!(
            "the calibration is that of images of {size} the size: its principal point is ({}, {})",
            short(cx),
            short(cy)
        );
        found.push(at(Finding::new(CHECK.name, about, State::Wrong, says)).mend(calibrate));
    } else if !(0.0..=1.0).contains(&u) || !(0.0..=1.0).contains(&v) {
        let says = format!("the principal point ({}, {}) lies outside the image", short(cx), short(cy));
        found.push(at(Finding::new(CHECK.name, about, State::Wrong, says)).mend(calibrate));
    } else if (u - 0.5).abs() > OFF_MIDDLE || (v - 0.5).abs() > OFF_MIDDLE {
        let says = format!(
            "the principal point ({}, {}) is far off the middle: were the images cropped?",
            short(cx),
            short(cy)
        );
        found.push(at(Finding::new(CHECK.name, about, State::Look, says)).mend(calibrate));
    }
    let aspect = fx / fy;
    if (aspect - 1.0).abs() > APART {
        let says =
            format!("fx and fy are {:.1} % apart: were the images squeezed?", 100.0 * (aspect - 1.0).abs());
        let finding =
            Finding::new(CHECK.name, about, State::Look, says).number("fx", fx, "px").number("fy", fy, "px");
        found.push(finding.mend(calibrate));
    }
    let (field, folded) = (field_deg(camera), folded(camera));
    if let Some(field) = field.filter(|f| *f < NARROW_DEG || *f > WIDE_DEG) {
        let says = format!("a field of view of {field:.0} degrees across is rare");
        let finding =
            Finding::new(CHECK.name, about, State::Look, says).number("field-of-view", field, "degrees");
        found.push(finding.mend(calibrate));
    }
    if folded > 0.0 {
        let state = if folded > FOLDED { State::Wrong } else { State::Look };
        let says =
            format!("{:.1} % of the image has no ray: the distortion folds back inside it", 100.0 * folded);
        let finding = Finding::new(CHECK.name, about, state, says).number("share-without-a-ray", folded, "");
        found.push(finding.number("folds-at-radius", camera.max_radius(), "").mend(calibrate));
    }
    if found.is_empty() {
        let field = field.map_or_else(String::new, |f| format!(", {f:.0} degrees across"));
        let says = format!("{}x{}, {}{field}", camera.width(), camera.height(), camera.model().name());
        found.push(Finding::new(CHECK.name, about, State::Ok, says));
    }
    found
}

/// Whether extrinsics can be those of a camera on a robot.
pub fn extrinsics(about: &str, body_from_camera: &BodyFromCamera) -> Finding {
    let arm = body_from_camera.translation().norm();
    let turn = rotation_angle_rad(&body_from_camera.rotation()).to_degrees();
    let numbers = |f: Finding| f.number("lever-arm", arm, "m").number("turned", turn, "degrees");
    if arm > FAR_M {
        let state = if arm > TOO_FAR_M { State::Wrong } else { State::Look };
        let unit = if arm > TOO_FAR_M { ": perhaps it is in millimetres" } else { "" };
        let says = format!("the camera is {} m away from the body{unit}", short(arm));
        return numbers(Finding::new(CHECK.name, about, state, says))
            .mend("`calibration` gives other extrinsics");
    }
    let says = match body_from_camera.rotation().angle() < 1e-9 && arm < 1e-9 {
        true => "the camera is the body".to_string(),
        false => format!("the camera is {} m from the body, turned by {} degrees", short(arm), short(turn)),
    };
    numbers(Finding::new(CHECK.name, about, State::Ok, says))
}

/// Angle between the rays at the left and the right edge, on the row of the principal point, degrees.
fn field_deg(camera: &Camera) -> Option<f64> {
    let [_, _, _, cy] = camera.fx_fy_cx_cy();
    let ray = |u: f64| -> Option<Vector3<f64>> { camera.unproject(Pixel::new(u, cy)).ok() };
    let (left, right) = (ray(0.0)?, ray(f64::from(camera.width()) - 1.0)?);
    Some(left.angle(&right).to_degrees())
}

/// The share of the image that no ray leads to.
fn folded(camera: &Camera) -> f64 {
    const STEPS: u32 = 40;
    let (w, h) = (f64::from(camera.width()) - 1.0, f64::from(camera.height()) - 1.0);
    let mut none = 0_u32;
    for i in 0..=STEPS {
        for j in 0..=STEPS {
            let pixel = Pixel::new(w * f64::from(i) / f64::from(STEPS), h * f64::from(j) / f64::from(STEPS));
            none += u32::from(camera.unproject(pixel).is_err());
        }
    }
    f64::from(none) / f64::from((STEPS + 1) * (STEPS + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;
    use crate::frames::Rigid;

    fn worst(width: u32, height: u32, k: [f64; 4], model: Model) -> (State, String) {
        let camera = Camera::new(width, height, k, model).unwrap();
        let found = intrinsics("cam0", &camera);
        let worst = found.iter().max_by_key(|f| f.state).unwrap();
        (worst.state, worst.says.clone())
    }

    #[test]
    fn calibrations_of_other_images_are_noticed() {
        let euroc =
            || Model::from_name("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]).unwrap();
        let k = [458.654, 457.296, 367.215, 248.375];
        assert_eq!(worst(752, 480, k, euroc()).0, State::Ok);
        let half = worst(376, 240, k, euroc());
        assert!(half.0 == State::Wrong && half.1.contains("twice the size"), "{half:?}");
        let twice = worst(1504, 960, k, euroc());
        assert!(twice.0 == State::Wrong && twice.1.contains("half the size"), "{twice:?}");
        assert_eq!(worst(752, 480, [458.0, 457.0, 900.0, 248.0], euroc()).0, State::Wrong);
        assert_eq!(worst(752, 480, [458.0, 380.0, 375.0, 240.0], euroc()).0, State::Look);
        let fold = worst(752, 480, k, Model::from_name("radtan", &[-0.6, 0.0, 0.0, 0.0]).unwrap());
        assert!(fold.0 == State::Wrong && fold.1.contains("folds back"), "{fold:?}");
    }

    #[test]
    fn extrinsics_in_millimetres_are_noticed() {
        let at = |x: f64| {
            extrinsics(
                "cam0",
                &Rigid::from_parts(Vector3::new(x, 0.0, 0.0), nalgebra::UnitQuaternion::identity()),
            )
        };
        assert_eq!(
            [at(0.0).state, at(0.2).state, at(8.0).state, at(108.0).state],
            [State::Ok, State::Ok, State::Look, State::Wrong]
        );
    }
}
