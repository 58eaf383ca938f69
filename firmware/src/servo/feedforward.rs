//! Torque that the reference motion needs, at the actuators: rigid arm, rotors seen through the gears, friction.

use super::dynamics::inverse_dynamics;
use super::inertia::Body;
use super::limits::within;
use crate::arm::{Arm, Turns};
use hal::wire_struct;

/// What the controller believes of the arm's dynamics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics<const N: usize> {
    /// The links, base first.
    pub bodies: [Body; N],
    /// Rotor inertia times the square of the gear ratio, kg·m² at the actuator.
    pub rotor: [f32; N],
    /// Viscous friction at the actuator, N·m/(rad/s).
    pub viscous: [f32; N],
    /// Coulomb friction at the actuator, N·m.
    pub coulomb: [f32; N],
}

wire_struct!(Dynamics<const N: usize> { bodies: [Body; N], rotor: [f32; N], viscous: [f32; N], coulomb: [f32; N] });

/// Speed at which Coulomb friction has reached its full value, rad/s at the actuator. Assumed: small against working speeds
/// (0.1–0.6 rad/s), large against a reference's ripple, so that a reference at rest asks for no chatter.
pub const COULOMB_SPEED: f32 = 0.02;

impl<const N: usize> Dynamics<N> {
    /// Actuator torques (N·m) for the joint angles of `turns`, velocities `dq` (rad/s) and accelerations `ddq` (rad/s²).
    pub fn torques(&self, arm: &Arm<N>, turns: &Turns<N>, dq: &[f32; N], ddq: &[f32; N]) -> [f32; N] {
        let mut torques = self.of_links(arm, turns, dq, ddq);
        let motion = arm
            .coupling
            .to_actuators(dq)
            .into_iter()
            .zip(arm.coupling.to_actuators(ddq));
        for ((torque, own), (speed, acceleration)) in torques.iter_mut().zip(self.actuators()).zip(motion) {
            *torque += own.torque(speed, acceleration);
        }
        torques
    }

    /// What of these torques the links ask for: all but rotors and friction.
    pub fn of_links(&self, arm: &Arm<N>, turns: &Turns<N>, dq: &[f32; N], ddq: &[f32; N]) -> [f32; N] {
        arm.coupling
            .torques_to_actuators(&inverse_dynamics(arm, &self.bodies, turns, dq, ddq))
    }

    /// What the actuators ask for by themselves.
    pub fn actuators(&self) -> impl Iterator<Item = Actuator> + '_ {
        let friction = self.viscous.iter().zip(&self.coulomb);
        self.rotor
            .iter()
            .zip(friction)
            .map(|(rotor, (viscous, coulomb))| Actuator {
                rotor: *rotor,
                viscous: *viscous,
                coulomb: *coulomb,
            })
    }
}

/// Rotor and friction of one actuator, as in [`Dynamics`].
#[derive(Clone, Copy, Debug)]
pub struct Actuator {
    rotor: f32,
    viscous: f32,
    coulomb: f32,
}

impl Actuator {
    /// Torque (N·m) that it takes at this speed (rad/s) and acceleration (rad/s²).
    #[inline(always)]
    pub fn torque(&self, speed: f32, acceleration: f32) -> f32 {
        self.rotor * acceleration + self.viscous * speed + self.coulomb * smooth_sign(speed)
    }
}

/// The sign of `speed` (rad/s), by a cubic without a kink from −[`COULOMB_SPEED`] to +[`COULOMB_SPEED`].
fn smooth_sign(speed: f32) -> f32 {
    let x = within(speed * (1.0 / COULOMB_SPEED), 1.0);
    x * (1.5 - 0.5 * x * x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::sample::k3s;
    use crate::servo::inertia::LinkInertia;

    fn dynamics() -> Dynamics<6> {
        let link = LinkInertia::new(4.0, [0.1, 0.0, 0.0], [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]);
        Dynamics {
            bodies: Body::of_links(&k3s(), &[link; 6]),
            rotor: [2.0; 6],
            viscous: [3.0; 6],
            coulomb: [5.0; 6],
        }
    }

    #[test]
    fn at_rest_only_gravity_remains_and_it_reaches_the_forearms_motor_by_the_coupling() {
        let (arm, model) = (k3s(), dynamics());
        let q = [0.0, -1.4, 0.2, 0.0, -1.5, 0.0];
        let joint = inverse_dynamics(&arm, &model.bodies, &Turns::of(&q), &[0.0; 6], &[0.0; 6]);
        let torques = model.torques(&arm, &Turns::of(&q), &[0.0; 6], &[0.0; 6]);
        assert!(
            (torques[1] - (joint[1] + joint[2])).abs() < 1e-4,
            "the upper arm's motor carries what both joints ask"
        );
        assert!((torques[2] + joint[2]).abs() < 1e-4);
    }

    #[test]
    fn rotor_and_friction_act_on_the_actuators_own_motion() {
        let (arm, model) = (k3s(), dynamics());
        let bare = Dynamics {
            rotor: [0.0; 6],
            viscous: [0.0; 6],
            coulomb: [0.0; 6],
            ..model
        };
        let q = [0.0, -1.4, 0.2, 0.0, -1.5, 0.0];
        // θ1 and θ2 move alike: the forearm's motor, at θ12, stands still.
        let (dq, ddq) = ([0.0, 0.5, 0.5, 0.0, 0.0, 0.0], [0.0, 2.0, 2.0, 0.0, 0.0, 0.0]);
        let (with, without) = (
            model.torques(&arm, &Turns::of(&q), &dq, &ddq),
            bare.torques(&arm, &Turns::of(&q), &dq, &ddq),
        );
        assert!((with[2] - without[2]).abs() < 1e-4);
        let added = with[1] - without[1];
        assert!((added - (2.0 * 2.0 + 3.0 * 0.5 + 5.0)).abs() < 0.01, "{added} N·m");
    }

    #[test]
    fn coulomb_friction_has_no_step_at_rest() {
        assert_eq!(smooth_sign(0.0), 0.0);
        assert!((smooth_sign(1e-4) - 0.0075).abs() < 1e-5);
        assert_eq!((smooth_sign(-0.3), smooth_sign(COULOMB_SPEED)), (-1.0, 1.0));
    }
}
