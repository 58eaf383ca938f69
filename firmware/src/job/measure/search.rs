//! Where the seam is looked for before its start is known: a light section well behind the start as taught, searched for round about and in height;
//! a second one, to say which way it runs; and along it its end. And what those say of a start that was seen later.

use crate::geometry::Pose;
use crate::job::path::TaughtPath;
use crate::job::survey::{Section, placed};
use hal::wire::Wire;
use nalgebra::Vector3;

/// Where the seam is first looked for, along it from the start as taught, m: of a part 20 mm nearer, or as high and so met by the slit's light
/// before its place, the seam is there still.
const FIND: f32 = 0.040;
/// Height over the part as told from which it is first looked for, m: the nozzle, 80 mm behind, is then over one that lies 20 mm higher.
const HIGH: f32 = 0.030;
/// The same of a part that was not in view from there, and so lies lower, m.
const LOW: f32 = 0.002;
/// And of one that was not in view from there either, m.
const LOWER: f32 = -0.014;
/// Round about there, m: along, across and up. The light is in view from 33 mm below to 22 mm above, and 16 mm to either side, and the joint takes
/// 7 mm of that; so the first nine cover 20 mm each way and 5°. A seam that is further than about 45 mm aside is not found. Down only where nothing
/// was seen from above, and further aside not at all: the nozzle may be over the part.
const SEARCH: [[f32; 3]; 14] = [
    [0.0, 0.0, HIGH],
    [0.0, 0.014, HIGH],
    [0.0, -0.014, HIGH],
    [0.0, 0.0, LOW],
    [0.0, 0.014, LOW],
    [0.0, -0.014, LOW],
    [0.0, 0.0, LOWER],
    [0.0, 0.014, LOWER],
    [0.0, -0.014, LOWER],
    [0.0, 0.035, HIGH],
    [0.0, -0.035, HIGH],
    [0.035, 0.0, HIGH],
    [0.035, 0.020, HIGH],
    [0.035, -0.020, HIGH],
];
/// Where the second section is tried, m from the first: toward the start if that is no nearer than this, else away from it; then anywhere else.
const SECOND: [f32; 4] = [0.024, 0.012, -0.012, -0.024];
/// Height over the first from which the second is looked for, m: 5° of slope are 9 mm from the one to the nozzle at the other.
const OVER: f32 = 0.020;
/// See [`SECOND`], m.
const ROOM: f32 = 0.036;
/// Where the seam's end is looked for, along the seam from where it is expected, m: views of 54 mm.
const ENDS: [f32; 5] = [0.0, 0.020, -0.020, 0.040, -0.040];
/// The seam is seen in no section further before its start than this, and in one no further behind it than the first ones are looked for, give or
/// take as much, m: the sheet's slope moves the light by that.
const NEAR: f32 = 0.001;

/// What a section led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// It is the first: where the second is looked for follows from it.
    First,
    /// The part is placed by both.
    Placed,
    /// They show no one seam.
    NoSeam,
}

/// The search.
#[derive(Clone, Debug)]
pub struct Search {
    /// Places of [`SEARCH`], [`SECOND`] and [`ENDS`] that are looked at.
    place: u8,
    second: u8,
    end: u8,
    /// The section that was found first.
    found: Option<Section>,
    /// The seam point nearest to its start of all sections, Σ_B, m: the start is not beyond it.
    nearest: Option<Vector3<f32>>,
    /// Where the part lies as told, from which every place is counted.
    told: Pose,
}

impl Search {
    /// Not begun.
    pub const EMPTY: Self = Self {
        place: 0,
        second: 0,
        end: 0,
        found: None,
        nearest: None,
        told: Pose::EMPTY,
    };

    /// The part lies moved by `told` (Σ_B), as far as is known.
    pub fn begin(&mut self, told: &Pose) {
        self.told = *told;
    }

    /// Where along the path the seam is looked for, m.
    pub fn station(&self) -> f32 {
        let [along, ..] = self.around();
        let away = SECOND.get(usize::from(self.second)).copied().unwrap_or_default();
        match &self.found {
            Some(first) if first.station > ROOM => first.station - away,
            Some(first) => first.station + away,
            None => FIND + along,
        }
    }

    /// And where the sensor is held for that, m ahead, aside and over: as much back as over, since the light falls at 45°; the second time aside
    /// where it was found.
    pub fn aside(&self) -> [f32; 3] {
        let [_, across, up] = self.around();
        let (across, over) = if self.found.is_some() {
            (0.0, OVER)
        } else {
            (across, up)
        };
        [-over, across, over]
    }

    fn around(&self) -> [f32; 3] {
        SEARCH.get(usize::from(self.place)).copied().unwrap_or_default()
    }

    /// Where the end is looked for, m along the seam from the start as it is known.
    pub fn end(&self) -> f32 {
        ENDS.get(usize::from(self.end)).copied().unwrap_or_default()
    }

    /// A section showed the seam at `point` (Σ_B, m); the part lies moved by `to_part`.
    pub fn saw(&mut self, point: &Vector3<f32>, path: &TaughtPath, to_part: &Pose) {
        let along = to_part.r * path.place(0.0).tangent;
        if self.nearest.is_none_or(|nearest| (point - nearest).dot(&along) < 0.0) {
            self.nearest = Some(*point);
        }
    }

    /// Whether the seam may begin at `start` and run along its x axis (Σ_B), the first section being looked for at most `reach` (m) behind it.
    #[inline(never)] // in no hurry
    pub fn begins(&self, start: &Pose, reach: f32) -> bool {
        let along = start.r.column(0);
        let first = self.nearest.map(|nearest| (nearest - start.p).dot(&along));
        first.is_some_and(|first| first > -NEAR && first < reach + NEAR)
    }

    /// One of the first two sections: the part lies moved by `to_part` so that the path runs through them.
    pub fn take(&mut self, path: &TaughtPath, to_part: &mut Pose, section: Section) -> Found {
        let Some(first) = self.found else {
            // Off the sensor's height the light meets the seam elsewhere; how far along the part that is cannot be seen in a section.
            let (station, place) = path.project(&(to_part.inverse() * section.point), section.station);
            to_part.p += section.point - *to_part * place.point;
            self.found = Some(Section { station, ..section });
            return Found::First;
        };
        let [near, far] = if first.station < section.station {
            [first, section]
        } else {
            [section, first]
        };
        match placed(path, &near, &far) {
            Some(motion) => {
                *to_part = motion;
                Found::Placed
            }
            None => {
                self.nearest = None;
                Found::NoSeam
            }
        }
    }

    /// The second section shows nothing here: whether there is another place to look for it. If not, the first one was something else.
    pub fn next_second(&mut self) -> bool {
        self.second += 1;
        let more = usize::from(self.second) < SECOND.len();
        if !more {
            self.nearest = None;
        }
        more
    }

    /// The end shows nothing here: whether there is another place to look for it.
    pub fn next_end(&mut self) -> bool {
        self.end += 1;
        usize::from(self.end) < ENDS.len()
    }

    /// The end is where it was looked for.
    pub fn found_end(&mut self) {
        self.end = 0;
    }

    /// To the next place for the first section, the part lying as told again: whether there is one.
    pub fn on(&mut self, to_part: &mut Pose) -> bool {
        (self.place, self.second, self.end, self.found) = (self.place + 1, 0, 0, None);
        *to_part = self.told;
        usize::from(self.place) < SEARCH.len()
    }
}
