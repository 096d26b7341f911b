//! The messages that are read, each described once for ROS 1 and ROS 2.

use crate::lenient::RawPose;
use crate::wire::{Header, Reader, WireResult};

/// `sensor_msgs/Image` before its pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImageHead<'a> {
    pub(crate) header: Header<'a>,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) encoding: &'a str,
    pub(crate) big_endian: bool,
    /// Bytes a row.
    pub(crate) step: u32,
}

/// Reads `sensor_msgs/Image` up to its pixels, which [`Reader::bytes`] gives then.
pub(crate) fn image_head<'a>(r: &mut Reader<'a>) -> WireResult<ImageHead<'a>> {
    let header = r.header()?;
    let (height, width) = (r.u32()?, r.u32()?);
    let encoding = r.str()?;
    let big_endian = r.u8()? != 0;
    Ok(ImageHead { header, height, width, encoding, big_endian, step: r.u32()? })
}

/// Reads `sensor_msgs/CompressedImage` up to its data: header and format.
pub(crate) fn compressed_head<'a>(r: &mut Reader<'a>) -> WireResult<(Header<'a>, &'a str)> {
    Ok((r.header()?, r.str()?))
}

/// `sensor_msgs/CameraInfo`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraInfo {
    pub(crate) frame: String,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) model: String,
    pub(crate) distortion: Vec<f64>,
    /// The camera matrix, row-major.
    pub(crate) k: [f64; 9],
    /// The projection matrix of the rectified image, row-major 3x4.
    pub(crate) p: [f64; 12],
    pub(crate) binning: [u32; 2],
    /// x, y, height, width; zeros mean the whole image.
    pub(crate) roi: [u32; 4],
}

impl CameraInfo {
    /// Whether it has a focal length: a driver without a calibration sends zeros.
    pub(crate) fn is_calibrated(&self) -> bool {
        self.k[0] != 0.0 || self.p[0] != 0.0
    }

    /// What differs from another one, in a few words.
    pub(crate) fn difference(&self, other: &Self) -> String {
        let size = |info: &Self| format!("{}x{}", info.width, info.height);
        let intrinsics =
            |info: &Self| format!("fx {} fy {} cx {} cy {}", info.k[0], info.k[4], info.k[2], info.k[5]);
        let window = |info: &Self| format!("binning {:?} roi {:?}", info.binning, info.roi);
        let lens = |info: &Self| format!("{} {:?}", info.model, info.distortion);
        let projection = |info: &Self| format!("P {:?}", info.p);
        let frame = |info: &Self| format!("frame {}", info.frame);
        let views: [&dyn Fn(&Self) -> String; 6] = [&size, &intrinsics, &window, &lens, &projection, &frame];
        let first = views.iter().map(|view| (view(self), view(other))).find(|(a, b)| a != b);
        first.map_or_else(|| "the rectification".to_string(), |(a, b)| format!("{a}, later {b}"))
    }
}

/// Reads `sensor_msgs/CameraInfo`.
pub(crate) fn camera_info(r: &mut Reader<'_>) -> WireResult<CameraInfo> {
    let frame = r.header()?.frame.to_string();
    let (height, width) = (r.u32()?, r.u32()?);
    let model = r.str()?.to_string();
    let distortion = r.f64_list()?;
    let k = r.f64s()?;
    r.f64s::<9>()?; // The rectification, which P has already.
    let p = r.f64s()?;
    let binning = [r.u32()?, r.u32()?];
    let roi = [r.u32()?, r.u32()?, r.u32()?, r.u32()?];
    Ok(CameraInfo { frame, height, width, model, distortion, k, p, binning, roi })
}

/// A pose with its frames: `Odometry`, `PoseStamped`, `PoseWithCovarianceStamped` or `TransformStamped`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FramedPose<'a> {
    pub(crate) header: Header<'a>,
    /// The frame whose pose it is; empty where the message does not say.
    pub(crate) child: &'a str,
    /// Taken as it is; [`crate::lenient::Tally::take`] says whether it is a pose.
    pub(crate) parent_from_child: RawPose,
}

/// How a message with a pose is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PoseKind {
    /// `nav_msgs/Odometry` and `geometry_msgs/TransformStamped`: header, child frame, pose.
    WithChild,
    /// `geometry_msgs/PoseStamped` and `PoseWithCovarianceStamped`: header, pose.
    Alone,
    /// `nav_msgs/Path`: the way so far, published again and again as it grows.
    Path,
}

impl PoseKind {
    /// By the type of a topic.
    pub(crate) fn of(kind: &str) -> Option<Self> {
        match kind {
            "nav_msgs/Odometry" | "geometry_msgs/TransformStamped" => Some(Self::WithChild),
            "geometry_msgs/PoseStamped" | "geometry_msgs/PoseWithCovarianceStamped" => Some(Self::Alone),
            "nav_msgs/Path" => Some(Self::Path),
            _ => None,
        }
    }
}

/// Reads a message with a pose; what comes after it is left.
pub(crate) fn framed_pose<'a>(r: &mut Reader<'a>, kind: PoseKind) -> WireResult<FramedPose<'a>> {
    let header = r.header()?;
    let child = match kind {
        PoseKind::WithChild => r.str()?.trim_start_matches('/'),
        PoseKind::Alone | PoseKind::Path => "",
    };
    Ok(FramedPose { header, child, parent_from_child: transform(r)? })
}

/// Reads the covariance that stands after the pose of `Odometry` and `PoseWithCovarianceStamped`, row by row; `None` of messages
/// that end there.
pub(crate) fn pose_covariance(r: &mut Reader<'_>) -> Option<[f64; 36]> {
    r.f64s().ok()
}

/// Reads `nav_msgs/Path`: its header, then a pose with a header of its own after the other.
pub(crate) fn path<'a>(r: &mut Reader<'a>, mut each: impl FnMut(FramedPose<'a>)) -> WireResult<Header<'a>> {
    let header = r.header()?;
    for _ in 0..r.count(64)? {
        let pose = framed_pose(r, PoseKind::Alone)?;
        // Many publishers name the frame of the whole path only.
        let frame = if pose.header.frame.is_empty() { header.frame } else { pose.header.frame };
        each(FramedPose { header: Header { frame, ..pose.header }, ..pose });
    }
    Ok(header)
}

/// Reads `tf2_msgs/TFMessage`, one transform after the other.
pub(crate) fn tf_message<'a>(r: &mut Reader<'a>, mut each: impl FnMut(FramedPose<'a>)) -> WireResult<()> {
    for _ in 0..r.count(60)? {
        each(framed_pose(r, PoseKind::WithChild)?);
    }
    Ok(())
}

/// `geometry_msgs/Pose` and `Transform` are alike: a vector and a quaternion xyzw.
fn transform(r: &mut Reader<'_>) -> WireResult<RawPose> {
    let translation_m = r.f64s()?;
    let [x, y, z, w] = r.f64s()?;
    Ok(RawPose { translation_m, rotation_wxyz: [w, x, y, z] })
}

/// `sensor_msgs/Imu` without orientation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Imu<'a> {
    pub(crate) header: Header<'a>,
    /// rad/s in the frame of the header; `None` where the sensor has no gyroscope.
    pub(crate) gyro: Option<[f64; 3]>,
    /// m/s² in the frame of the header; `None` where the sensor has no accelerometer.
    pub(crate) accel: Option<[f64; 3]>,
}

/// Reads `sensor_msgs/Imu`. A covariance that starts with -1 says that there is no such value.
pub(crate) fn imu<'a>(r: &mut Reader<'a>) -> WireResult<Imu<'a>> {
    let header = r.header()?;
    r.f64s::<4>()?;
    r.f64s::<9>()?;
    let mut value = || -> WireResult<Option<[f64; 3]>> {
        let value = r.f64s()?;
        let covariance = r.f64s::<9>()?;
        Ok((covariance[0] != -1.0).then_some(value))
    };
    Ok(Imu { header, gyro: value()?, accel: value()? })
}

/// Reads `sensor_msgs/JointState`: names and positions (rad or m), which may be fewer than the names.
pub(crate) fn joint_state<'a>(
    r: &mut Reader<'a>,
    mut each: impl FnMut(&'a str, f64),
) -> WireResult<Header<'a>> {
    let header = r.header()?;
    let names: Vec<&str> = (0..r.count(4)?).map(|_| r.str()).collect::<WireResult<_>>()?;
    for (name, position) in names.into_iter().zip(r.f64_list()?) {
        each(name, position);
    }
    Ok(header)
}
