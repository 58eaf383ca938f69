//! Finding a chessboard's inner corners in a photograph.
//!
//! `saddle` finds every point where four sectors alternate between dark and bright; `grid` joins those that continue
//! one another into a board; `subpixel` puts each corner where the grey values say it is. Tried on the image and on
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
                let start: Vec<Pixel> = corners
                    .iter()
                    .map(|corner| corner.map(|at| (at + 0.5) * scale - 0.5))
                    .collect();
                return subpixel::refine(&full, grid, &start, halvings);
            }
            Err(corners) => largest = largest.max(corners),
        }
        plane = plane.halved();
    }
    bail!("no board of {grid} corners: the largest piece of one has {largest}")
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::calibration::board::Board;
    use crate::calibration::camera::Camera;
    use crate::calibration::rendered::photograph;

    const GRID: Grid = Grid { columns: 9, rows: 6 };
    const BOARD: Board = Board {
        grid: GRID,
        square_m: 0.025,
    };
    const SIZE: (usize, usize) = (640, 480);
    const CAMERA: Camera = Camera {
        fx: 533.0,
        fy: 533.0,
        cx: 320.0,
        cy: 240.0,
        distortion: [-0.28, 0.03, 0.001, -0.001, 0.1],
    };

    /// The board's centre `distance` before the camera, leaning by `lean` and rolled by `roll` about the view.
    fn pose(distance: f64, lean: [f64; 2], roll: f64) -> Isometry3<f64> {
        let turn = Isometry3::rotation(Vector3::new(lean[0], lean[1], 0.0)) * Isometry3::rotation(Vector3::z() * roll);
        Isometry3::translation(0.0, 0.0, distance) * turn * Isometry3::from(-BOARD.centre().coords)
    }

    /// Root mean square and largest distance of the corners from where they are, px.
    fn errors(t_c_w: &Isometry3<f64>, found: &[Pixel]) -> (f64, f64) {
        let truth = BOARD.points().into_iter().map(|point| CAMERA.project(&(t_c_w * point)));
        let errors: Vec<f64> = truth.zip(found).map(|(truth, found)| (truth - found).norm()).collect();
        let square = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
        (square.sqrt(), errors.into_iter().fold(0.0, f64::max))
    }

    #[test]
    fn corners_come_in_order_to_a_tenth_of_a_pixel_however_the_board_is_turned() {
        for (seed, roll) in (0..12).map(|at| (at, at as f64 * std::f64::consts::TAU / 12.0)) {
            let t_c_w = pose(0.45, [0.4 * roll.cos(), 0.5 * roll.sin()], roll);
            let image = photograph(&BOARD, &CAMERA, SIZE, &t_c_w, None, seed);
            let found = find(&image, GRID).unwrap_or_else(|error| panic!("roll {roll}: {error:#}"));
            // The order itself is checked: a board turned by half a turn has its corners elsewhere.
            // The largest are where an edge runs along the rows of a sharp image, which hides its place within them.
            let (rms, max) = errors(&t_c_w, &found);
            assert!(rms < 0.1 && max < 0.2, "roll {roll}: {rms} px rms, {max} px max");
        }
    }

    #[test]
    fn a_far_board_of_squares_of_twelve_pixels_is_found() {
        let t_c_w = pose(1.1, [0.1, 0.2], 0.3);
        let image = photograph(&BOARD, &CAMERA, SIZE, &t_c_w, None, 1);
        let (_, max) = errors(&t_c_w, &find(&image, GRID).expect("found"));
        assert!(max < 0.2, "{max} px");
    }

    #[test]
    fn a_board_that_is_out_of_focus_is_found_on_a_halved_image() {
        let t_c_w = pose(0.4, [0.3, -0.2], 0.2);
        let sharp = Plane::of_image(&photograph(&BOARD, &CAMERA, SIZE, &t_c_w, None, 1));
        let blurred = sharp.blurred(5.0);
        let pixels = (0..SIZE.0 * SIZE.1)
            .map(|at| blurred.at(at % SIZE.0, at / SIZE.0).round() as u8)
            .collect();
        let found = find(
            &GreyImage {
                width: SIZE.0,
                height: SIZE.1,
                pixels,
            },
            GRID,
        )
        .expect("found");
        let (_, max) = errors(&t_c_w, &found);
        assert!(max < 0.5, "{max} px");
    }

    #[test]
    fn a_covered_corner_a_board_of_another_size_and_no_board_are_refused() {
        let error = |image: &GreyImage, grid: Grid| find(image, grid).expect_err("refused").to_string();
        let t_c_w = pose(0.45, [0.2, 0.3], 0.0);
        let mut image = photograph(&BOARD, &CAMERA, SIZE, &t_c_w, None, 1);
        assert_eq!(
            error(&image, Grid { columns: 8, rows: 5 }),
            "no board of 8x5 corners: the largest piece of one has 54"
        );
        assert_eq!(
            error(&image, Grid { columns: 10, rows: 6 }),
            "no board of 10x6 corners: the largest piece of one has 54"
        );
        let corner = CAMERA.project(&(t_c_w * BOARD.points()[0]));
        for (at, pixel) in image.pixels.iter_mut().enumerate() {
            let off = Pixel::new((at % SIZE.0) as f64, (at / SIZE.0) as f64) - corner;
            if off.norm() < 12.0 {
                *pixel = 100;
            }
        }
        assert_eq!(
            error(&image, GRID),
            "no board of 9x6 corners: the largest piece of one has 53"
        );
        image.pixels.fill(100);
        assert_eq!(
            error(&image, GRID),
            "no board of 9x6 corners: the largest piece of one has 0"
        );
        let tiny = GreyImage {
            width: 3,
            height: 2,
            pixels: vec![0, 255, 0, 255, 0, 255],
        };
        assert_eq!(
            error(&tiny, GRID),
            "no board of 9x6 corners: the largest piece of one has 0"
        );
    }
}
