//! The line's centre in every other row, from a window about its track.
//!
//! In the window the brightest place as wide as the line is found first; the centroid of what is brighter than a tenth of it is then
//! taken within a trimmed span, which moves along until the centroid is its middle. Pixels are cut at eight tenths of
//! the line's own brightness, so that a grain of speckle or a glint pulls no more than the line does.

use super::band::{self, BANDS};
use super::edge::Light;
use super::image::{self, SIDE_MAX, View};
use super::number::limit;
use super::track::Track;

/// The window reaches this far beyond the track to either side, px: a step of 7 px and half the line's width.
const REACH: f32 = 10.0;
/// Widest window, px: a sheet edge's drop between two bands, and the reach.
const WIDEST: usize = 64;
/// Columns summed to find the line: it is one to two sums wide.
const COLUMNS: usize = 4;
/// Half the trimmed span, px: the half width of a line that is 10 px wide at half its height, and what defocus of 5 mm adds. On the harsh
/// surface centres scatter by a tenth less than with 6 px.
const TRIM: usize = 8;
/// The span, px.
const SPAN: usize = 2 * TRIM + 1;
/// Times that the span moves to its centroid.
const MOVES: usize = 2;
/// A saturated pixel.
const SATURATED: u8 = 250;
/// More saturated pixels than this in a row are glare, px: a line does not saturate over its whole width.
const GLARE: usize = 4;
/// Two sums that may hold them.
const GLARE_SUM: u32 = GLARE as u32 * SATURATED as u32;
/// Weight of a row with glare: its centre may lie beside the line's by its own width.
const GLARE_WEIGHT: f32 = 0.5;
/// A row whose contrast is below this share of the usual has dropped out.
const DROP_OUT: f32 = 0.08;

/// Rows from one that is read to the next: neighbouring rows share speckle grains, and what the second adds is little.
pub const EACH: usize = 2;

/// The line's centre in a row, or in several together.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Row, px.
    pub y: f32,
    /// Centre, px; meaningless where the weight is zero.
    pub x: f32,
    /// Weight: 0 not seen, 1 well seen, and their sum over several rows.
    pub weight: f32,
}

/// The line, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Centre in every [`EACH`]th row, from row 0 on; those beyond the image have no weight.
    pub centres: [Sample; SIDE_MAX / EACH],
    /// Rows of the image.
    pub rows: usize,
    /// Rows with a weight.
    pub seen: usize,
    /// Rows with glare.
    pub glare: usize,
    /// Brightness of the line.
    pub light: Light,
}

impl Line {
    /// Nothing seen yet.
    pub const EMPTY: Self = Self {
        centres: [Sample {
            y: 0.0,
            x: 0.0,
            weight: 0.0,
        }; SIDE_MAX / EACH],
        rows: 0,
        seen: 0,
        glare: 0,
        light: Light {
            background: 0.0,
            contrast: 0.0,
        },
    };

    /// The centres in rows of the image.
    pub fn in_image(&self) -> &[Sample] {
        self.centres.get(..self.rows.div_ceil(EACH)).unwrap_or(&self.centres)
    }

    /// Reads the windows about `track` into an empty line; `typical` is the line's usual contrast in grey levels. In place, as a line is
    /// too large to be handed on for nothing.
    pub fn read(&mut self, view: &View, track: &Track, typical: f32) {
        self.rows = view.height();
        self.light.contrast = typical;
        let (mut background, mut read) = (0.0_f32, 0.0_f32);
        let mut windows = [None; BANDS + 1];
        for (band, window) in windows.iter_mut().enumerate().take(band::count(self.rows) + 1) {
            *window = between(track, band).map(|(low, high)| {
                let from = (low - REACH).max(0.0) as usize;
                let wide = ((high + REACH) as usize + COLUMNS).saturating_sub(from);
                (from, from + wide.min(WIDEST))
            });
        }
        for (y, sample) in (0..self.rows).step_by(EACH).zip(&mut self.centres) {
            // Row y lies between the middles of bands `below − 1` and `below`.
            let below = (y + band::PITCH - 2) / band::PITCH;
            let Some(&Some((from, to))) = windows.get(below.min(band::count(self.rows))) else {
                continue;
            };
            let Some(centre) = centre(view.row(y), from, to, typical) else {
                continue;
            };
            background += centre.background;
            read += 1.0;
            let relative = centre.contrast / typical;
            if relative < DROP_OUT {
                continue;
            }
            *sample = Sample {
                y: y as f32,
                x: centre.x,
                weight: (4.0 * (relative - DROP_OUT)).min(1.0),
            };
            self.seen += EACH;
            if centre.saturated > GLARE {
                sample.weight *= GLARE_WEIGHT;
                self.glare += EACH;
            }
        }
        self.light.background = background / read.max(1.0);
    }

    /// The centres gathered into samples of `each` rows; samples beyond the line have no weight.
    pub fn gather<const SAMPLES: usize>(&self, each: usize) -> [Sample; SAMPLES] {
        let mut samples = [Sample::default(); SAMPLES];
        let mut rows = self.in_image().iter();
        for sample in &mut samples {
            let (mut weight, mut moment, mut height) = (0.0_f32, 0.0_f32, 0.0_f32);
            for row in rows.by_ref().take(each / EACH) {
                weight += row.weight;
                moment += row.weight * row.x;
                height += row.weight * row.y;
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
}

/// Standard deviation of a row's centre, px, from second differences over eight rows.
pub fn roughness(line: &Line) -> f32 {
    const LAG: usize = 4;
    /// What a step or an outlier may add at most, px.
    const CUT: f32 = 5.0;
    let mut rows = line.in_image().iter();
    let mut latest = [(0.0_f32, 0.0_f32); 2 * LAG / EACH];
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    for slot in &mut latest {
        if let Some(row) = rows.next() {
            *slot = (row.x, row.weight);
        }
    }
    for &Sample { x, weight, .. } in rows {
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

/// The line's centre in the window `from..to` of a row.
fn centre(row: &[u8], from: usize, to: usize, typical: f32) -> Option<Centre> {
    let window = row.get(from..to.min(row.len()))?;
    let (fours, _) = window.as_chunks::<COLUMNS>();
    let mut sums = fours.iter().map(|&four| image::sum([four]));
    let mut last = sums.next()?;
    let (mut brightest, mut darkest, mut at) = (0, last, 0);
    for (sum, left) in sums.zip((0..).step_by(COLUMNS)) {
        darkest = darkest.min(sum);
        if last + sum > brightest {
            (brightest, at) = (last + sum, left);
        }
        last = sum;
    }
    if brightest <= 2 * darkest {
        return None;
    }
    let background = darkest as f32 / COLUMNS as f32;
    let contrast = (brightest - 2 * darkest) as f32 / (2 * COLUMNS) as f32;
    // Cut at what the line usually shows, unless this row is darker.
    let bright = contrast.min(1.3 * typical);
    let threshold = (background + 0.1 * bright) as i32;
    let ceiling = (0.7 * bright) as i32;
    let light = |pixel: u8| (i32::from(pixel) - threshold).max(0).min(ceiling);
    let mut middle = from + at + COLUMNS;
    let first = middle.checked_sub(TRIM)?;
    let span = row.get(first..)?.first_chunk::<SPAN>()?;
    let (mut mass, mut moment) = (0_i32, 0_i32);
    for (&pixel, index) in span.iter().zip(0..) {
        let light = light(pixel);
        mass += light;
        moment += light * index;
    }
    if mass <= 0 {
        return None;
    }
    let mut x = first as f32 + moment as f32 / mass as f32;
    for _ in 0..MOVES {
        let aim = (x + 0.5) as usize;
        if aim == middle {
            break;
        }
        while aim != middle {
            // A column leaves the span and one enters it at the other end.
            let [next, leaves, enters] = if aim > middle {
                [middle + 1, middle - TRIM, middle + TRIM + 1]
            } else {
                [middle - 1, middle + TRIM, (middle - TRIM).wrapping_sub(1)]
            };
            let (Some(&gone), Some(&new)) = (row.get(leaves), row.get(enters)) else {
                break;
            };
            let (gone, new) = (light(gone), light(new));
            mass += new - gone;
            moment += new * (enters as i32 - first as i32) - gone * (leaves as i32 - first as i32);
            middle = next;
        }
        if mass <= 0 {
            return None;
        }
        x = first as f32 + moment as f32 / mass as f32;
    }
    // A row without a bright box cannot hold glare.
    let saturated = if brightest > GLARE_SUM {
        fours.iter().map(|&four| image::bright(four, SATURATED)).sum()
    } else {
        0
    };
    Some(Centre {
        x,
        background,
        contrast,
        saturated,
    })
}
