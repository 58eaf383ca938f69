//! Which columns of the image each slit's line is looked for in.
//!
//! Height moves both lines together: over ±10 mm each crosses nearly half of the image, and at the ends of that range one stands
//! where the other may. So the pair is found first: the light of every eighth row is summed by columns, and the two places, about
//! as far apart as the slits, that stand out most are the lines. Each is then looked for within half their distance.

use crate::vision::image::{self, IMAGE_MAX, View};

/// Every so many rows are summed: 30 rows see the line between drop-outs.
const ROW_PITCH: usize = 8;
/// Neighbouring columns summed, a bin: the lines need not be known finer.
const COLUMNS: usize = 4;
/// Most bins of an image.
const BINS: usize = IMAGE_MAX / COLUMNS;
/// A row's part of a bin is cut at this level, 160 to the pixel, that a glint counts as no more than a bright line.
const CEILING: u32 = 160 * COLUMNS as u32;
/// Width over which light is summed, bins: 32 px, a line that leans by 0.15 px per row.
const BOX: usize = 8;
/// Distance of the lines may differ by this from the slits', bins: 24 px, 3 mm of height between the slits, 8° of pitch.
const STRETCH: usize = 6;
/// Half the columns in which a line is looked for, px: half the distance of the lines, so that one never sees the other.
pub const REACH: usize = 84;

/// First columns and widths of the parts of the image in which the two lines are looked for; `expected` are the columns of
/// the lines with the sheet at z = 0, and `travel` how far (px) it may be from there.
pub fn of_lines(view: &View, expected: [usize; 2], travel: usize) -> [(usize, usize); 2] {
    let light = stands_out(view);
    let [near, ahead] = expected.map(|x| x / COLUMNS);
    let travel = travel / COLUMNS;
    let distance = ahead.saturating_sub(near);
    let mut best = (i32::MIN, near, ahead);
    // Half-open: an inclusive range costs a comparison more.
    let end = near.saturating_add(travel).saturating_add(1);
    for bin in near.saturating_sub(travel)..end {
        let Some(&score) = light.get(bin) else { break };
        let away = bin.abs_diff(near) as i32;
        let first = (bin + distance).saturating_sub(STRETCH);
        let others = light.get(first..).unwrap_or(&[]).iter().take(2 * STRETCH + 1);
        for (&other_score, other) in others.zip(first..) {
            // Of what is nearly as good, the one nearer to the expected: a lone line is not half of a pair at the range's end.
            let both = score + other_score;
            let both = both - both / 8 * away / (travel as i32).max(1);
            if both > best.0 {
                best = (both, bin, other);
            }
        }
    }
    let (_, near, ahead) = best;
    [near, ahead].map(|bin| {
        // The box about a bin is centred on its first column.
        let x = bin * COLUMNS;
        let left = x.saturating_sub(REACH);
        (left, (x + REACH).min(view.width()).saturating_sub(left))
    })
}

/// By how much the light about each bin exceeds that to both sides.
fn stands_out(view: &View) -> [i32; BINS] {
    let mut cumulative = [0_i32; BINS + 1];
    for y in (ROW_PITCH / 2..view.height()).step_by(ROW_PITCH) {
        let (row, _) = view.row(y).as_chunks::<COLUMNS>();
        for (sum, &four) in cumulative.iter_mut().skip(1).zip(row) {
            *sum += image::sum([four]).min(CEILING) as i32;
        }
    }
    let bins = view.width() / COLUMNS;
    let mut total = 0;
    for sum in cumulative.iter_mut().take(bins + 1) {
        total += *sum;
        *sum = total;
    }
    let from = |bin: usize| cumulative.get(bin.min(bins)).copied().unwrap_or(0);
    let mut light = [0_i32; BINS];
    for (bin, light) in light.iter_mut().enumerate().take(bins) {
        let (left, right) = (bin.saturating_sub(BOX / 2), bin + BOX / 2);
        let inside = from(right) - from(left);
        let (before, after) = (
            from(left) - from(left.saturating_sub(BOX)),
            from(right + BOX) - from(right),
        );
        // At the image's border there is one side only.
        let beside = if left < BOX {
            2 * after
        } else if right + BOX > bins {
            2 * before
        } else {
            before + after
        };
        *light = 2 * inside - beside;
    }
    light
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec;

    /// Centre columns of the parts of an image whose lines (column at the middle row, brightness) lean by 0.07 px per row.
    fn found(lines: &[(f32, u8)]) -> [usize; 2] {
        let mut pixels = vec![20_u8; 400 * 240];
        for (y, row) in pixels.chunks_exact_mut(400).enumerate() {
            for (x, pixel) in row.iter_mut().enumerate() {
                *pixel += (x / 20) as u8; // ambient light from one side
            }
            for &(x, level) in lines {
                let x = (x + 0.07 * (y as f32 - 120.0)) as usize;
                row[x - 3..=x + 3].fill(level);
            }
        }
        let view = View::new(&pixels, 400, 240).unwrap();
        of_lines(&view, [114, 284], 92).map(|(left, width)| left + width / 2)
    }

    #[test]
    fn the_pair_is_found_wherever_its_height_puts_it() {
        for height in [-85, -50, 0, 50, 91] {
            let (near, ahead) = (114.0 - height as f32, 284.0 - height as f32);
            let [a, b] = found(&[(near, 110), (ahead, 80)]);
            // Parts that the image's border cuts short lean away from it.
            assert!(
                (a as f32 - near).abs() < 34.0 && (b as f32 - ahead).abs() < 34.0,
                "{a}, {b} at {height} px"
            );
        }
    }

    #[test]
    fn a_lone_line_belongs_to_the_slit_whose_range_it_is_in() {
        let [near, _] = found(&[(180.0, 110)]);
        let [_, ahead] = found(&[(215.0, 110)]);
        assert!(
            (near as f32 - 180.0).abs() < 20.0 && (ahead as f32 - 215.0).abs() < 20.0,
            "{near}, {ahead}"
        );
    }

    #[test]
    fn a_ghost_beside_one_line_does_not_draw_the_pair_away() {
        let [near, ahead] = found(&[(90.0, 110), (260.0, 110), (320.0, 90)]);
        assert!(
            (near as f32 - 90.0).abs() < 20.0 && (ahead as f32 - 260.0).abs() < 20.0,
            "{near}, {ahead}"
        );
    }
}
