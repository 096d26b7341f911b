//! Depth images registered to a camera: `depth0`.

use std::path::PathBuf;
use std::sync::OnceLock;

use vice_core::dataset::DepthImage;
use vice_core::error::DataResult;
use vice_core::statistics::middle;
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_files::once::cached;
use vice_files::{image_file, pairing};

use crate::listing::Listing;
use crate::sensor::{self, DepthFile};

/// Median depths, metres, that no scene of a robot has: counts of another worth than `metres_per_count` says.
const IMPLAUSIBLE_BELOW_M: f32 = 0.05;
const IMPLAUSIBLE_ABOVE_M: f32 = 100.0;

/// The folder of depth images, read as far as it was asked for.
#[derive(Debug)]
pub(crate) struct EurocDepth {
    folder: PathBuf,
    description: DepthFile,
    listing: OnceLock<Listing>,
    /// What the first image that was decoded looks like.
    doubt: OnceLock<Option<Suspicion>>,
}

impl EurocDepth {
    /// Reads the description; the list is read when it is needed.
    pub(crate) fn open(folder: PathBuf) -> DataResult<Self> {
        let description = sensor::depth(&folder)?;
        Ok(Self { folder, description, listing: OnceLock::new(), doubt: OnceLock::new() })
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
        let listing = self.listing()?;
        let Some(nearest) = pairing::belonging(frames, index, &listing.stamps) else { return Ok(None) };
        let path = listing.path(nearest)?;
        let bytes = image_file::read_bytes(&path)?;
        let scale = self.description.metres_per_count;
        let image =
            image_file::decode_depth_png(&bytes, listing.stamps[nearest], scale).map_err(|e| e.at(path))?;
        self.doubt.get_or_init(|| self.implausible(&image));
        Ok(Some(image))
    }

    /// What looks wrong in what was read so far.
    pub(crate) fn suspicions(&self) -> Vec<Suspicion> {
        let pictures = self.listing.get().and_then(|l| l.suspicion.clone());
        pictures.into_iter().chain(self.doubt.get().cloned().flatten()).collect()
    }

    fn implausible(&self, image: &DepthImage) -> Option<Suspicion> {
        let mut valid: Vec<f32> = image.z_m().iter().copied().filter(|z| !z.is_nan()).collect();
        let median = middle(&mut valid, f32::total_cmp)?;
        (!(IMPLAUSIBLE_BELOW_M..=IMPLAUSIBLE_ABOVE_M).contains(&median)).then(|| {
            let file = self.folder.join(sensor::SENSOR_FILE);
            Suspicion::new(
                "depth-scale",
                file.display().to_string(),
                "depths are not those of a robot's scene",
            )
            .evidence(format!(
                "half of an image is beyond {median:.3} m at metres_per_count = {}",
                self.description.metres_per_count
            ))
            .advice("millimetres are 0.001, and 5000 counts a metre 0.0002")
        })
    }

    fn listing(&self) -> DataResult<&Listing> {
        cached(&self.listing, || Listing::read(&self.folder))
    }
}
