//! Depth images registered to a camera: `depth0`.

use std::path::PathBuf;
use std::sync::OnceLock;

use vice_core::dataset::DepthImage;
use vice_core::error::DataResult;
use vice_core::time::{Span, Stamp};
use vice_files::image_file;

use crate::camera::cached;
use crate::listing::Listing;
use crate::sensor::{self, DepthFile};

/// The folder of depth images, read as far as it was asked for.
#[derive(Debug)]
pub(crate) struct EurocDepth {
    folder: PathBuf,
    description: DepthFile,
    listing: OnceLock<Listing>,
}

impl EurocDepth {
    /// Reads the description; the list is read when it is needed.
    pub(crate) fn open(folder: PathBuf) -> DataResult<Self> {
        let description = sensor::depth(&folder)?;
        Ok(Self { folder, description, listing: OnceLock::new() })
    }

    /// The camera that the depths belong to.
    pub(crate) fn camera(&self) -> &str {
        &self.description.registered_to
    }

    /// Number of depth images.
    pub(crate) fn count(&self) -> DataResult<usize> {
        Ok(self.listing()?.stamps.len())
    }

    /// The depth image nearest to a frame, if it is not nearer to another one.
    pub(crate) fn at(&self, frames: &[Stamp], index: usize) -> DataResult<Option<DepthImage>> {
        let (listing, stamp) = (self.listing()?, frames[index]);
        let Some(nearest) = nearest(&listing.stamps, stamp) else { return Ok(None) };
        let away = listing.stamps[nearest].since(stamp).abs();
        if away.as_nanos() > half_period(frames, index).as_nanos() {
            return Ok(None);
        }
        let path = listing.path(nearest)?;
        let bytes = image_file::read_bytes(&path)?;
        image_file::decode_depth_png(&bytes, listing.stamps[nearest], self.description.metres_per_count)
            .map(Some)
            .map_err(|e| e.at(path))
    }

    fn listing(&self) -> DataResult<&Listing> {
        cached(&self.listing, || Listing::read(&self.folder))
    }
}

/// Half the time to the nearer neighbour of a frame; a lone frame takes only its own stamp.
fn half_period(frames: &[Stamp], index: usize) -> Span {
    let before = index.checked_sub(1).map(|i| frames[index].since(frames[i]));
    let after = frames.get(index + 1).map(|next| next.since(frames[index]));
    let nearer = before.into_iter().chain(after).min().unwrap_or(Span::ZERO);
    Span::from_nanos(nearer.as_nanos() / 2)
}

fn nearest(stamps: &[Stamp], stamp: Stamp) -> Option<usize> {
    let after = stamps.partition_point(|s| *s < stamp);
    let candidates = [after.checked_sub(1), (after < stamps.len()).then_some(after)];
    candidates.into_iter().flatten().min_by_key(|i| stamps[*i].since(stamp).abs())
}
