//! Rigid poses.

use hal::wire::{Sink, Wire};
use nalgebra::{Matrix3, Vector3};

/// Pose of a frame B in a frame A, named `T_a_b`: a point known in B is `T_a_b * p_b` in A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation: columns are B's axes in A.
    pub r: Matrix3<f32>,
    /// Origin of B in A, m.
    pub p: Vector3<f32>,
}

impl Pose {
    /// A and B coincide.
    pub fn identity() -> Self {
        Self {
            r: Matrix3::identity(),
            p: Vector3::zeros(),
        }
    }

    /// The inverse pose, A in B.
    pub fn inverse(&self) -> Self {
        let r = self.r.transpose();
        Self { r, p: -(r * self.p) }
    }
}

impl core::ops::Mul for Pose {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        Self {
            r: self.r * rhs.r,
            p: self.r * rhs.p + self.p,
        }
    }
}

impl core::ops::Mul<Vector3<f32>> for Pose {
    type Output = Vector3<f32>;
    fn mul(self, point: Vector3<f32>) -> Vector3<f32> {
        self.r * point + self.p
    }
}

/// Rotation column by column, then position.
impl Wire for Pose {
    const BYTES: usize = 48;
    fn write(&self, sink: &mut impl Sink) {
        for column in self.r.column_iter().chain(core::iter::once(self.p.column(0))) {
            for value in column.iter() {
                value.write(sink);
            }
        }
    }
    fn read(source: &mut &[u8]) -> Option<Self> {
        let [x, y, z, p]: [[f32; 3]; 4] = Wire::read(source)?;
        Some(Self { r: Matrix3::from_columns(&[x.into(), y.into(), z.into()]), p: p.into() })
    }
}
