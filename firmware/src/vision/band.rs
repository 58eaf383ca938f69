//! Places where a line may run, band by band.
//!
//! A band is two neighbouring rows of every eight. Across it a box as wide as the line, less the background to both
//! sides, is largest on the line. Pixels are cut at a ceiling, so that a glint counts as no more than a bright line.

use super::image::{self, SIDE_MAX, View};

/// Rows from a band to the next. A quarter of the image's rows is enough to follow a line: sheets bend over 100 rows, and with twice
/// as many bands no more joints are found.
pub const PITCH: usize = 8;
/// Rows summed in a band. Two average the speckle, whose grains are about two rows high.
const ROWS: usize = 2;
/// Most bands of an image.
pub const BANDS: usize = SIDE_MAX / PITCH;
/// Candidates kept per band: the line, two ghosts and a glint.
pub const CANDIDATES: usize = 4;
/// Sums of two by four pixels are cut at this level, 160 to the pixel: a matt line's brightness is below, a glint's above.
const CEILING: u32 = 160 * (ROWS * COLUMNS) as u32;
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

/// Neighbouring columns summed: the line is one to two sums wide, and its track need not be finer.
const COLUMNS: usize = 4;
/// Sums of the filter: background 1, guard 1, line 2, guard 1, background 1.
const SPAN: usize = 6;
/// Pixels of the line in the filter.
const FILTERED: i32 = (2 * ROWS * COLUMNS) as i32;
/// From the first sum's first column to the middle of the line, px.
const MIDDLE: usize = 3 * COLUMNS - 1;

/// The strongest candidates of one band, strongest first; those of no more than `floor` grey levels are left out.
pub fn candidates(view: &View, band: usize, floor: u8) -> [Candidate; CANDIDATES] {
    let first = band * PITCH + 1;
    let (upper, _) = view.row(first).as_chunks::<COLUMNS>();
    let (lower, _) = view.row(first + ROWS - 1).as_chunks::<COLUMNS>();
    let mut sums = upper.iter().zip(lower).map(|(&upper, &lower)| sum(upper, lower));
    // The latest sums, the oldest first: the filter answers as they come, and nothing is stored.
    let mut latest = [0_i32; SPAN - 1];
    for (slot, sum) in latest.iter_mut().zip(sums.by_ref()) {
        *slot = sum;
    }
    let mut found = [Candidate::default(); CANDIDATES];
    let floor = i32::from(floor) * FILTERED;
    let mut peak = (floor, 0_usize);
    // Beyond this column a peak is complete; nowhere while there is none.
    let mut complete = usize::MAX;
    let mut at = MIDDLE;
    for newest in sums {
        let [oldest, guard, left, right, after] = latest;
        latest = [guard, left, right, after, newest];
        let score = left + right - oldest - newest;
        if score > peak.0 {
            peak = (score, at);
            complete = at + SEPARATION;
        } else if at > complete {
            keep(&mut found, peak);
            peak = (floor, at);
            complete = usize::MAX;
        }
        at += COLUMNS;
    }
    if complete < usize::MAX {
        keep(&mut found, peak);
    }
    found
}

/// Sum of two rows of four pixels, cut at [`CEILING`].
fn sum(upper: [u8; COLUMNS], lower: [u8; COLUMNS]) -> i32 {
    image::sum([upper, lower]).min(CEILING) as i32
}

/// Inserts a peak in order of contrast.
fn keep(found: &mut [Candidate; CANDIDATES], (score, at): (i32, usize)) {
    let mut new = Candidate {
        x: at as f32,
        contrast: score as f32 / FILTERED as f32,
    };
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
        let found = candidates(&view, 15, 5);
        assert!((found[0].x - 150.0).abs() <= 2.0 && (found[1].x - 100.0).abs() <= 2.0);
        // Of the filter's eight columns the line fills six or seven, as its columns lie to the sums'.
        assert_eq!((found[0].contrast, found[1].contrast), (75.0, 43.75));
        assert_eq!(found[2].contrast, 0.0);
    }
}
