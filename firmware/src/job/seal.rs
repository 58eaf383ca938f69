//! The sealing job: to the start of the path, along it with the bead on, and away (paper 003, chapter 6).
//!
//! Gives the joint reference one 5 ms cycle after another, two cycles ahead: outputs computed in cycle k act from SYNC k+1 to k+2.
//! Says what it wants; whether it may is [`crate::safety`]'s word, and what the motors do about it is [`crate::servo`]'s.

mod access;
mod params;
mod start;
mod turn;

pub use params::SealParams;
pub use start::StartPose;

use super::access::Access;
use super::correction::{Corrections, Use};
use super::exposure::Exposures;
use super::measure::Measure;
use super::past::{Moment, SYNC_OVERFLOW};
use super::path::TaughtPath;
use super::phase::Phase;
use super::round::{Leg, Round};
use super::start_pose::StartFrame;
use super::wish::{Wish, step_toward};
use crate::arm::{Arm, Turns};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::geometry::trig::sqrt;
use crate::servo::hold::Knot;
use hal::process::{Look, Sighting};
use hal::stage::{Stage, Stopwatch};
use hal::wire::Wire;

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

/// The job's memory.
#[derive(Clone, Debug)]
#[repr(C)] // what following needs first: a float further on than 1020 bytes takes the processor one instruction more
pub struct SealJob {
    /// Reference stations of this cycle, the next and the one after.
    stations: [f32; 3],
    speed: f32,
    /// The last cap of the speed, squared (m²/s²) and itself (m/s): along most of a path it stays, and a root is dear.
    cap: (f32, f32),
    /// Where the nozzle halts next, m: at a corner, or at the end.
    halt: f32,
    /// Deviation applied at the newest reference.
    applied: [f32; 3],
    to_part: Pose,
    round: Round,
    exposures: Exposures,
    /// Cycles spent waiting for the first sighting.
    waited: u16,
    access: Access,
    corrections: Corrections,
    measure: Measure,
}

impl SealJob {
    /// Of no path yet.
    pub const EMPTY: Self = Self {
        access: Access::IDLE,
        to_part: Pose::EMPTY,
        measure: Measure::EMPTY,
        corrections: Corrections::EMPTY,
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
        self.access.phase
    }

    /// Reference station of this cycle, m.
    pub fn station(&self) -> f32 {
        if self.access.phase == Phase::Turn {
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
        match self.access.phase {
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
        if self.access.phase == Phase::Measure {
            return self.measure.take(
                &params.measure,
                &params.path,
                &params.mount,
                &mut self.to_part,
                sighting,
                &t_b_n(),
            );
        }
        if self.access.phase == Phase::Turn && sighting.slit != 0 {
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
        if self.access.phase == Phase::Measure && !self.access.is_under_way() {
            return self.measure.exposure(sync % SYNC_OVERFLOW + 1);
        }
        if self.access.phase == Phase::Turn {
            let count = self.exposures.command(self.round.is_due(), sync);
            if count != 0 {
                self.round.exposed();
            }
            return count;
        }
        let seen = self.stations[0] + params.mount.pose.p.x;
        if self.access.phase != Phase::Follow || seen > params.path.length() + LAST_LOOK {
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
        if self.access.phase == Phase::Follow && next >= 0.0 && next <= params.path.length() {
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
        let mut result = match self.access.phase {
            Phase::Idle if advance => self.rise(params, arm, reference).map(|()| *reference),
            Phase::Idle | Phase::Done => Ok(*reference),
            Phase::Measure if !self.access.is_under_way() && advance => {
                self.measure_on(params, arm, reference).map(|()| *reference)
            }
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
        let still = match self.access.phase {
            Phase::Idle | Phase::Done => true,
            Phase::Follow => self.speed <= 0.0 && !advance,
            Phase::Measure if !self.access.is_under_way() => !advance,
            Phase::Turn if self.is_led() => self.round.is_still() && !advance,
            _ => self.access.is_still(),
        };
        watch.lap(Stage::Hold);
        if let Ok(joints) = &mut result {
            watch.result(Stage::Hold, joints);
        }
        let found = blind.then_some(Fault::Blind);
        Wish::of(result, found, still, reference, arm, &params.access.joint_speed)
    }

    /// No first sighting in time, or nothing seen of the path ahead: going on would be from memory.
    fn is_blind(&self, params: &SealParams) -> bool {
        if self.access.phase != Phase::Follow || !params.preview {
            return false;
        }
        let (station, length) = (self.stations[2], params.path.length());
        let known = self.corrections.seen();
        let interval = PERIOD * params.vision_period as f32 * params.speed;
        let unseen = station > 0.0 && station < length && station > known + interval && known < length - interval;
        unseen || self.waited > FIRST_FRAME
    }

    /// The tip is led cycle by cycle, and not from point to point.
    fn is_led(&self) -> bool {
        self.access.phase == Phase::Follow || self.access.phase == Phase::Turn && self.round.leg == Leg::Along
    }

    /// Where the tip is to be, T_b_n; `None` where the arm is to stay.
    fn lead(
        &mut self,
        params: &SealParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<Option<Pose>, Fault> {
        if self.access.phase == Phase::Follow {
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

    fn correction(&mut self, params: &SealParams, station: f32) -> [f32; 3] {
        self.applied = if params.preview {
            self.corrections.at(&params.path, station)
        } else {
            [0.0; 3]
        };
        self.applied
    }
}
