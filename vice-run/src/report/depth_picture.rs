//! Depth as a picture: cividis (Nuñez, Anderton and Renslow 2018), which reads the same with and without colour
//! blindness, and a scale beside it; differences from blue over white to vermilion.

use vice_core::dataset::{DepthImage, Image, PixelFormat};
use vice_core::error::DataResult;
use vice_core::statistics::{quantile, sorted};

use super::font;
use super::overlay::{Canvas, Colour};

/// Cividis at sixteenths.
const CIVIDIS: [Colour; 17] = [
    [0, 34, 78],
    [0, 46, 106],
    [26, 56, 111],
    [50, 67, 109],
    [67, 78, 108],
    [83, 90, 109],
    [97, 101, 111],
    [111, 112, 115],
    [125, 124, 120],
    [140, 136, 120],
    [155, 148, 118],
    [171, 160, 114],
    [188, 174, 108],
    [205, 187, 99],
    [222, 201, 88],
    [240, 216, 70],
    [254, 232, 56],
];

/// Blue, white, vermilion.
const DIVERGING: [Colour; 3] = [[0, 114, 178], [255, 255, 255], [213, 94, 0]];

/// Width of the scale beside the picture, pixels.
const SCALE_WIDTH: u32 = 90;

/// Where there is no depth: a hatching that no value has.
const NOTHING: [Colour; 2] = [[40, 40, 40], [70, 70, 70]];

fn at(map: &[Colour], fraction: f64) -> Colour {
    let place = fraction.clamp(0.0, 1.0) * (map.len() - 1) as f64;
    let (low, f) = ((place.floor() as usize).min(map.len() - 2), place - place.floor());
    let f = if place >= (map.len() - 1) as f64 { 1.0 } else { f };
    std::array::from_fn(|i| {
        (f64::from(map[low][i]) * (1.0 - f) + f64::from(map[low + 1][i]) * f).round() as u8
    })
}

/// The depths that pictures of one frame go from and to, metres: so that sources can be held side by side, and wide
/// enough for the 1st to the 99th percentile of the source that sees least far. A floor runs to the horizon.
pub(crate) fn common_range(images: &[&DepthImage]) -> (f64, f64) {
    let ranges = images.iter().map(|i| percentile_range(i.z_m()));
    let (low, high) =
        ranges.fold((f64::INFINITY, f64::INFINITY), |(l, h), (low, high)| (l.min(low), h.min(high)));
    if high > low { (low, high) } else { (low, low + 1e-3) }
}

/// A depth image in colour between two depths, near things dark.
pub(crate) fn depth_picture(depth: &DepthImage, range_m: (f64, f64)) -> DataResult<Image> {
    paint(depth.width(), depth.height(), depth.z_m(), range_m, &CIVIDIS, false)
}

/// Differences in metres in colour, symmetric about zero up to the 99th percentile of their size, or four times their
/// median where that is less.
pub(crate) fn difference_picture(width: u32, height: u32, metres: &[f32]) -> DataResult<Image> {
    let sizes: Vec<f32> = metres.iter().map(|v| v.abs()).collect();
    let (_, high) = percentile_range(&sizes);
    paint(width, height, metres, (-high, high), &DIVERGING, true)
}

/// The 1st and the 99th percentile of what is finite; the upper one at most four times the median, with room for
/// values that are nearly all alike.
fn percentile_range(values: &[f32]) -> (f64, f64) {
    let finite = sorted(values.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).collect());
    let at = |p: f64, otherwise: f64| quantile(&finite, p).unwrap_or(otherwise);
    let (low, high) = (at(0.01, 0.0), at(0.99, 1.0).min((4.0 * at(0.5, 1.0)).max(1e-3)));
    if high > low { (low, high) } else { (low, low + 1e-3) }
}

fn paint(
    width: u32,
    height: u32,
    values: &[f32],
    (low, high): (f64, f64),
    map: &[Colour],
    signed: bool,
) -> DataResult<Image> {
    let total = width + SCALE_WIDTH;
    let mut rgb = Vec::with_capacity(total as usize * height as usize * 3);
    for row in 0..height as usize {
        for column in 0..width as usize {
            let value = f64::from(values[row * width as usize + column]);
            let colour = match value.is_finite() {
                true => at(map, (value - low) / (high - low)),
                false => NOTHING[(row + column) / 4 % 2],
            };
            rgb.extend_from_slice(&colour);
        }
        rgb.extend(std::iter::repeat_n([255_u8; 3], SCALE_WIDTH as usize).flatten());
    }
    let mut canvas = Canvas::new(&Image::new(total, height, PixelFormat::Rgb8, rgb)?);
    let (left, top) = (i64::from(width) + 8, 12);
    let bottom = (i64::from(height) - 12).max(top + 1);
    for y in top..bottom {
        let fraction = 1.0 - (y - top) as f64 / (bottom - top) as f64;
        canvas.fill((left, y), (14, 1), at(map, fraction));
    }
    for tick in 0..5 {
        let fraction = f64::from(tick) / 4.0;
        let y = bottom - ((bottom - top) as f64 * fraction).round() as i64;
        let value = low + (high - low) * fraction;
        let digits = if high - low < 0.5 { 3 } else { 2 };
        let text = if signed { format!("{value:+.digits$}m") } else { format!("{value:.digits$}m") };
        canvas.fill((left + 14, y), (4, 1), [0; 3]);
        // The smaller size where the larger does not fit.
        let scale = if font::width(&text) * 2 > i64::from(SCALE_WIDTH) - 28 { 1 } else { 2 };
        font::write(&mut canvas, (left + 20, y - font::HEIGHT * scale / 2), scale, &text, [0; 3]);
    }
    canvas.into_image()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::time::Stamp;

    #[test]
    fn near_is_dark_far_is_light_and_nothing_is_hatched() {
        let mut z: Vec<f32> = (0..100 * 60).map(|i| 1.0 + i as f32 / 6000.0).collect();
        z[0] = f32::NAN;
        let depth = DepthImage::new(Stamp::default(), 100, 60, z).unwrap();
        let picture = depth_picture(&depth, common_range(&[&depth])).unwrap();
        assert_eq!((picture.width(), picture.height()), (190, 60));
        let sum = |column: usize, row: usize| -> u32 {
            picture.data()[3 * (row * 190 + column)..][..3].iter().map(|c| u32::from(*c)).sum()
        };
        assert!(sum(50, 1) < sum(50, 30) && sum(50, 30) < sum(50, 58));
        assert_eq!(picture.data()[..3], NOTHING[0]);
        assert_eq!((at(&CIVIDIS, 0.0), at(&CIVIDIS, 1.0)), (CIVIDIS[0], CIVIDIS[16]));
        assert_eq!(at(&DIVERGING, 0.5), [255, 255, 255]);
        // The scale has marks on it.
        assert!((0..60).any(|row| sum(130, row) < 300));
    }

    #[test]
    fn no_depth_at_all_is_a_picture_too() {
        let depth = DepthImage::new(Stamp::default(), 20, 30, vec![f32::NAN; 600]).unwrap();
        assert!(depth_picture(&depth, common_range(&[&depth])).is_ok());
        assert!(difference_picture(20, 30, &[0.0; 600]).is_ok());
    }
}
