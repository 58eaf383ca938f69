//! Rows of rendered images about a lap joint's edge, and where it truly is: on moderate and on harsh surfaces, to either hand, under either sensor.

use crate::camera::Camera;
use crate::camera::detection::expected_joint;
use crate::camera::effects::Effects;
use crate::camera::optics::Optics;
use crate::camera::scene::Scene;
use crate::cell::panel::{Joint, Side, Surface};
use firmware::vision::camera::Pinhole;
use firmware::vision::edge::ROWS;
use firmware::vision::exchange::{Asked, Row};
use firmware::vision::image::View;
use firmware::vision::{Refusal, SeamSensor, TwoSlitSensor};
use indicatif::ProgressBar;
use rand::RngExt;
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// Images of each surface and hand under two slits, and under one.
const IMAGES: [u64; 2] = [30_000, 10_000];
/// Of each surface and hand.
pub const SCENES: u64 = 4 * (IMAGES[0] + IMAGES[1]);
/// Stream of random numbers that belongs to the sheets' thickness.
const STREAM: u128 = 0x73_6865_6574;
/// Thickness of the lapped sheets, m: car bodies, assumed.
const SHEETS_M: std::ops::RangeInclusive<f64> = 0.0004..=0.0012;
/// An edge nearer than this to the first or the last row that is asked teaches nothing, rows.
const MARGIN: f32 = 2.0;

/// What the net sees of an image, and what it should find.
#[derive(Clone, Debug)]
pub struct Example {
    /// The rows that are asked.
    pub rows: Box<[Row; ROWS]>,
    /// The true edge: how many of them lie above it.
    pub edge: f32,
}

/// Draws the examples of `seed`; `bar` goes on by one for each of [`SCENES`].
pub fn draw(seed: u64, bar: &ProgressBar) -> Vec<Example> {
    draw_some(seed, IMAGES, bar)
}

/// The same of so many images of each surface and hand under two slits, and under one.
pub(super) fn draw_some(seed: u64, images: [u64; 2], bar: &ProgressBar) -> Vec<Example> {
    let mut examples = Vec::new();
    for (optics, images) in [Optics::TWO_SLITS, Optics::TRACKING].into_iter().zip(images) {
        for surface in [Surface::Moderate, Surface::Harsh] {
            for side in [Side::Left, Side::Right] {
                let camera = Camera::behind(optics, Effects::of(surface), seed);
                let of_each: Vec<Vec<Example>> = (0..images)
                    .into_par_iter()
                    .map(|index| {
                        bar.inc(1);
                        let joint = Joint::Crank {
                            upper: side,
                            sheet_m: sheet(seed, index),
                        };
                        let scene = Scene::draw_under(&optics, surface, joint, seed, index);
                        of_image(&optics, &scene, joint, &scene.image(&camera, index))
                    })
                    .collect();
                examples.extend(of_each.into_iter().flatten());
            }
        }
    }
    examples
}

/// Thickness of the lapped sheet in image number `index`, m.
fn sheet(seed: u64, index: u64) -> f64 {
    Pcg64::new(u128::from(seed), (STREAM << 64) | u128::from(index)).random_range(SHEETS_M)
}

fn of_image(optics: &Optics, scene: &Scene, joint: Joint, image: &[u8]) -> Vec<Example> {
    let Ok(view) = View::new(image, optics.width, optics.height) else {
        return Vec::new();
    };
    let expected = expected_joint(joint);
    let asked: Vec<Result<Asked, Refusal>> = if scene.ahead.is_some() {
        TwoSlitSensor::new(Pinhole::TWO_SLITS, expected).rows(&view).into()
    } else {
        vec![SeamSensor::new(Pinhole::TRACKING, expected).rows(&view)]
    };
    let truths = [Some(scene.truth), scene.ahead].into_iter().flatten();
    let examples = asked.into_iter().zip(truths).enumerate();
    examples
        .filter_map(|(slit, (asked, seam))| {
            let edge = optics.true_edge(slit, &scene.panel, &scene.t_b_s, seam.s);
            example(&asked.ok()?, change(joint, edge.pixel.1, seam.pixel.1))
        })
        .collect()
}

/// Row in which the one line goes over into the other, from those in which the upper sheet's edge and its foot are lit. Where the seam's turn
/// puts the foot beyond the edge, no row shows more than that the change is somewhere between; the sensor corrects the middle by the turn that
/// two slits show.
fn change(joint: Joint, edge: f64, foot: f64) -> f64 {
    let beyond = match joint {
        Joint::Crank { upper: Side::Right, .. } => (foot - edge).min(0.0),
        _ => (foot - edge).max(0.0),
    };
    edge + 0.5 * beyond
}

/// `None` where the rows are about another place.
fn example(asked: &Asked, change: f64) -> Option<Example> {
    // A row's middle is its number.
    let above = change as f32 + 0.5 - asked.first as f32;
    (MARGIN..=ROWS as f32 - MARGIN).contains(&above).then(|| Example {
        rows: Box::new(asked.rows),
        edge: above,
    })
}
