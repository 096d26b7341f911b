//! One object: what it is, and parts of it, each request tried again within bounds.

use std::ops::Range;
use std::time::Duration;

use futures_util::StreamExt;
use object_store::path::Path;
use object_store::{GetOptions, ObjectMeta, ObjectStoreExt};
use vice_core::error::DataResult;

use crate::client::Client;
use crate::failure::Failure;

/// The first pause before a request is made again; each is twice as long as the one before, up to the longest.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// The status of an answer to who asks for what is behind the end.
const NOT_SATISFIABLE: &str = "416";
/// Bytes of one request.
pub(crate) const MAX_REQUEST_BYTES: u64 = 8 << 20;
/// Requests at a time.
pub(crate) const REQUESTS_AT_A_TIME: usize = 16;

/// What tells one content of an object from another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Version {
    pub(crate) size: u64,
    pub(crate) e_tag: Option<String>,
    pub(crate) version: Option<String>,
    /// Nanoseconds since 1970; `None` where the server does not say.
    pub(crate) modified: Option<i64>,
}

impl Version {
    pub(crate) fn of(meta: &ObjectMeta) -> Self {
        Self {
            size: meta.size,
            e_tag: meta.e_tag.clone(),
            version: meta.version.clone(),
            modified: meta.last_modified.timestamp_nanos_opt().filter(|t| *t > 0),
        }
    }

    /// Whether the same version is the same content: a size alone says nothing.
    pub(crate) const fn is_certain(&self) -> bool {
        self.e_tag.is_some() || self.version.is_some() || self.modified.is_some()
    }

    /// As one line.
    pub(crate) fn line(&self) -> String {
        // Where there is an ETag, a copy of the same content that is newer is the same.
        let modified = self.modified.filter(|_| self.e_tag.is_none());
        format!("{} {:?} {:?} {modified:?}", self.size, self.e_tag, self.version)
    }

    /// What differs in an answer, where something does.
    fn differs(&self, meta: &ObjectMeta) -> Option<String> {
        let now = Self::of(meta);
        if now.size != self.size {
            return Some(format!("it had {} bytes and has {}", self.size, now.size));
        }
        match (&self.e_tag, &now.e_tag) {
            (Some(then), Some(now)) if then != now => Some("its ETag is another".to_string()),
            (None, _)
                if self.modified.is_some() && now.modified.is_some() && now.modified != self.modified =>
            {
                Some("it was written again".to_string())
            }
            _ => None,
        }
    }
}

/// An object of a store.
#[derive(Clone)]
pub(crate) struct Object {
    pub(crate) client: Client,
    pub(crate) path: Path,
    pub(crate) shown: String,
    pub(crate) version: Version,
    /// Whether the store gives parts of it.
    pub(crate) ranges: bool,
}

impl Object {
    /// The object at the very place that a client is for.
    pub(crate) async fn at(client: Client) -> DataResult<Self> {
        let (meta, ranges) = tried(&client, &client.shown, || stat(&client, &client.path)).await?;
        let (path, shown) = (client.path.clone(), client.shown.clone());
        Ok(Self { client, path, shown, version: Version::of(&meta), ranges })
    }

    /// Bytes of a range, which is not empty and inside of the object.
    pub(crate) async fn part(&self, range: Range<u64>) -> DataResult<Vec<u8>> {
        tried(&self.client, &self.shown, || self.once(range.clone())).await
    }

    async fn once(&self, range: Range<u64>) -> Result<Vec<u8>, Failure> {
        let len = range.end - range.start;
        // A weak ETag never matches where bytes must be the same.
        let if_match = self.version.e_tag.clone().filter(|tag| !tag.starts_with("W/"));
        let options = GetOptions { range: Some(range.into()), if_match, ..GetOptions::default() };
        let got = match self.client.store.get_opts(&self.path, options).await {
            Ok(got) => got,
            Err(error) => return Err(self.explained(error.into()).await),
        };
        self.check(&got.meta)?;
        self.complete(got.bytes().await?.to_vec(), len)
    }

    /// A part that cannot be given may be one that the object has no more.
    async fn explained(&self, failure: Failure) -> Failure {
        let no_part = match &failure {
            Failure::NoRanges => true,
            Failure::Passing(words) => words.contains(NOT_SATISFIABLE),
            _ => false,
        };
        if no_part
            && let Ok((meta, _)) = stat(&self.client, &self.path).await
            && let Err(changed) = self.check(&meta)
        {
            return changed;
        }
        failure
    }

    /// Refuses an answer that is of another content.
    pub(crate) fn check(&self, meta: &ObjectMeta) -> Result<(), Failure> {
        self.version.differs(meta).map_or(Ok(()), |how| Err(Failure::Changed(how)))
    }

    fn complete(&self, bytes: Vec<u8>, len: u64) -> Result<Vec<u8>, Failure> {
        match bytes.len() as u64 == len {
            true => Ok(bytes),
            false => Err(Failure::Passing(format!("{} of {len} bytes came", bytes.len()))),
        }
    }

    /// Bytes of several ranges, in their order; several requests are on their way at a time.
    pub(crate) async fn parts(&self, ranges: Vec<Range<u64>>) -> DataResult<Vec<Vec<u8>>> {
        let requests = ranges.into_iter().map(|range| self.part(range));
        let mut stream = futures_util::stream::iter(requests).buffered(REQUESTS_AT_A_TIME);
        let mut parts = Vec::new();
        while let Some(part) = stream.next().await {
            parts.push(part?);
        }
        Ok(parts)
    }
}

/// What an object is, and whether the store gives parts of it. A web server is asked for the first byte: an address that
/// is signed is signed for reading only.
async fn stat(client: &Client, path: &Path) -> Result<(ObjectMeta, bool), Failure> {
    if client.lists {
        return Ok((client.store.head(path).await?, true));
    }
    let first = GetOptions { range: Some((0..1).into()), ..GetOptions::default() };
    match client.store.get_opts(path, first).await.map_err(Failure::from) {
        Ok(got) => Ok((got.meta, true)),
        // Of an empty file there is no first byte.
        Err(Failure::NoRanges) => Ok((client.store.get(path).await?.meta, false)),
        Err(Failure::Passing(words)) if words.contains(NOT_SATISFIABLE) => {
            Ok((client.store.get(path).await?.meta, false))
        }
        Err(failure) => Err(failure),
    }
}

/// Makes a request until it succeeds, cannot succeed, or was made as often as is allowed.
pub(crate) async fn tried<T, F>(client: &Client, shown: &str, request: impl Fn() -> F) -> DataResult<T>
where
    F: Future<Output = Result<T, Failure>>,
{
    let limits = client.limits;
    let mut tries = 0;
    let mut pause = FIRST_PAUSE;
    loop {
        tries += 1;
        let slow = || Failure::Passing(format!("no answer within {} s", limits.timeout.as_secs_f64()));
        let result = tokio::time::timeout(limits.timeout, request()).await.unwrap_or_else(|_| Err(slow()));
        match result {
            Ok(value) => return Ok(value),
            Err(failure) if failure.may_pass() && tries <= limits.retries => {
                tracing::debug!("{shown}: {failure:?}: tried again");
                tokio::time::sleep(pause).await;
                pause = (2 * pause).min(LONGEST_PAUSE);
            }
            Err(failure) => return Err(failure.error(shown, tries)),
        }
    }
}
