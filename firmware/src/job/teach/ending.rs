//! Where the seam ends, and where it is only lost.
//!
//! A seam ends with its sheet: the slit's light then falls on nothing, and the sensor says of every image that no line runs through it. A lost
//! seam still has a sheet before the sensor: there is a line, but no joint is found on it, or none that follows on. So:
//! - **end**: `VOID_IMAGES` images in a row, over at least `VOID_LENGTH` of the sensor's way, show no line at all;
//! - **lost**: the sensor has gone [`LOST_LENGTH`] past the last point of the seam, and it is not the end.
//!
//! An image that did not come says neither. What this cannot tell: a sheet that is taken away.

use crate::vision::sensor::Refusal;
use hal::camera::NO_IMAGE;

/// Images without any line that make an end.
const VOID_IMAGES: u8 = 3;
/// Length over which they must have been exposed, m: more than a hole for a rivet, less than the sensor may go on unseeing.
const VOID_LENGTH: f32 = 0.010;
/// Length past the last seen point at which the seam is lost, m.
pub const LOST_LENGTH: f32 = 0.045;

/// What a look at the seam was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// On the way, so far as is known.
    Underway,
    /// The seam has ended.
    Ended,
    /// The seam is lost.
    Lost,
}

/// Watches the looks; by default nothing was looked at.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ending {
    /// Images without a line since the last with one, and where the first of them was exposed, m.
    void: u8,
    since: f32,
}

impl Ending {
    /// An image exposed with the sensor at distance `station` (m) came, with this refusal number, zero for a find.
    pub fn looked(&mut self, refusal: u8, station: f32) {
        if refusal == Refusal::NoLine as u8 {
            if self.void == 0 {
                self.since = station;
            }
            self.void = self.void.saturating_add(1);
        } else if refusal != NO_IMAGE {
            self.void = 0;
        }
    }

    /// With the sensor at distance `station`, and the last point of the seam at `seen`, m.
    pub fn judge(&self, station: f32, seen: f32) -> Outcome {
        if self.void >= VOID_IMAGES && station - self.since >= VOID_LENGTH {
            Outcome::Ended
        } else if station - seen > LOST_LENGTH {
            Outcome::Lost
        } else {
            Outcome::Underway
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_but_void_over_ten_millimetres_is_the_end() {
        let mut ending = Ending::default();
        for (station, expected) in [
            (0.500, Outcome::Underway),
            (0.504, Outcome::Underway),
            (0.509, Outcome::Underway),
            (0.511, Outcome::Ended),
        ] {
            ending.looked(Refusal::NoLine as u8, station);
            ending.looked(NO_IMAGE, station);
            assert_eq!(ending.judge(station, 0.498), expected, "at {station} m");
        }
    }

    #[test]
    fn a_line_without_a_joint_is_a_lost_seam() {
        let mut ending = Ending::default();
        let mut station = 0.500;
        while station <= 0.498 + LOST_LENGTH {
            assert_eq!(ending.judge(station, 0.498), Outcome::Underway, "at {station} m");
            station += 0.004;
            ending.looked(Refusal::NoLine as u8, station);
            ending.looked(Refusal::NoStep as u8, station);
        }
        assert_eq!(ending.judge(station, 0.498), Outcome::Lost);
    }
}
