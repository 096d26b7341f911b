//! What an address names, as a path of this machine.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use futures_util::StreamExt;
use object_store::{ObjectMeta, ObjectStoreExt as _, path};
use sha2::{Digest, Sha256};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_files::elsewhere::{self, Elsewhere, Ranged};
use vice_files::paths::safe_join;

use crate::client::Client;
use crate::failure::Failure;
use crate::limits::cache_folder;
use crate::object::{Object, Version, tried};
use crate::source::Source;
use crate::stage;
use crate::waiting::wait;

/// Objects of a folder beyond which it is no data set.
const MAX_OBJECTS: usize = 200_000;
/// Recordings, which are read by ranges.
const RECORDINGS: [&str; 2] = ["bag", "mcap"];
/// What such files start with, where their names do not say it.
const MAGICS: [&[u8]; 2] = [b"#ROSBAG V", b"\x89MCAP0\r\n"];
/// Pictures, which are fetched one by one where they are asked for.
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];
/// Films, of which the index is read by ranges, and all where a picture is asked for.
const FILMS: [&str; 3] = ["mov", "mp4", "m4v"];
/// A file of a data set that lies above its folder, where several share it, and how far above.
const ABOVE: (&str, usize) = ("trajectoryOffsets.yaml", 4);

/// What stands here for a data set or file that lies elsewhere, as long as this is kept.
pub struct Staged {
    path: PathBuf,
    shown: String,
    _files: Option<Arc<dyn Elsewhere>>,
}

impl Staged {
    /// The path by which it is read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its address without secrets.
    pub fn shown(&self) -> &str {
        &self.shown
    }
}

/// What tells one content of an address from another, found without reading it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// A hash of the address and of what the server says of each file.
    pub hash: String,
    /// Whether the server says more than sizes.
    pub certain: bool,
}

/// A data set: recordings and pictures in it are read where they lie, everything else is staged.
///
/// # Errors
/// [`DataError`] if there is nothing of this address, it cannot be fetched, or is too large to be staged.
pub fn data_set(address: &str) -> DataResult<Staged> {
    let found = found(address)?;
    let shown = found.shown.clone();
    let root = found.root()?;
    let (mut whole, mut elsewhere) = (Vec::new(), BTreeMap::new());
    for (name, object) in found.objects {
        let place = root.join(&name);
        if object.ranges
            && (has_ending(&name, &[&RECORDINGS[..], &PICTURES, &FILMS]) || is_recording(&object)?)
        {
            stage::stand_in(&place)?;
            elsewhere.insert(place, object);
        } else {
            whole.push((object, place));
        }
    }
    let bytes = whole.iter().filter(|(o, p)| !stage::is_there(o, p)).map(|(o, _)| o.version.size).sum();
    if let Some((object, _)) = whole.first() {
        stage::check_limit(bytes, object.client.limits, &shown)?;
    }
    wait(stage::fetch(whole))?;
    let files = Files { objects: elsewhere, opened: Mutex::default() };
    let files = elsewhere::mount(&root, Arc::new(files));
    Ok(Staged { path: root.join(found.place), shown, _files: Some(files) })
}

/// One file, staged.
///
/// # Errors
/// [`DataError`] if there is no such file, it cannot be fetched, or is too large to be staged.
pub fn file(address: &str) -> DataResult<Staged> {
    let client = Client::new(address)?;
    let shown = client.shown.clone();
    let object = wait(Object::at(client))?;
    stage::check_limit(object.version.size, object.client.limits, &shown)?;
    let found = Found::one(object);
    let (place, path) = (found.root()?.join(&found.place), found.objects);
    wait(stage::fetch(path.into_values().map(|object| (object, place.clone())).collect()))?;
    Ok(Staged { path: place, shown, _files: None })
}

/// What tells the content of an address from others.
///
/// # Errors
/// [`DataError`] of the kind missing if there is nothing of this address, or as [`data_set`].
pub fn identity(address: &str) -> DataResult<Identity> {
    let found = found(address)?;
    Ok(Identity { hash: found.hash(), certain: found.is_certain() })
}

/// The objects of an address.
struct Found {
    shown: String,
    /// Where the data set lies below the root of the cache, as the address has it.
    place: PathBuf,
    /// By their paths below the root.
    objects: BTreeMap<PathBuf, Object>,
}

fn found(address: &str) -> DataResult<Found> {
    let client = Client::new(address)?;
    wait(async move {
        let is_folder = client.shown.ends_with('/') || client.path.as_ref().is_empty();
        if !client.lists && client.shown.ends_with('/') {
            let problem = "a web server does not say what is in a folder";
            return Err(DataError::of_kind(ErrorKind::Unsupported, problem)
                .at(&client.shown)
                .hint("name a recording, or a folder in a bucket by `s3://` or `gs://`"));
        }
        if !client.lists || !is_folder {
            match Object::at(client.clone()).await {
                Ok(object) => return Ok(Found::one(object)),
                Err(e)
                    if client.lists && e.kind() == ErrorKind::Missing && e.problem() == "no such object" => {}
                Err(e) => return Err(e),
            }
        }
        listed(client).await
    })
}

async fn listed(client: Client) -> DataResult<Found> {
    let shown = client.shown.trim_end_matches('/').to_string();
    let prefix = Some(client.path.clone()).filter(|p| !p.as_ref().is_empty());
    let metas: Vec<ObjectMeta> = tried(&client, &shown, || async {
        let mut list = client.store.list(prefix.as_ref());
        let mut metas = Vec::new();
        while let Some(meta) = list.next().await {
            metas.push(meta?);
            if metas.len() > MAX_OBJECTS {
                break;
            }
        }
        Ok(metas)
    })
    .await?;
    if metas.len() > MAX_OBJECTS {
        let problem = format!("has more than {MAX_OBJECTS} files");
        return Err(DataError::of_kind(ErrorKind::Unsupported, problem)
            .at(&shown)
            .hint("name one data set in it"));
    }
    let place = place_of(&shown);
    let mut objects = BTreeMap::new();
    for meta in metas.iter().filter(|m| m.location != client.path) {
        let below: Vec<String> = match meta.location.prefix_match(&client.path) {
            Some(parts) => parts.map(|part| part.as_ref().to_string()).collect(),
            None => continue,
        };
        let name = below.join("/");
        let object = Object {
            client: client.clone(),
            path: meta.location.clone(),
            shown: format!("{shown}/{name}"),
            version: Version::of(meta),
            ranges: true,
        };
        objects.insert(safe_join(&place, &name).map_err(|e| e.at(&object.shown))?, object);
    }
    if objects.is_empty() {
        return Err(DataError::of_kind(ErrorKind::Missing, "no such object, and none below it").at(&shown));
    }
    objects.extend(above(&client, &shown, &place).await?);
    Ok(Found { shown, place, objects })
}

/// The file above a data set that belongs to it, where there is one.
async fn above(client: &Client, shown: &str, place: &Path) -> DataResult<Option<(PathBuf, Object)>> {
    let parts: Vec<_> = client.path.parts().collect();
    for up in 1..=ABOVE.1.min(parts.len()) {
        let mut folder = path::Path::from_iter(parts[..parts.len() - up].iter().cloned());
        folder = folder.join(ABOVE.0);
        let at = format!("{}/{}", shown.rsplitn(up + 1, '/').last().unwrap_or_default(), ABOVE.0);
        let meta = tried(client, &at, || async {
            match client.store.head(&folder).await.map_err(Failure::from) {
                Ok(meta) => Ok(Some(meta)),
                Err(Failure::Missing | Failure::Denied) => Ok(None),
                Err(failure) => Err(failure),
            }
        });
        if let (Some(meta), Some(beside)) = (meta.await?, place.ancestors().nth(up)) {
            let (version, client) = (Version::of(&meta), client.clone());
            let object = Object { client, path: folder, shown: at, version, ranges: true };
            return Ok(Some((beside.join(ABOVE.0), object)));
        }
    }
    Ok(None)
}

/// An address as a relative path, which keeps the names that readers look at.
fn place_of(shown: &str) -> PathBuf {
    let (_, rest) = shown.split_once("://").unwrap_or(("", shown));
    let plain = |part: &str| part.replace(['\\', ':', '\0'], "_");
    rest.split('/').filter(|p| !p.is_empty() && *p != "." && *p != "..").map(plain).collect()
}

impl Found {
    fn one(object: Object) -> Self {
        let (shown, place) = (object.shown.clone(), place_of(&object.shown));
        Self { shown, objects: BTreeMap::from([(place.clone(), object)]), place }
    }

    fn is_certain(&self) -> bool {
        self.objects.values().all(|o| o.version.is_certain())
    }

    fn hash(&self) -> String {
        let mut hasher = Sha256::new();
        hasher.update(format!("{}\n", self.shown));
        for (name, object) in &self.objects {
            hasher.update(format!("{}\0{}\n", name.to_string_lossy(), object.version.line()));
        }
        hasher.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }

    /// The folder of the cache for exactly this content; one of its own for each time where nothing tells contents apart.
    fn root(&self) -> DataResult<PathBuf> {
        static TIMES: AtomicU64 = AtomicU64::new(0);
        let hash = &self.hash()[..16];
        let name = match self.is_certain() {
            true => hash.to_string(),
            false => {
                let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
                format!("{hash}-{now}-{}-{}", std::process::id(), TIMES.fetch_add(1, Ordering::SeqCst))
            }
        };
        let root = cache_folder()?.join(name);
        let failed =
            |e: std::io::Error| DataError::new("the cache folder cannot be made").at(&root).because(e);
        std::fs::create_dir_all(&root).map_err(failed)?;
        root.canonicalize().map_err(failed)
    }
}

fn has_ending(name: &Path, endings: &[&[&str]]) -> bool {
    let ending = name.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    endings.iter().any(|some| some.contains(&ending.as_str()))
}

/// Whether an object without a telling name is a recording, by its first bytes.
fn is_recording(object: &Object) -> DataResult<bool> {
    let longest = MAGICS.iter().map(|m| m.len()).max().unwrap_or_default() as u64;
    if object.client.lists || object.version.size < longest || Path::new(&object.shown).extension().is_some()
    {
        return Ok(false);
    }
    let object = object.clone();
    let head = wait(async move { object.part(0..longest).await })?;
    Ok(MAGICS.iter().any(|magic| head.starts_with(magic)))
}

/// The files of a data set that were not staged.
struct Files {
    objects: BTreeMap<PathBuf, Object>,
    /// Recordings that are open, so that what was fetched of them is not fetched again.
    opened: Mutex<BTreeMap<PathBuf, Arc<Source>>>,
}

impl Elsewhere for Files {
    fn open(&self, path: &Path) -> DataResult<Option<Arc<dyn Ranged>>> {
        let Some(object) = self.objects.get(path).filter(|o| !stage::is_there(o, path)) else {
            return Ok(None);
        };
        if has_ending(path, &[&PICTURES]) {
            return Ok(Some(Arc::new(Source::new(object.clone()))));
        }
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        let source =
            opened.entry(path.to_path_buf()).or_insert_with(|| Arc::new(Source::new(object.clone())));
        Ok(Some(Arc::clone(source) as Arc<dyn Ranged>))
    }

    fn bring(&self, path: &Path) -> DataResult<()> {
        let Some(object) = self.objects.get(path).filter(|o| !stage::is_there(o, path)) else {
            return Ok(());
        };
        stage::check_limit(object.version.size, object.client.limits, &object.shown)?;
        let job = vec![(object.clone(), path.to_path_buf())];
        wait(stage::fetch(job))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_becomes_a_path_that_stays_below() {
        assert_eq!(place_of("s3://b/a/flight.mcap"), Path::new("b/a/flight.mcap"));
        assert_eq!(place_of("http://127.0.0.1:80/../x/./y"), Path::new("127.0.0.1_80/x/y"));
    }

    #[test]
    fn recordings_and_pictures_are_known_by_their_names() {
        assert!(has_ending(Path::new("a/b.MCAP"), &[&RECORDINGS, &PICTURES]));
        assert!(!has_ending(Path::new("a/b.mcap.zst"), &[&RECORDINGS, &PICTURES]));
    }
}
