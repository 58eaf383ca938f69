//! Rotations: about the axes, and between matrices and rotation vectors.

use super::trig::{atan2, sin_cos, sqrt};
use nalgebra::{Matrix3, Vector3};

/// Rotation by `angle` (rad) about x.
pub fn rot_x(angle: f32) -> Matrix3<f32> {
    let (s, c) = sin_cos(angle);
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

/// Rotation by `angle` (rad) about y.
pub fn rot_y(angle: f32) -> Matrix3<f32> {
    let (s, c) = sin_cos(angle);
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

/// Rotation by `angle` (rad) about z.
pub fn rot_z(angle: f32) -> Matrix3<f32> {
    let (s, c) = sin_cos(angle);
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// a·b by columns: nalgebra's product begins by clearing its result, which costs as much again.
pub fn product(a: &Matrix3<f32>, b: &Matrix3<f32>) -> Matrix3<f32> {
    let [x, y, z] = b.data.0.map(|column| rotate(a, &Vector3::from(column)).into());
    Matrix3::from([x, y, z])
}

/// a·v, likewise.
pub fn rotate(a: &Matrix3<f32>, v: &Vector3<f32>) -> Vector3<f32> {
    Vector3::new(
        a.m11 * v.x + a.m12 * v.y + a.m13 * v.z,
        a.m21 * v.x + a.m22 * v.y + a.m23 * v.z,
        a.m31 * v.x + a.m32 * v.y + a.m33 * v.z,
    )
}

/// a × b.
pub fn cross(a: &Vector3<f32>, b: &Vector3<f32>) -> Vector3<f32> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// Euclidean length of a vector; nalgebra's `norm` would take the square root of whatever back-end is linked.
pub fn length(v: &Vector3<f32>) -> f32 {
    sqrt(v.x * v.x + v.y * v.y + v.z * v.z)
}

/// `v` scaled to length 1, or `None` where it is too short (below 1e-12) to have a direction.
pub fn unit(v: &Vector3<f32>) -> Option<Vector3<f32>> {
    let n = length(v);
    (n > 1e-12).then(|| v * (1.0 / n))
}

/// Rotation matrix of a rotation vector (axis times angle, rad): Rodrigues' formula, with series below 0.02 rad.
pub fn exp(v: &Vector3<f32>) -> Matrix3<f32> {
    let square = v.x * v.x + v.y * v.y + v.z * v.z;
    // sin θ / θ and (1 − cos θ)/θ²; below 0.02 rad the next terms of the series are under 2e-10.
    let (a, b) = if square < 4e-4 {
        (1.0 - square * (1.0 / 6.0), 0.5 - square * (1.0 / 24.0))
    } else {
        let angle = sqrt(square);
        let (s, _) = sin_cos(angle);
        let (h, _) = sin_cos(0.5 * angle);
        (s / angle, 2.0 * h * h / square)
    };
    let (x, y, z) = (v.x, v.y, v.z);
    Matrix3::new(
        1.0 - b * (y * y + z * z),
        b * x * y - a * z,
        b * x * z + a * y,
        b * x * y + a * z,
        1.0 - b * (x * x + z * z),
        b * y * z - a * x,
        b * x * z - a * y,
        b * y * z + a * x,
        1.0 - b * (x * x + y * y),
    )
}

/// Trace of a turn by 0.2 rad, 1 + 2 cos θ: smaller turns have a larger one.
const SMALL_TURN_TRACE: f32 = 2.960_133;

/// Rotation vector of a rotation matrix, length in [0, π].
///
/// By way of the quaternion whose largest component is extracted first (Shepperd 1978), so it loses no digits anywhere,
/// half turns included. At exactly half a turn the sign of the axis is arbitrary.
pub fn log(r: &Matrix3<f32>) -> Vector3<f32> {
    let trace = r.m11 + r.m22 + r.m33;
    if trace > SMALL_TURN_TRACE {
        // sin θ times the axis, and θ/sin θ from the series of the arcus sine: off by less than 3e-7 of itself.
        let half = Vector3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12) * 0.5;
        let square = half.x * half.x + half.y * half.y + half.z * half.z;
        return half * (1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0))));
    }
    // (w, x, y, z), each four times the largest component too large; only ratios are used.
    let (w, v) = if trace >= r.m11 && trace >= r.m22 && trace >= r.m33 {
        (1.0 + trace, Vector3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12))
    } else if r.m11 >= r.m22 && r.m11 >= r.m33 {
        (
            r.m32 - r.m23,
            Vector3::new(1.0 + r.m11 - r.m22 - r.m33, r.m12 + r.m21, r.m13 + r.m31),
        )
    } else if r.m22 >= r.m33 {
        (
            r.m13 - r.m31,
            Vector3::new(r.m12 + r.m21, 1.0 - r.m11 + r.m22 - r.m33, r.m23 + r.m32),
        )
    } else {
        (
            r.m21 - r.m12,
            Vector3::new(r.m13 + r.m31, r.m23 + r.m32, 1.0 - r.m11 - r.m22 + r.m33),
        )
    };
    let (w, v) = if w < 0.0 { (-w, -v) } else { (w, v) };
    let n = length(&v);
    // angle/sin(angle/2), over |(w, v)| ≈ w when the vector part vanishes.
    let scale = if n > 1e-6 * w { 2.0 * atan2(n, w) / n } else { 2.0 / w };
    v * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(a: &Matrix3<f32>, b: &Matrix3<f32>, bound: f32) -> bool {
        (a - b).iter().all(|e| e.abs() <= bound)
    }

    proptest! {
        #[test]
        fn log_undoes_exp_up_to_half_a_turn(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0, size in 0usize..5) {
            let direction = unit(&Vector3::new(x, y, z));
            prop_assume!(direction.is_some());
            let v = direction.unwrap() * [1e-7, 1e-3, 0.5, 2.0, 3.1][size];
            prop_assert!(length(&(log(&exp(&v)) - v)) < 1e-6, "{:?} {:?}", v, log(&exp(&v)));
        }

        #[test]
        fn exp_is_a_rotation(x in -4.0f32..4.0, y in -4.0f32..4.0, z in -4.0f32..4.0) {
            let r = exp(&Vector3::new(x, y, z));
            prop_assert!(close(&(r * r.transpose()), &Matrix3::identity(), 2e-6));
        }
    }

    #[test]
    fn exp_about_an_axis_is_the_axis_rotation() {
        for angle in [-3.0, -0.3, -0.01, 0.0, 1e-5, 0.019, 0.021, 1.0, 3.1] {
            assert!(close(&exp(&Vector3::new(angle, 0.0, 0.0)), &rot_x(angle), 3e-7));
            assert!(close(&exp(&Vector3::new(0.0, angle, 0.0)), &rot_y(angle), 3e-7));
            assert!(close(&exp(&Vector3::new(0.0, 0.0, angle)), &rot_z(angle), 3e-7));
        }
    }

    #[test]
    fn half_turns_have_logarithms() {
        let pi = core::f32::consts::PI;
        for r in [rot_x(pi), rot_y(pi), rot_z(pi)] {
            assert!((length(&log(&r)) - pi).abs() < 1e-6);
        }
        assert_eq!(log(&Matrix3::identity()), Vector3::zeros());
    }
}
