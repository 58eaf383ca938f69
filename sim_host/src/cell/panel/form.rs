//! How a part differs from flat and straight: its seam bent to the side, its sheets deformed, uneven and dented.

use super::RUN_ON_M;
use super::surface::Roughness;
use crate::cell::path::SeamPath;
use nalgebra::{Vector2, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::{PI, TAU};

/// Shortest and longest wavelength of the deformation, m (issue 2: "deformed ±2 mm over 150–400 mm").
pub const DEFORMATION_WAVELENGTH_M: [f64; 2] = [0.150, 0.400];
const DEFORMATION_WAVES: usize = 3;
const UNDULATIONS: usize = 4;
/// Wavelengths of the undulation, m; radii of the dents, m.
const UNDULATION_WAVELENGTH_M: [f64; 2] = [0.025, 0.080];
const DENT_RADIUS_M: [f64; 2] = [0.006, 0.015];
/// Dents are drawn within this distance of the seam, m.
const DENT_REACH_M: f64 = 0.025;

/// One wave along the seam.
#[derive(Clone, Copy, Debug)]
struct Sway {
    amplitude: f64,
    wave_number: f64,
    phase: f64,
}

/// One plane wave of height over the plate.
#[derive(Clone, Copy, Debug)]
struct Swell {
    amplitude: f64,
    kx: f64,
    ky: f64,
    phase: f64,
}

impl Swell {
    fn draw(rng: &mut Pcg64, amplitude: f64, wavelength: [f64; 2], spread: f64) -> Self {
        let k = TAU / rng.random_range(wavelength[0]..wavelength[1]);
        let (sin, cos) = rng.random_range(-spread..spread).sin_cos();
        Self {
            amplitude,
            kx: k * cos,
            ky: k * sin,
            phase: rng.random_range(0.0..TAU),
        }
    }
}

/// A smooth dent or bump of finite reach: depth·(1 − r²/R²)³.
#[derive(Clone, Copy, Debug)]
pub struct Dent {
    x: f64,
    y: f64,
    radius: f64,
    height: f64,
}

/// Height of the sheets over the plane of Σ_W, without the joint, and its gradient.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    pub height: f64,
    pub gradient: Vector2<f64>,
}

/// What is drawn for one part.
#[derive(Clone, Debug)]
pub struct Form {
    sways: [Sway; DEFORMATION_WAVES],
    swells: [Swell; DEFORMATION_WAVES + UNDULATIONS],
    dents: Vec<Dent>,
}

impl Form {
    /// Of a part with this seam; its deformation is still to be scaled.
    pub fn draw(path: &SeamPath, roughness: &Roughness, rng: &mut Pcg64) -> Self {
        let sways = std::array::from_fn(|_| Sway {
            amplitude: rng.random_range(0.3..1.0),
            wave_number: TAU / rng.random_range(DEFORMATION_WAVELENGTH_M[0]..DEFORMATION_WAVELENGTH_M[1]),
            phase: rng.random_range(0.0..TAU),
        });
        // Within 60° of the first tangent, so that a straight seam meets them at nearly their own wavelength.
        let swells = std::array::from_fn(|index| {
            if index < DEFORMATION_WAVES {
                let amplitude = rng.random_range(0.3..1.0);
                Swell::draw(rng, amplitude, DEFORMATION_WAVELENGTH_M, PI / 3.0)
            } else {
                Swell::draw(rng, roughness.undulation_m, UNDULATION_WAVELENGTH_M, PI)
            }
        });
        let seam_span = -RUN_ON_M..path.length() + RUN_ON_M;
        let dent_count = (roughness.dents_per_m * (path.length() + 2.0 * RUN_ON_M)).round() as usize;
        let dents = (0..dent_count)
            .map(|_| {
                let frame = path.at(rng.random_range(seam_span.clone()));
                let centre = frame.p + frame.b * rng.random_range(-DENT_REACH_M..DENT_REACH_M);
                Dent {
                    x: centre.x,
                    y: centre.y,
                    radius: rng.random_range(DENT_RADIUS_M[0]..DENT_RADIUS_M[1]),
                    height: roughness.dent_m * rng.random_range(-1.0..1.0),
                }
            })
            .collect();
        Self { sways, swells, dents }
    }

    /// Scales both deformations so that their peaks along the seam are `peak`.
    pub fn scale(&mut self, path: &SeamPath, peak: f64) {
        let steps = (path.length() / 0.002).ceil() as usize;
        let (mut sideways, mut height) = (0.0_f64, 0.0_f64);
        for step in 0..=steps {
            let s = path.length() * step as f64 / steps as f64;
            let p = path.at(s).p;
            sideways = sideways.max(self.sideways(s).0.abs());
            height = height.max(relief_of(&self.swells[..DEFORMATION_WAVES], p.x, p.y).height.abs());
        }
        for sway in &mut self.sways {
            sway.amplitude *= peak / sideways;
        }
        for swell in &mut self.swells[..DEFORMATION_WAVES] {
            swell.amplitude *= peak / height;
        }
    }

    /// d_b(s), m, and its derivative.
    pub fn sideways(&self, s: f64) -> (f64, f64) {
        self.sways.iter().fold((0.0, 0.0), |(value, slope), sway| {
            let (sin, cos) = (sway.wave_number * s + sway.phase).sin_cos();
            (
                value + sway.amplitude * sin,
                slope + sway.amplitude * sway.wave_number * cos,
            )
        })
    }

    /// At a place of the plane of Σ_W.
    pub fn relief(&self, x: f64, y: f64) -> Relief {
        self.relief_with(x, y, &self.dents)
    }

    /// The same where of all dents only these reach.
    pub fn relief_with(&self, x: f64, y: f64, dents: &[Dent]) -> Relief {
        let mut relief = relief_of(&self.swells, x, y);
        for dent in dents {
            let (dx, dy) = (x - dent.x, y - dent.y);
            let inside = 1.0 - (dx * dx + dy * dy) / (dent.radius * dent.radius);
            if inside > 0.0 {
                relief.height += dent.height * inside * inside * inside;
                let slope = -6.0 * dent.height * inside * inside / (dent.radius * dent.radius);
                relief.gradient += Vector2::new(dx, dy) * slope;
            }
        }
        relief
    }

    /// The dents that reach to within `radius` (m) of `centre` in the plane of Σ_W.
    pub fn dents_near(&self, centre: &Vector3<f64>, radius: f64) -> Vec<Dent> {
        let near = |dent: &&Dent| (dent.x - centre.x).hypot(dent.y - centre.y) < radius + dent.radius;
        self.dents.iter().filter(near).copied().collect()
    }
}

fn relief_of(swells: &[Swell], x: f64, y: f64) -> Relief {
    let mut relief = Relief {
        height: 0.0,
        gradient: Vector2::zeros(),
    };
    for swell in swells {
        let (sin, cos) = (swell.kx * x + swell.ky * y + swell.phase).sin_cos();
        relief.height += swell.amplitude * sin;
        relief.gradient += Vector2::new(swell.kx, swell.ky) * (swell.amplitude * cos);
    }
    relief
}
