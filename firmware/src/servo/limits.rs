//! Limits of joints: their ranges and speeds.

use crate::arm::JointRange;

/// `value` limited to [min, max]. Unlike `f32::clamp` it cannot panic; NaN comes out as `min`, so a broken number cannot
/// reach a drive.
pub fn clamp(value: f32, min: f32, max: f32) -> f32 {
    let low = if value > min { value } else { min };
    if low < max { low } else { max }
}

/// `value` limited to ±`limit`; NaN comes out as −`limit`. What lies within costs one comparison.
pub fn within(value: f32, limit: f32) -> f32 {
    if value.abs() <= limit {
        value
    } else if value > limit {
        limit
    } else {
        -limit
    }
}

/// A joint outside its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeyondRange {
    /// Joint, from zero.
    pub joint: u8,
    /// Its angle, rad.
    pub angle: f32,
}

/// The first joint of `q` (rad) that is not within its range narrowed by `margin` (rad) on both sides; NaN is outside.
pub fn check_ranges<const N: usize>(q: &[f32; N], ranges: &[JointRange; N], margin: f32) -> Result<(), BeyondRange> {
    for (joint, (angle, range)) in (0u8..).zip(q.iter().zip(ranges)) {
        let inside = *angle >= range.min + margin && *angle <= range.max - margin;
        if !inside {
            return Err(BeyondRange { joint, angle: *angle });
        }
    }
    Ok(())
}

/// The factor in [0, 1] that brings every one of `velocities` within its limit without changing the direction of motion.
pub fn speed_factor<const N: usize>(velocities: &[f32; N], limits: &[f32; N]) -> f32 {
    let mut factor = 1.0;
    for (velocity, limit) in velocities.iter().zip(limits) {
        let size = velocity.abs();
        if size * factor > *limit {
            factor = limit / size;
        }
    }
    factor
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn clamping_holds_both_ends_and_swallows_nan() {
        assert_eq!(
            (clamp(2.0, -1.0, 1.0), clamp(-2.0, -1.0, 1.0), clamp(0.5, -1.0, 1.0)),
            (1.0, -1.0, 0.5)
        );
        assert_eq!(clamp(f32::NAN, -1.0, 1.0), -1.0);
        assert_eq!(
            [2.0, -2.0, 0.5, -1.0, f32::NAN].map(|value| within(value, 1.0)),
            [1.0, -1.0, 0.5, -1.0, -1.0]
        );
    }

    #[test]
    fn the_joint_that_leaves_its_range_is_named() {
        let ranges = [JointRange { min: -1.0, max: 1.0 }; 3];
        assert_eq!(check_ranges(&[0.0, 0.99, 0.0], &ranges, 0.0), Ok(()));
        assert_eq!(
            check_ranges(&[0.0, 0.99, 0.0], &ranges, 0.02),
            Err(BeyondRange { joint: 1, angle: 0.99 })
        );
        assert!(check_ranges(&[0.0, 0.0, f32::NAN], &ranges, 0.0).is_err());
    }

    proptest! {
        #[test]
        fn slowed_velocities_keep_within_every_limit(v in prop::array::uniform6(-9.0f32..9.0), limits in prop::array::uniform6(0.1f32..9.0)) {
            let factor = speed_factor(&v, &limits);
            prop_assert!((0.0..=1.0).contains(&factor));
            let mut touched = factor == 1.0;
            for (v, limit) in v.iter().zip(&limits) {
                prop_assert!(v.abs() * factor <= limit * 1.000_001);
                touched |= v.abs() * factor >= limit * 0.999_99;
            }
            prop_assert!(touched, "no more than needed");
        }
    }
}
