//! Where data is that a request names: a path of this machine, or an address such as `s3://bucket/flight.mcap`, which
//! only a build with the feature `remote` can read.

use std::borrow::Cow;
use std::path::Path;

use vice_core::error::DataResult;
use vice_files::address::is_address;

/// A file or data set as it is read here, as long as this is kept.
pub struct Place<'a> {
    path: Cow<'a, Path>,
    /// Its address without secrets, where it has one.
    shown: Option<String>,
    #[cfg(feature = "remote")]
    staged: Option<vice_remote::Staged>,
}

impl<'a> Place<'a> {
    /// A file; one that is named by an address is fetched, or found in the cache.
    ///
    /// # Errors
    /// [`DataError`](vice_core::error::DataError) if it cannot be fetched, or this build reads no addresses.
    pub fn of_file(path: &'a Path) -> DataResult<Self> {
        if is_address(path) { Self::fetched(path, false) } else { Ok(Self::here(path)) }
    }

    /// A data set; of one that is named by an address, what is small is fetched.
    ///
    /// # Errors
    /// As [`Place::of_file`].
    pub fn of_data_set(path: &'a Path) -> DataResult<Self> {
        if is_address(path) { Self::fetched(path, true) } else { Ok(Self::here(path)) }
    }

    /// The path by which it is read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The address in place of the path in an error.
    ///
    /// # Errors
    /// The error that is given.
    pub fn told<T>(&self, result: DataResult<T>) -> DataResult<T> {
        match &self.shown {
            Some(shown) => result.map_err(|e| e.renamed(&self.path, shown)),
            None => result,
        }
    }

    /// The address in place of the path in a text.
    pub fn in_words(&self, text: &str) -> String {
        match &self.shown {
            Some(shown) => text.replace(&*self.path.to_string_lossy(), shown),
            None => text.to_string(),
        }
    }

    /// Whether it was named by an address.
    pub const fn is_elsewhere(&self) -> bool {
        self.shown.is_some()
    }

    #[cfg(feature = "remote")]
    fn fetched(path: &'a Path, data_set: bool) -> DataResult<Self> {
        let address = path.to_string_lossy();
        let staged = if data_set { vice_remote::data_set(&address)? } else { vice_remote::file(&address)? };
        let (here, shown) = (staged.path().to_path_buf(), staged.shown().to_string());
        Ok(Self { path: Cow::Owned(here), shown: Some(shown), staged: Some(staged) })
    }

    #[cfg(feature = "remote")]
    const fn here(path: &'a Path) -> Self {
        Self { path: Cow::Borrowed(path), shown: None, staged: None }
    }

    #[cfg(not(feature = "remote"))]
    fn fetched(path: &'a Path, _: bool) -> DataResult<Self> {
        Err(no_addresses(path))
    }

    #[cfg(not(feature = "remote"))]
    const fn here(path: &'a Path) -> Self {
        Self { path: Cow::Borrowed(path), shown: None }
    }

    /// The same place, which may be kept longer than what named it.
    pub(crate) fn kept(self) -> Place<'static> {
        Place {
            path: Cow::Owned(self.path.into_owned()),
            shown: self.shown,
            #[cfg(feature = "remote")]
            staged: self.staged,
        }
    }
}

#[cfg(not(feature = "remote"))]
fn no_addresses(path: &Path) -> vice_core::error::DataError {
    use vice_core::error::{DataError, ErrorKind};
    let problem = "this build reads no data that is elsewhere";
    DataError::of_kind(ErrorKind::Unsupported, problem)
        .at(vice_files::address::shown_path(path))
        .hint("build it with `--features remote`, or fetch the data and name its path")
}

/// What tells the content of an address from others, found without reading it: a hash, and whether the server says more
/// than sizes. `None` where there is nothing.
///
/// # Errors
/// [`DataError`](vice_core::error::DataError) if the server cannot be asked, or this build reads no addresses.
#[cfg(feature = "remote")]
pub(crate) fn identity(path: &Path) -> DataResult<Option<(String, bool)>> {
    match vice_remote::identity(&path.to_string_lossy()) {
        Ok(identity) => Ok(Some((identity.hash, identity.certain))),
        Err(e) if e.problem().starts_with("no such object") => Ok(None),
        Err(e) => Err(e),
    }
}

/// As with the feature `remote`, without which there is none.
#[cfg(not(feature = "remote"))]
pub(crate) fn identity(path: &Path) -> DataResult<Option<(String, bool)>> {
    Err(no_addresses(path))
}

#[cfg(all(test, not(feature = "remote")))]
mod tests {
    use super::*;

    #[test]
    fn a_build_without_clients_says_so_and_gives_no_secret_away() {
        let error = Place::of_data_set(Path::new("https://me:word@h/a.mcap?sig=1")).err().unwrap();
        let line = error.to_string();
        assert!(line.starts_with("https://h/a.mcap: this build reads no data that is elsewhere"), "{line}");
        assert!(line.contains("--features remote"), "{line}");
        assert!(!Place::of_file(Path::new("a.csv")).unwrap().is_elsewhere());
    }
}
