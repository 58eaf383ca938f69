//! Where the part lies, and the motion from the part as taught to the part as it lies.

use crate::geometry::Pose;
use crate::geometry::rotation::{rot_x, rot_y};
use crate::geometry::trig::{sin_cos, sqrt};
use hal::wire_struct;
use nalgebra::{Matrix3, Vector3};

/// Where the part lies, seen from the taught start (paper 003, chapter 5): the six numbers that a start sensor measures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StartPose {
    /// Shift of the seam's start in the taught nozzle frame at s = 0, m.
    pub shift: [f32; 3],
    /// θ_x, θ_y and θ_z as the start sensor measures them, rad: θ_z in its own image plane, not about the pitched axis.
    pub tilt: [f32; 3],
}

wire_struct!(StartPose {
    shift: [f32; 3],
    tilt: [f32; 3]
});

impl StartPose {
    /// The rigid motion, in Σ_B, from the part as taught to the part as it lies (6.1, 6.2, and 6.3 corrected: θ_z* = atan(tan θ_z · cos θ_y)).
    /// `t_b_n0` is the taught nozzle pose at s = 0.
    pub fn motion(&self, t_b_n0: &Pose) -> Pose {
        let [x, y, z] = self.tilt;
        let ((sin_z, cos_z), (_, cos_y)) = (sin_cos(z), sin_cos(y));
        // θ_z* has the tangent sin_z·cos_y / cos_z: its sine and cosine without an inverse function.
        let (side, ahead) = (sin_z * cos_y, cos_z);
        let scale = 1.0 / sqrt(side * side + ahead * ahead);
        let (s, c) = (side * scale, ahead * scale);
        let yaw = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let measured = Pose {
            r: rot_x(x) * rot_y(y) * yaw,
            p: Vector3::from(self.shift),
        };
        *t_b_n0 * measured * t_b_n0.inverse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::rot_z;
    use crate::geometry::trig::{asin, atan2};

    #[test]
    fn the_start_pose_says_how_the_part_was_moved() {
        let taught = Pose {
            r: rot_z(0.3) * rot_x(0.35),
            p: Vector3::new(0.5, -0.1, 0.1),
        };
        let moved = Pose {
            r: rot_x(0.03) * rot_y(-0.05) * rot_z(0.04),
            p: Vector3::new(0.008, -0.009, 0.004),
        };
        // The part is moved by a motion of Σ_B; the start sensor sees it from the taught start: E = T0⁻¹·motion·T0.
        let seen = taught.inverse() * moved * taught;
        let (y, z_star) = (asin(seen.r.m13), -seen.r.m12 / seen.r.m11);
        let z = atan2(z_star, sin_cos(y).1);
        let x = atan2(-seen.r.m23, seen.r.m33);
        let start = StartPose {
            shift: seen.p.into(),
            tilt: [x, y, z],
        };
        let motion = start.motion(&taught);
        assert!(
            (motion.r - moved.r).iter().all(|e| e.abs() < 1e-6),
            "{:?}",
            motion.r - moved.r
        );
        assert!(
            (motion.p - moved.p).iter().all(|e| e.abs() < 1e-6),
            "{:?}",
            motion.p - moved.p
        );
    }
}
