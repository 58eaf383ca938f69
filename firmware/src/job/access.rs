//! How the arm comes to a seam and leaves it: up from where it stands, over the seam's start, down to it; and up from its end.

use super::phase::Phase;
use super::seal::AXES;
use super::transit::Transit;
use crate::arm::{Arm, K3sInverse};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::servo::profile::MotionLimits;
use hal::wire_struct;

/// Furthest that a joint turns from one place of a search to the next, rad: 160°. A wrist that turns over goes by half a turn, and one that is
/// at its end by a whole one.
const TURN: f32 = 2.8;

/// What a job is told about its ways from point to point, and of the arm's limits.
#[derive(Clone, Debug, PartialEq)]
pub struct AccessParams {
    /// Height over the seam's ends at which the arm comes and goes, m.
    pub clearance: f32,
    /// Limits of the point-to-point motions, per joint.
    pub joint: [MotionLimits; AXES],
    /// Highest speed that a job may ask of a joint, rad/s.
    pub joint_speed: [f32; AXES],
    /// Closed-form inverse of the arm, for the ends of the point-to-point motions.
    pub inverse: K3sInverse,
}

wire_struct!(AccessParams {
    clearance: f32,
    joint: [MotionLimits; AXES],
    joint_speed: [f32; AXES],
    inverse: K3sInverse,
});

/// The way that the arm is on, and the phase of the job that it belongs to.
#[derive(Clone, Debug)]
pub struct Access {
    /// Where the job stands.
    pub phase: Phase,
    transit: Transit<AXES>,
}

impl Access {
    /// Not begun.
    pub const IDLE: Self = Self {
        phase: Phase::Idle,
        transit: Transit::IDLE,
    };

    /// There is somewhere to go yet.
    pub fn is_under_way(&self) -> bool {
        self.transit.is_under_way()
    }

    /// Braked to a stop.
    pub fn is_still(&self) -> bool {
        self.transit.is_still()
    }

    /// Sets out for `goal`, T_b_n, by the joint angles nearest to `near` (rad).
    #[inline(never)] // it is large, wanted in many places, and in no hurry
    pub fn go(&mut self, params: &AccessParams, near: &[f32; AXES], goal: &Pose) -> Result<(), Fault> {
        let to = params.inverse.nearest(goal, near).map_err(|_| Fault::Unreachable)?;
        self.transit.start(&to);
        Ok(())
    }

    /// The same with the wrist unwound: where a path begins, which is then kept to.
    pub fn begin(&mut self, params: &AccessParams, reference: &[f32; AXES], goal: &Pose) -> Result<(), Fault> {
        self.go(params, &params.inverse.unwound(reference), goal)
    }

    /// The same where the tool is turned from place to place: refused if a joint would have to go round the other way.
    pub fn turn(&mut self, params: &AccessParams, reference: &[f32; AXES], goal: &Pose) -> Result<(), Fault> {
        let to = params.inverse.nearest(goal, reference).map_err(|_| Fault::CannotTurn)?;
        if to.iter().zip(reference).any(|(to, from)| (to - from).abs() > TURN) {
            return Err(Fault::CannotTurn);
        }
        self.transit.start(&to);
        Ok(())
    }

    /// Sets out for where it is: the next arrival is in a moment.
    pub fn stay(&mut self, reference: &[f32; AXES]) {
        self.transit.start(reference);
    }

    /// Sets out straight up along the nozzle, by `height` (m).
    #[inline(never)]
    pub fn up(
        &mut self,
        params: &AccessParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        height: f32,
    ) -> Result<(), Fault> {
        self.go(params, reference, &arm.forward(reference).raised(height))
    }

    /// First of all up, clear of whatever the nozzle was stopped over; where there is no room for that, straight to over `start`, the run-in's
    /// beginning (T_b_n).
    #[inline(never)]
    pub fn rise(
        &mut self,
        params: &AccessParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        start: &Pose,
    ) -> Result<(), Fault> {
        self.phase = Phase::Rise;
        self.up(params, arm, reference, params.clearance)
            .or_else(|_| self.arrived(params, reference, start))
    }

    /// One cycle on; true at an arrival. `advance` false brakes.
    pub fn step(&mut self, params: &AccessParams, reference: &[f32; AXES], advance: bool) -> ([f32; AXES], bool) {
        self.transit.step(reference, &params.joint, advance)
    }

    /// The way that follows on an arrival at `reference`; `start` as in [`Self::rise`].
    #[inline(never)]
    pub fn arrived(&mut self, params: &AccessParams, reference: &[f32; AXES], start: &Pose) -> Result<(), Fault> {
        self.phase = match self.phase {
            Phase::Rise => Phase::Approach,
            Phase::Approach => Phase::Descend,
            Phase::Descend => Phase::Follow,
            _ => Phase::Done,
        };
        match self.phase {
            Phase::Approach => self.begin(params, reference, &start.raised(params.clearance)),
            Phase::Descend => self.go(params, reference, start),
            _ => Ok(()),
        }
    }
}
