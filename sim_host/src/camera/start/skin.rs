//! How the sheets of one part look: brightness, marks and edges, fixed to the sheets, so that they move with the part from image to image.

use super::light::{Marks, SpotLight};
use crate::camera::paint::{count, draw};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Size of a map's cell, m: a pixel's.
const CELL_M: f64 = 0.000_12;
/// What the maps cover: left of the seam ±, and along it from..to, m. Wider than any view of the start.
const LEFT_M: f64 = 0.050;
const ALONG_M: [f64; 2] = [-0.022, 0.062];
const COLUMNS: usize = 700;
const ROWS: usize = 834;

/// A stretch of an edge.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from_m: f64,
    to_m: f64,
    gain: f64,
}

/// One of the two edges: the seam, or the part's end.
#[derive(Clone, Debug)]
pub struct Edge {
    lost: Vec<Stretch>,
    glints: Vec<Stretch>,
}

impl Edge {
    fn draw(light: &SpotLight, rng: &mut Pcg64) -> Self {
        let span = ALONG_M[1] - ALONG_M[0];
        let place = |size: f64, gain: f64, rng: &mut Pcg64| {
            let from_m = draw(rng, ALONG_M);
            Stretch {
                from_m,
                to_m: from_m + size,
                gain,
            }
        };
        let mean = 0.5 * (light.edge_lost_m[0] + light.edge_lost_m[1]);
        let lost = (0..count(rng, light.edge_lost * span / mean))
            .map(|_| {
                let size = draw(rng, light.edge_lost_m);
                place(size, 0.15, rng)
            })
            .collect();
        let glints = (0..count(rng, light.edge_glints.mean_count))
            .map(|_| {
                let (size, gain) = (
                    draw(rng, light.edge_glints.size_m),
                    draw(rng, light.edge_glints.contrast),
                );
                place(size, gain, rng)
            })
            .collect();
        Self { lost, glints }
    }

    /// What is left of the edge's contrast at `at` (m along it), and how much brighter it glints there.
    pub fn condition(&self, at: f64) -> (f64, f64) {
        let inside = |stretch: &&Stretch| at > stretch.from_m && at < stretch.to_m;
        (
            self.lost.iter().find(inside).map_or(1.0, |stretch| stretch.gain),
            self.glints.iter().find(inside).map_or(0.0, |stretch| stretch.gain),
        )
    }
}

/// The part's look.
pub struct Skin {
    /// Brightness of each sheet, grey levels.
    pub level: [f64; 2],
    /// Mirrored light relative to it, and the lobe's exponent.
    pub gloss: f64,
    /// See [`Self::gloss`].
    pub gloss_exponent: f64,
    /// Brightness lost in the image's corners.
    pub vignetting: f64,
    /// The line on an edge: relative brightness and width, m.
    pub line: f64,
    /// See [`Self::line`].
    pub line_m: f64,
    /// The crevice under an edge: share of light missing and width, m.
    pub crevice: f64,
    /// See [`Self::crevice`].
    pub crevice_m: f64,
    /// A bend shows as a bright line (1) or a dark one (−1).
    pub bend: f64,
    /// The seam's edge and the part's end.
    pub edges: [Edge; 2],
    /// Background, its fixture edges (direction, place m, change), grey levels.
    pub background: f64,
    fixture: [(f64, f64, f64); 2],
    maps: [Vec<f32>; 2],
}

impl Skin {
    /// Draws the look of a part.
    pub fn draw(light: &SpotLight, rng: &mut Pcg64) -> Self {
        let level = draw(rng, light.sheet);
        let other = level * (1.0 + draw(rng, [-1.0, 1.0]) * light.sheets_differ);
        let background = draw(rng, light.background);
        Self {
            level: [level, other],
            gloss: draw(rng, light.gloss),
            gloss_exponent: draw(rng, light.gloss_exponent),
            vignetting: draw(rng, light.vignetting),
            line: draw(rng, light.edge_line),
            line_m: draw(rng, light.edge_line_m),
            crevice: draw(rng, light.crevice),
            crevice_m: draw(rng, light.crevice_m),
            bend: if rng.random::<bool>() { 1.0 } else { -1.0 },
            edges: [(); 2].map(|()| Edge::draw(light, rng)),
            background,
            fixture: [(); 2].map(|()| {
                (
                    draw(rng, [0.0, TAU]),
                    draw(rng, [-0.03, 0.03]),
                    background * draw(rng, [-0.5, 1.0]),
                )
            }),
            maps: [(); 2].map(|()| map(light, rng)),
        }
    }

    /// Relative brightness of a sheet at a place on it, bilinear.
    pub fn map(&self, sheet: usize, left: f64, along: f64) -> f64 {
        let x = (along - ALONG_M[0]) / CELL_M;
        let y = (left + LEFT_M) / CELL_M;
        if x < 0.0 || y < 0.0 || x >= (COLUMNS - 1) as f64 || y >= (ROWS - 1) as f64 {
            return 1.0;
        }
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = ((x - column as f64) as f32, (y - row as f64) as f32);
        let map = &self.maps[sheet];
        let line = |row: usize| {
            let (a, b) = (map[row * COLUMNS + column], map[row * COLUMNS + column + 1]);
            a + fx * (b - a)
        };
        let (above, below) = (line(row), line(row + 1));
        f64::from(above + fy * (below - above))
    }

    /// What lies behind the part there.
    pub fn behind(&self, left: f64, along: f64) -> f64 {
        let step = |&(direction, at, change): &(f64, f64, f64)| {
            let distance = left * f64::sin(direction) + along * f64::cos(direction) - at;
            change * (0.5 + distance / CELL_M).clamp(0.0, 1.0)
        };
        (self.background + self.fixture.iter().map(step).sum::<f64>()).max(0.0)
    }
}

/// Streaks, grain and marks of one sheet.
fn map(light: &SpotLight, rng: &mut Pcg64) -> Vec<f32> {
    let (sin, cos) = draw(rng, [0.0, 0.5 * TAU]).sin_cos();
    let streaks: Vec<f32> = (0..2048).map(|_| rng.sample(StandardNormal)).collect();
    let grain: Vec<f32> = (0..8191).map(|_| rng.sample(StandardNormal)).collect();
    let mut map: Vec<f32> = (0..ROWS * COLUMNS)
        .map(|cell| {
            let (row, column) = ((cell / COLUMNS) as f64, (cell % COLUMNS) as f64);
            let across = row * cos + column * sin + 1024.0;
            // A prime length and a stride that shares no factor with it: no row repeats its neighbour.
            let speck = grain[(cell * 5 + cell / 8191 * 37) % 8191];
            let streak = streaks[across.rem_euclid(2048.0) as usize];
            1.0 + light.streaks as f32 * streak + light.grain as f32 * speck
        })
        .collect();
    let mut stamp = Stamp { map: &mut map };
    let sign = |rng: &mut Pcg64| if rng.random::<bool>() { 1.0 } else { -0.7 };
    for (marks, shape) in [
        (light.scratches, Shape::Line),
        (light.blots, Shape::Blot),
        (light.glints, Shape::Blot),
        (light.welds, Shape::Ring),
    ] {
        // Counts are of a view; a map covers more than its square.
        let share = (LEFT_M * 2.0) * (ALONG_M[1] - ALONG_M[0]) / (0.054 * 0.054) / 2.0;
        for _ in 0..count(rng, marks.mean_count * share) {
            let gain = draw(rng, marks.contrast)
                * match shape {
                    Shape::Ring => -1.0,
                    _ if marks == light.glints => 1.0,
                    _ => sign(rng),
                };
            stamp.mark(&marks, shape, gain, rng);
        }
    }
    map
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Line,
    Blot,
    Ring,
}

struct Stamp<'a> {
    map: &'a mut [f32],
}

impl Stamp<'_> {
    fn mark(&mut self, marks: &Marks, shape: Shape, gain: f64, rng: &mut Pcg64) {
        let (along, mut left) = (draw(rng, ALONG_M), draw(rng, [-LEFT_M, LEFT_M]));
        let size = draw(rng, marks.size_m) / CELL_M;
        if shape == Shape::Ring {
            left = draw(rng, [0.006, 0.012]).copysign(left);
        }
        let (x, y) = ((along - ALONG_M[0]) / CELL_M, (left + LEFT_M) / CELL_M);
        match shape {
            Shape::Line => {
                let (sin, cos) = draw(rng, [0.0, 0.5 * TAU]).sin_cos();
                let sigma = draw(rng, [0.5, 0.9]);
                self.each(x, y, 0.5 * size + 3.0, |dx, dy| {
                    let (on, off) = (dx * cos + dy * sin, dy * cos - dx * sin);
                    let end = (0.5 * size - on.abs()).clamp(-0.5, 0.5) + 0.5;
                    gain * end * (-0.5 * (off / sigma).powi(2)).exp()
                });
            }
            Shape::Blot => self.each(x, y, 2.5 * size, |dx, dy| {
                gain * (-(dx * dx + dy * dy) / (size * size)).exp()
            }),
            Shape::Ring => self.each(x, y, size + 8.0, |dx, dy| {
                let off = dx.hypot(dy) - size;
                gain * (-0.5 * (off / 2.5).powi(2)).exp() + if off < 0.0 { 0.4 * gain } else { 0.0 }
            }),
        }
    }

    /// Adds `value`(dx, dy) to the cells within `reach` of (`x`, `y`).
    fn each(&mut self, x: f64, y: f64, reach: f64, value: impl Fn(f64, f64) -> f64) {
        let span =
            |at: f64, size: usize| (at - reach).max(0.0) as usize..((at + reach).max(0.0) as usize + 1).min(size);
        for row in span(y, ROWS) {
            for column in span(x, COLUMNS) {
                self.map[row * COLUMNS + column] += value(column as f64 - x, row as f64 - y) as f32;
            }
        }
    }
}
