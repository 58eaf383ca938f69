//! A view of an 8-bit grey image that cannot be read out of bounds.

/// Largest width and height of an image, px: the start view's 450 × 450 (5.2).
pub const IMAGE_MAX: usize = 450;
/// Largest width and height of the part of an image that a seam is looked for in, px: what the fixed buffers of this room hold. All of it:
/// the part may lie anywhere in the start view.
pub const SIDE_MAX: usize = IMAGE_MAX;
/// Smallest width and height, px: less cannot hold a window and a joint.
pub const SIDE_MIN: usize = 64;

/// Why bytes are no image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageError {
    /// Width outside [`SIDE_MIN`]..=[`IMAGE_MAX`].
    Width(usize),
    /// Height outside [`SIDE_MIN`]..=[`IMAGE_MAX`].
    Height(usize),
    /// The number of bytes is not width × height.
    Length {
        /// Bytes given.
        given: usize,
        /// Bytes needed.
        needed: usize,
    },
}

impl core::fmt::Display for ImageError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Width(px) => write!(f, "width is {px} px, allowed {SIDE_MIN} to {IMAGE_MAX}"),
            Self::Height(px) => write!(f, "height is {px} px, allowed {SIDE_MIN} to {IMAGE_MAX}"),
            Self::Length { given, needed } => write!(f, "image has {given} bytes, width × height is {needed}"),
        }
    }
}

impl core::error::Error for ImageError {}

/// Rows of grey pixels, top first: of a whole image, or of some of its columns.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pixels: &'a [u8],
    /// Pixels from a row's first to the next row's.
    stride: usize,
    left: usize,
    width: usize,
    height: usize,
}

impl<'a> View<'a> {
    /// Views `pixels` as `height` rows of `width`.
    pub fn new(pixels: &'a [u8], width: usize, height: usize) -> Result<Self, ImageError> {
        if !(SIDE_MIN..=IMAGE_MAX).contains(&width) {
            return Err(ImageError::Width(width));
        }
        if !(SIDE_MIN..=IMAGE_MAX).contains(&height) {
            return Err(ImageError::Height(height));
        }
        if pixels.len() != width * height {
            return Err(ImageError::Length {
                given: pixels.len(),
                needed: width * height,
            });
        }
        Ok(Self {
            pixels,
            stride: width,
            left: 0,
            width,
            height,
        })
    }

    /// `width` columns of it from column `left` on; fewer where the image ends before.
    pub fn columns(&self, left: usize, width: usize) -> Self {
        let left = left.min(self.width);
        Self {
            left: self.left + left,
            width: width.min(self.width - left),
            ..*self
        }
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Row `y`; empty outside the image.
    pub fn row(&self, y: usize) -> &'a [u8] {
        let first = y * self.stride + self.left;
        self.pixels.get(first..first + self.width).unwrap_or(&[])
    }

    /// Pixels `from..to` of row `y`; empty unless all of them lie in the image.
    pub fn span(&self, y: usize, from: usize, to: usize) -> &'a [u8] {
        self.row(y).get(from..to).unwrap_or(&[])
    }
}

/// Sum of four pixels side by side in each of up to 64 rows.
pub fn sum<const ROWS: usize>(rows: [[u8; 4]; ROWS]) -> u32 {
    // Two sums of two side by side in a word, then the sum of those: the product's upper half.
    let pairs = rows.into_iter().fold(0, |pairs, four| {
        let four = u32::from_le_bytes(four);
        pairs + (four & 0x00ff_00ff) + ((four >> 8) & 0x00ff_00ff)
    });
    pairs.wrapping_mul(0x0001_0001) >> 16
}

/// How many of four pixels are at least as bright as `level`, of 128 to 255.
pub fn bright(four: [u8; 4], level: u8) -> usize {
    // What a pixel's lower seven bits lack to the level's carries into its highest bit, which must be set besides.
    let four = u32::from_le_bytes(four);
    let lower = (four & 0x7f7f_7f7f) + 0x0101_0101 * (256 - u32::from(level));
    ((((lower & four) >> 7) & 0x0101_0101).wrapping_mul(0x0101_0101) >> 24) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::string::ToString;

    #[test]
    fn bytes_that_are_no_image_are_refused_with_field_value_and_range() {
        let error =
            |bytes: usize, width, height| View::new(&[0; 70_000][..bytes], width, height).unwrap_err().to_string();
        assert_eq!(error(250, 250, 1), "height is 1 px, allowed 64 to 450");
        assert_eq!(error(451 * 64, 451, 64), "width is 451 px, allowed 64 to 450");
        assert_eq!(
            error(62_499, 250, 250),
            "image has 62499 bytes, width × height is 62500"
        );
    }

    #[test]
    fn outside_the_image_there_are_no_pixels() {
        let pixels = [7; 64 * 64];
        let view = View::new(&pixels, 64, 64).unwrap();
        assert!(view.row(64).is_empty() && view.span(0, 60, 65).is_empty());
        assert_eq!(view.span(63, 60, 64), [7; 4]);
    }

    #[test]
    fn four_pixels_together_are_what_they_are_one_by_one() {
        for four in [
            [0, 0, 0, 0],
            [255; 4],
            [1, 2, 3, 250],
            [249, 250, 128, 127],
            [0, 255, 0, 255],
        ] {
            let one_by_one: u32 = four.iter().map(|&pixel| u32::from(pixel)).sum();
            assert_eq!(sum([four; 3]), 3 * one_by_one);
            let level = |level| four.iter().filter(|&&pixel| pixel >= level).count();
            assert_eq!([bright(four, 250), bright(four, 128)], [level(250), level(128)]);
        }
    }

    #[test]
    fn some_columns_of_an_image_are_an_image() {
        let pixels: std::vec::Vec<u8> = (0..100 * 64).map(|index| (index % 100) as u8).collect();
        let view = View::new(&pixels, 100, 64).unwrap().columns(20, 30);
        assert_eq!((view.width(), view.height()), (30, 64));
        assert_eq!((view.row(63)[0], view.row(63)[29]), (20, 49));
        assert_eq!(view.columns(28, 10).row(5), [48, 49], "none from beyond");
        assert!(view.row(64).is_empty() && view.columns(40, 10).row(0).is_empty());
    }
}
