//! Where the camera sits on the arm, roughly: Park and Martin's closed form on the relative motions of arm and camera.

use anyhow::{Context, Result, bail, ensure};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::Station;

/// Least turn about a second axis, root mean square over the motions, rad. Assumed: at 5° a turn known to 0.1 mrad leaves
/// 0.1° and 0.2 mm at 100 mm.
const MIN_SECOND_TURN_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Motions with a turn up to this go into the start, rad; nearer to half a turn its axis may point either way.
const MAX_TURN_RAD: f64 = 170.0 * std::f64::consts::PI / 180.0;

/// Pose of the camera in Σ_5 from every pair of stations, and the board's pose in the camera (`t_c_w`) at each: the turns of the arm are those
/// of the camera, turned.
pub fn place(stations: &[Station], t_c_w: &[Isometry3<f64>]) -> Result<Isometry3<f64>> {
    let motions: Vec<(Isometry3<f64>, Isometry3<f64>)> = (0..stations.len())
        .flat_map(|j| (0..j).map(move |i| (i, j)))
        .map(|(i, j)| {
            (
                stations[i].t_b_5.inv_mul(&stations[j].t_b_5),
                t_c_w[i] * t_c_w[j].inverse(),
            )
        })
        .filter(|(arm, _)| arm.rotation.angle() <= MAX_TURN_RAD)
        .collect();
    let turns = motions
        .iter()
        .map(|(arm, eye)| (arm.rotation.scaled_axis(), eye.rotation.scaled_axis()));
    let (mut spread, mut moments) = (Matrix3::zeros(), Matrix3::zeros());
    for (arm, eye) in turns {
        spread += arm * arm.transpose() / motions.len() as f64;
        moments += arm * eye.transpose();
    }
    let mut about: Vec<f64> = spread
        .symmetric_eigenvalues()
        .iter()
        .map(|value| value.max(0.0).sqrt())
        .collect();
    about.sort_by(f64::total_cmp);
    ensure!(
        about[1] >= MIN_SECOND_TURN_RAD,
        "robot turns about a second axis {:.1}°: must be at least {:.0}° (rms), or the camera's place is not determined",
        about[1].to_degrees(),
        MIN_SECOND_TURN_RAD.to_degrees()
    );
    let svd = moments.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        bail!("stations: no rotation fits them");
    };
    let proper = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant()));
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * proper * v_t));
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (arm, eye) in &motions {
        let row = arm.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        matrix += row.transpose() * row;
        right += row.transpose() * (rotation * eye.translation.vector - arm.translation.vector);
    }
    let shift = matrix
        .try_inverse()
        .context("robot turns: they do not determine the camera's place")?
        * right;
    Ok(Isometry3::from_parts(shift.into(), rotation))
}
