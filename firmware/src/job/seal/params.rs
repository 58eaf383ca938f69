//! What a sealing job is told before it starts.

use super::StartPose;
use crate::job::access::AccessParams;
use crate::job::measure::MeasureParams;
use crate::job::mount::SensorMount;
use crate::job::path::TaughtPath;
use crate::job::round::RoundParams;
use crate::servo::hold::HoldKind;
use hal::wire_struct;

/// What a sealing job is told before it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct SealParams {
    /// The path to follow, with its allowed speeds.
    pub path: TaughtPath,
    /// Where the part lies, as told: exactly enough to seal it, or to begin the measurement at.
    pub start: StartPose,
    /// What is measured of it first.
    pub measure: MeasureParams,
    /// The sensor on the nozzle.
    pub mount: SensorMount,
    /// How the nozzle is led from one correction to the next.
    pub hold: HoldKind,
    /// Corrections are applied; false plays the taught path blind.
    pub preview: bool,
    /// Cycles from one burst of exposures to the next.
    pub vision_period: u8,
    /// Speed along the seam at which the dispenser's flow is nominal, m/s.
    pub speed: f32,
    /// Acceleration and braking along the path, m/s².
    pub acceleration: f32,
    /// How corners are looked round.
    pub round: RoundParams,
    /// How the arm comes and goes.
    pub access: AccessParams,
}

wire_struct!(SealParams {
    path: TaughtPath,
    start: StartPose,
    measure: MeasureParams,
    mount: SensorMount,
    hold: HoldKind,
    preview: bool,
    vision_period: u8,
    speed: f32,
    acceleration: f32,
    round: RoundParams,
    access: AccessParams,
});
