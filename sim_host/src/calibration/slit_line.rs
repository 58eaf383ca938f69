//! The slit's line in a photograph of a board, by comparison with a photograph of the same place without the slit.
//!
//! The difference of the two shows the light alone, whatever is printed on the board. In every row the centre of its
//! brightest run counts, and a smooth curve through the rows tells line from reflections.

use anyhow::{Result, ensure};
use nalgebra::{Matrix3, Vector3};

use super::Pixel;
use crate::image_file::GreyImage;

/// Least brightness that the slit adds, grey values: several times the noise of the difference of two photographs.
const MIN_BRIGHTNESS: i32 = 25;
/// The centre of a row is that of the light within this distance of its brightest pixel, px: half the width of the paper's
/// line (6 to 12 px).
const REACH_PX: usize = 6;
/// Rows that must show the line.
const MIN_ROWS: usize = 10;
/// Rows between which a first line is drawn: every pair of so many.
const FIRST_ROWS: usize = 40;
/// Distance from the first line, then from the curve through what it keeps, up to which a row counts, px: the line of a
/// distorting lens bends by less than the first, its centres scatter by less than the second.
const FIRST_OUTLIER_PX: f64 = 4.0;
const OUTLIER_PX: f64 = 0.5;

/// Centres of the line where `on_board` holds, px, a row each from the top. `dark` is the same place with the slit off.
pub fn find(lit: &GreyImage, dark: &GreyImage, on_board: impl Fn(&Pixel) -> bool) -> Result<Vec<Pixel>> {
    ensure!(
        (lit.width, lit.height) == (dark.width, dark.height),
        "size {} × {} px: must be {} × {} as without the slit",
        lit.width,
        lit.height,
        dark.width,
        dark.height
    );
    let rows = lit
        .pixels
        .chunks_exact(lit.width)
        .zip(dark.pixels.chunks_exact(dark.width));
    let mut centres: Vec<Pixel> = rows
        .enumerate()
        .filter_map(|(y, (lit, dark))| Some(Pixel::new(centre(lit, dark)?, y as f64)))
        .filter(on_board)
        .collect();
    enough(&centres)?;
    let line = first_line(&centres);
    centres.retain(|centre| (centre.x - line.dot(&powers(centre))).abs() <= FIRST_OUTLIER_PX);
    enough(&centres)?;
    let curve = parabola(&centres);
    centres.retain(|centre| (centre.x - curve.dot(&powers(centre))).abs() <= OUTLIER_PX);
    enough(&centres)?;
    Ok(centres)
}

fn enough(centres: &[Pixel]) -> Result<()> {
    ensure!(
        centres.len() >= MIN_ROWS,
        "{} rows show the slit's line: must be at least {MIN_ROWS}",
        centres.len()
    );
    Ok(())
}

/// Centre of the light that the slit adds in one row, px; none where it adds too little.
fn centre(lit: &[u8], dark: &[u8]) -> Option<f64> {
    let added: Vec<i32> = lit
        .iter()
        .zip(dark)
        .map(|(lit, dark)| i32::from(*lit) - i32::from(*dark))
        .collect();
    let (peak, brightness) = added
        .iter()
        .copied()
        .enumerate()
        .max_by_key(|(at, added)| (*added, usize::MAX - at))?;
    if brightness < MIN_BRIGHTNESS {
        return None;
    }
    // Below a quarter of the peak it is halo and noise, which would draw the centre to the middle of the reach.
    let floor = brightness / 4;
    let window = peak.saturating_sub(REACH_PX)..(peak + REACH_PX + 1).min(added.len());
    let weights = window.map(|x| (x as f64, f64::from((added[x] - floor).max(0))));
    let (sum, moment) = weights.fold((0.0, 0.0), |(sum, moment), (x, weight)| {
        (sum + weight, moment + x * weight)
    });
    Some(moment / sum)
}

fn powers(centre: &Pixel) -> Vector3<f64> {
    Vector3::new(1.0, centre.y, centre.y * centre.y)
}

/// Line x = a + b y through two of the centres with the least median distance from all of them: reflections may be nearly
/// half of the rows (P. Rousseeuw, Least median of squares regression, JASA 79 (1984) 871).
fn first_line(centres: &[Pixel]) -> Vector3<f64> {
    let step = centres.len().div_ceil(FIRST_ROWS);
    let ends: Vec<&Pixel> = centres.iter().step_by(step).collect();
    let lines = ends
        .iter()
        .enumerate()
        .flat_map(|(at, a)| ends[at + 1..].iter().map(move |b| through(a, b)));
    let scored = lines.map(|line| {
        let mut distances: Vec<f64> = centres
            .iter()
            .map(|centre| (centre.x - line.dot(&powers(centre))).abs())
            .collect();
        distances.sort_by(f64::total_cmp);
        (distances[distances.len() / 2], line)
    });
    scored
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(Vector3::zeros(), |(_, line)| line)
}

/// Line through two centres of different rows.
fn through(a: &Pixel, b: &Pixel) -> Vector3<f64> {
    let slope = (b.x - a.x) / (b.y - a.y);
    Vector3::new(a.x - slope * a.y, slope, 0.0)
}

/// x = a + b y + c y² with the least sum of squares; without curvature where the rows do not tell.
fn parabola(centres: &[Pixel]) -> Vector3<f64> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for centre in centres {
        matrix += powers(centre) * powers(centre).transpose();
        right += powers(centre) * centre.x;
    }
    matrix.cholesky().map_or_else(
        || through(&centres[0], &centres[centres.len() - 1]),
        |factors| factors.solve(&right),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 200;
    const HEIGHT: usize = 120;

    /// A chequered ground, and the same with a line of light at x = 80 + 0.3 y and, in every third row, a brighter glint.
    fn pair(glints: bool) -> (GreyImage, GreyImage) {
        let ground = |x: usize, y: usize| {
            if (x / 12 + y / 12).is_multiple_of(2) {
                40.0
            } else {
                90.0
            }
        };
        let image = |light: &dyn Fn(f64, usize) -> f64| GreyImage {
            width: WIDTH,
            height: HEIGHT,
            pixels: (0..WIDTH * HEIGHT)
                .map(|at| (ground(at % WIDTH, at / WIDTH) + light((at % WIDTH) as f64, at / WIDTH)).round() as u8)
                .collect(),
        };
        let peak = |x: f64, at: f64, height: f64| height * (-0.5 * ((x - at) / 1.8).powi(2)).exp();
        let lit = image(&|x, y| {
            let glint = if glints && y % 3 == 0 {
                peak(x, 20.0 + (y * 37 % 150) as f64, 150.0)
            } else {
                0.0
            };
            peak(x, 80.0 + 0.3 * y as f64, 100.0) + glint
        });
        (lit, image(&|_, _| 0.0))
    }

    #[test]
    fn the_line_is_found_to_a_tenth_of_a_pixel_among_glints() {
        let (lit, dark) = pair(true);
        let centres = find(&lit, &dark, |_| true).expect("a line");
        assert!(centres.len() >= 75, "{} rows", centres.len());
        let square = |centre: &Pixel| (centre.x - 80.0 - 0.3 * centre.y).powi(2);
        let rms = (centres.iter().map(square).sum::<f64>() / centres.len() as f64).sqrt();
        assert!(rms < 0.1, "{rms} px");
    }

    #[test]
    fn light_beside_the_board_does_not_count() {
        let (lit, dark) = pair(false);
        let centres = find(&lit, &dark, |centre| centre.y < 50.0).expect("a line");
        assert_eq!(centres.len(), 50);
    }

    #[test]
    fn a_photograph_without_the_slit_is_refused() {
        let (_, dark) = pair(false);
        let error = find(&dark, &dark, |_| true).expect_err("no line");
        assert_eq!(error.to_string(), "0 rows show the slit's line: must be at least 10");
    }
}
