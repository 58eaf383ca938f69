//! How the tool is held where its sensor looks at a place and its nozzle is not to touch what lies behind: raised, and leaning forward over the place.
//!
//! Beside a bend the sheet rises, and turned square to it the nozzle is over a flank. Raised that far, the sensor would see nothing any more; so the
//! tool leans about the place by as much as the flank rises, which is then as far below the nozzle everywhere.

use crate::geometry::Pose;
use crate::geometry::rotation::unit;
use hal::wire_struct;
use nalgebra::{Matrix3, Vector3};

/// How the tool is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// Height over the sheet, m: over a fresh bead and whatever the part is bent by.
    pub raise: f32,
    /// Distance ahead of the raised nozzle at which the nearest slit meets the sheet, m.
    pub look: f32,
    /// Slope by which the tool leans forward.
    pub lean: f32,
}

wire_struct!(Stance {
    raise: f32,
    look: f32,
    lean: f32
});

impl Stance {
    /// Pose of the nozzle (T_a_n, as what follows is in Σ_A) with the sensor's look at `place` (m) on a sheet with this `normal`, pointing to `ahead`,
    /// a unit vector in it; with a `share` of raise and lean, none to all.
    #[inline(never)] // wanted in four places
    pub fn over(&self, place: &Vector3<f32>, ahead: &Vector3<f32>, normal: &Vector3<f32>, share: f32) -> Pose {
        let left = normal.cross(ahead);
        let x = unit(&(ahead - normal * (self.lean * share))).unwrap_or(*ahead);
        let z = x.cross(&left);
        Pose {
            r: Matrix3::from_columns(&[x, left, z]),
            p: place - x * self.look + z * (self.raise * share),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::trig::sin_cos;

    #[test]
    fn the_look_stays_on_its_place_and_the_nozzle_above_the_flank_however_the_tool_is_turned() {
        const FLANK: f32 = 0.268;
        let stance = Stance {
            raise: 0.006,
            look: 0.075,
            lean: FLANK,
        };
        let place = Vector3::new(0.5, 0.1, 0.2);
        for degrees in [-100.0f32, -60.0, 0.0, 30.0, 90.0] {
            let (sin, cos) = sin_cos(degrees.to_radians());
            let pose = stance.over(&place, &Vector3::new(cos, sin, 0.0), &Vector3::z(), 1.0);
            let seen = pose * Vector3::new(stance.look, 0.0, -stance.raise);
            assert!((seen - place).abs().max() < 1e-6, "{seen} at {degrees}°");
            // The valley runs along x through the place.
            let flank = 0.2 + FLANK * (pose.p.y - 0.1).abs();
            assert!(pose.p.z - flank > 0.005, "{} m at {degrees}°", pose.p.z - flank);
        }
        let flat = stance.over(&place, &Vector3::x(), &Vector3::z(), 0.0);
        assert!((flat.p - Vector3::new(0.425, 0.1, 0.2)).abs().max() < 1e-6);
    }
}
