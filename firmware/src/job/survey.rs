//! Where the part lies, from its seam seen at several places: a rigid motion by weighted least squares.
//!
//! A start pose (paper 003, chapter 5) is seen over a few centimetres of seam, and no part is as straight as its drawing: a bend of ±2 mm
//! turns it by degrees, which 300 mm further on are tens of millimetres. Fitted to sections all along the seam, the motion is off by no
//! more than the bend itself, and that is what the corrections are for.

use super::correction::roll;
use super::path::TaughtPath;
use crate::arm::solve_symmetric;
use crate::geometry::Pose;
use crate::geometry::rotation::{exp, length, product, unit};
use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

/// Most sections that a survey keeps.
pub const SECTIONS: usize = 12;

/// Standard deviation of the seam's start as measured, along the seam, m: a pixel. A part that bends does not grow longer.
const START: f32 = 1.2e-4;
/// Standard deviation of a section, or the start, from the rigid part, lateral and in height, m: a wave with a peak of 2 mm.
const BEND: f32 = 1.4e-3;
/// Standard deviation of the sheet's roll in a section, rad: the slope of such a wave, and a slit of a few millimetres.
const SLOPE: f32 = 0.05;
/// Standard deviation of a round's turn, rad: keeps the first sections, near each other, from turning the part about their own line.
const TURN: f32 = 0.1;
/// Rounds of a fit: each leaves the square of the angle that it corrected, so that of 0.1 rad the third leaves nothing.
const ROUNDS: u8 = 3;

/// The seam seen at one place, in Σ_B.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Where along the path it was looked for, m.
    pub station: f32,
    /// Seam point, m.
    pub point: Vector3<f32>,
    /// Direction of the lit line on the sheet, to the left of travel; any length.
    pub slit: Vector3<f32>,
}

/// Shortest distance between two sections that say which way the seam runs, m: over it their noise turns the seam by half a degree.
const BASE: f32 = 0.008;
/// Least sine of the angle between the light's line and the seam: below it would say nothing of the sheet.
const SQUARE: f32 = 0.5;
/// Least cosine of the part's turn, and of its tilt: 15°, beyond which the end's edge is not looked for.
const TURNED: f32 = 0.965;

/// The motion (Σ_B) of a part whose path runs through two sections, the nearer to its start first; `None` where they show no one seam. How far along
/// it lies is as their stations say.
pub fn placed(path: &TaughtPath, near: &Section, far: &Section) -> Option<Pose> {
    let frame = |near: &Vector3<f32>, far: &Vector3<f32>, across: Vector3<f32>| {
        let chord = far - near;
        if length(&chord) < BASE {
            return None;
        }
        let x = unit(&chord)?;
        let across = unit(&across)?;
        let normal = x.cross(&across);
        if length(&normal) < SQUARE {
            return None;
        }
        let z = unit(&normal)?;
        Some(Pose {
            r: Matrix3::from_columns(&[x, z.cross(&x), z]),
            p: *near,
        })
    };
    let taught = [path.place(near.station), path.place(far.station)];
    let [first, second] = &taught;
    let seen = frame(&near.point, &far.point, unit(&near.slit)? + unit(&far.slit)?)?;
    let meant = frame(&first.point, &second.point, first.lateral() + second.lateral())?;
    let upright = |axis| seen.r.column(axis).dot(&meant.r.column(axis)) > TURNED;
    (upright(0) && upright(2)).then(|| seen * meant.inverse())
}

/// The fit, in slices of one section a cycle.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Start of the seam as measured, Σ_B, m: what the part turns about in the fit.
    start: Vector3<f32>,
    sections: Vec<Section, SECTIONS>,
    /// Normal equations of this round, of a shift (m) and a turn about the start (rad); the lower triangle is filled.
    normal: [[f32; 6]; 6],
    right: [f32; 6],
    next: usize,
    rounds: u8,
}

impl Survey {
    /// Nothing seen yet.
    pub const EMPTY: Self = Self {
        start: Vector3::new(0.0, 0.0, 0.0),
        sections: Vec::new(),
        normal: [[0.0; 6]; 6],
        right: [0.0; 6],
        next: 0,
        rounds: 0,
    };

    /// The seam's start is at `start` (Σ_B, m).
    pub fn begin(&mut self, start: Vector3<f32>) {
        *self = Self { start, ..Self::EMPTY };
    }

    /// Adds what was seen at one place; the fit is to be made anew. Past [`SECTIONS`] it is left out.
    pub fn add(&mut self, section: Section) {
        let _ = self.sections.push(section);
        (self.next, self.rounds) = (0, 0);
    }

    /// One slice of the fit; true when `to_part`, the motion (Σ_B) of the part from where it was taught, is the best there is.
    pub fn fit(&mut self, path: &TaughtPath, to_part: &mut Pose) -> bool {
        if self.rounds == ROUNDS {
            return true;
        }
        if self.next == 0 {
            self.open(path, to_part);
        }
        if let Some(section) = self.sections.get(self.next).copied() {
            self.weigh(path, to_part, &section);
            self.next += 1;
            return false;
        }
        let [x, y, z, a, b, c] = solve_symmetric(&self.normal, &self.right);
        let turn = exp(&Vector3::new(a, b, c));
        let from_start = to_part.p - self.start;
        *to_part = Pose {
            r: product(&turn, &to_part.r),
            p: self.start + turn * from_start + Vector3::new(x, y, z),
        };
        self.next = 0;
        self.rounds += 1;
        self.rounds == ROUNDS
    }

    /// Begins a round: the start of the path belongs on the start of the seam, as near as its bend lets it.
    fn open(&mut self, path: &TaughtPath, to_part: &Pose) {
        self.normal = [[0.0; 6]; 6];
        self.right = [0.0; 6];
        for turn in 3..6 {
            self.normal[turn][turn] = 1.0 / (TURN * TURN);
        }
        let place = path.place(0.0);
        let placed = *to_part * place.point;
        let (lever, off) = (placed - self.start, self.start - placed);
        for (axis, sigma) in [(place.tangent, START), (place.lateral(), BEND), (place.normal, BEND)] {
            let direction = to_part.r * axis;
            self.row(&direction, &lever.cross(&direction), off.dot(&direction), sigma);
        }
    }

    /// Adds one section: where it lies beside and over the path, and how its sheet is rolled.
    fn weigh(&mut self, path: &TaughtPath, to_part: &Pose, section: &Section) {
        let back = to_part.inverse();
        let point = back * section.point;
        let (_, place) = path.project(&point, section.station);
        let away = point - place.point;
        let lever = section.point - self.start;
        for axis in [place.lateral(), place.normal] {
            let direction = to_part.r * axis;
            self.row(&direction, &lever.cross(&direction), away.dot(&axis), BEND);
        }
        let tangent = to_part.r * place.tangent;
        self.row(&Vector3::zeros(), &tangent, roll(&place, back.r * section.slit), SLOPE);
    }

    /// Adds one equation: `shift`·δ + `turn`·θ = `residual`, known to `sigma`.
    fn row(&mut self, shift: &Vector3<f32>, turn: &Vector3<f32>, residual: f32, sigma: f32) {
        let weight = 1.0 / (sigma * sigma);
        let row = [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
        for ((normal, right), a) in self.normal.iter_mut().zip(&mut self.right).zip(&row) {
            for (sum, b) in normal.iter_mut().zip(&row) {
                *sum += weight * a * b;
            }
            *right += weight * a * residual;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::{log, rot_x, rot_y, rot_z};
    use crate::geometry::trig::sin_cos;
    use crate::job::path::tests::TRAVEL;

    const RADIUS: f32 = 0.150;

    /// A quarter circle of R150 and a straight of 200 mm, in the plane z = 0.
    fn path() -> TaughtPath {
        let bend = RADIUS * core::f32::consts::FRAC_PI_2;
        let seam = |s: f32| {
            let (sin, cos) = sin_cos(s.min(bend) / RADIUS);
            let on = (s - bend).max(0.0);
            (
                [0.4 + RADIUS * sin, RADIUS * (1.0 - cos) + on, 0.1],
                [cos, sin, 0.0],
                [0.0, 0.0, 1.0],
            )
        };
        TaughtPath::new(bend + 0.2, &TRAVEL, seam).unwrap()
    }

    /// Surveys the part moved by `motion` whose seam lies `bent(s)` beside and over the rigid one, from a placing that knows the start only.
    fn surveyed(motion: &Pose, sections: usize, bent: impl Fn(f32) -> [f32; 2]) -> Pose {
        let path = path();
        let start = *motion * path.place(0.0).point;
        let mut survey = Survey::EMPTY;
        survey.begin(start);
        let mut to_part = Pose {
            p: start - path.place(0.0).point,
            ..Pose::identity()
        };
        for k in 0..sections {
            let station = path.length() * k as f32 / (sections - 1) as f32;
            let place = path.place(station);
            let [lateral, height] = bent(station);
            survey.add(Section {
                station,
                point: *motion * (place.point + place.lateral() * lateral + place.normal * height),
                slit: motion.r * (place.lateral() * 0.02 + place.tangent * 0.003),
            });
            let slices = (1..).take_while(|_| !survey.fit(&path, &mut to_part)).count();
            assert_eq!(
                slices,
                ROUNDS as usize * (k + 2) - 1,
                "one section a slice, and the solution"
            );
        }
        to_part
    }

    fn moved() -> Pose {
        Pose {
            r: rot_z(0.06) * rot_y(-0.05) * rot_x(0.04),
            p: Vector3::new(0.008, -0.009, 0.007),
        }
    }

    #[test]
    fn two_sections_place_a_part_but_none_that_is_turned_too_far_or_seen_twice_at_one_place() {
        let (path, motion) = (path(), moved());
        let section = |station: f32| {
            let place = path.place(station);
            Section {
                station,
                point: motion * place.point,
                slit: motion.r * place.lateral(),
            }
        };
        let (near, far) = (section(0.016), section(0.040));
        let found = placed(&path, &near, &far).unwrap();
        let shift = (found * path.place(0.0).point - motion * path.place(0.0).point)
            .abs()
            .max();
        let turn = log(&(found.r * motion.r.transpose())).abs().max();
        assert!(shift < 1e-5 && turn < 1e-3, "{shift} m, {turn} rad");
        assert!(placed(&path, &near, &section(0.020)).is_none(), "4 mm apart");
        let aside = Section {
            point: far.point + far.slit * 0.010,
            ..far
        };
        assert!(placed(&path, &near, &aside).is_none(), "10 mm aside over 24 mm");
    }

    #[test]
    fn a_rigid_part_is_placed_where_it_lies() {
        let (motion, found) = (moved(), surveyed(&moved(), 6, |_| [0.0; 2]));
        let start = path().place(0.0).point;
        let shift = (found * start - motion * start).abs().max();
        let turn = log(&(found.r * motion.r.transpose())).abs().max();
        assert!(shift < 1e-6 && turn < 1e-5, "{shift} m, {turn} rad");
    }

    #[test]
    fn of_a_bent_part_the_seams_end_is_found_within_the_bend() {
        let wave = |s: f32| {
            let (sin, cos) = sin_cos(s * core::f32::consts::TAU / 0.150);
            [0.002 * sin, 0.002 * (cos - 1.0)]
        };
        let (motion, found) = (moved(), surveyed(&moved(), 8, wave));
        let path = path();
        let (start, end) = (path.place(0.0).point, path.place(path.length()).point);
        let off = |point: Vector3<f32>| found * point - motion * point;
        let along = off(start).dot(&(motion.r * path.place(0.0).tangent)).abs();
        assert!(along < 1e-4, "{along} m along the seam");
        // Off the start, its own tangent, 84 mrad off, would put the end 30 mm aside.
        for point in [start, end] {
            assert!(off(point).abs().max() < 2e-3, "{} m", off(point));
        }
    }
}
