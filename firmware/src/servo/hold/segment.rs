//! One piece of a hold: a function of station from a start to an end, for all channels.

use super::{CHANNELS, Channels, Held};
use hal::{wire_enum, wire_struct};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
enum Shape {
    /// The start value, and the end value from the end on.
    #[default]
    Rest,
    /// A polynomial in t = (station − start)/length.
    Polynomial,
    /// (6.9), (6.10): accelerates over the first half and brakes over the second; c₀ is the start and c₁ the way.
    Parabolas,
}

wire_enum!(Shape {
    Rest,
    Polynomial,
    Parabolas
});

/// One piece of a hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    start: f32,
    end: f32,
    shape: Shape,
    /// Per channel, c₀ first.
    coefficients: [[f32; 6]; CHANNELS],
}

wire_struct!(Segment {
    start: f32,
    end: f32,
    shape: Shape,
    coefficients: [[f32; 6]; CHANNELS]
});

impl Segment {
    /// Station at which it ends, m; infinite if nothing ends it.
    pub fn end(&self) -> f32 {
        self.end
    }

    /// `value` for ever.
    pub fn rest(start: f32, value: &Channels) -> Self {
        Self::rest_until(start, f32::INFINITY, value, value)
    }

    /// `from`, jumping to `to` at the end.
    pub fn rest_until(start: f32, end: f32, from: &Channels, to: &Channels) -> Self {
        let coefficients = core::array::from_fn(|i| [from[i], to[i], 0.0, 0.0, 0.0, 0.0]);
        Self {
            start,
            end,
            shape: Shape::Rest,
            coefficients,
        }
    }

    /// A straight line.
    pub fn line(start: f32, end: f32, from: &Channels, to: &Channels) -> Self {
        let coefficients = core::array::from_fn(|i| [from[i], to[i] - from[i], 0.0, 0.0, 0.0, 0.0]);
        Self {
            start,
            end,
            shape: Shape::Polynomial,
            coefficients,
        }
    }

    /// Rest to rest by two parabolas: greatest curvature 4 Δ/length².
    pub fn parabolas(start: f32, end: f32, from: &Channels, to: &Channels) -> Self {
        Self {
            shape: Shape::Parabolas,
            ..Self::line(start, end, from, to)
        }
    }

    /// From `state` to rest, the value where it comes to: slope goes to zero by a cubic in the distance.
    pub fn decay(start: f32, length: f32, state: &Held) -> Self {
        let coefficients = core::array::from_fn(|i| {
            let (v, a) = (state.slope[i] * length, state.curvature[i] * length * length);
            // Slope v + a t − (3v + 2a) t² + (2v + a) t³, integrated.
            [
                state.value[i],
                v,
                0.5 * a,
                -(v + a * (2.0 / 3.0)),
                0.5 * v + 0.25 * a,
                0.0,
            ]
        });
        Self {
            start,
            end: start + length,
            shape: Shape::Polynomial,
            coefficients,
        }
    }

    /// The quintic with value, slope and curvature of `from` at the start and of `to` at the end.
    pub fn quintic(start: f32, end: f32, from: &Held, to: &Held) -> Self {
        let h = end - start;
        let coefficients = core::array::from_fn(|i| {
            let (v0, v1) = (from.slope[i] * h, to.slope[i] * h);
            let (a0, a1) = (from.curvature[i] * h * h, to.curvature[i] * h * h);
            let way = to.value[i] - from.value[i];
            [
                from.value[i],
                v0,
                0.5 * a0,
                10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
                -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
                6.0 * way - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1,
            ]
        });
        Self {
            start,
            end,
            shape: Shape::Polynomial,
            coefficients,
        }
    }

    /// Share of the way at `station` (m), 0 to 1; `rate` is one over the length.
    fn share(&self, station: f32, rate: f32) -> f32 {
        let t = if station >= self.end {
            1.0
        } else {
            (station - self.start) * rate
        };
        if t > 0.0 { t } else { 0.0 }
    }

    /// Value at `station` (m), not before the start nor beyond the end.
    pub fn value(&self, station: f32) -> Channels {
        if self.shape != Shape::Polynomial {
            return self.state(station).value;
        }
        let t = self.share(station, 1.0 / (self.end - self.start));
        let at = |c: &[f32; 6]| ((((c[5] * t + c[4]) * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0];
        let [one, two, three] = &self.coefficients;
        [at(one), at(two), at(three)]
    }

    /// Value, slope and curvature at `station` (m), not before the start nor beyond the end.
    pub fn state(&self, station: f32) -> Held {
        let rate = 1.0 / (self.end - self.start);
        let t = self.share(station, rate);
        let [one, two, three] = self.coefficients.each_ref().map(|c| {
            let (value, slope, curvature) = match self.shape {
                Shape::Rest => (if station >= self.end { c[1] } else { c[0] }, 0.0, 0.0),
                Shape::Parabolas if t < 0.5 => (c[0] + 2.0 * t * t * c[1], 4.0 * t * c[1], 4.0 * c[1]),
                Shape::Parabolas => {
                    let left = 1.0 - t;
                    (c[0] + (1.0 - 2.0 * left * left) * c[1], 4.0 * left * c[1], -4.0 * c[1])
                }
                Shape::Polynomial => (
                    ((((c[5] * t + c[4]) * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0],
                    (((5.0 * c[5] * t + 4.0 * c[4]) * t + 3.0 * c[3]) * t + 2.0 * c[2]) * t + c[1],
                    ((20.0 * c[5] * t + 12.0 * c[4]) * t + 6.0 * c[3]) * t + 2.0 * c[2],
                ),
            };
            [value, slope * rate, curvature * rate * rate]
        });
        Held {
            value: [one[0], two[0], three[0]],
            slope: [one[1], two[1], three[1]],
            curvature: [one[2], two[2], three[2]],
            starved: false,
        }
    }
}
