//! Measures where the part lies before it is sealed: its start pose, twice, then sections along the seam (paper 003, chapter 5).
//!
//! First the seam is found by the slit's light, which a grey image's scratches and shadows do not look like: a section well behind the start as
//! taught, searched for round about and in height, and one nearer to it. Held over the start as they place it, with the seam along the image's
//! middle, the sensor sees the seam's end in a grey image, and in light sections a little further on the sheet's attitude. From what they say
//! it is held over the real start and looks again, which takes off what the first view's slant left. Then the [`Survey`]: the seam is
//! looked at along its length, so that a bend near the start does not turn the whole path.
//!
//! Everything is looked at from rest, and one look is asked for at a time.

use super::correction::{SensorMount, slit_direction};
use super::path::TaughtPath;
use super::start_pose::{StartFrame, StartLooks};
use super::survey::{SECTIONS, Section, Survey, placed};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::job::correction::Use;
use hal::process::{Look, Sighting};
use hal::wire::Wire;
use hal::wire_struct;
use nalgebra::{Matrix3, Vector3};

/// Cycles at rest before an exposure, 40 ms: the axes have come to where the reference stopped. A ripple that is left moves the image by less than a
/// pixel while it is exposed, and where the arm really was is latched with the exposure.
const SETTLE: u8 = 8;
/// Cycles after which a look that was not answered counts as refused: three times the slowest camera's latency.
const ANSWER: u8 = 30;
/// The same of a grey view, half as much again as the slowest processor works on it.
const GREY_ANSWER: u8 = 80;
/// Looks at one place before it is given up: one in twenty images is lost, and speckle is the same from rest.
const TRIES: u8 = 2;
/// Views of the start, at most: two in succession must agree, the second from where the first said; on a wavy sheet two with one between.
const VIEWS: u8 = 10;
/// Light sections in a view: two give the attitude, but sheets are wavy, and four over 36 mm halve what one wave does to it.
const SLITS: u8 = 4;
/// Distance of the first light section from the seam's start, m: as near as the sheet's corner and 3° of yaw allow, because the corner's height is
/// taken from there.
const FIRST_SECTION: f32 = 0.0025;
/// The same of a bend: its flanks rise toward the light, which meets them before it meets the seam, and the first centimetre of them must be lit.
const FIRST_SECTION_OF_BEND: f32 = 0.003;
/// And, where nothing is seen there, so much further, m: a start of which neither is seen lies elsewhere.
const FURTHER: f32 = 0.0015;
/// Distance from one section to the next, m; every other view has all but the first half as much nearer, and so other waves under them.
const ADVANCE: f32 = 0.012;
/// Light sections tried before the view is given up.
const ADVANCES: u8 = 6;
/// Where the seam is first looked for, along it from the start as taught, m: of a part 20 mm nearer, or as high and so met by the slit's light
/// before its place, the seam is there still.
const FIND: f32 = 0.040;
/// Round about there, m: along, across and up. The light is in view from 33 mm below to 22 mm above, and 16 mm to either side, and the joint takes
/// 7 mm of that; so the first nine cover 20 mm each way and 5°. A seam that is further than about 45 mm aside is not found. Not down
/// where the nozzle, 80 mm behind, may be over the part.
const SEARCH: [[f32; 3]; 15] = [
    [0.0, 0.0, 0.0],
    [0.0, 0.0, 0.014],
    [0.0, 0.014, 0.0],
    [0.0, -0.014, 0.0],
    [0.0, 0.014, 0.014],
    [0.0, -0.014, 0.014],
    [0.0, 0.0, -0.014],
    [0.0, 0.014, -0.014],
    [0.0, -0.014, -0.014],
    [0.0, 0.035, 0.0],
    [0.0, -0.035, 0.0],
    [0.035, 0.0, 0.014],
    [0.035, 0.020, 0.014],
    [0.035, -0.020, 0.014],
    [0.020, 0.0, 0.028],
];
/// Where the second section is tried, m from the first: toward the start if that is no nearer than this, else away from it; then anywhere else.
const SECOND: [f32; 4] = [0.024, 0.012, -0.012, -0.024];
/// See [`SECOND`], m.
const ROOM: f32 = 0.036;
/// Where the seam's end is looked for, along the seam from where it is expected, m: views of 54 mm.
const ENDS: [f32; 5] = [0.0, 0.020, -0.020, 0.040, -0.040];
/// The seam is seen in no section further before its start than this, and in one no further behind it than the first ones are looked for, give or
/// take as much, m: the sheet's slope moves the light by that.
const NEAR: f32 = 0.001;
/// Height over the first view from which the arm comes down to it, m.
const HOVER: f32 = 0.040;
/// Height of the nozzle over the seam in the survey, m: over what the part may be bent, and what a motion between two sections sags.
const LIFT: f32 = 0.010;
/// Of so many sections one may be missed.
const MISSED_OF: u8 = 3;
/// Distance of the last section from the seam's end, m: clear of the sheet's corner.
const LAST_SECTION: f32 = 0.015;

/// What is to be measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasureParams {
    /// Anything at all; else the start pose is as it is told.
    pub start: bool,
    /// Height over the seam's sheet of the edge that a grey image shows, m: the upper sheet's thickness for a lap joint, else 0.
    pub edge_height: f32,
    /// The seam is a bend's.
    pub bend: bool,
    /// Sections of the survey, 0 for none (the paper's way) or 2..=[`SECTIONS`].
    pub sections: u8,
}

wire_struct!(MeasureParams {
    start: bool,
    edge_height: f32,
    bend: bool,
    sections: u8
});

/// What is being looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// A light section anywhere on the seam, to begin with.
    Find,
    /// Another, to say which way it runs.
    Second,
    /// The seam's end.
    Grey,
    /// A light section near it.
    Slit,
    /// Section number so of the survey.
    Survey(u8),
    /// Nothing: the fit is under way, and then comes section number so.
    Fit(u8),
    /// Nothing more.
    Done,
}

/// What is to be done next.
#[derive(Clone, Copy, Debug)]
pub enum Next {
    /// Stay where the arm is.
    Wait,
    /// Bring the nozzle to this pose (Σ_B), and rest.
    Go(Pose),
    /// The part is placed.
    Done,
}

/// The measurement.
#[derive(Clone, Debug)]
pub struct Measure {
    step: Step,
    /// Views of the start that were taken.
    views: u8,
    /// Places of the searches for the seam, its second section and its end, and light section, that are looked at.
    place: u8,
    second: u8,
    end: u8,
    advance: u8,
    /// The section that was found first.
    found: Option<Section>,
    /// The seam point nearest to its start of all sections, Σ_B, m: the start is not beyond it.
    nearest: Option<Vector3<f32>>,
    /// Where the part lies as told, from which every search begins.
    told: Pose,
    /// The arm is over the first view.
    hovering: bool,
    /// The sensor is to be brought over what is looked at next.
    move_on: bool,
    settle: u8,
    /// SYNC count of the exposure that was asked for, and cycles since.
    asked: Option<u8>,
    since: u8,
    /// A sighting was taken in this cycle: where it leads to is planned in the next.
    heard: bool,
    /// The last look of a view was taken: what it says of the start comes in a cycle of its own.
    viewed: bool,
    tries: u8,
    misses: u8,
    slits: u8,
    looks: StartLooks,
    start: Option<StartFrame>,
    /// The one measured before that.
    earlier: Option<StartFrame>,
    survey: Survey,
    failure: Option<Fault>,
}

impl Measure {
    /// Not begun.
    pub const EMPTY: Self = Self {
        step: Step::Find,
        views: 0,
        place: 0,
        second: 0,
        end: 0,
        advance: 0,
        found: None,
        nearest: None,
        told: Pose::EMPTY,
        hovering: false,
        move_on: true,
        settle: 0,
        asked: None,
        since: 0,
        heard: false,
        viewed: false,
        tries: 0,
        misses: 0,
        slits: 0,
        looks: StartLooks::new(),
        start: None,
        earlier: None,
        survey: Survey::EMPTY,
        failure: None,
    };

    /// The start pose as last measured.
    pub fn start(&self) -> Option<&StartFrame> {
        self.start.as_ref()
    }

    /// Everything is measured.
    pub fn is_done(&self) -> bool {
        self.step == Step::Done
    }

    /// What the camera is to look at, and by which light.
    pub fn look(&self) -> Look {
        match self.step {
            Step::Grey => Look::StartGrey,
            Step::Find | Step::Second | Step::Slit | Step::Survey(_) => Look::StartSlit,
            Step::Fit(_) | Step::Done => Look::Dark,
        }
    }

    /// The arm rests, `next` being the count of the SYNC to come: the count of an exposure to command, zero for none.
    pub fn exposure(&mut self, next: u8) -> u8 {
        if self.asked.is_some() || self.move_on || self.settle > 0 || self.look() == Look::Dark {
            return 0;
        }
        self.asked = Some(next);
        self.since = 0;
        next
    }

    /// One cycle at rest: what to do. `to_part`, the motion (Σ_B) of the part from where it was taught, gets better each time.
    pub fn next(
        &mut self,
        params: &MeasureParams,
        path: &TaughtPath,
        mount: &SensorMount,
        to_part: &mut Pose,
    ) -> Result<Next, Fault> {
        if let Some(fault) = self.failure {
            return Err(fault);
        }
        if core::mem::take(&mut self.heard) {
            return Ok(Next::Wait);
        }
        if core::mem::take(&mut self.viewed) {
            self.conclude(params, path, mount, to_part);
            return Ok(Next::Wait);
        }
        if let Step::Fit(section) = self.step {
            if self.survey.fit(path, to_part) {
                self.step = if section < params.sections {
                    Step::Survey(section)
                } else {
                    Step::Done
                };
                self.move_on = true;
            }
            return Ok(Next::Wait);
        }
        if self.step == Step::Done {
            return Ok(Next::Done);
        }
        if self.move_on {
            let mut goal = *to_part * self.view(params, path, mount, to_part);
            if !self.hovering {
                self.hovering = true;
                self.told = *to_part;
                goal = goal.raised(HOVER);
                return Ok(Next::Go(goal));
            }
            self.move_on = false;
            self.settle = SETTLE;
            return Ok(Next::Go(goal));
        }
        self.settle = self.settle.saturating_sub(1);
        if self.asked.is_some() {
            self.since += 1;
            let patience = if self.look() == Look::StartGrey {
                GREY_ANSWER
            } else {
                ANSWER
            };
            if self.since > patience {
                self.refused(params, to_part);
            }
        }
        Ok(Next::Wait)
    }

    /// The nozzle's pose over the taught part for the next look; the part lies moved by `to_part`.
    fn view(&self, params: &MeasureParams, path: &TaughtPath, mount: &SensorMount, to_part: &Pose) -> Pose {
        let sensor = match (self.step, self.looks.aim()) {
            (Step::Survey(section), _) => {
                let station = station(section, params, path);
                return path.place(station - mount.pose.p.x).nozzle(0.0, LIFT, 0.0);
            }
            (Step::Find, _) => {
                let [_, across, up] = SEARCH.get(usize::from(self.place)).copied().unwrap_or_default();
                aside(&frame_of(path, self.station()), [0.0, across, up])
            }
            (Step::Second, _) => frame_of(path, self.station()),
            // On the seam as the grey image shows it, so that both sheets are in view.
            (Step::Slit, Some(aim)) => {
                let ahead = match self.advance {
                    0 => first_section(params),
                    1 if self.slits == 0 => first_section(params) + FURTHER,
                    steps => first_section(params) + ADVANCE * (f32::from(steps) - 0.5 * f32::from(self.views % 2)),
                };
                to_part.inverse() * aside(&aim, [ahead, 0.0, 0.0])
            }
            _ => {
                let along = ENDS.get(usize::from(self.end)).copied().unwrap_or_default();
                aside(&frame_of(path, 0.0), [along, 0.0, 0.0])
            }
        };
        sensor * mount.pose.inverse()
    }

    /// Where along the path the seam is looked for to begin with, m.
    fn station(&self) -> f32 {
        let [along, ..] = SEARCH.get(usize::from(self.place)).copied().unwrap_or_default();
        let away = SECOND.get(usize::from(self.second)).copied().unwrap_or_default();
        match &self.found {
            Some(first) if first.station > ROOM => first.station - away,
            Some(first) => first.station + away,
            None => FIND + along,
        }
    }

    /// Takes a sighting made with the nozzle at `t_b_n`.
    pub fn take(
        &mut self,
        params: &MeasureParams,
        path: &TaughtPath,
        mount: &SensorMount,
        to_part: &mut Pose,
        sighting: &Sighting,
        t_b_n: &Pose,
    ) -> Use {
        if self.asked.is_none() || sighting.look != self.look() || sighting.slit != 0 {
            return Use::Stale;
        }
        self.heard = true;
        if sighting.refusal != 0 {
            self.refused(params, to_part);
            return Use::Refused;
        }
        self.asked = None;
        self.tries = 0;
        let t_b_s = *t_b_n * mount.pose;
        let seen = |station| {
            let point = Vector3::from(sighting.point());
            Section {
                station,
                point: t_b_s * point,
                slit: t_b_s.r * slit_direction(point, sighting, mount),
            }
        };
        if let Step::Survey(section) = self.step {
            self.survey.add(seen(station(section, params, path)));
            self.step = Step::Fit(section + 1);
            return Use::Used;
        }
        self.move_on = true;
        if self.step != Step::Grey {
            let point = t_b_s * Vector3::from(sighting.point());
            let before = |nearest: Vector3<f32>| (point - nearest).dot(&(to_part.r * path.place(0.0).tangent)) < 0.0;
            if self.nearest.is_none_or(before) {
                self.nearest = Some(point);
            }
        }
        if matches!(self.step, Step::Find | Step::Second) {
            return self.find(path, to_part, seen(self.station()));
        }
        let taken = self.looks.take(sighting, mount, &t_b_s);
        if self.step == Step::Grey {
            self.step = Step::Slit;
        } else {
            self.slits += 1;
            self.advance += 1;
        }
        self.viewed = taken.is_err() || self.slits == SLITS;
        if taken.is_ok() { Use::Used } else { Use::Outlier }
    }

    /// One of the first two sections: the part lies so that the path runs through them.
    fn find(&mut self, path: &TaughtPath, to_part: &mut Pose, section: Section) -> Use {
        let Some(first) = self.found else {
            // Off the sensor's height the light meets the seam elsewhere; how far along the part that is cannot be seen in a section.
            let (station, place) = path.project(&(to_part.inverse() * section.point), section.station);
            to_part.p += section.point - *to_part * place.point;
            self.found = Some(Section { station, ..section });
            self.step = Step::Second;
            return Use::Used;
        };
        let [near, far] = if first.station < section.station {
            [first, section]
        } else {
            [section, first]
        };
        match placed(path, &near, &far) {
            Some(motion) => {
                *to_part = motion;
                self.step = Step::Grey;
                Use::Used
            }
            None => {
                self.nearest = None;
                self.search_on(to_part);
                Use::Outlier
            }
        }
    }

    /// What was taken for the seam is none, or there is none here, or its end is not to be seen: to the next place of the search.
    #[inline(never)] // in no hurry
    fn search_on(&mut self, to_part: &mut Pose) {
        *self = Self {
            step: Step::Find,
            place: self.place + 1,
            views: self.views,
            nearest: self.nearest,
            told: self.told,
            hovering: self.hovering,
            start: self.start,
            ..Self::EMPTY
        };
        *to_part = self.told;
        if usize::from(self.place) == SEARCH.len() {
            self.failure = Some(Fault::StartNotFound);
        }
    }

    /// The start pose from one view of the start.
    fn conclude(&mut self, params: &MeasureParams, path: &TaughtPath, mount: &SensorMount, to_part: &mut Pose) {
        let seen = self.looks.frame(mount, params.edge_height, params.bend);
        self.looks = StartLooks::new();
        (self.slits, self.advance, self.step) = (0, 0, Step::Grey);
        self.views += 1;
        let begins = |frame: &StartFrame| {
            let along = frame.pose.r.column(0);
            let first = |nearest: Vector3<f32>| (nearest - frame.pose.p).dot(&along);
            let reach = first_section(params) + FURTHER + NEAR;
            self.nearest
                .map(first)
                .is_some_and(|first| first > -NEAR && first < reach)
        };
        let Some(frame) = seen.ok().filter(begins) else {
            self.failure = (self.views >= VIEWS).then_some(Fault::StartDoubtful);
            // The same image would show the same again.
            self.next_end(to_part);
            return;
        };
        self.end = 0;
        let (before, earlier) = (self.start, self.earlier);
        // Where the sheet is wavy every other view, with its sections in the same places, repeats itself, and the views between say another attitude.
        let wavy = |before: &StartFrame| before.is_at(&frame) && earlier.is_some_and(|earlier| earlier.agrees(&frame));
        let agreeing = before.filter(|before| before.agrees(&frame) || wavy(before));
        let frame = agreeing.map_or(frame, |before| before.mean(&frame));
        *to_part = frame.motion(&path.place(0.0));
        (self.start, self.earlier) = (Some(frame), before);
        if agreeing.is_some() {
            self.survey.begin(frame.pose.p);
            self.step = if params.sections > 0 {
                Step::Survey(0)
            } else {
                Step::Done
            };
        } else if self.views >= VIEWS {
            self.failure = Some(Fault::StartDoubtful);
        }
    }

    /// The end is not to be seen from here: to the next place along the seam, and when there is none left, the seam is something else.
    fn next_end(&mut self, to_part: &mut Pose) {
        self.end += 1;
        if usize::from(self.end) == ENDS.len() {
            self.search_on(to_part);
        }
    }

    /// A look showed nothing.
    fn refused(&mut self, params: &MeasureParams, to_part: &mut Pose) {
        self.asked = None;
        self.tries += 1;
        if self.tries < TRIES {
            return;
        }
        self.tries = 0;
        self.move_on = true;
        match self.step {
            Step::Find => self.search_on(to_part),
            Step::Second => {
                self.second += 1;
                if usize::from(self.second) == SECOND.len() {
                    self.nearest = None;
                    self.search_on(to_part);
                }
            }
            Step::Grey => self.next_end(to_part),
            Step::Slit => {
                self.advance += 1;
                if self.advance == ADVANCES {
                    // No seam where the grey image showed one: it was something else.
                    (self.looks, self.slits, self.advance, self.step) = (StartLooks::new(), 0, 0, Step::Grey);
                    self.next_end(to_part);
                }
            }
            Step::Survey(section) => {
                self.misses += 1;
                self.step = if section + 1 < params.sections {
                    Step::Survey(section + 1)
                } else {
                    Step::Done
                };
                if self.misses > params.sections / MISSED_OF {
                    self.failure = Some(Fault::StartNotFound);
                }
            }
            Step::Fit(_) | Step::Done => {}
        }
    }
}

/// The taught frame of the seam at `station` (m), Σ_B: x along travel, z out of the sheet.
#[inline(never)] // in no hurry
fn frame_of(path: &TaughtPath, station: f32) -> Pose {
    let place = path.place(station);
    Pose {
        r: Matrix3::from_columns(&[place.tangent, place.lateral(), place.normal]),
        p: place.point,
    }
}

/// The frame `by` so much (m) aside in its own directions.
#[inline(never)] // in no hurry
fn aside(frame: &Pose, by: [f32; 3]) -> Pose {
    Pose {
        p: *frame * Vector3::from(by),
        ..*frame
    }
}

/// Distance of the first light section from the seam's start, m.
fn first_section(params: &MeasureParams) -> f32 {
    if params.bend {
        FIRST_SECTION_OF_BEND
    } else {
        FIRST_SECTION
    }
}

/// Where the survey's section number so is looked for, m: evenly from the light sections at the start to the seam's end.
fn station(section: u8, params: &MeasureParams, path: &TaughtPath) -> f32 {
    let first = first_section(params) + ADVANCE * f32::from(SLITS - 1);
    let share = f32::from(section) / f32::from(params.sections.min(SECTIONS as u8).max(2) - 1);
    first + (path.length() - LAST_SECTION - first) * share
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::{length, log, rot_x, rot_z};
    use crate::job::path::Travel;
    use crate::job::start_pose::tests::{SHEET, grey, slit};

    const MOUNT: SensorMount = SensorMount {
        pose: Pose {
            p: Vector3::new(0.080, 0.0, 0.0),
            ..crate::job::start_pose::tests::MOUNT.pose
        },
        ..crate::job::start_pose::tests::MOUNT
    };
    /// Half of what the camera sees at the start, m.
    const VIEW: f32 = 0.027;

    fn path() -> TaughtPath {
        let travel = Travel {
            speed: 0.3,
            acceleration: 2.0,
            centripetal: 3.0,
            turn_rate: 3.0,
            lead: 0.080,
        };
        let straight = |s| ([0.4, 0.2 - s, 0.1], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]);
        TaughtPath::new(0.5, &travel, straight).unwrap()
    }

    fn motion(shift: [f32; 3]) -> Pose {
        Pose {
            r: rot_z(0.03) * rot_x(-0.05),
            p: Vector3::from(shift),
        }
    }

    /// Measures a part that lies moved by `motion` with a camera that sees exactly, but for what `spoil` makes of a sighting; where the part
    /// was placed in the end, or why not, and how many cycles it took beyond the motions.
    fn measure(sections: u8, part: &Pose, mut spoil: impl FnMut(&mut Sighting)) -> (Result<Pose, Fault>, u32) {
        let (path, params) = (
            path(),
            MeasureParams {
                start: true,
                edge_height: SHEET,
                bend: false,
                sections,
            },
        );
        let mount = SensorMount {
            pose: Pose {
                r: Matrix3::identity(),
                ..MOUNT.pose
            },
            ..MOUNT
        };
        let frame = *part * frame_of(&path, 0.0);
        let (mut measure, mut to_part, mut t_b_n) = (Measure::EMPTY, Pose::identity(), Pose::identity());
        let mut due = None;
        for cycle in 0..20_000_u32 {
            let count = (cycle % 240) as u8 + 1;
            match measure.next(&params, &path, &mount, &mut to_part) {
                Ok(Next::Wait) => {}
                Ok(Next::Go(goal)) => t_b_n = goal,
                Ok(Next::Done) => return (Ok(to_part), cycle),
                Err(fault) => return (Err(fault), cycle),
            }
            if measure.exposure(count % 240 + 1) != 0 {
                due = Some((cycle + 4, measure.look()));
            }
            if let Some((_, look)) = due.filter(|(at, _)| *at == cycle) {
                let t_b_s = t_b_n * mount.pose;
                let seen = if look == Look::StartGrey {
                    Some(grey(&frame, &t_b_s))
                } else {
                    slit(&frame, &t_b_s)
                };
                let inside = |s: &Sighting| s.point().iter().all(|m| m.abs() < VIEW);
                let mut sighting = seen.filter(inside).unwrap_or(Sighting {
                    look,
                    refusal: 1,
                    ..Sighting::default()
                });
                spoil(&mut sighting);
                measure.take(&params, &path, &mount, &mut to_part, &sighting, &t_b_n);
            }
        }
        panic!("no end")
    }

    /// How far apart two motions put the path's start and end, m, and turn it, rad.
    fn apart(a: &Pose, b: &Pose) -> (f32, f32) {
        let path = path();
        let off = |s| length(&(*a * path.place(s).point - *b * path.place(s).point));
        (off(0.0).max(off(0.5)), length(&log(&(a.r * b.r.transpose()))))
    }

    #[test]
    fn a_part_20_mm_and_3_degrees_off_is_placed_where_it_lies() {
        for (sections, at_most) in [(0, 0.3e-3), (8, 0.05e-3)] {
            let part = motion([0.018, -0.019, 0.017]);
            let (placed, cycles) = measure(sections, &part, |_| {});
            let (off, turned) = apart(&placed.unwrap(), &part);
            // Of the start alone, the bus resolution over 20 mm is carried 500 mm on.
            assert!(
                off < at_most && turned < 1e-3,
                "{sections} sections: {off} m, {turned} rad"
            );
            assert!(cycles < 700, "{cycles} cycles at rest");
        }
    }

    #[test]
    fn a_start_out_of_view_is_searched_for_and_one_too_far_away_is_refused() {
        let part = motion([0.015, 0.045, 0.0]);
        let (off, _) = apart(&measure(8, &part, |_| {}).0.unwrap(), &part);
        assert!(off < 0.05e-3, "{off} m");
        let (placed, _) = measure(8, &motion([0.0, 0.15, 0.0]), |_| {});
        assert_eq!(placed, Err(Fault::StartNotFound));
    }

    #[test]
    fn a_look_that_is_lost_is_taken_again() {
        let mut looks = 0;
        let part = motion([0.0; 3]);
        let (placed, _) = measure(8, &part, |sighting| {
            looks += 1;
            if looks % 2 != 0 {
                *sighting = Sighting {
                    look: sighting.look,
                    refusal: 1,
                    ..Sighting::default()
                };
            }
        });
        let (off, _) = apart(&placed.unwrap(), &part);
        assert!(off < 0.05e-3, "{off} m");
    }

    #[test]
    fn on_a_wavy_sheet_whose_every_other_view_repeats_itself_the_start_is_between() {
        let (mut view, mut section) = (0, 0);
        let part = motion([0.0; 3]);
        let (placed, _) = measure(8, &part, |sighting| {
            if sighting.look == Look::StartGrey {
                (view, section) = (view + 1, 0);
            } else if view > 0 && section < SLITS {
                // The sections of every other view lie in a sheet that is pitched by 0.4°.
                let pitched = i16::from(section) * if view % 2 == 0 { 84 } else { 0 };
                sighting.point_um[2] += pitched;
                section += 1;
            }
        });
        let (off, _) = apart(&placed.unwrap(), &part);
        assert!(view >= 3 && off < 0.1e-3, "{off} m after {view} views");
    }

    #[test]
    fn a_start_20_mm_too_high_or_too_low_is_found() {
        for height in [0.020, -0.020] {
            let part = motion([-0.019, 0.018, height]);
            let (off, _) = apart(&measure(8, &part, |_| {}).0.unwrap(), &part);
            assert!(off < 0.05e-3, "{off} m at {height} m");
        }
    }

    #[test]
    fn a_corner_is_refused_that_lies_behind_a_section_or_far_before_the_first() {
        // A section was seen 16 mm behind the start.
        for along_um in [20_000, -8000] {
            let (placed, _) = measure(8, &Pose::identity(), |sighting| {
                if sighting.look == Look::StartGrey {
                    match sighting.point_um[0].checked_add(along_um) {
                        Some(moved) => sighting.point_um[0] = moved,
                        None => sighting.refusal = 1,
                    }
                }
            });
            assert!(
                matches!(placed, Err(Fault::StartDoubtful | Fault::StartNotFound)),
                "{along_um} µm: {placed:?}"
            );
        }
    }

    #[test]
    fn views_that_contradict_each_other_are_refused() {
        let mut looks = 0;
        let (placed, _) = measure(8, &motion([0.0; 3]), |sighting| {
            looks += 1;
            if sighting.look == Look::StartGrey {
                sighting.point_um[0] += if looks % 2 == 0 { 400 } else { -400 };
            }
        });
        assert_eq!(placed, Err(Fault::StartDoubtful));
    }
}
