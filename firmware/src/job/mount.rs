//! The sensor on the nozzle: where its frame Σ_S is, and how the planes of its slits stand in it.

use crate::geometry::Pose;
use crate::vision::camera::line_direction;
use hal::camera::SLITS;
use hal::process::{Look, Sighting};
use hal::wire_struct;
use nalgebra::Vector3;

/// Geometry of the sensor on the nozzle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorMount {
    /// Pose of the sensor in the nozzle frame: T_n_s.
    pub pose: Pose,
    /// Height of the camera's centre over Σ_S, m.
    pub camera_height: f32,
    /// Of the slit of the start view: tangent of its plane's angle φ, and its lean along y. The plane is x = c − z·tan φ − y·lean in Σ_S.
    pub slit_slopes: [f32; 2],
    /// The same of each slit of the seam sensor.
    pub seam_slopes: [[f32; 2]; SLITS],
}

wire_struct!(SensorMount {
    pose: Pose,
    camera_height: f32,
    slit_slopes: [f32; 2],
    seam_slopes: [[f32; 2]; SLITS]
});

impl SensorMount {
    /// Tangent and lean of the slit by whose light `sighting` was seen.
    pub fn slopes(&self, sighting: &Sighting) -> [f32; 2] {
        let [near, ahead] = self.seam_slopes;
        match (sighting.look, sighting.slit) {
            (Look::StartGrey | Look::StartSlit, _) => self.slit_slopes,
            (Look::Seam | Look::Dark, 0) => near,
            (Look::Seam | Look::Dark, _) => ahead,
        }
    }

    /// Direction in Σ_S, not normalised, of the lit line on the sheet at `seen` (m), where `sighting` saw it, from its inclination in the image.
    pub fn slit_direction(&self, seen: Vector3<f32>, sighting: &Sighting) -> Vector3<f32> {
        let angle = sighting.angle();
        // Small angles: a few degrees of θ_x and of heading against the seam; the cubic term is 0.4 % of tan at 0.25 rad.
        let slope = angle * (1.0 + angle * angle * (1.0 / 3.0));
        line_direction(&seen, slope, self.camera_height, self.slopes(sighting))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::Matrix3;

    /// The sensor as drawn.
    pub const MOUNT: SensorMount = SensorMount {
        pose: Pose {
            r: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
            p: Vector3::new(0.080, 0.0, 0.0),
        },
        camera_height: 0.150,
        slit_slopes: [1.0, 0.0],
        seam_slopes: [[1.0, 0.0]; SLITS],
    };

    #[test]
    fn a_lit_line_lies_in_the_plane_of_the_slit_that_it_was_seen_by() {
        let leaning = SensorMount {
            slit_slopes: [0.9, -0.02],
            seam_slopes: [[1.05, 0.01], [0.97, 0.03]],
            ..MOUNT
        };
        for (look, slit, [tan, lean]) in [
            (Look::StartSlit, 0, [0.9, -0.02]),
            (Look::Seam, 0, [1.05, 0.01]),
            (Look::Seam, 1, [0.97, 0.03]),
        ] {
            let sighting = Sighting {
                look,
                slit,
                angle_e4: 800,
                ..Sighting::default()
            };
            let (y, z) = (0.004, -0.003);
            let direction = leaning.slit_direction(Vector3::new(-z * tan - y * lean, y, z), &sighting);
            let out = direction.dot(&Vector3::new(1.0, lean, tan));
            assert!(out.abs() < 1e-6 && direction.y > 0.9, "{look:?} {slit}: {direction}");
        }
    }
}
