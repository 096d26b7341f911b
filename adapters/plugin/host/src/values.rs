//! The contract's values as the core's, checked.

use nalgebra::{Point3, Quaternion, Unit, UnitQuaternion, Vector3};
use vice_abi::contract;
use vice_core::camera::{Camera, Model};
use vice_core::dataset::{DepthImage, Floor, Image, PixelFormat, Plane};
use vice_core::finding::{Finding, State};
use vice_core::frames::Rigid;
use vice_core::imu::{self, ImuSample, InertialState};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::{RelativeMotion, Trajectory};

use crate::border::{self, Fault};

/// A length this near to 1 is rounding, and the numbers are kept to the bit: those of a format written in Rust are the same
/// through a plugin.
const ROUNDING: f64 = 1e-9;

fn text(error: impl std::fmt::Display) -> Fault {
    error.to_string()
}

pub(crate) fn rigid<A, B>(a_from_b: &contract::Rigid) -> Result<Rigid<A, B>, Fault> {
    let [w, x, y, z] = a_from_b.rotation_wxyz;
    let raw = Quaternion::new(w, x, y, z);
    if (raw.norm() - 1.0).abs() < ROUNDING && a_from_b.translation_m.iter().all(|v| v.is_finite()) {
        let rotation = UnitQuaternion::new_unchecked(raw);
        return Ok(Rigid::from_parts(Vector3::from(a_from_b.translation_m), rotation));
    }
    Rigid::try_from_parts(a_from_b.translation_m, a_from_b.rotation_wxyz).map_err(text)
}

pub(crate) fn camera(camera: &contract::Camera) -> Result<Camera, Fault> {
    let given = camera
        .coefficients
        .get(..camera.coefficient_count as usize)
        .ok_or_else(|| format!("{} distortion coefficients are announced", camera.coefficient_count))?;
    let name = match camera.model {
        contract::MODEL_PINHOLE => "pinhole",
        contract::MODEL_RADTAN => "radtan",
        contract::MODEL_RATIONAL => "rational",
        contract::MODEL_EQUIDISTANT => "equidistant",
        contract::MODEL_DS => "ds",
        contract::MODEL_EUCM => "eucm",
        contract::MODEL_OMNI => "omni",
        contract::MODEL_FOV => "fov",
        other => return Err(format!("camera model {other} is none of the contract's")),
    };
    let model = Model::from_name(name, given).map_err(text)?;
    let intrinsics = [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px];
    Camera::new(camera.width_px, camera.height_px, intrinsics, model).map_err(text)
}

pub(crate) fn frames(stamps_ns: &[i64]) -> Result<Vec<Stamp>, Fault> {
    if let Some(place) = stamps_ns.windows(2).position(|w| w[0] >= w[1]) {
        let (before, stamp) = (stamps_ns[place], stamps_ns[place + 1]);
        return Err(format!(
            "frame {} at {stamp} ns is not later than the one before, {before} ns",
            place + 1
        ));
    }
    Ok(stamps_ns.iter().copied().map(Stamp::from_nanos).collect())
}

/// Where the rows of an image are in its bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) row_bytes: usize,
    pub(crate) stride: usize,
}

impl Rows {
    /// Checks that all rows lie in `data_bytes`.
    pub(crate) fn new(
        (width, height): (u32, u32),
        pixel_bytes: usize,
        stride: u32,
        data_bytes: usize,
    ) -> Result<Self, Fault> {
        if width == 0 || height == 0 {
            return Err(format!("the image is {width}x{height}"));
        }
        let (row, stride) = (width as usize * pixel_bytes, stride as usize);
        if stride < row {
            return Err(format!("a row has {row} bytes, but the stride is {stride}"));
        }
        let needed = (height as usize - 1).checked_mul(stride).and_then(|n| n.checked_add(row));
        match needed {
            Some(needed) if needed <= data_bytes => Ok(Self { width, height, row_bytes: row, stride }),
            _ => Err(format!(
                "{height} rows with a stride of {stride} do not fit the {data_bytes} bytes that are announced"
            )),
        }
    }

    fn of<'a>(&self, data: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        let (row, stride) = (self.row_bytes, self.stride);
        (0..self.height as usize).map(move |y| &data[y * stride..y * stride + row])
    }

    /// The bytes without what is between the rows.
    fn tight(&self, data: &[u8]) -> Result<Vec<u8>, Fault> {
        let mut tight = Vec::new();
        let size = self.row_bytes * self.height as usize;
        tight
            .try_reserve_exact(size)
            .map_err(|_| format!("there is no memory for {size} bytes of an image"))?;
        if self.stride == self.row_bytes {
            tight.extend_from_slice(&data[..size]);
        } else {
            self.of(data).for_each(|row| tight.extend_from_slice(row));
        }
        Ok(tight)
    }
}

pub(crate) fn pixel_format(format: i32) -> Result<PixelFormat, Fault> {
    match format {
        contract::PIXELS_GRAY8 => Ok(PixelFormat::Gray8),
        contract::PIXELS_RGB8 => Ok(PixelFormat::Rgb8),
        other => Err(format!("pixel format {other} is none of the contract's")),
    }
}

pub(crate) fn image(rows: &Rows, format: PixelFormat, data: &[u8]) -> Result<Image, Fault> {
    Image::new(rows.width, rows.height, format, rows.tight(data)?).map_err(text)
}

/// A stored file, which browsers and decoders know by its first bytes.
pub(crate) fn image_file(bytes: &[u8]) -> Result<Vec<u8>, Fault> {
    const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
    const JPEG: &[u8] = &[0xff, 0xd8, 0xff];
    if !bytes.starts_with(PNG) && !bytes.starts_with(JPEG) {
        return Err(format!("its {} bytes are neither a PNG nor a JPEG", bytes.len()));
    }
    Ok(bytes.to_vec())
}

/// `z_m` holds the rows, each `stride / 4` values.
pub(crate) fn depth(stamp_ns: i64, rows: &Rows, z_m: &[f32]) -> Result<DepthImage, Fault> {
    let (width, stride) = (rows.width as usize, rows.stride / size_of::<f32>());
    let mut tight = Vec::new();
    let size = width * rows.height as usize;
    tight.try_reserve_exact(size).map_err(|_| format!("there is no memory for {size} depth values"))?;
    for y in 0..rows.height as usize {
        tight.extend_from_slice(&z_m[y * stride..y * stride + width]);
    }
    DepthImage::new(Stamp::from_nanos(stamp_ns), rows.width, rows.height, tight).map_err(text)
}

pub(crate) fn trajectory(poses: &[contract::Pose]) -> Result<Trajectory, Fault> {
    let mut rows = Vec::new();
    rows.try_reserve_exact(poses.len())
        .map_err(|_| format!("there is no memory for {} poses", poses.len()))?;
    for (row, pose) in poses.iter().enumerate() {
        let world_from_body = rigid(&pose.world_from_body).map_err(|e| format!("pose {row}: {e}"))?;
        rows.push((Stamp::from_nanos(pose.stamp_ns), world_from_body));
    }
    Trajectory::from_poses(rows).map_err(text)
}

/// Motions chained into poses, the first of which is the identity.
pub(crate) fn chained(motions: &[contract::Motion]) -> Result<Trajectory, Fault> {
    let mut rows = Vec::new();
    rows.try_reserve_exact(motions.len())
        .map_err(|_| format!("there is no memory for {} motions", motions.len()))?;
    for (row, motion) in motions.iter().enumerate() {
        rows.push(RelativeMotion {
            from: Stamp::from_nanos(motion.from_ns),
            to: Stamp::from_nanos(motion.to_ns),
            later_from_earlier: rigid(&motion.later_from_earlier)
                .map_err(|e| format!("motion {row}: {e}"))?,
        });
    }
    Trajectory::from_relative(&rows, Rigid::identity()).map_err(text)
}

pub(crate) fn imu(samples: &[contract::ImuSample]) -> Result<Vec<ImuSample>, Fault> {
    let sample = |s: &contract::ImuSample| ImuSample {
        stamp: Stamp::from_nanos(s.stamp_ns),
        gyro_rad_s: Vector3::from(s.gyro_body_rad_s),
        accel_m_s2: Vector3::from(s.accel_body_m_s2),
    };
    let samples: Vec<ImuSample> = samples.iter().map(sample).collect();
    imu::validate(&samples).map_err(text)?;
    Ok(samples)
}

pub(crate) fn inertial_state(state: &contract::InertialState) -> Result<InertialState, Fault> {
    let vectors = [state.velocity_world_m_s, state.gyro_bias_body_rad_s, state.accel_bias_body_m_s2];
    if !vectors.iter().flatten().all(|v| v.is_finite()) {
        return Err("its velocity or a bias is not finite".to_string());
    }
    let [velocity_m_s, gyro_bias_rad_s, accel_bias_m_s2] = vectors.map(Vector3::from);
    Ok(InertialState {
        stamp: Stamp::from_nanos(state.stamp_ns),
        world_from_body: rigid(&state.world_from_body)?,
        velocity_m_s,
        gyro_bias_rad_s,
        accel_bias_m_s2,
    })
}

pub(crate) fn points(points: &[contract::Point]) -> Vec<Point3<f32>> {
    points.iter().map(|p| Point3::new(p.x_m, p.y_m, p.z_m)).collect()
}

pub(crate) fn floor(floor: &contract::Floor) -> Result<Floor, Fault> {
    match floor.frame {
        contract::FLOOR_WORLD => Ok(Floor::World(plane(floor)?)),
        contract::FLOOR_BODY => Ok(Floor::Body(plane(floor)?)),
        other => Err(format!("frame {other} of the floor is none of the contract's")),
    }
}

fn plane<F>(floor: &contract::Floor) -> Result<Plane<F>, Fault> {
    let normal = Vector3::from(floor.normal);
    if (normal.norm() - 1.0).abs() < ROUNDING && floor.d_m.is_finite() {
        return Ok(Plane::from_unit(Unit::new_unchecked(normal), floor.d_m));
    }
    Plane::new(floor.normal, floor.d_m).map_err(text)
}

/// # Safety
/// Its texts are as [`contract::Text::bytes`] wants them.
#[allow(unsafe_code)]
pub(crate) unsafe fn suspicion(given: &contract::Suspicion) -> Result<Suspicion, Fault> {
    // SAFETY: the caller's promise, for all of these.
    let (code, about, message, evidence, advice) = unsafe {
        (
            border::name(given.code, "the code of a suspicion")?,
            border::text(given.about, "what a suspicion is about")?,
            border::text(given.message, "the message of a suspicion")?,
            border::text(given.evidence, "the evidence of a suspicion")?,
            border::text(given.advice, "the advice of a suspicion")?,
        )
    };
    if message.trim().is_empty() || given.count == 0 {
        return Err(format!("the suspicion `{code}` has no message, or was seen 0 times"));
    }
    Ok(Suspicion::new(&code, about, message).evidence(evidence).advice(advice).times(given.count))
}

/// # Safety
/// Its texts and numbers are as [`border`] wants them.
#[allow(unsafe_code)]
pub(crate) unsafe fn finding(given: &contract::Finding) -> Result<Finding, Fault> {
    // SAFETY: the caller's promise, for all of these.
    let (check, about, says, mend, numbers) = unsafe {
        (
            border::name(given.check, "the name of a check")?,
            border::text(given.about, "what a finding is about")?,
            border::text(given.says, "what a finding says")?,
            border::text(given.mend, "what mends a finding")?,
            border::list(given.numbers, given.number_count, "numbers of a finding")?,
        )
    };
    let state = match given.state {
        contract::STATE_UNKNOWN => State::Unknown,
        contract::STATE_OK => State::Ok,
        contract::STATE_LOOK => State::Look,
        contract::STATE_WRONG => State::Wrong,
        other => return Err(format!("state {other} of the finding `{check}` is none of the contract's")),
    };
    if says.trim().is_empty() {
        return Err(format!("the finding `{check}` says nothing"));
    }
    let mut finding = Finding::new(&check, about, state, says).mend(mend);
    for number in numbers {
        // SAFETY: the caller's promise.
        let (name, unit) = unsafe {
            (border::name(number.name, "the name of a number")?, border::text(number.unit, "a unit")?)
        };
        if !number.value.is_finite() {
            return Err(format!("the number `{name}` of the finding `{check}` is not finite"));
        }
        finding = finding.number(&name, number.value, &unit);
    }
    Ok(finding)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::frames::{Body, World};

    const IDENTITY: contract::Rigid =
        contract::Rigid { translation_m: [0.0; 3], rotation_wxyz: [1.0, 0.0, 0.0, 0.0] };

    #[test]
    fn rotations_keep_their_bits_and_bad_ones_are_refused() {
        let kept = [0.5 + 1e-16, 0.5, 0.5, 0.5 - 2e-16];
        let r: Rigid<World, Body> = rigid(&contract::Rigid { rotation_wxyz: kept, ..IDENTITY }).unwrap();
        let q = r.rotation();
        assert_eq!([q.w, q.i, q.j, q.k].map(f64::to_bits), kept.map(f64::to_bits));
        let near: Rigid<World, Body> =
            rigid(&contract::Rigid { rotation_wxyz: [1.0005, 0.0, 0.0, 0.0], ..IDENTITY }).unwrap();
        assert_eq!(near.rotation().w, 1.0);
        let why = |r: contract::Rigid| rigid::<World, Body>(&r).unwrap_err();
        assert!(why(contract::Rigid { rotation_wxyz: [0.0; 4], ..IDENTITY }).contains("length 0.000000"));
        assert!(why(contract::Rigid { rotation_wxyz: [f64::NAN; 4], ..IDENTITY }).contains("not finite"));
        assert!(
            why(contract::Rigid { translation_m: [f64::INFINITY; 3], ..IDENTITY }).contains("not finite")
        );
    }

    #[test]
    fn rows_must_lie_in_the_buffer() {
        let why = |stride, bytes| Rows::new((4, 3), 1, stride, bytes).unwrap_err();
        assert!(why(3, 100).contains("the stride is 3"));
        assert!(why(6, 15).contains("do not fit the 15 bytes"));
        assert!(Rows::new((u32::MAX, u32::MAX), 3, u32::MAX, usize::MAX).is_err());
        assert!(Rows::new((0, 3), 1, 4, 12).is_err());
        let rows = Rows::new((2, 2), 1, 3, 5).unwrap();
        assert_eq!(image(&rows, PixelFormat::Gray8, &[1, 2, 9, 3, 4]).unwrap().data(), [1, 2, 3, 4]);
        let rows = Rows::new((1, 2), 4, 8, 12).unwrap();
        assert_eq!(depth(7, &rows, &[1.0, 9.0, 2.0]).unwrap().z_m(), [1.0, 2.0]);
    }

    #[test]
    fn lists_are_ordered_and_finite() {
        assert!(frames(&[1, 2, 2]).unwrap_err().starts_with("frame 2 at 2 ns"));
        let pose = |stamp_ns| contract::Pose { stamp_ns, world_from_body: IDENTITY };
        assert!(trajectory(&[pose(2), pose(1)]).unwrap_err().contains("earlier"));
        assert!(trajectory(&[]).is_err());
        let motion = |from_ns, to_ns| contract::Motion { from_ns, to_ns, later_from_earlier: IDENTITY };
        assert_eq!(chained(&[motion(1, 2), motion(2, 4)]).unwrap().len(), 3);
        assert!(chained(&[motion(1, 2), motion(3, 4)]).unwrap_err().contains("ended at 2"));
        let sample = |stamp_ns, x| contract::ImuSample {
            stamp_ns,
            gyro_body_rad_s: [x; 3],
            accel_body_m_s2: [0.0; 3],
        };
        assert!(imu(&[sample(1, 0.0), sample(2, f64::NAN)]).unwrap_err().contains("sample 1"));
        assert!(imu(&[sample(1, 0.0), sample(1, 0.0)]).unwrap_err().contains("not later"));
    }

    #[test]
    fn models_are_known_and_have_their_coefficients() {
        let good = contract::Camera {
            width_px: 4,
            height_px: 4,
            fx_px: 1.0,
            fy_px: 1.0,
            cx_px: 0.0,
            cy_px: 0.0,
            model: contract::MODEL_RADTAN,
            coefficient_count: 4,
            coefficients: [0.0; 8],
        };
        assert!(camera(&good).is_ok());
        let why = |c: contract::Camera| camera(&c).unwrap_err();
        assert!(why(contract::Camera { model: 77, ..good }).contains("77"));
        assert!(why(contract::Camera { coefficient_count: 99, ..good }).contains("99"));
        assert!(why(contract::Camera { coefficient_count: 3, ..good }).contains("4 or 5"));
        assert!(why(contract::Camera { fx_px: f64::NAN, ..good }).contains("not finite"));
    }
}
