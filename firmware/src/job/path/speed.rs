//! How fast a path may be travelled: capped by its bends and by how fast the tool turns, down to rest at every stop.

use super::{STATIONS, TaughtPath, Travel};
use crate::geometry::rotation::length;
use nalgebra::Vector3;

impl TaughtPath {
    /// Caps the speed by curvature and by the heading's turning, then by braking distance to the next stop, from the end backwards; and along
    /// the run-in so that it rises evenly over all of it: the seam's first centimetres are then seen as densely as the rest. Picking up speed
    /// behind a cap takes as long as whoever follows takes ([`pace`]).
    pub(super) fn limit_speed(&mut self, travel: &Travel) {
        let count = self.count as usize;
        let nominal = travel.speed * travel.speed;
        // The cap of each stretch between two stations, for both of its ends.
        let mut caps = [nominal; STATIONS];
        for (cap, pair) in caps.iter_mut().zip(self.stations.windows(2)).take(count - 1) {
            if let [here, ahead] = pair {
                let change = |a: [f32; 3], b: [f32; 3]| length(&(Vector3::from(b) - Vector3::from(a))) / self.spacing;
                let bend = change(here.tangent, ahead.tangent);
                if bend * nominal > travel.centripetal {
                    *cap = travel.centripetal / bend;
                }
                let turn = change(here.heading, ahead.heading);
                if turn * travel.speed > travel.turn_rate {
                    let slow = travel.turn_rate / turn;
                    *cap = cap.min(slow * slow);
                }
            }
        }
        let mut allowed = 0.0f32; // at rest at the end
        let stops = self
            .corners
            .map(|corner| ((corner.stop - self.first) * self.per_metre + 0.5) as usize);
        for (index, (station, cap)) in self.stations.iter_mut().zip(caps).enumerate().take(count).rev() {
            if stops.contains(&index) {
                allowed = 0.0;
            }
            station.speed_squared = allowed.min(cap);
            allowed = station.speed_squared + 2.0 * travel.acceleration * self.spacing;
        }
        let run_in = (-self.first / self.spacing) as usize;
        for (index, station) in self.stations.iter_mut().take(run_in).enumerate() {
            let risen = nominal * index as f32 / run_in as f32;
            station.speed_squared = station.speed_squared.min(risen);
        }
        // The far end of a capped stretch.
        for (station, cap) in self.stations.iter_mut().take(count).skip(1).zip(caps) {
            station.speed_squared = station.speed_squared.min(cap);
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::SPACING;
    use super::super::tests::{TRAVEL, bent, corner};
    use super::*;
    use proptest::prelude::*;

    /// Change of a direction from one end to the other of a stretch around `s`, rad/m.
    fn rate(path: &TaughtPath, s: f32, direction: impl Fn(f32) -> Vector3<f32>) -> f32 {
        let from = path.first + ((s - path.first) * path.per_metre) as usize as f32 * path.spacing;
        length(&(direction(from + path.spacing) - direction(from))) / path.spacing
    }

    #[test]
    fn the_speed_is_low_enough_for_every_bend_and_to_stop_at_the_end() {
        let path = TaughtPath::new(0.2, &TRAVEL, corner).unwrap();
        let bend = 15f32.to_radians() / SPACING;
        let slowest = (90..110)
            .map(|mm| path.speed_squared(mm as f32 * 1e-3))
            .fold(1.0, f32::min);
        assert!(slowest <= TRAVEL.centripetal / bend * 1.01);
        assert!(
            (path.speed_squared(0.05) - 0.09).abs() < 1e-6,
            "full speed away from the corner"
        );
        assert_eq!(path.speed_squared(path.last()), 0.0);
    }

    proptest! {
        #[test]
        fn no_limit_is_exceeded_and_away_from_all_of_them_none_is_undercut(
            degrees in -90.0f32..90.0, radius in 0.005f32..0.2, speed in 0.1f32..0.4, turn_rate in 1.0f32..4.0,
        ) {
            let travel = Travel { speed, turn_rate, ..TRAVEL };
            let Ok(path) = TaughtPath::new(0.5, &travel, bent(degrees, radius)) else {
                return Ok(()); // too long to be looked at from one stop
            };
            let steps = ((path.last() - path.first) / 1e-3) as usize;
            let stops: std::vec::Vec<f32> = path.corners.iter().map(|corner| corner.stop).chain([path.last()]).collect();
            for step in 0..steps {
                let s = path.first + step as f32 * 1e-3;
                let v = path.speed_squared(s).max(0.0);
                let bend = rate(&path, s, |s| path.course(s).1);
                let turn = rate(&path, s, |s| path.place(s).heading);
                prop_assert!(v <= speed * speed * 1.0001);
                prop_assert!(v * bend <= travel.centripetal * 1.01, "{v} at {s}: bend {bend}");
                prop_assert!(v.sqrt() * turn <= turn_rate * 1.01, "{v} at {s}: turn {turn}");
                let ahead = path.speed_squared(s + 1e-3);
                prop_assert!(v - ahead <= 2.0 * travel.acceleration * 1e-3 * 1.01, "brakes at {s}");
                // What holds it back is a limit somewhere within braking distance, or the run-in: nothing else may.
                let reach = speed * speed / (2.0 * travel.acceleration) + 2.0 * path.spacing;
                let free = s > path.spacing
                    && stops.iter().all(|stop| s < stop - reach || s > stop + path.spacing)
                    && (0..=(reach / 1e-3) as usize).all(|step| {
                        let there = s - path.spacing + step as f32 * 1e-3;
                        let bend = rate(&path, there, |s| path.course(s).1);
                        let turn = rate(&path, there, |s| path.place(s).heading);
                        bend * speed * speed < travel.centripetal && turn * speed < turn_rate
                    });
                prop_assert!(!free || v >= speed * speed * 0.98, "{v} at {s} with nothing in the way");
            }
        }
    }
}
