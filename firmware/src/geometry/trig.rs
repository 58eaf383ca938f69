//! Elementary functions in f32: square root, sine and cosine, arcus functions.
//!
//! The same bits on every target: integer arithmetic and f32 `+ - * /` in the written order, nothing from `std` or
//! `libm` (whose f32 trigonometry computes in f64, in software on the Cortex-M4F). No table, no loop, no panic.
//! Error bounds are stated at each function and tested against f64.

use core::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// 2/π.
const QUARTER_TURNS_PER_RADIAN: f32 = core::f32::consts::FRAC_2_PI;

// π/2 in three parts (Cody and Waite): 13 + 13 + 24 bits, so that n·A and n·B are exact for |n| < 2^11.
const HALF_PI_A: f32 = 1.5708008;
const HALF_PI_B: f32 = -4.454516e-06;
const HALF_PI_C: f32 = 6.0771006e-11;

/// Largest argument of [`sin_cos`] for which the error bound holds, rad: beyond it n·A is no longer exact.
pub const SIN_COS_MAX: f32 = 3000.0;

/// Sine and cosine of `angle` (rad).
///
/// Absolute error ≤ 1e-7 for |angle| ≤ [`SIN_COS_MAX`]; a quarter turn as f32 knows it gives cos = −4.4e-8, as it should.
/// Minimax polynomials on ±π/4 (Cephes `sinf`, `cosf`; S. Moshier).
pub fn sin_cos(angle: f32) -> (f32, f32) {
    let turns = angle * QUARTER_TURNS_PER_RADIAN;
    let n = (turns + if turns < 0.0 { -0.5 } else { 0.5 }) as i32;
    let k = n as f32;
    let x = ((angle - k * HALF_PI_A) - k * HALF_PI_B) - k * HALF_PI_C;
    let z = x * x;
    let s = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * x + x;
    let c = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    let (sine, cosine) = if n & 1 == 0 { (s, c) } else { (c, s) };
    (
        if n & 2 == 0 { sine } else { -sine },
        if n.wrapping_add(1) & 2 == 0 { cosine } else { -cosine },
    )
}

/// Angle of the point (x, y) from the x axis, rad, in (−π, π]; zero for the origin.
///
/// Absolute error ≤ 3e-7. The sign of a zero is not looked at: `atan2(-0.0, -1.0)` is +π.
pub fn atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let (low, high) = if steep { (ax, ay) } else { (ay, ax) };
    if high == 0.0 {
        return 0.0;
    }
    // atan(t) = π/4 + atan((t − 1)/(t + 1)) keeps the polynomial's argument below tan(π/8).
    const TAN_EIGHTH_PI: f32 = 0.414_213_57;
    let (base, t) = if low > TAN_EIGHTH_PI * high {
        (FRAC_PI_4, (low - high) / (low + high))
    } else {
        (0.0, low / high)
    };
    let z = t * t;
    let poly = ((8.053_744_5e-2 * z - 1.387_768_6e-1) * z + 1.997_771e-1) * z - 3.333_295e-1;
    let angle = base + (poly * z * t + t);
    let angle = if steep { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

/// Arcus cosine, rad, in [0, π]; an argument outside ±1 counts as ±1. Absolute error ≤ 4e-7.
pub fn acos(x: f32) -> f32 {
    atan2(sqrt((1.0 - x) * (1.0 + x)), x)
}

/// Arcus sine, rad, in ±π/2; an argument outside ±1 counts as ±1. Absolute error ≤ 4e-7.
pub fn asin(x: f32) -> f32 {
    atan2(x, sqrt((1.0 - x) * (1.0 + x)))
}

/// `angle` (rad) less whole turns, in [−π, π] to within rounding; meant for |angle| ≤ [`SIN_COS_MAX`].
pub fn wrap(angle: f32) -> f32 {
    let turns = angle * (0.25 * QUARTER_TURNS_PER_RADIAN);
    let k = (turns + if turns < 0.0 { -0.5 } else { 0.5 }) as i32 as f32;
    ((angle - k * (4.0 * HALF_PI_A)) - k * (4.0 * HALF_PI_B)) - k * (4.0 * HALF_PI_C)
}

/// Square root, correctly rounded (round to nearest), hence equal to IEEE hardware. Negative arguments give zero: here
/// they are always the rounding error of a quantity that is not negative. NaN and infinity pass through.
pub fn sqrt(x: f32) -> f32 {
    const SUBNORMAL_SCALE: f32 = 16_777_216.0; // 2^24, whose root undoes it exactly
    const SUBNORMAL_UNSCALE: f32 = 1.0 / 4096.0;
    if x <= 0.0 {
        return 0.0;
    }
    if x.is_nan() || x == f32::INFINITY {
        return x;
    }
    if x < f32::MIN_POSITIVE {
        return sqrt_normal(x * SUBNORMAL_SCALE) * SUBNORMAL_UNSCALE;
    }
    sqrt_normal(x)
}

/// The root of a positive normal number: Newton's method in f32 to within an ulp, then rounding made exact in integers.
fn sqrt_normal(x: f32) -> f32 {
    const ONE: u32 = 1 << 23; // 1.0 as a 24-bit significand
    let bits = x.to_bits();
    let odd = (bits >> 23 & 1) ^ 1; // the unbiased exponent is odd when the biased one (bias 127) is even
    let a = f32::from_bits((bits & (ONE - 1)) | ((127 + odd) << 23)); // in [1, 4)

    // 1/√a from the classic bit trick (3.4 % off), two Newton steps (5e-6), then one for √a.
    let mut r = f32::from_bits(0x5f37_5a86 - (a.to_bits() >> 1));
    r = r * (1.5 - 0.5 * a * r * r);
    r = r * (1.5 - 0.5 * a * r * r);
    let s = a * r;
    let s = s + 0.5 * r * (a - s * s);

    // √a = y/2^23 with y² nearest to m: y is right when −y < m − y² ≤ y (the midpoints (y ± ½)² are no integers).
    let mut y = (s * ONE as f32) as u32;
    let m = (((bits & (ONE - 1)) | ONE) as u64) << (23 + odd);
    let rest = m as i64 - (y as u64 * y as u64) as i64;
    if rest > y as i64 {
        y += 1;
    } else if rest <= -(y as i64) {
        y -= 1;
    }
    let exponent = ((bits >> 23) + 127 - odd) >> 1;
    f32::from_bits((exponent << 23).wrapping_add(y.wrapping_sub(ONE)))
}

/// Cube root of a positive normal number; relative error ≤ 3e-7. Zero and below give zero.
pub fn cbrt(x: f32) -> f32 {
    if x <= 0.0 {
        return 0.0;
    }
    // A third of the exponent, 3 % off (Kahan's constant), then Newton's method three times.
    let mut y = f32::from_bits(x.to_bits() / 3 + 0x2a51_37a0);
    for _ in 0..3 {
        y = (2.0 * y + x / (y * y)) * (1.0 / 3.0);
    }
    y
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    fn sweep(from: f64, to: f64, steps: usize) -> impl Iterator<Item = f32> {
        (0..=steps).map(move |i| (from + (to - from) * i as f64 / steps as f64) as f32)
    }

    #[test]
    fn sine_and_cosine_stay_within_their_bound() {
        for (range, bound) in [(20.0, 1e-7), (SIN_COS_MAX as f64, 1e-7)] {
            let mut worst = 0.0_f64;
            for x in sweep(-range, range, 2_000_003) {
                let (s, c) = sin_cos(x);
                worst = worst
                    .max((s as f64 - (x as f64).sin()).abs())
                    .max((c as f64 - (x as f64).cos()).abs());
            }
            assert!(worst <= bound, "±{range} rad: {worst:e}");
        }
    }

    #[test]
    fn arcus_tangent_of_all_quadrants_stays_within_its_bound() {
        let mut worst = 0.0_f64;
        for angle in sweep(-PI as f64, PI as f64, 400_001) {
            for radius in [1e-20, 1e-3, 1.0, 7.3, 1e20_f64] {
                let (x, y) = (
                    (radius * (angle as f64).cos()) as f32,
                    (radius * (angle as f64).sin()) as f32,
                );
                worst = worst.max((atan2(y, x) as f64 - (y as f64).atan2(x as f64)).abs());
            }
        }
        assert!(worst <= 3e-7, "{worst:e}");
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert_eq!(atan2(0.0, -1.0), PI);
        assert_eq!(atan2(-1.0, 0.0), -FRAC_PI_2);
    }

    #[test]
    fn arcus_sine_and_cosine_stay_within_their_bounds_and_outside_one_they_saturate() {
        let mut worst = 0.0_f64;
        for x in sweep(-1.0, 1.0, 1_000_003) {
            worst = worst
                .max((acos(x) as f64 - (x as f64).acos()).abs())
                .max((asin(x) as f64 - (x as f64).asin()).abs());
        }
        assert!(worst <= 4e-7, "{worst:e}");
        assert_eq!((acos(1.1), acos(-1.1), asin(1.1)), (0.0, PI, FRAC_PI_2));
    }

    #[test]
    fn wrapping_takes_off_whole_turns() {
        for x in sweep(-60.0, 60.0, 100_001) {
            let w = wrap(x);
            let turns = (x as f64 - w as f64) / std::f64::consts::TAU;
            assert!(
                w.abs() <= PI + 4e-6 && (turns - turns.round()).abs() < 1e-7,
                "{x} → {w}"
            );
        }
    }

    /// Every significand of an even and of an odd exponent: all other normal numbers differ only in the exponent.
    #[test]
    fn square_root_is_correctly_rounded_for_every_significand() {
        for bits in 0x3f80_0000..0x4080_0000_u32 {
            let x = f32::from_bits(bits);
            assert_eq!(sqrt(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
        }
    }

    #[test]
    fn cube_root_stays_within_its_bound() {
        let mut worst = 0.0_f64;
        for i in 0..200_000 {
            let x = (10.0_f64).powf(-24.0 + 48.0 * i as f64 / 2e5) as f32;
            worst = worst.max((cbrt(x) as f64 / (x as f64).cbrt() - 1.0).abs());
        }
        assert!(worst <= 3e-7, "{worst:e}");
        assert_eq!((cbrt(0.0), cbrt(-1.0)), (0.0, 0.0));
    }

    #[test]
    fn square_root_holds_at_the_edges() {
        for x in [
            f32::MIN_POSITIVE,
            f32::from_bits(1),
            f32::from_bits(0x007f_ffff),
            f32::MAX,
            0.0,
            f32::INFINITY,
            4.0,
        ] {
            assert_eq!(sqrt(x), x.sqrt(), "{x:e}");
        }
        for exponent in 1..255_u32 {
            let x = f32::from_bits(exponent << 23 | 0x2a_5a5a);
            assert_eq!(sqrt(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
        }
        assert_eq!(sqrt(-1e-9), 0.0);
        assert!(sqrt(f32::NAN).is_nan());
    }
}
