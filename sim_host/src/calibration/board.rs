//! The chessboard: how many inner corners, how far apart.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context, Result};
use nalgebra::Point3;

/// Inner corners along a side that a board may have: three give the detector a middle to grow from, and 50 keep one view
/// below 2500 corners.
pub const CORNERS_PER_SIDE: std::ops::RangeInclusive<usize> = 3..=50;

/// Inner corners of a chessboard, counted as OpenCV does: a board of 10 × 7 squares is 9x6.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Corners in a row, along the board's x.
    pub columns: usize,
    /// Corners in a column, along the board's y.
    pub rows: usize,
}

impl Grid {
    /// How many corners there are.
    pub fn corners(self) -> usize {
        self.columns * self.rows
    }
}

impl FromStr for Grid {
    type Err = anyhow::Error;

    /// Reads `9x6`.
    fn from_str(text: &str) -> Result<Self> {
        let side = |text: &str| text.parse().ok().filter(|side| CORNERS_PER_SIDE.contains(side));
        let read = || {
            let (columns, rows) = text.split_once('x')?;
            Some(Self {
                columns: side(columns)?,
                rows: side(rows)?,
            })
        };
        read().with_context(|| {
            format!(
                "must be COLUMNSxROWS of inner corners, each from {} to {}, as 9x6",
                CORNERS_PER_SIDE.start(),
                CORNERS_PER_SIDE.end()
            )
        })
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.columns, self.rows)
    }
}

/// A chessboard of known size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Its inner corners.
    pub grid: Grid,
    /// Side of a square, m.
    pub square_m: f64,
}

impl Board {
    /// Corners in Σ_W, m, row by row from the origin; z = 0.
    pub fn points(&self) -> Vec<Point3<f64>> {
        let Grid { columns, rows } = self.grid;
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column as f64, row as f64)))
            .map(|(x, y)| Point3::new(x * self.square_m, y * self.square_m, 0.0))
            .collect()
    }

    /// Middle of the corners in Σ_W, m.
    pub fn centre(&self) -> Point3<f64> {
        let half = |count: usize| (count - 1) as f64 * self.square_m / 2.0;
        Point3::new(half(self.grid.columns), half(self.grid.rows), 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_reads_as_opencv_counts_it_and_its_corners_go_row_by_row() {
        let grid: Grid = "9x6".parse().expect("a grid");
        assert_eq!((grid.columns, grid.rows, grid.to_string().as_str()), (9, 6, "9x6"));
        let board = Board { grid, square_m: 0.025 };
        let points = board.points();
        assert_eq!(points.len(), 54);
        assert_eq!(points[1], Point3::new(0.025, 0.0, 0.0));
        assert_eq!(points[9], Point3::new(0.0, 0.025, 0.0));
        assert_eq!(board.centre(), Point3::new(0.1, 0.0625, 0.0));
    }

    #[test]
    fn a_grid_that_is_none_is_refused_by_name_value_and_range() {
        let error = |text: &str| format!("{:#}", text.parse::<Grid>().expect_err("no grid"));
        for text in ["54", "9x", "2x6", "9x51", "-9x6"] {
            assert_eq!(
                error(text),
                "must be COLUMNSxROWS of inner corners, each from 3 to 50, as 9x6"
            );
        }
    }
}
