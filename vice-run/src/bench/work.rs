//! What is measured, and against which limit.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::{UnitQuaternion, Vector3};
use vice_core::camera::{Camera, Model};
use vice_core::dataset::{Floor, Plane};
use vice_core::depth::Keyframe;
use vice_core::frames::{BodyFromCamera, Rigid, WorldFromCamera};
use vice_core::random::Congruential;
use vice_core::time::Stamp;
use vice_core::track::track_batch;
use vice_depth::{Cloud, CloudOptions, ZMapDepth, ZMapOptions, depth_image, read_scan_points};

use super::limits::{copy_bytes, seconds};
use super::scan::room;
use super::{KernelName, ModelName};
use crate::error::{Context, RunResult};

/// Measured until both are reached.
const MIN_ROUNDS: usize = 5;
const MIN_SECONDS: f64 = 0.5;

/// The best time, and the shortest that the machine allows.
pub(super) struct Measured {
    pub(super) seconds: f64,
    pub(super) limit_seconds: f64,
    pub(super) limit: &'static str,
}

/// Input and output of a kernel.
pub(super) enum Work {
    Camera {
        kernel: KernelName,
        camera: Camera,
        input: [Vec<f64>; 3],
        output: [Vec<f64>; 2],
        valid: Vec<bool>,
    },
    ZMap {
        camera: Camera,
        cloud: Arc<Cloud>,
    },
    Ply {
        _folder: Folder,
        path: PathBuf,
        bytes: usize,
    },
}

/// A folder that goes away again.
pub(super) struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        // What is left in a folder for temporary files harms nobody.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn camera(model: ModelName) -> RunResult<Camera> {
    let (name, coefficients): (&str, &[f64]) = match model {
        ModelName::Pinhole => ("pinhole", &[]),
        ModelName::Radtan => ("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]),
        ModelName::Rational => ("rational", &[0.35, 0.12, 0.0004, -0.0007, 0.01, 0.62, 0.2, 0.02]),
        ModelName::Equidistant => {
            ("equidistant", &[0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673])
        }
        ModelName::Ds => ("ds", &[-0.18, 0.59]),
        ModelName::Eucm => ("eucm", &[0.63, 1.04]),
        ModelName::Omni => ("omni", &[0.9, -0.2, 0.05, 0.0005, -0.0003]),
        ModelName::Fov => ("fov", &[0.93]),
    };
    let model = Model::from_name(name, coefficients)?;
    Ok(Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], model)?)
}

/// A small motion of the camera.
fn motion() -> WorldFromCamera {
    Rigid::from_parts(
        Vector3::new(0.1, 0.0, -0.1),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.2, 0.05)),
    )
}

impl Work {
    pub(super) fn new(kernel: KernelName, model: Option<ModelName>, n: usize) -> RunResult<Self> {
        let mut numbers = Congruential::new(7);
        let model = model.unwrap_or(ModelName::Pinhole);
        match kernel {
            KernelName::Project | KernelName::Unproject | KernelName::Track => {
                let [x, y, z] = [[-0.7, 0.7], [-0.42, 0.42], [1.0, 8.0]];
                let [u, v] = [[20.0, 730.0], [20.0, 460.0]];
                let ranges = if kernel == KernelName::Project { [x, y, z] } else { [u, v, z] };
                let input = ranges.map(|[low, high]| numbers.list(n, low, high));
                let output = [vec![0.0; n], vec![0.0; n]];
                Ok(Self::Camera { kernel, camera: camera(model)?, input, output, valid: vec![false; n] })
            }
            KernelName::Zmap => {
                let cloud = Arc::new(Cloud::from_points(room(n), &CloudOptions::default())?);
                Ok(Self::ZMap { camera: camera(model)?, cloud })
            }
            KernelName::Ply => {
                let folder = std::env::temp_dir().join(format!("vice-bench-{}", std::process::id()));
                std::fs::create_dir_all(&folder).context(|| format!("cannot make {}", folder.display()))?;
                let (path, folder) = (folder.join("scan.ply"), Folder(folder));
                let mut bytes = format!(
                    "ply\nformat binary_little_endian 1.0\nelement vertex {n}\n\
                     property float x\nproperty float y\nproperty float z\nend_header\n"
                )
                .into_bytes();
                bytes.extend(room(n).iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f32::to_le_bytes));
                std::fs::File::create(&path)
                    .and_then(|mut f| f.write_all(&bytes))
                    .context(|| format!("cannot write {}", path.display()))?;
                Ok(Self::Ply { _folder: folder, path, bytes: bytes.len() })
            }
        }
    }

    /// Rounds of the kernel and of what limits it, in turn.
    pub(super) fn measure(&mut self) -> RunResult<Measured> {
        match self {
            Self::Camera { kernel, camera, input, output, valid } => {
                let (kernel, n) = (*kernel, valid.len());
                let [u, v] = output;
                // Half of them are read, half written; a mask's byte too.
                let bytes = n * if kernel == KernelName::Unproject { 33 } else { 41 };
                let (from, mut to) = (vec![1_u8; bytes.div_ceil(2)], vec![0_u8; bytes.div_ceil(2)]);
                let (at_keyframe, now) = (WorldFromCamera::identity(), motion());
                let (best, copy) = rounds(
                    || {
                        let [a, b, c] = &*input;
                        // The pixels of a key frame are replaced, and must come back; that is not what is measured.
                        if kernel == KernelName::Track {
                            u.copy_from_slice(a);
                            v.copy_from_slice(b);
                        }
                        seconds(|| {
                            match kernel {
                                KernelName::Project => camera.project_batch([a, b, c], [u, v], valid),
                                KernelName::Unproject => camera.unproject_batch([a, b], [u, v], valid),
                                _ => track_batch(camera, &at_keyframe, &now, [u, v], c, valid),
                            };
                        })
                    },
                    || seconds(|| copy_bytes(&from, &mut to)),
                );
                Ok(Measured { seconds: best, limit_seconds: copy, limit: "memory" })
            }
            Self::ZMap { camera, cloud } => {
                let keyframe = Keyframe {
                    stamp: Stamp::default(),
                    frame: 0,
                    camera,
                    body_from_camera: BodyFromCamera::identity(),
                    world_from_camera: Some(WorldFromCamera::identity()),
                    floor: Floor::World(Plane::z_zero()),
                };
                let zmap = ZMapDepth::new(Arc::clone(cloud), Rigid::identity(), ZMapOptions::default());
                let (from, mut to) = (vec![1_u8; cloud.len() * 12], vec![0_u8; cloud.len() * 12]);
                let mut failed = None;
                let (best, copy) = rounds(
                    || seconds(|| failed = depth_image(&zmap, &keyframe).err()),
                    || seconds(|| copy_bytes(&from, &mut to)),
                );
                match failed {
                    Some(error) => Err(error.into()),
                    None => Ok(Measured { seconds: best, limit_seconds: copy, limit: "memory" }),
                }
            }
            Self::Ply { path, bytes, .. } => {
                let mut failed = None;
                let mut buffer = Vec::with_capacity(*bytes);
                let (best, read) = rounds(
                    || seconds(|| failed = read_scan_points(&*path, &CloudOptions::default()).err()),
                    || {
                        buffer.clear();
                        seconds(|| {
                            let read = std::fs::File::open(&*path)
                                .and_then(|mut f| std::io::Read::read_to_end(&mut f, &mut buffer));
                            // A file that cannot be read fails in the kernel too, which says so.
                            let _ = read;
                        })
                    },
                );
                match failed {
                    Some(error) => Err(error.into()),
                    None => Ok(Measured { seconds: best, limit_seconds: read, limit: "reading bytes" }),
                }
            }
        }
    }
}

/// The best times of two things that are done in turn.
fn rounds(mut kernel: impl FnMut() -> f64, mut limit: impl FnMut() -> f64) -> (f64, f64) {
    kernel();
    limit();
    let (mut best, mut best_limit) = (f64::INFINITY, f64::INFINITY);
    let start = Instant::now();
    let mut round = 0;
    while round < MIN_ROUNDS || start.elapsed().as_secs_f64() < MIN_SECONDS {
        round += 1;
        best = best.min(kernel());
        best_limit = best_limit.min(limit());
    }
    (best, best_limit)
}
