//! The plane between the flanks of a bend, from a slit that crosses the valley at a slant.
//!
//! Of a bend the sensor reports the mean of both flanks' slopes in the light's plane. Square to the valley that is the slope of the plane between
//! the flanks. At a slant it is not: in the light's plane x = −z·tan φ, along a valley (c, s) in Σ_S, flanks that rise by f to either side
//! show as z = f·c·y/(1 − a) and −f·c·y/(1 + a) with a = f·s·tan φ, and the mean of these slopes is f·c·a/(1 − a²): 1° on R150, where the sensor,
//! a lead of 80 mm ahead, looks across the seam 15° askew.

use nalgebra::Vector3;

/// Direction in the plane between the flanks, from the reported one, `line`, both in Σ_S and of any length; the valley runs `along` (Σ_S), its
/// flanks rise by `flank` (tangent), and the light's plane leans by `slit_tangent` = tan φ.
pub fn between_flanks(line: &Vector3<f32>, along: &Vector3<f32>, flank: f32, slit_tangent: f32) -> Vector3<f32> {
    let askew = flank * along.y * slit_tangent;
    // Steeper than any flank, nothing is lit on the far one.
    let mean = flank * along.x * askew / (1.0 - askew * askew).max(0.1);
    let rise = mean * line.y;
    line - Vector3::new(-rise * slit_tangent, 0.0, rise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::{rot_x, unit};
    use crate::geometry::trig::sin_cos;

    /// Slope of a lit flank in the light's plane: of the plane with this normal, where z = slope·y.
    fn slope(normal: &Vector3<f32>, slit_tangent: f32) -> f32 {
        // n·(−z·tan φ, y, z) = 0.
        -normal.y / (normal.z - normal.x * slit_tangent)
    }

    #[test]
    fn a_valley_of_150_degrees_is_level_however_the_slit_crosses_it() {
        const FLANK: f32 = 0.268;
        for heading in [-0.27f32, -0.1, 0.0, 0.15, 0.27] {
            for roll in [-0.05f32, 0.0, 0.05] {
                let (sin, cos) = sin_cos(heading);
                let along = Vector3::new(cos, sin, 0.0);
                let left = rot_x(roll) * Vector3::new(-sin, cos, 0.0);
                let up = rot_x(roll) * Vector3::z();
                let along = rot_x(roll) * along;
                let flanks = [left * -FLANK + up, left * FLANK + up];
                let mean = 0.5 * flanks.iter().map(|normal| slope(normal, 1.0)).sum::<f32>();
                let line = between_flanks(&Vector3::new(-mean, 1.0, mean), &along, FLANK, 1.0);
                let normal = unit(&along.cross(&line)).unwrap();
                let off = normal.dot(&left).to_degrees();
                assert!(off.abs() < 0.25, "{off}° at heading {heading}, roll {roll}");
            }
        }
    }
}
