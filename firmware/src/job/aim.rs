//! Where a tip is to be and which way it is to point, and nothing about how it is turned about itself: what five axes can reach, and
//! all that a tool that is round asks for.

use crate::geometry::Pose;
use crate::geometry::rotation::unit;
use hal::wire::{Sink, Wire};
use nalgebra::Vector3;

/// A place and a direction, in Σ_B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// Of the tip, m.
    pub point: Vector3<f32>,
    /// Of the tip's z, out of the work; of length one.
    pub direction: Vector3<f32>,
}

impl Aim {
    /// That of a tip at this pose, T_b_n.
    pub fn of(tip: &Pose) -> Self {
        Self {
            point: tip.p,
            direction: Vector3::new(tip.r.m13, tip.r.m23, tip.r.m33),
        }
    }

    /// The aim at `share`, 0 to 1, of the straight way to `other`; the direction goes along the chord, which up to 60° is within 1° of an even
    /// turn. Opposite directions have none between: it stays the first.
    pub fn toward(&self, other: &Self, share: f32) -> Self {
        let direction = self.direction + (other.direction - self.direction) * share;
        Self {
            point: self.point + (other.point - self.point) * share,
            direction: unit(&direction).unwrap_or(self.direction),
        }
    }
}

/// Six numbers: the point's, then the direction's.
impl Wire for Aim {
    const BYTES: usize = 6 * f32::BYTES;
    const EMPTY: Self = Self {
        point: Vector3::new(0.0, 0.0, 0.0),
        direction: Vector3::new(0.0, 0.0, 0.0),
    };

    fn write(&self, sink: &mut impl Sink) {
        [self.point, self.direction]
            .iter()
            .for_each(|v| <[f32; 3]>::from(*v).write(sink));
    }

    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        self.point = Vector3::from(<[f32; 3]>::read(source)?);
        self.direction = Vector3::from(<[f32; 3]>::read(source)?);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::rot_y;

    #[test]
    fn half_way_is_in_the_middle_of_both_and_of_length_one() {
        let at = |angle, x| {
            Aim::of(&Pose {
                r: rot_y(angle),
                p: Vector3::new(x, 0.0, 0.2),
            })
        };
        let middle = at(0.0, 0.3).toward(&at(1.0, 0.5), 0.5);
        assert!((middle.point - Vector3::new(0.4, 0.0, 0.2)).abs().max() < 1e-7);
        assert!((middle.direction - rot_y(0.5).column(2)).abs().max() < 1e-6);
    }
}
