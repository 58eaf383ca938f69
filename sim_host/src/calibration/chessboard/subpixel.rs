//! Where a corner is, to a few hundredths of a pixel.
//!
//! At a corner every grey-value gradient nearby is orthogonal to the way there: the corner is the point that makes the
//! sum of squared products of the two least (W. Förstner and E. Gülch, 1987; OpenCV's `cornerSubPix` is the same, with
//! the same weights, so that figures compare).

use anyhow::{Result, ensure};
use nalgebra::Matrix2;

use super::plane::Plane;
use crate::calibration::Pixel;
use crate::calibration::board::Grid;

/// Half the side of the window, px. 5: with it OpenCV calibrates its own chessboard photographs to 0.195 px.
const HALF_WINDOW_PX: i32 = 5;
/// Smallest half window, px: the gradient needs that much.
const MIN_HALF_WINDOW_PX: i32 = 2;
/// Half window as a share of the distance to the nearest corner, at most: the window must hold one corner.
const MAX_WINDOW_SHARE: f64 = 0.4;
/// Steps, and the step at which the corner stands still, px.
const MAX_STEPS: usize = 50;
const STANDSTILL_PX: f64 = 1e-4;

/// The corners of a grid refined from `start`, px; windows are doubled for each of the `halvings` that it took to find them,
/// for so blurred are they. An error names the first that is not there.
pub fn refine(image: &Plane, grid: Grid, start: &[Pixel], halvings: u32) -> Result<Vec<Pixel>> {
    let spacing = nearest_spacing(grid, start);
    let half = ((spacing * MAX_WINDOW_SHARE) as i32).clamp(MIN_HALF_WINDOW_PX, HALF_WINDOW_PX << halvings);
    let mut corners = Vec::with_capacity(start.len());
    for (at, begin) in start.iter().enumerate() {
        let corner = meeting_point(image, *begin, half);
        let moved = (corner - begin).amax();
        ensure!(
            moved <= f64::from(half),
            "corner {}, {} of the board: its edges do not meet near ({:.1}, {:.1}) px",
            at % grid.columns + 1,
            at / grid.columns + 1,
            begin.x,
            begin.y
        );
        corners.push(corner);
    }
    Ok(corners)
}

/// Least distance between neighbours in a row or column, px.
fn nearest_spacing(grid: Grid, corners: &[Pixel]) -> f64 {
    let distance = |a: usize, b: usize| (corners[a] - corners[b]).norm();
    let in_rows = (0..corners.len())
        .filter(|at| at % grid.columns != 0)
        .map(|at| distance(at, at - 1));
    let in_columns = (grid.columns..corners.len()).map(|at| distance(at, at - grid.columns));
    in_rows.chain(in_columns).fold(f64::MAX, f64::min)
}

/// Where the edges meet in a window of `half` px to each side that follows the point from `start`; a point that leaves the
/// window about the start is given as it left.
pub fn meeting_point(image: &Plane, start: Pixel, half: i32) -> Pixel {
    let mut corner = start;
    for _ in 0..MAX_STEPS {
        let (mut matrix, mut right) = (Matrix2::zeros(), Pixel::zeros());
        for row in -half..=half {
            for column in -half..=half {
                let offset = Pixel::new(f64::from(column), f64::from(row));
                let weight = (-offset.norm_squared() / f64::from(half * half)).exp();
                let (x, y) = (corner.x + offset.x, corner.y + offset.y);
                let gradient = Pixel::new(
                    image.sample(x + 1.0, y) - image.sample(x - 1.0, y),
                    image.sample(x, y + 1.0) - image.sample(x, y - 1.0),
                );
                let product = gradient * gradient.transpose() * weight;
                matrix += product;
                right += product * offset;
            }
        }
        let Some(inverse) = matrix.try_inverse() else {
            break; // a window without edges: nothing says where the corner is
        };
        let step = inverse * right;
        corner += step;
        if step.norm() < STANDSTILL_PX || (corner - start).amax() > f64::from(half) {
            break;
        }
    }
    corner
}
