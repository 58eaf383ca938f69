//! Speed from encoder counts by a tracking filter, as drives do: a second-order observer that follows the position.
//!
//! Differentiating the counts at 4 kHz would give steps of 4000 counts/s; the filter's noise is a fraction of that, for a
//! lag of 17° at the speed loop's 60 Hz.

/// Natural frequency, rad/s (400 Hz), critically damped.
const FREQUENCY_RAD_S: f64 = 2.0 * std::f64::consts::PI * 400.0;

/// Position and speed as tracked.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tracking {
    /// First reading; the filter works on the difference to it, where f64 has digits to spare.
    origin: Option<i32>,
    position: f64,
    velocity: f64,
}

impl Tracking {
    /// Takes the reading `dt_s` after the last one.
    pub fn update(&mut self, dt_s: f64, counts: i32) {
        let origin = *self.origin.get_or_insert(counts);
        let measured = counts.wrapping_sub(origin) as f64;
        // Both poles of the sampled filter at exp(-w dt).
        let pole = (-FREQUENCY_RAD_S * dt_s).exp();
        let predicted = self.position + self.velocity * dt_s;
        let innovation = measured - predicted;
        self.position = predicted + (1.0 - pole * pole) * innovation;
        self.velocity += (1.0 - pole).powi(2) / dt_s * innovation;
    }

    /// Speed, counts/s.
    pub fn velocity(&self) -> f64 {
        self.velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_speed_is_found_within_5_ms_to_less_than_the_step_of_a_difference() {
        let dt = 0.25e-3;
        for speed in [-6.55e6, 1234.5, 1e5] {
            let mut tracking = Tracking::default();
            let mut worst = 0.0f64;
            for k in 0..4000 {
                tracking.update(dt, (speed * dt * k as f64).floor() as i32 + 1_000_000);
                if k > 20 {
                    worst = worst.max((tracking.velocity() - speed).abs());
                }
            }
            assert!(worst < 1500.0, "{speed}: {worst} counts/s");
        }
    }
}
