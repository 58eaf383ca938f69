//! Point-to-point motion of a job: planned, run at its own pace, braked without leaving its way, and taken up again.

use super::seal::{AXES, PERIOD};
use crate::servo::profile::{JointMotion, MotionLimits};

/// Time in which a point-to-point motion is braked, s.
const BRAKING: f32 = 0.25;

/// The motion under way, if any.
#[derive(Clone, Debug)]
pub struct Transit {
    /// Joint angles (rad) to go to, until the motion there is planned.
    goal: Option<[f32; AXES]>,
    /// The motion, and how far into it the clock is, s.
    motion: Option<(JointMotion<AXES>, f32)>,
    /// The motion has come to its end, and nobody was told yet.
    at_end: bool,
    /// Share of its own pace at which the motion runs: 1, and down to 0 in braking.
    pace: f32,
}

impl Transit {
    /// None under way.
    pub const IDLE: Self = Self {
        goal: None,
        motion: None,
        at_end: false,
        pace: 1.0,
    };

    /// Begins a motion from rest to rest at `goal` (rad).
    pub fn start(&mut self, goal: &[f32; AXES]) {
        self.goal = Some(*goal);
        self.motion = None;
        self.at_end = false;
    }

    /// One cycle on, from `reference`: the next joints, rad, and whether they are those of an end reached the cycle before. `advance` false brakes.
    ///
    /// The first step plans, at rest: whoever called [`Self::start`] has used that cycle up with an inverse, which takes as long as all
    /// else that a cycle does. For the same reason an arrival is told when nothing else is left to do.
    pub fn step(
        &mut self,
        reference: &[f32; AXES],
        limits: &[MotionLimits; AXES],
        advance: bool,
    ) -> ([f32; AXES], bool) {
        if core::mem::take(&mut self.at_end) {
            return (*reference, true);
        }
        if let Some(goal) = self.goal.take() {
            self.motion = Some((JointMotion::plan(reference, &goal, limits), 0.0));
            return (*reference, false);
        }
        let change = PERIOD / BRAKING;
        self.pace = if advance {
            (self.pace + change).min(1.0)
        } else {
            (self.pace - change).max(0.0)
        };
        let Some((motion, clock)) = self.motion.as_mut() else {
            return (*reference, false);
        };
        *clock += PERIOD * self.pace;
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
        self.pace <= 0.0
    }
}
