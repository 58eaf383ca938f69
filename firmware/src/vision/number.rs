//! The few f32 functions that this room needs, from + − × ÷ alone, so that they are the same on every processor.

/// Square root; relative error below 1e-6. Zero for what is not positive.
pub fn sqrt(value: f32) -> f32 {
    if value <= f32::MIN_POSITIVE {
        return 0.0;
    }
    // Halving the exponent gives a start within 4 %; each Newton step squares the error: 8e-4, 3e-7, rounding.
    let mut root = f32::from_bits((value.to_bits() >> 1) + 0x1fbb_4f2e);
    for _ in 0..3 {
        root = 0.5 * (root + value / root);
    }
    root
}

/// `value` held within `low..=high`. (`f32::clamp` panics on a wrong order, and the core must not panic.)
pub fn limit(value: f32, low: f32, high: f32) -> f32 {
    let floored = if value > low { value } else { low };
    if floored < high { floored } else { high }
}

/// Arc tangent of |`slope`| ≤ 1, rad; error below 2e-6. (Abramowitz and Stegun, 4.4.49.)
pub fn atan(slope: f32) -> f32 {
    const COEFFICIENTS: [f32; 8] = [
        0.002_866_226,
        -0.016_165_737,
        0.042_909_614,
        -0.075_289_64,
        0.106_562_64,
        -0.142_089,
        0.199_935_51,
        -0.333_331_45,
    ];
    let square = slope * slope;
    let series = COEFFICIENTS.iter().fold(0.0, |sum, c| (sum + c) * square);
    slope + slope * series
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_root_squared_is_the_value(value in 1e-12_f32..1e12) {
            prop_assert!((sqrt(value) / value.sqrt() - 1.0).abs() < 1e-6);
        }

        #[test]
        fn the_arc_tangent_agrees_with_the_standard_librarys(slope in -1.0_f32..1.0) {
            prop_assert!((atan(slope) - slope.atan()).abs() < 2e-6);
        }
    }
}
