//! The plant's constants, its actuator coordinates, and how they are disturbed.

use super::{AXES, chain::Chain};
use nalgebra::{SMatrix, SVector};
use rand::{Rng, RngExt};

/// Friction of one axis, at the actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Dry friction, N·m.
    pub coulomb: f64,
    /// Viscous friction, N·m/(rad/s).
    pub viscous: f64,
}

/// Everything that decides how the arm moves. Gears are taken as loss-free: their losses are in the friction.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantModel<const N: usize = AXES> {
    /// Links and tool.
    pub chain: Chain<N>,
    /// The actuator that turns the absolute angle q_{elbow−1} − q_{elbow} of a parallel link.
    pub elbow: Option<usize>,
    /// Turns of the motor per turn of the actuator.
    pub gear: [f64; N],
    /// Rotor inertia at the actuator, kg·m².
    pub rotor: [f64; N],
    /// Friction at the actuator.
    pub friction: [Friction; N],
    /// Holding torque of the brake at the actuator, N·m.
    pub brake: [f64; N],
    /// Torque that the motor really gives per torque that its drive believes it gives.
    pub torque_constant: [f64; N],
}

impl<const N: usize> PlantModel<N> {
    /// Joint angles (or velocities, accelerations) to the actuators'.
    pub fn to_actuators(&self, joints: &[f64; N]) -> SVector<f64, N> {
        let mut actuators = *joints;
        if let Some(elbow) = self.elbow {
            actuators[elbow] = joints[elbow - 1] - joints[elbow];
        }
        actuators.into()
    }

    /// Actuator angles (or velocities, accelerations) to the joints'.
    pub fn to_joints(&self, actuators: &[f64; N]) -> [f64; N] {
        self.to_actuators(actuators).into() // its own inverse
    }

    /// Mass matrix in actuator coordinates with the rotors, kg·m², at joint angles `q` (rad).
    pub fn mass_matrix(&self, q: &[f64; N]) -> SMatrix<f64, N, N> {
        let (mass, _) = self.dynamics(&self.to_actuators(q).into(), &[0.0; N]);
        SMatrix::from(mass)
    }

    /// Torques of Coriolis forces and gravity at the actuators, N·m, at joint angles `q` (rad) and velocities `dq` (rad/s).
    pub fn bias(&self, q: &[f64; N], dq: &[f64; N]) -> SVector<f64, N> {
        let (_, bias) = self.dynamics(&self.to_actuators(q).into(), &self.to_actuators(dq).into());
        bias.into()
    }

    /// Mass matrix with rotors (kg·m²) and Coriolis and gravity torques (N·m) at actuator angles and velocities.
    pub(super) fn dynamics(&self, position: &[f64; N], velocity: &[f64; N]) -> ([[f64; N]; N], [f64; N]) {
        let (mut mass, mut bias) = self
            .chain
            .dynamics(&self.to_joints(position), &self.to_joints(velocity));
        if let Some(elbow) = self.elbow {
            // Mᵀ·(…) with q_{elbow} = a_{elbow−1} − a_{elbow}; for the matrix from both sides.
            bias[elbow - 1] += bias[elbow];
            bias[elbow] = -bias[elbow];
            let row = mass[elbow];
            for (before, entry) in mass[elbow - 1].iter_mut().zip(row) {
                *before += entry;
            }
            mass[elbow] = row.map(|entry| -entry);
            for row in &mut mass {
                row[elbow - 1] += row[elbow];
                row[elbow] = -row[elbow];
            }
        }
        for (i, row) in mass.iter_mut().enumerate() {
            row[i] += self.rotor[i];
        }
        (mass, bias)
    }

    /// The same arm as a controller with a wrong model meets it: every mass, inertia, friction and torque constant multiplied
    /// by a factor of its own, even in 1 ± `fraction`. 0.1 is the project's "servo model 10 % wrong".
    pub fn disturbed(&self, fraction: f64, rng: &mut impl Rng) -> Self {
        let mut factor = || 1.0 + fraction * rng.random_range(-1.0..=1.0);
        let mut model = self.clone();
        for i in 0..N {
            model.chain.scale(i, factor(), factor());
            model.rotor[i] *= factor();
            model.friction[i].coulomb *= factor();
            model.friction[i].viscous *= factor();
            model.torque_constant[i] *= factor();
        }
        model
    }
}
