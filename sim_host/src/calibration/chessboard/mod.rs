//! Finding a chessboard's inner corners in a photograph.
//!
//! [`saddle`] finds every point where four sectors alternate between dark and bright; [`grid`] joins those that continue
//! one another into a board; [`subpixel`] puts each corner where the grey values say it is. Tried on the image and on
//! halves of it, finest first, so that large or blurred boards are found as well.

mod grid;
mod plane;
mod saddle;
mod subpixel;

use anyhow::{Result, bail};

use super::Pixel;
use super::board::Grid;
use crate::image_file::GreyImage;
use plane::Plane;

/// How often the image is halved before it is given up. 3: squares up to eight times as blurred as those of the finest.
const HALVINGS: u32 = 3;

/// Corners of the board, px: row by row, x along the rows, y to the right of x as in the image, whose y is down.
///
/// A board with an odd sum of columns and rows has one such order that begins between dark squares, and that is taken;
/// otherwise the order that begins nearest to the image's top left. An error says how much of a board was found.
pub fn find(image: &GreyImage, grid: Grid) -> Result<Vec<Pixel>> {
    let full = Plane::of_image(image);
    let mut plane = full.clone();
    let mut largest = 0;
    for halvings in 0..=HALVINGS {
        let saddles = saddle::find(&plane);
        match grid::assemble(&saddles, grid) {
            Ok(corners) => {
                let scale = f64::from(1_u32 << halvings);
                // Pixel centres: the centre of a halved pixel lies between those of its parts.
                let start: Vec<Pixel> =
                    corners.iter().map(|corner| corner.map(|at| (at + 0.5) * scale - 0.5)).collect();
                return subpixel::refine(&full, grid, &start);
            }
            Err(corners) => largest = largest.max(corners),
        }
        plane = plane.halved();
    }
    bail!("no board of {grid} corners: the largest piece of one has {largest}")
}
