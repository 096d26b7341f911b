//! Plugins in a process of their own: a crash, a hang or an exit is an error of the data set that was being read, never the
//! end of the program, and memory, time and log have a limit.
//!
//! The program starts itself once more with a hidden command, which calls [`serve`]. Each data set has a process of its own.
//! What comes back is checked as what a plugin in the same process hands over: a plugin can write anything into the pipe.

mod calls;
mod codec;
mod dataset;
mod process;
mod serve;
mod values;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe};
use vice_core::error::DataResult;

use crate::LoadOptions;
use codec::{Carried, Reader, Writer};
use process::Process;

pub use process::{can_isolate, death, program_is};
pub use serve::serve;

/// Whether a plugin runs in a process of its own where nobody said so: one that lies outside of the user's own folders does,
/// which are the home folder and that of the user's plugins. What lies elsewhere was put there by a package, an
/// administrator, a colleague or a script.
pub fn isolated_by_default(path: &Path) -> bool {
    let Ok(real) = path.canonicalize() else { return true };
    let home = directories::BaseDirs::new().map(|dirs| dirs.home_dir().to_path_buf());
    let own = [home, crate::search::user_folder()].into_iter().flatten();
    !own.filter_map(|folder| folder.canonicalize().ok()).any(|folder| real.starts_with(folder))
}

/// A plugin that runs in processes of its own. Cheap to clone.
#[derive(Clone)]
pub struct IsolatedPlugin {
    shared: Arc<Shared>,
}

struct Shared {
    file: PathBuf,
    options: LoadOptions,
    hello: Hello,
    /// The process that looks at paths; started again where it ended.
    prober: Mutex<Option<Process>>,
}

/// What a plugin says of itself.
struct Hello {
    info: FormatInfo,
    path: PathBuf,
    complete_table: bool,
    thread_safe: bool,
    abi_version: u32,
}

impl Carried for Hello {
    fn put(&self, out: &mut Writer) {
        out.put(&self.info)
            .put(&self.path)
            .put(&[self.complete_table, self.thread_safe])
            .put(&self.abi_version);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, String> {
        let (info, path): (FormatInfo, PathBuf) = (from.get()?, from.get()?);
        let [complete_table, thread_safe] = from.get()?;
        let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c);
        if info.name.is_empty() || !info.name.chars().all(good) {
            return Err("its format has no name that can be used".to_string());
        }
        Ok(Self { info, path, complete_table, thread_safe, abi_version: from.get()? })
    }
}

fn started(file: &Path, options: &LoadOptions) -> DataResult<(Process, Hello)> {
    let process = Process::start(file, options)?;
    let mut request = Writer::default();
    request.put(&calls::HELLO);
    let hello = process.ask("loading the plugin in a process of its own", &request)?;
    Ok((process, hello))
}

impl IsolatedPlugin {
    /// Loads a library in a process of its own.
    ///
    /// # Errors
    /// As [`Plugin::load`](crate::Plugin::load), and where that process cannot be started, ends or does not answer.
    pub fn load(file: impl AsRef<Path>, options: &LoadOptions) -> DataResult<Self> {
        let file = file.as_ref();
        // Not found is told of the name that the user gave, without a process.
        crate::place::look(file)?;
        // As it was named: links on the way to it are looked at where it is loaded.
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
        let (process, hello) = started(&file, options)?;
        let prober = Mutex::new(Some(process));
        let shared = Shared { file, options: *options, hello, prober };
        Ok(Self { shared: Arc::new(shared) })
    }

    /// Where the library is, without links.
    pub fn path(&self) -> &Path {
        &self.shared.hello.path
    }

    /// What the format is.
    pub fn info(&self) -> &FormatInfo {
        &self.shared.hello.info
    }

    /// Whether the library says that its calls may overlap. Here they are made one after another all the same.
    pub fn thread_safe(&self) -> bool {
        self.shared.hello.thread_safe
    }

    /// Whether its table is that of this program's contract in full, or an older and shorter one.
    pub fn complete_table(&self) -> bool {
        self.shared.hello.complete_table
    }

    /// The version of the contract that it was built for.
    pub fn abi_version(&self) -> u32 {
        self.shared.hello.abi_version
    }

    fn ask_probe(&self, path: &Path) -> DataResult<Probe> {
        let mut prober = self.shared.prober.lock().unwrap_or_else(PoisonError::into_inner);
        let process = match prober.take() {
            Some(process) => process,
            None => started(&self.shared.file, &self.shared.options)?.0,
        };
        let mut request = Writer::default();
        request.put(&calls::PROBE).put(&path.to_path_buf());
        let answer = process.ask("probe", &request)?;
        *prober = Some(process);
        Ok(answer)
    }
}

impl DatasetFactory for IsolatedPlugin {
    fn info(&self) -> FormatInfo {
        Self::info(self).clone()
    }

    fn probe(&self, path: &Path) -> Probe {
        self.ask_probe(path).unwrap_or_else(|error| {
            tracing::warn!("asking plugin {} about {}: {error}", Self::info(self).name, path.display());
            Probe::No
        })
    }

    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        let (process, hello) = started(&self.shared.file, &self.shared.options)?;
        Ok(Box::new(dataset::IsolatedDataset::open(process, hello.info.name, path, options)?))
    }
}
