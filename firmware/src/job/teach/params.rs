//! What a teaching job is told before it starts.

use crate::geometry::Pose;
use crate::job::access::AccessParams;
use crate::job::mount::SensorMount;
use crate::job::stance::Stance;
use hal::{wire_enum, wire_struct};
use nalgebra::Vector3;

/// Distance from the seam's start at which the sensor takes its first look, m: all of its slits, which are up to 11 mm ahead, are still before
/// the sheet's edge, by more than a start pose's error and a sheet 2 mm too low.
const FIRST_LOOK: f32 = -0.015;

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
    /// Rise of each flank of a bend over its valley, as a tangent; zero where sheets lie on or beside each other.
    pub flank: f32,
    /// How the tool is held while the other leg of a seam is looked for.
    pub search: Stance,
    /// Cycles from one exposure to the next.
    pub vision_period: u8,
    /// Speed along the seam, m/s.
    pub speed: f32,
    /// Acceleration and braking along the seam, m/s².
    pub acceleration: f32,
    /// How the arm comes and goes.
    pub access: AccessParams,
}

wire_struct!(TeachParams {
    law: Law,
    start: Pose,
    mount: SensorMount,
    flank: f32,
    search: Stance,
    vision_period: u8,
    speed: f32,
    acceleration: f32,
    access: AccessParams,
});

impl TeachParams {
    /// Distance from tip to sensor, m.
    pub(super) fn lead(&self) -> f32 {
        self.mount.pose.p.x
    }

    /// Distance of the nozzle from the seam's start, m, at which the sensor takes its first look; negative is before it.
    pub(super) fn first_station(&self) -> f32 {
        FIRST_LOOK - self.lead()
    }

    /// Pose of the nozzle at that distance `station` (m) along the direction in which the operator placed it, T_b_n.
    pub(super) fn straight(&self, station: f32) -> Pose {
        let along = Pose {
            p: Vector3::new(station, 0.0, 0.0),
            ..Pose::identity()
        };
        self.start * along
    }

    /// Where that is, T_b_n.
    pub(super) fn beginning(&self) -> Pose {
        self.straight(self.first_station()).raised(self.ride())
    }

    /// Height of the nozzle over the sheet on the way, m: the paper's loop leads the sensor alone, and the nozzle where there is no seam.
    pub(super) fn ride(&self) -> f32 {
        match self.law {
            Law::Lead => 0.0,
            Law::Paper => self.search.raise,
        }
    }
}
