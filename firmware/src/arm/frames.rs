//! Forward kinematics and the geometric Jacobian.

use super::{Arm, Link};
use crate::geometry::{Pose, trig::sin_cos};
use hal::wire_struct;
use nalgebra::{ArrayStorage, Matrix3, SMatrix, Vector3};

/// Geometric Jacobian: tip velocity in Σ_B (linear rows first, m/s; then angular, rad/s) per joint velocity (rad/s).
pub type Jacobian<const N: usize> = SMatrix<f32, 6, N>;

/// Sines and cosines of all joint angles: half of what kinematics costs, and dynamics wants them again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turns<const N: usize> {
    /// Joint angle (rad), its sine, its cosine.
    joints: [(f32, f32, f32); N],
    /// The joint whose sine and cosine [`Self::go`] computes anew next.
    anew: u8,
}

wire_struct!(Turns<const N: usize> { joints: [(f32, f32, f32); N], anew: u8 });

impl<const N: usize> Turns<N> {
    /// At joint angles zero.
    pub const ZERO: Self = Self {
        joints: [(0.0, 0.0, 1.0); N],
        anew: 0,
    };

    /// At joint angles `q` (rad).
    pub fn of(q: &[f32; N]) -> Self {
        let mut turns = Self::ZERO;
        for ((angle, sine, cosine), q) in turns.joints.iter_mut().zip(q) {
            *angle = *q;
            (*sine, *cosine) = sin_cos(*q);
        }
        turns
    }

    /// Goes on to joint angles `q` (rad): where near by the angle-sum formulas to third order, which is off by less than 4e-8, at half of
    /// what trigonometry costs. One joint in turn is computed anew, so that no more than N such steps and their roundings add up.
    pub fn go(&mut self, q: &[f32; N]) {
        self.anew = if self.anew + 1 < N as u8 { self.anew + 1 } else { 0 };
        for (joint, ((angle, sine, cosine), q)) in (0..).zip(self.joints.iter_mut().zip(q)) {
            let way = q - *angle;
            let (s, c) = (*sine, *cosine);
            *angle = *q;
            (*sine, *cosine) = if way.abs() < NEAR && joint != self.anew {
                let half = 0.5 * way * way;
                let sine = way - way * half * (1.0 / 3.0);
                (s + (c * sine - s * half), c - (s * sine + c * half))
            } else {
                sin_cos(*q)
            };
        }
    }

    /// Sine and cosine of each joint angle, base first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (f32, f32)> + ExactSizeIterator + '_ {
        self.joints.iter().map(|(_, sine, cosine)| (*sine, *cosine))
    }
}

/// Way over which [`Turns::go`] goes without trigonometry, rad: six cycles at 1 rad/s.
const NEAR: f32 = 0.03;

/// All frames of the arm at one joint vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames<const N: usize> {
    /// Pose of each joint's frame in Σ_B.
    pub joints: [Pose; N],
    /// Pose of the tool tip in Σ_B, `T_b_n`.
    pub tip: Pose,
}

impl Link {
    /// The frame behind Σ_B itself.
    #[inline(always)]
    fn first(&self, sine: f32, cosine: f32) -> Pose {
        let (ca, sa) = (self.twist_cos, self.twist_sin);
        let axis = Vector3::new(0.0, -sa, ca);
        Pose {
            r: columns(
                Vector3::new(cosine, ca * sine, sa * sine),
                Vector3::new(-sine, ca * cosine, sa * cosine),
                axis,
            ),
            p: Vector3::new(self.a, -sa * self.d, ca * self.d),
        }
    }

    /// The frame behind `before` (both in Σ_B), the joint turned by an angle of this `sine` and `cosine`.
    #[inline(always)] // between two calls the pose's twelve numbers would go through memory
    fn after(&self, before: &Pose, sine: f32, cosine: f32) -> Pose {
        let (r, p) = (&before.r, &before.p);
        let x = Vector3::new(r.m11, r.m21, r.m31);
        let y = Vector3::new(r.m12, r.m22, r.m32);
        let z = Vector3::new(r.m13, r.m23, r.m33);
        // Twist about x, then turn about the new z; columns written out, as most of Craig's factors are zero.
        let y_twisted = y * self.twist_cos + z * self.twist_sin;
        let axis = z * self.twist_cos - y * self.twist_sin;
        Pose {
            r: columns(x * cosine + y_twisted * sine, y_twisted * cosine - x * sine, axis),
            p: p + x * self.a + axis * self.d,
        }
    }
}

impl<const N: usize> Arm<N> {
    /// Pose of the tool tip in Σ_B at joint angles `q` (rad).
    pub fn forward(&self, q: &[f32; N]) -> Pose {
        let turns = Turns::of(q);
        let mut links = self.links.iter().zip(turns.iter());
        let mut at = links
            .next()
            .map_or(Pose::identity(), |(link, (sine, cosine))| link.first(sine, cosine));
        for (link, (sine, cosine)) in links {
            at = link.after(&at, sine, cosine);
        }
        at * self.tool
    }

    /// All frames at joint angles `q` (rad).
    pub fn frames(&self, q: &[f32; N]) -> Frames<N> {
        let mut at = Pose::identity();
        let joints = core::array::from_fn(|i| {
            let (sine, cosine) = sin_cos(q[i]);
            at = self.links[i].after(&at, sine, cosine);
            at
        });
        Frames {
            joints,
            tip: at * self.tool,
        }
    }

    /// Pose of the tool tip in Σ_B, and its `jacobian` filled in, without the frames between: what a step toward a pose needs.
    #[inline(never)] // on its own it has all registers
    pub fn tip_and_jacobian(&self, turns: &Turns<N>, jacobian: &mut Jacobian<N>) -> Pose {
        let place = |at: &Pose| [at.p.x, at.p.y, at.p.z, at.r.m13, at.r.m23, at.r.m33];
        let mut columns = jacobian.data.0.iter_mut().zip(self.links.iter().zip(turns.iter()));
        let mut at = Pose::identity();
        if let Some((column, (link, (sine, cosine)))) = columns.next() {
            at = link.first(sine, cosine);
            *column = place(&at);
        }
        for (column, (link, (sine, cosine))) in columns {
            at = link.after(&at, sine, cosine);
            *column = place(&at);
        }
        let tip = at * self.tool;
        for column in &mut jacobian.data.0 {
            let [x, y, z, axis_x, axis_y, axis_z] = *column;
            let axis = Vector3::new(axis_x, axis_y, axis_z);
            *column = twist(&axis, &(tip.p - Vector3::new(x, y, z)));
        }
        tip
    }
}

impl<const N: usize> Frames<N> {
    /// The Jacobian of the tool tip.
    pub fn jacobian(&self) -> Jacobian<N> {
        self.jacobian_at(&self.tip.p)
    }

    /// The Jacobian of a point `at` (m, Σ_B) that moves with the last link: the sensor's origin, say.
    pub fn jacobian_at(&self, at: &Vector3<f32>) -> Jacobian<N> {
        Jacobian::from_array_storage(ArrayStorage(self.joints.each_ref().map(|joint| {
            let axis = Vector3::new(joint.r.m13, joint.r.m23, joint.r.m33);
            twist(&axis, &(at - joint.p))
        })))
    }
}

/// Velocity of the point at `lever` from a joint that turns at 1 rad/s about `axis`, linear first.
fn twist(axis: &Vector3<f32>, lever: &Vector3<f32>) -> [f32; 6] {
    [
        axis.y * lever.z - axis.z * lever.y,
        axis.z * lever.x - axis.x * lever.z,
        axis.x * lever.y - axis.y * lever.x,
        axis.x,
        axis.y,
        axis.z,
    ]
}

fn columns(x: Vector3<f32>, y: Vector3<f32>, z: Vector3<f32>) -> Matrix3<f32> {
    Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::sample::{ROWS, k3s};
    use super::*;
    use nalgebra::{Matrix4, Matrix6, Vector6};
    use proptest::prelude::*;

    /// The Craig product in f64, written from the definition, not from the code under test.
    fn oracle(q: &[f64; 6]) -> Matrix4<f64> {
        let quarter = |angle: f32| (angle as f64 / std::f64::consts::FRAC_PI_2).round() * std::f64::consts::FRAC_PI_2;
        let mut t = Matrix4::<f64>::identity();
        for ((a, twist, d), theta) in ROWS.into_iter().zip(q) {
            let ((st, ct), (sa, ca)) = (theta.sin_cos(), quarter(twist).sin_cos());
            let (a, d) = (a as f64, d as f64);
            t *= Matrix4::new(
                ct,
                -st,
                0.0,
                a,
                st * ca,
                ct * ca,
                -sa,
                -sa * d,
                st * sa,
                ct * sa,
                ca,
                ca * d,
                0.0,
                0.0,
                0.0,
                1.0,
            );
        }
        t * Matrix4::new(
            1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.22, 0.0, 0.0, 0.0, 1.0,
        )
    }

    fn numerical_jacobian(q: &[f64; 6]) -> Matrix6<f64> {
        const STEP: f64 = 1e-6;
        let columns = std::array::from_fn::<_, 6, _>(|i| {
            let (mut up, mut down) = (*q, *q);
            up[i] += STEP;
            down[i] -= STEP;
            let (t, up, down) = (oracle(q), oracle(&up), oracle(&down));
            let rate = (up - down) / (2.0 * STEP);
            let spin = rate.fixed_view::<3, 3>(0, 0) * t.fixed_view::<3, 3>(0, 0).transpose();
            Vector6::new(
                rate[(0, 3)],
                rate[(1, 3)],
                rate[(2, 3)],
                spin[(2, 1)],
                spin[(0, 2)],
                spin[(1, 0)],
            )
        });
        Matrix6::from_columns(&columns)
    }

    #[test]
    fn at_zero_the_upper_arm_is_level_and_the_forearm_and_nozzle_hang_down() {
        let arm = k3s();
        let frames = arm.frames(&[0.0; 6]);
        assert!(
            (frames.joints[5].p - Vector3::new(0.59, 0.0, -0.43)).norm_squared() < 1e-13,
            "{:?}",
            frames.joints[5].p
        );
        assert!((frames.tip.p - Vector3::new(0.59, 0.0, -0.65)).norm_squared() < 1e-13);
        assert_eq!(
            (frames.tip.r.m33, frames.tip.r.m11),
            (1.0, 1.0),
            "z_N out of the work, x_N forward"
        );
    }

    proptest! {
        #[test]
        fn forward_agrees_with_the_craig_product_in_f64(q in prop::array::uniform6(-3.1f32..3.1)) {
            let (tip, truth) = (k3s().forward(&q), oracle(&q.map(f64::from)));
            for i in 0..3 {
                prop_assert!((tip.p[i] as f64 - truth[(i, 3)]).abs() < 1e-6);
                for j in 0..3 {
                    prop_assert!((tip.r[(i, j)] as f64 - truth[(i, j)]).abs() < 1e-6);
                }
            }
        }

        #[test]
        fn tip_and_jacobian_are_those_of_the_frames(q in prop::array::uniform6(-3.1f32..3.1)) {
            let frames = k3s().frames(&q);
            let mut jacobian = Jacobian::zeros();
            let tip = k3s().tip_and_jacobian(&Turns::of(&q), &mut jacobian);
            prop_assert_eq!(jacobian, frames.jacobian());
            prop_assert_eq!((tip, k3s().forward(&q)), (frames.tip, frames.tip));
        }

        #[test]
        fn turns_that_went_on_are_the_turns_there(q in prop::array::uniform6(-3.1f32..3.1), way in -0.04f32..0.04) {
            let mut there = q;
            let mut turns = Turns::of(&q);
            for _ in 0..50 {
                there = there.map(|angle| angle + way);
                turns.go(&there);
                for (got, truth) in turns.iter().zip(Turns::of(&there).iter()) {
                    prop_assert!((got.0 - truth.0).abs() < 4e-7 && (got.1 - truth.1).abs() < 4e-7, "{got:?} {truth:?}");
                }
            }
        }

        #[test]
        fn jacobian_agrees_with_numerical_differentiation(q in prop::array::uniform6(-3.1f32..3.1)) {
            let jacobian = k3s().frames(&q).jacobian();
            let truth = numerical_jacobian(&q.map(f64::from));
            for (a, b) in jacobian.iter().zip(truth.iter()) {
                prop_assert!((*a as f64 - b).abs() < 1.5e-6, "{jacobian} {truth}");
            }
        }

        /// det J = l1·r·(d3 cos θ2 − l2 sin θ2)·sin θ4, r = l0 + l1 c1 + l2 c12 − d3 s12; with a tool on the last axis too.
        #[test]
        fn determinant_is_the_closed_formula(q in prop::array::uniform6(-3.1f32..3.1)) {
            let jacobian = k3s().frames(&q).jacobian().map(f64::from);
            let q = q.map(f64::from);
            let pitch = q[1] - q[2];
            let r = 0.12 + 0.42 * q[1].cos() + 0.05 * pitch.cos() - 0.43 * pitch.sin();
            let formula = 0.42 * r * (0.43 * q[2].cos() - 0.05 * q[2].sin()) * q[4].sin();
            prop_assert!((jacobian.determinant() - formula).abs() < 1e-6, "{} {formula}", jacobian.determinant());
        }
    }
}
