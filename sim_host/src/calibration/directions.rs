//! One seam measured in both directions of travel.
//!
//! With the sensor leading along +x and, turned by half a turn, along −x, an error of its place on the arm shows with
//! opposite signs: the two lines that it measures lie twice the error apart. A straight edge is enough, and nothing
//! about it needs to be known; errors along the seam do not show.

use anyhow::{Context, Result, ensure};
use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};

use super::Pixel;
use super::camera::Camera;
use super::slit_plane::SlitPlane;

/// Sightings that each direction needs: two make a line.
pub const MIN_SIGHTINGS: usize = 3;

/// The seam seen at one pose of the arm.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    /// Pose of Σ_5 in Σ_B, as the arm says.
    pub t_b_5: Isometry3<f64>,
    /// Where the slit's line shows the seam, px.
    pub pixel: Pixel,
}

/// The sensor as calibrated.
#[derive(Clone, Copy, Debug)]
pub struct Sensor {
    /// Its camera.
    pub camera: Camera,
    /// Pose of the camera in Σ_5.
    pub t_5_c: Isometry3<f64>,
    /// Its slit in Σ_C.
    pub slit: SlitPlane,
}

impl Sensor {
    /// Point of the seam in Σ_B, m.
    pub fn measure(&self, sighting: &Sighting) -> Option<Point3<f64>> {
        let on_slit = self.slit.point(&self.camera, &sighting.pixel)?;
        Some(sighting.t_b_5 * self.t_5_c * on_slit)
    }
}

/// How the two directions agree about a straight seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Distance of the seam measured travelling −x from the line measured travelling +x, root mean square, m.
    pub offset_m: f64,
    /// The largest, m.
    pub offset_max_m: f64,
}

/// Compares a straight seam seen travelling +x and −x.
pub fn compare(sensor: &Sensor, forward: &[Sighting], backward: &[Sighting]) -> Result<Agreement> {
    let measure = |name: &str, sightings: &[Sighting]| -> Result<Vec<Point3<f64>>> {
        ensure!(
            sightings.len() >= MIN_SIGHTINGS,
            "{name} sightings {}: must be at least {MIN_SIGHTINGS}",
            sightings.len()
        );
        let points: Option<Vec<_>> = sightings.iter().map(|sighting| sensor.measure(sighting)).collect();
        points.with_context(|| format!("{name} sightings: one is not on the slit's plane"))
    };
    let (forward, backward) = (measure("forward", forward)?, measure("backward", backward)?);
    let (centre, direction) = line(&forward);
    let offsets: Vec<f64> = backward
        .iter()
        .map(|point| (point - centre).cross(&direction).norm())
        .collect();
    Ok(Agreement {
        offset_m: (offsets.iter().map(|offset| offset * offset).sum::<f64>() / offsets.len() as f64).sqrt(),
        offset_max_m: offsets.into_iter().fold(0.0, f64::max),
    })
}

/// A point and the direction of the line nearest to the points.
fn line(points: &[Point3<f64>]) -> (Point3<f64>, Unit<Vector3<f64>>) {
    let centre = points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let spread = points.iter().fold(Matrix3::zeros(), |spread, point| {
        let off = point.coords - centre;
        spread + off * off.transpose()
    });
    let eigen = spread.symmetric_eigen();
    let direction: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    (centre.into(), Unit::new_normalize(direction))
}

#[cfg(test)]
mod tests {
    use super::super::simulated;
    use super::*;

    #[test]
    fn a_sensor_that_sits_a_quarter_of_a_millimetre_aside_shows_half_a_millimetre() {
        let (truth, measured) = simulated::cell(3, 10).expect("a cell");
        let [forward, backward] = &measured.passes;
        let [slit, ..] = truth.slits;
        let right = Sensor {
            camera: truth.camera,
            t_5_c: truth.t_5_c,
            slit,
        };
        let agreement = compare(&right, forward, backward).expect("compared");
        assert!(agreement.offset_m < 0.000_05, "{agreement:?}");
        let aside = Isometry3::translation(0.0, 0.000_25, 0.0);
        let wrong = Sensor {
            t_5_c: aside * truth.t_5_c,
            ..right
        };
        let agreement = compare(&wrong, forward, backward).expect("compared");
        assert!((agreement.offset_m - 0.000_5).abs() < 0.000_05, "{agreement:?}");
    }

    #[test]
    fn a_direction_with_too_few_sightings_is_refused() {
        let (truth, measured) = simulated::cell(3, 10).expect("a cell");
        let [forward, backward] = &measured.passes;
        let [slit, ..] = truth.slits;
        let sensor = Sensor {
            camera: truth.camera,
            t_5_c: truth.t_5_c,
            slit,
        };
        let error = compare(&sensor, forward, &backward[..2]).expect_err("refused");
        assert_eq!(error.to_string(), "backward sightings 2: must be at least 3");
    }
}
