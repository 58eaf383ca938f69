//! Seeded parts before the start sensor, displaced from where they were taught.

use crate::cell::panel::{Joint, Panel, Surface};
use crate::cell::path::SeamPath;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

/// Stream of random numbers for start scenes.
const STREAM: u128 = 0x7374_6172_7400;
/// The stretch of seam whose direction is the part's at its start, m: what the start view shows.
pub const REGION_M: f64 = 0.040;

/// How parts are misplaced and bent.
#[derive(Clone, Copy, Debug)]
pub struct Misplacement {
    /// Largest shift per axis, m.
    pub shift: f64,
    /// Largest turn about each axis through the seam's start, rad.
    pub turn: f64,
    /// Peak of the deformation, m.
    pub deform: f64,
}

/// A part and its true start.
pub struct StartScene {
    /// The part.
    pub panel: Panel,
    /// Where the taught start frame lies: x along the seam, z out of the sheet; the base frame for all that is measured here.
    pub taught: Isometry3<f64>,
    /// The true start frame: origin in the seam's end corner; x along the straight line that fits the seam's first 40 mm best; z square to it, with
    /// the roll that fits the seam's own sheet best over the 24 mm beside them.
    pub start: Isometry3<f64>,
    /// The rigid part of it: where the undeformed part's start frame lies.
    pub rigid: Isometry3<f64>,
}

impl StartScene {
    /// Part number `index` of `seed`.
    pub fn draw(surface: Surface, joint: Joint, misplaced: &Misplacement, seed: u64, index: u64) -> Self {
        let mut rng = Pcg64::new(u128::from(seed), (STREAM << 64) | u128::from(index));
        // Somewhere in the cell, the part tilted 20° about y_B as in chapter 4.
        let taught = Isometry3::from_parts(
            Translation3::new(0.55, 0.25, 0.1),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.35)
                * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -1.57),
        );
        let mut triple = |limit: f64| Vector3::from_fn(|_, _| limit * (2.0 * rng.random::<f64>() - 1.0));
        let (shift, turn) = (triple(misplaced.shift), triple(misplaced.turn));
        let rigid = taught
            * Isometry3::from_parts(
                Translation3::from(shift),
                UnitQuaternion::from_euler_angles(turn.x, turn.y, turn.z),
            );
        let path = SeamPath::straight();
        let panel = Panel::new(path, joint, surface, misplaced.deform, rigid, &mut rng).ending_at_start();
        let start = true_start(&panel);
        Self {
            panel,
            taught,
            start,
            rigid,
        }
    }
}

/// The start frame of the part as it really is.
pub fn true_start(panel: &Panel) -> Isometry3<f64> {
    const STEPS: usize = 20;
    let corner = panel.seam(0.0);
    // x: the straight line that fits the seam best; z: square to it, with the roll that fits the sheet on the seam's own side best.
    let side = match panel.joint() {
        Joint::Crank { upper, .. } => -upper.sign(),
        Joint::Lip { sheet, .. } => sheet.sign(),
        Joint::Vee { .. } => 0.0,
    };
    let place = |along: usize, across: usize| {
        let share = across as f64 / STEPS as f64;
        let share = if side == 0.0 { 2.0 * share - 1.0 } else { side * share };
        panel.base_sheet(REGION_M * along as f64 / STEPS as f64, 0.6 * REGION_M * share)
    };
    let seam: Vec<_> = (0..=STEPS)
        .map(|along| panel.seam(REGION_M * along as f64 / STEPS as f64).p)
        .collect();
    let x = main_direction(&seam, &corner.t);
    let flat = |v: Vector3<f64>| v - x * v.dot(&x);
    let across: Vec<_> = (0..=STEPS)
        .flat_map(|along| {
            let line: Vec<_> = (0..=STEPS).map(|across| flat(place(along, across))).collect();
            let mean = line.iter().sum::<Vector3<f64>>() / line.len() as f64;
            line.into_iter().map(move |point| point - mean)
        })
        .collect();
    let y = main_direction(&across, &corner.b);
    let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    Isometry3::from_parts(
        Translation3::from(corner.p),
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)),
    )
}

/// Direction in which points spread most, on `toward`'s side.
fn main_direction(points: &[Vector3<f64>], toward: &Vector3<f64>) -> Vector3<f64> {
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let scatter: Matrix3<f64> = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let direction = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    if direction.dot(toward) < 0.0 {
        -direction
    } else {
        direction
    }
}
