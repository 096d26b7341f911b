//! The core's values between two processes. What is read is checked as if the plugin had handed it over itself: numbers
//! become the contract's values first.

use nalgebra::Point3;
use vice_abi::contract;
use vice_abi::export::values as given;
use vice_core::camera::Camera;
use vice_core::dataset::{
    CloudRef, CloudSource, DepthImage, Fact, Floor, FormatInfo, Image, Probe, SettingInfo,
};
use vice_core::error::{DataError, ErrorKind, Place, one_line};
use vice_core::finding::{Finding, Number, State};
use vice_core::frames::Rigid;
use vice_core::imu::{ImuSample, InertialState};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use super::codec::{Carried, Reader, Writer};
use crate::border::Fault;
use crate::values;

/// Structures field by field, in the order in which they are named.
macro_rules! structure {
    ($name:ty { $($field:ident),* }) => {
        impl Carried for $name {
            fn put(&self, out: &mut Writer) {
                $( out.put(&self.$field); )*
            }

            fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
                Ok(Self { $( $field: from.get()? ),* })
            }
        }
    };
}

structure!(contract::Rigid { translation_m, rotation_wxyz });
structure!(contract::Camera {
    width_px,
    height_px,
    fx_px,
    fy_px,
    cx_px,
    cy_px,
    model,
    coefficient_count,
    coefficients
});
structure!(contract::Pose { stamp_ns, world_from_body });
structure!(contract::ImuSample { stamp_ns, gyro_body_rad_s, accel_body_m_s2 });
structure!(contract::InertialState {
    stamp_ns,
    world_from_body,
    velocity_world_m_s,
    gyro_bias_body_rad_s,
    accel_bias_body_m_s2
});
structure!(contract::Floor { frame, reserved, normal, d_m });
structure!(Fact { section, text });
structure!(SettingInfo { key, description });
structure!(Number { name, value, unit });

impl<A, B> Carried for Rigid<A, B> {
    fn put(&self, out: &mut Writer) {
        out.put(&given::rigid(self));
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        values::rigid(&from.get()?)
    }
}

impl Carried for Stamp {
    fn put(&self, out: &mut Writer) {
        out.put(&self.as_nanos());
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        from.get().map(Self::from_nanos)
    }
}

impl Carried for Camera {
    fn put(&self, out: &mut Writer) {
        out.put(&given::camera(self));
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        values::camera(&from.get()?)
    }
}

/// Stamps of frames.
pub(super) struct Frames(pub(super) Vec<Stamp>);

impl Carried for Frames {
    fn put(&self, out: &mut Writer) {
        out.list(&self.0);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        values::frames(&from.list::<i64>()?).map(Self)
    }
}

impl Carried for Image {
    fn put(&self, out: &mut Writer) {
        // A format that the contract has no word for is none that a plugin can hand over.
        let format = given::pixel_format(self.format()).unwrap_or(-1);
        out.put(&self.width()).put(&self.height()).put(&format).bytes(self.data());
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        let (size, format) = ((from.get()?, from.get()?), values::pixel_format(from.get()?)?);
        let data = from.bytes()?;
        let stride = u64::from(size.0) * format.bytes() as u64;
        let stride = u32::try_from(stride).map_err(|_| format!("a row has {stride} bytes"))?;
        values::image(&values::Rows::new(size, format.bytes(), stride, data.len())?, format, data)
    }
}

impl Carried for DepthImage {
    fn put(&self, out: &mut Writer) {
        let z_m: Vec<u8> = self.z_m().iter().flat_map(|z| z.to_le_bytes()).collect();
        out.put(&self.stamp).put(&self.width()).put(&self.height()).bytes(&z_m);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        let (stamp, width, height) = (from.get()?, from.get()?, from.get()?);
        let z_m = from.bytes()?.as_chunks::<4>().0.iter().map(|z| f32::from_le_bytes(*z)).collect();
        Self::new(stamp, width, height, z_m).map_err(|e| e.to_string())
    }
}

impl Carried for Trajectory {
    fn put(&self, out: &mut Writer) {
        out.list(&given::poses(self));
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        values::trajectory(&from.list::<contract::Pose>()?)
    }
}

/// Inertial samples.
pub(super) struct Samples(pub(super) Vec<ImuSample>);

impl Carried for Samples {
    fn put(&self, out: &mut Writer) {
        out.list(&given::imu(&self.0));
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        values::imu(&from.list::<contract::ImuSample>()?).map(Self)
    }
}

impl Carried for InertialState {
    fn put(&self, out: &mut Writer) {
        out.put(&given::inertial_state(self));
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        values::inertial_state(&from.get()?)
    }
}

impl Carried for Floor {
    fn put(&self, out: &mut Writer) {
        // None for what the contract has no word for: it is not known.
        out.put(&given::floor(self).ok());
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        from.get::<Option<contract::Floor>>()?.map_or(Ok(Self::Unknown), |floor| values::floor(&floor))
    }
}

impl Carried for CloudRef {
    fn put(&self, out: &mut Writer) {
        out.put(&self.world_from_cloud);
        let (path, points) = match &self.source {
            CloudSource::File(path) => (Some(path.clone()), &[][..]),
            CloudSource::Points(points) => (None, &points[..]),
            _ => (None, &[][..]),
        };
        let bytes: Vec<u8> = points.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f32::to_le_bytes).collect();
        out.put(&path).bytes(&bytes);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        let world_from_cloud = from.get()?;
        let path: Option<std::path::PathBuf> = from.get()?;
        let numbers = from.bytes()?.as_chunks::<4>().0.iter().map(|v| f32::from_le_bytes(*v));
        let numbers: Vec<f32> = numbers.collect();
        let points: Vec<Point3<f32>> = numbers.as_chunks::<3>().0.iter().map(|p| Point3::from(*p)).collect();
        let source = path.map_or_else(|| CloudSource::Points(points.into()), CloudSource::File);
        Ok(Self { source, world_from_cloud })
    }
}

impl Carried for Suspicion {
    fn put(&self, out: &mut Writer) {
        out.put(&self.code)
            .put(&self.about)
            .put(&self.message)
            .put(&self.evidence)
            .put(&self.advice)
            .put(&self.count);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        let (code, about, message): (String, String, String) = (from.get()?, from.get()?, from.get()?);
        let (evidence, advice): (String, String) = (from.get()?, from.get()?);
        Ok(Self::new(&code, about, message).evidence(evidence).advice(advice).times(from.get()?))
    }
}

impl Carried for Finding {
    fn put(&self, out: &mut Writer) {
        let state: u8 = match self.state {
            State::Unknown => 0,
            State::Ok => 1,
            State::Look => 2,
            State::Wrong => 3,
        };
        out.put(&self.check).put(&self.about).put(&state).put(&self.says).put(&self.mend).list(&self.numbers);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        let (check, about): (String, String) = (from.get()?, from.get()?);
        let state = match from.get::<u8>()? {
            0 => State::Unknown,
            1 => State::Ok,
            2 => State::Look,
            3 => State::Wrong,
            other => return Err(format!("state {other} of the finding `{check}` is none")),
        };
        let (says, mend): (String, String) = (from.get()?, from.get()?);
        let finding = Self::new(&check, about, state, says).mend(mend);
        let numbers = from.list::<Number>()?.into_iter().filter(|n| n.value.is_finite());
        Ok(numbers.fold(finding, |finding, n| finding.number(&n.name, n.value, &n.unit)))
    }
}

impl Carried for FormatInfo {
    fn put(&self, out: &mut Writer) {
        out.put(&self.name).put(&self.description).put(&self.version).list(&self.offers).list(&self.settings);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        Ok(Self {
            name: from.get()?,
            description: from.get()?,
            version: from.get()?,
            offers: from.list()?,
            settings: from.list()?,
        })
    }
}

impl Carried for Probe {
    fn put(&self, out: &mut Writer) {
        match self {
            Self::Yes => out.put(&1_u8),
            Self::Collection(paths) => out.put(&2_u8).list(paths),
            _ => out.put(&0_u8),
        };
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        match from.get::<u8>()? {
            0 => Ok(Self::No),
            1 => Ok(Self::Yes),
            2 => from.list().map(Self::Collection),
            other => Err(format!("the answer {other} is none")),
        }
    }
}

impl Carried for DataError {
    fn put(&self, out: &mut Writer) {
        let kind: u8 = match self.kind() {
            ErrorKind::Missing => 1,
            ErrorKind::Unsupported => 2,
            ErrorKind::Contradictory => 3,
            ErrorKind::Usage => 4,
            _ => 0,
        };
        let (line, byte) = match self.place() {
            Some(Place::Line(line)) => (Some(line), None),
            Some(Place::Byte(byte)) => (None, Some(byte)),
            _ => (None, None),
        };
        let because = std::error::Error::source(self).map(one_line);
        out.put(&kind).put(&self.problem().to_string()).put(&self.hint_text().map(str::to_string));
        out.put(&self.path().map(std::path::Path::to_path_buf)).put(&line).put(&byte).put(&because);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        let kind = match from.get::<u8>()? {
            1 => ErrorKind::Missing,
            2 => ErrorKind::Unsupported,
            3 => ErrorKind::Contradictory,
            4 => ErrorKind::Usage,
            _ => ErrorKind::Corrupt,
        };
        let mut error = Self::of_kind(kind, from.get::<String>()?);
        if let Some(hint) = from.get::<Option<String>>()? {
            error = error.hint(hint);
        }
        if let Some(path) = from.get::<Option<std::path::PathBuf>>()? {
            error = error.at(path);
        }
        if let Some(line) = from.get::<Option<u64>>()? {
            error = error.line(line);
        }
        if let Some(byte) = from.get::<Option<u64>>()? {
            error = error.byte(byte);
        }
        if let Some(cause) = from.get::<Option<String>>()? {
            error = error.because(cause);
        }
        Ok(error)
    }
}
