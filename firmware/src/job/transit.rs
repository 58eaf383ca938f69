//! Point-to-point motion of a job: planned, run at its own pace, braked without leaving its way, and taken up again.

use super::seal::PERIOD;
use crate::servo::profile::{JointMotion, MotionLimits};

/// Time in which a point-to-point motion is braked, s.
const BRAKING: f32 = 0.25;

/// The motion under way, if any.
#[derive(Clone, Debug)]
pub struct Transit<const N: usize> {
    /// Joint angles (rad) to go to, until the motion there is planned.
    goal: Option<[f32; N]>,
    /// The motion, and how far into it the clock is, s.
    motion: Option<(JointMotion<N>, f32)>,
    /// The motion has come to its end, and nobody was told yet.
    at_end: bool,
    pace: Pace,
}

/// Share of its own pace at which a motion runs: 1, and down to 0 in braking.
#[derive(Clone, Copy, Debug)]
pub struct Pace(f32);

impl Pace {
    /// Not braked.
    pub const FULL: Self = Self(1.0);
    /// Braked to a stop.
    pub const NONE: Self = Self(0.0);

    /// One cycle on; the motion's own time that passes in it, s. `advance` false brakes.
    pub fn go(&mut self, advance: bool) -> f32 {
        let change = PERIOD / BRAKING;
        self.0 = if advance {
            (self.0 + change).min(1.0)
        } else {
            (self.0 - change).max(0.0)
        };
        PERIOD * self.0
    }

    /// Braked to a stop.
    pub fn is_still(&self) -> bool {
        self.0 <= 0.0
    }
}

impl<const N: usize> Transit<N> {
    /// None under way.
    pub const IDLE: Self = Self {
        goal: None,
        motion: None,
        at_end: false,
        pace: Pace::FULL,
    };

    /// Begins a motion from rest to rest at `goal` (rad).
    pub fn start(&mut self, goal: &[f32; N]) {
        self.goal = Some(*goal);
        self.motion = None;
        self.at_end = false;
    }

    /// One cycle on, from `reference`: the next joints, rad, and whether they are those of an end reached the cycle before. `advance` false brakes.
    ///
    /// The first step plans, at rest: whoever called [`Self::start`] has used that cycle up with an inverse, which takes as long as all
    /// else that a cycle does. For the same reason an arrival is told when nothing else is left to do.
    pub fn step(&mut self, reference: &[f32; N], limits: &[MotionLimits; N], advance: bool) -> ([f32; N], bool) {
        if core::mem::take(&mut self.at_end) {
            return (*reference, true);
        }
        if let Some(goal) = self.goal.take() {
            self.motion = Some((JointMotion::plan(reference, &goal, limits), 0.0));
            return (*reference, false);
        }
        let time = self.pace.go(advance);
        let Some((motion, clock)) = self.motion.as_mut() else {
            return (*reference, false);
        };
        *clock += time;
        let joints = motion.evaluate(*clock).position;
        if *clock >= motion.duration() {
            self.motion = None;
            self.at_end = true;
        }
        (joints, false)
    }

    /// There is somewhere to go yet.
    pub fn is_under_way(&self) -> bool {
        self.goal.is_some() || self.motion.is_some() || self.at_end
    }

    /// Braked to a stop.
    pub fn is_still(&self) -> bool {
        self.pace.is_still()
    }
}
