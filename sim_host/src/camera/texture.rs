//! Tables of speckle and of normal deviates, made once; frames read them from seeded offsets.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Side of the square speckle table, a power of two; it tiles.
pub const SPECKLE_SIDE: usize = 512;
/// Number of normal deviates, a power of two.
pub const DEVIATES: usize = 1 << 16;

/// The tables.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Intensity of fully developed speckle: mean 1, exponentially distributed, row by row.
    pub speckle: Vec<f32>,
    /// Standard normal deviates.
    pub noise: Vec<f32>,
}

impl Texture {
    /// Tables with speckle grains of `grain_px`; the same on every machine.
    pub fn new(grain_px: f64) -> Self {
        let mut rng = Pcg64::new(0x7465_7874_7572, 1);
        let noise = (0..DEVIATES).map(|_| rng.sample::<f32, _>(StandardNormal)).collect();
        // Speckle is the squared modulus of a complex Gaussian field, smoothed by the aperture.
        let parts = [(); 2].map(|()| smooth(grain_px, &mut rng));
        let mut speckle: Vec<f32> = parts[0]
            .iter()
            .zip(&parts[1])
            .map(|(re, im)| re * re + im * im)
            .collect();
        let mean = speckle.iter().sum::<f32>() / speckle.len() as f32;
        speckle.iter_mut().for_each(|value| *value /= mean);
        Self { speckle, noise }
    }
}

/// White noise smoothed by a Gaussian of `sigma` px, on the torus.
fn smooth(sigma: f64, rng: &mut Pcg64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as usize;
    let kernel: Vec<f32> = (0..=2 * reach)
        .map(|tap| {
            let d = (tap as f64 - reach as f64) / sigma;
            (-0.5 * d * d).exp() as f32
        })
        .collect();
    let side = SPECKLE_SIDE;
    let white: Vec<f32> = (0..side * side).map(|_| rng.sample(StandardNormal)).collect();
    let pass = |field: &[f32], step: usize| -> Vec<f32> {
        let line_step = if step == 1 { side } else { 1 };
        let mut out = vec![0.0; side * side];
        for line in 0..side {
            for at in 0..side {
                let taps = kernel.iter().enumerate();
                out[line * line_step + at * step] = taps
                    .map(|(tap, weight)| weight * field[line * line_step + (at + side + tap - reach) % side * step])
                    .sum();
            }
        }
        out
    };
    pass(&pass(&white, 1), side)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speckle_has_mean_one_and_contrast_one() {
        let texture = Texture::new(0.9);
        let n = texture.speckle.len() as f32;
        let mean = texture.speckle.iter().sum::<f32>() / n;
        let variance = texture.speckle.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / n;
        assert!((mean - 1.0).abs() < 1e-3, "mean {mean}");
        assert!((variance.sqrt() - 1.0).abs() < 0.05, "contrast {}", variance.sqrt());
    }
}
