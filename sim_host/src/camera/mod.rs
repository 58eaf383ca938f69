//! The emulated camera: 8-bit images of the lit slit on the true part.
//!
//! - [`optics`]: pinhole, slit planes, projectors, and where the true seam must appear;
//! - [`effects`]: what disturbs the image, with the values of the surfaces `clean`, `moderate`, `harsh`;
//! - [`eye`]: the sensor that looks at the images;
//! - [`scene`]: seeded scenes on which seam sensors are measured;
//! - [`detection`]: how often a sensor is right on them, and [`pair`] the one with two slits;
//! - [`start`]: the start view, grey and lit;
//! - `section`: where the light meets the sheets; `texture`: tables of speckle and noise; `paint`: the image.
//!
//! An image is a pure function of the scene, the camera's seed and the frame's index.

pub mod detection;
pub mod effects;
pub mod eye;
pub mod optics;
mod paint;
pub mod pair;
pub mod scene;
mod section;
pub mod start;
mod texture;

use crate::cell::panel::Panel;
use effects::Effects;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use optics::Optics;
use rand_pcg::Pcg64;
use texture::Texture;

/// Stream of random numbers that belongs to the camera, so that other users of the same seed draw others.
const STREAM: u128 = 0x63616d657261;

/// How the sensor moves during the exposure: velocity of Σ_S in Σ_B.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    /// Velocity of its origin, m/s.
    pub linear: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular: Vector3<f64>,
}

impl Motion {
    /// The pose `after` seconds from the one at which the sensor was at `t_b_s`.
    pub fn carry(&self, t_b_s: &Isometry3<f64>, after: f64) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(t_b_s.translation.vector + self.linear * after),
            UnitQuaternion::from_scaled_axis(self.angular * after) * t_b_s.rotation,
        )
    }
}

/// The camera of a seam sensor.
#[derive(Clone, Debug)]
pub struct Camera {
    optics: Optics,
    effects: Effects,
    seed: u64,
    texture: Texture,
}

impl Camera {
    /// The tracking view's camera, whose images are disturbed by `effects`, drawn from `seed`.
    pub fn new(effects: Effects, seed: u64) -> Self {
        Self::behind(Optics::TRACKING, effects, seed)
    }

    /// The same behind other `optics`.
    pub fn behind(optics: Optics, effects: Effects, seed: u64) -> Self {
        Self {
            optics,
            texture: Texture::new(effects.speckle_grain_px),
            effects,
            seed,
        }
    }

    /// Exposes frame number `frame`: what stands before the sensor at `t_b_s` (mid-exposure) while it moves by `motion`.
    /// Without a panel the slit falls into the void. Returns the image's rows.
    pub fn expose(&self, frame: u64, panel: Option<&Panel>, t_b_s: &Isometry3<f64>, motion: &Motion) -> Vec<u8> {
        let mut rng = Pcg64::new(u128::from(self.seed), (STREAM << 64) | u128::from(frame));
        let half = 0.5 * self.effects.exposure_s;
        let light = panel.map_or_else(Vec::new, |panel| {
            let sections = |slit| {
                [-half, half].map(|after| section::Section::of(panel, &self.optics, slit, &motion.carry(t_b_s, after)))
            };
            (0..self.optics.slits_m.len()).map(sections).collect()
        });
        let mut image = vec![0; self.optics.width * self.optics.height];
        paint::paint(&self.effects, &self.texture, &self.optics, &light, &mut rng, &mut image);
        image
    }
}
