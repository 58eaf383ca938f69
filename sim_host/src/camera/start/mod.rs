//! The start view: grey images of the seam's end under a ring light, and the slit in the same, larger window (paper 003, chapter 5).
//!
//! - [`light`]: what disturbs a grey image, with the values of the surfaces `clean`, `moderate`, `harsh`;
//! - `surface`: what each pixel sees of the sheets; `skin`: how those sheets look, the same in every image of a part; `paint`: the image;
//! - [`scene`]: seeded parts before the sensor, and their true start;
//! - [`grey`], [`measure`]: how well the corner is found in them, and the start pose measured.
//!
//! 54 × 54 mm, 450 × 450 px (5.2); camera, height and scale are the tracking view's, because the paper's camera keeps its focal length.

pub mod grey;
pub mod light;
pub mod measure;
mod paint;
pub mod scene;
mod skin;
mod surface;

use super::optics::Optics;
use crate::cell::panel::Panel;
use light::SpotLight;
use nalgebra::Isometry3;
use rand_pcg::Pcg64;
use skin::Skin;
use surface::Surfaces;

/// Image width and height, px.
pub const SIDE: usize = Optics::START.width;
/// Middle of the image, px.
pub const CENTRE_PX: f64 = 0.5 * (SIDE as f64 - 1.0);

/// Streams of random numbers: a part's look is drawn apart from a frame's noise.
const SKIN_STREAM: u128 = 0x0073_6b69_6e00;
const FRAME_STREAM: u128 = 0x6772_6579;

/// A part under the ring light.
pub struct GreyView {
    optics: Optics,
    light: SpotLight,
    skin: Skin,
    seed: u64,
}

impl GreyView {
    /// The part whose look is drawn from `seed`, under `light`, through `optics`: the start view as drawn or as built.
    pub fn new(optics: Optics, light: SpotLight, seed: u64) -> Self {
        let mut rng = Pcg64::new(u128::from(seed), SKIN_STREAM);
        Self {
            optics,
            skin: Skin::draw(&light, &mut rng),
            light,
            seed,
        }
    }

    /// Exposes frame number `frame` with the sensor at rest at `t_b_s`: [`SIDE`] rows of [`SIDE`] pixels.
    pub fn expose(&self, frame: u64, panel: &Panel, t_b_s: &Isometry3<f64>) -> Vec<u8> {
        let mut rng = Pcg64::new(u128::from(self.seed), (FRAME_STREAM << 64) | u128::from(frame));
        let surfaces = Surfaces::of(&self.optics, panel, t_b_s);
        paint::paint(&self.light, &self.skin, panel.joint(), &surfaces, &mut rng)
    }
}
