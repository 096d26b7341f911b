//! The size of a PNG or JPEG by its first bytes, so that nothing has to be decoded to compare it with a calibration.

/// Columns and rows; `None` where the bytes are neither, or end before they say it.
pub(crate) fn image_size_px(bytes: &[u8]) -> Option<(u32, u32)> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        let word = |at: usize| bytes.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes);
        return Some((word(16)?, word(20)?)).filter(|(w, h)| *w > 0 && *h > 0);
    }
    if !bytes.starts_with(&[0xff, 0xd8]) {
        return None;
    }
    let short = |at: usize| bytes.get(at..at + 2)?.try_into().ok().map(u16::from_be_bytes);
    let mut at = 2;
    loop {
        let marker = match bytes.get(at..at + 2)? {
            // A marker may be preceded by any number of fill bytes.
            [0xff, 0xff] => {
                at += 1;
                continue;
            }
            [0xff, marker] => *marker,
            _ => return None,
        };
        match marker {
            // The start of a frame, of whatever process; C4, C8 and CC are tables and the like.
            0xc0..=0xcf if !matches!(marker, 0xc4 | 0xc8 | 0xcc) => {
                let (height, width) = (short(at + 5)?, short(at + 7)?);
                return Some((u32::from(width), u32::from(height))).filter(|(w, h)| *w > 0 && *h > 0);
            }
            // Without a length.
            0x01 | 0xd0..=0xd7 => at += 2,
            0xd8..=0xda => return None,
            _ => at += 2 + usize::from(short(at + 2)?),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vice_core::dataset::{Image, PixelFormat};
    use vice_files::image_file::{encode_jpeg, encode_png};

    #[test]
    fn png_and_jpeg_say_their_size() {
        let image = Image::new(70, 30, PixelFormat::Gray8, vec![9; 2100]).unwrap();
        assert_eq!(image_size_px(&encode_png(&image).unwrap()), Some((70, 30)));
        let jpeg = encode_jpeg(&image, 80).unwrap();
        assert_eq!(image_size_px(&jpeg), Some((70, 30)));
        // An application segment of 5000 bytes, as a camera writes one, with fill bytes before the next marker.
        let mut long = jpeg[..2].to_vec();
        long.extend([0xff, 0xe1, 0x13, 0x8a]);
        long.extend([0; 5000]);
        long.extend([0xff, 0xff]);
        long.extend(&jpeg[2..]);
        assert_eq!(image_size_px(&long), Some((70, 30)));
        assert_eq!(image_size_px(&long[..4000]), None, "cut off before its size");
        assert_eq!(image_size_px(b"GIF89a"), None);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(tail in prop::collection::vec(any::<u8>(), 0..64), png in any::<bool>()) {
            let head: &[u8] = if png { b"\x89PNG\r\n\x1a\n" } else { &[0xff, 0xd8, 0xff] };
            let _ = image_size_px(&[head, &tail].concat());
        }
    }
}
