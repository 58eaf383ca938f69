//! The sealing job: to the start of the path, along it with the bead on, and away (paper 003, chapter 6).
//!
//! Gives the joint reference one 5 ms cycle after another, two cycles ahead: outputs computed in cycle k act from SYNC k+1 to k+2.
//! Says what it wants; whether it may is [`crate::safety`]'s word, and what the motors do about it is [`crate::servo`]'s.

use crate::arm::{Arm, K3sInverse, Turns};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::geometry::rotation::{rot_x, rot_y};
use crate::geometry::trig::{sin_cos, sqrt};
use crate::job::correction::{Corrections, SensorMount, Use};
use crate::job::exposure::Exposures;
use crate::job::measure::{Measure, MeasureParams, Next};
use crate::job::past::{Moment, SYNC_OVERFLOW};
use crate::job::path::TaughtPath;
use crate::job::round::{Leg, Round, RoundParams};
use crate::job::start_pose::StartFrame;
use crate::job::transit::Transit;
use crate::job::wish::{Wish, step_toward};
use crate::servo::hold::{HoldKind, Knot};
use crate::servo::profile::MotionLimits;
use hal::process::{Look, Sighting};
use hal::stage::{Stage, Stopwatch};
use hal::wire::Wire;
use hal::{wire_enum, wire_struct};
use nalgebra::{Matrix3, Vector3};

/// The control period T, s (paper 003, chapter 4).
pub const PERIOD: f32 = 0.005;

/// Axes of the sealing robot.
pub const AXES: usize = 6;

/// Cycles to wait at the start for a first usable sighting: 2 s, twenty frames.
const FIRST_FRAME: u16 = 400;

/// Distance past the seam's end up to which the sensor looks, m: the nearer of two slits is 11 mm behind it.
const LAST_LOOK: f32 = 0.015;

/// Remaining path, m, at which a braked follower counts as arrived: √(2as) has no end of its own.
const ARRIVED: f32 = 2e-5;

/// Where the part lies, seen from the taught start (paper 003, chapter 5): the six numbers that a start sensor measures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StartPose {
    /// Shift of the seam's start in the taught nozzle frame at s = 0, m.
    pub shift: [f32; 3],
    /// θ_x, θ_y and θ_z as the start sensor measures them, rad: θ_z in its own image plane, not about the pitched axis.
    pub tilt: [f32; 3],
}

wire_struct!(StartPose {
    shift: [f32; 3],
    tilt: [f32; 3]
});

impl StartPose {
    /// The rigid motion, in Σ_B, from the part as taught to the part as it lies (6.1, 6.2, and 6.3 corrected: θ_z* = atan(tan θ_z · cos θ_y)).
    /// `t_b_n0` is the taught nozzle pose at s = 0.
    pub fn motion(&self, t_b_n0: &Pose) -> Pose {
        let [x, y, z] = self.tilt;
        let ((sin_z, cos_z), (_, cos_y)) = (sin_cos(z), sin_cos(y));
        // θ_z* has the tangent sin_z·cos_y / cos_z: its sine and cosine without an inverse function.
        let (side, ahead) = (sin_z * cos_y, cos_z);
        let scale = 1.0 / sqrt(side * side + ahead * ahead);
        let (s, c) = (side * scale, ahead * scale);
        let yaw = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        let measured = Pose {
            r: rot_x(x) * rot_y(y) * yaw,
            p: Vector3::from(self.shift),
        };
        *t_b_n0 * measured * t_b_n0.inverse()
    }
}

/// What a sealing job is told before it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct SealParams {
    /// The path to follow, with its allowed speeds.
    pub path: TaughtPath,
    /// Where the part lies, as told: exactly enough to seal it, or to begin the measurement at.
    pub start: StartPose,
    /// What is measured of it first.
    pub measure: MeasureParams,
    /// The sensor on the nozzle.
    pub mount: SensorMount,
    /// How the nozzle is led from one correction to the next.
    pub hold: HoldKind,
    /// Corrections are applied; false plays the taught path blind.
    pub preview: bool,
    /// Cycles from one burst of exposures to the next.
    pub vision_period: u8,
    /// Speed along the seam at which the dispenser's flow is nominal, m/s.
    pub speed: f32,
    /// Acceleration and braking along the path, m/s².
    pub acceleration: f32,
    /// How corners are looked round.
    pub round: RoundParams,
    /// Height over the path's ends at which the arm comes and goes, m.
    pub clearance: f32,
    /// Limits of the point-to-point motions, per joint.
    pub joint: [MotionLimits; AXES],
    /// Highest speed that the path may ask of a joint, rad/s.
    pub joint_speed: [f32; AXES],
    /// Closed-form inverse of the arm, for the ends of the point-to-point motions.
    pub inverse: K3sInverse,
}

wire_struct!(SealParams {
    path: TaughtPath,
    start: StartPose,
    measure: MeasureParams,
    mount: SensorMount,
    hold: HoldKind,
    preview: bool,
    vision_period: u8,
    speed: f32,
    acceleration: f32,
    round: RoundParams,
    clearance: f32,
    joint: [MotionLimits; AXES],
    joint_speed: [f32; AXES],
    inverse: K3sInverse,
});

/// Where the job stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// Not begun.
    #[default]
    Idle,
    /// Up, clear of where the arm stands.
    Rise,
    /// To where the part is measured, from place to place.
    Measure,
    /// Point to point to a place over the start of the run-in.
    Approach,
    /// Down to the start of the run-in.
    Descend,
    /// Along the path; the bead is on between 0 and the seam's length.
    Follow,
    /// Up from the end of the run-out.
    Lift,
    /// At rest over the end.
    Done,
    /// Stopped on the path before a corner, and about looking round it.
    Turn,
}

wire_enum!(Phase {
    Idle,
    Rise,
    Measure,
    Approach,
    Descend,
    Follow,
    Lift,
    Done,
    Turn
});

/// The job's memory.
#[derive(Clone, Debug)]
pub struct SealJob {
    phase: Phase,
    to_part: Pose,
    measure: Measure,
    corrections: Corrections,
    transit: Transit<AXES>,
    speed: f32,
    /// The last cap of the speed, squared (m²/s²) and itself (m/s): along most of a path it stays, and a root is dear.
    cap: (f32, f32),
    /// Reference stations of this cycle, the next and the one after.
    stations: [f32; 3],
    /// Where the nozzle halts next, m: at a corner, or at the end.
    halt: f32,
    round: Round,
    exposures: Exposures,
    /// Cycles spent waiting for the first sighting.
    waited: u16,
    /// Deviation applied at the newest reference.
    applied: [f32; 3],
}

impl SealJob {
    /// Of no path yet.
    pub const EMPTY: Self = Self {
        phase: Phase::Idle,
        to_part: Pose::EMPTY,
        measure: Measure::EMPTY,
        corrections: Corrections::EMPTY,
        transit: Transit::IDLE,
        speed: 0.0,
        cap: (0.0, 0.0),
        stations: [0.0; 3],
        halt: 0.0,
        round: Round::EMPTY,
        exposures: Exposures::new(),
        waited: 0,
        applied: [0.0; 3],
    };

    /// Becomes a job that is not begun, where it stands: it takes four kilobytes, which a microcontroller's stack is not to hold besides.
    pub fn reset(&mut self, params: &SealParams) {
        let first = params.path.first();
        let taught = params.path.place(0.0).nozzle(0.0, 0.0, 0.0);
        *self = Self::EMPTY;
        self.to_part = params.start.motion(&taught);
        self.stations = [first; 3];
        self.halt = params.path.halt(first);
        self.corrections
            .reset(params.hold, first, params.path.horizon(self.halt));
    }

    /// Where the job stands.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Reference station of this cycle, m.
    pub fn station(&self) -> f32 {
        if self.phase == Phase::Turn {
            self.round.station()
        } else {
            self.stations[0]
        }
    }

    /// The newest deviation that sightings showed.
    pub fn newest_correction(&self) -> Option<Knot> {
        self.corrections.newest_knot()
    }

    /// Deviation applied at the newest reference: lateral m, height m, roll rad.
    pub fn correction_now(&self) -> [f32; 3] {
        self.applied
    }

    /// Where the newest correction says that the seam is: its station, m, and the nozzle's pose there, T_b_n.
    pub fn seam_ahead(&self, path: &TaughtPath) -> Option<(f32, Pose)> {
        let knot = self.corrections.newest_knot()?;
        let [lateral, height, roll] = knot.value;
        let nozzle = path.place(knot.station).nozzle(lateral, height, roll);
        Some((knot.station, self.to_part * nozzle))
    }

    /// What the camera is to look at; [`Look::Dark`] if its frames do not matter now.
    pub fn look(&self) -> Look {
        match self.phase {
            Phase::Measure => self.measure.look(),
            Phase::Follow | Phase::Turn => Look::Seam,
            _ => Look::Dark,
        }
    }

    /// The start pose as last measured, if it was.
    pub fn start(&self) -> Option<&StartFrame> {
        self.measure.start()
    }

    /// Takes in a sighting with the moment of its exposure, and how many cycles ago that was.
    pub fn sight(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        sighting: &Sighting,
        exposed: Option<(&Moment<AXES>, u8)>,
    ) -> Use {
        let Some((moment, age)) = exposed.filter(|_| sighting.look == self.look()) else {
            return Use::Stale;
        };
        let t_b_n = || arm.forward(&moment.joints);
        if self.phase == Phase::Measure {
            return self.measure.take(
                &params.measure,
                &params.path,
                &params.mount,
                &mut self.to_part,
                sighting,
                &t_b_n(),
            );
        }
        if self.phase == Phase::Turn && sighting.slit != 0 {
            // The slit further on sees a corner aslant.
            return Use::OffPath;
        }
        let fate = self.corrections.take(
            sighting,
            &params.mount,
            &params.path,
            &self.to_part,
            t_b_n,
            moment.station,
        );
        self.exposures.sighted(sighting.slit, age, fate == Use::Used);
        fate
    }

    /// SYNC count of the next exposure to command, zero for none in this cycle.
    pub fn exposure(&mut self, params: &SealParams, sync: u8) -> u8 {
        if self.phase == Phase::Measure && !self.transit.is_under_way() {
            return self.measure.exposure(sync % SYNC_OVERFLOW + 1);
        }
        if self.phase == Phase::Turn {
            let count = self.exposures.command(self.round.is_due(), sync);
            if count != 0 {
                self.round.exposed();
            }
            return count;
        }
        let seen = self.stations[0] + params.mount.pose.p.x;
        if self.phase != Phase::Follow || seen > params.path.length() + LAST_LOOK {
            return 0;
        }
        // What lies behind the last burst before the seam's end nothing would show: there the camera takes what it can.
        let between_bursts = params.speed * PERIOD * f32::from(params.vision_period);
        if seen > params.path.length() - between_bursts {
            return self.exposures.command(true, sync);
        }
        self.exposures.next(params.vision_period, sync)
    }

    /// Dispenser flow for the coming cycle, per mille of nominal: in proportion to the speed, so that the bead's section stays the same.
    pub fn flow(&self, params: &SealParams) -> u16 {
        let next = self.stations[1];
        if self.phase == Phase::Follow && next >= 0.0 && next <= params.path.length() {
            (1000.0 * self.speed / params.speed) as u16
        } else {
            0
        }
    }

    /// One cycle on: `reference` is last cycle's wish, to which `turns` go on. `advance` false brakes, along the path.
    pub fn advance(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        turns: &mut Turns<AXES>,
        advance: bool,
        watch: &mut impl Stopwatch,
    ) -> Wish<AXES> {
        self.stations = [self.stations[1], self.stations[2], self.stations[2]];
        turns.go(reference);
        watch.lap(Stage::Kinematics);
        watch.result(Stage::Kinematics, turns);
        let blind = advance && self.is_blind(params);
        let advance = advance && !blind;
        let mut result = match self.phase {
            Phase::Idle if advance => self.rise(params, arm, reference),
            Phase::Idle | Phase::Done => Ok(*reference),
            Phase::Measure if !self.transit.is_under_way() && advance => self.measure_on(params, arm, reference),
            Phase::Follow | Phase::Turn if self.is_led() => {
                self.lead(params, arm, reference, advance).map(|goal| match goal {
                    Some(mut goal) => {
                        watch.lap(Stage::Hold);
                        watch.result(Stage::Hold, &mut goal);
                        step_toward(arm, reference, turns, &goal, watch)
                    }
                    None => *reference,
                })
            }
            _ => self.point_to_point(params, reference, advance),
        };
        let still = match self.phase {
            Phase::Idle | Phase::Done => true,
            Phase::Follow => self.speed <= 0.0 && !advance,
            Phase::Measure if !self.transit.is_under_way() => !advance,
            Phase::Turn if self.is_led() => self.round.is_still() && !advance,
            _ => self.transit.is_still(),
        };
        watch.lap(Stage::Hold);
        if let Ok(joints) = &mut result {
            watch.result(Stage::Hold, joints);
        }
        let found = blind.then_some(Fault::Blind);
        Wish::of(result, found, still, reference, arm, &params.joint_speed)
    }

    /// No first sighting in time, or no correction for the path ahead: going on would be from memory.
    fn is_blind(&self, params: &SealParams) -> bool {
        let (station, length) = (self.stations[2], params.path.length());
        let known = self.corrections.newest().unwrap_or(f32::MIN);
        let interval = PERIOD * params.vision_period as f32 * params.speed;
        let unseen = station > 0.0 && station < length && station > known + interval && known < length - interval;
        self.phase == Phase::Follow && params.preview && (unseen || self.waited > FIRST_FRAME)
    }

    /// Between two motions of the measurement. A measured part is left straight up.
    fn measure_on(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
    ) -> Result<[f32; AXES], Fault> {
        let next = self
            .measure
            .next(&params.measure, &params.path, &params.mount, &mut self.to_part)?;
        match next {
            Next::Wait => {}
            Next::Go(goal) => self.move_to(params, reference, &goal)?,
            Next::Done => return self.rise(params, arm, reference),
        }
        Ok(*reference)
    }

    /// First of all up along the nozzle, clear of whatever it was stopped over; where there is no room for that, straight to the approach.
    #[inline(never)]
    fn rise(&mut self, params: &SealParams, arm: &Arm<AXES>, reference: &[f32; AXES]) -> Result<[f32; AXES], Fault> {
        let goal = arm.forward(reference).raised(params.clearance);
        let Ok(to) = params.inverse.nearest(&goal, reference) else {
            return self.go(params, reference, Phase::Approach);
        };
        self.phase = Phase::Rise;
        self.transit.start(&to);
        Ok(*reference)
    }

    /// Starts a phase of point-to-point motion: over the start, down to it, or up from the end.
    #[inline(never)] // large, and in no hurry
    fn go(&mut self, params: &SealParams, reference: &[f32; AXES], phase: Phase) -> Result<[f32; AXES], Fault> {
        self.phase = phase;
        let station = self.stations[2];
        let height = if phase == Phase::Descend { 0.0 } else { params.clearance };
        // At the end of the run-out the last correction still holds: lift from where the nozzle is.
        let [lateral, dz, roll] = if phase == Phase::Lift {
            self.correction(params, station)
        } else {
            [0.0; 3]
        };
        let goal = self.to_part * params.path.place(station).nozzle(lateral, dz + height, roll);
        self.move_to(params, reference, &goal)?;
        Ok(*reference)
    }

    /// Plans a point-to-point motion of the nozzle to `goal`. A path begins with the wrist unwound, and is then kept to.
    #[inline(never)] // it is large, wanted in many places, and in no hurry
    fn move_to(&mut self, params: &SealParams, reference: &[f32; AXES], goal: &Pose) -> Result<(), Fault> {
        let begins = self.phase == Phase::Approach || self.phase == Phase::Measure && self.measure.start().is_none();
        let to = if begins {
            params.inverse.unwound(goal, reference)
        } else {
            params.inverse.nearest(goal, reference)
        }
        .map_err(|_| Fault::Unreachable)?;
        self.transit.start(&to);
        Ok(())
    }

    #[inline(never)] // in no hurry: this wants less than following does
    fn point_to_point(
        &mut self,
        params: &SealParams,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<[f32; AXES], Fault> {
        let (joints, arrived) = self.transit.step(reference, &params.joint, advance);
        if self.phase == Phase::Turn {
            self.corrections.settle(&params.path, self.round.due());
        }
        if !arrived {
            return Ok(joints);
        }
        match self.phase {
            Phase::Turn => self.turn_on(params, &joints),
            Phase::Rise if params.measure.start && !self.measure.is_done() => {
                self.phase = Phase::Measure;
                Ok(joints)
            }
            Phase::Rise => self.go(params, &joints, Phase::Approach),
            Phase::Measure => Ok(joints),
            Phase::Approach => self.go(params, &joints, Phase::Descend),
            Phase::Descend => {
                self.phase = Phase::Follow;
                if let Some(start) = self.measure.start() {
                    self.corrections.begin(&params.path, &self.to_part, &start.pose);
                }
                Ok(joints)
            }
            _ => {
                self.phase = Phase::Done;
                Ok(joints)
            }
        }
    }

    /// The tip is led cycle by cycle, and not from point to point.
    fn is_led(&self) -> bool {
        self.phase == Phase::Follow || self.phase == Phase::Turn && self.round.leg == Leg::Along
    }

    /// Where the tip is to be, T_b_n; `None` where the arm is to stay.
    fn lead(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<Option<Pose>, Fault> {
        if self.phase == Phase::Follow {
            self.follow(params, arm, reference, advance)
        } else {
            self.look_round(params, reference, advance)
        }
    }

    fn follow(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<Option<Pose>, Fault> {
        let path = &params.path;
        let here = self.stations[2];
        if advance && self.halt - here < ARRIVED {
            self.speed = 0.0;
            self.halted(params, arm, reference)?;
            return Ok(None);
        }
        let change = params.acceleration * PERIOD;
        // The first frame is taken at rest, over the start of the seam.
        let waiting = params.preview && self.corrections.newest().is_none();
        self.waited = if waiting && advance {
            self.waited.saturating_add(1)
        } else {
            0
        };
        self.speed = if waiting {
            0.0
        } else if advance {
            // The cap a step ahead, so that braking toward the end never overruns it.
            let cap = path.speed_squared(here + self.speed * PERIOD);
            if cap != self.cap.0 {
                self.cap = (cap, sqrt(cap));
            }
            (self.speed + change).min(self.cap.1).max(ARRIVED / PERIOD)
        } else {
            (self.speed - change).max(0.0)
        };
        let station = here + self.speed * PERIOD;
        self.stations[2] = station;
        let [lateral, height, roll] = self.correction(params, station);
        Ok(Some(self.to_part * path.place(station).nozzle(lateral, height, roll)))
    }

    /// At a halt: up from the end, or from the stop before a corner that is to be looked round.
    fn halted(&mut self, params: &SealParams, arm: &Arm<AXES>, reference: &[f32; AXES]) -> Result<[f32; AXES], Fault> {
        let Some(corner) = params.path.corner(self.halt) else {
            return self.go(params, reference, Phase::Lift);
        };
        self.halt = params.path.halt(corner.stop + ARRIVED);
        if params.preview {
            self.round = Round::at(*corner, params.mount.pose.p.x);
            self.phase = Phase::Turn;
            self.move_to(params, reference, &arm.forward(reference).raised(params.round.raise))?;
        }
        Ok(*reference)
    }

    /// The next leg of a look round a corner.
    #[inline(never)]
    fn turn_on(&mut self, params: &SealParams, reference: &[f32; AXES]) -> Result<[f32; AXES], Fault> {
        match self.round.leg {
            Leg::Up => {
                self.round.leg = Leg::Back;
                let goal = self.to_part * self.round.pose(&params.round, &params.path, self.applied);
                self.move_to(params, reference, &goal)?;
            }
            Leg::Back => {
                self.round.leg = Leg::Along;
                self.corrections.look_to(params.path.horizon(self.halt));
            }
            Leg::Along | Leg::Home => {
                let (next, height) = if self.round.leg == Leg::Along {
                    (Leg::Home, params.round.raise)
                } else {
                    (Leg::Down, 0.0)
                };
                self.round.leg = next;
                // Where the nozzle stopped, with the correction that was applied there.
                let [lateral, up, roll] = self.applied;
                let stop = params.path.place(self.round.stop()).nozzle(lateral, up, roll);
                self.move_to(params, reference, &(self.to_part * stop).raised(height))?;
            }
            Leg::Down => {
                self.stations = [self.round.stop(); 3];
                self.phase = Phase::Follow;
            }
        }
        Ok(*reference)
    }

    /// The sensor goes on along the seam.
    fn look_round(
        &mut self,
        params: &SealParams,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<Option<Pose>, Fault> {
        self.corrections.settle(&params.path, self.round.due());
        if self.round.go(&params.round, &params.path, advance) {
            self.turn_on(params, reference)?;
            return Ok(None);
        }
        Ok(Some(
            self.to_part * self.round.pose(&params.round, &params.path, self.applied),
        ))
    }

    fn correction(&mut self, params: &SealParams, station: f32) -> [f32; 3] {
        self.applied = if params.preview {
            self.corrections.at(&params.path, station)
        } else {
            [0.0; 3]
        };
        self.applied
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::rot_z;
    use crate::geometry::trig::{asin, atan2};

    #[test]
    fn the_start_pose_says_how_the_part_was_moved() {
        let taught = Pose {
            r: rot_z(0.3) * rot_x(0.35),
            p: Vector3::new(0.5, -0.1, 0.1),
        };
        let moved = Pose {
            r: rot_x(0.03) * rot_y(-0.05) * rot_z(0.04),
            p: Vector3::new(0.008, -0.009, 0.004),
        };
        // The part is moved by a motion of Σ_B; the start sensor sees it from the taught start: E = T0⁻¹·motion·T0.
        let seen = taught.inverse() * moved * taught;
        let (y, z_star) = (asin(seen.r.m13), -seen.r.m12 / seen.r.m11);
        let z = atan2(z_star, sin_cos(y).1);
        let x = atan2(-seen.r.m23, seen.r.m33);
        let start = StartPose {
            shift: seen.p.into(),
            tilt: [x, y, z],
        };
        let motion = start.motion(&taught);
        assert!(
            (motion.r - moved.r).iter().all(|e| e.abs() < 1e-6),
            "{:?}",
            motion.r - moved.r
        );
        assert!(
            (motion.p - moved.p).iter().all(|e| e.abs() < 1e-6),
            "{:?}",
            motion.p - moved.p
        );
    }
}
