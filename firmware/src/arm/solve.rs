//! Damped least squares and manipulability, without an iteration: root-free Cholesky of J·Jᵀ + λ²I.

use super::Jacobian;
use nalgebra::Vector3;

/// Smallest pivot taken as such. Without damping a singular J·Jᵀ leaves pivots of rounding size (1e-7 of its entries, about
/// 1); dividing by one of those would turn rounding into motion.
const PIVOT_MIN: f32 = 1e-10;

/// Joint velocities (rad/s) that give the tip `twist` (m/s and rad/s, linear first, Σ_B): `Jᵀ(J·Jᵀ + λ²I)⁻¹·twist`.
///
/// With `lambda` = 0 the exact answer away from singularities; near one, `lambda` bounds |dq| by |twist|/(2λ).
#[inline(never)] // on its own it has all registers
pub fn solve_damped<const N: usize>(jacobian: &Jacobian<N>, twist: &[f32; 6], lambda: f32) -> [f32; N] {
    let mut gram = gram(jacobian);
    for (i, row) in gram.iter_mut().enumerate() {
        row[i] += lambda * lambda;
    }
    let y = solve_symmetric(&gram, twist);
    jacobian.data.0.map(|column| {
        let mut sum = 0.0;
        for (j, y) in column.iter().zip(&y) {
            sum += j * y;
        }
        sum
    })
}

/// Leaves the tip free to turn about `axis` (of length one, Σ_B): takes that out of the angular rows, so that a solution neither asks for it nor
/// holds it back. Five axes cannot do more. The twist to solve for must have none of it either.
pub fn free_about<const N: usize>(jacobian: &mut Jacobian<N>, axis: &Vector3<f32>) {
    for column in &mut jacobian.data.0 {
        let [.., x, y, z] = column;
        let about = *x * axis.x + *y * axis.y + *z * axis.z;
        *x -= about * axis.x;
        *y -= about * axis.y;
        *z -= about * axis.z;
    }
}

/// The x of A·x = b for a symmetric positive matrix given by its lower triangle.
#[inline(always)] // else what was worked out of the matrix goes through memory
pub fn solve_symmetric(a: &[[f32; 6]; 6], b: &[f32; 6]) -> [f32; 6] {
    let (l, pivots) = factor(a);
    let mut y = *b;
    for i in 0..6 {
        for k in 0..i {
            y[i] -= l[i][k] * y[k];
        }
    }
    for (y, pivot) in y.iter_mut().zip(&pivots) {
        *y /= pivot;
    }
    for i in (0..6).rev() {
        for k in i + 1..6 {
            y[i] -= l[k][i] * y[k];
        }
    }
    y
}

/// Yoshikawa's manipulability √det(J·Jᵀ), for six joints |det J|: zero at a singularity. Unit m³ (three linear rows).
pub fn manipulability<const N: usize>(jacobian: &Jacobian<N>) -> f32 {
    let (_, pivots) = factor(&gram(jacobian));
    let mut det = 1.0;
    for pivot in pivots {
        det *= if pivot > PIVOT_MIN { pivot } else { 0.0 };
    }
    crate::geometry::trig::sqrt(det)
}

/// J·Jᵀ; only the lower triangle is filled.
#[inline(always)]
fn gram<const N: usize>(jacobian: &Jacobian<N>) -> [[f32; 6]; 6] {
    let mut gram = [[0.0; 6]; 6];
    // How many columns is hidden: unrolled over all of them, the sums no longer fit the registers, a fifth of the solution's cost.
    let [first, others @ ..] = core::hint::black_box(jacobian.data.0.as_slice()) else {
        return gram;
    };
    for i in 0..6 {
        for k in 0..=i {
            gram[i][k] = first[i] * first[k];
        }
    }
    for column in others {
        for i in 0..6 {
            for k in 0..=i {
                gram[i][k] += column[i] * column[k];
            }
        }
    }
    gram
}

/// A = L·D·Lᵀ of a symmetric positive matrix given by its lower triangle: unit lower L, and the pivots D.
#[inline(always)]
fn factor(a: &[[f32; 6]; 6]) -> ([[f32; 6]; 6], [f32; 6]) {
    let mut l = [[0.0; 6]; 6];
    let mut pivots = [0.0; 6];
    for i in 0..6 {
        let mut pivot = a[i][i];
        let mut row = [0.0; 6]; // of L·D
        for k in 0..i {
            let mut entry = a[i][k];
            for m in 0..k {
                entry -= row[m] * l[k][m];
            }
            row[k] = entry;
            let scaled = entry / pivots[k];
            pivot -= entry * scaled;
            l[i][k] = scaled;
        }
        pivots[i] = if pivot > PIVOT_MIN { pivot } else { PIVOT_MIN };
    }
    (l, pivots)
}

#[cfg(test)]
mod tests {
    use super::super::sample::k3s;
    use super::*;
    use nalgebra::Vector6;
    use proptest::prelude::*;

    fn condition(q: &[f32; 6], length: f64) -> (f64, f64) {
        let mut j = k3s().frames(q).jacobian().map(f64::from);
        j.fixed_view_mut::<3, 6>(0, 0).iter_mut().for_each(|e| *e /= length);
        let s = j.singular_values();
        (s[0] / s[5], s[5])
    }

    proptest! {
        #[test]
        fn the_joint_velocities_give_the_asked_twist(
            q2 in -1.1f32..1.1, q4 in -2.0f32..-0.6, q5 in -3.0f32..3.0, twist in prop::array::uniform6(-0.3f32..0.3)
        ) {
            let jacobian = k3s().frames(&[0.2, -1.6, q2, 0.4, q4, q5]).jacobian();
            prop_assume!(manipulability(&jacobian) > 0.01);
            let twist_got = jacobian * Vector6::from(solve_damped(&jacobian, &twist, 0.0));
            for (got, asked) in twist_got.iter().zip(&twist) {
                prop_assert!((got - asked).abs() < 2e-4, "{twist_got} {twist:?}");
            }
        }

        #[test]
        fn damping_bounds_the_joint_velocities_at_a_singularity(twist in prop::array::uniform6(-0.3f32..0.3), q4 in -0.01f32..0.01) {
            let jacobian = k3s().frames(&[0.2, -1.6, 0.1, 0.4, q4, 0.3]).jacobian();
            let dq = solve_damped(&jacobian, &twist, 0.05);
            let (speed, asked) = (Vector6::from(dq).norm(), Vector6::from(twist).norm());
            prop_assert!(speed <= asked / (2.0 * 0.05) * 1.01, "{speed} rad/s for {asked}");
        }

        #[test]
        fn five_joints_move_and_point_the_tip_as_asked_whatever_they_turn_it_about_itself(
            q1 in -1.2f32..-0.4, q2 in 0.6f32..1.6, q3 in -1.2f32..0.4, twist in prop::array::uniform6(-0.3f32..0.3)
        ) {
            let arm = crate::arm::sample::five();
            let frames = arm.frames(&[0.3, q1, q2, q3, -1.4]);
            let axis: Vector3<f32> = frames.tip.r.column(2).into();
            let mut jacobian = frames.jacobian();
            free_about(&mut jacobian, &axis);
            prop_assume!(jacobian.map(f64::from).singular_values()[4] > 0.1);
            let [linear, angular] = [[0, 1, 2], [3, 4, 5]].map(|rows| Vector3::from(rows.map(|i| twist[i])));
            let pointing = angular - axis * axis.dot(&angular);
            let asked = [linear.x, linear.y, linear.z, pointing.x, pointing.y, pointing.z];
            let got = frames.jacobian() * nalgebra::Vector5::from(solve_damped(&jacobian, &asked, 1e-3));
            let turned: Vector3<f32> = got.fixed_rows::<3>(3).into();
            prop_assert!((got.fixed_rows::<3>(0) - linear).abs().max() < 1e-3, "{got} {asked:?}");
            prop_assert!((turned - axis * axis.dot(&turned) - pointing).abs().max() < 1e-3, "{got} {asked:?}");
        }

        #[test]
        fn manipulability_is_the_determinants_size(q in prop::array::uniform6(-3.1f32..3.1)) {
            let jacobian = k3s().frames(&q).jacobian();
            let det = jacobian.map(f64::from).determinant().abs();
            prop_assert!((manipulability(&jacobian) as f64 - det).abs() < 1e-4 + 1e-3 * det, "{det}");
        }
    }

    #[test]
    fn an_undamped_singular_solve_stays_finite() {
        let jacobian = k3s().frames(&[0.0, -1.5, 0.0, 0.0, 0.0, 0.0]).jacobian();
        assert!(solve_damped(&jacobian, &[0.1; 6], 0.0).iter().all(|v| v.is_finite()));
    }

    /// The spec: nozzle down at x = 0.55 m, z = −0.05 m, length scale 0.3 m: condition 5.9, smallest singular value 0.48.
    #[test]
    fn the_condition_number_is_the_quoted_one() {
        let arm = k3s();
        let inverse = super::super::K3sInverse::of(&arm).unwrap();
        let pose = crate::geometry::Pose {
            r: nalgebra::Matrix3::identity(),
            p: nalgebra::Vector3::new(0.55, 0.0, -0.05),
        };
        let q = inverse.nearest(&pose, &[0.0, -1.6, 0.0, 0.0, -1.6, 0.0]).unwrap();
        let (condition, smallest) = condition(&q, 0.3);
        assert!(
            (condition - 5.9).abs() < 0.1 && (smallest - 0.48).abs() < 0.02,
            "{condition} {smallest} at {q:?}"
        );
    }
}
