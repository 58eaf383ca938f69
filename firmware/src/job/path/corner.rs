//! Corners: stretches of a path that the sensor cannot see on the way.
//!
//! The sensor is a fixed lead ahead of the nozzle, and the tool can be turned so that it stays over the path: down to a radius of about the lead.
//! Round a sharper corner the sensor comes over the second leg a lead away from the corner, and what lies between is never under it; nor
//! does it see a seam that runs along the slit. So the path has a stop before that stretch, where the bead is interrupted, and from which
//! the sensor is led over the stretch itself ([`crate::job::round`]) before the nozzle goes there.

use super::{PathError, TaughtPath};
use crate::geometry::rotation::length;
use hal::wire_struct;
use nalgebra::Vector3;

/// Most stops on a path.
pub const CORNERS: usize = 4;

/// Longest stretch that is looked at from one stop, m: what the corrections' store holds, and two leads.
pub const UNSEEN: f32 = 0.160;

/// Furthest that the path may lie beside the middle of the view, m: the view reaches 15 mm, parts lie up to 3 mm off it, and the sensor wants 2 mm beside
/// the seam.
const VIEW: f32 = 0.010;

/// Cosine of the largest angle between the path and the sensor's axis at which the path counts as seen, 25°: R150 is seen at 16°.
const ASLANT: f32 = 0.906;

/// A shorter stretch unseen needs no stop, m: the corrections lead over it, as over a lost burst.
const LEAP: f32 = 0.020;

/// The stop lies this far before the last place that is seen on the way, m: half of what the nozzle does between two bursts, of which the last may
/// have come to nothing.
const BEFORE: f32 = 0.015;

/// A path bent more than this counts as tight, 1/m: its deviation changes too fast there for the corrections' ordinary window.
const TIGHT: f32 = 20.0;

/// A corner of a path, all m along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Where the nozzle stops: a station.
    pub stop: f32,
    /// Where the tight bend begins and ends.
    pub bend: [f32; 2],
    /// From here on the sensor sees the path again on the way.
    pub end: f32,
}

wire_struct!(Corner {
    stop: f32,
    bend: [f32; 2],
    end: f32
});

impl Corner {
    /// Beyond every path.
    pub const NONE: Self = Self {
        stop: f32::INFINITY,
        bend: [f32::INFINITY; 2],
        end: f32::INFINITY,
    };
}

impl TaughtPath {
    /// Where the nozzle is to halt next, at `s` or beyond (m): at a corner, or at the end of the run-out.
    pub fn halt(&self, s: f32) -> f32 {
        let next = self.corners.iter().find(|corner| corner.stop >= s);
        next.map_or(self.last(), |corner| corner.stop.min(self.last()))
    }

    /// The corner whose stop is `halt`, as [`Self::halt`] gives it.
    pub fn corner(&self, halt: f32) -> Option<&Corner> {
        self.corners.iter().find(|corner| corner.stop == halt)
    }

    /// How far sightings on the way to `halt` count, m: beyond a corner's stop the sensor sees patches at best.
    pub fn horizon(&self, halt: f32) -> f32 {
        self.corner(halt).map_or(self.last(), |corner| corner.stop + BEFORE)
    }

    /// Distance from `s` to the nearest tight bend, m; zero within it.
    #[inline(never)] // wanted in four places, a few times a second
    pub fn from_bend(&self, s: f32) -> f32 {
        let mut nearest = f32::INFINITY;
        for Corner {
            bend: [first, last], ..
        } in &self.corners
        {
            // Whichever side it lies on, the other difference is negative.
            let away = if *first > s { first - s } else { s - last };
            nearest = if away < nearest { away } else { nearest };
        }
        if nearest > 0.0 { nearest } else { 0.0 }
    }

    /// The corners, for a sensor `lead` (m) ahead, its headings being settled.
    pub(super) fn find_corners(&self, lead: f32) -> Result<[Corner; CORNERS], PathError> {
        let mut corners = [Corner::NONE; CORNERS];
        let mut places = corners.iter_mut();
        let mut seen = 0.0f32;
        for index in 0..self.count as usize {
            let Some(there) = self.under_sensor(self.station(index), lead) else {
                continue;
            };
            if there - seen > LEAP && seen < self.length {
                if there - seen > UNSEEN {
                    return Err(PathError::Unseen(seen, there));
                }
                let place = places.next().ok_or(PathError::TooManyCorners)?;
                let before = ((seen - BEFORE - self.first) * self.per_metre).max(0.0) as usize;
                *place = Corner {
                    stop: self.station(before),
                    bend: self.tight(seen - BEFORE, there),
                    end: there,
                };
            }
            seen = seen.max(there);
        }
        Ok(corners)
    }

    /// The place that the sensor sees with the nozzle at `s`, m.
    fn under_sensor(&self, s: f32, lead: f32) -> Option<f32> {
        let here = self.place(s);
        let side = here.normal.cross(&here.heading);
        let there = self.reach(s, lead, |far| (far - here.point).dot(&here.heading))?;
        let (_, tangent) = self.course(there.station);
        let beside = (there.point - here.point).dot(&side);
        (beside.abs() <= VIEW && tangent.dot(&here.heading) >= ASLANT).then_some(there.station)
    }

    /// First and last place between `from` and `to` (m) where the path is tight; at infinity if it is nowhere.
    fn tight(&self, from: f32, to: f32) -> [f32; 2] {
        let mut bend = Corner::NONE.bend;
        for (index, pair) in self.stations.windows(2).take(self.count as usize - 1).enumerate() {
            let s = self.station(index);
            if let [a, b] = pair
                && s >= from
                && s < to
                && length(&(Vector3::from(b.tangent) - Vector3::from(a.tangent))) > TIGHT * self.spacing
            {
                bend = [bend[0].min(s), s + self.spacing];
            }
        }
        bend
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::tests::{TRAVEL, arc, bent};
    use super::*;
    use std::vec::Vec;

    fn stops(path: &TaughtPath) -> Vec<Corner> {
        path.corners
            .iter()
            .filter(|corner| corner.stop < path.last())
            .copied()
            .collect()
    }

    #[test]
    fn a_half_circle_of_150_mm_and_a_corner_of_15_degrees_are_seen_on_the_way() {
        let half_circle = TaughtPath::new(0.45, &TRAVEL, arc).unwrap();
        assert_eq!(stops(&half_circle), []);
        let corner = TaughtPath::new(0.4, &TRAVEL, bent(15.0, 0.005)).unwrap();
        assert_eq!(stops(&corner), []);
        assert_eq!(corner.halt(0.0), corner.last());
    }

    #[test]
    fn before_a_corner_of_90_degrees_the_nozzle_stops_where_the_sensor_has_seen_the_seam() {
        for degrees in [45.0, 60.0, -90.0, 90.0] {
            let path = TaughtPath::new(0.4, &TRAVEL, bent(degrees, 0.005)).unwrap();
            let found = stops(&path);
            let [corner] = found[..] else {
                panic!("{found:?} at {degrees}°")
            };
            // The bend begins at 0.2 m.
            assert!((0.15..0.2).contains(&corner.stop), "{corner:?} at {degrees}°");
            assert!((0.23..0.29).contains(&corner.end), "{corner:?} at {degrees}°");
            std::println!("{degrees} {corner:?}");
            let turned = 0.005 * f32::to_radians(degrees).abs();
            let [from, to] = corner.bend;
            assert!(
                (from - 0.2).abs() < 4e-3 && (to - 0.2 - turned).abs() < 4e-3,
                "{corner:?}"
            );
            assert_eq!(path.halt(0.0), corner.stop);
            assert_eq!(path.corner(path.halt(0.0)), Some(&corner));
            assert_eq!(path.halt(corner.stop + 1e-4), path.last());
            assert_eq!(path.from_bend(0.5 * (from + to)), 0.0, "{corner:?}");
            assert!((path.from_bend(from - 0.03) - 0.03).abs() < 1e-6);
            assert!(path.speed_squared(corner.stop) < 1e-6);
        }
    }

    #[test]
    fn a_stretch_that_is_too_long_to_be_looked_at_from_one_stop_is_refused() {
        let spiral = TaughtPath::new(0.6, &TRAVEL, bent(300.0, 0.050));
        assert!(
            matches!(spiral, Err(PathError::Unseen(from, to)) if from < to),
            "{:?}",
            spiral.err()
        );
    }
}
