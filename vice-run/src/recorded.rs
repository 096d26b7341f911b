//! Poses out of recordings, by what a person types: `V1_01_easy`, `run.bag:/odom`, `run.bag:/tf:map.base_link`.

use std::path::{Path, PathBuf};

use vice_core::dataset::{Dataset, GROUND_TRUTH};
use vice_core::suspicion::Suspicions;
use vice_core::trajectory::Trajectory;
use vice_files::address::is_address;

use crate::error::{RunError, RunResult};
use crate::formats;
use crate::request::{DatasetSpec, EstimateSpec, PluginsSpec};

/// Starts the name of a stream that is read from tf: `/tf:map.base_link`.
const TF: &str = "/tf:";

/// A stream of a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Recorded {
    pub(crate) data_set: PathBuf,
    /// `None`: the ground truth, or the only stream there is.
    stream: Option<String>,
}

impl Recorded {
    /// What a name means: a data set, or a stream of one behind a colon. `None` where it is a file of poses, or nothing.
    ///
    /// # Errors
    /// [`RunError`] if formats cannot be loaded.
    pub(crate) fn of(spec: &EstimateSpec) -> RunResult<Option<Self>> {
        let EstimateSpec::Named(name) = spec else { return Ok(None) };
        if is_address(Path::new(name)) {
            return Ok(None);
        }
        let whole = Path::new(name);
        if whole.exists() {
            let known = formats::registry(&PluginsSpec::default())?.detect(whole).is_ok();
            return Ok(known.then(|| Self { data_set: whole.to_path_buf(), stream: None }));
        }
        // The name of a stream may have colons in it; that of the data set ends at the first after which it is there.
        let cuts = name.match_indices(':').map(|(at, _)| name.split_at(at));
        let mut there = cuts.filter(|(before, _)| !before.is_empty() && Path::new(before).exists());
        Ok(there.next().map(|(before, after)| Self {
            data_set: PathBuf::from(before),
            stream: Some(after[1..].to_string()),
        }))
    }

    /// The poses, and what looked wrong when they were read.
    ///
    /// # Errors
    /// [`RunError`] if there is no such stream, or none is named and several could be meant.
    pub(crate) fn read(&self) -> RunResult<(Trajectory, Suspicions)> {
        let mut spec = DatasetSpec { path: self.data_set.clone(), ..DatasetSpec::default() };
        let mut stream = self.stream.clone();
        if let Some(frames) = stream.as_deref().and_then(|s| s.strip_prefix(TF)) {
            let (parent, child) = frames.split_once('.').ok_or_else(|| {
                RunError::usage("estimate", format!("{TF}{frames} names no two frames"))
                    .advise("as /tf:map.base_link: the poses of base_link in map")
            })?;
            spec.set.insert("map_frame".to_string(), parent.to_string());
            spec.set.insert("base_frame".to_string(), child.to_string());
            stream = Some("slam".to_string());
        }
        let dataset = spec.open_raw(&formats::registry(&spec.plugins)?)?;
        let name = match stream {
            Some(name) => name,
            None => only_stream(dataset.as_ref(), &self.data_set)?,
        };
        let trajectory = dataset.trajectory(&name)?;
        Ok((trajectory, dataset.suspicions().into_iter().collect()))
    }
}

/// The stream that is meant where none is named: the ground truth, or the only one there is.
///
/// # Errors
/// [`RunError`] of the kind usage that lists them.
pub(crate) fn only_stream(dataset: &dyn Dataset, shown: &Path) -> RunResult<String> {
    let streams = dataset.streams();
    if streams.iter().any(|s| s == GROUND_TRUTH) {
        return Ok(GROUND_TRUTH.to_string());
    }
    match streams.as_slice() {
        [only] => Ok(only.clone()),
        [] => Err(RunError::missing(format!("{}: the data set has no pose stream", shown.display()))),
        several => Err(RunError::usage(
            "stream",
            format!("{} has several pose streams: {}", shown.display(), several.join(", ")),
        )
        .advise(format!("name one, as {}:{}", shown.display(), several[0]))),
    }
}
