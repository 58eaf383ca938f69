//! The teaching job: along a seam that nobody has shown, and every point of it that the sensor sees out on the bus (paper 003, chapter 4).
//!
//! The operator places the nozzle at the seam's start and says so with a pose; the arm goes back from there by the sensor's lead and more, so
//! that the sensor stands before the sheet's edge, creeps on until two images agree on the seam ([`beginning`]), and follows it to its end
//! ([`ending`]). So every slit sees the seam from its first millimetre to its last. Two laws lead the tool: [`lead`], the default, and [`paper`],
//! the paper's loop. What is taught does not depend on the law: each point is put into Σ_B with the joint angles of its exposure. The points
//! leave as telemetry ([`hal::telemetry`]) raw, wrong ones too; smoothing them is for whoever collects them, with all of them before him.

pub mod beginning;
pub mod course;
pub mod ending;
mod flanks;
pub mod lead;
pub mod paper;
mod params;
pub mod seam;
pub mod search;
pub mod trail;
mod turn;

pub use params::{Law, TeachParams};

use super::access::Access;
use super::correction::Use;
use super::past::{Moment, SYNC_OVERFLOW};
use super::phase::Phase;
use super::seal::{AXES, PERIOD};
use super::wish::{Wish, step_toward};
use crate::arm::{Arm, Turns};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::geometry::trig::{atan2, sqrt};
use beginning::Beginning;
use ending::{Ending, LOST_LENGTH, Outcome};
use flanks::between_flanks;
use hal::process::{Look, Sighting, TaughtPoint};
use hal::stage::{Stage, Stopwatch};
use lead::Lead;
use nalgebra::Vector3;
use paper::{Deviation, PAIR, PaperLaw};
use seam::Seam;
use search::Search;

/// Speed at which the sensor goes to meet the seam, m/s: two images in 2 mm of it.
const CREEP: f32 = 0.050;
/// Distance past the start that the operator gave at which there should have been a seam, m.
const LAST_LOOK: f32 = 0.030;

/// The law's memory.
#[derive(Clone, Copy, Debug)]
enum Guide {
    Lead(Lead),
    Paper(PaperLaw),
}

/// The job's memory.
#[derive(Clone, Debug)]
pub struct TeachJob {
    access: Access,
    speed: f32,
    /// Reference distances of the nozzle along the seam of this cycle, the next and the one after, m.
    stations: [f32; 3],
    /// Cycles since the last exposure.
    clock: u8,
    beginning: Beginning,
    seam: Option<Seam>,
    guide: Guide,
    ending: Ending,
    search: Option<Search>,
    /// Up to this distance the nozzle is raised, m.
    raised_to: f32,
    /// The first slit's point and line in Σ_S, of the exposure with this stamp, while the second's are awaited.
    pair: Option<(u8, Vector3<f32>, Vector3<f32>)>,
    sequence: u8,
    taught: Option<TaughtPoint>,
}

impl TeachJob {
    /// Not begun.
    pub fn new(params: &TeachParams) -> Self {
        let run_in = params.beginning();
        Self {
            access: Access::IDLE,
            speed: 0.0,
            stations: [params.first_station(); 3],
            clock: 0,
            beginning: Beginning::default(),
            seam: None,
            guide: match params.law {
                Law::Lead => Guide::Lead(Lead::new(&run_in)),
                Law::Paper => Guide::Paper(PaperLaw::new(run_in * params.mount.pose)),
            },
            ending: Ending::default(),
            search: None,
            raised_to: f32::NEG_INFINITY,
            pair: None,
            sequence: 0,
            taught: None,
        }
    }

    /// Where the job stands; [`Phase::Follow`] teaches.
    pub fn phase(&self) -> Phase {
        self.access.phase
    }

    /// What the camera is to look at; [`Look::Dark`] if its frames do not matter now.
    pub fn look(&self) -> Look {
        match self.access.phase {
            Phase::Follow | Phase::Turn => Look::Seam,
            _ => Look::Dark,
        }
    }

    /// Reference distance of the nozzle from the start along the seam in this cycle, m.
    pub fn station(&self) -> f32 {
        self.stations[0]
    }

    /// The point that was taught since the last call.
    pub fn taught(&mut self) -> Option<TaughtPoint> {
        self.taught.take()
    }

    /// SYNC count of the next exposure to command, zero for none in this cycle.
    pub fn exposure(&mut self, params: &TeachParams, sync: u8) -> u8 {
        if self.look() != Look::Seam {
            return 0;
        }
        let due = self.clock == 0;
        self.clock = if self.clock + 1 >= params.vision_period {
            0
        } else {
            self.clock + 1
        };
        if !due {
            return 0;
        }
        if let Guide::Paper(law) = &mut self.guide {
            law.frame();
        }
        // As every RPDO, the command acts on the next SYNC.
        sync % SYNC_OVERFLOW + 1
    }

    /// Takes in a sighting with the moment of its exposure.
    pub fn sight(
        &mut self,
        params: &TeachParams,
        arm: &Arm<AXES>,
        sighting: &Sighting,
        exposed: Option<(&Moment<AXES>, u8)>,
    ) -> Use {
        let Some((moment, _)) = exposed.filter(|_| sighting.look == self.look()) else {
            return Use::Stale;
        };
        self.ending.looked(sighting.refusal, moment.station + params.lead());
        if sighting.refusal != 0 {
            return Use::Refused;
        }
        let t_b_s = arm.forward(&moment.joints) * params.mount.pose;
        let seen = Vector3::from(sighting.point());
        let line = self.line(params, &t_b_s, seen, sighting);
        let (point, across) = (t_b_s * seen, t_b_s.r * line);
        let fate = match (&mut self.search, &mut self.seam) {
            // The slit further on sees a corner aslant.
            (Some(_), _) if sighting.slit != 0 => Use::OffPath,
            (Some(search), _) => search.take(&point, &t_b_s.r.column(0).into()),
            (None, Some(seam)) => seam.take(&point, &across),
            (None, None) => self.begin(params, sighting.slit, &point),
        };
        // Past a corner that is not known yet the sensor may see the other leg already: it is taught in its turn.
        if fate == Use::Used || self.search.is_none() && fate != Use::Outlier {
            self.tell(sighting, &point, &across);
        }
        if fate == Use::Used {
            self.steer(params, sighting, &t_b_s, &seen, &line);
        }
        fate
    }

    /// Direction of the lit line across the sheet at `seen` (Σ_S), where `sighting` saw it, in Σ_S.
    fn line(&self, params: &TeachParams, t_b_s: &Pose, seen: Vector3<f32>, sighting: &Sighting) -> Vector3<f32> {
        let line = params.mount.slit_direction(seen, sighting);
        match &self.seam {
            // In a search the tool points along the seam.
            Some(Seam { course, .. }) if params.flank > 0.0 && self.search.is_none() => {
                let (ahead, _) = course.locate(&(*t_b_s * seen));
                let along = t_b_s.r.transpose() * course.at(ahead).tangent;
                between_flanks(&line, &along, params.flank, params.mount.slopes(sighting)[0])
            }
            _ => line,
        }
    }

    /// A point for the bus.
    fn tell(&mut self, sighting: &Sighting, point: &Vector3<f32>, across: &Vector3<f32>) {
        let flat = sqrt(across.x * across.x + across.y * across.y);
        self.taught = Some(TaughtPoint {
            sequence: self.sequence,
            slit: sighting.slit,
            point_um: [point.x, point.y, point.z].map(|m| nearest(m * 1e6)),
            across_e4: [atan2(across.y, across.x), atan2(across.z, flat)].map(|angle| nearest(angle * 1e4) as i16),
            sigma_um: sighting.sigma_um,
        });
        self.sequence = self.sequence.wrapping_add(1);
    }

    /// Two sightings that agree are where the seam begins.
    fn begin(&mut self, params: &TeachParams, slit: u8, point: &Vector3<f32>) -> Use {
        let fate = self.beginning.take(slit, point, &params.start);
        if fate == Use::Used {
            let along: Vector3<f32> = params.start.r.column(0).into();
            let (station, nozzle) = (along.dot(&(point - params.start.p)), self.stations[2]);
            let seam = self.seam.insert(Seam::EMPTY);
            seam.start(station, *point, &params.straight(nozzle), station - nozzle);
        }
        fate
    }

    /// The paper's law takes each frame's deviation: from both slits, or from one and the seam behind it.
    fn steer(
        &mut self,
        params: &TeachParams,
        sighting: &Sighting,
        t_b_s: &Pose,
        seen: &Vector3<f32>,
        line: &Vector3<f32>,
    ) {
        let (Guide::Paper(law), Some(seam)) = (&mut self.guide, &self.seam) else {
            return;
        };
        let other = self.pair.replace((sighting.stamp, *seen, *line));
        let both = other.filter(|(stamp, ..)| *stamp == sighting.stamp && sighting.slit != 0);
        let deviation = match both {
            Some((_, behind, beside)) => Deviation::of(seen, &behind, &(line + beside)),
            None => {
                let behind = t_b_s.inverse() * seam.course.at(-PAIR).point;
                Deviation::of(seen, &behind, line)
            }
        };
        if let Some(mut deviation) = deviation {
            // The loop would bring the sensor down to the seam.
            deviation.shift.z += params.ride();
            law.measured(deviation);
        }
    }

    /// One cycle on: `reference` is last cycle's wish, to which `turns` go on. `advance` false brakes, along the seam.
    pub fn advance(
        &mut self,
        params: &TeachParams,
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
        let mut found = None;
        let mut result = match self.access.phase {
            Phase::Idle if advance => {
                let rise = self.access.rise(&params.access, arm, reference, &params.beginning());
                rise.map(|()| *reference)
            }
            Phase::Idle | Phase::Done => Ok(*reference),
            Phase::Follow => {
                found = match self.outcome(params) {
                    Outcome::Lost if matches!(self.guide, Guide::Paper(_)) => Some(Fault::SeamLost),
                    _ if self.seam.is_none() && self.stations[0] + params.lead() > LAST_LOOK => Some(Fault::Blind),
                    _ => None,
                };
                self.follow(params, arm, reference, turns, advance, watch)
            }
            Phase::Rise | Phase::Measure | Phase::Approach | Phase::Descend | Phase::Turn | Phase::Lift => {
                self.point_to_point(params, reference, advance)
            }
        };
        let still = match self.access.phase {
            Phase::Idle | Phase::Done => true,
            Phase::Follow => self.speed <= 0.0 && !advance,
            _ => self.access.is_still(),
        };
        watch.lap(Stage::Hold);
        if let Ok(joints) = &mut result {
            watch.result(Stage::Hold, joints);
        }
        Wish::of(result, found, still, reference, arm, &params.access.joint_speed)
    }

    fn outcome(&self, params: &TeachParams) -> Outcome {
        let sensor = self.stations[0] + params.lead();
        self.seam.as_ref().map_or(Outcome::Underway, |seam| {
            self.ending.judge(sensor, seam.course.station())
        })
    }

    #[inline(never)] // in no hurry: this wants less than following does
    fn point_to_point(
        &mut self,
        params: &TeachParams,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<[f32; AXES], Fault> {
        let (joints, arrived) = self.access.step(&params.access, reference, advance);
        match self.access.phase {
            _ if !arrived => {}
            Phase::Turn => self.turn_on(params, &joints)?,
            _ => self.access.arrived(&params.access, &joints, &params.beginning())?,
        }
        Ok(joints)
    }

    fn follow(
        &mut self,
        params: &TeachParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        turns: &Turns<AXES>,
        advance: bool,
        watch: &mut impl Stopwatch,
    ) -> Result<[f32; AXES], Fault> {
        let outcome = self.outcome(params);
        let change = params.acceleration * PERIOD;
        self.speed = if advance && outcome == Outcome::Underway {
            let most = self.seam.as_ref().map_or(CREEP, |seam| {
                // Never so fast that the arm could not stop before the sensor is out of what is known.
                let left = LOST_LENGTH - (self.stations[2] + params.lead() - seam.course.station());
                sqrt(2.0 * params.acceleration * left.max(0.0))
            });
            (self.speed + change).min(params.speed).min(most)
        } else {
            (self.speed - change).max(0.0)
        };
        if advance && outcome != Outcome::Underway && self.speed <= 0.0 {
            if outcome == Outcome::Lost {
                self.look_round(params, arm, reference)?;
            } else {
                self.access.phase = Phase::Lift;
                self.access
                    .up(&params.access, arm, reference, params.access.clearance)?;
            }
            return Ok(*reference);
        }
        let way = self.speed * PERIOD;
        let station = self.stations[2] + way;
        self.stations[2] = station;
        let mut goal = match (&mut self.guide, &mut self.seam) {
            (Guide::Paper(law), _) => law.advance(way, params.vision_period) * params.mount.pose.inverse(),
            (Guide::Lead(lead), Some(seam)) => lead.pose(station, params.lead(), seam),
            (Guide::Lead(_), None) => params.straight(station),
        };
        goal = self.landing(params, station, goal);
        watch.lap(Stage::Hold);
        watch.result(Stage::Hold, &mut goal);
        Ok(step_toward(arm, reference, turns, &goal, watch))
    }
}

/// To the nearest whole number.
fn nearest(value: f32) -> i32 {
    (value + if value < 0.0 { -0.5 } else { 0.5 }) as i32
}
