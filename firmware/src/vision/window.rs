//! The line's centre in every row, from a window about its track.
//!
//! In the window the brightest place as wide as the line is found first; the centroid of what is brighter than a tenth
//! of it is then taken twice within a trimmed span, the second time about the first's centre. Pixels are cut at eight tenths of the
//! line's own brightness, so that a grain of speckle or a glint pulls no more than the line does.

use super::band::{self, BANDS};
use super::edge::Light;
use super::fit::Sample;
use super::image::{SIDE_MAX, View};
use super::number::limit;
use super::track::Track;

/// The window reaches this far beyond the track to either side, px: a step of 7 px and half the line's width.
const REACH: f32 = 10.0;
/// Widest window, px: a sheet edge's drop between two bands, and the reach.
const WIDEST: usize = 64;
/// Width of the box that finds the line, px.
const BOX: usize = 5;
/// Half the trimmed span, px: the half width of a line that is 10 px wide at half its height, and what defocus of 5 mm adds. On the harsh
/// surface centres scatter by a tenth less than with 6 px.
const TRIM: i32 = 8;
/// A saturated pixel.
const SATURATED: u8 = 250;
/// More saturated pixels than this in a row are glare, px: a line does not saturate over its whole width.
const GLARE: usize = 4;
/// Sum of a box that may hold them.
const GLARE_SUM: u32 = 2 * SATURATED as u32;
/// Weight of a row with glare: its centre may lie beside the line's by its own width.
const GLARE_WEIGHT: f32 = 0.5;
/// A row whose contrast is below this share of the usual has dropped out.
const DROP_OUT: f32 = 0.08;

/// Rows from one that is read to the next: neighbouring rows share speckle grains, and what the second adds is little.
const EACH: usize = 2;

/// The line, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Centre by row, px; meaningless where the weight is zero.
    pub x: [f32; SIDE_MAX],
    /// Weight by row: 0 not seen, 1 well seen.
    pub weight: [f32; SIDE_MAX],
    /// Rows of the image.
    pub rows: usize,
    /// Rows with a weight.
    pub seen: usize,
    /// Rows with glare.
    pub glare: usize,
    /// Brightness of the line.
    pub light: Light,
}

/// Reads the windows about `track`; `typical` is the line's usual contrast in grey levels.
pub fn read(view: &View, track: &Track, typical: f32) -> Line {
    let mut line = Line {
        x: [0.0; SIDE_MAX],
        weight: [0.0; SIDE_MAX],
        rows: view.height(),
        seen: 0,
        glare: 0,
        light: Light {
            background: 0.0,
            contrast: typical,
        },
    };
    let (mut background, mut read) = (0.0_f32, 0.0_f32);
    let mut spans = [None; BANDS + 1];
    for (band, span) in spans.iter_mut().enumerate().take(band::count(line.rows) + 2) {
        *span = between(track, band);
    }
    let rows = line.x.iter_mut().zip(&mut line.weight).take(line.rows);
    for (y, (x, weight)) in rows.enumerate().step_by(EACH) {
        // Row y lies between the middles of bands `below − 1` and `below`.
        let below = (y + band::PITCH - 2) / band::PITCH;
        let Some(&Some((low, high))) = spans.get(below) else {
            continue;
        };
        let from = (low - REACH).max(0.0) as usize;
        let to = ((high + REACH) as usize + 1).min(view.width()).min(from + WIDEST);
        let window = view.span(y, from, to);
        let Some(centre) = centre(window, typical) else {
            continue;
        };
        background += centre.background;
        read += 1.0;
        let relative = centre.contrast / typical;
        if relative < DROP_OUT {
            continue;
        }
        *x = from as f32 + centre.x;
        *weight = (4.0 * (relative - DROP_OUT)).min(1.0);
        line.seen += EACH;
        if centre.saturated > GLARE {
            *weight *= GLARE_WEIGHT;
            line.glare += EACH;
        }
    }
    line.light.background = background / read.max(1.0);
    line
}

/// Standard deviation of a row's centre, px, from second differences over eight rows.
pub fn roughness(line: &Line) -> f32 {
    const LAG: usize = 4;
    /// What a step or an outlier may add at most, px.
    const CUT: f32 = 5.0;
    let mut rows = line.x.iter().zip(&line.weight).take(line.rows).step_by(EACH);
    let mut latest = [(0.0_f32, 0.0_f32); 2 * LAG / EACH];
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    for slot in &mut latest {
        if let Some((&x, &weight)) = rows.next() {
            *slot = (x, weight);
        }
    }
    for (&x, &weight) in rows {
        let [a, next, b, last] = latest;
        latest = [next, b, last, (x, weight)];
        if a.1 > 0.5 && b.1 > 0.5 && weight > 0.5 {
            let bend = a.0 - 2.0 * b.0 + x;
            sum += limit(if bend < 0.0 { -bend } else { bend }, 0.0, CUT);
            count += 1.0;
        }
    }
    if count < 8.0 {
        return 1.5;
    }
    // The mean of |N(0, s)| is 0.80 s; the second difference has √6 times the deviation of one centre.
    limit(sum / count / (0.8 * 2.45), 0.3, 2.0)
}

/// The rows' centres from row `first` on, gathered into samples of `each` rows; samples beyond the line have no weight.
pub fn gather<const SAMPLES: usize>(line: &Line, first: usize, each: usize) -> [Sample; SAMPLES] {
    let mut samples = [Sample::default(); SAMPLES];
    let rows = line.x.iter().zip(&line.weight).take(line.rows);
    let mut rows = rows.enumerate().skip(first);
    for sample in &mut samples {
        let (mut weight, mut moment, mut height) = (0.0_f32, 0.0_f32, 0.0_f32);
        for (y, (x, w)) in rows.by_ref().take(each) {
            if *w > 0.0 {
                weight += w;
                moment += w * x;
                height += w * y as f32;
            }
        }
        if weight > 0.0 {
            *sample = Sample {
                y: height / weight,
                x: moment / weight,
                weight,
            };
        }
    }
    samples
}

/// Columns that the line passes between the bands next above and below; `None` where the track is not seen at all.
fn between(track: &Track, band: usize) -> Option<(f32, f32)> {
    let above = track.x.iter().take(band).rev().take(4).flatten().next();
    let below = track.x.iter().skip(band).take(4).flatten().next();
    match (above, below) {
        (Some(&a), Some(&b)) => Some((a.min(b), a.max(b))),
        (Some(&a), None) | (None, Some(&a)) => Some((a, a)),
        (None, None) => None,
    }
}

struct Centre {
    x: f32,
    background: f32,
    contrast: f32,
    saturated: usize,
}

fn centre(window: &[u8], typical: f32) -> Option<Centre> {
    let mut sum: u32 = window.get(..BOX)?.iter().map(|&pixel| u32::from(pixel)).sum();
    let (mut brightest, mut darkest, mut at) = (sum, sum, 0_i32);
    for ((&new, &old), first) in window.iter().skip(BOX).zip(window).zip(1..) {
        sum = sum + u32::from(new) - u32::from(old);
        if sum > brightest {
            (brightest, at) = (sum, first);
        }
        darkest = darkest.min(sum);
    }
    if brightest <= darkest {
        return None;
    }
    let background = darkest as f32 / BOX as f32;
    let contrast = (brightest - darkest) as f32 / BOX as f32;
    // Cut at what the line usually shows, unless this row is darker.
    let bright = contrast.min(1.3 * typical);
    let threshold = (background + 0.1 * bright) as i32;
    let ceiling = (0.7 * bright) as i32;
    let mut x = at + (BOX as i32) / 2;
    let mut fine = x as f32;
    for _ in 0..2 {
        let first = (x - TRIM).max(0);
        let (mut mass, mut moment) = (0_i32, 0_i32);
        let end = window.len().min((x + TRIM + 1) as usize);
        for (&pixel, index) in window.get(first as usize..end)?.iter().zip(first..) {
            let light = (i32::from(pixel) - threshold).max(0).min(ceiling);
            mass += light;
            moment += light * index;
        }
        if mass <= 0 {
            return None;
        }
        fine = moment as f32 / mass as f32;
        let moved = (fine + 0.5) as i32;
        if moved == x {
            break;
        }
        x = moved;
    }
    // A row without a bright box cannot hold glare.
    let saturated = if brightest > GLARE_SUM {
        window.iter().filter(|&&pixel| pixel >= SATURATED).count()
    } else {
        0
    };
    Some(Centre {
        x: fine,
        background,
        contrast,
        saturated,
    })
}
