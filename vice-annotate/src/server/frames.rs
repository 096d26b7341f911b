//! Images for the page: the stored file as it is where a browser can show it, else a PNG; kept within a bound of bytes.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex};

use axum::body::Bytes;
use tokio::sync::{OnceCell, Semaphore};
use vice_core::dataset::Dataset;
use vice_core::error::{DataError, DataResult};
use vice_files::image_file::encode_png;

use super::error::ApiError;
use crate::store::lock;

/// Bytes of images that are kept.
const CACHE_BYTES: usize = 192 << 20;
/// Images that are made at once.
const AT_ONCE: usize = 2;

/// An image as it goes to the browser.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    pub(super) bytes: Bytes,
    pub(super) content_type: &'static str,
}

/// The images of one camera.
pub(super) struct Frames {
    dataset: Arc<dyn Dataset>,
    camera: String,
    size: (u32, u32),
    cache: Mutex<Cache>,
    permits: Semaphore,
}

#[derive(Default)]
struct Cache {
    cells: BTreeMap<usize, Arc<OnceCell<Picture>>>,
    /// Frames, the one asked for last at the back.
    order: VecDeque<usize>,
}

impl Frames {
    pub(super) fn new(dataset: Arc<dyn Dataset>, camera: String, size: (u32, u32)) -> Self {
        Self { dataset, camera, size, cache: Mutex::default(), permits: Semaphore::new(AT_ONCE) }
    }

    /// The image of a frame; made once, however many ask for it.
    pub(super) async fn get(&self, frame: usize) -> Result<Picture, ApiError> {
        let cell = lock(&self.cache).cell(frame);
        let made = cell
            .get_or_try_init(|| async {
                let _permit = self.permits.acquire().await.map_err(ApiError::internal)?;
                let (dataset, camera, size) = (Arc::clone(&self.dataset), self.camera.clone(), self.size);
                tokio::task::spawn_blocking(move || picture(dataset.as_ref(), &camera, frame, size))
                    .await
                    .map_err(ApiError::internal)?
                    .map_err(ApiError::from)
            })
            .await;
        let made = made.cloned();
        lock(&self.cache).trim(made.is_err().then_some(frame));
        made
    }
}

impl Cache {
    fn cell(&mut self, frame: usize) -> Arc<OnceCell<Picture>> {
        self.order.retain(|f| *f != frame);
        self.order.push_back(frame);
        Arc::clone(self.cells.entry(frame).or_default())
    }

    /// Forgets what could not be made, and what was asked for longest ago until the rest is within the bound.
    fn trim(&mut self, failed: Option<usize>) {
        if let Some(frame) = failed {
            self.order.retain(|f| *f != frame);
            self.cells.remove(&frame);
        }
        let size = |cell: &Arc<OnceCell<Picture>>| cell.get().map_or(0, |p| p.bytes.len());
        let mut total: usize = self.cells.values().map(size).sum();
        while total > CACHE_BYTES && self.order.len() > 1 {
            let Some(oldest) = self.order.pop_front() else { return };
            total -= self.cells.remove(&oldest).as_ref().map_or(0, size);
        }
    }
}

fn picture(dataset: &dyn Dataset, camera: &str, frame: usize, size: (u32, u32)) -> DataResult<Picture> {
    if let Some(bytes) = dataset.image_file(camera, frame)?
        && let Some(content_type) = shown_as(&bytes, size)
    {
        return Ok(Picture { bytes: bytes.into(), content_type });
    }
    let image = dataset.image(camera, frame)?;
    if (image.width(), image.height()) != size {
        return Err(DataError::new(format!(
            "frame {frame} has {}x{} pixels, the camera {}x{}",
            image.width(),
            image.height(),
            size.0,
            size.1
        )));
    }
    Ok(Picture { bytes: encode_png(&image)?.into(), content_type: "image/png" })
}

/// The content type of a file that a browser shows pixel for pixel as it is decoded here; `None` for all others.
fn shown_as(bytes: &[u8], size: (u32, u32)) -> Option<&'static str> {
    if png_size(bytes) == Some(size) {
        Some("image/png")
    } else if jpeg_size(bytes) == Some(size) {
        Some("image/jpeg")
    } else {
        None
    }
}

/// Columns and rows of a PNG whose chunks are all there and whole, and that no metadata turns.
fn png_size(bytes: &[u8]) -> Option<(u32, u32)> {
    let number = |at: usize| Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let mut at = bytes.starts_with(b"\x89PNG\r\n\x1a\n").then_some(8)?;
    let size = (number(16)?, number(20)?);
    loop {
        let len = number(at)? as usize;
        let kind_and_data = bytes.get(at + 4..at.checked_add(8)?.checked_add(len)?)?;
        if number(at + 8 + len)? != crc32fast::hash(kind_and_data) {
            return None;
        }
        match kind_and_data.get(..4)? {
            b"IEND" => return Some(size),
            b"eXIf" | b"acTL" => return None,
            _ => at += 12 + len,
        }
    }
}

/// Columns and rows of a JPEG that is there to its end, and that no metadata turns.
fn jpeg_size(bytes: &[u8]) -> Option<(u32, u32)> {
    let mut at = (bytes.starts_with(b"\xff\xd8") && bytes.ends_with(b"\xff\xd9")).then_some(2)?;
    loop {
        let [0xff, kind] = *bytes.get(at..at + 2)? else { return None };
        let len = usize::from(u16::from_be_bytes(bytes.get(at + 2..at + 4)?.try_into().ok()?));
        let data = bytes.get(at + 4..at + 2 + len)?;
        match kind {
            // EXIF may say that the image is to be turned.
            0xe1 => return None,
            0xc0..=0xc2 => {
                let number =
                    |i: usize| Some(u32::from(u16::from_be_bytes(data.get(i..i + 2)?.try_into().ok()?)));
                return Some((number(3)?, number(1)?));
            }
            0xda | 0xd9 => return None,
            _ => at += 2 + len,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::dataset::{Image, PixelFormat};

    #[test]
    fn only_whole_files_of_the_right_size_pass() {
        let image = Image::new(7, 5, PixelFormat::Gray8, (0..35).collect()).unwrap();
        let png = encode_png(&image).unwrap();
        assert_eq!(shown_as(&png, (7, 5)), Some("image/png"));
        assert_eq!(shown_as(&png, (5, 7)), None);
        for cut in 0..png.len() {
            assert_eq!(shown_as(&png[..cut], (7, 5)), None, "cut at {cut}");
        }
        for at in 0..png.len() - 12 {
            let mut wrong = png.clone();
            wrong[at] ^= 1;
            assert_eq!(shown_as(&wrong, (7, 5)), None, "byte {at}");
        }
        let jpeg =
            b"\xff\xd8\xff\xc0\x00\x0b\x08\x00\x05\x00\x07\x01\x01\x11\x00\xff\xda\x00\x02\x11\xff\xd9";
        assert_eq!(shown_as(jpeg, (7, 5)), Some("image/jpeg"));
        assert_eq!(shown_as(&jpeg[..jpeg.len() - 1], (7, 5)), None);
        let turned = [&jpeg[..2], b"\xff\xe1\x00\x08Exif\0\0", &jpeg[2..]].concat();
        assert_eq!(shown_as(&turned, (7, 5)), None);
    }

    #[test]
    fn the_cache_forgets_what_was_asked_for_longest_ago() {
        let mut cache = Cache::default();
        let third = Bytes::from(vec![0_u8; CACHE_BYTES / 3]);
        for frame in [1, 2, 3, 1, 4] {
            let cell = cache.cell(frame);
            let _ = cell.set(Picture { bytes: third.clone(), content_type: "image/png" });
            cache.trim(None);
        }
        assert_eq!(cache.cells.keys().copied().collect::<Vec<_>>(), [1, 3, 4]);
        cache.trim(Some(3));
        assert_eq!(cache.order, [1, 4]);
    }
}
