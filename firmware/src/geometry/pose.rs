//! Rigid poses.

use super::rotation::{product, rotate};
use hal::wire::{Sink, Wire};
use nalgebra::{ArrayStorage, Matrix3, Vector3};

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

    /// A point known in B, in A.
    fn carry(&self, point: &Vector3<f32>) -> Vector3<f32> {
        rotate(&self.r, point) + self.p
    }

    /// The pose moved by `height` (m) along B's own z axis.
    pub fn raised(mut self, height: f32) -> Self {
        self.p += self.r.column(2) * height;
        self
    }

    /// The inverse pose, A in B.
    pub fn inverse(&self) -> Self {
        let r = self.r.transpose();
        Self { r, p: -(r * self.p) }
    }
}

impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

/// Twelve numbers: the columns of `r`, then `p`.
impl Wire for Pose {
    const BYTES: usize = 12 * f32::BYTES;
    const EMPTY: Self = Self {
        r: Matrix3::from_array_storage(ArrayStorage([[0.0; 3]; 3])),
        p: Vector3::from_array_storage(ArrayStorage([[0.0; 3]; 1])),
    };
    fn write(&self, sink: &mut impl Sink) {
        self.r.data.0.write(sink);
        self.p.data.0.write(sink);
    }
    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        self.r.data.0.fill(source)?;
        self.p.data.0.fill(source)
    }
}

impl core::ops::Mul for Pose {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        Self {
            r: product(&self.r, &rhs.r),
            p: self.carry(&rhs.p),
        }
    }
}

impl core::ops::Mul<Vector3<f32>> for Pose {
    type Output = Vector3<f32>;
    fn mul(self, point: Vector3<f32>) -> Vector3<f32> {
        self.carry(&point)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::geometry::rotation::{rot_x, rot_z};

    struct Bytes(std::vec::Vec<u8>);
    impl Sink for Bytes {
        fn put(&mut self, bytes: &[u8]) {
            self.0.extend_from_slice(bytes);
        }
    }

    #[test]
    fn a_pose_reads_back_from_its_bytes_and_a_short_source_gives_none() {
        let pose = Pose {
            r: rot_x(0.3) * rot_z(-1.2),
            p: Vector3::new(0.1, -0.2, 0.3),
        };
        let mut bytes = Bytes(std::vec::Vec::new());
        pose.write(&mut bytes);
        assert_eq!(bytes.0.len(), Pose::BYTES);
        assert_eq!(Pose::read(&mut bytes.0.as_slice()), Some(pose));
        assert_eq!(Pose::read(&mut &bytes.0[..47]), None);
    }

    #[test]
    fn a_pose_times_its_inverse_is_the_identity() {
        let pose = Pose {
            r: rot_x(0.3) * rot_z(-1.2),
            p: Vector3::new(0.1, -0.2, 0.3),
        };
        let one = pose * pose.inverse();
        assert!((one.r - Matrix3::identity()).iter().all(|e| e.abs() < 3e-7));
        assert!(one.p.iter().all(|e| e.abs() < 1e-7));
    }
}
