//! The paper's own seam finder (3.29)–(3.44), for reference: windows of l × h pixels and the statistic D_i.
//!
//! One series of windows follows the slit line from the top of the image down. As printed, with two corrections:
//! D_i is first taken when four windows on the line are behind it, (3.36)/(3.44) having a false maximum at the start;
//! a window without light repeats the last centre, which the paper leaves open. The line is what is brighter than half
//! way between a window's mean and its brightest pixel, for the paper binarises without saying where.

use super::image::View;

/// Window length and height, px (5.2, for 250 × 250).
const L: usize = 50;
/// See [`L`].
const H: usize = 4;
/// A window without this much contrast holds no line, grey levels.
const CONTRAST: u8 = 20;

/// The seam's pixel by the paper's method: where D_i is largest. `None` if no window holds a line.
pub fn seam(view: &View) -> Option<(f32, f32)> {
    let mut left = first_window(view)?;
    let mut changes = [0.0_f32; 4];
    let mut columns = [0.0_f32; 4];
    let mut best = (-1.0_f32, None);
    for index in 0..view.height() / H {
        let y = index * H;
        let m = centroid(view, left, y).unwrap_or(0.5 * L as f32);
        let [_, a, b, c] = changes;
        changes = [a, b, c, m - 0.5 * L as f32];
        let [_, d, e, f] = columns;
        columns = [d, e, f, left as f32 + m];
        if index >= 4 {
            let mut r = changes;
            r.sort_unstable_by(|p, q| q.total_cmp(p));
            let [r1, r2, r3, r4] = r;
            let statistic = (r1 + r2) - (r3 + r4);
            if statistic > best.0 {
                let [_, x, _, _] = columns;
                best = (statistic, Some((x, (y - 2 * H) as f32 + 0.5 * (H as f32 - 1.0))));
            }
        }
        let next = left as f32 + m - 0.5 * L as f32;
        left = (next.max(0.0) as usize).min(view.width() - L);
    }
    best.1
}

/// Left side of the first window in the top row that holds a line (3.30).
fn first_window(view: &View) -> Option<usize> {
    (0..view.width() / L)
        .map(|window| window * L)
        .find(|&left| centroid(view, left, 0).is_some())
}

fn centroid(view: &View, left: usize, y: usize) -> Option<f32> {
    let (mut brightest, mut sum) = (0_u8, 0_u32);
    for row in y..y + H {
        for &pixel in view.span(row, left, left + L) {
            brightest = brightest.max(pixel);
            sum += u32::from(pixel);
        }
    }
    let mean = (sum / (L * H) as u32) as u8;
    if brightest - mean.min(brightest) < CONTRAST {
        return None;
    }
    let threshold = mean / 2 + brightest / 2;
    let (mut mass, mut moment) = (0_u32, 0_u32);
    for row in y..y + H {
        for (x, &pixel) in (0_u32..).zip(view.span(row, left, left + L)) {
            if pixel > threshold {
                mass += 1;
                moment += x;
            }
        }
    }
    (mass > 0).then(|| moment as f32 / mass as f32)
}
