//! Loading a library, and the table it hands over.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use vice_abi::contract::{
    self, ABI_OLDEST, ABI_VERSION, CameraStampCall, Entry, FLAG_THREAD_SAFE, FreeCall, PluginTable, ProbeCall,
};
use vice_core::dataset::{FormatInfo, SettingInfo};
use vice_core::error::{DataError, DataResult, one_line};

use crate::border::{self, Fault};
use crate::host_log::Context;
use crate::{binary, place};

/// How a library is loaded.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions {
    /// Also from a file or folder that others may write to.
    pub allow_writable: bool,
}

/// A loaded plugin. Cheap to clone; its library stays loaded until the program ends.
#[derive(Clone, Debug)]
pub struct Plugin {
    library: Arc<Library>,
}

/// The table of a library, checked: required calls are there.
#[derive(Debug)]
pub(crate) struct Library {
    pub(crate) path: PathBuf,
    pub(crate) info: FormatInfo,
    pub(crate) calls: Calls,
    table_size: u32,
    abi_version: u32,
    /// Held during a call where calls must not overlap.
    turn: Option<Mutex<()>>,
}

/// The required calls; the optional ones are in `optional`.
#[derive(Debug)]
pub(crate) struct Calls {
    pub(crate) probe: ProbeCall,
    pub(crate) open: contract::OpenCall,
    pub(crate) close: FreeCall,
    pub(crate) release: FreeCall,
    pub(crate) describe: contract::Call<contract::DatasetInfo>,
    pub(crate) camera: contract::IndexCall<contract::Camera>,
    pub(crate) frames: contract::IndexCall<contract::Stamps>,
    pub(crate) image: contract::FrameCall<contract::Image>,
    pub(crate) body_from_camera: CameraStampCall<contract::Rigid>,
    pub(crate) trajectory: contract::IndexCall<contract::Poses>,
    pub(crate) optional: Optional,
}

/// The optional calls.
#[derive(Debug)]
pub(crate) struct Optional {
    pub(crate) relative_motions: Option<contract::IndexCall<contract::Motions>>,
    pub(crate) imu: Option<contract::Call<contract::ImuSamples>>,
    pub(crate) inertial_state: Option<contract::StampCall<contract::InertialState>>,
    pub(crate) depth_image: Option<contract::FrameCall<contract::DepthImage>>,
    pub(crate) cloud: Option<contract::Call<contract::Cloud>>,
    pub(crate) floor: Option<contract::StampCall<contract::Floor>>,
    pub(crate) facts: Option<contract::Call<contract::Facts>>,
    pub(crate) image_file: Option<contract::FrameCall<contract::ImageFile>>,
    pub(crate) suspicions: Option<contract::Call<contract::Suspicions>>,
    pub(crate) checks: Option<contract::Call<contract::Findings>>,
}

impl Plugin {
    /// Loads a library. This runs its code.
    ///
    /// # Errors
    /// [`DataError`] if there is no such file, strangers may write to it, it is no library for this machine, lacks the symbol, or its
    /// table is not one that this program can use.
    pub fn load(path: impl AsRef<Path>, options: &LoadOptions) -> DataResult<Self> {
        let place = place::look(path.as_ref())?;
        match place.refusal {
            Some(reason) if !options.allow_writable => {
                return Err(DataError::new(format!("not loaded: {reason}"))
                    .at(&place.path)
                    .hint("loading a plugin runs its code; `allow-writable-plugin` loads it all the same"));
            }
            Some(reason) => tracing::warn!("{reason}; loaded as --allow-writable-plugin asks"),
            None => {}
        }
        if let Some(warning) = place.warning {
            tracing::warn!("plugin: {warning}");
        }
        binary::check(&place.path)?;
        let bug =
            |fault: Fault| DataError::new(format!("is no plugin that can be used: {fault}")).at(&place.path);
        let context = Context::leaked(&place.path);
        let entry = entry(&place.path)?;
        // SAFETY: the contract of the symbol; the host's structure lives as long as the process.
        let table = unsafe { entry(context.host()) };
        let logged = context.loaded();
        if table.is_null() {
            return Err(match logged {
                Some(reason) => bug(format!("it hands over no table: {reason}")),
                None => bug("it hands over no table and does not say why".to_string()),
            });
        }
        // SAFETY: not null; the contract says that a table lives there.
        let table = unsafe { copy_table(table) }.map_err(bug)?;
        // SAFETY: what the table points at lives as long as the library.
        let info = unsafe { info(&table) }.map_err(bug)?;
        Ok(Self {
            library: Arc::new(Library {
                path: place.path.clone(),
                info,
                calls: calls(&table).map_err(bug)?,
                table_size: table.struct_size,
                abi_version: table.abi_version,
                turn: (table.flags & FLAG_THREAD_SAFE == 0).then(Mutex::default),
            }),
        })
    }

    /// Where the library is, without links.
    pub fn path(&self) -> &Path {
        &self.library.path
    }

    /// What the format is.
    pub fn info(&self) -> &FormatInfo {
        &self.library.info
    }

    /// Whether calls of it may overlap; they are made one after another otherwise.
    pub fn thread_safe(&self) -> bool {
        self.library.turn.is_none()
    }

    /// Whether its table is that of this program's contract in full, or an older and shorter one.
    pub fn complete_table(&self) -> bool {
        self.library.table_size as usize >= size_of::<PluginTable>()
    }

    /// The version of the contract that it was built for, at most [`ABI_VERSION`].
    pub fn abi_version(&self) -> u32 {
        self.library.abi_version
    }

    pub(crate) fn library(&self) -> &Arc<Library> {
        &self.library
    }
}

impl Library {
    /// Waits for other calls where they must not overlap.
    pub(crate) fn turn(&self) -> Option<MutexGuard<'_, ()>> {
        self.turn.as_ref().map(|turn| turn.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Frees what an answer points at. Within the turn of its call.
    pub(crate) fn release(&self, owner: *mut c_void) {
        if !owner.is_null() {
            // SAFETY: an owner that the plugin has just handed over, released once.
            unsafe { (self.calls.release)(owner) };
        }
    }
}

/// The entry of a library, which stays loaded.
fn entry(path: &Path) -> DataResult<Entry> {
    let failed = |e: libloading::Error| DataError::new("cannot be loaded").at(path).because(one_line(&e));
    // SAFETY: loading runs the library's initialisers: the user named it, or put it where plugins are.
    #[cfg(unix)]
    let library = unsafe {
        use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
        // At once, so that a missing symbol is an error here and not an abort later.
        Library::open(Some(path), RTLD_NOW | RTLD_LOCAL).map(libloading::Library::from)
    };
    // SAFETY: as above.
    #[cfg(not(unix))]
    let library = unsafe { libloading::Library::new(path) };
    let library = library.map_err(failed)?;
    // SAFETY: the contract says what the symbol is.
    let entry = unsafe { library.get::<Entry>(contract::ENTRY_SYMBOL) }.map(|symbol| *symbol);
    // Never unloaded: thread-locals and static variables of Rust and C++ are destroyed later than that.
    std::mem::forget(library);
    entry.map_err(|e| {
        DataError::new(format!("has no symbol {}", contract::ENTRY_SYMBOL))
            .at(path)
            .hint("is it a plugin of VICE? C++: VICE_PLUGIN(...), Rust: vice_abi::export_plugin!(...)")
            .because(one_line(&e))
    })
}

/// Copies as much of the table as the plugin says there is; what is beyond is zero, as if it were null.
///
/// # Safety
/// A table of the size that it states lives at `table`.
unsafe fn copy_table(table: *const PluginTable) -> Result<PluginTable, Fault> {
    if !table.is_aligned() {
        return Err("its table is not aligned".to_string());
    }
    let head = table.cast::<u32>();
    // SAFETY: version and size come first.
    let (version, size) = unsafe { (head.read(), head.add(1).read() as usize) };
    if !(ABI_OLDEST..=ABI_VERSION).contains(&version) {
        let what = if version > ABI_VERSION { "update VICE" } else { "rebuild the plugin" };
        return Err(format!(
            "it speaks version {version} of the contract, this program {ABI_OLDEST} to {ABI_VERSION}; {what}"
        ));
    }
    if size < PluginTable::REQUIRED_SIZE {
        return Err(format!(
            "its table has {size} bytes, but the required calls end at {}",
            PluginTable::REQUIRED_SIZE
        ));
    }
    if size % align_of::<PluginTable>() != 0 {
        return Err(format!("its table has {size} bytes, which ends within a field"));
    }
    // SAFETY: null pointers, zero lengths and absent calls are values of each field.
    let mut copy: PluginTable = unsafe { std::mem::zeroed() };
    let known = size.min(size_of::<PluginTable>());
    // SAFETY: the plugin says that so many bytes are there, and the copy has as many.
    unsafe {
        std::ptr::copy_nonoverlapping(table.cast::<u8>(), (&raw mut copy).cast::<u8>(), known);
    }
    Ok(copy)
}

/// # Safety
/// What the table points at is there.
unsafe fn info(table: &PluginTable) -> Result<FormatInfo, Fault> {
    // SAFETY: the caller's promise, for all of these.
    let (name, version, description, offers, settings) = unsafe {
        let offers = border::list(table.offers, table.offer_count, "offers")?;
        let settings = border::list(table.settings, table.setting_count, "settings")?;
        (
            border::name(table.name, "the format's name")?,
            border::name(table.version, "its version")?,
            border::name(table.description, "its description")?,
            offers.iter().map(|o| border::name(*o, "an offer")).collect::<Result<Vec<_>, _>>()?,
            settings
                .iter()
                .map(|s| {
                    Ok(SettingInfo {
                        key: border::name(s.key, "the key of a setting")?,
                        description: border::name(s.description, "the description of a setting")?,
                    })
                })
                .collect::<Result<Vec<_>, Fault>>()?,
        )
    };
    if !name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c)) {
        return Err(format!("the format's name `{name}` has other characters than a-z, 0-9, - and _"));
    }
    Ok(FormatInfo { name, description, version, offers, settings })
}

fn calls(table: &PluginTable) -> Result<Calls, Fault> {
    let missing = |call: &str| format!("the call `{call}` is null");
    Ok(Calls {
        probe: table.probe.ok_or_else(|| missing("probe"))?,
        open: table.open.ok_or_else(|| missing("open"))?,
        close: table.close.ok_or_else(|| missing("close"))?,
        release: table.release.ok_or_else(|| missing("release"))?,
        describe: table.describe.ok_or_else(|| missing("describe"))?,
        camera: table.camera.ok_or_else(|| missing("camera"))?,
        frames: table.frames.ok_or_else(|| missing("frames"))?,
        image: table.image.ok_or_else(|| missing("image"))?,
        body_from_camera: table.body_from_camera.ok_or_else(|| missing("body_from_camera"))?,
        trajectory: table.trajectory.ok_or_else(|| missing("trajectory"))?,
        optional: Optional {
            relative_motions: table.relative_motions,
            imu: table.imu,
            inertial_state: table.inertial_state,
            depth_image: table.depth_image,
            cloud: table.cloud,
            floor: table.floor,
            facts: table.facts,
            image_file: table.image_file,
            suspicions: table.suspicions,
            checks: table.checks,
        },
    })
}
