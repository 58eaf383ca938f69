//! The servo of all axes: joint reference and measured actuator angles in, drive commands out.
//!
//! Timing. What is computed from the sample at k acts on the next SYNC, during [k+1, k+2): exactly one cycle from sample to
//! actuation. So the error is taken between reference and measurement at k, and the feed-forward is the reference motion
//! of the interval in which it will act.
//!
//! - Velocity mode (CSV): velocity = reference velocity + PI-D of the position, and the model's torque as torque offset; the
//!   drive closes its speed loop itself.
//! - Torque mode (CST), the thesis's arrangement: torque = the model's + PI-D of the position.

use super::{
    drive::DriveScale,
    feedforward::Dynamics,
    pid::{Gains, Pid, Sample},
};
use crate::arm::{Arm, Turns};
use hal::stage::{Stage, Stopwatch};
use hal::{wire_enum, wire_struct};

/// Which loop the drive closes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum DriveMode {
    /// CiA 402 cyclic synchronous velocity, 9.
    #[default]
    Velocity,
    /// CiA 402 cyclic synchronous torque, 10.
    Torque,
}

wire_enum!(DriveMode { Velocity, Torque });

/// Parameters of the servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo<const N: usize> {
    /// Which loop the drives close.
    pub mode: DriveMode,
    /// Sample time, s.
    pub period: f32,
    /// Position gains: rad/s per rad in velocity mode, N·m per rad in torque mode.
    pub gains: [Gains; N],
    /// The drives.
    pub drives: [DriveScale; N],
    /// What the controller believes of the dynamics.
    pub dynamics: Dynamics<N>,
    /// Feed the reference's motion forward; off, the gains do all the work.
    pub feedforward: bool,
}

wire_struct!(Servo<const N: usize> {
    mode: DriveMode, period: f32, gains: [Gains; N], drives: [DriveScale; N], dynamics: Dynamics<N>, feedforward: bool,
});

/// Reference of one cycle, joint-side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference<const N: usize> {
    /// Angles at this sample k, rad.
    pub position: [f32; N],
    /// Mean velocities of the interval in which the command acts, (position(k+2) − position(k+1))/period, rad/s.
    pub velocity: [f32; N],
    /// Mean accelerations of that interval, rad/s².
    pub acceleration: [f32; N],
}

impl<const N: usize> Reference<N> {
    /// To stand still at `position` (rad).
    pub fn still(position: [f32; N]) -> Self {
        Self {
            position,
            velocity: [0.0; N],
            acceleration: [0.0; N],
        }
    }
}

/// Command to one drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriveCommand {
    /// Target velocity 0x60FF, counts/s; zero in torque mode.
    pub velocity: i32,
    /// Target torque 0x6071 or torque offset 0x60B2, per mille of rated.
    pub torque: i16,
}

wire_struct!(DriveCommand {
    velocity: i32,
    torque: i16
});

/// State of the servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoState<const N: usize> {
    axes: [Pid; N],
}

wire_struct!(ServoState<const N: usize> { axes: [Pid; N] });

impl<const N: usize> ServoState<N> {
    /// Leaves the derivative out of the next step: the sample before lies more than a period back. `reference` and `measured` are the actuator
    /// angles (rad) of that step.
    pub fn forget_rates(&mut self, reference: &[f32; N], measured: &[f32; N]) {
        for (axis, (reference, measured)) in self.axes.iter_mut().zip(reference.iter().zip(measured)) {
            axis.forget_rates(*reference, *measured);
        }
    }
}

impl<const N: usize> Servo<N> {
    /// State for arming at actuator angles `measured` (rad), standing still: the first command is the feed-forward of rest, and
    /// nothing else.
    pub fn preset(&self, measured: &[f32; N]) -> ServoState<N> {
        ServoState {
            axes: core::array::from_fn(|i| Pid::preset(&self.gains[i], measured[i], measured[i], 0.0)),
        }
    }

    /// One cycle: `measured` are the actuator angles (rad) of sample k; `turns` are those of the joint references of k+1, with which the
    /// interval begins. Its middle would be right; but 2.5 ms at 1 rad/s change gravity's torque by a quarter of a per cent of itself, a
    /// fortieth of what the model is trusted to, and the job has these sines and cosines already.
    #[inline(never)] // on its own it has all registers
    pub fn step(
        &self,
        arm: &Arm<N>,
        state: &mut ServoState<N>,
        reference: &Reference<N>,
        turns: &Turns<N>,
        measured: &[f32; N],
        watch: &mut impl Stopwatch,
    ) -> [DriveCommand; N] {
        let Reference {
            position,
            velocity,
            acceleration,
        } = reference;
        let mut torques = if self.feedforward {
            self.dynamics.of_links(arm, turns, velocity, acceleration)
        } else {
            [0.0; N]
        };
        watch.lap(Stage::FeedForward);
        watch.result(Stage::FeedForward, &mut torques);
        let mut commands = [DriveCommand::default(); N];
        let drives = self.gains.iter().zip(&self.drives).zip(&mut state.axes);
        let actuators = arm.coupling.rows().zip(self.dynamics.actuators().zip(&torques));
        let joints = position.iter().zip(velocity.iter().zip(acceleration)).zip(measured);
        // Of the joint before: angle, velocity, acceleration.
        let mut before = (0.0, 0.0, 0.0);
        for (
            (command, ((gains, drive), pid)),
            (((own, carry), (actuator, links)), ((position, (dq, ddq)), measured)),
        ) in commands.iter_mut().zip(drives).zip(actuators.zip(joints))
        {
            let speed = own * dq + carry * before.1;
            let acceleration = own * ddq + carry * before.2;
            let sample = Sample {
                reference: own * position + carry * before.0,
                measured: *measured,
                feedforward: 0.0,
                follow: self.feedforward,
            };
            before = (*position, *dq, *ddq);
            let (speed, torque) = if self.feedforward {
                (speed, links + actuator.torque(speed, acceleration))
            } else {
                (0.0, 0.0)
            };
            *command = match self.mode {
                DriveMode::Velocity => {
                    let sample = Sample {
                        feedforward: speed,
                        ..sample
                    };
                    DriveCommand {
                        velocity: drive.velocity(pid.step(gains, &sample, drive.max_speed, self.period)),
                        torque: drive.per_mille(torque),
                    }
                }
                DriveMode::Torque => {
                    let sample = Sample {
                        feedforward: torque,
                        ..sample
                    };
                    DriveCommand {
                        velocity: 0,
                        torque: drive.per_mille(pid.step(gains, &sample, drive.peak_torque, self.period)),
                    }
                }
            };
        }
        watch.lap(Stage::Servo);
        watch.result(Stage::Servo, &mut commands);
        commands
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::sample::k3s;
    use crate::servo::inertia::{Body, LinkInertia};

    const PERIOD: f32 = 0.005;

    fn servo(mode: DriveMode, feedforward: bool) -> Servo<6> {
        let link = LinkInertia::new(2.0, [0.05, 0.0, 0.0], [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]);
        let gains = match mode {
            DriveMode::Velocity => Gains {
                proportional: 40.0,
                integral: 0.0,
                derivative: 0.0,
            },
            DriveMode::Torque => Gains::pole_placement(4.0, 20.0, 0.9, 2.0),
        };
        Servo {
            mode,
            period: PERIOD,
            gains: [gains; 6],
            drives: [DriveScale {
                counts_per_rad: 156_454.9,
                zero: 0,
                rated_torque: 114.6,
                peak_torque: 343.2,
                max_speed: 3.9,
            }; 6],
            dynamics: Dynamics {
                bodies: Body::of_links(&k3s(), &[link; 6]),
                rotor: [2.0; 6],
                viscous: [1.0; 6],
                coulomb: [5.0; 6],
            },
            feedforward,
        }
    }

    const HOME: [f32; 6] = [0.0, -1.6, -0.1, 0.0, -1.5, 0.0];

    /// Follows a ramp of 0.5 rad/s on joint 0 with ideal speed loops that act a cycle late; greatest error after 0.2 s, rad.
    fn ramp_error(feedforward: bool) -> f32 {
        let (arm, servo) = (k3s(), servo(DriveMode::Velocity, feedforward));
        let mut measured = arm.coupling.to_actuators(&HOME);
        let mut state = servo.preset(&measured);
        let (mut acting, mut worst) = ([0.0; 6], 0.0_f32);
        let speed = |k: i32| if k >= 2 { 0.5 } else { 0.0 };
        let mut reference = Reference::still(HOME);
        for k in 0..200 {
            reference.velocity[0] = speed(k + 1);
            let commands = servo.step(&arm, &mut state, &reference, &Turns::of(&HOME), &measured, &mut ());
            if k > 40 {
                worst = worst.max((reference.position[0] - measured[0]).abs());
            }
            for i in 0..6 {
                measured[i] += acting[i] * PERIOD;
                acting[i] = servo.drives[i].speed(commands[i].velocity);
            }
            reference.position[0] += speed(k) * PERIOD;
        }
        worst
    }

    #[test]
    fn velocity_feedforward_in_the_right_interval_leaves_no_lag() {
        let (with, without) = (ramp_error(true), ramp_error(false));
        assert!(with < 5e-6, "{with} rad");
        assert!((without - 0.5 / 40.0).abs() < 1e-4, "v/K_P without: {without} rad");
    }

    #[test]
    fn arming_commands_no_motion_and_carries_gravity() {
        let arm = k3s();
        let measured = arm.coupling.to_actuators(&HOME);
        for mode in [DriveMode::Velocity, DriveMode::Torque] {
            let servo = servo(mode, true);
            let mut state = servo.preset(&measured);
            let commands = servo.step(
                &arm,
                &mut state,
                &Reference::still(HOME),
                &Turns::of(&HOME),
                &measured,
                &mut (),
            );
            let gravity = servo.dynamics.torques(&arm, &Turns::of(&HOME), &[0.0; 6], &[0.0; 6]);
            for (i, command) in commands.iter().enumerate() {
                assert_eq!(command.velocity, 0);
                let wanted = servo.drives[i].per_mille(gravity[i]);
                assert!(
                    (command.torque - wanted).abs() <= 1,
                    "axis {i}: {} for {wanted} ‰",
                    command.torque
                );
            }
        }
    }

    #[test]
    fn the_models_torque_at_the_beginning_of_an_interval_is_within_three_per_mille_of_its_middles() {
        let (arm, servo) = (k3s(), servo(DriveMode::Velocity, true));
        let measured = arm.coupling.to_actuators(&HOME);
        let velocity = [0.0, 3.0, 0.0, 0.0, 3.0, 0.0];
        let reference = Reference {
            velocity,
            ..Reference::still(HOME)
        };
        let at = |time: f32| core::array::from_fn(|i| HOME[i] + time * velocity[i]);
        let commands = servo.step(
            &arm,
            &mut servo.preset(&measured),
            &reference,
            &Turns::of(&at(PERIOD)),
            &measured,
            &mut (),
        );
        let torque_at = |time: f32| {
            servo.drives[1].per_mille(
                servo
                    .dynamics
                    .torques(&arm, &Turns::of(&at(time)), &velocity, &[0.0; 6])[1],
            )
        };
        assert_eq!(commands[1].torque, torque_at(PERIOD));
        let away = commands[1].torque - torque_at(1.5 * PERIOD);
        assert!(
            away != 0 && away.abs() <= 3,
            "{away} ‰ of rated torque at 3 rad/s, or this test could not tell"
        );
    }

    #[test]
    fn a_command_is_cut_at_the_drives_greatest_speed() {
        let (arm, servo) = (k3s(), servo(DriveMode::Velocity, true));
        let measured = arm.coupling.to_actuators(&HOME);
        let mut state = servo.preset(&measured);
        let mut reference = Reference::still(HOME);
        reference.position[3] += 1.0;
        let commands = servo.step(&arm, &mut state, &reference, &Turns::of(&HOME), &measured, &mut ());
        assert_eq!(commands[3].velocity, servo.drives[3].velocity(3.9));
    }
}
