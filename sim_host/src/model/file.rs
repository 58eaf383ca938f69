//! The model file as it stands on disk.

use firmware::servo::axes::DriveMode;
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModelFile {
    pub name: String,
    pub parallel_link_elbow: Option<usize>,
    pub home_deg: Vec<f64>,
    pub tool: ToolEntry,
    pub sensor: SensorEntry,
    pub servo: ServoEntry,
    pub motors: BTreeMap<String, MotorEntry>,
    pub axes: Vec<AxisEntry>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolEntry {
    pub tip_m: [f64; 3],
    pub turn_about_x_deg: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorEntry {
    pub lead_m: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ServoEntry {
    pub mode: ModeEntry,
    pub period_s: f64,
    pub feedforward: bool,
    pub velocity_proportional: Vec<f64>,
    pub torque_omega: f64,
    pub torque_zeta: f64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ModeEntry {
    Velocity,
    Torque,
}

impl From<ModeEntry> for DriveMode {
    fn from(mode: ModeEntry) -> Self {
        match mode {
            ModeEntry::Velocity => Self::Velocity,
            ModeEntry::Torque => Self::Torque,
        }
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MotorEntry {
    pub rated_torque: f64,
    pub peak_torque: f64,
    pub rated_speed_rpm: f64,
    pub max_speed_rpm: f64,
    pub rotor_inertia: f64,
    pub encoder_counts: u32,
    pub brake_torque: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisEntry {
    pub name: String,
    pub a: f64,
    pub twist_deg: f64,
    pub d: f64,
    pub range_deg: [f64; 2],
    pub mass: f64,
    pub centre: [f64; 3],
    pub inertia: [f64; 6],
    pub motor: String,
    pub gear: f64,
    pub coulomb: f64,
    pub viscous: f64,
}
