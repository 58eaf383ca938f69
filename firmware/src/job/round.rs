//! Looking round a corner: the nozzle has stopped before it, and the sensor is led over what it cannot see from the path.
//!
//! Straight up from the stop, back until the sensor stands over it, then along the seam round the corner with the sensor where the nozzle
//! will come: square to the seam and raised, so that nothing is touched; back to the stop, and down. What the sensor saw is corrected for as
//! ever ([`super::correction`]). While the tool turns, the nozzle swings about the bend at the sensor's distance: how fast
//! that may be, limits the speed along the seam.

use super::path::TaughtPath;
use super::path::corner::Corner;
use super::seal::PERIOD;
use super::stance::Stance;
use crate::geometry::Pose;
use crate::geometry::rotation::{length, unit};
use crate::geometry::trig::sqrt;
use crate::servo::hold::Channels;
use hal::wire::Wire;
use hal::wire_struct;

/// The sensor stands square to the chord over this much to either side, m: a right angle is turned over 24 mm, and R5 seen within 25° of square.
const EASING: f32 = 0.004;

/// Turns this far ahead already count for the speed, m: braking distance from 0.15 m/s.
const FORESIGHT: f32 = 0.008;

/// Distance between exposures, m: eighteen sightings, as many as are kept, reach over the window of a tight bend.
const PITCH: f32 = 0.0008;

/// The stretch is looked at this far beyond where the sensor sees the path again on the way, m.
const BEYOND: f32 = 0.010;

/// With all of it seen, corrections up to this far from the end of the stretch are due, m.
const LEFT: f32 = 0.030;

/// Least speed, m/s, and what is left of the way when it counts as done, m.
const CREEP: f32 = 0.002;
const ARRIVED: f32 = CREEP * PERIOD;

/// How it is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundParams {
    /// How the tool is held.
    pub stance: Stance,
    /// Highest speed of the place that is looked at, m/s.
    pub speed: f32,
    /// Its acceleration and braking, m/s².
    pub acceleration: f32,
    /// Highest rate at which the tool is turned, rad/s.
    pub turn_rate: f32,
}

wire_struct!(RoundParams {
    stance: Stance,
    speed: f32,
    acceleration: f32,
    turn_rate: f32
});

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leg {
    /// Straight up from the stop.
    Up,
    /// To where the sensor stands over the stop.
    Back,
    /// The sensor goes along the seam.
    Along,
    /// To over the stop.
    Home,
    /// Down to it.
    Down,
}

/// One look round a corner.
#[derive(Clone, Debug)]
pub struct Round {
    /// What is being done.
    pub leg: Leg,
    corner: Corner,
    lead: f32,
    /// Where the slit meets the path: reference stations of this cycle, the next and the one after, m.
    looks: [f32; 3],
    speed: f32,
    /// Where it was at the last exposure, m.
    exposed: f32,
}

impl Round {
    /// None.
    pub const EMPTY: Self = Self {
        exposed: 0.0,
        ..Self::at(Corner::EMPTY, 0.0)
    };

    /// About to leave the stop of `corner`, with the sensor `lead` (m) ahead of the nozzle.
    pub const fn at(corner: Corner, lead: f32) -> Self {
        Self {
            leg: Leg::Up,
            corner,
            lead,
            looks: [corner.stop; 3],
            speed: 0.0,
            exposed: f32::NEG_INFINITY,
        }
    }

    /// Station where the nozzle stopped, m.
    pub fn stop(&self) -> f32 {
        self.corner.stop
    }

    /// Station in this cycle of a nozzle that would have the sensor where it is a lead ahead on the path, m.
    pub fn station(&self) -> f32 {
        self.looks[0] - self.lead
    }

    /// Up to here corrections are due with the nozzle elsewhere, m: nowhere, while more is still to be seen.
    pub fn due(&self) -> f32 {
        match self.leg {
            Leg::Home | Leg::Down => self.corner.end - LEFT,
            Leg::Up | Leg::Back | Leg::Along => f32::MIN,
        }
    }

    /// The sensor's way was braked to a stop.
    pub fn is_still(&self) -> bool {
        self.speed <= 0.0
    }

    /// One cycle further along the seam; true at its end. `advance` false brakes.
    pub fn go(&mut self, params: &RoundParams, path: &TaughtPath, advance: bool) -> bool {
        let [_, next, here] = self.looks;
        let left = self.corner.end + BEYOND - here;
        if left < ARRIVED {
            self.looks = [next, here, here];
            return advance;
        }
        let change = params.acceleration * PERIOD;
        self.speed = if advance {
            let (_, behind) = path.course(here - EASING);
            let (_, ahead) = path.course(here + EASING + FORESIGHT);
            // The chord over twice the easing turns as fast as the directions at its ends differ.
            let turning = length(&(ahead - behind)) * (0.5 / EASING);
            let brake = sqrt(2.0 * params.acceleration * left);
            (self.speed + change)
                .min(params.speed)
                .min(brake)
                .min(params.turn_rate / turning.max(1e-3))
                .max(CREEP)
        } else {
            (self.speed - change).max(0.0)
        };
        self.looks = [next, here, here + self.speed * PERIOD];
        false
    }

    /// Where the nozzle is to be for that, on the path as taught with the `correction` (lateral and height, m) of the stop: T_b_n.
    pub fn pose(&self, params: &RoundParams, path: &TaughtPath, [lateral, height, _]: Channels) -> Pose {
        let [_, _, here] = self.looks;
        let place = path.place(here);
        let chord = path.course(here + EASING).0 - path.course(here - EASING).0;
        let flat = chord - place.normal * chord.dot(&place.normal);
        let x = unit(&flat).unwrap_or(place.tangent);
        let there = place.point + place.lateral() * lateral + place.normal * height;
        params.stance.over(&there, &x, &place.normal, 1.0)
    }

    /// The next exposure is due at the next SYNC.
    pub fn is_due(&self) -> bool {
        let [_, next, _] = self.looks;
        self.leg == Leg::Along && next - self.exposed >= PITCH
    }

    /// That exposure was commanded.
    pub fn exposed(&mut self) {
        [_, self.exposed, _] = self.looks;
    }
}
