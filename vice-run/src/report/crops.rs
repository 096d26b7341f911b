//! Small pieces of images around a point: where it started, where its label says it is, and where each stream carried it.
//! Alike pieces mean a good estimate; anyone can see it.

use std::collections::BTreeMap;

use vice_core::camera::Pixel;
use vice_core::dataset::Image;
use vice_core::error::DataResult;
use vice_core::result::PointName;
use vice_core::time::Stamp;
use vice_files::image_file::encode_png;

use super::marks::Marks;

/// Columns and rows of a piece: odd, so that a pixel is its middle.
pub(crate) const SIDE: u32 = 25;
/// Points that are shown, the worst first.
const MOST_POINTS: usize = 12;
/// Estimates of which pieces are shown.
const MOST_CARRIERS: usize = 5;

/// What a piece is around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Around {
    /// The label at the key frame: what is followed.
    Keyframe,
    /// The label in the frame.
    Label,
    /// Where a stream carried it, by its place in [`Marks::carriers`].
    Carried(usize),
}

/// A piece to be cut.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Piece {
    pub(crate) around: Around,
    pub(crate) stamp: Stamp,
    pub(crate) at: Pixel,
    /// How far that is from the label, pixels; zero of a label.
    pub(crate) error_px: f64,
    /// The piece as a PNG; `None` while it is not cut, or where it lies outside the image.
    pub(crate) png: Option<Vec<u8>>,
}

/// The pieces of a point, in the frame in which an estimate is furthest off.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PointPieces {
    pub(crate) point: PointName,
    pub(crate) stamp: Stamp,
    pub(crate) error_px: f64,
    pub(crate) pieces: Vec<Piece>,
}

/// What is to be cut for each point, the worst point first.
pub(crate) fn wanted(marks: &Marks) -> Vec<PointPieces> {
    let shown = marks.shown();
    let mut started: BTreeMap<&PointName, (Stamp, Pixel)> = BTreeMap::new();
    let mut worst: BTreeMap<&PointName, PointPieces> = BTreeMap::new();
    for (stamp, points) in &marks.frames {
        for (point, mark) in points {
            let Some(label) = mark.label_px else { continue };
            if mark.keyframe {
                started.insert(point, (*stamp, label));
            }
            let of_shown = mark.carried.iter().filter(|c| shown.contains(&c.0) && c.2.is_finite());
            let Some(error_px) = of_shown.map(|c| c.2).max_by(f64::total_cmp) else { continue };
            if worst.get(point).is_some_and(|w| w.error_px >= error_px) {
                continue;
            }
            let piece = |around, stamp, at, error_px| Piece { around, stamp, at, error_px, png: None };
            let mut pieces = vec![];
            pieces.extend(started.get(point).map(|(at, px)| piece(Around::Keyframe, *at, *px, 0.0)));
            pieces.push(piece(Around::Label, *stamp, label, 0.0));
            let carried = mark.carried.iter().take(MOST_CARRIERS);
            pieces.extend(carried.map(|c| piece(Around::Carried(c.0), *stamp, c.1, c.2)));
            worst.insert(point, PointPieces { point: point.clone(), stamp: *stamp, error_px, pieces });
        }
    }
    let mut list: Vec<PointPieces> = worst.into_values().collect();
    list.sort_by(|a, b| b.error_px.total_cmp(&a.error_px).then(a.point.cmp(&b.point)));
    list.truncate(MOST_POINTS);
    list
}

/// The piece of an image around a place, gray beyond its edge; `None` where the place lies outside.
pub(crate) fn cut(image: &Image, at: Pixel) -> DataResult<Option<Vec<u8>>> {
    let (columns, rows) = (i64::from(image.width()), i64::from(image.height()));
    // The casts saturate: a place far outside is outside.
    let (column, row) = (at.u.round() as i64, at.v.round() as i64);
    if !(at.u.is_finite() && at.v.is_finite() && (0..columns).contains(&column) && (0..rows).contains(&row)) {
        return Ok(None);
    }
    let channels = image.format().bytes();
    let half = i64::from(SIDE / 2);
    let mut data = Vec::with_capacity((SIDE * SIDE) as usize * channels);
    for y in row - half..=row + half {
        for x in column - half..=column + half {
            if (0..columns).contains(&x) && (0..rows).contains(&y) {
                let start = (y * columns + x) as usize * channels;
                data.extend_from_slice(&image.data()[start..start + channels]);
            } else {
                data.extend(std::iter::repeat_n(128, channels));
            }
        }
    }
    Ok(Some(encode_png(&Image::new(SIDE, SIDE, image.format(), data)?)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, keyframe, part, sample};
    use vice_core::dataset::PixelFormat;
    use vice_files::image_file::decode;

    #[test]
    fn each_point_shows_its_worst_frame_with_its_own_key_frame() {
        let mut estimate =
            part("e", &[sample("a", 1, 2.0), sample("a", 2, 9.0), sample("a", 4, 1.0), sample("b", 2, 30.0)]);
        estimate.keyframes = vec![keyframe("a", 0), keyframe("a", 3), keyframe("b", 0)];
        let list = wanted(&Marks::of(&document(vec![estimate]), None).unwrap());
        let names: Vec<(&str, i64)> = list.iter().map(|p| (&*p.point.0, p.stamp.as_nanos())).collect();
        assert_eq!(names, [("b", 2), ("a", 2)]);
        let around: Vec<(Around, i64)> =
            list[1].pieces.iter().map(|p| (p.around, p.stamp.as_nanos())).collect();
        assert_eq!(around, [(Around::Keyframe, 0), (Around::Label, 2), (Around::Carried(0), 2)]);
    }

    #[test]
    fn a_piece_holds_the_pixels_around_its_middle() {
        let data: Vec<u8> = (0..40 * 30).map(|i| (i % 40) as u8).collect();
        let image = Image::new(40, 30, PixelFormat::Gray8, data).unwrap();
        let piece = decode(&cut(&image, Pixel::new(20.4, 3.0)).unwrap().unwrap()).unwrap();
        let at = |x: usize, y: usize| piece.data()[y * SIDE as usize + x];
        assert_eq!((at(12, 12), at(0, 12), at(24, 12)), (20, 8, 32));
        // Nine rows above the image.
        assert_eq!((at(12, 8), at(12, 9)), (128, 20));
        for outside in [Pixel::new(-1.0, 3.0), Pixel::new(f64::NAN, 3.0), Pixel::new(1e300, 0.0)] {
            assert_eq!(cut(&image, outside).unwrap(), None);
        }
    }
}
