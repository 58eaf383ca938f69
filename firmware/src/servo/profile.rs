//! Rest-to-rest motion in closed form: trapezoidal, or jerk-limited in seven pieces, for one coordinate and for N joints in step.

use super::limits::clamp;
use crate::geometry::trig::{cbrt, sqrt};
use hal::wire_struct;

/// Limits of a motion, all positive, in the coordinate's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionLimits {
    /// Speed, per s.
    pub speed: f32,
    /// Acceleration, per s².
    pub acceleration: f32,
    /// Jerk, per s³; infinite for a trapezoid of speed.
    pub jerk: f32,
}

wire_struct!(MotionLimits {
    speed: f32,
    acceleration: f32,
    jerk: f32
});

/// Where a motion is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionState {
    /// Way from the start.
    pub position: f32,
    /// Its rate, per s.
    pub velocity: f32,
    /// Its second rate, per s².
    pub acceleration: f32,
}

/// A planned rest-to-rest motion over a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Profile {
    distance: f32,
    /// Greatest speed and acceleration that it reaches.
    speed: f32,
    acceleration: f32,
    /// Time for which the acceleration rises, s, and in which the speed is reached, s.
    jerk_time: f32,
    rise_time: f32,
    /// Time at constant speed, s.
    cruise_time: f32,
}

wire_struct!(Profile {
    distance: f32,
    speed: f32,
    acceleration: f32,
    jerk_time: f32,
    rise_time: f32,
    cruise_time: f32,
});

impl Profile {
    /// The fastest such motion over `distance` (≥ 0; anything else is no motion).
    pub fn plan(distance: f32, limits: &MotionLimits) -> Self {
        let MotionLimits {
            speed: top,
            acceleration,
            jerk,
        } = *limits;
        let possible = top > 0.0 && acceleration > 0.0 && jerk > 0.0;
        if !(distance > 0.0 && possible) {
            return Self::default();
        }
        // Speed at which the acceleration just reaches its limit; below it the acceleration is a triangle.
        let knee = acceleration * acceleration / jerk;
        // Speed that a motion of this length reaches without cruising: d = v·(rise time).
        let reached = if distance >= 2.0 * knee * sqrt(knee / jerk) || jerk == f32::INFINITY {
            // d = v (v/a + a/j)
            0.5 * (sqrt(knee * knee + 4.0 * acceleration * distance) - knee)
        } else {
            // d = 2 v √(v/j)
            cbrt(0.25 * distance * distance * jerk)
        };
        let speed = if reached < top { reached } else { top };
        let (acceleration, jerk_time, rise_time) = if speed > knee {
            let jerk_time = acceleration / jerk;
            (acceleration, jerk_time, speed / acceleration + jerk_time)
        } else {
            let jerk_time = sqrt(speed / jerk);
            (jerk * jerk_time, jerk_time, 2.0 * jerk_time)
        };
        let cruise = (distance - speed * rise_time) / speed;
        let cruise_time = if cruise > 0.0 { cruise } else { 0.0 };
        Self {
            distance,
            speed,
            acceleration,
            jerk_time,
            rise_time,
            cruise_time,
        }
    }

    /// Time from rest to rest, s.
    pub fn duration(&self) -> f32 {
        2.0 * self.rise_time + self.cruise_time
    }

    /// The way from rest to rest.
    pub fn distance(&self) -> f32 {
        self.distance
    }

    /// The state at `time` (s) from the start; before it and after the end, at rest.
    pub fn evaluate(&self, time: f32) -> MotionState {
        let left = self.duration() - time;
        if time <= 0.0 {
            MotionState::default()
        } else if left <= 0.0 {
            MotionState {
                position: self.distance,
                ..MotionState::default()
            }
        } else if time < self.rise_time {
            self.rise(time)
        } else if left > self.rise_time {
            let position = self.speed * (0.5 * self.rise_time + (time - self.rise_time));
            MotionState {
                position,
                velocity: self.speed,
                acceleration: 0.0,
            }
        } else {
            // The end is the start run backwards.
            let MotionState {
                position,
                velocity,
                acceleration,
            } = self.rise(left);
            MotionState {
                position: self.distance - position,
                velocity,
                acceleration: -acceleration,
            }
        }
    }

    /// The first three pieces: jerk up, constant acceleration, jerk down.
    fn rise(&self, time: f32) -> MotionState {
        let (a, tj) = (self.acceleration, self.jerk_time);
        if time < tj {
            let jerk = a / tj;
            let acceleration = jerk * time;
            let velocity = 0.5 * acceleration * time;
            return MotionState {
                position: velocity * time * (1.0 / 3.0),
                velocity,
                acceleration,
            };
        }
        let left = self.rise_time - time;
        if left < tj {
            let acceleration = a / tj * left;
            let lacking = 0.5 * acceleration * left; // speed still to gain
            let position = self.speed * (0.5 * self.rise_time - left) + lacking * left * (1.0 / 3.0);
            return MotionState {
                position,
                velocity: self.speed - lacking,
                acceleration,
            };
        }
        // From the middle of the jerk on, the motion is a parabola that started there, shifted by a·tj²/24.
        let since = time - 0.5 * tj;
        MotionState {
            position: a * (0.5 * since * since + tj * tj * (1.0 / 24.0)),
            velocity: a * since,
            acceleration: a,
        }
    }
}

/// All joints from one vector to another, in step along a straight line in joint space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotion<const N: usize> {
    start: [f32; N],
    way: [f32; N],
    /// Of the fraction of the way, 0 to 1.
    fraction: Profile,
}

wire_struct!(JointMotion<const N: usize> { start: [f32; N], way: [f32; N], fraction: Profile });

/// Angles (rad), velocities (rad/s) and accelerations (rad/s²) of all joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointState<const N: usize> {
    /// Angles.
    pub position: [f32; N],
    /// Velocities.
    pub velocity: [f32; N],
    /// Accelerations.
    pub acceleration: [f32; N],
}

impl<const N: usize> JointMotion<N> {
    /// The fastest motion from `start` to `end` (rad) in which no joint exceeds its limits.
    pub fn plan(start: &[f32; N], end: &[f32; N], limits: &[MotionLimits; N]) -> Self {
        let way = core::array::from_fn(|i| end[i] - start[i]);
        let mut tightest = MotionLimits {
            speed: f32::INFINITY,
            acceleration: f32::INFINITY,
            jerk: f32::INFINITY,
        };
        let mut moves = false;
        for (way, limit) in way.iter().zip(limits) {
            let size: f32 = f32::abs(*way);
            // A micro-radian is rest: below it the limits divided by the way mean nothing.
            if size > 1e-6 {
                moves = true;
                tightest.speed = least(tightest.speed, limit.speed / size);
                tightest.acceleration = least(tightest.acceleration, limit.acceleration / size);
                tightest.jerk = least(tightest.jerk, limit.jerk / size);
            }
        }
        let fraction = Profile::plan(if moves { 1.0 } else { 0.0 }, &tightest);
        Self {
            start: *start,
            way,
            fraction,
        }
    }

    /// Time from rest to rest, s.
    pub fn duration(&self) -> f32 {
        self.fraction.duration()
    }

    /// The joints at `time` (s) from the start.
    pub fn evaluate(&self, time: f32) -> JointState<N> {
        let MotionState {
            position,
            velocity,
            acceleration,
        } = self.fraction.evaluate(time);
        let fraction = clamp(position, 0.0, 1.0);
        JointState {
            position: core::array::from_fn(|i| self.start[i] + fraction * self.way[i]),
            velocity: core::array::from_fn(|i| velocity * self.way[i]),
            acceleration: core::array::from_fn(|i| acceleration * self.way[i]),
        }
    }
}

fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn limits() -> impl Strategy<Value = MotionLimits> {
        (
            0.01f32..3.0,
            0.05f32..20.0,
            prop_oneof![Just(f32::INFINITY), 0.1f32..500.0],
        )
            .prop_map(|(speed, acceleration, jerk)| MotionLimits {
                speed,
                acceleration,
                jerk,
            })
    }

    proptest! {
        #[test]
        fn every_motion_arrives_within_its_limits_and_is_its_own_derivative(distance in 1e-4f32..5.0, limits in limits()) {
            let profile = Profile::plan(distance, &limits);
            let end = profile.evaluate(profile.duration() * 1.001);
            prop_assert_eq!(end, MotionState { position: distance, ..MotionState::default() });
            // Acceleration is linear in each of the seven pieces, so the trapezoid and Simpson's rule are exact.
            let (tj, ta, tv) = (profile.jerk_time, profile.rise_time - 2.0 * profile.jerk_time, profile.cruise_time);
            let mut start = 0.0;
            for (piece, length) in [tj, ta, tj, tv, tj, ta, tj].into_iter().enumerate() {
                if length > 1e-3 * profile.duration() {
                    let [a, m, b] = [0.01, 0.5, 0.99].map(|part| profile.evaluate(start + part * length));
                    let dt = 0.98 * length;
                    let (dv, dp) = (0.5 * dt * (a.acceleration + b.acceleration), dt / 6.0 * (a.velocity + 4.0 * m.velocity + b.velocity));
                    // Times are known to an ulp of the duration.
                    let blur = 4e-7 * profile.duration();
                    prop_assert!((b.velocity - a.velocity - dv).abs() < 1e-5 * profile.speed + blur * profile.acceleration, "{piece}");
                    prop_assert!((b.position - a.position - dp).abs() < 1e-5 * distance + blur * profile.speed, "{piece}");
                    for state in [a, m, b] {
                        prop_assert!(state.velocity <= limits.speed * 1.000_01 && state.velocity >= 0.0);
                        prop_assert!(state.acceleration.abs() <= limits.acceleration * 1.000_01);
                    }
                    if limits.jerk.is_finite() {
                        let change = (b.acceleration - a.acceleration).abs();
                        let slack = 1e-5 * limits.acceleration + blur * limits.jerk;
                        prop_assert!(change <= limits.jerk * dt + slack, "piece {piece}: jerk {}", change / dt);
                    }
                }
                start += length;
                let (before, after) = (profile.evaluate(start * (1.0 - 1e-5)), profile.evaluate(start * (1.0 + 1e-5)));
                let gap = 2e-5 * start;
                prop_assert!((after.velocity - before.velocity).abs() < 1.1 * gap * profile.acceleration + 1e-4 * profile.speed, "{piece}");
                prop_assert!((after.position - before.position).abs() < 1.1 * gap * profile.speed + 1e-5 * distance, "{piece}");
            }
        }

        /// No slack: some limit is reached for as long as it can be.
        #[test]
        fn no_motion_is_slower_than_its_bounds_demand(distance in 1e-4f32..5.0, limits in limits()) {
            let profile = Profile::plan(distance, &limits);
            let full_speed = profile.speed >= limits.speed * 0.9999;
            prop_assert!(full_speed || profile.cruise_time < 2e-3 * profile.duration(), "{profile:?}");
            let full_acceleration = profile.acceleration >= limits.acceleration * 0.9999;
            prop_assert!(full_acceleration || (profile.rise_time - 2.0 * profile.jerk_time).abs() < 1e-5 * profile.rise_time);
        }

        #[test]
        fn joints_move_in_step_and_none_exceeds_its_limits(
            start in prop::array::uniform6(-2.0f32..2.0), end in prop::array::uniform6(-2.0f32..2.0), limits in prop::array::uniform6(limits())
        ) {
            let motion = JointMotion::plan(&start, &end, &limits);
            for step in 0..=50 {
                let state = motion.evaluate(motion.duration() * step as f32 / 50.0);
                for (i, limit) in limits.iter().enumerate() {
                    prop_assert!(state.velocity[i].abs() <= limit.speed * 1.000_1);
                    prop_assert!(state.acceleration[i].abs() <= limit.acceleration * 1.000_1);
                }
            }
            let arrived = motion.evaluate(motion.duration() + 1.0);
            for (end, (position, velocity)) in end.iter().zip(arrived.position.iter().zip(&arrived.velocity)) {
                prop_assert!((position - end).abs() < 1e-6 && *velocity == 0.0);
            }
        }
    }

    #[test]
    fn a_trapezoid_has_the_textbooks_times() {
        let limits = MotionLimits {
            speed: 0.5,
            acceleration: 1.0,
            jerk: f32::INFINITY,
        };
        let long = Profile::plan(1.0, &limits);
        assert!(
            (long.duration() - 2.5).abs() < 1e-6,
            "0.5 s up, 1.5 s along, 0.5 s down"
        );
        let short = Profile::plan(0.16, &limits);
        assert!((short.duration() - 0.8).abs() < 1e-6, "2·√(d/a)");
    }

    #[test]
    fn a_jerk_limited_motion_takes_the_seven_piece_time() {
        let limits = MotionLimits {
            speed: 0.5,
            acceleration: 1.0,
            jerk: 10.0,
        };
        assert!(
            (Profile::plan(1.0, &limits).duration() - 2.6).abs() < 1e-5,
            "d/v + v/a + a/j"
        );
        // Too short for the acceleration: four pieces of ∛(d/2j).
        assert!((Profile::plan(0.000_16, &limits).duration() - 0.08).abs() < 1e-6);
    }

    #[test]
    fn no_way_and_broken_limits_are_no_motion() {
        let limits = MotionLimits {
            speed: 0.5,
            acceleration: 1.0,
            jerk: 10.0,
        };
        for profile in [
            Profile::plan(0.0, &limits),
            Profile::plan(-1.0, &limits),
            Profile::plan(f32::NAN, &limits),
            Profile::plan(1.0, &MotionLimits { speed: 0.0, ..limits }),
        ] {
            assert_eq!(
                (profile.duration(), profile.evaluate(1.0)),
                (0.0, MotionState::default())
            );
        }
        let still = JointMotion::plan(&[0.3; 6], &[0.3; 6], &[limits; 6]);
        assert_eq!((still.duration(), still.evaluate(0.0).position), (0.0, [0.3; 6]));
    }
}
