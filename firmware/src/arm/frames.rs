//! Forward kinematics and the geometric Jacobian.

use super::Arm;
use crate::geometry::{Pose, trig::sin_cos};
use nalgebra::{ArrayStorage, Matrix3, SMatrix, Vector3};

/// Geometric Jacobian: tip velocity in Σ_B (linear rows first, m/s; then angular, rad/s) per joint velocity (rad/s).
pub type Jacobian<const N: usize> = SMatrix<f32, 6, N>;

/// All frames of the arm at one joint vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames<const N: usize> {
    /// Pose of each joint's frame in Σ_B.
    pub joints: [Pose; N],
    /// Pose of the tool tip in Σ_B, `T_b_n`.
    pub tip: Pose,
}

impl<const N: usize> Arm<N> {
    /// Pose of the tool tip in Σ_B at joint angles `q` (rad).
    pub fn forward(&self, q: &[f32; N]) -> Pose {
        self.frames(q).tip
    }

    /// All frames at joint angles `q` (rad); with [`Frames::jacobian`] about a thousand instructions for six joints.
    pub fn frames(&self, q: &[f32; N]) -> Frames<N> {
        let mut at = Pose::identity();
        let joints = core::array::from_fn(|i| {
            let link = &self.links[i];
            let (s, c) = sin_cos(q[i]);
            let (r, p) = (&at.r, &at.p);
            let x = Vector3::new(r.m11, r.m21, r.m31);
            let y = Vector3::new(r.m12, r.m22, r.m32);
            let z = Vector3::new(r.m13, r.m23, r.m33);
            // Twist about x, then turn about the new z; columns written out, as most of Craig's factors are zero.
            let y_twisted = y * link.twist_cos + z * link.twist_sin;
            let axis = z * link.twist_cos - y * link.twist_sin;
            at = Pose {
                r: columns(x * c + y_twisted * s, y_twisted * c - x * s, axis),
                p: p + x * link.a + axis * link.d,
            };
            at
        });
        Frames {
            joints,
            tip: at * self.tool,
        }
    }
}

impl<const N: usize> Frames<N> {
    /// The Jacobian of the tool tip.
    pub fn jacobian(&self) -> Jacobian<N> {
        self.jacobian_at(&self.tip.p)
    }

    /// The Jacobian of a point `at` (m, Σ_B) that moves with the last link: the sensor's origin, say.
    pub fn jacobian_at(&self, at: &Vector3<f32>) -> Jacobian<N> {
        Jacobian::from_array_storage(ArrayStorage(self.joints.map(|joint| {
            let (z, lever) = (Vector3::new(joint.r.m13, joint.r.m23, joint.r.m33), at - joint.p);
            [
                z.y * lever.z - z.z * lever.y,
                z.z * lever.x - z.x * lever.z,
                z.x * lever.y - z.y * lever.x,
                z.x,
                z.y,
                z.z,
            ]
        })))
    }
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
