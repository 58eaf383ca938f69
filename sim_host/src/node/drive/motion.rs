//! From target to torque: speed loop, torque limits, current loop. SI at the motor shaft.

use super::data::DriveData;

/// The speed loop's integral acts below this part of its bandwidth: 11° of phase there.
const INTEGRAL_RATIO: f64 = 0.2;

/// What the motion part is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// No torque.
    Off,
    /// This speed, rad/s, with this torque added, N·m.
    Velocity(f64, f64),
    /// This torque, N·m.
    Torque(f64),
}

/// Limits in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Torque either way, N·m.
    pub torque_n_m: f64,
    /// Speed either way, rad/s.
    pub speed_rad_s: f64,
}

/// State of the loops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    integral_n_m: f64,
    torque_n_m: f64,
    /// Heat of the winding, 1 at rated torque for ever.
    heat: f64,
    hot: bool,
    limited: bool,
}

impl Motion {
    /// Torque at the shaft now, N·m.
    pub fn torque(&self) -> f64 {
        self.torque_n_m
    }

    /// Whether a limit of torque or speed acted at the last step.
    pub fn is_limited(&self) -> bool {
        self.limited
    }

    /// One step of `dt_s` at the measured `speed`, rad/s.
    pub fn step(&mut self, data: &DriveData, limits: Limits, demand: Demand, speed: f64, dt_s: f64) {
        let limit = self.torque_limit(data, limits);
        let gain = data.total_inertia_kg_m2 * data.speed_bandwidth_rad_s;
        let wanted = match demand {
            Demand::Off => {
                // Power stage off: no current, whatever flowed before.
                *self = Self {
                    heat: self.heat,
                    hot: self.hot,
                    ..Self::default()
                };
                self.warm(data, dt_s);
                return;
            }
            Demand::Torque(torque) => {
                self.integral_n_m = 0.0;
                // Near the speed limit only as much torque as does not pass it.
                torque
                    .min(gain * (limits.speed_rad_s - speed))
                    .max(gain * (-limits.speed_rad_s - speed))
            }
            Demand::Velocity(velocity, offset) => {
                let velocity = velocity.clamp(-limits.speed_rad_s, limits.speed_rad_s);
                let error = velocity - speed;
                let integral = self.integral_n_m + gain * data.speed_bandwidth_rad_s * INTEGRAL_RATIO * error * dt_s;
                let wanted = gain * error + integral + offset;
                // Anti-windup: at the limit the integral may only turn back.
                if wanted.abs() <= limit || wanted * error < 0.0 {
                    self.integral_n_m = integral;
                }
                gain * error + self.integral_n_m + offset
            }
        };
        let allowed = wanted.clamp(-limit, limit);
        self.limited = match demand {
            Demand::Torque(torque) => allowed != torque,
            Demand::Velocity(velocity, _) => allowed != wanted || velocity.abs() > limits.speed_rad_s,
            Demand::Off => false,
        };
        self.torque_n_m += (allowed - self.torque_n_m) * (1.0 - (-dt_s / data.current_lag_s).exp());
        self.warm(data, dt_s);
    }

    /// Torque that is allowed now: the object's and the peak's; rated once the winding is hot, until it has cooled a tenth.
    fn torque_limit(&mut self, data: &DriveData, limits: Limits) -> f64 {
        self.hot = self.heat >= if self.hot { 0.9 } else { 1.0 };
        let thermal = if self.hot {
            data.rated_torque_n_m
        } else {
            data.peak_torque_n_m
        };
        limits.torque_n_m.min(thermal)
    }

    fn warm(&mut self, data: &DriveData, dt_s: f64) {
        let relative = self.torque_n_m / data.rated_torque_n_m;
        self.heat += (relative * relative - self.heat) * (dt_s / data.thermal_time_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.25e-3;
    const FREE: Limits = Limits {
        torque_n_m: 9.0,
        speed_rad_s: 471.0,
    };

    #[test]
    fn torque_follows_its_target_with_the_current_loop_s_lag() {
        let data = DriveData::main(3e-4);
        let mut motion = Motion::default();
        for _ in 0..4 {
            motion.step(&data, FREE, Demand::Torque(1.0), 0.0, DT);
        }
        // 1 ms is 3.33 time constants.
        assert!((motion.torque() - (1.0 - (-1.0f64 / 0.3).exp())).abs() < 1e-9);
    }

    #[test]
    fn peak_torque_is_cut_to_rated_after_about_3_s() {
        let data = DriveData::main(3e-4);
        let mut motion = Motion::default();
        let steps = (1..100_000).find(|_| {
            motion.step(&data, FREE, Demand::Torque(99.0), 0.0, DT);
            motion.torque() < 2.8 && motion.heat > 0.1
        });
        let seconds = steps.unwrap() as f64 * DT;
        assert!((2.5..3.5).contains(&seconds), "{seconds} s");
    }

    #[test]
    fn the_speed_loop_settles_on_a_free_rotor_with_moderate_overshoot() {
        let data = DriveData::main(3e-4);
        let (mut motion, mut speed, mut peak, mut settled) = (Motion::default(), 0.0f64, 0.0f64, 0);
        for k in 0..400 {
            motion.step(&data, FREE, Demand::Velocity(10.0, 0.0), speed, DT);
            speed += motion.torque() / data.total_inertia_kg_m2 * DT;
            peak = peak.max(speed);
            if (speed - 10.0).abs() > 0.2 {
                settled = k;
            }
        }
        assert!(peak < 12.5, "{peak} rad/s at peak");
        assert!((settled as f64) * DT < 0.04, "{settled} steps");
    }
}
