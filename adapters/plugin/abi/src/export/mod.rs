//! A [`DatasetFactory`] as the table of a plugin.

mod calls;
mod failure;
mod guard;
mod log;
mod owned;
pub mod values;

use std::sync::OnceLock;

use vice_core::dataset::{DatasetFactory, FormatInfo};

use crate::contract::{ABI_VERSION, FLAG_THREAD_SAFE, Host, PluginTable, SettingInfo, Text};

/// Exports a format: the one line of a plugin written in Rust.
///
/// Takes an expression of a type that implements [`DatasetFactory`], and defines the symbol `vice_plugin`. Two of them in one
/// program do not link: keep adapters in plain libraries and export them from packages of their own.
#[macro_export]
macro_rules! export_plugin {
    ($factory:expr) => {
        const _: () = {
            /// The symbol that VICE looks for; see `vice_plugin.h`.
            ///
            /// # Safety
            /// `host` is null or points at a host that lives as long as the process.
            #[allow(unsafe_code)]
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn vice_plugin(
                host: *const $crate::contract::Host,
            ) -> *const $crate::contract::PluginTable {
                // SAFETY: the host's promise is passed on.
                unsafe { $crate::export::table(host, || ::std::boxed::Box::new($factory)) }
            }
        };
    };
}

/// The format of this library, and what its table points at.
struct Plugin {
    factory: Box<dyn DatasetFactory>,
    table: PluginTable,
    // Pointed at by the table.
    _info: FormatInfo,
    _offers: Vec<Text>,
    _settings: Vec<SettingInfo>,
}

// SAFETY: the pointers of the table go into `_info`, `_offers` and `_settings`, which nothing changes.
#[allow(unsafe_code)]
unsafe impl Send for Plugin {}
// SAFETY: as above.
#[allow(unsafe_code)]
unsafe impl Sync for Plugin {}

static PLUGIN: OnceLock<Option<Plugin>> = OnceLock::new();

/// The format of this library. Calls come after [`table`] made it.
fn factory() -> Option<&'static dyn DatasetFactory> {
    PLUGIN.get().and_then(Option::as_ref).map(|p| p.factory.as_ref())
}

/// What [`export_plugin`] calls: makes the table once. Null if the format panics while it is made.
///
/// # Safety
/// `host` is null or points at a host that lives as long as the process.
#[doc(hidden)]
#[allow(unsafe_code)]
pub unsafe fn table(host: *const Host, make: fn() -> Box<dyn DatasetFactory>) -> *const PluginTable {
    // SAFETY: the caller's promise.
    unsafe { log::install(host) };
    guard::install();
    let plugin = PLUGIN.get_or_init(|| match guard::caught(|| plugin(make())) {
        Ok(plugin) => Some(plugin),
        Err(panic) => {
            log::line(crate::contract::LOG_ERROR, &panic);
            None
        }
    });
    plugin.as_ref().map_or(std::ptr::null(), |p| &raw const p.table)
}

fn plugin(factory: Box<dyn DatasetFactory>) -> Plugin {
    let info = factory.info();
    let text = |s: &String| Text::from_bytes(s.as_bytes());
    let offers: Vec<Text> = info.offers.iter().map(text).collect();
    let settings: Vec<SettingInfo> = info
        .settings
        .iter()
        .map(|s| SettingInfo { key: text(&s.key), description: text(&s.description) })
        .collect();
    let table = PluginTable {
        abi_version: ABI_VERSION,
        struct_size: size_of::<PluginTable>() as u32,
        // `Dataset` and `DatasetFactory` are Sync.
        flags: FLAG_THREAD_SAFE,
        name: text(&info.name),
        version: text(&info.version),
        description: text(&info.description),
        offers: offers.as_ptr(),
        offer_count: offers.len(),
        settings: settings.as_ptr(),
        setting_count: settings.len(),
        probe: Some(calls::probe),
        open: Some(calls::open),
        close: Some(calls::close),
        release: Some(owned::release),
        describe: Some(calls::describe),
        camera: Some(calls::cameras::camera),
        frames: Some(calls::cameras::frames),
        image: Some(calls::cameras::image),
        body_from_camera: Some(calls::cameras::body_from_camera),
        trajectory: Some(calls::motion::trajectory),
        // Relative streams are `STREAM_CHAINED`: the core's trait hands over chained poses.
        relative_motions: None,
        imu: Some(calls::motion::imu),
        inertial_state: Some(calls::motion::inertial_state),
        depth_image: Some(calls::cameras::depth_image),
        cloud: Some(calls::scene::cloud),
        floor: Some(calls::scene::floor),
        facts: Some(calls::scene::facts),
        image_file: Some(calls::cameras::image_file),
        suspicions: Some(calls::scene::suspicions),
        checks: Some(calls::scene::checks),
    };
    // The strings and lists keep their place in memory when they are moved.
    Plugin { factory, table, _info: info, _offers: offers, _settings: settings }
}
