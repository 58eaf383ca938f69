//! Point-to-point motion of a job: planned, run at its own pace, braked without leaving its way, and taken up again.

use super::seal::{AXES, PERIOD};
use crate::servo::profile::{JointMotion, MotionLimits};

/// Time in which a point-to-point motion is braked, s.
const BRAKING: f32 = 0.25;

/// The motion under way, if any.
#[derive(Clone, Debug)]
pub struct Transit {
    /// The motion, and how far into it the clock is, s.
    motion: Option<(JointMotion<AXES>, f32)>,
    /// Share of its own pace at which the motion runs: 1, and down to 0 in braking.
    pace: f32,
}

impl Transit {
    /// None under way.
    pub const IDLE: Self = Self {
        motion: None,
        pace: 1.0,
    };

    /// Plans a motion from rest to rest, joints in rad.
    pub fn start(&mut self, from: &[f32; AXES], to: &[f32; AXES], limits: &[MotionLimits; AXES]) {
        self.motion = Some((JointMotion::plan(from, to, limits), 0.0));
    }

    /// One cycle on, from `reference`: the next joints, rad, and whether the motion has arrived with them. `advance` false brakes.
    pub fn step(&mut self, reference: &[f32; AXES], advance: bool) -> ([f32; AXES], bool) {
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
        let arrived = *clock >= motion.duration();
        if arrived {
            self.motion = None;
        }
        (joints, arrived)
    }

    /// There is somewhere to go yet.
    pub fn is_under_way(&self) -> bool {
        self.motion.is_some()
    }

    /// Braked to a stop.
    pub fn is_still(&self) -> bool {
        self.pace <= 0.0
    }
}
