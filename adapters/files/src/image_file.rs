//! PNG and JPEG to pixels and back, with limits that are set before anything is decoded.

use std::fs::{self, File};
use std::io::{self, Cursor, Read};
use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::imageops::FilterType as Resampling;
use image::{
    DynamicImage, ExtendedColorType, GrayImage, ImageDecoder, ImageEncoder, ImageFormat, ImageReader, Limits,
    RgbImage,
};
use vice_core::budget::Budget;
use vice_core::dataset::{DepthImage, Image, PixelFormat};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::time::Stamp;

use crate::elsewhere;

/// Columns or rows beyond which a picture is refused.
pub const MAX_SIDE_PX: u32 = 32_768;
/// Bytes of pixels beyond which the decoder stops.
const MAX_DECODED_BYTES: u64 = 1 << 30;
/// Bytes of pixels that any file may claim, however small it is: 32 million coloured pixels.
const FREE_DECODED_BYTES: u64 = 96 << 20;
/// The same of a JPEG: one that is stored in several passes takes three times as much while it is decoded.
const FREE_JPEG_BYTES: u64 = 48 << 20;
/// Bytes of pixels for each byte of a larger file. Pictures of a camera are packed 2 to 30 times; only a bomb needs more.
const MAX_PACKING: u64 = 64;
/// Bytes beyond which a file is no picture of a camera: it is not even read.
const MAX_FILE_BYTES: u64 = 160 << 20;

/// Decodes a PNG or JPEG: gray stays gray, 16 bits a channel become 8 (the full range scaled), alpha is dropped.
///
/// # Errors
/// [`DataError`] if the bytes are no such image, are cut off, or claim to be larger than [`MAX_SIDE_PX`].
pub fn decode(bytes: &[u8]) -> DataResult<Image> {
    let image = decode_dynamic(bytes)?;
    let (width, height) = (image.width(), image.height());
    let (format, data) = match image {
        DynamicImage::ImageLuma8(gray) => (PixelFormat::Gray8, gray.into_raw()),
        DynamicImage::ImageRgb8(rgb) => (PixelFormat::Rgb8, rgb.into_raw()),
        gray @ (DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageLumaA16(_)) => (PixelFormat::Gray8, gray.into_luma8().into_raw()),
        colour => (PixelFormat::Rgb8, colour.into_rgb8().into_raw()),
    };
    Image::new(width, height, format, data)
}

/// Decodes an image file; see [`decode`].
///
/// # Errors
/// [`DataError`] with the path, as [`decode`], or if the file cannot be read.
pub fn read(path: impl AsRef<Path>) -> DataResult<Image> {
    let path = path.as_ref();
    decode(&read_picture(path)?).map_err(|e| e.at(path))
}

/// Decodes a 16 bit gray PNG of counts, each worth `metres_per_count`; 0 is no depth.
///
/// # Errors
/// [`DataError`] if the bytes are no such PNG or the scale is not positive.
pub fn decode_depth_png(bytes: &[u8], stamp: Stamp, metres_per_count: f64) -> DataResult<DepthImage> {
    check_scale(metres_per_count)?;
    let DynamicImage::ImageLuma16(counts) = decode_dynamic(bytes)? else {
        return Err(DataError::new("a depth image is a PNG with one channel of 16 bits, this is not one"));
    };
    let (width, height) = counts.dimensions();
    let z_m = counts.into_raw().into_iter().map(|c| (f64::from(c) * metres_per_count) as f32).collect();
    DepthImage::new(stamp, width, height, z_m)
}

/// Size of an image file, from its header only.
///
/// # Errors
/// [`DataError`] if the file cannot be read or is no PNG or JPEG.
pub fn dimensions(path: impl AsRef<Path>) -> DataResult<(u32, u32)> {
    let path = path.as_ref();
    if let Some(bytes) = elsewhere::read(path)? {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
        let reader = reader.map_err(|e| unreadable(path, e))?;
        return reader.into_dimensions().map_err(|e| not_an_image(e).at(path));
    }
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    let reader = reader.map_err(|e| unreadable(path, e))?;
    reader.into_dimensions().map_err(|e| not_an_image(e).at(path))
}

/// Size of an image by the first bytes of its file.
///
/// # Errors
/// [`DataError`] if they are none of a PNG or JPEG.
pub fn decode_size(bytes: &[u8]) -> DataResult<(u32, u32)> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|e| DataError::new("the image cannot be read").because(e))?;
    reader.into_dimensions().map_err(not_an_image)
}

/// A PNG of an image, quick rather than small.
///
/// # Errors
/// [`DataError`] if the encoder refuses, which a valid image gives no reason for.
pub fn encode_png(image: &Image) -> DataResult<Vec<u8>> {
    encode(image.data(), image.width(), image.height(), colour(image)?)
}

/// A JPEG of an image; `quality` from 1 to 100.
///
/// # Errors
/// [`DataError`] if the encoder refuses: a JPEG has at most 65,535 columns and rows.
pub fn encode_jpeg(image: &Image, quality: u8) -> DataResult<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .write_image(image.data(), image.width(), image.height(), colour(image)?)
        .map_err(|e| DataError::new("cannot be encoded as JPEG").because(e))?;
    Ok(bytes)
}

/// A smaller copy with at most so many columns, its shape kept; what is small already is copied as it is.
///
/// # Errors
/// [`DataError`] for pixels that are neither gray nor colour.
pub fn shrink(image: &Image, max_columns: u32) -> DataResult<Image> {
    let (width, height) = (image.width(), image.height());
    if width <= max_columns || max_columns == 0 {
        return Ok(image.clone());
    }
    let rows = (u64::from(height) * u64::from(max_columns) / u64::from(width)).max(1) as u32;
    let wrong_size = || DataError::new("the image does not have the bytes of its size");
    let data = image.data().to_vec();
    let small = match image.format() {
        PixelFormat::Gray8 => {
            let gray = GrayImage::from_raw(width, height, data).ok_or_else(wrong_size)?;
            image::imageops::resize(&gray, max_columns, rows, Resampling::Triangle).into_raw()
        }
        PixelFormat::Rgb8 => {
            let rgb = RgbImage::from_raw(width, height, data).ok_or_else(wrong_size)?;
            image::imageops::resize(&rgb, max_columns, rows, Resampling::Triangle).into_raw()
        }
        other => return Err(DataError::new(format!("{other:?} pixels cannot be made smaller"))),
    };
    Image::new(max_columns, rows, image.format(), small)
}

fn colour(image: &Image) -> DataResult<ExtendedColorType> {
    match image.format() {
        PixelFormat::Gray8 => Ok(ExtendedColorType::L8),
        PixelFormat::Rgb8 => Ok(ExtendedColorType::Rgb8),
        other => Err(DataError::new(format!("no picture can be made of {other:?} pixels"))),
    }
}

/// A 16 bit PNG of a depth image; no depth becomes 0.
///
/// # Errors
/// [`DataError`] if the scale is not positive or a depth does not fit 16 bits of counts.
pub fn encode_depth_png(image: &DepthImage, metres_per_count: f64) -> DataResult<Vec<u8>> {
    check_scale(metres_per_count)?;
    let mut bytes = Vec::with_capacity(image.z_m().len() * 2);
    for z in image.z_m() {
        let count = if z.is_nan() { 0.0 } else { (f64::from(*z) / metres_per_count).round() };
        if count > f64::from(u16::MAX) {
            return Err(DataError::new(format!("a depth of {z} m does not fit 16 bits"))
                .hint("more metres a count make room"));
        }
        bytes.extend_from_slice(&(count as u16).to_ne_bytes());
    }
    encode(&bytes, image.width(), image.height(), ExtendedColorType::L16)
}

/// The bytes of a file, with an error that names it.
///
/// # Errors
/// [`DataError`] with the path.
pub fn read_bytes(path: impl AsRef<Path>) -> DataResult<Vec<u8>> {
    let path = path.as_ref();
    match elsewhere::read(path)? {
        Some(bytes) => Ok(bytes),
        None => fs::read(path).map_err(|e| unreadable(path, e)),
    }
}

/// The bytes of a file that should be a picture, however large it says it is: files may have holes.
fn read_picture(path: &Path) -> DataResult<Vec<u8>> {
    if let Some(bytes) = elsewhere::read(path)? {
        return Ok(bytes);
    }
    let file = File::open(path).map_err(|e| unreadable(path, e))?;
    let size = file.metadata().map_err(|e| unreadable(path, e))?.len();
    let budget = Budget::in_use();
    budget.check(size, "bytes of a picture", MAX_FILE_BYTES).map_err(|e| e.at(path))?;
    let mut bytes = Vec::new();
    file.take(budget.most(MAX_FILE_BYTES)).read_to_end(&mut bytes).map_err(|e| unreadable(path, e))?;
    Ok(bytes)
}

fn encode(bytes: &[u8], width: u32, height: u32, colour: ExtendedColorType) -> DataResult<Vec<u8>> {
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Up)
        .write_image(bytes, width, height, colour)
        .map_err(|e| DataError::new("the PNG cannot be written").because(e))?;
    Ok(png)
}

fn decode_dynamic(bytes: &[u8]) -> DataResult<DynamicImage> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| DataError::new("the image cannot be read").because(e))?;
    let budget = Budget::in_use();
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(MAX_SIDE_PX);
    limits.max_image_height = Some(MAX_SIDE_PX);
    limits.max_alloc = Some(budget.most(MAX_DECODED_BYTES));
    let is_jpeg = reader.format() == Some(ImageFormat::Jpeg);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(not_an_image)?;
    let claimed = decoder.total_bytes();
    let free = if is_jpeg { FREE_JPEG_BYTES } else { FREE_DECODED_BYTES };
    let usual = free.max(MAX_PACKING.saturating_mul(bytes.len() as u64)).min(MAX_DECODED_BYTES);
    if claimed > budget.most(usual) {
        let (width, height) = decoder.dimensions();
        return Err(DataError::new(format!(
            "claims {width}x{height} pixels ({} MB) in {} kB: no camera's picture is packed like that, it is not decoded",
            claimed >> 20,
            bytes.len() >> 10
        ))
        .hint(format!("is the file damaged? Where it is right, {}", Budget::raised(claimed, usual))));
    }
    DynamicImage::from_decoder(decoder).map_err(not_an_image)
}

fn check_scale(metres_per_count: f64) -> DataResult<()> {
    if metres_per_count.is_finite() && metres_per_count > 0.0 {
        Ok(())
    } else {
        Err(DataError::new(format!("{metres_per_count} metres a count is no scale of a depth image")))
    }
}

fn not_an_image(error: image::ImageError) -> DataError {
    DataError::new("is no PNG or JPEG that can be decoded").because(error)
}

fn unreadable(path: &Path, error: io::Error) -> DataError {
    match error.kind() {
        io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn png16(values: &[u16], width: u32, height: u32, colour: ExtendedColorType) -> Vec<u8> {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
        encode(&bytes, width, height, colour).unwrap()
    }

    #[test]
    fn sixteen_bits_become_eight_and_alpha_goes() {
        let gray = decode(&png16(&[0, 257, 65_535], 3, 1, ExtendedColorType::L16)).unwrap();
        assert_eq!((gray.format(), gray.data()), (PixelFormat::Gray8, &[0, 1, 255][..]));
        let rgba = encode(&[1, 2, 3, 9], 1, 1, ExtendedColorType::Rgba8).unwrap();
        let rgb = decode(&rgba).unwrap();
        assert_eq!((rgb.format(), rgb.data()), (PixelFormat::Rgb8, &[1, 2, 3][..]));
        let gray_alpha = encode(&[7, 0], 1, 1, ExtendedColorType::La8).unwrap();
        assert_eq!(decode(&gray_alpha).unwrap().data(), &[7]);
    }

    #[test]
    fn depth_counts_become_metres() {
        let png = png16(&[0, 5000], 2, 1, ExtendedColorType::L16);
        let depth = decode_depth_png(&png, Stamp::from_nanos(3), 0.0002).unwrap();
        assert_eq!((depth.get(0, 0), depth.get(1, 0)), (None, Some(1.0)));
        let again = encode_depth_png(&depth, 0.0002).unwrap();
        let again = decode_depth_png(&again, depth.stamp, 0.0002).unwrap();
        assert_eq!(again.get(1, 0), Some(1.0));
        assert!(encode_depth_png(&depth, 1e-6).is_err(), "a million counts do not fit");
        assert!(decode_depth_png(&png, Stamp::default(), 0.0).is_err());
        let eight = encode(&[1], 1, 1, ExtendedColorType::L8).unwrap();
        assert!(decode_depth_png(&eight, Stamp::default(), 0.001).is_err());
    }

    #[test]
    fn a_smaller_picture_looks_the_same() {
        let data: Vec<u8> = (0..120 * 80 * 3).map(|i| if i % 360 < 180 { 40 } else { 200 }).collect();
        let image = Image::new(120, 80, PixelFormat::Rgb8, data).unwrap();
        let small = shrink(&image, 30).unwrap();
        assert_eq!((small.width(), small.height(), small.format()), (30, 20, PixelFormat::Rgb8));
        assert_eq!((small.data()[0], small.data()[3 * 29]), (40, 200));
        assert_eq!(shrink(&image, 500).unwrap(), image);
        let back = decode(&encode_jpeg(&small, 80).unwrap()).unwrap();
        assert!(back.data()[0].abs_diff(40) < 12 && back.data()[3 * 29].abs_diff(200) < 12);
    }

    #[test]
    fn what_is_no_image_is_refused_without_memory() {
        assert!(decode(b"").is_err());
        assert!(decode(b"hello").is_err());
        let png = png16(&[1, 2, 3, 4], 2, 2, ExtendedColorType::L16);
        assert!(decode(&png[..png.len() / 2]).is_err(), "cut off");
        // A header that claims 2^31 - 1 columns: the check sum must be right for the claim to be looked at.
        let mut huge = png.clone();
        huge[16..20].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
        let crc = crc32(&huge[12..29]);
        huge[29..33].copy_from_slice(&crc.to_be_bytes());
        assert!(decode(&huge).is_err());
    }

    #[test]
    fn a_bomb_is_seen_by_its_header() {
        // All black: a thousandth of its pixels, as packed as a PNG can be.
        let black = Image::new(12_000, 9_000, PixelFormat::Gray8, vec![0; 108_000_000]).unwrap();
        let png = encode_png(&black).unwrap();
        let begun = std::time::Instant::now();
        let error = decode(&png).unwrap_err().to_string();
        assert!(error.contains("12000x9000 pixels") && error.contains("not decoded"), "{error}");
        assert!(begun.elapsed().as_millis() < 500);
        let fair = Image::new(4_000, 3_000, PixelFormat::Gray8, vec![0; 12_000_000]).unwrap();
        assert!(decode(&encode_png(&fair).unwrap()).is_ok(), "a black frame of a large camera");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0_u32, |crc, byte| {
            (0..8)
                .fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
        })
    }

    #[test]
    fn files_are_named_in_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        assert!(read(&path).unwrap_err().to_string().ends_with("a.png: no such file"));
        assert!(dimensions(&path).is_err());
        fs::write(&path, png16(&[1, 2, 3, 4, 5, 6], 3, 2, ExtendedColorType::L16)).unwrap();
        assert_eq!(dimensions(&path).unwrap(), (3, 2));
        fs::write(&path, b"").unwrap();
        assert!(dimensions(&path).is_err() && read(&path).is_err());
    }

    proptest! {
        #[test]
        fn a_png_gives_its_pixels_back(width in 1..20_u32, height in 1..20_u32, seed in any::<u8>(), rgb in any::<bool>()) {
            let format = if rgb { PixelFormat::Rgb8 } else { PixelFormat::Gray8 };
            let n = width as usize * height as usize * format.bytes();
            let data = (0..n).map(|i| (i as u8).wrapping_mul(37).wrapping_add(seed)).collect();
            let image = Image::new(width, height, format, data).unwrap();
            prop_assert_eq!(decode(&encode_png(&image).unwrap()).unwrap(), image);
        }

        #[test]
        fn no_bytes_make_the_decoder_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..200), png in any::<bool>()) {
            if png {
                bytes.splice(0..0, *b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
            }
            let _ = decode(&bytes);
        }
    }
}
