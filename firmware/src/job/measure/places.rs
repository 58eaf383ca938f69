//! Where the sensor is held for each look.

use super::{Measure, MeasureParams, Step};
use crate::geometry::Pose;
use crate::job::mount::SensorMount;
use crate::job::path::TaughtPath;
use crate::job::start_pose::{SLITS, rolled};
use crate::job::survey::SECTIONS;
use nalgebra::{Matrix3, Vector3};

/// Distance of the first light section from the seam's start, m: as near as the sheet's corner and 3° of yaw allow, because the corner's height is
/// taken from there.
const FIRST_SECTION: f32 = 0.0025;
/// The same of a bend: its flanks rise toward the light, which meets them before it meets the seam, and the first centimetre of them must be lit.
const FIRST_SECTION_OF_BEND: f32 = 0.003;
/// And, where nothing is seen there, so much further, m: a start of which neither is seen lies elsewhere.
pub(super) const FURTHER: f32 = 0.0015;
/// Distance from one section to the next, m; every other view has all but the first half as much nearer, and so other waves under them.
const ADVANCE: f32 = 0.012;
/// Where a section before the start must show no seam, and one behind it must show it, m from there: the light is a millimetre wide, and the sheet's
/// height, which moves it, is known to a tenth of that.
const BEFORE: f32 = 0.0009;
/// See [`BEFORE`].
const BEHIND: f32 = 0.0012;
/// Sine of the sensor's roll in a grey image: 10°. Looked at squarely a sheet mirrors the light about the lens into it, right where the corner is held;
/// from 10° aside it does that 26 mm beside the seam, at the image's border.
const ROLL: f32 = 0.1736;
/// Height of the nozzle over the seam in the survey, m: over what the part may be bent, and what a motion between two sections sags.
const LIFT: f32 = 0.010;
/// Distance of the last section from the seam's end, m: clear of the sheet's corner.
const LAST_SECTION: f32 = 0.015;

impl Measure {
    /// The nozzle's pose over the taught part for the next look; the part lies moved by `to_part`.
    pub(super) fn view(&self, params: &MeasureParams, path: &TaughtPath, mount: &SensorMount, to_part: &Pose) -> Pose {
        let beside = |along: f32| aside(&frame_of(path, 0.0), [along, 0.0, 0.0]);
        let sensor = match (self.step, self.looks.aim(self.roll(params))) {
            (Step::Survey(section), _) => {
                let station = station(section, params, path);
                return path.place(station - mount.pose.p.x).nozzle(0.0, LIFT, 0.0);
            }
            (Step::Find | Step::Second, _) => {
                let sensor = frame_of(path, self.search.station());
                aside(&sensor, self.search.aside())
            }
            // On the seam as the grey image shows it, so that both sheets are in view.
            (Step::Slit, Some(aim)) => {
                let ahead = match self.advance {
                    0 => first_section(params),
                    1 if self.looks.sections() == 0 => first_section(params) + FURTHER,
                    steps => first_section(params) + ADVANCE * (f32::from(steps) - 0.5 * f32::from(self.views % 2)),
                };
                to_part.inverse() * aside(&aim, [ahead, 0.0, 0.0])
            }
            (Step::Before, _) => beside(-BEFORE - self.light),
            (Step::Behind, _) => beside(BEHIND - self.light),
            _ => rolled(&beside(self.search.end()), self.roll(params)),
        };
        sensor * mount.pose.inverse()
    }

    /// Sine of the sensor's roll in this view's grey image: to one side of the seam and the other in turn.
    pub(super) fn roll(&self, params: &MeasureParams) -> f32 {
        match (params.bend, self.views % 2) {
            (true, _) => 0.0,
            (false, 0) => ROLL,
            (false, _) => -ROLL,
        }
    }
}

/// The taught frame of the seam at `station` (m), Σ_B: x along travel, z out of the sheet.
#[inline(never)] // in no hurry
pub(super) fn frame_of(path: &TaughtPath, station: f32) -> Pose {
    let place = path.place(station);
    Pose {
        r: Matrix3::from_columns(&[place.tangent, place.lateral(), place.normal]),
        p: place.point,
    }
}

/// The frame `by` so much (m) aside in its own directions.
#[inline(never)] // in no hurry
pub(super) fn aside(frame: &Pose, by: [f32; 3]) -> Pose {
    Pose {
        p: *frame * Vector3::from(by),
        ..*frame
    }
}

/// Distance of the first light section from the seam's start, m.
pub(super) fn first_section(params: &MeasureParams) -> f32 {
    if params.bend {
        FIRST_SECTION_OF_BEND
    } else {
        FIRST_SECTION
    }
}

/// Where the survey's section number so is looked for, m: evenly from the light sections at the start to the seam's end.
pub(super) fn station(section: u8, params: &MeasureParams, path: &TaughtPath) -> f32 {
    let first = first_section(params) + ADVANCE * f32::from(SLITS as u8 - 1);
    let share = f32::from(section) / f32::from(params.sections.min(SECTIONS as u8).max(2) - 1);
    first + (path.length() - LAST_SECTION - first) * share
}
