//! How far along the seam each raw point lies, before anything is fitted.
//!
//! Points come in the order of their exposures, which is nearly that of their distances: the second slit is ahead of the first, at the start the
//! sensor stands, and some points are wrong. Medians of a few successive points of the first slit make a chain that wrong ones do not bend;
//! each point's distance is that of its foot on the part of the chain that was seen about the same time.

use super::collect::RawPoint;
use nalgebra::Vector3;

/// Points of which one link's end is the median, coordinate by coordinate.
const MEDIAN: usize = 5;
/// Shortest link, m: well over the noise of a median.
const LINK: f64 = 0.004;
/// Links about a point's own, in the order of exposure, in which its foot is searched: 30 mm and more.
const AROUND: usize = 10;

/// A point's place along the chain.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    /// Distance along the chain, m; beyond its ends along the first and last links.
    pub t: f64,
    /// Distance of the point from the chain, m.
    pub away: f64,
}

/// Foot of each point, in the points' order; `None` if there is no chain of two links.
pub fn feet(points: &[RawPoint]) -> Option<Vec<Foot>> {
    // Links' ends, with the index of the middle one of the points that each was made of.
    let mut ends: Vec<(usize, Vector3<f64>)> = Vec::new();
    let first_slit: Vec<(usize, &RawPoint)> = points.iter().enumerate().filter(|(_, raw)| raw.slit == 0).collect();
    for window in first_slit.windows(MEDIAN) {
        let middle = Vector3::from_fn(|axis, _| {
            let mut values: Vec<f64> = window.iter().map(|(_, raw)| raw.point[axis]).collect();
            values.sort_by(f64::total_cmp);
            values[MEDIAN / 2]
        });
        if ends.last().is_none_or(|(_, last)| (middle - last).norm() >= LINK) {
            ends.push((window[MEDIAN / 2].0, middle));
        }
    }
    if ends.len() < 3 {
        return None;
    }
    let mut distances = vec![0.0];
    for pair in ends.windows(2) {
        distances.push(distances[distances.len() - 1] + (pair[1].1 - pair[0].1).norm());
    }
    let links = ends.len() - 1;
    let foot = |(index, raw): (usize, &RawPoint)| {
        let own = ends.partition_point(|(at, _)| *at <= index).saturating_sub(1);
        let range = own.saturating_sub(AROUND)..(own + AROUND).min(links);
        range
            .map(|link| {
                let (from, to) = (ends[link].1, ends[link + 1].1);
                let length = (to - from).norm();
                let along = (raw.point - from).dot(&(to - from)) / length;
                let low = if link == 0 { f64::NEG_INFINITY } else { 0.0 };
                let high = if link == links - 1 { f64::INFINITY } else { length };
                let along = along.clamp(low, high);
                Foot {
                    t: distances[link] + along,
                    away: (raw.point - from - (to - from) * (along / length)).norm(),
                }
            })
            .min_by(|a, b| a.away.total_cmp(&b.away))
    };
    points.iter().enumerate().map(foot).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(x: f64, y: f64, slit: u8) -> RawPoint {
        RawPoint {
            point: Vector3::new(x, y, 0.0),
            across: Vector3::y(),
            slit,
            sigma: 1e-4,
        }
    }

    #[test]
    fn distances_are_right_through_a_rest_at_the_start_wrong_points_and_a_second_slit() {
        let mut points = vec![raw(0.002, 0.0, 0); 20];
        for k in 0..60 {
            let x = 0.002 + 0.0035 * f64::from(k);
            points.push(raw(x, if k % 11 == 5 { 0.006 } else { 0.0 }, 0));
            points.push(raw(x + 0.021, 0.0, 1));
        }
        let feet = feet(&points).unwrap();
        let start = feet[0].t;
        for (foot, point) in feet.iter().zip(&points) {
            let x = point.point.x - 0.002;
            assert!((foot.t - start - x).abs() < 1e-3, "{} m for {x} m", foot.t - start);
        }
        assert!(feet.iter().filter(|foot| foot.away > 3e-3).count() == 5);
    }

    #[test]
    fn a_heap_of_points_in_one_place_is_no_seam() {
        assert!(feet(&[raw(0.0, 0.0, 0); 50]).is_none());
    }
}
