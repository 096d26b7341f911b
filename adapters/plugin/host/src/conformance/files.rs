//! Images as they are stored.

use vice_core::dataset::{Dataset, Image, PixelFormat};
use vice_core::error::one_line;
use vice_files::image_file;

use super::{CameraLists, Check, spread};

/// Files that are decoded of each camera.
const FILES: usize = 16;

/// Mean difference of two pictures, gray levels, beyond which they are not the same: decoders of JPEG differ by less.
const SAME_LEVELS: f64 = 4.0;

impl Check<'_> {
    pub(super) fn stored_images(&mut self, dataset: &dyn Dataset, lists: &CameraLists) {
        let (name, count) = (&lists.name, lists.frames.len());
        let mut found = 0_usize;
        let places = spread(count, self.thorough.images.min(FILES));
        for place in &places {
            self.step(format!("stored image {place} of camera {name}"));
            match dataset.image_file(name, *place) {
                Ok(Some(file)) => {
                    found += 1;
                    let image = dataset.image(name, *place).ok();
                    if let Some(wrong) = differs(&file, image.as_ref()) {
                        self.fault(format!("stored image {place} of camera {name}: {wrong}"));
                        return;
                    }
                }
                Ok(None) => {}
                Err(error) => {
                    self.error(&format!("stored image {place} of camera {name}"), &error);
                    return;
                }
            }
        }
        match found {
            0 => self.missing(format!(
                "camera {name}: no image is given as a stored PNG or JPEG; `vice annotate` encodes each that it shows"
            )),
            _ => self.good(format!(
                "camera {name}: {found} of {} images are given as they are stored, and show the same",
                places.len()
            )),
        }
        self.step(format!("stored image of camera {name} beyond the last"));
        for place in [count, usize::MAX] {
            if matches!(dataset.image_file(name, place), Ok(Some(_))) {
                self.fault(format!(
                    "stored image {place} of camera {name} is given, though there are {count} frames"
                ));
            }
        }
    }
}

/// What is wrong with a stored image beside the decoded one.
fn differs(file: &[u8], image: Option<&Image>) -> Option<String> {
    let shown = match image_file::decode(file) {
        Ok(shown) => shown,
        Err(error) => return Some(format!("it cannot be decoded: {}", one_line(&error))),
    };
    let image = image?;
    let size = |i: &Image| (i.width(), i.height());
    if size(&shown) != size(image) {
        let ((a, b), (c, d)) = (size(&shown), size(image));
        return Some(format!("it is {a}x{b}, but `image` gives {c}x{d}"));
    }
    let (one, two) = (gray(&shown), gray(image));
    let apart = one.zip(two).map(|(a, b)| f64::from(a.abs_diff(b))).sum::<f64>();
    let mean = apart / (f64::from(image.width()) * f64::from(image.height()));
    (mean > SAME_LEVELS).then(|| {
        format!("it differs from what `image` gives by {mean:.0} gray levels: labels would be set on another picture")
    })
}

/// Gray levels, near enough to compare.
fn gray(image: &Image) -> Box<dyn Iterator<Item = u8> + '_> {
    match image.format() {
        PixelFormat::Rgb8 => {
            let level = |p: &[u8]| (p.iter().map(|v| u32::from(*v)).sum::<u32>() / 3) as u8;
            Box::new(image.data().chunks_exact(3).map(level))
        }
        _ => Box::new(image.data().iter().copied()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(format: PixelFormat, level: u8) -> Image {
        Image::new(4, 2, format, vec![level; 8 * format.bytes()]).unwrap()
    }

    #[test]
    fn another_picture_is_told_from_another_decoder() {
        let stored = image_file::encode_png(&image(PixelFormat::Rgb8, 100)).unwrap();
        assert_eq!(differs(&stored, Some(&image(PixelFormat::Rgb8, 101))), None);
        assert_eq!(differs(&stored, Some(&image(PixelFormat::Gray8, 100))), None);
        assert_eq!(differs(&stored, None), None);
        assert!(differs(&stored, Some(&image(PixelFormat::Gray8, 160))).unwrap().contains("60 gray levels"));
        let other = Image::new(2, 4, PixelFormat::Gray8, vec![0; 8]).unwrap();
        assert!(differs(&stored, Some(&other)).unwrap().contains("4x2, but `image` gives 2x4"));
        assert!(differs(&stored[..20], None).unwrap().contains("cannot be decoded"));
    }
}
