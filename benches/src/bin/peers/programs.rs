//! Runs both sides.

use std::collections::BTreeSet;
use std::error::Error;
use std::ffi::OsString;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;
use vice_core::camera::{Camera, Model, Pixel};
use vice_core::frames::{Rigid, WorldFromCamera};
use vice_depth::{Cloud, CloudOptions, ZMapDepth, ZMapOptions, depth_image, read_scan_points};
use vice_track::{Pyramid, corners, track_translation};

use crate::files::{Files, POSES, SCAN_POINTS};
use crate::table::{Rounds, Side};

/// Corners that are tracked, at most.
const CORNERS: usize = 500;
/// Levels of a pyramid above the picture.
const LEVELS: usize = 3;

type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

/// The program `vice`.
pub(crate) struct Ours {
    program: PathBuf,
}

impl Ours {
    /// Builds it in the profile and target folder of this program.
    pub(crate) fn build() -> Result<Self> {
        let own = std::env::current_exe()?;
        let folder = own.parent().ok_or("this program lies nowhere")?;
        let target = folder.parent().ok_or("this program does not lie in a target folder")?;
        let profile = match folder.file_name().and_then(|n| n.to_str()) {
            Some("debug") | None => "dev",
            Some(name) => name,
        };
        let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
            .args(["build", "--package", "vice-cli", "--profile", profile, "--target-dir"])
            .arg(target)
            .status()?;
        if !status.success() {
            return Err("vice could not be built".into());
        }
        Ok(Self { program: folder.join(format!("vice{}", std::env::consts::EXE_SUFFIX)) })
    }

    fn bench(&self, arguments: &[&str]) -> Result<Value> {
        let output =
            Command::new(&self.program).arg("bench").args(arguments).args(["--json", "-"]).output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
        }
        Ok(serde_json::from_slice(&output.stdout)?)
    }

    /// Projection, undistortion and equation 1 with the lens of EuRoC in one thread, and the same at several sizes with one
    /// and two.
    pub(crate) fn kernels(&self, points: usize, rounds: &mut Rounds) -> Result<()> {
        let mut sizes = BTreeSet::from([100_000, 1_000_000, 10_000_000]);
        sizes.insert(points);
        for size in sizes {
            for threads in [1, 2] {
                let (n, t) = (size.to_string(), threads.to_string());
                let kernels =
                    ["project", "unproject", "track", "--model", "radtan", "--points", &n, "--threads", &t];
                let document = self.bench(&kernels)?;
                for result in document["results"].as_array().into_iter().flatten() {
                    let name = result["kernel"].as_str().unwrap_or_default();
                    let number = |field: &str| result[field].as_f64().unwrap_or(f64::NAN);
                    let (per_second, fraction) = (number("points_per_second"), number("fraction_of_limit"));
                    rounds.sizes.add(name, size, threads, per_second, fraction);
                    if threads == 1 && size == points {
                        rounds.add(Side::Ours, name, points, points as f64 / per_second);
                    }
                }
                if size == points {
                    rounds.machine(&document["machine"][0]);
                }
            }
        }
        let (n, one) = (points.to_string(), "1");
        let document =
            self.bench(&["unproject", "--model", "equidistant", "--points", &n, "--threads", one])?;
        let per_second = document["results"][0]["points_per_second"].as_f64().unwrap_or(f64::NAN);
        rounds.add(Side::Ours, "unproject equidistant", points, points as f64 / per_second);
        // OpenCV's projection moves the points too, which is one more kernel here, timed in this process.
        let seconds = vice_benches::in_one_thread(|| vice_benches::project_moved_seconds(points))?;
        rounds.add(Side::Ours, "project moved", points, seconds);
        Ok(())
    }

    /// Corners of a picture found again in the next, from the two pictures to the places.
    pub(crate) fn tracker(&self, files: &Files, rounds: &mut Rounds) -> Result<()> {
        let (corners, seconds) = vice_benches::in_one_thread(|| -> Result<(usize, f64)> {
            let pyramids = || -> Result<_> {
                Ok((Pyramid::new(&files.before, LEVELS)?, Pyramid::new(&files.after, LEVELS)?))
            };
            let found = corners(&pyramids()?.0, 8.0);
            let places: Vec<Pixel> = found.iter().take(CORNERS).map(|c| c.px).collect();
            let seconds = best(10, || {
                let (before, after) = pyramids()?;
                black_box(track_translation(&before, &after, &places));
                Ok(())
            })?;
            Ok((places.len(), seconds))
        })??;
        rounds.add(Side::Ours, "pyrlk", corners, seconds);
        Ok(())
    }

    /// Reading a scan, and a whole depth image of it without the test for occlusion, which SciPy has not.
    pub(crate) fn depth(&self, files: &Files, rounds: &mut Rounds) -> Result<()> {
        let camera = Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], Model::Pinhole)?;
        let (ply, zmap) = vice_benches::in_one_thread(|| -> Result<(f64, f64)> {
            let options = CloudOptions::default();
            let ply = best(3, || Ok(read_scan_points(&files.scan, &options).map(drop)?))?;
            let cloud = Arc::new(Cloud::read(&files.scan, &options)?);
            let keyframe = vice_benches::keyframe(&camera, WorldFromCamera::identity());
            let without = ZMapOptions { occlusion: false, ..ZMapOptions::default() };
            let source = ZMapDepth::new(cloud, Rigid::identity(), without);
            let zmap = best(3, || Ok(depth_image(&source, &keyframe).map(drop)?))?;
            Ok((ply, zmap))
        })??;
        rounds.add(Side::Ours, "ply", SCAN_POINTS, ply);
        rounds.add(Side::Ours, "zmap", SCAN_POINTS, zmap);
        Ok(())
    }

    /// The whole command, process start and reading included.
    pub(crate) fn trajectory(&self, files: &Files, rounds: &mut Rounds) -> Result<()> {
        let seconds = best(3, || {
            run(Command::new(&self.program)
                .arg("trajectory")
                .args([&files.reference, &files.estimate])
                .args(["--align", "se3"]))
        })?;
        rounds.add(Side::Ours, "trajectory", POSES, seconds);
        Ok(())
    }
}

/// What a user would pick instead.
pub(crate) struct Peers {
    cpp: Option<PathBuf>,
    /// Plain loops, as the standard has arithmetic, and with vector functions.
    strong: Option<[PathBuf; 2]>,
    python: Option<OsString>,
    evo: Option<PathBuf>,
    pub(crate) missing: Vec<String>,
}

impl Peers {
    pub(crate) fn find(folder: &Path) -> Self {
        let mut missing = Vec::new();
        let cpp = compile(folder).map_err(|e| missing.push(format!("OpenCV from C++: {e}"))).ok();
        let strong = compile_strong(folder).map_err(|e| missing.push(format!("plain C++ loops: {e}"))).ok();
        let python = std::env::var_os("VICE_PEERS_PYTHON").unwrap_or_else(|| "python3".into());
        let python = match run(python_command(&python).args(["-c", "import numpy, cv2"])) {
            Ok(()) => Some(python),
            Err(error) => {
                missing.push(format!("Python with opencv-python-headless and numpy: {error}"));
                None
            }
        };
        let evo = python.as_ref().and_then(|p| {
            let beside = Path::new(p).with_file_name("evo_ape");
            if beside.is_file() {
                return Some(beside);
            }
            missing.push("evo: there is no evo_ape beside the Python (VICE_PEERS_PYTHON)".to_string());
            None
        });
        for module in ["scipy", "plyfile"] {
            if let Some(python) = &python
                && run(python_command(python).args(["-c", &format!("import {module}")])).is_err()
            {
                missing.push(format!("{module}: the Python cannot import it"));
            }
        }
        Self { cpp, strong, python, evo, missing }
    }

    pub(crate) fn cpp(&self, points: usize, files: &Files, rounds: &mut Rounds) -> Result<()> {
        let Some(program) = &self.cpp else { return Ok(()) };
        let mut command = Command::new(program);
        lines(command.arg(points.to_string()).args(&files.pictures), Side::Cpp, rounds)
    }

    pub(crate) fn strong(&self, points: usize, rounds: &mut Rounds) -> Result<()> {
        for program in self.strong.iter().flatten() {
            lines(Command::new(program).arg(points.to_string()), Side::Strong, rounds)?;
        }
        Ok(())
    }

    pub(crate) fn python(&self, points: usize, files: &Files, rounds: &mut Rounds) -> Result<()> {
        let Some(python) = &self.python else { return Ok(()) };
        let mut command = python_command(python);
        command.args(["-c", include_str!("../../../peers/peers.py"), &points.to_string()]);
        command.args([&files.scan, &files.reference, &files.estimate]).args(&files.pictures);
        lines(&mut command, Side::Python, rounds)
    }

    /// The whole command, process start and reading included.
    pub(crate) fn evo(&self, files: &Files, rounds: &mut Rounds) -> Result<()> {
        let Some(evo) = &self.evo else { return Ok(()) };
        let seconds = best(1, || {
            let mut command = python_command(evo.as_os_str());
            run(command.arg("tum").args([&files.reference, &files.estimate]).arg("--align"))
        })?;
        rounds.add(Side::Python, "trajectory", POSES, seconds);
        Ok(())
    }
}

/// A Python program in one thread. Settings that bind its libraries to a processor of another kind are taken off.
fn python_command(program: &std::ffi::OsStr) -> Command {
    let mut command = Command::new(program);
    command.env_remove("OPENBLAS_CORETYPE").env_remove("OPENBLAS_L2_SIZE");
    command.env("OPENBLAS_NUM_THREADS", "1").env("OMP_NUM_THREADS", "1");
    command
}

fn compile(folder: &Path) -> Result<PathBuf> {
    let (source, program) = (folder.join("opencv.cpp"), folder.join("opencv-peer"));
    std::fs::write(&source, include_str!("../../../peers/opencv.cpp"))?;
    let flags = Command::new("pkg-config").args(["--cflags", "opencv4"]).output();
    let flags = flags.map_or_else(
        |_| "-I/usr/include/opencv4".into(),
        |o| String::from_utf8_lossy(&o.stdout).into_owned(),
    );
    run(Command::new(compiler())
        .args(["-O3", "-march=native", "-std=c++17"])
        .args(flags.split_whitespace())
        .arg(&source)
        .arg("-o")
        .arg(&program)
        .args(
            ["opencv_calib3d", "opencv_video", "opencv_imgproc", "opencv_core"].map(|l| format!("-l{l}")),
        ))?;
    Ok(program)
}

fn compiler() -> OsString {
    std::env::var_os("CXX").unwrap_or_else(|| "c++".into())
}

/// The loops twice: the second time with a tangent for whole registers, which its numbers need not be the same for.
fn compile_strong(folder: &Path) -> Result<[PathBuf; 2]> {
    let source = folder.join("strong.cpp");
    std::fs::write(&source, include_str!("../../../peers/strong.cpp"))?;
    let build = |name: &str, flags: &[&str]| -> Result<PathBuf> {
        let program = folder.join(name);
        let wide: &[&str] = if cfg!(target_arch = "x86_64") { &["-mprefer-vector-width=512"] } else { &[] };
        run(Command::new(compiler())
            .args(["-O3", "-march=native", "-std=c++17"])
            .args(wide)
            .args(flags)
            .arg(&source)
            .arg("-o")
            .arg(&program))?;
        Ok(program)
    };
    Ok([build("strong", &["-ffp-contract=off"])?, build("strong-fast", &["-ffast-math", "-DFAST"])?])
}

/// Runs a program that must succeed; its last line is why where it does not.
fn run(command: &mut Command) -> Result<()> {
    let name = Path::new(command.get_program()).display().to_string();
    let output = command.stdin(Stdio::null()).output().map_err(|e| format!("{name}: {e}"))?;
    if output.status.success() {
        return Ok(());
    }
    let errors = String::from_utf8_lossy(&output.stderr);
    let last = errors.lines().rfind(|l| l.contains("rror")).or_else(|| errors.lines().last());
    Err(format!("{name}: {}", last.unwrap_or("failed")).into())
}

/// The cases that a peer prints.
fn lines(command: &mut Command, side: Side, rounds: &mut Rounds) -> Result<()> {
    let output = command.stdin(Stdio::null()).output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    for line in String::from_utf8(output.stdout)?.lines() {
        let case: Value = serde_json::from_str(line)?;
        if let (Some(name), Some(n), Some(seconds)) =
            (case["name"].as_str(), case["n"].as_u64(), case["seconds"].as_f64())
        {
            rounds.add(side, name, usize::try_from(n)?, seconds);
        }
    }
    Ok(())
}

fn best(runs: usize, mut work: impl FnMut() -> Result<()>) -> Result<f64> {
    work()?;
    let mut best = f64::INFINITY;
    for _ in 0..runs {
        let start = Instant::now();
        work()?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}
