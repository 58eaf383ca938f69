//! Where the seam begins: until then nobody knows where the sheet's edge is, and a single sighting may be wrong.

use super::seam::CLOSE;
use crate::geometry::Pose;
use crate::geometry::rotation::length;
use crate::job::correction::Use;
use nalgebra::Vector3;

/// The first sightings must lie within this of the line along which the operator placed the nozzle, and of each other, m: a bent part's 2 mm, its
/// slope over the lead, and the operator's error.
const REACH: f32 = 0.010;

/// The last sighting of each slit, Σ_B; by default none.
#[derive(Clone, Copy, Debug, Default)]
pub struct Beginning {
    before: [Option<Vector3<f32>>; 2],
}

impl Beginning {
    /// Takes in a sighting by `slit` at `point` (m, Σ_B), with the nozzle placed at `start` (T_b_n): of use if the same slit's last lies on a line
    /// with it in that direction.
    pub fn take(&mut self, slit: u8, point: &Vector3<f32>, start: &Pose) -> Use {
        let along: Vector3<f32> = start.r.column(0).into();
        let aside = |way: Vector3<f32>| length(&(way - along * along.dot(&way)));
        let near = aside(point - start.p) <= REACH; // false for what is no number
        let Some(place) = self.before.get_mut(usize::from(slit)).filter(|_| near) else {
            return Use::Outlier;
        };
        let agrees = |before: Vector3<f32>| length(&(point - before)) <= REACH && aside(point - before) <= CLOSE;
        match place.replace(*point) {
            Some(before) if agrees(before) => Use::Used,
            _ => Use::Waiting,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_sightings_of_the_same_slit_in_line_with_the_nozzle_are_the_beginning() {
        let start = Pose::identity();
        let mut beginning = Beginning::default();
        for (slit, x, y, expected) in [
            (0, 0.001, 0.020, Use::Outlier),
            (0, 0.001, 0.001, Use::Waiting),
            (1, 0.022, 0.002, Use::Waiting),
            (0, 0.003, 0.004, Use::Waiting),
            (1, 0.024, 0.0021, Use::Used),
            (0, 0.005, f32::NAN, Use::Outlier),
            (2, 0.024, 0.0021, Use::Outlier),
        ] {
            let fate = beginning.take(slit, &Vector3::new(x, y, 0.0), &start);
            assert_eq!(fate, expected, "slit {slit} at {x} m, {y} m");
        }
    }
}
