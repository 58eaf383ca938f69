//! The two-slit sensor (paper 003, chapter 3): one image, two lit lines 21 mm apart along the seam, and from them the seam's
//! pose in five numbers with their covariance.
//!
//! Each line is read by [`SeamSensor`] in its own columns of the image, found by `columns`; [`pose`] puts the two together.
//! Slit 0 is the one nearer to the nozzle.

mod columns;
mod gap;
pub mod pose;

use super::camera::Pinhole;
use super::exchange::Asked;
use super::image::View;
use super::joint::Joint;
use super::number::limit;
use super::place::Place;
use super::sensor::{Find, PROOF, Refusal, SeamSensor};
use super::window::Line;
use gap::{Lip, Seen};
use hal::process::Sighting;
use nalgebra::{SMatrix, SVector};
use pose::{Cut, SeamPose};

/// How far the sheet may lie from z = 0, m.
const HEIGHT_REACH: f32 = 0.010;
/// Standard deviation of a line's column at the joint, px, on the moderate surface: `detection --slits 2` measures it.
const COLUMN_SIGMA: f32 = 0.30;
/// The same of its slope, px/px.
const SLOPE_SIGMA: f32 = 0.013;

/// A slit that saw the joint as clearly as this (logarithm of the likelihood ratio joint : no joint), more so than it ever seems to see one where
/// none is, …
const CLEAR: f32 = 17.0;
/// … lets the other be believed at this, …
const PROOF_BESIDE: f32 = 3.0;
/// … and one that saw none lets it not be below this.
const PROOF_ALONE: f32 = 15.0;

/// Tangent beyond which a turn of the seam is believed no further: R150 with all tilts is 0.4.
const STEEPEST: f32 = 0.5;
/// Tangent beyond which the seam does not rise or fall from slit to slit: tilts of 8°. Where it seems to, one slit's line is a reflection.
const STEEPEST_RISE: f32 = 0.14;
/// The slits' points are farther apart than this along x, m, wherever there is a turn to tell.
const SHORTEST: f32 = 0.005;

/// The sensor of one joint.
#[derive(Clone, Copy, Debug)]
pub struct TwoSlitSensor {
    slits: [Pinhole; 2],
    sensors: [SeamSensor; 2],
    beside: Beside,
}

/// What a slit alone cannot know of the joint, as it depends on the seam's turn, which both together show.
#[derive(Clone, Copy, Debug)]
enum Beside {
    /// How long the gap beside a lip's sheet is in the slit's light.
    Gap(Lip),
    /// Whether both lines of a lap joint share rows; its upper sheet lies to the left or not.
    Overlap {
        /// See [`Self::Overlap`].
        upper_left: bool,
    },
    /// Nothing: a bend has one line.
    Nothing,
}

impl Beside {
    fn of(joint: Joint) -> Self {
        match joint {
            Joint::Crank { upper_left, .. } => Self::Overlap { upper_left },
            Joint::Vee { .. } => Self::Nothing,
            Joint::Lip { .. } => Lip::of(joint).map_or(Self::Nothing, Self::Gap),
        }
    }
}

impl TwoSlitSensor {
    /// A sensor for `joint` behind one camera with two slits, the nearer to the nozzle first.
    pub fn new(slits: [Pinhole; 2], joint: Joint) -> Self {
        Self {
            slits,
            sensors: slits.map(|slit| SeamSensor::new(slit, joint)),
            beside: Beside::of(joint),
        }
    }

    /// Sees the seam by each slit, or refuses; the caller fills in stamp and look.
    pub fn sight(&self, view: &View) -> [Sighting; 2] {
        self.sightings(&self.find(view))
    }

    /// What was found, as the camera reports it.
    pub fn sightings(&self, [near, ahead]: &[Result<Find, Refusal>; 2]) -> [Sighting; 2] {
        let [by_near, by_ahead] = &self.sensors;
        [
            by_near.sighting(near),
            Sighting {
                slit: 1,
                ..by_ahead.sighting(ahead)
            },
        ]
    }

    /// Finds the seam in each slit's light; columns are those of the whole image.
    pub fn find(&self, view: &View) -> [Result<Find, Refusal>; 2] {
        let parts = self.parts(view);
        let [(near_left, _), (ahead_left, _)] = parts;
        let [in_near, in_ahead] = parts.map(|(left, width)| view.columns(left, width));
        let [by_near, by_ahead] = &self.sensors;
        let (mut near_end, mut ahead_end) = (None, None);
        let mut askew = false;
        let mut near = by_near.seek(&in_near, &mut near_end);
        let mut ahead = by_ahead.seek(&in_ahead, &mut ahead_end);
        if let (Ok(near), Ok(ahead)) = (&mut near, &mut ahead) {
            let [at_near, at_ahead] = &self.slits;
            let seen = [
                seen(at_near, by_near, near, near_left),
                seen(at_ahead, by_ahead, ahead, ahead_left),
            ];
            let [turn, rise] = chord(seen.each_ref());
            askew = rise.abs() > STEEPEST_RISE;
            match &self.beside {
                Beside::Gap(lip) => {
                    if let (Some(near_end), Some(ahead_end)) = (&near_end, &ahead_end)
                        && let Some(edges) = lip.agreed(seen.each_ref(), [near_end, ahead_end])
                    {
                        [near.edge, ahead.edge] = edges;
                    }
                }
                Beside::Overlap { upper_left } => {
                    let turn = limit(turn, -STEEPEST, STEEPEST);
                    for (place, seen) in [near, ahead].into_iter().zip(&seen) {
                        place.edge.y += shared(seen.step, turn, *upper_left);
                    }
                }
                Beside::Nothing => {}
            }
        }
        let proofs = [proof(&ahead), proof(&near)];
        let find = |sensor, place: Result<Place, Refusal>, left, proof| {
            let place = place?;
            place.judge(proof)?;
            let mut find = found(sensor, &place, left);
            if askew {
                find.quality = find.quality.min(Sighting::SURE - 1);
            }
            Ok(find)
        };
        let [of_near, of_ahead] = proofs;
        [
            find(by_near, near, near_left, of_near),
            find(by_ahead, ahead, ahead_left, of_ahead),
        ]
    }

    /// Traces both lines; each with the column at which its own part of the image begins.
    pub fn trace(&self, view: &View) -> [(usize, Result<Line, Refusal>); 2] {
        let [near, ahead] = self.parts(view);
        let [by_near, by_ahead] = &self.sensors;
        let trace = |sensor: &SeamSensor, (left, width)| (left, sensor.trace(&view.columns(left, width)));
        [trace(by_near, near), trace(by_ahead, ahead)]
    }

    /// As [`SeamSensor::rows`], of both slits.
    pub fn rows(&self, view: &View) -> [Result<Asked, Refusal>; 2] {
        let [near, ahead] = self.parts(view);
        let [by_near, by_ahead] = &self.sensors;
        let rows = |sensor: &SeamSensor, (left, width)| sensor.rows(&view.columns(left, width));
        [rows(by_near, near), rows(by_ahead, ahead)]
    }

    /// First columns and widths of the parts of the image in which each line is looked for.
    pub fn parts(&self, view: &View) -> [(usize, usize); 2] {
        let level = self.slits.map(|slit| {
            let [x, _] = slit.pixel(&nalgebra::Vector3::new(slit.slit_offset_m, 0.0, 0.0));
            x as usize
        });
        let [slit, _] = &self.slits;
        // A raised sheet is nearer to the camera, and moves more.
        let scale = slit.height_m / (slit.height_m - HEIGHT_REACH);
        let travel = HEIGHT_REACH * slit.tan_slit * scale / slit.pixel_m;
        columns::of_lines(view, level, travel as usize)
    }

    /// The seam's pose from what the nearer slit and the one ahead found, with the covariance that the uncertainty of row, column and
    /// slope in both gives it; `None` if that is no seam.
    pub fn pose(&self, finds: &[Find; 2]) -> Option<SeamPose> {
        let value = self.pose_of(finds)?;
        let mut covariance = SMatrix::<f32, 5, 5>::zeros();
        for slit in 0..2 {
            for quantity in [Quantity::Row, Quantity::Column, Quantity::Slope] {
                let moved = |by: f32| {
                    let mut finds = *finds;
                    let find = finds.get_mut(slit)?;
                    quantity.shift(find, by);
                    self.pose_of(&finds)
                };
                let step = quantity.step();
                let (low, high) = (SVector::from(moved(-step)?), SVector::from(moved(step)?));
                let sigma = finds.get(slit).map_or(0.0, |find| quantity.sigma(find));
                let rate = (high - low) * (sigma / (2.0 * step));
                covariance += rate * rate.transpose();
            }
        }
        Some(SeamPose { value, covariance })
    }

    fn pose_of(&self, finds: &[Find; 2]) -> Option<[f32; 5]> {
        let [near, ahead] = finds;
        let [at_near, at_ahead] = &self.slits;
        let [by_near, by_ahead] = &self.sensors;
        pose::from_cuts(&cut(at_near, by_near, near), &cut(at_ahead, by_ahead, ahead))
    }
}

fn cut(slit: &Pinhole, sensor: &SeamSensor, find: &Find) -> Cut {
    let point = sensor.place(find);
    Cut {
        point,
        direction: slit.direction(&point, sensor.slope(find)),
    }
}

/// What a sensor saw at a place in columns that begin with column `left`.
fn seen<'a>(slit: &'a Pinhole, sensor: &SeamSensor, place: &Place, left: usize) -> Seen<'a> {
    let find = found(sensor, place, left);
    Seen {
        slit,
        find,
        step: place.fit.size(),
        cut: cut(slit, sensor, &find),
    }
}

/// Tangents by which the seam turns to the left and rises from the one's point to the other's.
fn chord([near, ahead]: [&Seen; 2]) -> [f32; 2] {
    let along = ahead.cut.point - near.cut.point;
    let way = along.x.max(SHORTEST);
    [along.y / way, along.z / way]
}

/// Rows by which a lap joint's edge lies further down than it was found. A slit's plane is inclined and meets the upper sheet's edge a `step` (px)
/// before the lower sheet: where the seam turns toward the upper sheet's other side, both lines share the rows that it covers meanwhile, and
/// [`exchange`](super::exchange) finds the edge in the middle of them.
fn shared(step: f32, turn: f32, upper_left: bool) -> f32 {
    let rows = 0.5 * turn * if step < 0.0 { -step } else { step };
    if (turn < 0.0) == upper_left { rows } else { 0.0 }
}

/// Logarithm of the likelihood ratio joint : no joint that is asked of a slit, from what the `other` saw.
fn proof(other: &Result<Place, Refusal>) -> f32 {
    match other {
        Ok(place) if place.evidence > CLEAR => PROOF_BESIDE,
        Err(Refusal::NoStep) => PROOF_ALONE,
        _ => PROOF,
    }
}

/// What a sensor found at a place in columns that begin with column `left`.
fn found(sensor: &SeamSensor, place: &Place, left: usize) -> Find {
    let find = sensor.report(place);
    Find {
        x: find.x + left as f32,
        edge_x: find.edge_x + left as f32,
        ..find
    }
}

/// What is measured of a line.
#[derive(Clone, Copy)]
enum Quantity {
    /// Where along the line the joint is.
    Row,
    /// Where the line is.
    Column,
    /// How it leans.
    Slope,
}

impl Quantity {
    fn sigma(self, find: &Find) -> f32 {
        match self {
            Self::Row => find.sigma,
            Self::Column => COLUMN_SIGMA,
            Self::Slope => SLOPE_SIGMA,
        }
    }

    /// Half the step by which the pose is differentiated: small against what bends the formulas, large against rounding.
    fn step(self) -> f32 {
        match self {
            Self::Row | Self::Column => 0.5,
            Self::Slope => 0.01,
        }
    }

    fn shift(self, find: &mut Find, by: f32) {
        let (along, aside) = match self {
            Self::Row => (by, find.slope * by),
            Self::Column => (0.0, by),
            Self::Slope => {
                find.slope += by;
                (0.0, 0.0)
            }
        };
        find.y += along;
        find.x += aside;
        find.edge_x += aside;
    }
}

#[cfg(test)]
mod tests;
