//! The one comparison that this room needs beside [`crate::geometry::trig`].

/// `value` held within `low..=high`. (`f32::clamp` panics on a wrong order, and the core must not panic.)
pub fn limit(value: f32, low: f32, high: f32) -> f32 {
    let floored = if value > low { value } else { low };
    if floored < high { floored } else { high }
}
