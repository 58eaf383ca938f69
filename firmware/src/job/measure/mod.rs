//! Measures where the part lies before it is sealed: its start pose, twice, then sections along the seam (paper 003, chapter 5).
//!
//! First the seam is found by the slit's light, which a grey image's scratches and shadows do not look like: see `search`. Held over the start
//! as those sections place it, with the seam along the image's middle, the sensor sees the seam's end in a grey image, and in light sections a
//! little further on the sheet's attitude. From what they say it is held over the real start and looks again, which takes off what the first
//! view's slant left; and again, while two views do not agree or what they state of their own errors does not suffice. The grey images are taken
//! from 10° to either side in turn, since a sheet that is looked at squarely mirrors the light. Two sections prove the start: right before it there is
//! no seam, and right behind it there is, which also says how high it is. Then the [`Survey`]: the
//! seam is looked at along its length, so that a bend near the start does not turn the whole path.
//!
//! Everything is looked at from rest, and one look is asked for at a time.

mod places;
mod search;

use super::mount::SensorMount;
use super::path::TaughtPath;
use super::start_pose::{SLITS, StartFrame, StartLooks};
use super::survey::{Section, Survey};
use crate::fault::Fault;
use crate::geometry::Pose;
use crate::job::correction::Use;
use hal::camera::NO_IMAGE;
use hal::process::{Look, Sighting};
use hal::wire_struct;
use nalgebra::Vector3;
use places::{FURTHER, first_section, station};
use search::{Found, Search};

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
/// Light sections tried before the view is given up.
const ADVANCES: u8 = 6;
/// What a section next to the start shows lies on the seam as measured, m to either side, or is a dent.
const ON_SEAM: f32 = 0.5e-3;
/// And so far over or under it: three standard deviations of both.
const OVER: f32 = 0.2e-3;
/// Share of its height over the start as measured by which the start is higher: the start's height is known to 0.035 mm, its own to 0.04 mm, and the
/// sheet's slope is 20e-3.
const OVER_START: f32 = 0.4;
/// Height over the first view from which the arm comes down to it, m.
const HOVER: f32 = 0.040;
/// Of so many sections one may be missed.
const MISSED_OF: u8 = 3;
/// What is to be measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasureParams {
    /// Anything at all; else the start pose is as it is told.
    pub start: bool,
    /// Height over the seam's sheet of the edge that a grey image shows, m: the upper sheet's thickness for a lap joint, else 0.
    pub edge_height: f32,
    /// The seam is a bend's.
    pub bend: bool,
    /// Sections of the survey, 0 for none (the paper's way) or 2..=[`super::survey::SECTIONS`].
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
    /// Nothing: all of a view is seen, and what it says of the start comes in a cycle of its own.
    Viewed,
    /// A light section before the start, where no seam is to be seen.
    Before,
    /// One right behind it, where it is.
    Behind,
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
    search: Search,
    /// Views of the start that were taken.
    views: u8,
    /// Light sections of this view that were tried.
    advance: u8,
    /// How far ahead of Σ_S's origin the light shows a seam that lies in z = 0, m, as the last section did: what mounting leaves of the slit, and
    /// an edge stands before its foot in the light.
    light: f32,
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
    tries: u8,
    /// One of them was answered.
    answered: bool,
    misses: u8,
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
        search: Search::EMPTY,
        views: 0,
        advance: 0,
        light: 0.0,
        hovering: false,
        move_on: true,
        settle: 0,
        asked: None,
        since: 0,
        heard: false,
        tries: 0,
        answered: false,
        misses: 0,
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
            Step::Find | Step::Second | Step::Slit | Step::Before | Step::Behind | Step::Survey(_) => Look::StartSlit,
            Step::Viewed | Step::Fit(_) | Step::Done => Look::Dark,
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
        match self.step {
            Step::Viewed => {
                self.conclude(params, path, mount, to_part);
                return Ok(Next::Wait);
            }
            Step::Fit(section) => {
                if self.survey.fit(path, to_part) {
                    self.survey_from(section, params);
                }
                return Ok(Next::Wait);
            }
            Step::Done => return Ok(Next::Done),
            _ => {}
        }
        if self.move_on {
            let mut goal = *to_part * self.view(params, path, mount, to_part);
            if !self.hovering {
                self.hovering = true;
                self.search.begin(to_part);
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
            self.answered |= sighting.refusal != NO_IMAGE;
            self.refused(params, to_part);
            return Use::Refused;
        }
        self.asked = None;
        (self.tries, self.answered) = (0, false);
        self.move_on = true;
        let t_b_s = *t_b_n * mount.pose;
        let point = Vector3::from(sighting.point());
        let seen = |station| Section {
            station,
            point: t_b_s * point,
            slit: t_b_s.r * mount.slit_direction(point, sighting),
        };
        match self.step {
            Step::Survey(section) => {
                self.survey.add(seen(station(section, params, path)));
                self.step = Step::Fit(section + 1);
                return Use::Used;
            }
            Step::Before | Step::Behind => return self.prove(params, path, &(t_b_s * point), to_part),
            Step::Find | Step::Second => {
                let section = seen(self.search.station());
                self.search.saw(&section.point, path, to_part);
                return self.find(path, to_part, section);
            }
            Step::Slit => {
                let [tan_slit, lean] = mount.slit_slopes;
                self.light = point.x + point.z * tan_slit + point.y * lean;
                self.search.saw(&(t_b_s * point), path, to_part);
            }
            _ => {}
        }
        let taken = self.looks.take(sighting, mount, &t_b_s);
        let mut over = taken.is_err();
        if self.step == Step::Grey {
            self.step = Step::Slit;
            // Where the seam was seen before it, it does not begin: no section is looked for behind it, where the nozzle would come to the sheets.
            let aim = self.looks.aim(self.roll(params));
            over |= !aim.is_some_and(|aim| self.search.begins(&aim, f32::INFINITY));
        } else {
            self.advance += 1;
        }
        if over || self.looks.sections() == SLITS {
            self.step = Step::Viewed;
        }
        if taken.is_ok() { Use::Used } else { Use::Outlier }
    }

    /// One of the first two sections: the part lies so that the path runs through them.
    fn find(&mut self, path: &TaughtPath, to_part: &mut Pose, section: Section) -> Use {
        self.step = match self.search.take(path, to_part, section) {
            Found::First => Step::Second,
            Found::Placed => Step::Grey,
            Found::NoSeam => {
                self.search_on(to_part);
                return Use::Outlier;
            }
        };
        Use::Used
    }

    /// What was taken for the seam is none, or there is none here, or its end is not to be seen: to the next place of the search.
    #[inline(never)] // in no hurry
    fn search_on(&mut self, to_part: &mut Pose) {
        self.begin_view();
        self.earlier = None;
        self.step = Step::Find;
        if !self.search.on(to_part) {
            self.failure.get_or_insert(Fault::StartNotFound);
        }
    }

    /// Nothing is seen of a view yet.
    fn begin_view(&mut self) {
        self.looks = StartLooks::new();
        (self.advance, self.step, self.move_on) = (0, Step::Grey, true);
    }

    /// The start pose from one view of the start.
    #[inline(never)] // in no hurry, as whatever is done at rest
    fn conclude(&mut self, params: &MeasureParams, path: &TaughtPath, mount: &SensorMount, to_part: &mut Pose) {
        let seen = self.looks.frame(mount, params.edge_height);
        self.begin_view();
        self.views += 1;
        let reach = first_section(params) + FURTHER;
        let Some(frame) = seen.ok().filter(|frame| self.search.begins(&frame.pose, reach)) else {
            self.doubt(to_part);
            return;
        };
        self.search.found_end();
        let (before, earlier) = (self.start, self.earlier);
        // Where the sheet is wavy every other view, with its sections in the same places, repeats itself, and the views between say another attitude.
        let wavy = |before: &StartFrame| before.is_at(&frame) && earlier.is_some_and(|earlier| earlier.agrees(&frame));
        let agreeing = before.filter(|before| before.agrees(&frame) || wavy(before));
        let frame = agreeing.map_or(frame, |before| before.mean(&frame));
        let sure = agreeing.is_some() && frame.is_sure();
        *to_part = frame.motion(&path.place(0.0));
        (self.start, self.earlier) = (Some(frame), before);
        if sure {
            self.step = Step::Before;
        } else if self.views >= VIEWS {
            self.failure = Some(Fault::StartDoubtful);
        }
    }

    /// What a section next to the start shows: before it a seam, so that it lies elsewhere, or something beside it; behind it the seam.
    fn prove(&mut self, params: &MeasureParams, path: &TaughtPath, point: &Vector3<f32>, to_part: &mut Pose) -> Use {
        let behind = self.step == Step::Behind;
        let on_seam = |start: &mut StartFrame| {
            let off = point - start.pose.p;
            let (aside, over) = (start.pose.r.column(1).dot(&off), start.pose.r.column(2).dot(&off));
            if behind {
                start.pose.p += start.pose.r.column(2) * (OVER_START * over);
                *to_part = start.motion(&path.place(0.0));
            }
            aside.abs() <= ON_SEAM && over.abs() <= OVER
        };
        let on_seam = self.start.as_mut().is_some_and(on_seam);
        self.proven(on_seam, params, to_part);
        if on_seam { Use::Used } else { Use::Outlier }
    }

    /// A section next to the start shows the seam, or none.
    #[inline(never)] // in no hurry
    fn proven(&mut self, seam: bool, params: &MeasureParams, to_part: &mut Pose) {
        match (self.step, seam) {
            // Of a bend too little is lit right behind its start: see [`FIRST_SECTION_OF_BEND`].
            (Step::Before, false) if !params.bend => self.step = Step::Behind,
            (Step::Before, false) | (Step::Behind, true) => {
                if let Some(start) = &self.start {
                    self.survey.begin(start.pose.p);
                }
                self.survey_from(0, params);
            }
            _ => {
                // The views agreed on something else.
                (self.start, self.earlier) = (None, None);
                self.begin_view();
                self.doubt(to_part);
            }
        }
    }

    /// The survey's section number so, if there are as many.
    fn survey_from(&mut self, section: u8, params: &MeasureParams) {
        self.step = if section < params.sections {
            Step::Survey(section)
        } else {
            Step::Done
        };
        self.move_on = true;
    }

    /// A view shows no start that could be: the same image would show the same again.
    fn doubt(&mut self, to_part: &mut Pose) {
        if self.views >= VIEWS {
            self.failure = Some(Fault::StartDoubtful);
        }
        self.next_end(to_part);
    }

    /// The end is not to be seen from here: to the next place along the seam, and when there is none left, the seam is something else.
    fn next_end(&mut self, to_part: &mut Pose) {
        if !self.search.next_end() {
            self.search_on(to_part);
        }
    }

    /// A look showed nothing.
    #[inline(never)] // in no hurry
    fn refused(&mut self, params: &MeasureParams, to_part: &mut Pose) {
        self.asked = None;
        self.tries += 1;
        if self.tries < TRIES {
            return;
        }
        let answered = core::mem::take(&mut self.answered);
        self.tries = 0;
        self.move_on = true;
        match self.step {
            Step::Find => self.search_on(to_part),
            Step::Second => {
                if !self.search.next_second() {
                    self.search_on(to_part);
                }
            }
            Step::Grey => self.next_end(to_part),
            Step::Slit => {
                self.advance += 1;
                if self.advance == ADVANCES {
                    // No seam where the grey image showed one: it was something else.
                    self.begin_view();
                    self.next_end(to_part);
                }
            }
            // Where no image came at all, nothing is proven: a seam before the start cannot be ruled out.
            Step::Before => self.proven(!answered, params, to_part),
            Step::Behind => self.proven(false, params, to_part),
            Step::Survey(section) => {
                self.misses += 1;
                self.survey_from(section + 1, params);
                if self.misses > params.sections / MISSED_OF {
                    self.failure = Some(Fault::StartNotFound);
                }
            }
            Step::Viewed | Step::Fit(_) | Step::Done => {}
        }
    }
}

#[cfg(test)]
mod tests;
