//! Pictures, of brightness and of depth.

use crate::error::{DataError, DataResult};
use crate::time::Stamp;

/// How the bytes of an [`Image`] are laid out; rows are tight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PixelFormat {
    /// One byte a pixel.
    Gray8,
    /// Three bytes a pixel: red, green, blue.
    Rgb8,
}

impl PixelFormat {
    /// Bytes a pixel takes.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Gray8 => 1,
            Self::Rgb8 => 3,
        }
    }
}

/// A decoded image, rows tight and from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    format: PixelFormat,
    data: Vec<u8>,
}

impl Image {
    /// An image from its bytes.
    ///
    /// # Errors
    /// [`DataError`] if the number of bytes is not `width * height * format.bytes()`.
    pub fn new(width: u32, height: u32, format: PixelFormat, data: Vec<u8>) -> DataResult<Self> {
        let expected = width as usize * height as usize * format.bytes();
        if data.len() == expected {
            Ok(Self { width, height, format, data })
        } else {
            let got = data.len();
            Err(DataError::new(format!(
                "a {width}x{height} {format:?} image has {expected} bytes, got {got}"
            )))
        }
    }

    /// Columns.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Layout of the bytes.
    pub const fn format(&self) -> PixelFormat {
        self.format
    }

    /// The bytes.
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// The bytes, given away.
    pub fn into_data(self) -> Vec<u8> {
        self.data
    }
}

/// A depth image registered to a colour image: metres along the optical axis, NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// When it was taken.
    pub stamp: Stamp,
    width: u32,
    height: u32,
    z_m: Vec<f32>,
}

impl DepthImage {
    /// A depth image; values that are not finite or not positive become NaN, which means no depth.
    ///
    /// # Errors
    /// [`DataError`] if the number of values is not `width * height`.
    pub fn new(stamp: Stamp, width: u32, height: u32, mut z_m: Vec<f32>) -> DataResult<Self> {
        let (expected, got) = (width as usize * height as usize, z_m.len());
        if got != expected {
            return Err(DataError::new(format!(
                "a {width}x{height} depth image has {expected} values, got {got}"
            )));
        }
        // Stored in any case, so that several are done at once.
        for z in &mut z_m {
            *z = if z.is_finite() && *z > 0.0 { *z } else { f32::NAN };
        }
        Ok(Self { stamp, width, height, z_m })
    }

    /// Columns.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Metres along the optical axis, row by row, NaN where there is none.
    pub fn z_m(&self) -> &[f32] {
        &self.z_m
    }

    /// Depth of a pixel; `None` outside the image or where there is none.
    pub fn get(&self, column: u32, row: u32) -> Option<f32> {
        if column >= self.width || row >= self.height {
            return None;
        }
        let z = self.z_m[row as usize * self.width as usize + column as usize];
        (!z.is_nan()).then_some(z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_know_their_size() {
        assert!(Image::new(2, 2, PixelFormat::Rgb8, vec![0; 12]).is_ok());
        assert!(Image::new(2, 2, PixelFormat::Gray8, vec![0; 5]).is_err());
        let depth = DepthImage::new(Stamp::default(), 2, 1, vec![0.0, 1.5]).unwrap();
        assert_eq!((depth.get(0, 0), depth.get(1, 0), depth.get(2, 0)), (None, Some(1.5), None));
    }
}
