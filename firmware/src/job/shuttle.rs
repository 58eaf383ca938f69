//! A second arm's job: from wherever it stands to a posture, and from there its tip along a straight line to another aim and back, again and
//! again, until it is called off.
//!
//! It asks for what a job of a five-axis arm asks for in every cycle: a place on a line, kinematics, the inverse by a Newton step, and limits
//! of joints and speeds. Like every job it is two cycles ahead, and brakes along its way.

use super::aim::Aim;
use super::transit::{Pace, Transit};
use super::wish::{Wish, step_toward_aim};
use crate::arm::{Arm, Turns};
use crate::geometry::rotation::length;
use crate::servo::profile::{MotionLimits, Profile};
use hal::stage::{Stage, Stopwatch};
use hal::wire_struct;

/// What it is told before it starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShuttleParams<const N: usize> {
    /// Joint angles at the line's beginning, rad.
    posture: [f32; N],
    /// The line's ends.
    ends: [Aim; 2],
    /// The motion from one to the other, m.
    motion: Profile,
    /// Limits of the motion to the posture, per joint.
    joint: [MotionLimits; N],
    /// Highest speed that the line may ask of a joint, rad/s.
    joint_speed: [f32; N],
}

wire_struct!(ShuttleParams<const N: usize> {
    posture: [f32; N], ends: [Aim; 2], motion: Profile, joint: [MotionLimits; N], joint_speed: [f32; N],
});

impl<const N: usize> ShuttleParams<N> {
    /// From where the tip is at joint angles `posture` (rad) to the aim `far`, the tip within `tip` (m), the joints within `joint` (rad) on their way to
    /// the posture, and within `joint_speed` (rad/s) always.
    pub fn new(
        arm: &Arm<N>,
        posture: [f32; N],
        far: Aim,
        tip: &MotionLimits,
        joint: [MotionLimits; N],
        joint_speed: [f32; N],
    ) -> Self {
        let near = Aim::of(&arm.forward(&posture));
        Self {
            posture,
            ends: [near, far],
            motion: Profile::plan(length(&(far.point - near.point)), tip),
            joint,
            joint_speed,
        }
    }

    /// The aim at `time` (s) into the motion, out or back.
    fn aim(&self, time: f32, back: bool) -> Aim {
        let [near, far] = &self.ends;
        let way = self.motion.evaluate(time).position / self.motion.distance();
        near.toward(far, if back { 1.0 - way } else { way })
    }
}

/// Where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Not begun.
    Idle,
    /// To the posture.
    Approach,
    /// Along the line.
    Line,
}

/// The job's memory.
#[derive(Clone, Debug)]
pub struct Shuttle<const N: usize> {
    phase: Phase,
    transit: Transit<N>,
    /// How far into the motion along the line, s, whether it is the way back, and at what pace.
    clock: f32,
    back: bool,
    pace: Pace,
}

impl<const N: usize> Shuttle<N> {
    /// Not begun.
    pub const IDLE: Self = Self {
        phase: Phase::Idle,
        transit: Transit::IDLE,
        clock: 0.0,
        back: false,
        pace: Pace::NONE,
    };

    /// One cycle on: `reference` (rad) is last cycle's wish, to which `turns` go on. `advance` false brakes, along the way.
    pub fn advance(
        &mut self,
        params: &ShuttleParams<N>,
        arm: &Arm<N>,
        reference: &[f32; N],
        turns: &mut Turns<N>,
        advance: bool,
        watch: &mut impl Stopwatch,
    ) -> Wish<N> {
        turns.go(reference);
        watch.lap(Stage::Kinematics);
        watch.result(Stage::Kinematics, turns);
        let joints = match self.phase {
            Phase::Idle => {
                if advance {
                    self.transit.start(&params.posture);
                    self.phase = Phase::Approach;
                }
                *reference
            }
            Phase::Approach => {
                let (joints, arrived) = self.transit.step(reference, &params.joint, advance);
                if arrived {
                    self.phase = Phase::Line;
                }
                joints
            }
            Phase::Line => {
                self.clock += self.pace.go(advance);
                if self.clock >= params.motion.duration() {
                    self.clock = 0.0;
                    self.back = !self.back;
                }
                let mut aim = params.aim(self.clock, self.back);
                watch.lap(Stage::Hold);
                watch.result(Stage::Hold, &mut aim);
                step_toward_aim(arm, reference, turns, &aim, watch)
            }
        };
        let still = match self.phase {
            Phase::Idle => true,
            Phase::Approach => self.transit.is_still(),
            Phase::Line => self.pace.is_still(),
        };
        let wish = Wish::of(Ok(joints), None, still, reference, arm, &params.joint_speed);
        watch.lap(Stage::Hold);
        wish
    }
}
