//! The start frame of a part, what two that were measured have in common, and the motion that it says.

use crate::geometry::Pose;
use crate::geometry::rotation::{length, unit};
use crate::geometry::trig::{asin, atan2, sin_cos};
use crate::job::path::Place;
use crate::job::seal::StartPose;
use nalgebra::{Matrix3, Vector3};

/// Farthest apart that two measurements of the same part may put its start, m and rad, to be believed: the accuracy asked for.
pub const AGREEMENT: f32 = 0.15e-3;
/// See [`AGREEMENT`].
pub const AGREEMENT_ANGLE: f32 = 0.3 * core::f32::consts::PI / 180.0;

/// Largest standard deviations of a start that is believed, m and rad.
const SURE: f32 = 0.068e-3;
/// See [`SURE`].
const SURE_ANGLE: f32 = 0.09 * core::f32::consts::PI / 180.0;

/// The part's start, as measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartFrame {
    /// The start frame in Σ_B: origin in the end corner on the seam's sheet, x along the seam, z out of the sheet.
    pub pose: Pose,
    /// Variances of the start along the seam, m², and of the seam's direction in the sheet, rad².
    pub variance: [f32; 2],
}

impl StartFrame {
    /// Whether `other`, measured after it, says the same within [`AGREEMENT`].
    #[inline(never)] // in no hurry, as whatever is done at rest
    pub fn agrees(&self, other: &Self) -> bool {
        // Chords of the axes' turns: a degree's chord differs from its arc by 1e-5 of it.
        let turn = |axis: usize| length(&(self.pose.r.column(axis) - other.pose.r.column(axis)));
        self.is_at(other) && turn(0).max(turn(2)) <= AGREEMENT_ANGLE
    }

    /// Whether at least the place is the same within [`AGREEMENT`].
    pub fn is_at(&self, other: &Self) -> bool {
        length(&(self.pose.p - other.pose.p)) <= AGREEMENT
    }

    /// Whether it is known well enough.
    pub fn is_sure(&self) -> bool {
        let [along, turn] = self.variance;
        along <= SURE * SURE && turn <= SURE_ANGLE * SURE_ANGLE
    }

    /// What lies between two that agree, nearer to the one whose seam's direction is known better: the noise of both is less in it. Of that of the
    /// start along the seam nothing is taken off: both images show it by the same edge.
    #[inline(never)]
    pub fn mean(&self, other: &Self) -> Self {
        let ([place, turn], [other_place, other_turn]) = (self.variance, other.variance);
        let share = turn / (turn + other_turn);
        let toward = |own: Vector3<f32>, other: Vector3<f32>| own + (other - own) * share;
        let axis = |axis: usize| toward(self.pose.r.column(axis).into(), other.pose.r.column(axis).into());
        let (along, left) = (axis(0), axis(1));
        let axes = unit(&along).zip(unit(&along.cross(&left)));
        Self {
            pose: Pose {
                // Two that agree are never opposite.
                r: axes.map_or(other.pose.r, |(x, z)| Matrix3::from_columns(&[x, z.cross(&x), z])),
                p: toward(self.pose.p, other.pose.p),
            },
            variance: [place + (other_place - place) * share, turn * (1.0 - share)],
        }
    }

    /// The rigid motion, in Σ_B, from the part as taught to the part as it lies; `taught` is the place of the corner on the taught path.
    pub fn motion(&self, taught: &Place) -> Pose {
        let left = taught.lateral();
        let t_b_taught = Pose {
            r: Matrix3::from_columns(&[left.cross(&taught.normal), left, taught.normal]),
            p: taught.point,
        };
        self.pose * t_b_taught.inverse()
    }
}

impl StartPose {
    /// The six numbers of a rigid motion of the part in Σ_B, as a start sensor measures them from the taught nozzle pose `t_b_n0`: what
    /// [`StartPose::motion`] undoes.
    pub fn of_motion(motion: &Pose, t_b_n0: &Pose) -> Self {
        let seen = t_b_n0.inverse() * *motion * *t_b_n0;
        let y = asin(seen.r.m13);
        let (_, cos_y) = sin_cos(y);
        Self {
            shift: seen.p.into(),
            tilt: [
                atan2(-seen.r.m23, seen.r.m33),
                y,
                atan2(-seen.r.m12, seen.r.m11 * cos_y),
            ],
        }
    }
}
