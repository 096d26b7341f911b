//! An image and its halvings.

use fearless_simd::{Simd, dispatch};
use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::{DataError, DataResult};

use crate::registers;

/// Columns and rows of the window that is matched.
pub const WINDOW_PX: usize = 21;

/// A gray image and versions of it of half the size each: to the bit what OpenCV's `cvtColor` and `pyrDown` give.
///
/// Place `(u, v)` of a level is place `(2u, 2v)` of the one before it.
#[derive(Clone, Debug)]
pub struct Pyramid {
    levels: Vec<Level>,
}

/// One size of the image, rows tight and from the top.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Vec<u8>,
}

impl Pyramid {
    /// Halves the image `halvings` times, or until a window no longer fits. Colours become luma (ITU-R BT.601).
    ///
    /// # Errors
    /// [`DataError`] for an image without pixels or of a layout that is not known.
    pub fn new(image: &Image, halvings: usize) -> DataResult<Self> {
        let (width, height) = (image.width() as usize, image.height() as usize);
        if width == 0 || height == 0 {
            return Err(DataError::new(format!("an image of {width}x{height} pixels cannot be tracked")));
        }
        let simd = registers::level();
        let pixels = match image.format() {
            PixelFormat::Gray8 => image.data().to_vec(),
            PixelFormat::Rgb8 => dispatch!(simd, simd => simd.vectorize(|| luma(image.data()))),
            other => return Err(DataError::new(format!("{other:?} pixels cannot be tracked"))),
        };
        let mut levels = vec![Level { width, height, pixels }];
        for _ in 0..halvings {
            let last = &levels[levels.len() - 1];
            if last.width.div_ceil(2) <= WINDOW_PX || last.height.div_ceil(2) <= WINDOW_PX {
                break;
            }
            levels.push(dispatch!(simd, simd => halve(simd, last)));
        }
        Ok(Self { levels })
    }

    /// As many halvings as the size of the image asks for: three for 752x480, five for 3840x2160.
    ///
    /// # Errors
    /// As [`Pyramid::new`].
    pub fn for_tracking(image: &Image) -> DataResult<Self> {
        let extra = (f64::from(image.width().max(image.height())) / 752.0).log2().ceil().clamp(0.0, 4.0);
        Self::new(image, 3 + extra as usize)
    }

    /// Columns of the image.
    pub fn width(&self) -> usize {
        self.levels[0].width
    }

    /// Rows of the image.
    pub fn height(&self) -> usize {
        self.levels[0].height
    }

    /// The image itself and its halvings, largest first.
    pub(crate) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The image itself.
    pub(crate) fn base(&self) -> &Level {
        &self.levels[0]
    }
}

/// `0.299 R + 0.587 G + 0.114 B` in fixed point of 15 bits.
#[inline(always)]
fn luma(rgb: &[u8]) -> Vec<u8> {
    rgb.chunks_exact(3)
        .map(|p| {
            let sum = u32::from(p[0]) * 9798 + u32::from(p[1]) * 19235 + u32::from(p[2]) * 3735;
            ((sum + (1 << 14)) >> 15) as u8
        })
        .collect()
}

/// Index of a pixel beyond the border, mirrored about the border pixel's centre.
pub(crate) const fn mirrored(index: isize, length: usize) -> usize {
    let last = length as isize - 1;
    if last == 0 {
        return 0;
    }
    let folded = index.rem_euclid(2 * last);
    (if folded > last { 2 * last - folded } else { folded }) as usize
}

/// Smooths with `(1 4 6 4 1) / 16` along both axes, mirrored at the border, and keeps each second pixel.
#[inline(always)]
fn halve<S: Simd>(simd: S, from: &Level) -> Level {
    let (width, height) = (from.width.div_ceil(2), from.height.div_ceil(2));
    let mut pixels = vec![0_u8; width * height];
    // One column more on either side, so that the sum along the row needs no border: column c is at c + 1.
    let mut even = vec![0_u16; width + 2];
    let mut odd = vec![0_u16; width + 2];
    let mut column_sums = vec![0_u16; from.width];
    simd.vectorize(
        #[inline(always)]
        || {
            for (y, line) in pixels.chunks_exact_mut(width).enumerate() {
                let row = |offset: isize| {
                    let y = mirrored(2 * y as isize + offset, from.height);
                    &from.pixels[y * from.width..][..from.width]
                };
                sum_rows([row(-2), row(-1), row(0), row(1), row(2)], &mut column_sums);
                let at = |x: isize| column_sums[mirrored(x, from.width)];
                split(&column_sums, &mut even[1..], &mut odd[1..]);
                // Columns -2, -1 and those past the end: the last odd one is past it where the width is odd.
                (even[0], odd[0]) = (at(-2), at(-1));
                (even[width + 1], odd[width]) = (at(2 * width as isize), at(2 * width as isize - 1));
                sum_columns(&even, &odd, line);
            }
        },
    );
    Level { width, height, pixels }
}

#[inline(always)]
fn sum_rows(rows: [&[u8]; 5], sums: &mut [u16]) {
    let n = sums.len();
    let [a, b, c, d, e] = rows.map(|r| &r[..n]);
    for i in 0..n {
        let [a, b, c, d, e] = [a[i], b[i], c[i], d[i], e[i]].map(u16::from);
        sums[i] = a + e + 4 * (b + d) + 6 * c;
    }
}

#[inline(always)]
fn split(sums: &[u16], even: &mut [u16], odd: &mut [u16]) {
    for ((pair, even), odd) in sums.chunks_exact(2).zip(even.iter_mut()).zip(odd) {
        (*even, *odd) = (pair[0], pair[1]);
    }
    if let ([.., last], true) = (sums, sums.len() % 2 == 1) {
        even[sums.len() / 2] = *last;
    }
}

/// At most 255 * 256 + 128: sixteen bits hold it.
#[inline(always)]
fn sum_columns(even: &[u16], odd: &[u16], line: &mut [u8]) {
    let n = line.len();
    let (left, here, right) = (&even[..n], &even[1..=n], &even[2..n + 2]);
    let (odd_left, odd_right) = (&odd[..n], &odd[1..=n]);
    for i in 0..n {
        let sum = left[i] + right[i] + 4 * (odd_left[i] + odd_right[i]) + 6 * here[i];
        line[i] = ((sum + 128) >> 8) as u8;
    }
}
