//! The arm as geometry: where its frames are, how the tip moves, which joints reach a pose.
//!
//! An [`Arm`] is data: one row of the modified Denavit–Hartenberg table (Craig) per joint, the tool, the joint limits and
//! the [`Coupling`] between joint angles and what the drives turn. Angles in rad, joint-side; lengths in m; poses and
//! twists in the base frame Σ_B. Speed, torque and servo belong to `servo`.

mod coupling;
mod frames;
mod inverse;
mod solve;

pub use coupling::Coupling;
pub use frames::{Frames, Jacobian, Turns};
pub use inverse::{K3sInverse, NotK3s, Solutions, Unreachable};
pub use solve::{free_about, manipulability, solve_damped, solve_symmetric};

use crate::geometry::{Pose, trig::sin_cos};
use hal::wire_struct;

/// One row of the modified Denavit–Hartenberg table: the fixed part of the step from frame i−1 to frame i,
/// `Rot(x, α)·Trans(x, a)·Rot(z, θ)·Trans(z, d)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Link {
    /// a_{i−1}, distance of the joint axes along x_{i−1}, m.
    pub a: f32,
    /// Cosine of the twist α_{i−1}.
    pub twist_cos: f32,
    /// Sine of the twist α_{i−1}.
    pub twist_sin: f32,
    /// d_i, offset along the joint axis z_i, m.
    pub d: f32,
}

wire_struct!(Link {
    a: f32,
    twist_cos: f32,
    twist_sin: f32,
    d: f32
});

impl Link {
    /// From (a_{i−1} in m, α_{i−1} in rad, d_i in m). Quarter turns come out exact: their f32 angle is not.
    pub fn craig(a: f32, twist: f32, d: f32) -> Self {
        let (s, c) = sin_cos(twist);
        let snap = |v: f32| if v.abs() < 1e-6 { 0.0 } else { v };
        Self {
            a,
            twist_cos: snap(c),
            twist_sin: snap(s),
            d,
        }
    }
}

/// Closed range of a joint angle, rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointRange {
    /// Smallest angle.
    pub min: f32,
    /// Largest angle.
    pub max: f32,
}

wire_struct!(JointRange { min: f32, max: f32 });

/// A serial chain of N revolute joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm<const N: usize> {
    /// The table's rows, base first.
    pub links: [Link; N],
    /// Pose of the tool tip in the last frame (`T_5_N` of the sealing arm).
    pub tool: Pose,
    /// What each joint can reach.
    pub ranges: [JointRange; N],
    /// From joint angles to what the drives turn.
    pub coupling: Coupling<N>,
}

wire_struct!(Arm<const N: usize> { links: [Link; N], tool: Pose, ranges: [JointRange; N], coupling: Coupling<N> });

#[cfg(test)]
pub(crate) mod sample {
    //! The K3S of the spec, for tests; the product reads `sim_host/models/k3s.toml`.
    use super::*;
    use crate::geometry::rotation::rot_x;
    use core::f32::consts::{FRAC_PI_2, PI};
    use nalgebra::{Matrix3, Vector3};

    pub const ROWS: [(f32, f32, f32); 6] = [
        (0.0, 0.0, 0.0),
        (0.120, -FRAC_PI_2, 0.0),
        (0.420, PI, 0.0),
        (0.050, FRAC_PI_2, 0.430),
        (0.0, -FRAC_PI_2, 0.0),
        (0.0, FRAC_PI_2, 0.0),
    ];

    /// A five-axis arm: turning column, shoulder, elbow, and a wrist that pitches and swings, the tool along y of its last frame.
    pub fn five() -> Arm<5> {
        let quarter = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
        Arm {
            links: [
                (0.0, 0.0, 0.0),
                (0.0, -FRAC_PI_2, 0.0),
                (0.35, 0.0, 0.0),
                (0.30, 0.0, 0.0),
                (0.0, -FRAC_PI_2, 0.0),
            ]
            .map(|(a, twist, d)| Link::craig(a, twist, d)),
            tool: Pose {
                r: quarter,
                p: Vector3::new(0.0, 0.15, 0.0),
            },
            ranges: [JointRange { min: -3.0, max: 3.0 }; 5],
            coupling: Coupling::direct(),
        }
    }

    pub fn k3s() -> Arm<6> {
        let range = |min: f32, max: f32| JointRange {
            min: min.to_radians(),
            max: max.to_radians(),
        };
        let mut flip = rot_x(PI);
        flip.iter_mut().for_each(|e| *e = if e.abs() < 0.5 { 0.0 } else { *e });
        Arm {
            links: ROWS.map(|(a, twist, d)| Link::craig(a, twist, d)),
            tool: Pose {
                r: flip,
                p: Vector3::new(0.0, 0.0, 0.220),
            },
            ranges: [
                range(-150.0, 150.0),
                range(-185.0, 10.0),
                range(-65.0, 65.0),
                range(-170.0, 170.0),
                range(-145.0, 145.0),
                range(-270.0, 270.0),
            ],
            coupling: Coupling::parallel_link(2),
        }
    }
}
