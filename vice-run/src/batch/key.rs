//! The key of a run: what it would find is the same where the key is.

use std::fmt;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::content::Hashes;
use super::paths;
use crate::error::RunResult;
use crate::request::Request;
use crate::text::hex;

/// What a run is filed under: a hash of the version, the request as the manifest has it, and the content of what is
/// read. It ends in `-sampled` where a recording was too large to be hashed whole.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Key(String);

/// Part of the hash, so that a change of what is hashed changes all keys.
const SCHEME: &str = "vice.key/1";

/// Files of a data set that lie above a run's folder, where several runs share them, and how far above.
const ABOVE: (&str, usize) = ("trajectoryOffsets.yaml", 4);

impl Key {
    /// The key of a name that was read.
    pub(super) fn named(name: &str) -> Self {
        Self(name.to_string())
    }

    /// The key of a request whose paths are relative to `base`.
    ///
    /// # Errors
    /// [`RunError`](crate::error::RunError) if a file that is there cannot be read.
    pub fn of(request: &Request, base: &Path, hashes: &Hashes) -> RunResult<Self> {
        let resolved = paths::resolved(request, base);
        let mut hasher = Sha256::new();
        hasher.update(format!("{SCHEME}\n{}\n", env!("CARGO_PKG_VERSION")));
        hasher.update(serde_json::to_vec(request)?);
        let mut sampled = false;
        let mut read = vec![resolved.dataset.path.clone()];
        read.extend(paths::files(&resolved));
        read.extend(resolved.dataset.path.ancestors().skip(1).take(ABOVE.1).map(|f| f.join(ABOVE.0)));
        for path in read {
            let content = hashes.of(&path)?;
            sampled |= content.sampled;
            hasher.update(format!("\n{}", content.hash));
        }
        let hash = hex(&hasher.finalize()[..16]);
        Ok(Self(if sampled { format!("{hash}-sampled") } else { hash }))
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
