//! The joint's shape, as the line shows it.
//!
//! Near the seam the line is a cubic (the sheets: tilt, deformation, dents) plus the joint's own feature: a step for a lap
//! joint or a sheet's edge, a kink for a bend. The size of the feature is known within limits. For a place the cost of the
//! `fit` with the feature and without it are the statistic by which places are compared; a local window keeps
//! dents elsewhere out of it.

use super::edge::Change;
use hal::wire::{Sink, Wire};

/// Shape of the joint across the seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Joint {
    /// Lap joint; the seam is the foot of the upper sheet's edge.
    Crank {
        /// The upper sheet lies to the left of travel (+y of Σ_S, up in the image).
        upper_left: bool,
        /// Thickness of the upper sheet, m.
        sheet_m: f32,
    },
    /// Bend; the seam is the bottom of the valley.
    Vee {
        /// Tangent of the inclination of each flank.
        flank: f32,
    },
    /// Sheet edge beside a hole or drop; the seam is the upper corner of the edge.
    Lip {
        /// The sheet lies to the left of travel.
        sheet_left: bool,
        /// How far the next sheet lies below, m.
        drop_m: f32,
        /// Width of the gap between the two sheets' edges, m.
        gap_m: f32,
    },
}

impl Joint {
    /// Height over the seam's sheet of the edge that a grey image shows, m: what a start pose needs to know of the joint.
    pub fn edge_height(self) -> f32 {
        match self {
            Self::Crank { sheet_m, .. } => sheet_m,
            Self::Vee { .. } | Self::Lip { .. } => 0.0,
        }
    }

    /// Rise of each flank of a bend over its valley, as a tangent; zero where sheets lie on or beside each other.
    pub fn flank(self) -> f32 {
        match self {
            Self::Vee { flank } => flank,
            Self::Crank { .. } | Self::Lip { .. } => 0.0,
        }
    }

    /// Whether the seam is a bend's.
    pub fn is_bend(self) -> bool {
        matches!(self, Self::Vee { .. })
    }
}

/// As its number in the order above, its flag, its length or tangent, and the width of its gap.
impl Wire for Joint {
    const BYTES: usize = <((u8, bool), (f32, f32))>::BYTES;

    const EMPTY: Self = Self::Vee { flank: 0.0 };

    fn write(&self, sink: &mut impl Sink) {
        match *self {
            Self::Crank { upper_left, sheet_m } => ((0_u8, upper_left), (sheet_m, 0.0)),
            Self::Vee { flank } => ((1, false), (flank, 0.0)),
            Self::Lip {
                sheet_left,
                drop_m,
                gap_m,
            } => ((2, sheet_left), (drop_m, gap_m)),
        }
        .write(sink);
    }

    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        *self = match <((u8, bool), (f32, f32))>::read(source)? {
            ((0, upper_left), (sheet_m, _)) => Self::Crank { upper_left, sheet_m },
            ((1, false), (flank, _)) => Self::Vee { flank },
            ((2, sheet_left), (drop_m, gap_m)) => Self::Lip {
                sheet_left,
                drop_m,
                gap_m,
            },
            _ => return None,
        };
        Some(())
    }
}

/// Gap under a lapped sheet, in the mean, m: of none to 0.25 mm, assumed.
const LAP_GAP_M: f32 = 0.000_11;
/// Standard deviation of a lap joint's step: by the gap, m, …
const LAP_GAP_SIGMA_M: f32 = 0.000_072;
/// … and by tilts of ±8°, of the sheet's thickness.
const LAP_TILT_SIGMA: f32 = 0.1;

/// Half the window of a fit, rows: 7.2 mm. Wider than the ±14 bands of 3 rows with which a local fit did best on dented plates
/// (sealing.md, chapter 2), because here priors keep the cubic from following dents that are not there.
pub const HALF_WINDOW: usize = 60;

/// The feature that a joint adds to the line, and what is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Feature {
    /// How the line changes at the seam; `None` for a kink, which has no edge.
    pub change: Option<Change>,
    /// Expected size, px: of the step from above to below; of the kink, its change over half a window.
    pub size: f32,
    /// Standard deviation of the size, px.
    pub spread: f32,
    /// The seam point lies on the line below (after) the step, not above it.
    pub seam_below: bool,
}

impl Feature {
    /// The feature of `joint` in an image with `pixel_m` metres per pixel under a slit of inclination `tan_slit`.
    pub fn of(joint: Joint, pixel_m: f32, tan_slit: f32) -> Self {
        let px_per_m = tan_slit / pixel_m;
        let signed = |up: bool, size: f32| if up { size } else { -size };
        match joint {
            Joint::Crank { upper_left, sheet_m } => Self {
                change: Some(Change::Exchange),
                size: signed(upper_left, (sheet_m + LAP_GAP_M) * px_per_m),
                spread: (LAP_GAP_SIGMA_M + LAP_TILT_SIGMA * sheet_m) * px_per_m,
                seam_below: upper_left,
            },
            Joint::Vee { flank } => Self {
                change: None,
                size: -flank * tan_slit * HALF_WINDOW as f32,
                spread: 0.12 * flank * tan_slit * HALF_WINDOW as f32,
                seam_below: false,
            },
            Joint::Lip { sheet_left, drop_m, .. } => Self {
                change: Some(if sheet_left { Change::Ends } else { Change::Begins }),
                size: signed(sheet_left, drop_m * px_per_m),
                spread: 0.15 * drop_m * px_per_m,
                seam_below: !sheet_left,
            },
        }
    }

    /// How far the line steps aside, px; a kink does not.
    pub fn step(&self) -> f32 {
        if self.change.is_some() { self.size } else { 0.0 }
    }

    /// Value at `below` rows below the seam.
    pub fn at(&self, below: f32) -> f32 {
        if self.change.is_some() {
            // Row blur spreads a step over about two rows.
            if below >= 1.0 {
                1.0
            } else if below <= -1.0 {
                0.0
            } else {
                0.5 + 0.5 * below
            }
        } else {
            (if below < 0.0 { -below } else { below }) / HALF_WINDOW as f32
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    struct Bytes(Vec<u8>);

    impl Sink for Bytes {
        fn put(&mut self, bytes: &[u8]) {
            self.0.extend_from_slice(bytes);
        }
    }

    #[test]
    fn every_joint_is_read_as_it_was_written_and_a_fourth_kind_is_none() {
        let crank = Joint::Crank {
            upper_left: true,
            sheet_m: 0.0006,
        };
        let lip = Joint::Lip {
            sheet_left: false,
            drop_m: 0.002,
            gap_m: 0.001,
        };
        for joint in [crank, lip, Joint::Vee { flank: 0.5 }] {
            let mut bytes = Bytes(Vec::new());
            joint.write(&mut bytes);
            assert_eq!(bytes.0.len(), Joint::BYTES);
            assert_eq!(Joint::read(&mut bytes.0.as_slice()), Some(joint));
            bytes.0[0] = 3;
            assert_eq!(Joint::read(&mut bytes.0.as_slice()), None);
        }
    }
}
