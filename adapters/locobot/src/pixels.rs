//! From the pixels of a message to an image of the core: encodings, row steps and byte orders.

use vice_core::dataset::{DepthImage, Image, PixelFormat};
use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;
use vice_files::image_file::{self, MAX_SIDE_PX};

use crate::message::{ImageHead, compressed_head, image_head};
use crate::wire::{Reader, WireError};

/// Metres a count of a `16UC1` depth image (REP 118).
const METRES_PER_COUNT: f64 = 0.001;
/// Bytes before the PNG of `compressedDepth`: the kind and the two parameters of quantised inverse depth.
const DEPTH_HEADER_BYTES: usize = 12;

/// How an image topic packs its images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    /// `sensor_msgs/Image`.
    Raw,
    /// `sensor_msgs/CompressedImage`.
    Compressed,
}

impl Packing {
    /// By the type of a topic.
    pub(crate) fn of(kind: &str) -> Option<Self> {
        match kind {
            "sensor_msgs/Image" => Some(Self::Raw),
            "sensor_msgs/CompressedImage" => Some(Self::Compressed),
            _ => None,
        }
    }
}

/// Decodes a message as a colour or gray image.
///
/// # Errors
/// [`DataError`] for an unknown encoding, or pixels that do not fit the size.
pub(crate) fn image(mut reader: Reader<'_>, packing: Packing) -> DataResult<Image> {
    match packing {
        Packing::Compressed => {
            let (_, format) = compressed_head(&mut reader).map_err(broken)?;
            let bytes = reader.bytes().map_err(broken)?;
            image_file::decode(bytes).map_err(|e| of_format(format, e))
        }
        Packing::Raw => {
            let head = image_head(&mut reader).map_err(broken)?;
            raw_image(&head, reader.bytes().map_err(broken)?)
        }
    }
}

/// The PNG or JPEG that a message holds as it is; `None` where it holds raw pixels.
///
/// # Errors
/// [`DataError`] for a message that is cut off.
pub(crate) fn file(mut reader: Reader<'_>, packing: Packing) -> DataResult<Option<Vec<u8>>> {
    match packing {
        Packing::Compressed => {
            compressed_head(&mut reader).map_err(broken)?;
            Ok(Some(reader.bytes().map_err(broken)?.to_vec()))
        }
        Packing::Raw => Ok(None),
    }
}

/// What the numbers of depth images are, where the user says so: metres each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DepthUnit(pub(crate) f64);

impl DepthUnit {
    /// From `m`, `cm`, `mm` or a number of metres.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let metres = match text.trim() {
            "m" => 1.0,
            "cm" => 0.01,
            "mm" => 0.001,
            number => number.parse().ok()?,
        };
        (f64::is_finite(metres) && metres > 0.0).then_some(Self(metres))
    }
}

/// Decodes a message as a depth image. Without a `unit` counts of 16 bits are millimetres and floats are metres.
///
/// # Errors
/// [`DataError`] for an encoding that is no depth, or pixels that do not fit the size.
pub(crate) fn depth(
    mut reader: Reader<'_>,
    packing: Packing,
    unit: Option<DepthUnit>,
) -> DataResult<DepthImage> {
    match packing {
        Packing::Compressed => {
            let (header, format) = compressed_head(&mut reader).map_err(broken)?;
            let bytes = reader.bytes().map_err(broken)?;
            compressed_depth(header.stamp, format, bytes, unit).map_err(|e| of_format(format, e))
        }
        Packing::Raw => {
            let head = image_head(&mut reader).map_err(broken)?;
            raw_depth(&head, reader.bytes().map_err(broken)?, unit)
        }
    }
}

fn broken(error: WireError) -> DataError {
    DataError::new(format!("the image message is damaged: {error}"))
}

fn of_format(format: &str, error: DataError) -> DataError {
    DataError::new(format!("the compressed image (`{format}`) cannot be decoded")).because(error)
}

/// The rows of a raw image without what follows them up to the step.
fn rows<'a>(
    head: &ImageHead<'_>,
    data: &'a [u8],
    bytes_per_px: usize,
) -> DataResult<impl Iterator<Item = &'a [u8]> + use<'a>> {
    let ImageHead { width, height, step, .. } = *head;
    if width == 0 || height == 0 || width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(DataError::new(format!("the image claims to have {width}x{height} pixels")));
    }
    let (row, step) = (width as usize * bytes_per_px, step as usize);
    if step < row {
        let problem =
            format!("a row of {width} `{}` pixels has {row} bytes, its step is {step}", head.encoding);
        return Err(DataError::new(problem));
    }
    let needed = step * (height as usize - 1) + row;
    if data.len() < needed {
        let got = data.len();
        return Err(DataError::new(format!("the {width}x{height} image needs {needed} bytes, it has {got}")));
    }
    Ok(data.chunks(step).take(height as usize).map(move |r| &r[..row]))
}

fn raw_image(head: &ImageHead<'_>, data: &[u8]) -> DataResult<Image> {
    let (width, height) = (head.width, head.height);
    let make = |format: PixelFormat, bytes_per_px: usize, convert: &dyn Fn(&[u8], &mut Vec<u8>)| {
        let rows = rows(head, data, bytes_per_px)?;
        let mut out = Vec::with_capacity(width as usize * height as usize * format.bytes());
        rows.for_each(|row| convert(row, &mut out));
        Image::new(width, height, format, out)
    };
    match head.encoding {
        "mono8" | "8UC1" => make(PixelFormat::Gray8, 1, &|row, out| out.extend_from_slice(row)),
        "rgb8" => make(PixelFormat::Rgb8, 3, &|row, out| out.extend_from_slice(row)),
        // 8UC3 is what OpenCV calls its own order.
        "bgr8" | "8UC3" => make(PixelFormat::Rgb8, 3, &|row, out| {
            out.extend(row.as_chunks::<3>().0.iter().flat_map(|[b, g, r]| [*r, *g, *b]));
        }),
        "rgba8" => make(PixelFormat::Rgb8, 4, &|row, out| {
            out.extend(row.as_chunks::<4>().0.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]));
        }),
        "bgra8" => make(PixelFormat::Rgb8, 4, &|row, out| {
            out.extend(row.as_chunks::<4>().0.iter().flat_map(|[b, g, r, _]| [*r, *g, *b]));
        }),
        other => Err(DataError::new(format!("the encoding `{other}` is not one of an image that is read"))
            .hint("known: mono8, rgb8, bgr8, rgba8, bgra8, 8UC1, 8UC3")),
    }
}

/// A count of `16UC1` in metres. Bit for bit what [`image_file::decode_depth_png`] gives, and four at once.
fn metres(count: u16) -> f32 {
    f32::from(count) / 1000.0
}

fn raw_depth(head: &ImageHead<'_>, data: &[u8], unit: Option<DepthUnit>) -> DataResult<DepthImage> {
    let (width, height) = (head.width, head.height);
    let capacity = || Vec::with_capacity(width as usize * height as usize);
    let mut z_m: Vec<f32>;
    match head.encoding {
        "16UC1" | "mono16" => {
            let rows = rows(head, data, 2)?;
            z_m = capacity();
            // Loops of their own, so that none asks for the byte order or the unit at each pixel.
            match (head.big_endian, unit) {
                (big, Some(DepthUnit(metres))) => rows.for_each(|row| {
                    let count =
                        |b: &[u8; 2]| if big { u16::from_be_bytes(*b) } else { u16::from_le_bytes(*b) };
                    z_m.extend(row.as_chunks::<2>().0.iter().map(|b| (f64::from(count(b)) * metres) as f32));
                }),
                (true, None) => rows.for_each(|row| {
                    z_m.extend(row.as_chunks::<2>().0.iter().map(|b| metres(u16::from_be_bytes(*b))));
                }),
                (false, None) => rows.for_each(|row| {
                    z_m.extend(row.as_chunks::<2>().0.iter().map(|b| metres(u16::from_le_bytes(*b))));
                }),
            }
        }
        "32FC1" => {
            let rows = rows(head, data, 4)?;
            z_m = capacity();
            let big = head.big_endian;
            let plain = |b: &[u8; 4]| if big { f32::from_be_bytes(*b) } else { f32::from_le_bytes(*b) };
            let value = |b: &[u8; 4]| match unit {
                Some(DepthUnit(metres)) => (f64::from(plain(b)) * metres) as f32,
                None => plain(b),
            };
            rows.for_each(|row| z_m.extend(row.as_chunks::<4>().0.iter().map(value)));
        }
        other => {
            return Err(DataError::new(format!("the encoding `{other}` is not one of a depth image"))
                .hint("known: 16UC1, mono16, 32FC1"));
        }
    }
    DepthImage::new(head.header.stamp, width, height, z_m)
}

/// `16UC1; png compressed` is a PNG; `compressedDepth` puts 12 bytes before it, and quantises `32FC1` as inverse depth.
fn compressed_depth(
    stamp: Stamp,
    format: &str,
    bytes: &[u8],
    unit: Option<DepthUnit>,
) -> DataResult<DepthImage> {
    let metres_per_count = unit.map_or(METRES_PER_COUNT, |unit| unit.0);
    if !format.contains("compressedDepth") {
        return image_file::decode_depth_png(bytes, stamp, metres_per_count);
    }
    if format.contains("rvl") {
        return Err(DataError::new("RVL compression is not read").hint("record compressedDepth as png"));
    }
    let Some((header, png)) = bytes.split_at_checked(DEPTH_HEADER_BYTES) else {
        return Err(DataError::new(format!("has {} bytes, its header alone has 12", bytes.len())));
    };
    if !format.starts_with("32FC1") {
        return image_file::decode_depth_png(png, stamp, metres_per_count);
    }
    let parameter = |at: usize| {
        header.get(at..at + 4).and_then(|b| b.try_into().ok()).map(f32::from_le_bytes).unwrap_or_default()
    };
    let (a, b) = (parameter(4), parameter(8));
    // One metre a count keeps the counts, of which 0 becomes NaN and stays it.
    let counts = image_file::decode_depth_png(png, stamp, 1.0)?;
    let plain = counts.z_m().iter().map(|count| a / (count - b));
    let z_m = match unit {
        Some(DepthUnit(metres)) => plain.map(|z| (f64::from(z) * metres) as f32).collect(),
        None => plain.collect(),
    };
    DepthImage::new(stamp, counts.width(), counts.height(), z_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Header;
    use proptest::prelude::*;

    fn head(encoding: &str, width: u32, height: u32, step: u32, big_endian: bool) -> ImageHead<'_> {
        let header = Header { stamp: Stamp::from_nanos(5), frame: "c" };
        ImageHead { header, height, width, encoding, big_endian, step }
    }

    #[test]
    fn encodings_steps_and_byte_orders() {
        let padded = [1, 2, 3, 9, 4, 5, 6, 9];
        let rgb = raw_image(&head("rgb8", 1, 2, 4, false), &padded).unwrap();
        assert_eq!((rgb.format(), rgb.data()), (PixelFormat::Rgb8, &[1, 2, 3, 4, 5, 6][..]));
        let bgr = raw_image(&head("bgr8", 1, 2, 4, false), &padded[..7]).unwrap();
        assert_eq!(bgr.data(), &[3, 2, 1, 6, 5, 4]);
        assert_eq!(raw_image(&head("bgra8", 1, 1, 4, false), &[1, 2, 3, 4]).unwrap().data(), &[3, 2, 1]);
        assert_eq!(raw_image(&head("mono8", 2, 1, 2, false), &[7, 8]).unwrap().data(), &[7, 8]);
        let little = raw_depth(&head("16UC1", 2, 1, 4, false), &[0xe8, 3, 0, 0], None).unwrap();
        let big = raw_depth(&head("16UC1", 2, 1, 4, true), &[3, 0xe8, 0, 0], None).unwrap();
        assert_eq!((little.get(0, 0), little.get(1, 0)), (Some(1.0), None));
        assert_eq!(big.get(0, 0), Some(1.0));
        let mut floats = 1.5_f32.to_le_bytes().to_vec();
        floats.extend(f32::NAN.to_le_bytes());
        let depth = raw_depth(&head("32FC1", 2, 1, 8, false), &floats, None).unwrap();
        assert_eq!((depth.get(0, 0), depth.get(1, 0)), (Some(1.5), None));
    }

    #[test]
    fn a_unit_that_is_said_holds_for_every_encoding() {
        let unit = DepthUnit::parse;
        assert_eq!((unit("mm"), unit("cm"), unit(" m ")), (unit("0.001"), unit("0.01"), unit("1")));
        assert!(["", "km", "0", "-1", "nan", "inf"].iter().all(|text| unit(text).is_none()));
        let counts =
            |big| raw_depth(&head("16UC1", 1, 1, 2, big), &[2, 2], unit("0.00025")).unwrap().get(0, 0);
        assert_eq!(
            (counts(true), counts(false)),
            (Some(0.1285), Some(0.1285)),
            "514 quarters of a millimetre"
        );
        let floats =
            |unit| raw_depth(&head("32FC1", 1, 1, 4, false), &1061.0_f32.to_le_bytes(), unit).unwrap();
        assert_eq!((floats(unit("mm")).get(0, 0), floats(None).get(0, 0)), (Some(1.061), Some(1061.0)));
        let z = DepthImage::new(Stamp::default(), 1, 1, vec![1.0]).unwrap();
        let png = image_file::encode_depth_png(&z, 0.001).unwrap();
        let packed = |format: &str, header: usize| {
            let bytes = [vec![0; header], png.clone()].concat();
            compressed_depth(Stamp::default(), format, &bytes, unit("cm")).unwrap().get(0, 0)
        };
        assert_eq!(
            (packed("16UC1; png compressed", 0), packed("16UC1; compressedDepth", 12)),
            (Some(10.0), Some(10.0))
        );
    }

    #[test]
    fn raw_and_compressed_depth_have_the_same_bits() {
        for count in 0..=u16::MAX {
            let compressed = (f64::from(count) * METRES_PER_COUNT) as f32;
            assert_eq!(metres(count).to_bits(), compressed.to_bits(), "{count}");
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let text = |head: ImageHead<'_>, data: &[u8]| raw_image(&head, data).unwrap_err().to_string();
        assert!(text(head("yuv422", 2, 2, 4, false), &[0; 8]).contains("encoding `yuv422`"));
        assert!(text(head("rgb8", 2, 1, 5, false), &[0; 8]).contains("step is 5"));
        assert!(text(head("rgb8", 2, 2, 6, false), &[0; 11]).contains("needs 12 bytes, it has 11"));
        assert!(text(head("rgb8", u32::MAX, 2, u32::MAX, false), &[]).contains("claims"));
        assert!(raw_depth(&head("rgb8", 1, 1, 3, false), &[0; 3], None).is_err());
    }

    #[test]
    fn compressed_depth_has_a_header() {
        let z = DepthImage::new(Stamp::default(), 2, 1, vec![1.0, f32::NAN]).unwrap();
        let png = image_file::encode_depth_png(&z, 0.001).unwrap();
        let plain = compressed_depth(Stamp::default(), "16UC1; png compressed", &png, None).unwrap();
        assert_eq!((plain.get(0, 0), plain.get(1, 0)), (Some(1.0), None));
        let mut with_header = vec![0; 12];
        with_header.extend(&png);
        let depth = compressed_depth(Stamp::default(), "16UC1; compressedDepth", &with_header, None).unwrap();
        assert_eq!(depth.get(0, 0), Some(1.0));
        // Inverse depth: z = a / (count - b), with a = 1990 and b = 5 two metres are 1000 counts.
        with_header[4..8].copy_from_slice(&1990.0_f32.to_le_bytes());
        with_header[8..12].copy_from_slice(&5.0_f32.to_le_bytes());
        let inverse =
            compressed_depth(Stamp::default(), "32FC1; compressedDepth", &with_header, None).unwrap();
        assert_eq!((inverse.get(0, 0), inverse.get(1, 0)), (Some(2.0), None));
        assert!(compressed_depth(Stamp::default(), "16UC1; compressedDepth", &[0; 5], None).is_err());
        assert!(
            compressed_depth(Stamp::default(), "16UC1; compressedDepth rvl", &with_header, None).is_err()
        );
    }

    proptest! {
        #[test]
        fn no_image_message_makes_it_panic(
            width in any::<u32>(), height in 0..5_u32, step in any::<u32>(),
            data in prop::collection::vec(any::<u8>(), 0..40), which in 0..4_usize,
        ) {
            let encoding = ["rgb8", "mono8", "16UC1", "32FC1"][which];
            let head = head(encoding, width % 7, height, step % 20, false);
            let _ = raw_image(&head, &data);
            let _ = raw_depth(&head, &data, None);
        }
    }
}
