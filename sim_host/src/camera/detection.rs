//! How often a seam sensor is right on seeded scenes: ours, the paper's, and the plain centroid of each row.

use super::optics::{HEIGHT, WIDTH, on_slit_plane};
use super::scene::{JointKind, Scene};
use super::{Camera, effects::Effects};
use crate::cell::panel::{SHEET_M, Side, Surface};
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use firmware::vision::joint::Joint;
use firmware::vision::{SeamSensor, printed};
use nalgebra::Vector3;
use rayon::prelude::*;

/// A method under test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// `firmware::vision::SeamSensor`.
    Sensor,
    /// `firmware::vision::printed`: windows and D_i.
    Printed,
    /// Centroid of each row over its whole width, then the largest step between the means of eight rows.
    RowCentroid,
}

/// What a method made of one image: its point in Σ_S (m), or the number of its refusal.
pub type Answer = Result<Vector3<f64>, u8>;

/// The joint that a sensor is told to expect in scenes of a kind.
pub fn expected_joint(kind: JointKind) -> Joint {
    match kind {
        JointKind::Crank(side) => Joint::Crank {
            upper_left: side == Side::Left,
            sheet_m: SHEET_M as f32,
        },
        JointKind::Plain => Joint::Crank {
            upper_left: true,
            sheet_m: SHEET_M as f32,
        },
        JointKind::Vee => Joint::Vee {
            flank: 15_f32.to_radians().tan(),
        },
        JointKind::Lip(side) => Joint::Lip {
            sheet_left: side == Side::Left,
            drop_m: 0.003,
        },
    }
}

impl Method {
    /// Applies the method.
    pub fn find(self, kind: JointKind, image: &[u8]) -> Answer {
        let view = View::new(image, WIDTH, HEIGHT).map_err(|_| u8::MAX)?;
        let found = match self {
            Self::Sensor => {
                let sighting = SeamSensor::new(Pinhole::TRACKING, expected_joint(kind)).sight(&view);
                if sighting.refusal != 0 {
                    return Err(sighting.refusal);
                }
                let [x, y, z] = sighting.point_um.map(|um| f64::from(um) * 1e-6);
                return Ok(Vector3::new(x, y, z));
            }
            Self::Printed => printed::seam(&view).map(|(x, y)| (f64::from(x), f64::from(y))),
            Self::RowCentroid => row_centroid(image),
        };
        let (x, y) = found.ok_or(u8::MAX)?;
        Ok(on_slit_plane(x, y))
    }
}

/// The plainest peer: threshold half way to the brightest pixel, centroid of each row with light, median of five, and the place where
/// a straight line with a step of 3 to 10 px fits the 24 rows to either side so much better than a straight line.
fn row_centroid(image: &[u8]) -> Option<(f64, f64)> {
    const REACH: usize = 24;
    const STEP_PX: std::ops::RangeInclusive<f64> = 3.0..=10.0;
    let range = |row: &[u8]| {
        row.iter()
            .max()
            .zip(row.iter().min())
            .map_or(0, |(most, least)| most - least)
    };
    let mut ranges: Vec<u8> = image.chunks_exact(WIDTH).map(range).collect();
    ranges.sort_unstable();
    // A row with less than half of the usual light has dropped out and repeats the last centre.
    let dark = ranges[HEIGHT / 2] / 2;
    let centroids: Vec<f64> = image
        .chunks_exact(WIDTH)
        .scan(0.5 * WIDTH as f64, |last, row| {
            let (least, most) = (row.iter().min()?, row.iter().max()?);
            let threshold = f64::from(*least) + 0.5 * f64::from(most - least);
            let light = row.iter().map(|&pixel| (f64::from(pixel) - threshold).max(0.0));
            let (mass, moment) = light.enumerate().fold((0.0, 0.0), |(mass, moment), (x, light)| {
                (mass + light, moment + light * x as f64)
            });
            if mass > 0.0 && most - least > dark {
                *last = moment / mass;
            }
            Some(*last)
        })
        .collect();
    let smooth: Vec<f64> = centroids
        .windows(5)
        .map(|five| {
            let mut five = five.to_vec();
            five.sort_by(f64::total_cmp);
            five[2]
        })
        .collect();
    // Of a window symmetric about the step, the step's part that no straight line explains is orthogonal to it:
    // h(u) = sign(u) − 1.5·u, for u in −1..1, has neither mean nor slope.
    let shape: Vec<f64> = (0..2 * REACH)
        .map(|row| {
            let u = (row as f64 + 0.5) / REACH as f64 - 1.0;
            u.signum() - 1.5 * u
        })
        .collect();
    let energy: f64 = shape.iter().map(|h| h * h).sum();
    smooth
        .windows(2 * REACH)
        .enumerate()
        .filter_map(|(first, rows)| {
            let projection: f64 = rows.iter().zip(&shape).map(|(x, h)| x * h).sum();
            let step = 2.0 * projection / energy;
            let middle = rows.iter().sum::<f64>() / rows.len() as f64;
            STEP_PX
                .contains(&step.abs())
                .then_some((step.abs(), (middle, (first + REACH) as f64 + 1.5)))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|best| best.1)
}

/// What became of a set of scenes. Errors are those of the seam point, across the seam in the sheet's plane and along
/// its normal.
#[derive(Clone, Debug, Default)]
pub struct Detection {
    /// Scenes.
    pub frames: usize,
    /// Refusals by number.
    pub refused: std::collections::BTreeMap<u8, usize>,
    /// Scene, lateral error (m), height error (m) of each find.
    pub found: Vec<(u64, f64, f64)>,
}

impl Detection {
    /// Measures `method` on scenes `first..first + frames` of `seed`.
    pub fn measure(method: Method, surface: Surface, kind: JointKind, seed: u64, frames: u64) -> Self {
        let camera = Camera::new(Effects::of(surface), seed);
        let answers: Vec<_> = (0..frames)
            .into_par_iter()
            .map(|index| {
                let scene = Scene::draw(surface, kind, seed, index);
                let answer = method.find(kind, &scene.image(&camera, index));
                (index, answer.map(|point| scene.errors(&point)))
            })
            .collect();
        let mut detection = Self {
            frames: answers.len(),
            ..Self::default()
        };
        for (index, answer) in answers {
            match answer {
                Ok((lateral, height)) => detection.found.push((index, lateral, height)),
                Err(number) => *detection.refused.entry(number).or_default() += 1,
            }
        }
        detection
    }

    /// Share of all frames in which the seam was found within `limit_m` laterally.
    pub fn within(&self, limit_m: f64) -> f64 {
        self.found.iter().filter(|find| find.1.abs() <= limit_m).count() as f64 / self.frames as f64
    }

    /// Scenes in which an error, lateral or in height, exceeds `limit_m` though nothing was refused.
    pub fn unflagged(&self, limit_m: f64) -> Vec<u64> {
        let wrong = |find: &&(u64, f64, f64)| find.1.abs().max(find.2.abs()) > limit_m;
        self.found.iter().filter(wrong).map(|find| find.0).collect()
    }

    /// Root mean square of the lateral and the height errors within a millimetre, m.
    pub fn rms(&self) -> (f64, f64) {
        let good: Vec<_> = self
            .found
            .iter()
            .filter(|find| find.1.abs().max(find.2.abs()) < 0.001)
            .collect();
        let rms = |error: fn(&(u64, f64, f64)) -> f64| {
            (good.iter().map(|find| error(find).powi(2)).sum::<f64>() / good.len().max(1) as f64).sqrt()
        };
        (rms(|find| find.1), rms(|find| find.2))
    }
}
