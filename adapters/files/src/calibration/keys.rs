//! What the keys of calibration files mean, in the dialects of Kalibr, OpenVINS, EuRoC, ROS, OpenCV, VINS and
//! ORB-SLAM.
//!
//! A key about geometry, time or size that is not known is refused by its name: passed over, it would leave the data
//! set's own value in its place without a word. Others are listed once.

use serde_json::Value;

/// What a key says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// The projection: a pinhole, or one with parameters of its own.
    CameraModel,
    /// The lens.
    DistortionModel,
    /// `fx fy cx cy`.
    Intrinsics,
    /// A 3x3 matrix.
    CameraMatrix,
    /// One of fx, fy, cx, cy, by its place.
    Intrinsic(usize),
    /// fx, fy, cx, cy by their names.
    Projection,
    /// Coefficients of the lens.
    Distortion,
    /// Parameters of the projection itself by their names, such as xi.
    Mirror,
    /// k1, k2, p1, p2 and so on by their names.
    DistortionByName,
    /// One of k1, k2, p1, p2, k3 to k6, by its place.
    Coefficient(usize),
    /// Columns and rows.
    Resolution,
    Width,
    Height,
    /// Takes the camera to the body.
    BodyFromCamera,
    /// Takes the body to the camera.
    CameraFromBody,
    /// Takes the camera before this one to this one.
    CameraFromPrevious,
    /// Stamp of the IMU less that of the image, seconds.
    TimeShift,
    Topic,
    Name,
    /// Whether the lens is a fisheye, 0 or 1.
    Fisheye,
    /// 0 or 1, anything else is another image.
    Binning,
    /// Of no account for what is computed here.
    Harmless,
    /// About geometry, time or size, and not read.
    Weighty,
    /// Not known, and about none of these.
    Unknown,
}

const HARMLESS: [&str; 65] = [
    "cam_overlaps",
    "camera_overlaps",
    "overlaps",
    "comment",
    "sensor_type",
    "rate_hz",
    "rate",
    "fps",
    "frequency",
    "date",
    "calibration_time",
    "nframes",
    "n_frames",
    "nr_of_frames",
    "nrofframes",
    "board_width",
    "board_height",
    "square_size",
    "boardsize_width",
    "boardsize_height",
    "squaresize",
    "fixaspectratio",
    "flags",
    "flagvalue",
    "avg_reprojection_error",
    "reprojection_error",
    "rms",
    "rms_error",
    "per_view_reprojection_errors",
    "extrinsic_parameters",
    "image_points",
    "grid_points",
    "aspectratio",
    "marker_size",
    "projection_matrix",
    "p",
    "frame_id",
    "header",
    "serial",
    "serial_number",
    "manufacturer",
    "vendor",
    "description",
    "label",
    "id",
    "version",
    "file.version",
    "bf",
    "thdepth",
    // The size that ORB-SLAM scales its images to.
    "newwidth",
    "newheight",
    "depthmapfactor",
    "rgb",
    "stereo.thdepth",
    "stereo.b",
    "mask",
    "use_mask",
    "is_fisheye_mask",
    "num_cameras",
    "num_of_cam",
    "timestamp",
    "calibration_date",
    "calib_date",
    "pattern",
    "sigma_pixels",
];
/// Parts of names of keys that are about geometry, time or size.
const WEIGHTY: [&str; 34] = [
    "extrin",
    "rotation",
    "translation",
    "transform",
    "_from_",
    "_to_",
    "shift",
    "offset",
    "delay",
    "time",
    "stamp",
    "resolution",
    "width",
    "height",
    "size",
    "intrins",
    "focal",
    "principal",
    "distort",
    "skew",
    "binning",
    "roi",
    "crop",
    "rect",
    "scale",
    "mirror",
    "flip",
    "baseline",
    "pose",
    "clock",
    "rolling",
    "t_cam",
    "_cam_",
    "matrix",
];

/// What a key means, whatever the case of its letters.
pub(super) fn of(key: &str) -> Key {
    let lower = key.to_lowercase();
    // ORB-SLAM's `Camera.fx` and `Camera1.fx`.
    let name = lower.strip_prefix("camera.").or_else(|| lower.strip_prefix("camera1.")).unwrap_or(&lower);
    let compact: String = name.chars().filter(|c| *c != '_' && *c != '-').collect();
    match compact.as_str() {
        "cameramodel" | "modeltype" | "projectionmodel" => Key::CameraModel,
        "type" if lower.starts_with("camera") => Key::CameraModel,
        "distortionmodel" | "distortiontype" | "distmodel" => Key::DistortionModel,
        "intrinsics" | "intrinsic" => Key::Intrinsics,
        "cameramatrix" | "k" | "intrinsicmatrix" | "intrinsicsmatrix" | "mtx" => Key::CameraMatrix,
        "projectionparameters" => Key::Projection,
        "mirrorparameters" => Key::Mirror,
        "fx" => Key::Intrinsic(0),
        "fy" => Key::Intrinsic(1),
        "cx" => Key::Intrinsic(2),
        "cy" => Key::Intrinsic(3),
        "distortioncoeffs"
        | "distortioncoefficients"
        | "distcoeffs"
        | "distcoefficients"
        | "d"
        | "distortion"
        | "dist" => Key::Distortion,
        "distortionparameters" => Key::DistortionByName,
        "k1" => Key::Coefficient(0),
        "k2" => Key::Coefficient(1),
        "p1" => Key::Coefficient(2),
        "p2" => Key::Coefficient(3),
        "k3" => Key::Coefficient(4),
        "k4" => Key::Coefficient(5),
        "k5" => Key::Coefficient(6),
        "k6" => Key::Coefficient(7),
        "resolution" | "imagesize" | "imagedimension" => Key::Resolution,
        "imagewidth" | "width" | "imgwidth" => Key::Width,
        "imageheight" | "height" | "imgheight" => Key::Height,
        "tbs" | "timucam" | "tic" | "tbodycam" | "tbodycamera" | "bodyfromcamera" | "bodytcam"
        | "bodytcam0" | "tbc" | "tbc1" | "imu.tbc1" | "timucamera" => Key::BodyFromCamera,
        "tcamimu" | "tsb" | "tci" | "tcambody" | "tcamerabody" | "camerafrombody" | "tcb" | "tcameraimu" => {
            Key::CameraFromBody
        }
        "tcncnm1" => Key::CameraFromPrevious,
        "timeshiftcamimu" | "td" => Key::TimeShift,
        "rostopic" | "topic" | "imagetopic" => Key::Topic,
        "cameraname" | "name" => Key::Name,
        "fisheyemodel" | "fisheye" => Key::Fisheye,
        "binningx" | "binningy" => Key::Binning,
        // Turns images that are rectified, which those of a camera are not.
        "rectificationmatrix" | "r" | "roi" | "linedelay" => Key::Weighty,
        _ if HARMLESS.contains(&name) || HARMLESS.contains(&compact.as_str()) => Key::Harmless,
        _ if lower.starts_with("orbextractor.") || lower.starts_with("viewer.") => Key::Harmless,
        _ if lower.starts_with("t_") || WEIGHTY.iter().any(|part| lower.contains(part)) => Key::Weighty,
        _ => Key::Unknown,
    }
}

/// Whether keys like these describe a camera.
pub(super) fn describes_camera(map: &serde_json::Map<String, Value>) -> bool {
    map.keys().any(|key| {
        matches!(
            of(key),
            Key::CameraModel
                | Key::DistortionModel
                | Key::Intrinsics
                | Key::CameraMatrix
                | Key::Intrinsic(_)
                | Key::Projection
                | Key::Mirror
                | Key::Distortion
                | Key::DistortionByName
                | Key::Resolution
                | Key::Width
                | Key::BodyFromCamera
                | Key::CameraFromBody
                | Key::CameraFromPrevious
                | Key::TimeShift
        )
    })
}
