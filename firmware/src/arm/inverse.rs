//! Closed-form inverse kinematics of the K3S: all eight solutions, and the one to take.
//!
//! Source: thesis Appendix A, (A.26)–(A.44) as corrected and verified in the spec, plus the second wrist (θ₃+π, −θ₄, θ₅+π)
//! that it leaves out. Two shoulders × two elbows × two wrists.
//!
//! In f32 a pose carries angles to about 1e-7 rad divided by the lever that they act on. Where that lever vanishes
//! (wrist θ₄ = 0 or π: only θ₃ ± θ₅ acts; shoulder: wrist centre above the base axis) every angle explains the pose; there
//! the solution keeps the old angle, so that a motion through a singularity does not jump.

use super::{Arm, JointRange};
use crate::geometry::{
    Pose,
    trig::{atan2, sin_cos, sqrt, wrap},
};
use core::f32::consts::{PI, TAU};
use hal::wire_struct;

/// An old angle is kept where changing it moves nothing by more than this (m at the shoulder, rad at the wrist): ten times
/// the rounding of a pose.
const RESOLUTION: f32 = 1e-6;

/// Rounding allowed for at the joint limits, rad, and at the reach (m²): what lies on the edge counts as inside.
const EDGE: f32 = 1e-5;

/// Every joint vector (rad) that gives a pose, in no order of merit; empty where it is out of reach.
pub type Solutions = heapless::Vec<[f32; 6], 8>;

/// The lengths that the closed form needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct K3sInverse {
    l0: f32,
    l1: f32,
    l2: f32,
    d3: f32,
    tool_inverse: Pose,
    ranges: [JointRange; 6],
}

wire_struct!(K3sInverse {
    l0: f32,
    l1: f32,
    l2: f32,
    d3: f32,
    tool_inverse: Pose,
    ranges: [JointRange; 6]
});

/// The arm's table is not of the K3S's form; holds the number of the first row that differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotK3s {
    /// Row of the table, from zero.
    pub row: u8,
}

/// Why a pose has no joint vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unreachable {
    /// The wrist centre is too far or too near.
    OutOfReach,
    /// It could be reached, but only beyond the joint limits.
    BeyondLimits,
}

impl K3sInverse {
    /// Reads the lengths off a table of the form (0,0,0) (l0,−π/2,0) (l1,π,0) (l2,π/2,d3) (0,−π/2,0) (0,π/2,0), l1 > 0.
    pub fn of(arm: &Arm<6>) -> Result<Self, NotK3s> {
        let [_, shoulder, elbow, forearm, _, _] = &arm.links;
        let (l0, l1, l2, d3) = (shoulder.a, elbow.a, forearm.a, forearm.d);
        // (a, cos α, sin α, d)
        let form = [
            (0.0, 1.0, 0.0, 0.0),
            (l0, 0.0, -1.0, 0.0),
            (l1, -1.0, 0.0, 0.0),
            (l2, 0.0, 1.0, d3),
            (0.0, 0.0, -1.0, 0.0),
            (0.0, 0.0, 1.0, 0.0),
        ];
        for (row, (link, form)) in (0u8..).zip(arm.links.iter().zip(form)) {
            if (link.a, link.twist_cos, link.twist_sin, link.d) != form || (row == 2 && link.a <= 0.0) {
                return Err(NotK3s { row });
            }
        }
        Ok(Self {
            l0,
            l1,
            l2,
            d3,
            tool_inverse: arm.tool.inverse(),
            ranges: arm.ranges,
        })
    }

    /// The joint vector (rad) within limits that gives tip pose `pose` (Σ_B) and lies nearest to `near` (rad) in the sum of
    /// squares, each angle taken modulo whole turns.
    pub fn nearest(&self, pose: &Pose, near: &[f32; 6]) -> Result<[f32; 6], Unreachable> {
        let flange = *pose * self.tool_inverse;
        let mut best = Err(Unreachable::OutOfReach);
        let mut least = f32::INFINITY;
        for shoulder in shoulders(&flange, near[0]) {
            for elbow_sign in [1.0, -1.0] {
                let Some((q1, q2)) = self.elbow(&flange, shoulder, elbow_sign) else {
                    continue;
                };
                if best == Err(Unreachable::OutOfReach) {
                    best = Err(Unreachable::BeyondLimits);
                }
                // Most arms of the eight end here, before the dearer wrist.
                let mut arm = [shoulder, q1, q2].into_iter().zip(near).zip(&self.ranges);
                if arm.any(|((angle, near), range)| turn_into(range, angle, *near).is_none()) {
                    continue;
                }
                for twin in wrists(&flange, shoulder, (q1, q2), near[3]) {
                    let Some(q) = self.within_limits(&twin, near) else {
                        continue;
                    };
                    let mut distance = 0.0;
                    for (a, b) in q.iter().zip(near) {
                        distance += (a - b) * (a - b);
                    }
                    if distance < least {
                        least = distance;
                        best = Ok(q);
                    }
                }
            }
        }
        best
    }

    /// `near` with the joints that can make a whole turn in the middle of their range: what to be nearest to where a path begins that may
    /// turn them either way. An arm that was stopped at a path's end has used up the turn that it needs.
    pub fn unwound(&self, near: &[f32; 6]) -> [f32; 6] {
        let mut near = *near;
        for (near, range) in near.iter_mut().zip(&self.ranges) {
            if range.max - range.min >= TAU {
                *near = 0.5 * (range.min + range.max);
            }
        }
        near
    }

    /// `q` moved by whole turns, joint by joint, into the limits and there nearest to `near`; `None` if that cannot be.
    #[inline(never)]
    pub fn within_limits(&self, q: &[f32; 6], near: &[f32; 6]) -> Option<[f32; 6]> {
        let mut turned = *q;
        for ((angle, near), range) in turned.iter_mut().zip(near).zip(&self.ranges) {
            *angle = turn_into(range, *angle, *near)?;
        }
        Some(turned)
    }

    /// Every joint vector (rad, each angle in ±π) that gives tip pose `pose`, limits or not: 8, 4 or none. `near` decides
    /// only what the pose leaves open, at the shoulder and wrist singularities.
    pub fn solutions(&self, pose: &Pose, near: &[f32; 6]) -> Solutions {
        let flange = *pose * self.tool_inverse;
        let mut solutions = Solutions::new();
        for shoulder in shoulders(&flange, near[0]) {
            for elbow_sign in [1.0, -1.0] {
                let Some(elbow) = self.elbow(&flange, shoulder, elbow_sign) else {
                    continue;
                };
                for q in wrists(&flange, shoulder, elbow, near[3]) {
                    // Eight at most, by the three loops of two.
                    let _ = solutions.push(q);
                }
            }
        }
        solutions
    }

    /// θ₁ and θ₂ from the wrist centre, (A.29)–(A.37); `None` where it is out of reach.
    #[inline(never)] // wanted four times in a row: else the loops are unrolled, which is kilobytes for a few instructions
    fn elbow(&self, flange: &Pose, q0: f32, sign: f32) -> Option<(f32, f32)> {
        let (s0, c0) = sin_cos(q0);
        let (x, z) = (c0 * flange.p.x + s0 * flange.p.y - self.l0, flange.p.z);
        let fore = self.l2 * self.l2 + self.d3 * self.d3;
        let k = (x * x + z * z - self.l1 * self.l1 - fore) / (2.0 * self.l1);
        let square = fore - k * k;
        if square < -EDGE {
            return None;
        }
        let q2 = wrap(atan2(self.l2, -self.d3) - atan2(k, sign * sqrt(square)));
        let (s2, c2) = sin_cos(q2);
        let (u, w) = (self.l2 + c2 * self.l1, self.d3 + s2 * self.l1);
        let q12 = atan2(-w * x - u * z, u * x - w * z);
        Some((q12 + q2, q2))
    }
}

/// The two θ₀: towards the wrist centre and away from it.
fn shoulders(flange: &Pose, near0: f32) -> [f32; 2] {
    let towards = keep_or(near0, flange.p.y, flange.p.x);
    [towards, wrap(towards + PI)]
}

/// `angle` moved by whole turns into `range` and there nearest to `near` (all rad); `None` if that cannot be.
fn turn_into(range: &JointRange, angle: f32, near: f32) -> Option<f32> {
    let angle = near + wrap(angle - near);
    let angle = if angle > range.max + EDGE {
        angle - TAU
    } else if angle < range.min - EDGE {
        angle + TAU
    } else {
        angle
    };
    (angle <= range.max + EDGE && angle >= range.min - EDGE).then_some(angle)
}

/// The two wrists of one arm.
fn wrists(flange: &Pose, q0: f32, (q1, q2): (f32, f32), near3: f32) -> [[f32; 6]; 2] {
    let (q3, q4, q5) = wrist(flange, q0, q1 - q2, near3);
    let (q1, q2) = (wrap(q1), wrap(q2));
    [
        [q0, q1, q2, q3, q4, q5],
        [q0, q1, q2, wrap(q3 + PI), -q4, wrap(q5 + PI)],
    ]
}

/// θ₃, θ₄ and θ₅ from the flange's axes, (A.38)–(A.44), given the forearm's heading θ₀ and pitch θ₁₂.
#[inline(never)] // for the same reason
fn wrist(flange: &Pose, q0: f32, q12: f32, near3: f32) -> (f32, f32, f32) {
    let r = &flange.r;
    let ((s0, c0), (s12, c12)) = (sin_cos(q0), sin_cos(q12));
    // Axes of the flange in the forearm's frame (x, y in the plane across it, z along it towards the elbow).
    let forearm = |x: f32, y: f32, z: f32| {
        (
            c12 * (c0 * x + s0 * y) - s12 * z,
            s0 * x - c0 * y,
            -(s12 * (c0 * x + s0 * y) + c12 * z),
        )
    };
    let (a, b, along) = forearm(r.m13, r.m23, r.m33);
    let q3 = keep_or(near3, b, a);
    let (s3, c3) = sin_cos(q3);
    let q4 = atan2(c3 * a + s3 * b, along);
    // z₃ turned by θ₃ is the wrist axis; x₅ measured from it and from what is across.
    let (xa, xb, xz) = forearm(r.m11, r.m21, r.m31);
    let (s4, c4) = sin_cos(q4);
    let s5 = c3 * xb - s3 * xa;
    let c5 = c4 * (c3 * xa + s3 * xb) - s4 * xz;
    (q3, q4, atan2(s5, c5))
}

/// The angle of (x, y), or `old` (modulo half a turn) where the point is so near the origin that `old` is as good.
fn keep_or(old: f32, y: f32, x: f32) -> f32 {
    let (s, c) = sin_cos(old);
    let across = c * y - s * x;
    let along = c * x + s * y;
    // Half-way to a resolved angle (1e4 resolutions) there is nothing to keep.
    if across.abs() <= RESOLUTION && along.abs() < 1e4 * RESOLUTION {
        wrap(if along < 0.0 { old + PI } else { old })
    } else {
        atan2(y, x)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::sample::k3s;
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// A plain congruential stream: the 10 000 vectors are the same on every machine.
    struct Stream(u64);
    impl Stream {
        fn between(&mut self, min: f32, max: f32) -> f32 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            min + (max - min) * ((self.0 >> 40) as f32 / 16_777_216.0)
        }
        fn joints(&mut self, arm: &Arm<6>) -> [f32; 6] {
            arm.ranges.map(|r| self.between(r.min, r.max))
        }
    }

    fn worst_angle(a: &[f32; 6], b: &[f32; 6]) -> f32 {
        a.iter().zip(b).map(|(a, b)| wrap(a - b).abs()).fold(0.0, f32::max)
    }

    fn tip_error(arm: &Arm<6>, q: &[f32; 6], pose: &Pose) -> (f32, f32) {
        let got = arm.forward(q);
        ((got.p - pose.p).abs().max(), (got.r - pose.r).abs().max())
    }

    #[test]
    fn the_inverse_of_forward_finds_the_joints_and_every_solution_gives_the_pose() {
        let arm = k3s();
        let inverse = K3sInverse::of(&arm).unwrap();
        let mut stream = Stream(1);
        let (mut eight, mut four, mut blurred) = (0, 0, 0);
        let (mut worst_joint, mut worst_position, mut worst_rotation) = (0.0_f32, 0.0_f32, 0.0_f32);
        for _ in 0..10_000 {
            let q = stream.joints(&arm);
            let pose = arm.forward(&q);
            let wrist = arm.frames(&q).joints[5].p;
            let solutions = inverse.solutions(&pose, &[0.0; 6]);
            match solutions.len() {
                8 => eight += 1,
                4 => four += 1,
                n => panic!("{n} solutions at {q:?}"),
            }
            for s in &solutions {
                let (position, rotation) = tip_error(&arm, s, &pose);
                worst_position = worst_position.max(position);
                worst_rotation = worst_rotation.max(rotation);
            }
            // With nothing else to go by, where a lever is below 5 mm (shoulder) or 5 mrad (wrist) the f32 pose itself does not
            // hold the angle to 1e-4 rad; the old angles decide it.
            let lever = sqrt(wrist.x * wrist.x + wrist.y * wrist.y).min(sin_cos(q[4]).0.abs());
            let found = if lever < 5e-3 {
                blurred += 1;
                inverse.solutions(&pose, &q)
            } else {
                solutions
            };
            let nearest = found.iter().map(|s| worst_angle(s, &q)).fold(f32::INFINITY, f32::min);
            worst_joint = worst_joint.max(nearest);
        }
        std::println!(
            "8: {eight}, 4: {four}, blurred {blurred}; {worst_joint:e} rad, {worst_position:e} m, {worst_rotation:e}"
        );
        assert!(worst_joint < 1e-4, "{worst_joint:e} rad");
        assert!(worst_position < 1e-5, "{worst_position:e} m");
        assert!(worst_rotation < 1e-5, "{worst_rotation:e}");
        assert!(blurred < 100, "{blurred} of 10 000 poses are singular to f32");
    }

    #[test]
    fn near_wrist_and_shoulder_singularities_every_solution_still_gives_the_pose() {
        let arm = k3s();
        let inverse = K3sInverse::of(&arm).unwrap();
        let mut stream = Stream(2);
        let mut worst = (0.0_f32, 0.0_f32);
        let mut kept = 0.0_f32;
        for i in 0..4000 {
            let mut q = stream.joints(&arm);
            let size = [0.0, 1e-8, 1e-6, 1e-4, 1e-3][i % 5];
            q[4] = if i % 2 == 0 { size } else { -size };
            if i % 3 == 0 {
                // Wrist centre over the base axis (θ2 is free): l1 c1 + l2 c12 − d3 s12 = −l0, by bisection over θ1.
                let radius = |q1: f32| {
                    let ((_, c1), (s12, c12)) = (sin_cos(q1), sin_cos(q1 - q[2]));
                    0.12 + 0.42 * c1 + 0.05 * c12 - 0.43 * s12
                };
                let (mut low, mut high) = (-3.2, 0.17);
                if radius(low) * radius(high) < 0.0 {
                    for _ in 0..40 {
                        let middle = 0.5 * (low + high);
                        if radius(low) * radius(middle) <= 0.0 {
                            high = middle
                        } else {
                            low = middle
                        }
                    }
                    q[1] = low + size;
                }
            }
            let pose = arm.forward(&q);
            for s in inverse.solutions(&pose, &[0.3; 6]) {
                let (position, rotation) = tip_error(&arm, &s, &pose);
                worst = (worst.0.max(position), worst.1.max(rotation));
            }
            let nearest = inverse
                .solutions(&pose, &q)
                .iter()
                .map(|s| worst_angle(s, &q))
                .fold(f32::INFINITY, f32::min);
            kept = kept.max(nearest);
        }
        std::println!("{worst:?} m, rotation; kept within {kept:e} rad");
        assert!(worst.0 < 1e-5 && worst.1 < 1e-5, "{worst:?}");
        assert!(kept < 1e-4, "{kept:e} rad");
    }

    proptest! {
        #[test]
        fn the_nearest_solution_of_a_small_motion_is_the_neighbour(seed: u64, step in prop::array::uniform6(-0.02f32..0.02)) {
            let arm = k3s();
            let inverse = K3sInverse::of(&arm).unwrap();
            let q = Stream(seed).joints(&arm);
            let lever = sin_cos(q[4]).0.abs();
            prop_assume!(lever > 0.1 && arm.frames(&q).joints[5].p.xy().norm_squared() > 0.01);
            let near = core::array::from_fn(|i| q[i] + step[i]);
            let got = inverse.nearest(&arm.forward(&q), &near).unwrap();
            for (a, b) in got.iter().zip(&q) {
                prop_assert!((a - b).abs() < 1e-4, "{:?} {:?}", got, q);
            }
        }
    }

    #[test]
    fn out_of_reach_and_beyond_limits_are_told_apart() {
        let inverse = K3sInverse::of(&k3s()).unwrap();
        let far = Pose {
            p: Vector3::new(1.3, 0.0, 0.0),
            ..Pose::identity()
        };
        assert_eq!(inverse.nearest(&far, &[0.0; 6]), Err(Unreachable::OutOfReach));
        // On the far side of the base, low: the parallelogram or the shoulder forbids it.
        let behind = Pose {
            p: Vector3::new(-0.85, 0.0, -0.2),
            ..Pose::identity()
        };
        assert_eq!(inverse.nearest(&behind, &[0.0; 6]), Err(Unreachable::BeyondLimits));
    }

    #[test]
    fn a_whole_turn_more_is_found_when_it_is_nearer() {
        let arm = k3s();
        let inverse = K3sInverse::of(&arm).unwrap();
        let q = [0.1, -1.6, 0.1, 0.2, -1.5, 4.0];
        let got = inverse
            .nearest(&arm.forward(&q), &[0.1, -1.6, 0.1, 0.2, -1.5, 3.9])
            .unwrap();
        assert!((got[5] - 4.0).abs() < 1e-5, "{got:?}");
        let other = inverse
            .nearest(&arm.forward(&q), &[0.1, -1.6, 0.1, 0.2, -1.5, -2.0])
            .unwrap();
        assert!((other[5] - (4.0 - TAU)).abs() < 1e-5, "{other:?}");
    }

    #[test]
    fn another_arm_is_refused_by_row() {
        let mut arm = k3s();
        arm.links[4].a = 0.01;
        assert_eq!(K3sInverse::of(&arm), Err(NotK3s { row: 4 }));
    }
}
