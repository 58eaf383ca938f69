//! Paints the image: the line's light, what is wrong with it, and the camera's noise.
//!
//! Each row is sampled three times: at thirds of its height and, with the thirds in turn, at thirds of the exposure. So
//! the edge of a joint is anti-aliased and blurred by the motion for the price of one.

use super::effects::{Blemish, Effects, Range};
use super::optics::Optics;
use super::section::Section;
use super::texture::{DEVIATES, SPECKLE_SIDE, Texture};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Samples per row.
const SAMPLES: usize = 3;
/// A half width at half height of a Gaussian, in standard deviations: sqrt(2 ln 2).
const HALF_WIDTH_SIGMAS: f64 = 1.177_41;

/// The line's condition in one row.
#[derive(Clone, Copy)]
struct Row {
    brightness: f64,
    widening: f64,
    shift_px: f64,
}

/// The line's secondary reflection.
struct Ghost {
    rows: Range,
    distance_px: f64,
    tilt: f64,
    brightness: f64,
}

pub fn draw(rng: &mut Pcg64, range: Range) -> f64 {
    range[0] + (range[1] - range[0]) * rng.random::<f64>()
}

/// Poisson count, by multiplying uniform numbers.
pub fn count(rng: &mut Pcg64, mean: f64) -> usize {
    let floor = (-mean).exp();
    let mut product = rng.random::<f64>();
    let mut count = 0;
    while product > floor {
        product *= rng.random::<f64>();
        count += 1;
    }
    count
}

/// Paints one frame: `light` holds, by slit, the section at the exposure's start and end; it is empty without a part.
///
/// Each line has its own highlights, drop-outs and ghosts, and its own glints and scratches, so that as many lie about it as
/// about the only line of the sensor with one slit.
pub fn paint(
    effects: &Effects,
    texture: &Texture,
    optics: &Optics,
    light: &[[Section; 2]],
    rng: &mut Pcg64,
    image: &mut [u8],
) {
    let mut canvas = Canvas::new(optics.width, optics.height);
    let condition: Vec<_> = light
        .iter()
        .map(|_| {
            (
                line_condition(effects, optics.height, rng),
                draw_ghosts(effects, optics.height, rng),
            )
        })
        .collect();
    if !light.is_empty() {
        let focus = Focus::draw(effects, rng);
        for (sections, (rows, ghosts)) in light.iter().zip(&condition) {
            let line = paint_line(effects, sections, rows, ghosts, &focus, &mut canvas);
            paint_glints(effects, &line, rng, &mut canvas);
            paint_scratches(effects.scratches, rng, &mut canvas);
        }
    }
    develop(effects, texture, &canvas, rng, image);
}

/// Light in linear grey levels.
struct Canvas {
    width: usize,
    height: usize,
    light: Vec<f32>,
    gauss: Vec<f32>,
}

/// Resolution of the table of the Gaussian: entries per standard deviation, and its reach in standard deviations.
const GAUSS_PER_SIGMA: f64 = 64.0;
const GAUSS_REACH: f64 = 3.5;

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        let entries = (GAUSS_PER_SIGMA * GAUSS_REACH) as usize + 2;
        let gauss = |index: usize| (-0.5 * (index as f64 / GAUSS_PER_SIGMA).powi(2)).exp() as f32;
        Self {
            width,
            height,
            light: vec![0.0; width * height],
            gauss: (0..entries).map(gauss).collect(),
        }
    }

    /// Adds a Gaussian across one row.
    fn streak(&mut self, row: usize, x_px: f64, sigma_px: f64, brightness: f64) {
        let reach = GAUSS_REACH * sigma_px;
        let first = (x_px - reach).ceil().max(0.0) as usize;
        let last = (x_px + reach).floor().min(self.width as f64 - 1.0);
        if last < first as f64 {
            return;
        }
        let scale = (GAUSS_PER_SIGMA / sigma_px) as f32;
        let (x, brightness) = (x_px as f32, brightness as f32);
        let pixels = &mut self.light[row * self.width + first..=row * self.width + last as usize];
        for (offset, pixel) in pixels.iter_mut().enumerate() {
            let d = ((first + offset) as f32 - x).abs() * scale + 0.5;
            *pixel += brightness * self.gauss[d as usize];
        }
    }

    /// Adds a round or oval spot.
    fn spot(&mut self, x_px: f64, y_px: f64, sigma_px: [f64; 2], brightness: f64) {
        let reach = GAUSS_REACH * sigma_px[1];
        let first = (y_px - reach).ceil().max(0.0) as usize;
        let end = (y_px + reach).ceil().clamp(0.0, self.height as f64) as usize;
        for row in first..end {
            let d = (row as f64 - y_px) / sigma_px[1];
            self.streak(row, x_px, sigma_px[0], brightness * (-0.5 * d * d).exp());
        }
    }
}

/// Brightness and shape of the line, row by row: shading, drop-outs, specular stretches.
fn line_condition(effects: &Effects, height: usize, rng: &mut Pcg64) -> Vec<Row> {
    let brightness = draw(rng, effects.line_brightness);
    let (wave, phase) = (TAU / draw(rng, [100.0, 400.0]), draw(rng, [0.0, TAU]));
    let mut rows: Vec<Row> = (0..height)
        .map(|row| Row {
            brightness: brightness * (1.0 + effects.shading * (wave * row as f64 + phase).sin()),
            widening: 1.0,
            shift_px: 0.0,
        })
        .collect();
    for _ in 0..count(rng, effects.highlights.mean_count) {
        let (gain, length) = (
            draw(rng, effects.highlights.brightness),
            draw(rng, effects.highlights.size_px),
        );
        let (middle, shift) = (
            draw(rng, [0.0, height as f64]),
            draw(rng, [-1.0, 1.0]) * effects.highlight_shift_px,
        );
        for (index, row) in rows.iter_mut().enumerate() {
            let d = (index as f64 - middle) / (0.5 * length);
            let here = (1.0 - d * d).max(0.0);
            row.brightness *= 1.0 + (gain - 1.0) * here;
            row.widening += 0.2 * here;
            row.shift_px += shift * here;
        }
    }
    let mean_length = 0.5 * (effects.drop_out_rows[0] + effects.drop_out_rows[1]);
    for _ in 0..count(rng, effects.drop_out_share * height as f64 / mean_length) {
        let first = draw(rng, [0.0, height as f64]) as usize;
        let length = draw(rng, effects.drop_out_rows).round() as usize;
        let left = draw(rng, effects.drop_out_light);
        rows.iter_mut()
            .skip(first)
            .take(length)
            .for_each(|row| row.brightness *= left);
    }
    rows
}

fn draw_ghosts(effects: &Effects, height: usize, rng: &mut Pcg64) -> Vec<Ghost> {
    (0..count(rng, effects.ghosts.mean_count))
        .map(|_| {
            let first = draw(rng, [-60.0, height as f64 - 20.0]);
            let side = if rng.random::<bool>() { 1.0 } else { -1.0 };
            Ghost {
                rows: [first, first + draw(rng, effects.ghosts.size_px)],
                distance_px: side * draw(rng, effects.ghost_distance_px),
                // A reflection in the neighbouring sheet opens away from the line that it mirrors.
                tilt: side * draw(rng, [-0.02, 0.2]),
                brightness: draw(rng, effects.ghosts.brightness),
            }
        })
        .collect()
}

/// What the lens makes of a line.
struct Focus {
    /// Standard deviation of a line in focus, px.
    sigma: f64,
    /// Height of the plane in focus, m.
    plane_m: f64,
}

impl Focus {
    fn draw(effects: &Effects, rng: &mut Pcg64) -> Self {
        Self {
            sigma: 0.5 * draw(rng, effects.line_width_px) / HALF_WIDTH_SIGMAS,
            // Anywhere within a millimetre of the sensor's origin.
            plane_m: draw(rng, [-0.001, 0.001]),
        }
    }
}

/// Paints the line with its halo and ghosts; returns where its centre lies and, once, where the joint's edge is.
fn paint_line(
    effects: &Effects,
    sections: &[Section; 2],
    rows: &[Row],
    ghosts: &[Ghost],
    focus: &Focus,
    canvas: &mut Canvas,
) -> Line {
    let sigma_in_focus = focus.sigma;
    let mut line = Line::default();
    for (index, row) in rows.iter().enumerate() {
        for sample in 0..SAMPLES {
            let y_px = index as f64 + (sample as f64 - 1.0) / SAMPLES as f64;
            let time = ((sample + index) % SAMPLES) as f64 / (SAMPLES - 1) as f64;
            // The sample of the exposure's middle belongs to its first half in every other row: so an edge that passes lies in the middle.
            let early = time < 0.5 || time == 0.5 && index.is_multiple_of(2);
            let (start, end) = (sections[0].columns(y_px), sections[1].columns(y_px));
            for (sheet, columns) in start.into_iter().zip(end).enumerate() {
                let x_px = match columns {
                    (Some(from), Some(to)) => from + time * (to - from),
                    (Some(from), None) if early => from,
                    (None, Some(to)) if !early => to,
                    _ => continue,
                };
                line.note(index, x_px, sheet);
                let depth = sections[0].point(x_px, y_px).z - focus.plane_m;
                let sigma = (sigma_in_focus * row.widening).hypot(effects.defocus_px_per_m * depth);
                // Blur spreads the light, it does not add to it.
                let brightness = row.brightness / SAMPLES as f64 * sigma_in_focus * row.widening / sigma;
                canvas.streak(index, x_px + row.shift_px, sigma, brightness);
                if sample == 1 {
                    let whole = brightness * SAMPLES as f64;
                    canvas.streak(index, x_px, effects.halo_px, whole * effects.halo);
                    for ghost in ghosts {
                        let from_start = y_px - ghost.rows[0];
                        if from_start > 0.0 && y_px < ghost.rows[1] {
                            let x_px = x_px + ghost.distance_px + ghost.tilt * from_start;
                            canvas.streak(index, x_px, 1.2 * sigma, whole * ghost.brightness);
                        }
                    }
                }
            }
        }
    }
    line
}

/// Where the line was painted.
#[derive(Default)]
struct Line {
    /// Row, column and sheet of each sample.
    samples: Vec<(usize, f64, usize)>,
}

impl Line {
    fn note(&mut self, row: usize, x_px: f64, sheet: usize) {
        self.samples.push((row, x_px, sheet));
    }

    /// Row and column of the joint's edge: where the sheet changes.
    fn edge(&self) -> Option<(f64, f64)> {
        let change = self.samples.windows(2).find(|pair| pair[0].2 != pair[1].2)?;
        Some((change[1].0 as f64, 0.5 * (change[0].1 + change[1].1)))
    }
}

/// Spots: half of them within 30 px of the line, the others anywhere; and one on the joint's edge.
fn paint_glints(effects: &Effects, line: &Line, rng: &mut Pcg64, canvas: &mut Canvas) {
    let glints = effects.glints;
    for _ in 0..count(rng, glints.mean_count) {
        let anywhere = (
            draw(rng, [0.0, canvas.width as f64]),
            draw(rng, [0.0, canvas.height as f64]),
        );
        let (near, beside) = (rng.random::<bool>(), draw(rng, [-30.0, 30.0]));
        let pick = draw(rng, [0.0, line.samples.len() as f64]) as usize;
        let (x_px, y_px) = match line.samples.get(pick) {
            Some(&(row, x_px, _)) if near => (x_px + beside, row as f64),
            _ => anywhere,
        };
        let size = draw(rng, glints.size_px);
        let sigma = [0.5 * size * draw(rng, [0.7, 1.4]), 0.5 * size * draw(rng, [0.7, 1.4])];
        let brightness = draw(rng, glints.brightness);
        canvas.spot(x_px, y_px, sigma, brightness);
    }
    let (chance, size, brightness) = (
        rng.random::<f64>(),
        draw(rng, glints.size_px),
        draw(rng, glints.brightness),
    );
    let (dx, dy) = (draw(rng, [-4.0, 4.0]), draw(rng, [-1.0, 1.0]));
    if let Some((row, x_px)) = line.edge()
        && chance < effects.edge_glint
    {
        // An edge is thin: the glint is a third as high as it is long.
        canvas.spot(x_px + dx, row + dy, [0.5 * size, 0.5 * size / 3.0 + 0.4], brightness);
    }
}

/// Straight, one to two pixels wide, in any direction.
fn paint_scratches(scratches: Blemish, rng: &mut Pcg64, canvas: &mut Canvas) {
    for _ in 0..count(rng, scratches.mean_count) {
        let (x, y) = (
            draw(rng, [0.0, canvas.width as f64]),
            draw(rng, [0.0, canvas.height as f64]),
        );
        let (sin, cos) = draw(rng, [0.0, TAU / 2.0]).sin_cos();
        let (length, sigma) = (draw(rng, scratches.size_px), draw(rng, [0.6, 1.0]));
        // Spots one standard deviation apart add up to 2.5 times their brightness.
        let brightness = draw(rng, scratches.brightness) / 2.5;
        let spots = (length / sigma) as usize;
        for spot in 0..spots {
            let along = spot as f64 * sigma - 0.5 * length;
            canvas.spot(x + along * cos, y + along * sin, [sigma, sigma], brightness);
        }
    }
}

/// Row blur, speckle, ambient light, noise, saturation and rounding.
fn develop(effects: &Effects, texture: &Texture, canvas: &Canvas, rng: &mut Pcg64, image: &mut [u8]) {
    let (width, height) = (canvas.width, canvas.height);
    let ambient = draw(rng, effects.ambient) as f32;
    let tilt = [(); 2].map(|()| (draw(rng, [-1.0, 1.0]) * effects.ambient_variation) as f32);
    let speckle_at = [(); 2].map(|()| rng.random_range(0..SPECKLE_SIDE));
    let noise_at: usize = rng.random_range(0..DEVIATES);
    let (blur, contrast) = (effects.row_blur as f32, effects.speckle_contrast as f32);
    let deviation: Vec<f32> = (0..=256)
        .map(|level| (effects.read_noise.powi(2) + effects.shot_noise * f64::from(level)).sqrt() as f32)
        .collect();
    for (row, pixels) in image.chunks_exact_mut(width).enumerate() {
        let (above, below) = (row.saturating_sub(1), (row + 1).min(height - 1));
        let line = |row: usize| &canvas.light[row * width..(row + 1) * width];
        let neighbours = line(above).iter().zip(line(below));
        let speckle_row = (row + speckle_at[0]) % SPECKLE_SIDE * SPECKLE_SIDE;
        // An odd stride per row, so that no two rows of a frame meet the same deviates in the same columns.
        let noise_row = noise_at + row * 257;
        let row_ambient = ambient * (1.0 + tilt[1] * (row as f32 / height as f32 - 0.5));
        for (column, ((pixel, &own), (&above, &below))) in pixels.iter_mut().zip(line(row)).zip(neighbours).enumerate()
        {
            let light = (1.0 - 2.0 * blur) * own + blur * (above + below);
            let grain = texture.speckle[speckle_row + (column + speckle_at[1]) % SPECKLE_SIDE];
            let background = row_ambient + ambient * tilt[0] * (column as f32 / width as f32 - 0.5);
            let level = light * (1.0 + contrast * (grain - 1.0)) + background;
            let noise = texture.noise[(noise_row + column) % DEVIATES] * deviation[(level as usize).min(256)];
            // Conversion to u8 saturates and drops the fraction: adding a half rounds.
            *pixel = (level + noise + 0.5) as u8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_streak_holds_the_light_of_its_gaussian_and_is_centred_where_asked() {
        let mut canvas = Canvas::new(250, 250);
        canvas.streak(3, 100.3, 2.5, 80.0);
        let row = &canvas.light[3 * 250..4 * 250];
        let sum: f32 = row.iter().sum();
        let centre = row.iter().enumerate().map(|(x, v)| x as f32 * v).sum::<f32>() / sum;
        assert!((f64::from(sum) - 80.0 * 2.5 * TAU.sqrt()).abs() < 2.0, "{sum}");
        assert!((centre - 100.3).abs() < 0.01, "{centre} px");
    }
}
