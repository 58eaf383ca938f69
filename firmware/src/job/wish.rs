//! What a job wants of the next cycle: a step of the joints toward where the tip is to be, within what they can do.

use super::aim::Aim;
use super::seal::PERIOD;
use crate::arm::{Arm, Jacobian, JointRange, Turns, free_about, solve_damped};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::geometry::rotation::{cross, log, product};
use crate::servo::limits::check_ranges;
use hal::stage::{Stage, Stopwatch};
use nalgebra::Vector3;

/// Damping λ of the Jacobian inverse: against singular values of 0.2 and more in the work area it bends a step by less than 0.1 %,
/// and what it leaves of one step is made up by the next.
const DAMPING: f32 = 5e-3;

/// What a job wants of the next cycle.
#[derive(Clone, Copy, Debug)]
pub struct Wish<const N: usize> {
    /// Joint reference two cycles ahead, rad.
    pub joints: [f32; N],
    /// The arm's reference is at rest, and the job is done or was braked.
    pub at_rest: bool,
    /// A fault that the job found, and the axis to blame.
    pub fault: Option<(Fault, u8)>,
}

impl<const N: usize> Wish<N> {
    /// What a job wants that came from `reference` (rad) to `result`, and `found` a fault itself; beyond a joint's range, or faster than
    /// `speed` (rad/s), is one too.
    pub fn of(
        result: Result<[f32; N], Fault>,
        found: Option<Fault>,
        at_rest: bool,
        reference: &[f32; N],
        arm: &Arm<N>,
        speed: &[f32; N],
    ) -> Self {
        let (joints, failed) = match result {
            Ok(joints) => (joints, None),
            Err(fault) => (*reference, Some(fault)),
        };
        let fault = failed.or(found).map(|fault| (fault, 0));
        let fault = fault.or_else(|| astray(reference, &joints, arm, speed));
        Self { joints, at_rest, fault }
    }
}

/// The axis that would leave its range, else that which would have to turn faster than its limit.
fn astray<const N: usize>(from: &[f32; N], to: &[f32; N], arm: &Arm<N>, limits: &[f32; N]) -> Option<(Fault, u8)> {
    // Comparisons are false for what is no number.
    let keeps = |((a, b), limit): ((&f32, &f32), &f32)| (b - a).abs() <= limit * PERIOD;
    let stays = |(b, range): (&f32, &JointRange)| *b >= range.min && *b <= range.max;
    let steps = from.iter().zip(to).zip(limits);
    // Which it is, is asked only if there is one.
    if steps
        .clone()
        .zip(&arm.ranges)
        .all(|(step, range)| keeps(step) && stays((step.0.1, range)))
    {
        return None;
    }
    match check_ranges(to, &arm.ranges, 0.0) {
        Err(beyond) => Some((Fault::JointLimit, beyond.joint)),
        Ok(()) => (0..)
            .zip(steps)
            .find(|(_, step)| !keeps(*step))
            .map(|(axis, _)| (Fault::SpeedLimit, axis)),
    }
}

/// One Newton step of the joints toward a tip pose. Steps are 1.5 mm and 0.15 rad at most, so one leaves micrometres, and the next, which
/// starts from where this one really came, makes them up.
pub fn step_toward<const N: usize>(
    arm: &Arm<N>,
    joints: &[f32; N],
    turns: &Turns<N>,
    goal: &Pose,
    watch: &mut impl Stopwatch,
) -> [f32; N] {
    let mut jacobian = Jacobian::zeros();
    let tip = kinematics(arm, turns, &mut jacobian, watch);
    let shift = goal.p - tip.p;
    let turn = log(&product(&goal.r, &tip.r.transpose()));
    newton(joints, &jacobian, &shift, &turn, watch)
}

/// The same toward an aim: the tip is left free to turn about itself, which is all that five axes can do.
pub fn step_toward_aim<const N: usize>(
    arm: &Arm<N>,
    joints: &[f32; N],
    turns: &Turns<N>,
    aim: &Aim,
    watch: &mut impl Stopwatch,
) -> [f32; N] {
    let mut jacobian = Jacobian::zeros();
    let tip = kinematics(arm, turns, &mut jacobian, watch);
    let here = Aim::of(&tip);
    free_about(&mut jacobian, &here.direction);
    // Across both directions, and as long as the sine between them: up to a sixth of a radian the angle within half a per cent.
    let turn = cross(&here.direction, &aim.direction);
    newton(joints, &jacobian, &(aim.point - here.point), &turn, watch)
}

/// The tip's pose T_b_n at `turns`, and its Jacobian.
#[inline(always)] // for the same reason as [`newton`]
fn kinematics<const N: usize>(
    arm: &Arm<N>,
    turns: &Turns<N>,
    jacobian: &mut Jacobian<N>,
    watch: &mut impl Stopwatch,
) -> Pose {
    let mut tip = arm.tip_and_jacobian(turns, jacobian);
    watch.lap(Stage::Kinematics);
    watch.result(Stage::Kinematics, &mut tip);
    watch.result(Stage::Kinematics, &mut jacobian.data.0);
    tip
}

/// From `joints` on, by the tip's `shift` (m) and `turn` (rad).
#[inline(always)] // the Jacobian is not to go through memory once more
fn newton<const N: usize>(
    joints: &[f32; N],
    jacobian: &Jacobian<N>,
    shift: &Vector3<f32>,
    turn: &Vector3<f32>,
    watch: &mut impl Stopwatch,
) -> [f32; N] {
    let twist = [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
    let mut next = *joints;
    next.iter_mut()
        .zip(solve_damped(jacobian, &twist, DAMPING))
        .for_each(|(joint, step)| *joint += step);
    watch.lap(Stage::Solve);
    watch.result(Stage::Solve, &mut next);
    next
}
