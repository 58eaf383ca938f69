//! The gap beside a lip's sheet, as the two slits together know it.
//!
//! The next sheet lies some millimetres lower, and a slit's plane is inclined: where the seam runs at a slant to it, the light goes over the
//! gap at that slant. So a gap of 1 mm over a drop of 3 mm is 16 rows long under a seam that turns by 20° one way, and none the other
//! way. One slit alone does not know the turn, and cannot tell the end of a sheet from a drop-out beside the gap. Two do: their points
//! give the chord, from which the tangents at the slits differ by the seam's curvature, to either side. So the gaps in both lights
//! are all but known, and each of them the better for what the other shows.

use super::pose::Cut;
use crate::geometry::rotation::unit;
use crate::vision::camera::Pinhole;
use crate::vision::edge::Edge;
use crate::vision::ending::{GAPS, Gap, Profile};
use crate::vision::joint::Joint;
use crate::vision::sensor::Find;
use nalgebra::Vector3;

/// Rows by which a gap looks shorter: half a row's blur at either end is still seen.
const BLUR: f32 = 1.7;
/// Standard deviation of both gaps' mean from the expected, rows: by a millimetre's error of the chord.
const MEAN_SIGMA: f32 = 0.5;
/// The same of half their difference: R150 turns by 4° between a slit and the chord, over 3 mm of drop.
const HALF_SIGMA: f32 = 1.2;

/// No length is less likely than by exp(−this): one slit's place may be wrong, and what the other shows shall then count more.
const UNLIKELY: f32 = 8.0;

/// A sheet's edge beside a gap.
#[derive(Clone, Copy, Debug)]
pub struct Lip {
    /// The sheet lies below its edge in the image, and begins there.
    begins: bool,
    /// Width of the gap, m.
    gap_m: f32,
}

/// What one slit saw.
pub struct Seen<'a> {
    /// The slit.
    pub slit: &'a Pinhole,
    /// What is found there by that slit alone, in pixels of the whole image.
    pub find: Find,
    /// Size of the step there, px.
    pub step: f32,
    /// What that says of the seam.
    pub cut: Cut,
}

impl Lip {
    /// That of `joint`, if it is one.
    pub fn of(joint: Joint) -> Option<Self> {
        match joint {
            Joint::Lip { sheet_left, gap_m, .. } => Some(Self {
                begins: !sheet_left,
                gap_m,
            }),
            _ => None,
        }
    }

    /// The edges that both slits together make likeliest, from what each saw and from what its rows say.
    pub fn agreed(&self, seen: [&Seen; 2], rows: [&Profile; 2]) -> Option<[Edge; 2]> {
        let ([near, ahead], [by_near, by_ahead]) = (seen, rows);
        let along = unit(&(ahead.cut.point - near.cut.point))?;
        let (at_near, at_ahead) = (self.expected(near, &along)?, self.expected(ahead, &along)?);
        Some([
            by_near.edge_beside(&given(at_near, at_ahead, by_ahead)),
            by_ahead.edge_beside(&given(at_ahead, at_near, by_near)),
        ])
    }

    /// Length of the gap in a slit's light, rows, where the seam runs in direction `along`; negative where both sheets' lines share rows.
    fn expected(&self, seen: &Seen, along: &Vector3<f32>) -> Option<f32> {
        let Seen { slit, find, step, cut } = seen;
        let normal = unit(&along.cross(&cut.direction))?;
        let left = normal.cross(along);
        let (side, next_x) = if self.begins {
            (self.gap_m, find.x - step)
        } else {
            (-self.gap_m, find.x + step)
        };
        // As deep as the next sheet shows itself to lie.
        let drop = (slit.point(next_x, find.y) - cut.point).dot(&normal);
        let across = left * side + normal * drop;
        // Where the next sheet's edge comes through the slit's plane, x + y·lean + z·tan = c.
        let level = |v: &Vector3<f32>| v.x + v.y * slit.slit_lean + v.z * slit.tan_slit;
        let edge = cut.point + across - along * (level(&across) / level(along));
        let [_, row] = slit.pixel(&edge);
        let rows = if self.begins { find.y - row } else { row - find.y };
        (rows * rows < 1e4).then_some(rows - BLUR)
    }
}

/// What is known of one slit's gap, if `expected` rows long, from what the rows say about that of the `other`.
fn given(expected: f32, other_expected: f32, other: &Profile) -> Gap {
    let shortest = Gap::shortest_about(expected);
    let other_shortest = Gap::shortest_about(other_expected);
    let others = other.gaps(other_shortest);
    let best = others.iter().fold(f32::MIN, |best, &value| best.max(value));
    let log_likelihood: [f32; GAPS] = core::array::from_fn(|index| {
        let off = (shortest + index as i32) as f32 - expected;
        let mut most = f32::MIN;
        for (gap, value) in (other_shortest..).zip(others) {
            let other_off = gap as f32 - other_expected;
            let (mean, half) = (0.5 * (off + other_off), 0.5 * (off - other_off));
            let price = 0.5 * (mean * mean / (MEAN_SIGMA * MEAN_SIGMA) + half * half / (HALF_SIGMA * HALF_SIGMA));
            most = most.max(value - best - price.min(UNLIKELY));
        }
        most
    });
    Gap {
        shortest,
        log_likelihood,
    }
}
