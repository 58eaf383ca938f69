//! Units at the drives: encoder counts and per mille of rated torque against rad and N·m at the actuator.

use super::limits::within;
use hal::wire_struct;

/// Scales and limits of one drive, seen at the actuator, that is after the gear.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriveScale {
    /// Encoder counts per rad of the actuator: counts per turn × gear ratio / 2π.
    pub counts_per_rad: f32,
    /// Count at actuator angle zero.
    pub zero: i32,
    /// Rated torque × gear ratio, N·m.
    pub rated_torque: f32,
    /// Peak torque × gear ratio, N·m.
    pub peak_torque: f32,
    /// Greatest speed / gear ratio, rad/s.
    pub max_speed: f32,
}

wire_struct!(DriveScale {
    counts_per_rad: f32,
    zero: i32,
    rated_torque: f32,
    peak_torque: f32,
    max_speed: f32
});

impl DriveScale {
    /// Actuator angle, rad, of an encoder `position`. The difference to `zero` is taken in integers, so that no digit of a
    /// position far from zero is lost; f32 holds it to a count up to ±2^24 (17 turns of the actuator at 10^6 counts per turn).
    pub fn angle(&self, position: i32) -> f32 {
        position.wrapping_sub(self.zero) as f32 / self.counts_per_rad
    }

    /// Actuator velocity, rad/s, of an encoder `velocity` in counts/s.
    pub fn speed(&self, velocity: i32) -> f32 {
        velocity as f32 / self.counts_per_rad
    }

    /// Encoder position of an actuator `angle` (rad).
    pub fn position(&self, angle: f32) -> i32 {
        self.zero.wrapping_add(round(angle * self.counts_per_rad))
    }

    /// Target velocity, counts/s, for an actuator `speed` (rad/s), limited to the drive's greatest.
    pub fn velocity(&self, speed: f32) -> i32 {
        round(within(speed, self.max_speed) * self.counts_per_rad)
    }

    /// Target torque or torque offset, per mille of rated, for an actuator `torque` (N·m), limited to the peak.
    pub fn per_mille(&self, torque: f32) -> i16 {
        let value = within(torque, self.peak_torque) * 1000.0 / self.rated_torque;
        round(value) as i16
    }

    /// Actuator torque, N·m, of a drive's torque in per mille of rated.
    pub fn torque(&self, per_mille: i16) -> f32 {
        per_mille as f32 * self.rated_torque / 1000.0
    }
}

/// To the nearest integer, halves away from zero; saturates.
fn round(x: f32) -> i32 {
    (x + if x < 0.0 { -0.5 } else { 0.5 }) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// J1 of the K3S: 300 W motor, gear 120, 8192 counts per turn.
    fn main_axis() -> DriveScale {
        DriveScale {
            counts_per_rad: 156_454.9,
            zero: 1_000_000,
            rated_torque: 114.6,
            peak_torque: 343.2,
            max_speed: 3.927,
        }
    }

    #[test]
    fn commands_are_limited_to_what_the_drive_can_do() {
        let drive = main_axis();
        assert_eq!(drive.per_mille(114.6), 1000);
        assert_eq!(drive.per_mille(1e9), 2995);
        assert_eq!(drive.per_mille(-1e9), -2995);
        assert_eq!(drive.velocity(100.0), drive.velocity(3.927));
        assert_eq!(
            drive.per_mille(f32::NAN),
            -2995,
            "a broken torque is at least a bounded one"
        );
    }

    proptest! {
        #[test]
        fn an_angle_comes_back_to_the_count(angle in -6.0f32..6.0) {
            let drive = main_axis();
            let error = (drive.angle(drive.position(angle)) - angle).abs();
            prop_assert!(error <= 0.51 / drive.counts_per_rad + 4e-7, "{error} rad");
        }
    }
}
