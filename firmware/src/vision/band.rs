//! Places where a line may run, band by band.
//!
//! A band is two neighbouring rows of every four. Across it a box as wide as the line, less the background to both
//! sides, is largest on the line. Pixels are cut at a ceiling, so that a glint counts as no more than a bright line.

use super::image::{SIDE_MAX, View};

/// Rows from a band to the next. A quarter of the image's rows is enough to follow a line: sheets bend over 100 rows.
pub const PITCH: usize = 4;
/// Rows summed in a band. Two average the speckle, whose grains are about two rows high.
const ROWS: usize = 2;
/// Most bands of an image.
pub const BANDS: usize = SIDE_MAX / PITCH;
/// Candidates kept per band: the line, two ghosts and a glint.
pub const CANDIDATES: usize = 4;
/// Pixels are cut at this level: a matt line's brightness is below, a glint's above.
const CEILING: u16 = 160;
/// Two candidates are at least this far apart, px: the width of the line.
const SEPARATION: usize = 7;

/// A place where a line may run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Candidate {
    /// Centre, px.
    pub x: f32,
    /// Grey levels by which it is brighter than the background; zero for no candidate.
    pub contrast: f32,
}

/// Number of bands in an image of `height` rows.
pub fn count(height: usize) -> usize {
    (height / PITCH).min(BANDS)
}

/// Cumulative sums at the borders of the strips of the filter: background 5, guard 4, line 7, guard 4, background 5.
const SPAN: usize = 26;
const MIDDLE: usize = 12;

/// The strongest candidates of one band, strongest first; those weaker than `floor` grey levels are left out.
pub fn candidates(view: &View, band: usize, floor: f32) -> [Candidate; CANDIDATES] {
    let mut columns = [0_u16; SIDE_MAX];
    for row in 0..ROWS {
        let pixels = view.row(band * PITCH + 1 + row);
        for (sum, &pixel) in columns.iter_mut().zip(pixels) {
            *sum += u16::from(pixel).min(CEILING);
        }
    }
    let mut cumulative = [0_u32; SIDE_MAX + 1];
    let mut total = 0;
    for (sum, &column) in cumulative.iter_mut().skip(1).zip(&columns) {
        total += u32::from(column);
        *sum = total;
    }
    let in_image = cumulative.get(..=view.width()).unwrap_or(&[]);
    let mut found = [Candidate::default(); CANDIDATES];
    let mut peak = (0_i32, 0_usize);
    for (left, strips) in in_image.windows(SPAN).enumerate() {
        let Some(
            &[
                a,
                _,
                _,
                _,
                _,
                b,
                _,
                _,
                _,
                c,
                _,
                _,
                _,
                _,
                _,
                _,
                d,
                _,
                _,
                _,
                e,
                _,
                _,
                _,
                _,
                f,
            ],
        ) = strips.first_chunk()
        else {
            continue;
        };
        // Line 7 px and background 10 px wide, on a common denominator of 70.
        let score = 10 * (d - c) as i32 - 7 * (b - a + f - e) as i32;
        let at = left + MIDDLE;
        if score > peak.0 {
            peak = (score, at);
        } else if at > peak.1 + SEPARATION && peak.0 > 0 {
            keep(&mut found, peak, floor);
            peak = (0, at);
        }
    }
    keep(&mut found, peak, floor);
    found
}

/// Inserts a peak in order of contrast.
fn keep(found: &mut [Candidate; CANDIDATES], (score, at): (i32, usize), floor: f32) {
    let mut new = Candidate {
        x: at as f32,
        contrast: score as f32 / (70.0 * ROWS as f32),
    };
    if new.contrast < floor {
        return;
    }
    for kept in found {
        if new.contrast > kept.contrast {
            core::mem::swap(kept, &mut new);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_its_ghost_are_found_in_order_of_brightness() {
        let mut pixels = [10_u8; 250 * 250];
        for row in pixels.chunks_exact_mut(250) {
            row[97..=103].fill(60);
            row[147..=153].fill(110);
        }
        let view = View::new(&pixels, 250, 250).unwrap();
        let found = candidates(&view, 30, 5.0);
        assert_eq!((found[0].x, found[1].x), (150.0, 100.0));
        assert_eq!((found[0].contrast, found[1].contrast), (100.0, 50.0));
        assert_eq!(found[2].contrast, 0.0);
    }
}
