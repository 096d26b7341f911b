//! Scans that several runs share: a point cloud that was read and indexed is kept for the next run that asks for it.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use vice_core::dataset::{CloudRef, CloudSource};
use vice_core::error::DataResult;
use vice_depth::{Cloud, CloudOptions, load_cloud};

/// What makes two files the same scan; `None` where that is not known, and nothing is kept.
type Identity = dyn Fn(&Path) -> Option<String> + Send + Sync;

/// Where a scan is kept. It is locked while the scan is read, so that two runs do not read it at once.
type Slot = Arc<Mutex<Option<Arc<Cloud>>>>;

/// Scans that are kept, the latest last.
pub struct Scans {
    identity: Box<Identity>,
    most_bytes: usize,
    slots: Mutex<Vec<(Name, Slot)>>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Name {
    content: String,
    voxel_m: Option<u64>,
}

impl fmt::Debug for Scans {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scans").field("most_bytes", &self.most_bytes).finish_non_exhaustive()
    }
}

impl Scans {
    /// Keeps scans of up to `most_bytes` together. `identity` says what makes two files the same scan.
    pub fn new(
        most_bytes: usize,
        identity: impl Fn(&Path) -> Option<String> + Send + Sync + 'static,
    ) -> Self {
        Self { identity: Box::new(identity), most_bytes, slots: Mutex::default() }
    }

    /// The scan that a data set refers to, from before or read now.
    ///
    /// # Errors
    /// As [`load_cloud`].
    pub fn load(&self, cloud: &CloudRef, options: &CloudOptions) -> DataResult<Arc<Cloud>> {
        let content = match &cloud.source {
            CloudSource::File(path) => (self.identity)(path.as_path()),
            _ => None,
        };
        let Some(content) = content else { return load_cloud(cloud, options) };
        let name = Name { content, voxel_m: options.voxel_m.map(f64::to_bits) };
        let slot = self.slot(&name);
        let mut held = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(cloud) = &*held {
            return Ok(Arc::clone(cloud));
        }
        let found = load_cloud(cloud, options)?;
        *held = Some(Arc::clone(&found));
        drop(held);
        self.drop_oldest();
        Ok(found)
    }

    /// The place of a scan, which becomes the latest.
    fn slot(&self, name: &Name) -> Slot {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let slot = match slots.iter().position(|(n, _)| n == name) {
            Some(at) => slots.remove(at).1,
            None => Slot::default(),
        };
        slots.push((name.clone(), Arc::clone(&slot)));
        slot
    }

    /// Lets go of the oldest scans until the rest fits.
    fn drop_oldest(&self) {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let mut bytes = 0;
        let mut fits = Vec::new();
        for (name, slot) in slots.drain(..).rev() {
            // One that is being read now counts once it is there.
            let size = slot.try_lock().map_or(0, |held| held.as_ref().map_or(0, |cloud| cloud.bytes()));
            bytes += size;
            if bytes <= self.most_bytes {
                fits.push((name, slot));
            }
        }
        fits.reverse();
        *slots = fits;
    }
}

/// The path itself, size and time of the last change: what makes a file the same while a program runs.
pub fn unchanged_file(path: &Path) -> Option<String> {
    let real: PathBuf = path.canonicalize().ok()?;
    let meta = real.metadata().ok()?;
    Some(format!("{}\0{}\0{:?}", real.display(), meta.len(), meta.modified().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::frames::Rigid;

    fn cloud(path: &Path) -> CloudRef {
        CloudRef { source: CloudSource::File(path.to_path_buf()), world_from_cloud: Rigid::identity() }
    }

    fn ply(folder: &Path, name: &str, points: usize) -> PathBuf {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {points}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        );
        (0..points).for_each(|i| text.push_str(&format!("{i} 0 0\n")));
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    #[test]
    fn a_scan_is_read_once_while_it_fits() {
        let folder = tempfile::tempdir().unwrap();
        let (small, large) = (ply(folder.path(), "s.ply", 10), ply(folder.path(), "l.ply", 1000));
        let options = CloudOptions::default();
        let size = Cloud::read(&large, &options).unwrap().bytes();
        let scans = Scans::new(size, unchanged_file);
        let load = |path: &Path, options: &CloudOptions| scans.load(&cloud(path), options).unwrap();
        let first = load(&small, &options);
        assert!(Arc::ptr_eq(&first, &load(&small, &options)));
        let thinned = CloudOptions { voxel_m: Some(5.0), ..options };
        assert!(load(&small, &thinned).len() < first.len(), "thinned it is another scan");
        // Both together are too much: the older one goes.
        let second = load(&large, &options);
        assert!(Arc::ptr_eq(&second, &load(&large, &options)));
        assert!(!Arc::ptr_eq(&first, &load(&small, &options)));
        // A file that was changed is another.
        ply(folder.path(), "s.ply", 11);
        assert_eq!(load(&small, &options).len(), 11);
        let none = Scans::new(usize::MAX, |_| None);
        let twice = [0; 2].map(|_| none.load(&cloud(&small), &options).unwrap());
        assert!(!Arc::ptr_eq(&twice[0], &twice[1]));
    }
}
