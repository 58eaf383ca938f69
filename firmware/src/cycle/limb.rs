//! One arm in the cycle, whatever its job: where it is, where it is to be, and the servo between.

use crate::arm::{Arm, Turns};
use crate::job::seal::PERIOD;
use crate::servo::axes::{DriveCommand, Reference, Servo, ServoState};
use hal::process::AxisInput;
use hal::stage::{Stage, Stopwatch};
use hal::wire::Wire;

/// Furthest that an axis may be from its reference, rad: twice what the wrist lags at 2.5 rad/s without feed-forward.
const ASTRAY: f32 = 0.2;

/// The memory of one arm.
#[derive(Clone, Debug)]
pub struct Limb<const N: usize> {
    /// Angles at this SYNC, rad: the actuators', and the joints'.
    actuators: [f32; N],
    joints: [f32; N],
    servo: ServoState<N>,
    /// Joint references of this cycle, the next, and the one after, rad.
    reference: [[f32; N]; 3],
    /// Sines and cosines of the joint angles that are in hand.
    pub turns: Turns<N>,
}

impl<const N: usize> Limb<N> {
    /// Of no arm yet.
    pub const EMPTY: Self = Self {
        actuators: [0.0; N],
        joints: [0.0; N],
        servo: ServoState::EMPTY,
        reference: [[0.0; N]; 3],
        turns: Turns::ZERO,
    };

    /// Takes in what the drives latched.
    #[inline(always)]
    pub fn measure(&mut self, arm: &Arm<N>, servo: &Servo<N>, axes: &[AxisInput; N], watch: &mut impl Stopwatch) {
        for ((angle, drive), axis) in self.actuators.iter_mut().zip(&servo.drives).zip(axes) {
            *angle = drive.angle(axis.position);
        }
        watch.result(Stage::Estimate, &mut self.actuators);
        self.joints = arm.coupling.to_joints(&self.actuators);
        watch.result(Stage::Estimate, &mut self.joints);
    }

    /// Bumpless: the reference is where the arm stands, integrators are empty.
    pub fn stand(&mut self, servo: &Servo<N>) {
        self.reference = [self.joints; 3];
        self.servo = servo.preset(&self.actuators);
    }

    /// Joint angles at this SYNC, rad.
    pub fn joints(&self) -> &[f32; N] {
        &self.joints
    }

    /// Joint reference of this cycle, rad.
    pub fn reference(&self) -> &[f32; N] {
        &self.reference[0]
    }

    /// The newest reference, two cycles ahead, rad: from where a job goes on.
    pub fn newest(&self) -> [f32; N] {
        self.reference[2]
    }

    /// The reference goes on by a cycle, to `joints` (rad).
    pub fn lead(&mut self, joints: &[f32; N]) {
        let [_, next, last] = self.reference;
        self.reference = [next, last, *joints];
    }

    /// Computes the drives' commands, and names the axis that is too far from its reference, if one is. `late`: the last sample is of unknown age.
    #[inline(always)]
    pub fn follow(
        &mut self,
        arm: &Arm<N>,
        servo: &Servo<N>,
        late: bool,
        watch: &mut impl Stopwatch,
    ) -> ([DriveCommand; N], Option<u8>) {
        if late {
            let [now, ..] = &self.reference;
            let now = arm.coupling.to_actuators(now);
            self.servo.forget_rates(&now, &self.actuators);
        }
        let commands = servo.step(
            arm,
            &mut self.servo,
            &reference(&self.reference),
            &self.turns,
            &self.actuators,
            watch,
        );
        let follows = |(now, measured): (&f32, &f32)| (now - measured).abs() <= ASTRAY; // false for what is no number
        let mut pairs = self.reference[0].iter().zip(&self.joints);
        let astray = pairs.position(|pair| !follows(pair));
        (commands, astray.map(|axis| axis as u8))
    }
}

/// What the servo is to follow: the position of this sample, and the mean velocity and acceleration of the interval in which the
/// command acts, from the references of this cycle, the next and the one after.
fn reference<const N: usize>(points: &[[f32; N]; 3]) -> Reference<N> {
    let [now, next, last] = points;
    let mut reference = Reference::still(*now);
    for (((velocity, acceleration), now), (next, last)) in reference
        .velocity
        .iter_mut()
        .zip(&mut reference.acceleration)
        .zip(now)
        .zip(next.iter().zip(last))
    {
        *velocity = (last - next) * (1.0 / PERIOD);
        *acceleration = (last - 2.0 * next + now) * (1.0 / (PERIOD * PERIOD));
    }
    reference
}
