//! The teaching job: along a seam that nobody has shown, and every point of it that the sensor sees out on the bus (paper 003, chapter 4).
//!
//! The operator places the nozzle at the seam's start and says so with a pose; the arm goes back from there by the sensor's lead, so that the
//! sensor stands over the first millimetres, waits until two images agree on the seam, and follows it to its end ([`ending`]). Two laws lead
//! the tool: [`lead`], the default, and [`paper`], the paper's loop. What is taught does not depend on the law: each point is put into Σ_B
//! with the joint angles of its exposure. The points leave as telemetry ([`hal::telemetry`]) raw, wrong ones too; smoothing them is
//! for whoever collects them, with all of them before him.

pub mod course;
pub mod ending;
pub mod lead;
pub mod paper;
pub mod trail;

use super::correction::{SensorMount, Use, slit_direction};
use super::past::{Moment, SYNC_OVERFLOW};
use super::seal::{AXES, PERIOD, Phase, Wish, step_toward};
use super::transit::Transit;
use crate::arm::{Arm, K3sInverse, Turns};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::geometry::rotation::{length, unit};
use crate::geometry::trig::{atan2, sqrt};
use crate::servo::profile::MotionLimits;
use course::Course;
use ending::{Ending, LOST_LENGTH, Outcome};
use hal::process::{Look, Sighting, TaughtPoint};
use hal::stage::{Stage, Stopwatch};
use hal::{wire_enum, wire_struct};
use lead::Lead;
use nalgebra::Vector3;
use paper::{Deviation, PAIR, PaperLaw};
use trail::Trail;

/// Distance into the seam at which the sensor begins, m: off the sheet's edge by more than a start pose's error.
pub const FIRST_LOOK: f32 = 0.002;

/// Cycles to wait at the start for two sightings that agree: 2 s.
const FIRST_FRAME: u16 = 400;

/// The first sightings must lie within this of where the start pose lets expect the seam, m: a bent part's 2 mm, its slope over the lead, and
/// the operator's error.
const FIRST_REACH: f32 = 0.010;

/// A sighting follows on if it lies within this of the course, m: four standard deviations on an ordinary surface …
const CLOSE: f32 = 0.5e-3;
/// … and this much more per distance from the newest point, m/m: what R150 bends away from a straight course in 15 mm.
const CLOSE_SLOPE: f32 = 0.05;
/// Tangent of the sharpest turn that is followed on the move, 20°: within it two sightings that agree with each other are believed against the
/// course.
const TURN_SLOPE: f32 = 0.36;
/// Furthest behind the newest point that a point is still of use to the course, m: the second slit's distance and a frame's way.
const BEHIND: f32 = 0.030;

/// Share of the difference that the normal takes up with each point: smoothed over about 25 mm.
const NORMAL_SHARE: f32 = 0.15;
/// Cosine of the largest difference that is still taken for the sheet's slope, 15°.
const NORMAL_REACH: f32 = 0.966;

/// How the tool is led.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Law {
    /// Nozzle on the seam that was seen, sensor over the seam ahead: without lag.
    #[default]
    Lead,
    /// The paper's critically damped loop.
    Paper,
}

wire_enum!(Law { Lead, Paper });

/// What a teaching job is told before it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct TeachParams {
    /// How the tool is led.
    pub law: Law,
    /// Where the operator placed the nozzle: at the seam's start, x along it; T_b_n.
    pub start: Pose,
    /// The sensor on the nozzle.
    pub mount: SensorMount,
    /// Cycles from one exposure to the next, m.
    pub vision_period: u8,
    /// Speed along the seam, m/s.
    pub speed: f32,
    /// Acceleration and braking along the seam, m/s².
    pub acceleration: f32,
    /// Height over the seam's ends at which the arm comes and goes, m.
    pub clearance: f32,
    /// Limits of the point-to-point motions, per joint.
    pub joint: [MotionLimits; AXES],
    /// Highest speed that the seam may ask of a joint, rad/s.
    pub joint_speed: [f32; AXES],
    /// Closed-form inverse of the arm, for the ends of the point-to-point motions.
    pub inverse: K3sInverse,
}

wire_struct!(TeachParams {
    law: Law,
    start: Pose,
    mount: SensorMount,
    vision_period: u8,
    speed: f32,
    acceleration: f32,
    clearance: f32,
    joint: [MotionLimits; AXES],
    joint_speed: [f32; AXES],
    inverse: K3sInverse,
});

impl TeachParams {
    /// Distance from tip to sensor, m.
    fn lead(&self) -> f32 {
        self.mount.pose.p.x
    }

    /// Where the nozzle begins: back from the start by the lead, but for the first look; T_b_n.
    fn run_in(&self) -> Pose {
        let back = Pose {
            p: Vector3::new(FIRST_LOOK - self.lead(), 0.0, 0.0),
            ..Pose::identity()
        };
        self.start * back
    }
}

/// The seam as far as it is known.
#[derive(Clone, Debug)]
struct Seam {
    course: Course,
    trail: Trail,
    /// Normal of the sheet at the newest points.
    normal: Vector3<f32>,
    /// A sighting off the course, at this distance, that waits for another that agrees with it.
    waiting: Option<(f32, Vector3<f32>)>,
}

/// The law's memory.
#[derive(Clone, Copy, Debug)]
enum Guide {
    Lead(Lead),
    Paper(PaperLaw),
}

/// The job's memory.
#[derive(Clone, Debug)]
pub struct TeachJob {
    phase: Phase,
    transit: Transit,
    speed: f32,
    /// Reference distances of the nozzle along the seam of this cycle, the next and the one after, m.
    stations: [f32; 3],
    /// Cycles since the last exposure.
    clock: u8,
    /// Cycles spent waiting for the first sightings.
    waited: u16,
    /// The first sighting, while it waits for a second.
    first: Option<Vector3<f32>>,
    seam: Option<Seam>,
    guide: Guide,
    ending: Ending,
    /// The first slit's point and line in Σ_S, of the exposure with this stamp, while the second's are awaited.
    pair: Option<(u8, Vector3<f32>, Vector3<f32>)>,
    sequence: u8,
    taught: Option<TaughtPoint>,
}

impl TeachJob {
    /// Not begun.
    pub fn new(params: &TeachParams) -> Self {
        let run_in = params.run_in();
        Self {
            phase: Phase::Idle,
            transit: Transit::IDLE,
            speed: 0.0,
            stations: [FIRST_LOOK - params.lead(); 3],
            clock: 0,
            waited: 0,
            first: None,
            seam: None,
            guide: match params.law {
                Law::Lead => Guide::Lead(Lead::new(&run_in)),
                Law::Paper => Guide::Paper(PaperLaw::new(run_in * params.mount.pose)),
            },
            ending: Ending::default(),
            pair: None,
            sequence: 0,
            taught: None,
        }
    }

    /// Where the job stands; [`Phase::Follow`] teaches.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// What the camera is to look at; [`Look::Dark`] if its frames do not matter now.
    pub fn look(&self) -> Look {
        if self.phase == Phase::Follow {
            Look::Seam
        } else {
            Look::Dark
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
        if self.phase != Phase::Follow {
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
        let line = slit_direction(seen, sighting.angle(), &params.mount);
        let (point, across) = (t_b_s * seen, t_b_s.r * line);
        self.tell(sighting, &point, &across);
        let fate = match &mut self.seam {
            Some(seam) => seam.take(&point, &across),
            None => self.begin(params, &t_b_s, &point),
        };
        if fate == Use::Used {
            self.steer(sighting, &t_b_s, &seen, &line);
        }
        fate
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
    fn begin(&mut self, params: &TeachParams, t_b_s: &Pose, point: &Vector3<f32>) -> Use {
        if length(&(point - t_b_s.p)) > FIRST_REACH {
            return Use::Outlier;
        }
        let before = self.first.replace(*point);
        let Some(before) = before.filter(|before| length(&(point - before)) <= CLOSE) else {
            return Use::Waiting;
        };
        let (run_in, first) = (params.run_in(), (point + before) * 0.5);
        let direction: Vector3<f32> = run_in.r.column(0).into();
        let normal: Vector3<f32> = run_in.r.column(2).into();
        let station = self.stations[0];
        self.seam = Some(Seam {
            course: Course::new(station + params.lead(), first, direction),
            trail: Trail::new(station, run_in.p, first, params.lead(), normal),
            normal,
            waiting: None,
        });
        Use::Used
    }

    /// The paper's law takes each frame's deviation: from both slits, or from one and the seam behind it.
    fn steer(&mut self, sighting: &Sighting, t_b_s: &Pose, seen: &Vector3<f32>, line: &Vector3<f32>) {
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
        if let Some(deviation) = deviation {
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
    ) -> Wish {
        self.stations = [self.stations[1], self.stations[2], self.stations[2]];
        turns.go(reference);
        watch.lap(Stage::Kinematics);
        watch.result(Stage::Kinematics, turns);
        let mut found = None;
        let mut result = match self.phase {
            Phase::Idle if advance => self.rise(params, arm, reference),
            Phase::Idle | Phase::Done => Ok(*reference),
            Phase::Follow => {
                found = match self.outcome(params) {
                    Outcome::Lost => Some(Fault::SeamLost),
                    _ if self.waited > FIRST_FRAME => Some(Fault::Blind),
                    _ => None,
                };
                self.follow(params, arm, reference, turns, advance, watch)
            }
            Phase::Rise | Phase::Measure | Phase::Approach | Phase::Descend | Phase::Lift => {
                self.point_to_point(params, reference, advance)
            }
        };
        let still = match self.phase {
            Phase::Idle | Phase::Done => true,
            Phase::Follow => self.speed <= 0.0 && !advance,
            _ => self.transit.is_still(),
        };
        watch.lap(Stage::Hold);
        if let Ok(joints) = &mut result {
            watch.result(Stage::Hold, joints);
        }
        Wish::of(result, found, still, reference, arm, &params.joint_speed)
    }

    fn outcome(&self, params: &TeachParams) -> Outcome {
        let sensor = self.stations[0] + params.lead();
        self.seam.as_ref().map_or(Outcome::Underway, |seam| {
            self.ending.judge(sensor, seam.course.station())
        })
    }

    /// First of all up along the nozzle, clear of whatever it was stopped over; where there is no room for that, straight to the approach.
    fn rise(&mut self, params: &TeachParams, arm: &Arm<AXES>, reference: &[f32; AXES]) -> Result<[f32; AXES], Fault> {
        self.up(params, arm, reference, Phase::Rise)
            .or_else(|_| self.go(params, reference, Phase::Approach))
    }

    /// Up along the nozzle by the clearance.
    fn up(
        &mut self,
        params: &TeachParams,
        arm: &Arm<AXES>,
        reference: &[f32; AXES],
        phase: Phase,
    ) -> Result<[f32; AXES], Fault> {
        let mut goal = arm.forward(reference);
        goal.p += goal.r.column(2) * params.clearance;
        self.move_to(params, &goal, reference, phase)
    }

    /// To the run-in's beginning: over it, or down to it.
    fn go(&mut self, params: &TeachParams, reference: &[f32; AXES], phase: Phase) -> Result<[f32; AXES], Fault> {
        let mut goal = params.run_in();
        if phase == Phase::Approach {
            goal.p += goal.r.column(2) * params.clearance;
        }
        self.move_to(params, &goal, reference, phase)
    }

    fn move_to(
        &mut self,
        params: &TeachParams,
        goal: &Pose,
        reference: &[f32; AXES],
        phase: Phase,
    ) -> Result<[f32; AXES], Fault> {
        let to = params
            .inverse
            .nearest(goal, reference)
            .map_err(|_| Fault::Unreachable)?;
        self.phase = phase;
        self.transit.start(&to);
        Ok(*reference)
    }

    fn point_to_point(
        &mut self,
        params: &TeachParams,
        reference: &[f32; AXES],
        advance: bool,
    ) -> Result<[f32; AXES], Fault> {
        let (joints, arrived) = self.transit.step(reference, &params.joint, advance);
        if !arrived {
            return Ok(joints);
        }
        match self.phase {
            Phase::Rise => self.go(params, &joints, Phase::Approach),
            Phase::Approach => self.go(params, &joints, Phase::Descend),
            Phase::Descend => {
                self.phase = Phase::Follow;
                Ok(joints)
            }
            _ => {
                self.phase = Phase::Done;
                Ok(joints)
            }
        }
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
        let Some(seam) = &mut self.seam else {
            self.waited = if advance { self.waited.saturating_add(1) } else { 0 };
            return Ok(*reference);
        };
        self.waited = 0;
        seam.trail.extend(&seam.course, &seam.normal);
        let change = params.acceleration * PERIOD;
        self.speed = if advance && outcome == Outcome::Underway {
            // Never so fast that the arm could not stop before the sensor is out of what is known.
            let left = LOST_LENGTH - (self.stations[2] + params.lead() - seam.course.station());
            let cap = sqrt(2.0 * params.acceleration * left.max(0.0));
            (self.speed + change).min(params.speed).min(cap)
        } else {
            (self.speed - change).max(0.0)
        };
        if advance && outcome == Outcome::Ended && self.speed <= 0.0 {
            return self.up(params, arm, reference, Phase::Lift);
        }
        let way = self.speed * PERIOD;
        let station = self.stations[2] + way;
        self.stations[2] = station;
        let mut goal = match &mut self.guide {
            Guide::Lead(lead) => lead.pose(station, params.lead(), &seam.trail, &seam.course, &seam.normal),
            Guide::Paper(law) => law.advance(way, params.vision_period) * params.mount.pose.inverse(),
        };
        watch.lap(Stage::Hold);
        watch.result(Stage::Hold, &mut goal);
        Ok(step_toward(arm, reference, turns, &goal, watch))
    }
}

impl Seam {
    /// Takes in a point of the seam if it follows on.
    fn take(&mut self, point: &Vector3<f32>, across: &Vector3<f32>) -> Use {
        let (ahead, off) = self.course.locate(point);
        let away = length(&off);
        let reach = ahead.max(0.0);
        if ahead < -BEHIND {
            return Use::OffPath;
        }
        if away <= CLOSE + CLOSE_SLOPE * reach {
            self.waiting = None;
            self.add(ahead, point, across);
            return Use::Used;
        }
        let within = away <= CLOSE + TURN_SLOPE * reach; // false for what is no number
        if !within {
            return Use::Outlier;
        }
        let station = self.course.station() + ahead;
        let before = self.waiting.replace((station, *point));
        let agrees = |(then, other): &(f32, Vector3<f32>)| {
            let (_, aside) = self.course.locate(other);
            length(&(off - aside)) <= CLOSE + TURN_SLOPE * (station - then).abs() && station > *then
        };
        let Some((then, other)) = before.filter(agrees) else {
            return Use::Waiting;
        };
        self.waiting = None;
        // A bend: what lies before it says little of where the seam goes on.
        self.course.turn();
        self.course.take(then - self.course.station(), &other);
        let (ahead, _) = self.course.locate(point);
        self.add(ahead, point, across);
        Use::Used
    }

    fn add(&mut self, ahead: f32, point: &Vector3<f32>, across: &Vector3<f32>) {
        self.course.take(ahead, point);
        let tangent = self.course.at(0.0).tangent;
        let normal = unit(&tangent.cross(across)).unwrap_or(self.normal);
        if normal.dot(&self.normal) > NORMAL_REACH {
            let mixed = self.normal + (normal - self.normal) * NORMAL_SHARE;
            self.normal = unit(&mixed).unwrap_or(self.normal);
        }
    }
}

/// To the nearest whole number.
fn nearest(value: f32) -> i32 {
    (value + if value < 0.0 { -0.5 } else { 0.5 }) as i32
}

#[cfg(test)]
mod tests {
    use super::course::Ahead;
    use super::*;
    use crate::geometry::trig::sin_cos;

    /// A seam with a corner of `degrees` to the left after 0.1 m, R5, seen each 7 mm (0.2 m/s and 35 ms).
    fn follow(degrees: f32) -> (Seam, Option<f32>) {
        const RADIUS: f32 = 0.005;
        let turn = degrees.to_radians();
        let corner = |s: f32| {
            let (sin, cos) = sin_cos(((s - 0.1) / RADIUS).max(0.0).min(turn));
            let past = (s - 0.1 - RADIUS * turn).max(0.0);
            Vector3::new(
                s.min(0.1) + RADIUS * sin + past * cos,
                RADIUS * (1.0 - cos) + past * sin,
                0.0,
            )
        };
        let mut seam = Seam {
            course: Course::new(0.0, corner(0.0), Vector3::x()),
            trail: Trail::new(-0.08, Vector3::new(-0.08, 0.0, 0.0), corner(0.0), 0.08, Vector3::z()),
            normal: Vector3::z(),
            waiting: None,
        };
        let mut refused = None;
        for step in 1..40 {
            let s = 0.007 * step as f32;
            if seam.take(&corner(s), &Vector3::y()) == Use::Outlier {
                refused = refused.or(Some(s));
            }
        }
        (seam, refused)
    }

    #[test]
    fn a_corner_of_15_degrees_is_followed_on_the_move() {
        let (seam, refused) = follow(15.0);
        assert_eq!(refused, None);
        let Ahead { tangent, .. } = seam.course.at(0.0);
        let heading = atan2(tangent.y, tangent.x).to_degrees();
        assert!((heading - 15.0).abs() < 0.5, "{heading}°");
    }

    #[test]
    fn a_corner_of_90_degrees_is_no_course_of_the_seam_and_loses_it() {
        let (seam, refused) = follow(90.0);
        assert!(refused.is_some_and(|s| (0.1..0.13).contains(&s)), "{refused:?}");
        assert!(seam.course.station() < 0.115, "{} m", seam.course.station());
        let ending = Ending::default();
        assert_eq!(ending.judge(0.17, seam.course.station()), Outcome::Lost);
    }
}
