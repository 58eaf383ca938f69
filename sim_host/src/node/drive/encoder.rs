//! The absolute multi-turn encoder on a motor shaft.

/// What the encoder shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncoderReading {
    /// Counts, multi-turn.
    pub counts: i32,
}

/// Resolution of an encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoder {
    /// Counts per revolution.
    pub counts_per_revolution: u32,
}

impl Encoder {
    /// The reading at a shaft angle: the count whose step the shaft is on, so the error is 0..1 count.
    pub fn read(&self, angle_rad: f64) -> EncoderReading {
        let counts = angle_rad * self.counts_per_revolution as f64 / (2.0 * std::f64::consts::PI);
        EncoderReading {
            counts: counts.floor() as i32,
        }
    }
}
