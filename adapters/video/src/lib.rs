//! The format `video`: a film, the stamps of its frames, a calibration and estimates. Anyone with a phone and an estimate
//! can use VICE with it.
//!
//! A data set is a folder with a file `vice-video.toml` (or that file itself):
//!
//! ```
//! # let text = r#"
//! name = "kitchen"                      # optional: by default the folder's name
//! film = "film.mov"                     # QuickTime or MP4, any codec that FFmpeg knows
//! stamps = "stamps.txt"                 # one line a frame, in the order in which frames are shown: integer nanoseconds
//! gray = false                          # optional: decode to gray instead of RGB
//! imu = "imu.csv"                       # optional: ns, gyro x y z (rad/s), accel x y z (m/s²), in the body frame
//! floor = [0.0, 0.0, 1.0, 0.0]          # optional: nx ny nz d of n·p + d = 0 in the world; by default z = 0
//!
//! [camera]
//! name = "camera"                       # optional
//! size = [1920, 1080]                   # columns, rows of the film as it is shown
//! intrinsics = [1400.0, 1400.0, 959.5, 539.5]  # fx fy cx cy in pixels; pixel centres are integers
//! model = "radtan"                      # optional: pinhole (default), radtan, rational, equidistant, ds, eucm, omni, fov
//! distortion = [0.1, -0.2, 0.0, 0.0]    # coefficients of the model
//! body_from_camera = [                  # optional: row-major 4x4, metres; by default the body is the camera
//!   1.0, 0.0, 0.0, 0.0,
//!   0.0, 1.0, 0.0, 0.0,
//!   0.0, 0.0, 1.0, 0.0,
//!   0.0, 0.0, 0.0, 1.0,
//! ]
//!
//! [trajectories]                        # optional: files of poses world_from_body, TUM or another format VICE reads
//! ground-truth = "vicon.tum"            # this name is the reference
//! slam = "slam.tum"
//! # "#;
//! # vice_video::Description::parse(text).unwrap();
//! ```
//!
//! Paths are relative to the file and stay below its folder. The world's z points up. A film that a phone stores turned
//! by a quarter is used as players show it, upright.
//!
//! The film code ([`film`], [`StampedFilm`]) serves other formats too.
#![forbid(unsafe_code)]

mod dataset;
mod description;
mod encode;
mod ffmpeg;
pub mod film;
mod mov;
mod stamped;
mod state;

pub use dataset::Video;
pub use description::{CameraPart, Description};
pub use encode::FilmWriter;
pub use ffmpeg::Ffmpeg;
pub use stamped::{StampedFilm, check_count, read_stamps};
pub use state::reference_state;
