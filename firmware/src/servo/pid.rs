//! PI-D control of one axis: proportional and integral on the error, derivative on the measurement (thesis 6.11, 6.12).

use super::limits::within;
use hal::wire_struct;

/// Gains of one axis. The output's unit U is N·m at the actuator in torque mode, rad/s in velocity mode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gains {
    /// Proportional, U/rad.
    pub proportional: f32,
    /// Integral, U/(rad·s).
    pub integral: f32,
    /// Derivative, U/(rad/s).
    pub derivative: f32,
}

wire_struct!(Gains {
    proportional: f32,
    integral: f32,
    derivative: f32
});

/// The thesis's Table 1 (chapters 4 and 6), joints base first: (K_P V/rad, K_I V/rad per sample, K_D V/rad per sample).
pub const TABLE_1: [(f32, f32, f32); 6] = [
    (7360.0, 6.25, 8.05),
    (5790.0, 7.08, 6.86),
    (6910.0, 8.22, 6.08),
    (581.0, 14.72, 3.32),
    (1356.0, 18.51, 2.57),
    (740.0, 21.00, 2.43),
];

impl Gains {
    /// Torque-mode gains that place the poles of a pure `inertia` (kg·m², at the actuator) at
    /// (s² + 2ζωs + ω²)(s + ω_i); `omega` and `omega_i` in rad/s.
    ///
    /// With one cycle T from sample to actuation keep ωT ≤ 0.11 for a damping of 0.5 over a load ratio of 1 to 4 (spec,
    /// suggested gains): 20 rad/s at 5 ms, with ζ = 0.9 and ω_i = ω/10.
    pub fn pole_placement(inertia: f32, omega: f32, zeta: f32, omega_i: f32) -> Self {
        Self {
            proportional: inertia * (omega * omega + 2.0 * zeta * omega * omega_i),
            integral: inertia * omega * omega * omega_i,
            derivative: inertia * (2.0 * zeta * omega + omega_i),
        }
    }

    /// A row of [`TABLE_1`] taken literally (joint rad, K_I and K_D per sample): `torque_per_volt` is the motor's (N·m/V)
    /// times the gear ratio, `period` the sample time, s. Unstable at 5 ms on the main axes: kept to be reported, not used.
    pub fn table_1(row: (f32, f32, f32), torque_per_volt: f32, period: f32) -> Self {
        let (proportional, integral, derivative) = row;
        Self {
            proportional: proportional * torque_per_volt,
            integral: integral * torque_per_volt / period,
            derivative: derivative * torque_per_volt * period,
        }
    }
}

/// What one axis is to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Reference angle at this sample, rad.
    pub reference: f32,
    /// Measured angle at this sample, rad.
    pub measured: f32,
    /// Added to the controller's output, U.
    pub feedforward: f32,
    /// The derivative acts on the measured velocity less the reference's: right when the feed-forward moves the axis.
    pub follow: bool,
}

/// State of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pid {
    /// Integral part of the output, U.
    integral: f32,
    /// Measured angle of the sample before, rad.
    measured: f32,
    /// Reference angle of the sample before, rad.
    reference: f32,
}

wire_struct!(Pid {
    integral: f32,
    measured: f32,
    reference: f32
});

impl Pid {
    /// Starts at rest so that the next step's output is `residual` plus its feed-forward: no bump when the drive is armed or the
    /// mode changes. `residual` in U.
    pub fn preset(gains: &Gains, reference: f32, measured: f32, residual: f32) -> Self {
        Self {
            integral: residual - gains.proportional * (reference - measured),
            measured,
            reference,
        }
    }

    /// Takes these as the angles of the sample before: no rate is known then, and the derivative is left out once.
    pub fn forget_rates(&mut self, reference: f32, measured: f32) {
        self.reference = reference;
        self.measured = measured;
    }

    /// One sample: the command including feed-forward, within ±`limit`, U. `period` in s; `limit` > 0 in U. While the output is cut, the
    /// integral does not grow further that way.
    pub fn step(&mut self, gains: &Gains, sample: &Sample, limit: f32, period: f32) -> f32 {
        let error = sample.reference - sample.measured;
        let rate = 1.0 / period;
        let velocity = (sample.measured - self.measured) * rate;
        let wanted = if sample.follow {
            (sample.reference - self.reference) * rate
        } else {
            0.0
        };
        self.measured = sample.measured;
        self.reference = sample.reference;

        let asked =
            gains.proportional * error + self.integral + gains.derivative * (wanted - velocity) + sample.feedforward;
        let growth = gains.integral * error * period;
        let value = within(asked, limit);
        let winding = (asked - value) * growth > 0.0;
        if !winding {
            self.integral = within(self.integral + growth, limit);
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f32 = 0.005;

    fn still(reference: f32, measured: f32) -> Sample {
        Sample {
            reference,
            measured,
            feedforward: 0.0,
            follow: false,
        }
    }

    /// Torque-mode axis of 6 kg·m² with one cycle of delay; returns (overshoot, error at the end) of a `step`.
    fn answer(inertia: f32, gains: &Gains, step: f32, limit: f32, cycles: usize) -> (f32, f32) {
        let (mut angle, mut speed, mut torque, mut highest) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        let mut pid = Pid::preset(gains, 0.0, 0.0, 0.0);
        for _ in 0..cycles {
            let next = pid.step(gains, &still(step, angle), limit, PERIOD);
            angle += speed * PERIOD + 0.5 * torque / inertia * PERIOD * PERIOD;
            speed += torque / inertia * PERIOD;
            torque = next;
            highest = highest.max(angle);
        }
        (highest - step, step - angle)
    }

    #[test]
    fn pole_placement_settles_a_step_at_load_ratios_of_one_to_four() {
        let gains = Gains::pole_placement(6.0, 20.0, 0.9, 2.0);
        for inertia in [4.0, 6.0, 10.0] {
            let (overshoot, rest) = answer(inertia, &gains, 0.01, 1e9, 600);
            assert!(overshoot < 0.0025, "{overshoot} rad over at {inertia} kg·m²");
            assert!(rest.abs() < 2e-5, "{rest} rad left at {inertia} kg·m²");
        }
    }

    #[test]
    fn the_printed_gains_diverge_at_five_milliseconds() {
        // J1: 120 · 0.159 N·m/V on 6 kg·m².
        let gains = Gains::table_1(TABLE_1[0], 120.0 * 0.159, PERIOD);
        let (overshoot, _) = answer(6.0, &gains, 1e-4, 1e9, 100);
        assert!(overshoot > 1.0, "{overshoot} rad");
    }

    /// The overshoot that is left is the double integrator's own under a torque limit; wound up, it would run away.
    #[test]
    fn a_saturated_step_overshoots_no_more_than_without_the_integral() {
        let gains = Gains::pole_placement(6.0, 20.0, 0.9, 2.0);
        let bare = Gains { integral: 0.0, ..gains };
        for step in [0.3, 1.0] {
            let ((with, rest), (without, _)) = (
                answer(6.0, &gains, step, 60.0, 2000),
                answer(6.0, &bare, step, 60.0, 2000),
            );
            assert!(
                with < without + 0.01 * step.max(0.5),
                "{with} rad against {without} over a step of {step}"
            );
            assert!(rest.abs() < 1e-3, "{rest} rad");
        }
    }

    #[test]
    fn a_preset_axis_starts_without_a_bump() {
        let gains = Gains::pole_placement(6.0, 20.0, 0.9, 2.0);
        let mut pid = Pid::preset(&gains, 0.31, 0.3, 7.0);
        let sample = Sample {
            feedforward: 2.0,
            ..still(0.31, 0.3)
        };
        let out = pid.step(&gains, &sample, 100.0, PERIOD);
        assert!((out - 9.0).abs() < 1e-4, "{out:?}");
    }

    #[test]
    fn the_derivative_brakes_the_measurement_but_not_a_followed_reference() {
        let gains = Gains {
            proportional: 0.0,
            integral: 0.0,
            derivative: 2.0,
        };
        let mut pid = Pid::default();
        let sample = Sample {
            reference: 0.001,
            measured: 0.001,
            feedforward: 0.0,
            follow: false,
        };
        assert!(
            (pid.step(&gains, &sample, 9.0, PERIOD) + 0.4).abs() < 1e-5,
            "0.2 rad/s · 2"
        );
        let mut pid = Pid::default();
        assert_eq!(pid.step(&gains, &Sample { follow: true, ..sample }, 9.0, PERIOD), 0.0);
    }

    #[test]
    fn the_output_stays_within_its_limit() {
        let gains = Gains {
            proportional: 1e6,
            integral: 0.0,
            derivative: 0.0,
        };
        let mut pid = Pid::default();
        assert_eq!(pid.step(&gains, &still(-1.0, 0.0), 5.0, PERIOD), -5.0);
    }
}
