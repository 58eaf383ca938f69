//! The arm as it is: rigid bodies, rotors, friction and brakes, integrated in time. Truth: the controller never sees it.
//!
//! Actuator coordinates throughout: for the parallel link the third is the forearm's absolute pitch θ₁₂.

mod chain;
mod friction;
mod model;
mod symmetric;

pub use chain::{Chain, Link};
pub use model::{Friction, PlantModel};

use friction::project;
use nalgebra::{Isometry3, Vector3};
use symmetric::Factor;

/// Number of axes of the sealing arm.
const AXES: usize = 6;

/// The moving arm.
///
/// One [`Self::tick`] is a step of the drift–kick–drift scheme (position Verlet): half a step of motion, one evaluation of the
/// forces there with the velocity predicted for that moment, a full step of velocity, the other half of motion. Second order
/// with one evaluation; the forces that depend on velocity (Coriolis, viscous) are slow against 0.25 ms, and dry friction is
/// solved for, not integrated. Tests compare with RK4 at a finer step.
#[derive(Clone, Debug)]
pub struct Plant<const N: usize = AXES> {
    model: PlantModel<N>,
    position: [f64; N],
    velocity: [f64; N],
    acceleration: [f64; N],
    /// Dry friction's impulses of the last step, N·m·s: the next step's first guess.
    impulse: [f64; N],
    braked: [bool; N],
}

impl<const N: usize> Plant<N> {
    /// At rest at joint angles `q` (rad), brakes off.
    pub fn at_rest(model: PlantModel<N>, q: &[f64; N]) -> Self {
        let position = model.to_actuators(q).into();
        Self {
            model,
            position,
            velocity: [0.0; N],
            acceleration: [0.0; N],
            impulse: [0.0; N],
            braked: [false; N],
        }
    }

    /// Moves on by `dt` (s) under constant motor torques (N·m, before the gears). 0.25 ms is what it is tested at.
    #[expect(clippy::needless_range_loop, reason = "seven arrays side by side, by axis")]
    pub fn tick(&mut self, dt: f64, motor_torque: &[f64; N]) {
        let half = 0.5 * dt;
        let mut predicted = [0.0; N];
        for i in 0..N {
            self.position[i] += half * self.velocity[i];
            predicted[i] = self.velocity[i] + half * self.acceleration[i];
        }
        let model = &self.model;
        let (mass, bias) = model.dynamics(&self.position, &predicted);
        let inverse = Factor::of(&mass).inverse();
        let mut drive = [0.0; N];
        let mut reach = [0.0; N];
        for i in 0..N {
            let torque = motor_torque[i] * model.gear[i] * model.torque_constant[i];
            drive[i] = dt * (torque - bias[i] - model.friction[i].viscous * predicted[i]);
            reach[i] = dt * (model.friction[i].coulomb + if self.braked[i] { model.brake[i] } else { 0.0 });
        }
        let mut velocity = self.velocity;
        for i in 0..N {
            for k in 0..N {
                velocity[i] += inverse[i][k] * drive[k];
            }
        }
        project(&inverse, &reach, &mut self.impulse, &mut velocity);
        for i in 0..N {
            self.acceleration[i] = (velocity[i] - self.velocity[i]) / dt;
            self.velocity[i] = velocity[i];
            self.position[i] += half * velocity[i];
        }
    }

    /// Sets or releases the holding brake of an axis; a brake is dry friction and may be set while the axis moves.
    pub fn set_brake(&mut self, axis: usize, on: bool) {
        self.braked[axis] = on;
    }

    /// Actuator angles, rad.
    pub fn actuators(&self) -> [f64; N] {
        self.position
    }

    /// Actuator velocities, rad/s.
    pub fn actuator_velocities(&self) -> [f64; N] {
        self.velocity
    }

    /// Joint angles, rad.
    pub fn joints(&self) -> [f64; N] {
        self.model.to_joints(&self.position)
    }

    /// Joint velocities, rad/s.
    pub fn joint_velocities(&self) -> [f64; N] {
        self.model.to_joints(&self.velocity)
    }

    /// Mean joint accelerations of the last step, rad/s².
    pub fn joint_accelerations(&self) -> [f64; N] {
        self.model.to_joints(&self.acceleration)
    }

    /// Pose of the nozzle tip in Σ_B.
    #[expect(non_snake_case, reason = "the project's name for a pose: N in B")]
    pub fn T_b_n(&self) -> Isometry3<f64> {
        self.model.chain.tip(&self.joints())
    }

    /// Linear (m/s) and angular (rad/s) velocity of the nozzle tip in Σ_B.
    pub fn tip_velocity(&self) -> (Vector3<f64>, Vector3<f64>) {
        self.model.chain.tip_velocity(&self.joints(), &self.joint_velocities())
    }

    /// The arm's constants.
    pub fn model(&self) -> &PlantModel<N> {
        &self.model
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod tracking_tests;
