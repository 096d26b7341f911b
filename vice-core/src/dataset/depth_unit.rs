//! Whether the depths of an image can be metres.

use super::DepthImage;
use crate::statistics::middle;
use crate::suspicion::Suspicion;

/// Middle depths beyond this are none of a depth camera's, metres: the farthest-reaching ones see some tens of metres.
const TOO_FAR_M: f64 = 80.0;
/// Middle depths below this are none either, metres: no lens is focused there.
const TOO_NEAR_M: f64 = 0.03;
/// Depths that are looked at, of all that an image has.
const LOOKED_AT: usize = 4096;

/// A doubt about the unit of a depth image, where its middle depth is none that a depth camera can see; without a subject.
///
/// `None` where the depths may well be metres, or there are none.
pub fn depth_unit_doubt(image: &DepthImage) -> Option<Suspicion> {
    let every = (image.z_m().len() / LOOKED_AT).max(1);
    let mut depths: Vec<f32> = image.z_m().iter().step_by(every).copied().filter(|z| !z.is_nan()).collect();
    let z_m = f64::from(middle(&mut depths, f32::total_cmp)?);
    let perhaps = match z_m {
        z if z > TOO_FAR_M => {
            let units = [("millimetres", z / 1000.0), ("centimetres", z / 100.0)];
            let fitting = units.iter().filter(|(_, z)| (TOO_NEAR_M..TOO_FAR_M).contains(z));
            let each: Vec<String> = fitting.map(|(unit, z)| format!("{unit} ({z:.3} m)")).collect();
            match each.is_empty() {
                true => String::new(),
                false => format!(", perhaps they are in {}", each.join(" or ")),
            }
        }
        z if z < TOO_NEAR_M => ", perhaps metres or centimetres were read as millimetres".to_string(),
        _ => return None,
    };
    let digits = if z_m >= 1.0 { 0 } else { 4 };
    Some(
        Suspicion::new("depth-unit", "", format!("the depth images cannot be in metres{perhaps}"))
            .evidence(format!("their median depth would be {z_m:.digits$} m"))
            .advice(
                "recordings take `--set depth_unit=mm`, cm, m or metres a count; else convert the images",
            ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Stamp;

    fn doubt(z: f32) -> Option<String> {
        let mut z_m = vec![z; 9000];
        z_m[0] = f32::NAN;
        let image = DepthImage::new(Stamp::default(), 100, 90, z_m).unwrap();
        depth_unit_doubt(&image).map(|s| s.line())
    }

    #[test]
    fn what_no_depth_camera_sees_is_doubted() {
        assert!(doubt(1061.0).unwrap().contains("millimetres (1.061 m) or centimetres (10.610 m)"));
        assert!(doubt(150.0).unwrap().contains("millimetres (0.150 m) or centimetres (1.500 m)"));
        assert!(doubt(9000.0).unwrap().contains("in millimetres (9.000 m): "));
        assert!(
            doubt(1e9).unwrap().contains("cannot be in metres: their median depth would be 1000000000 m")
        );
        assert!(doubt(0.002).unwrap().contains("read as millimetres"));
        for z in [0.05, 0.3, 1.0, 10.0, 60.0, f32::NAN] {
            assert_eq!(doubt(z), None, "{z}");
        }
    }
}
