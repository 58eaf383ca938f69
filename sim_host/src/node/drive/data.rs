//! Ratings and constants of a drive with its motor.

/// A drive and its motor, SI at the motor shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveData {
    /// Rated (continuous) torque, N·m.
    pub rated_torque_n_m: f64,
    /// Peak torque, N·m.
    pub peak_torque_n_m: f64,
    /// Highest speed of the motor, 1/min.
    pub max_speed_rpm: u32,
    /// Encoder counts per motor revolution.
    pub encoder_counts: u32,
    /// Inertia that the speed loop is tuned for: rotor and reflected load, kg·m².
    pub total_inertia_kg_m2: f64,
    /// Bandwidth of the speed loop, rad/s.
    pub speed_bandwidth_rad_s: f64,
    /// Time constant of the current loop, s.
    pub current_lag_s: f64,
    /// Thermal time constant of the motor for the I²t limit, s.
    pub thermal_time_s: f64,
    /// Time from operation enabled until the holding brake is open, s.
    pub brake_open_s: f64,
    /// Target velocities are joined by straight lines from SYNC to SYNC instead of held; costs one cycle of delay.
    pub interpolate: bool,
}

/// Speed loop: 60 Hz. Ten times the position loop of a 5 ms cycle (about 30 rad/s) so that the controller may take it as
/// ideal, and low enough for the lags behind it: tracking filter, current loop and 4 kHz sampling together cost 32° of
/// phase at 60 Hz and the integrator 11°, which leaves a margin of 47°. Belts and gears of such arms resonate above.
pub const SPEED_BANDWIDTH_RAD_S: f64 = 2.0 * std::f64::consts::PI * 60.0;
/// 17 bit per revolution: assumed, the usual absolute encoder of servo motors of this size today.
pub const ENCODER_COUNTS: u32 = 1 << 17;
/// Current loop of about 500 Hz: assumed, usual for servo drives of this size.
const CURRENT_LAG_S: f64 = 0.0003;
/// Assumed: peak torque (three times rated) is then allowed for 3 s from cold, as such drives allow.
const THERMAL_TIME_S: f64 = 25.0;
/// Assumed: a spring-applied brake of this size opens in about 20 ms.
const BRAKE_OPEN_S: f64 = 0.020;

impl DriveData {
    /// Main axes of the paper's arm: 300 W, 0.955 N·m, peak 2.86 N·m, 3000 (4500) 1/min (thesis, appendix A).
    pub fn main(total_inertia_kg_m2: f64) -> Self {
        Self {
            rated_torque_n_m: 0.955,
            peak_torque_n_m: 2.86,
            max_speed_rpm: 4500,
            encoder_counts: ENCODER_COUNTS,
            total_inertia_kg_m2,
            speed_bandwidth_rad_s: SPEED_BANDWIDTH_RAD_S,
            current_lag_s: CURRENT_LAG_S,
            thermal_time_s: THERMAL_TIME_S,
            brake_open_s: BRAKE_OPEN_S,
            interpolate: false,
        }
    }

    /// Wrist axes of the paper's arm: 50 W, 0.159 N·m, peak 0.476 N·m, 3000 (4500) 1/min (thesis, appendix A).
    pub fn wrist(total_inertia_kg_m2: f64) -> Self {
        Self {
            rated_torque_n_m: 0.159,
            peak_torque_n_m: 0.476,
            ..Self::main(total_inertia_kg_m2)
        }
    }

    /// Counts of one radian at the motor.
    pub fn counts_per_rad(&self) -> f64 {
        self.encoder_counts as f64 / (2.0 * std::f64::consts::PI)
    }

    /// Highest speed, rad/s.
    pub fn max_speed_rad_s(&self) -> f64 {
        rad_s(self.max_speed_rpm)
    }

    /// Rated torque as object 0x6076 has it, mN·m.
    pub fn rated_torque_mnm(&self) -> u32 {
        (self.rated_torque_n_m * 1000.0).round() as u32
    }
}

/// Speed in rad/s of one in 1/min.
pub(super) fn rad_s(rpm: u32) -> f64 {
    rpm as f64 * (2.0 * std::f64::consts::PI / 60.0)
}
