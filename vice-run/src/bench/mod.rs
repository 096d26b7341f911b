//! How fast this machine projects, and how far that is from its limit.

mod limits;
mod scan;
mod work;

use serde::Serialize;
use vice_core::lanes::instruction_set;

pub use self::limits::Machine;
use self::work::Work;
use crate::error::{RunError, RunResult};
use crate::progress::Progress;
use crate::report::table;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KernelName {
    /// Points of the camera frame to pixels.
    Project,
    /// Pixels to rays, solved to 1e-10.
    Unproject,
    /// Equation 1: pixels with depth to pixels of another frame.
    Track,
    /// A scan to a whole depth image.
    Zmap,
    /// A binary PLY file to points.
    Ply,
}

/// Camera models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelName {
    /// No distortion.
    Pinhole,
    /// Radial and tangential.
    Radtan,
    /// Rational, eight coefficients.
    Rational,
    /// Kannala-Brandt.
    Equidistant,
    /// Double sphere.
    Ds,
    /// Extended unified.
    Eucm,
    /// Omnidirectional, five coefficients.
    Omni,
    /// Field of view.
    Fov,
}

impl KernelName {
    /// All kernels.
    pub const ALL: [Self; 5] = [Self::Project, Self::Unproject, Self::Track, Self::Zmap, Self::Ply];

    /// The name in options and documents.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Project => "project",
            Self::Unproject => "unproject",
            Self::Track => "track",
            Self::Zmap => "zmap",
            Self::Ply => "ply",
        }
    }

    /// What it does, in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Project => "Points of the camera frame to pixels",
            Self::Unproject => "Pixels to rays, solved to 1e-10",
            Self::Track => "Equation 1: pixels with depth to pixels of another frame",
            Self::Zmap => "A scan to a whole depth image",
            Self::Ply => "A binary PLY file to points",
        }
    }
}

impl std::str::FromStr for KernelName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|k| k.name() == text).ok_or_else(|| format!("no kernel {text}"))
    }
}

impl ModelName {
    /// All models.
    pub const ALL: [Self; 8] = [
        Self::Pinhole,
        Self::Radtan,
        Self::Rational,
        Self::Equidistant,
        Self::Ds,
        Self::Eucm,
        Self::Omni,
        Self::Fov,
    ];

    /// The name in options and documents.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Radtan => "radtan",
            Self::Rational => "rational",
            Self::Equidistant => "equidistant",
            Self::Ds => "ds",
            Self::Eucm => "eucm",
            Self::Omni => "omni",
            Self::Fov => "fov",
        }
    }
}

impl std::str::FromStr for ModelName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|m| m.name() == text).ok_or_else(|| format!("no model {text}"))
    }
}

/// The document.
#[derive(Debug, Serialize)]
pub struct BenchDocument {
    /// The measurements.
    pub results: Vec<Measurement>,
    /// What the machine could do, by number of threads.
    pub machine: Vec<Machine>,
}

/// One measurement.
#[derive(Debug, Serialize)]
pub struct Measurement {
    /// What was measured.
    pub kernel: KernelName,
    /// Null where no camera takes part.
    pub model: Option<ModelName>,
    /// Number of points.
    pub points: u64,
    /// Number of threads.
    pub threads: usize,
    /// Points a second, best of many rounds.
    pub points_per_second: f64,
    /// The time of what limits, measured in the same rounds, over that of the kernel; the least of each.
    pub fraction_of_limit: f64,
    /// What limits: copying as many bytes (`memory`), or reading those of the file.
    pub limit: &'static str,
}

/// What is measured, and how.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// The kernels; empty: project, unproject and track.
    pub kernels: Vec<KernelName>,
    /// Number of points.
    pub points: usize,
    /// Camera model; `None`: all that apply.
    pub model: Option<ModelName>,
    /// Number of threads; `None`: one, and all there are.
    pub threads: Option<usize>,
}

/// Measures.
///
/// # Errors
/// [`RunError`] if the threads cannot be started or a file cannot be made.
pub fn measure(options: &BenchOptions, progress: &Progress<'_>) -> RunResult<BenchDocument> {
    let kernels = match options.kernels.is_empty() {
        true => vec![KernelName::Project, KernelName::Unproject, KernelName::Track],
        false => options.kernels.clone(),
    };
    let threads = match options.threads {
        Some(threads) => vec![threads],
        None => {
            let all = std::thread::available_parallelism().map_or(1, usize::from);
            if all > 1 { vec![1, all] } else { vec![1] }
        }
    };
    let pools: Vec<rayon::ThreadPool> = threads
        .iter()
        .map(|n| rayon::ThreadPoolBuilder::new().num_threads(*n).build())
        .collect::<Result<_, _>>()
        .map_err(|e| RunError::usage("threads", "cannot be started").because(e))?;
    let mut document = BenchDocument { results: Vec::new(), machine: Vec::new() };
    for pool in &pools {
        document.machine.push(pool.install(Machine::measure));
    }
    let work: Vec<_> =
        kernels.iter().flat_map(|k| models(*k, options.model).into_iter().map(move |m| (*k, m))).collect();
    for (done, (kernel, model)) in work.iter().enumerate() {
        progress("measuring", done, work.len());
        let mut measured = Work::new(*kernel, *model, options.points)?;
        for pool in &pools {
            let best = pool.install(|| measured.measure())?;
            document.results.push(Measurement {
                kernel: *kernel,
                model: *model,
                points: options.points as u64,
                threads: pool.current_num_threads(),
                points_per_second: options.points as f64 / best.seconds,
                fraction_of_limit: best.limit_seconds / best.seconds,
                limit: best.limit,
            });
        }
    }
    progress("measuring", work.len(), work.len());
    Ok(document)
}

/// The models that a kernel is measured with. Reading a file knows no camera.
fn models(kernel: KernelName, asked: Option<ModelName>) -> Vec<Option<ModelName>> {
    match (kernel, asked) {
        (KernelName::Ply, _) => vec![None],
        (_, Some(model)) => vec![Some(model)],
        (KernelName::Zmap, None) => vec![Some(ModelName::Radtan)],
        (_, None) => ModelName::ALL.map(Some).into(),
    }
}

/// The results as a table.
pub fn render(document: &BenchDocument) -> String {
    let mut text = format!("instructions: {}\n", instruction_set());
    for m in &document.machine {
        text.push_str(&format!(
            "memcpy with {} thread{}: {:.1} GB/s (read and written)\n",
            m.threads,
            if m.threads == 1 { "" } else { "s" },
            m.memcpy_bytes_per_second / 1e9,
        ));
    }
    text.push('\n');
    let head =
        ["kernel", "model", "points", "threads", "million points/s", "ns a point", "of the limit", "limit"];
    let mut grid = vec![head.map(String::from).to_vec()];
    for r in &document.results {
        let name = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
        grid.push(vec![
            name(&r.kernel),
            r.model.map_or_else(|| "-".to_string(), |m| name(&m)),
            r.points.to_string(),
            r.threads.to_string(),
            format!("{:.1}", r.points_per_second / 1e6),
            format!("{:.3}", 1e9 / r.points_per_second),
            format!("{:.2}", r.fraction_of_limit),
            r.limit.to_string(),
        ]);
    }
    text.push_str(&table::align(&grid));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kernel_is_measured_against_a_limit() {
        for kernel in
            [KernelName::Project, KernelName::Unproject, KernelName::Track, KernelName::Zmap, KernelName::Ply]
        {
            for model in models(kernel, None) {
                let measured = Work::new(kernel, model, 500).unwrap().measure().unwrap();
                assert!(measured.seconds > 0.0 && measured.limit_seconds > 0.0, "{kernel:?} {model:?}");
            }
        }
    }
}
