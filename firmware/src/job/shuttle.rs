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

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::arm::sample::five;
    use crate::geometry::rotation::cross;
    use crate::job::seal::PERIOD;
    use nalgebra::Vector3;
    use std::vec::Vec;

    const HOME: [f32; 5] = [0.0, -1.05, 1.57, 1.05, -1.57];

    fn params() -> ShuttleParams<5> {
        let arm = five();
        let home = arm.forward(&HOME);
        let far = Aim {
            point: home.p + Vector3::new(0.05, 0.25, 0.05),
            direction: Vector3::new(0.0, -0.389, 0.921),
        };
        let tip = MotionLimits {
            speed: 0.3,
            acceleration: 2.0,
            jerk: 20.0,
        };
        let joint = MotionLimits {
            speed: 1.0,
            acceleration: 6.0,
            jerk: 60.0,
        };
        ShuttleParams::new(&arm, HOME, far, &tip, [joint; 5], [3.0; 5])
    }

    /// Joint references of so many cycles from joint angles `from` (rad), `advance` told by the cycle; every fault fails the test.
    fn run(from: [f32; 5], cycles: usize, advance: impl Fn(usize) -> bool) -> Vec<([f32; 5], bool)> {
        let (arm, params) = (five(), params());
        let (mut job, mut turns, mut reference) = (Shuttle::IDLE, Turns::of(&from), from);
        (0..cycles)
            .map(|cycle| {
                let wish = job.advance(&params, &arm, &reference, &mut turns, advance(cycle), &mut ());
                assert_eq!(wish.fault, None, "cycle {cycle}");
                reference = wish.joints;
                (reference, wish.at_rest)
            })
            .collect()
    }

    #[test]
    fn the_tip_stays_on_the_line_and_points_along_the_chord_from_end_to_end_and_back() {
        let (arm, params) = (five(), params());
        let [near, far] = params.ends;
        let (mut ends, mut off, mut tilt) = ([0, 0], 0.0_f32, 0.0_f32);
        for (joints, _) in run(HOME, 2000, |_| true) {
            let tip = Aim::of(&arm.forward(&joints));
            let way = far.point - near.point;
            let share = (tip.point - near.point).dot(&way) / way.norm_squared();
            let wanted = near.toward(&far, share);
            off = off.max(length(&(tip.point - wanted.point)));
            tilt = tilt.max(length(&cross(&tip.direction, &wanted.direction)));
            for (end, at) in ends.iter_mut().zip([0.0, 1.0]) {
                *end += usize::from((share - at).abs() < 1e-4);
            }
        }
        assert!(off < 2e-5 && tilt < 2e-4, "{off} m, {tilt} rad");
        assert!(
            ends.iter().all(|cycles| *cycles > 10),
            "at rest at each end: {ends:?} cycles"
        );
    }

    #[test]
    fn it_goes_to_the_posture_first_and_brakes_on_its_way_wherever_it_is_called_off() {
        let aside = [-0.4, -1.25, 1.77, 1.15, -1.37];
        for called_off in [30, 60, 300, 500, 531] {
            let states = run(aside, called_off + 80, |cycle| cycle < called_off);
            let fastest = |at: usize| {
                let pairs = states[at].0.iter().zip(&states[at - 1].0);
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / PERIOD
            };
            let (at_rest, standing) = (states[called_off + 60].1, fastest(called_off + 60));
            assert!(
                at_rest && standing < 2e-3,
                "called off at {called_off}: {standing} rad/s"
            );
            let jump = (1..states.len()).map(fastest).fold(0.0, f32::max);
            assert!(jump < 2.0, "{jump} rad/s");
        }
    }
}
