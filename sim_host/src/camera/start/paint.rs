//! Paints a grey image: which sheet each pixel shows, how bright it is, and what lens and sensor make of it.

use super::light::SpotLight;
use super::skin::Skin;
use super::surface::{Spot, Surfaces};
use super::{CENTRE_PX, SIDE};
use crate::camera::paint::draw;
use crate::cell::panel::{FLANGE_M, Joint};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Table of normal deviates for a frame, a prime number of them so that rows differ.
const DEVIATES: usize = 16_381;

/// Paints one frame.
pub fn paint(light: &SpotLight, skin: &Skin, joint: Joint, surfaces: &Surfaces, rng: &mut Pcg64) -> Vec<u8> {
    let mut canvas: Vec<f32> = (0..SIDE * SIDE)
        .map(|pixel| {
            let (x, y) = (pixel % SIDE, pixel / SIDE);
            let (dx, dy) = (x as f64 / CENTRE_PX - 1.0, y as f64 / CENTRE_PX - 1.0);
            let lens = 1.0 - skin.vignetting * 0.5 * (dx * dx + dy * dy);
            (lens * level(skin, joint, &surfaces.at(x, y))) as f32
        })
        .collect();
    blur(draw(rng, light.blur_px), &mut canvas);
    let noise: Vec<f32> = (0..DEVIATES).map(|_| rng.sample(StandardNormal)).collect();
    let first: usize = rng.random_range(0..DEVIATES);
    let deviates = noise.iter().cycle().skip(first);
    canvas
        .iter()
        .zip(deviates)
        .map(|(level, deviate)| {
            let deviation = (light.read_noise.powi(2) + light.shot_noise * f64::from(*level)).sqrt() as f32;
            // Conversion to u8 saturates and drops the fraction: adding a half rounds.
            (level + deviate * deviation + 0.5) as u8
        })
        .collect()
}

/// Share of a pixel that lies inside a border `distance` (m, positive inside) from its middle.
fn inside(distance: f64, spot: &Spot) -> f64 {
    (0.5 + distance / spot.pixel_m).clamp(0.0, 1.0)
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    b + (a - b) * share
}

/// Light of a pixel.
fn level(skin: &Skin, joint: Joint, spots: &[Spot; 2]) -> f64 {
    let [base, other] = spots;
    match joint {
        Joint::Crank { upper, .. } => {
            let below = mix(
                shade(skin, 0, base),
                skin.behind(base.left, base.along),
                inside(base.along + FLANGE_M, base),
            );
            cover(skin, 1, other, upper.sign(), below, &corner(base, upper.sign()), 1.0)
        }
        Joint::Lip { sheet, gap_m, .. } => {
            let sign = sheet.sign();
            // Light that falls into the gap does not come back.
            let there = inside(-other.left * sign - gap_m, other) * inside(other.along + FLANGE_M, other);
            let below = mix(shade(skin, 1, other), skin.behind(other.left, other.along), there);
            cover(skin, 0, base, sign, below, &corner(other, sign), 3.0)
        }
        Joint::Vee { .. } => {
            let (sheet, spot) = if base.left < 0.0 { (0, base) } else { (1, other) };
            let (kept, glint) = skin.edges[0].condition(spot.along);
            // A press radius of a millimetre mirrors the ring over a third of its width, or the camera itself, which is dark.
            let strength = if skin.bend > 0.0 {
                1.5 * skin.line + glint
            } else {
                -0.8 * skin.crevice
            };
            let stripe = 1.0 + kept * strength * (-(spot.left / (2.0 * skin.line_m)).powi(2)).exp();
            let (kept, glint) = skin.edges[1].condition(spot.left.abs());
            let lit = 1.0 + line(skin, kept, glint, spot.along);
            let here = shade(skin, sheet, spot) * stripe.max(0.0) * lit;
            mix(here, skin.behind(spot.left, spot.along), inside(spot.along, spot))
        }
    }
}

/// Where a point lies against the corner between seam and end.
struct Corner {
    /// Distance to the nearer of the two edges, m, positive inside.
    distance: f64,
    /// Which of [`Skin::edges`] that is, and how far along it the point lies, m.
    edge: usize,
    at: f64,
}

fn corner(spot: &Spot, sign: f64) -> Corner {
    let (aside, along) = (spot.left * sign, spot.along);
    let distance = if aside > 0.0 && along > 0.0 {
        aside.min(along)
    } else {
        -aside.min(0.0).hypot(along.min(0.0))
    };
    let (edge, at) = if aside < along { (0, along) } else { (1, aside) };
    Corner { distance, edge, at }
}

/// The sheet with the edges over what lies below it. `drop` is how many crevices' widths the crevice is wide.
fn cover(skin: &Skin, sheet: usize, spot: &Spot, sign: f64, below: f64, shadow: &Corner, drop: f64) -> f64 {
    let top = corner(spot, sign);
    let (kept, glint) = skin.edges[top.edge].condition(top.at);
    let upper = shade(skin, sheet, spot) * (1.0 + line(skin, kept, glint, top.distance));
    let (kept, _) = skin.edges[shadow.edge].condition(shadow.at);
    let depth = (-shadow.distance).max(0.0) / (drop * skin.crevice_m);
    let crevice = 1.0 - kept * skin.crevice * (-depth * depth).exp();
    mix(upper, below * crevice, inside(top.distance, spot))
}

/// The line on an edge, relative to the sheet: a Gaussian whose middle lies its own width inside.
fn line(skin: &Skin, kept: f64, glint: f64, distance: f64) -> f64 {
    let u = (distance - skin.line_m) / skin.line_m;
    (kept * skin.line + glint) * (-u * u).exp()
}

/// A sheet's light without its edges.
fn shade(skin: &Skin, sheet: usize, spot: &Spot) -> f64 {
    if spot.on_part < 0.5 {
        return skin.behind(spot.left, spot.along);
    }
    let facing = spot.facing.clamp(0.0, 1.0);
    // The light comes from where the camera looks from: the mirrored ray leaves it by twice the normal's angle.
    let mirrored = (2.0 * facing * facing - 1.0).max(0.0).powf(skin.gloss_exponent);
    skin.level[sheet] * (facing + skin.gloss * mirrored) * skin.map(sheet, spot.left, spot.along).max(0.0)
}

/// Gaussian blur, rows then columns; the rim repeats its last pixel.
fn blur(sigma_px: f64, canvas: &mut [f32]) {
    const REACH: i32 = 4;
    let weights: Vec<f32> = (-REACH..=REACH)
        .map(|tap| (-0.5 * (f64::from(tap) / sigma_px).powi(2)).exp() as f32)
        .collect();
    let sum: f32 = weights.iter().sum();
    for step in [1, SIDE] {
        let from = canvas.to_vec();
        for (index, pixel) in canvas.iter_mut().enumerate() {
            let at = (index / step % SIDE) as i32;
            let first = index - at as usize * step;
            let taps = weights.iter().enumerate();
            let light: f32 = taps
                .map(|(tap, weight)| {
                    let from_at = (at + tap as i32 - REACH).clamp(0, SIDE as i32 - 1) as usize;
                    weight * from[first + from_at * step]
                })
                .sum();
            *pixel = light / sum;
        }
    }
}
