//! The middle of what an image sensor puts out, as a camera interface lets it through: rows of whole words.
//!
//! Such an interface packs pixels into words of four, so the rows in memory are up to three pixels longer than the
//! image's; [`squeeze`] takes the surplus out.

use crate::camera::{Size, room};

/// A window of an image sensor, and the image in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column and row of the image, counted in what the sensor puts out.
    first: [u16; 2],
    /// The image.
    pub size: Size,
}

impl Crop {
    /// The window in the middle of `full`. The image is not larger than that, nor its rows when they are filled up.
    pub const fn centred(size: Size, full: Size) -> Self {
        let [width, height] = size;
        let first = [(full[0] - width) / 2, (full[1] - height) / 2];
        Self { first, size }
    }

    /// Pixels of a row in memory.
    const fn stride(&self) -> u16 {
        self.size[0].next_multiple_of(4)
    }

    /// Bytes in memory.
    pub const fn bytes(&self) -> usize {
        room(self.size)
    }

    /// The register DCMI_CWSTRT: first row, first column in pixel clocks.
    pub const fn start(&self) -> u32 {
        (self.first[1] as u32) << 16 | self.first[0] as u32
    }

    /// The register DCMI_CWSIZE: rows less one, pixel clocks of a row less one.
    pub const fn extent(&self) -> u32 {
        (self.size[1] as u32 - 1) << 16 | (self.stride() as u32 - 1)
    }
}

/// Moves the rows together, so that one follows the other.
pub fn squeeze(memory: &mut [u8], crop: &Crop) {
    let (width, stride) = (usize::from(crop.size[0]), usize::from(crop.stride()));
    for row in 1..usize::from(crop.size[1]) {
        // The part of the memory from the row's new place on: never longer ahead of its old one than itself.
        let gap = row * (stride - width);
        let Some(rest) = memory.get_mut(row * width..row * stride + width) else {
            return;
        };
        for at in 0..width {
            if let Some(&pixel) = rest.get(at + gap)
                && let Some(place) = rest.get_mut(at)
            {
                *place = pixel;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_window_is_in_the_middle_and_its_rows_are_whole_words() {
        let crop = Crop::centred([250, 250], [456, 450]);
        assert_eq!(crop.start(), 100 << 16 | 103);
        assert_eq!(crop.extent(), 249 << 16 | 251);
        assert_eq!(crop.bytes(), 252 * 250);
        assert_eq!(Crop::centred([400, 240], [456, 450]).bytes(), 400 * 240);
    }

    #[test]
    fn squeezed_rows_follow_each_other() {
        for width in [5, 6, 7, 8] {
            let crop = Crop::centred([width, 3], [20, 20]);
            let width = usize::from(width);
            let mut memory: Vec<u8> = (0..3u8)
                .flat_map(|row| (0..8).map(move |at| 10 * row + at))
                .take(crop.bytes())
                .collect();
            squeeze(&mut memory, &crop);
            let expected: Vec<u8> = (0..3u8)
                .flat_map(|row| (0..width as u8).map(move |at| 10 * row + at))
                .collect();
            assert_eq!(memory[..3 * width], expected);
        }
    }

    #[test]
    fn memory_that_is_too_short_is_left_as_it_is() {
        let mut memory = [1, 2, 3, 4, 5, 6];
        squeeze(&mut memory, &Crop::centred([5, 2], [8, 2]));
        assert_eq!(memory, [1, 2, 3, 4, 5, 6]);
    }
}
