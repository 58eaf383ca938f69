//! Where a part lay when its seam was taught: the emulated cell's jig must know how far it has moved since, to say where it starts now.
//!
//! The rigid motion that takes the part's drawing to the taught seam, by least squares over points and normals (Arun, Huang, Blostein 1987; the
//! normals settle the turn about a straight seam). It also tells a seam that was taught on another part.

use super::scenario::{PathName, name_of};
use crate::taught::TaughtSeam;
use anyhow::{Context, Result, ensure};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Length of the normals that count as points, m: about half a view.
const NORMAL: f64 = 0.020;
/// Fits, each with the places that the one before says.
const ROUNDS: usize = 5;
/// Furthest of a taught point from the drawing, m: twice the largest deformation that a part may have.
const REACH: f64 = 0.010;

/// Where a seam was taught.
#[derive(Clone, Copy, Debug)]
pub struct Registration {
    /// Displacement of the part from its nominal place, Σ_B.
    pub displacement: Isometry3<f64>,
    /// Where along the drawing's seam the taught one begins and ends, m.
    pub ends: [f64; 2],
}

/// Finds the part with seam `path` on which `seam` was taught.
pub fn register(seam: &TaughtSeam, path: PathName) -> Result<Registration> {
    let (drawing, placing) = (path.seam(), path.placing());
    let mut displacement = Isometry3::identity();
    let along = |displacement: &Isometry3<f64>, point: Vector3<f64>| {
        let back = (displacement * placing).inverse_transform_point(&Point3::from(point));
        drawing.project(back.x, back.y).0
    };
    let mut off = 0.0;
    for round in 0..ROUNDS {
        let mut pairs = Vec::new();
        off = 0.0f64;
        for row in seam.rows() {
            let s = if round == 0 {
                row.s
            } else {
                along(&displacement, row.point)
            };
            let frame = drawing.at(s);
            let (point, normal) = ((placing * Point3::from(frame.p)).coords, placing * frame.n);
            off = off.max((displacement * Point3::from(point) - Point3::from(row.point)).norm());
            pairs.push((point, row.point));
            pairs.push((point + normal * NORMAL, row.point + row.normal * NORMAL));
        }
        displacement = fit(&pairs).context("taught seam: its points determine no place")?;
    }
    ensure!(
        off <= REACH,
        "taught seam: {:.1} mm off the {} path at its best fit, allowed {}: it was taught on another",
        off * 1e3,
        name_of(&path),
        REACH * 1e3
    );
    Ok(Registration {
        displacement,
        ends: [0.0, seam.length()].map(|s| along(&displacement, seam.at(s).point)),
    })
}

/// The rigid motion that takes the first of each pair to the second.
fn fit(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Isometry3<f64>> {
    let count = pairs.len() as f64;
    let (from, to) = pairs
        .iter()
        .fold((Vector3::zeros(), Vector3::zeros()), |(from, to), (a, b)| {
            (from + a, to + b)
        });
    let (from, to) = (from / count, to / count);
    let spread: Matrix3<f64> = pairs.iter().map(|(a, b)| (b - to) * (a - from).transpose()).sum();
    let svd = spread.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let hand = (u * v_t).determinant().signum();
    let turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, hand)) * v_t;
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    Some(Isometry3::from_parts(Translation3::from(to - turn * from), turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taught::TaughtRow;

    fn taught(path: PathName, displacement: &Isometry3<f64>) -> TaughtSeam {
        let (drawing, placing) = (path.seam(), path.placing());
        let rows = (0..=200)
            .map(|k| {
                let s = 0.002 * f64::from(k);
                let frame = drawing.at(s);
                TaughtRow {
                    s,
                    point: (displacement * placing * Point3::from(frame.p)).coords,
                    normal: displacement * (placing * frame.n),
                }
            })
            .collect();
        TaughtSeam::new(rows, 0.4).unwrap()
    }

    #[test]
    fn a_taught_seam_tells_where_its_part_lay() {
        let moved = Isometry3::from_parts(
            Translation3::new(0.008, -0.009, 0.004),
            UnitQuaternion::from_euler_angles(0.03, -0.05, 0.04),
        );
        for path in [PathName::Straight, PathName::Panel] {
            let Registration {
                displacement: found,
                ends,
            } = register(&taught(path, &moved), path).unwrap();
            assert!(ends[0].abs() < 1e-6 && (ends[1] - 0.4).abs() < 1e-6, "{ends:?} m");
            let point = path.placing() * Point3::new(0.2, 0.0, 0.0);
            assert!((found * point - moved * point).norm() < 1e-6, "{path:?}: {found}");
            assert!(found.rotation.angle_to(&moved.rotation) < 1e-6, "{path:?}: {found}");
        }
    }

    #[test]
    fn a_seam_of_another_path_is_refused() {
        let arc = taught(PathName::Arc, &Isometry3::identity());
        let error = register(&arc, PathName::Straight).unwrap_err().to_string();
        assert!(error.contains("off the straight path"), "{error}");
    }
}
