//! The joint's shape, fitted to the line.
//!
//! Near the seam the line is a cubic (the sheets: tilt, deformation, dents) plus the joint's own feature: a step for a lap
//! joint or a sheet's edge, a kink for a bend. The size of the feature is known within limits, and so is how much sheets
//! bend: both enter as Gaussian priors. For a place `r` (row) the fit's cost with the feature and without it are the
//! statistic by which places are compared; a local window keeps dents elsewhere out of it.

use super::edge::Change;
use super::number::{limit, sqrt};
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
    },
}

/// As its number in the order above, its flag, and its length or tangent.
impl Wire for Joint {
    const BYTES: usize = <(u8, (bool, f32))>::BYTES;

    const EMPTY: Self = Self::Vee { flank: 0.0 };

    fn write(&self, sink: &mut impl Sink) {
        match *self {
            Self::Crank { upper_left, sheet_m } => (0_u8, (upper_left, sheet_m)),
            Self::Vee { flank } => (1, (false, flank)),
            Self::Lip { sheet_left, drop_m } => (2, (sheet_left, drop_m)),
        }
        .write(sink);
    }

    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        *self = match <(u8, (bool, f32))>::read(source)? {
            (0, (upper_left, sheet_m)) => Self::Crank { upper_left, sheet_m },
            (1, (false, flank)) => Self::Vee { flank },
            (2, (sheet_left, drop_m)) => Self::Lip { sheet_left, drop_m },
            _ => return None,
        };
        Some(())
    }
}

/// Step of a lap joint over the sheet's thickness: between none and 0.25 mm of gap, assumed.
const GAP_FACTOR: f32 = 1.18;

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
            // Gaps of up to 0.25 mm make the step larger than the sheet, tilts of ±8° change it by ±14 %.
            Joint::Crank { upper_left, sheet_m } => Self {
                change: Some(Change::Exchange),
                size: signed(upper_left, GAP_FACTOR * sheet_m * px_per_m),
                spread: 0.22 * sheet_m * px_per_m,
                seam_below: upper_left,
            },
            Joint::Vee { flank } => Self {
                change: None,
                size: -flank * tan_slit * HALF_WINDOW as f32,
                spread: 0.25 * flank * tan_slit * HALF_WINDOW as f32,
                seam_below: false,
            },
            Joint::Lip { sheet_left, drop_m } => Self {
                change: Some(if sheet_left { Change::Ends } else { Change::Begins }),
                size: signed(sheet_left, drop_m * px_per_m),
                spread: 0.15 * drop_m * px_per_m,
                seam_below: !sheet_left,
            },
        }
    }

    /// Value at `below` rows below the seam.
    fn at(&self, below: f32) -> f32 {
        if self.change.is_some() {
            // Row blur spreads a step over about two rows.
            limit(0.5 + 0.5 * below, 0.0, 1.0)
        } else {
            below.max(-below) / HALF_WINDOW as f32
        }
    }
}

/// The line's centre in a row or a band.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Row, px.
    pub y: f32,
    /// Centre, px.
    pub x: f32,
    /// Weight, 0..=1 per row that it stands for.
    pub weight: f32,
}

/// Parameters of a fit: four of the cubic, one of the feature.
const PARAMETERS: usize = 5;
/// Standard deviations of the cubic's parameters over half a window, px: offset free; slope ±0.4 px per row (15° and tilts);
/// curvature and change of curvature of an undulation; a dent is rarer and must earn its bend against the prior.
const BEND: [f32; 4] = [100.0, 22.0, 2.0, 1.0];
/// Residuals beyond this many standard deviations of a row's centre count no more (Geman–McClure).
const OUTLIER: f32 = 3.0;
/// The first fits look wider, so that the line is found among outliers.
const WIDENING: [f32; 3] = [4.0, 2.0, 1.0];

/// A fit at one place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fit {
    parameters: [f32; PARAMETERS],
    origin: f32,
    offset: f32,
    /// Half the sum of squared, normalised and limited residuals, with the priors: minus the logarithm of the likelihood.
    pub cost: f32,
}

impl Fit {
    /// Column of the sheets' line (the side above a step) at row `y`, px.
    pub fn sheet(&self, y: f32) -> f32 {
        let u = (y - self.origin) / HALF_WINDOW as f32;
        let [a, b, c, d, _] = self.parameters;
        self.offset + a + u * (b + u * (c + u * d))
    }

    /// Slope of that line at row `y`, px per row.
    pub fn slope(&self, y: f32) -> f32 {
        let u = (y - self.origin) / HALF_WINDOW as f32;
        let [_, b, c, d, _] = self.parameters;
        (b + u * (2.0 * c + u * 3.0 * d)) / HALF_WINDOW as f32
    }

    /// Size of the feature, px.
    pub fn size(&self) -> f32 {
        let [.., size] = self.parameters;
        size
    }
}

/// Fits cubic and feature at row `seam` to `samples`; `origin` is the window's middle row, `sigma` the standard deviation of
/// a row's centre (px). Without `feature` the cubic alone.
pub fn fit(samples: &[Sample], origin: f32, seam: f32, feature: Option<&Feature>, sigma: f32) -> Fit {
    let near = |sample: &&Sample| sample.weight > 0.0;
    let Some(first) = samples.iter().find(near) else {
        return Fit::default();
    };
    let mut fit = Fit {
        parameters: [0.0; PARAMETERS],
        origin,
        offset: first.x,
        cost: 0.0,
    };
    let precision = 1.0 / (sigma * sigma);
    let basis = |y: f32| {
        let u = (y - origin) / HALF_WINDOW as f32;
        [
            1.0,
            u,
            u * u,
            u * u * u,
            feature.map_or(0.0, |feature| feature.at(y - seam)),
        ]
    };
    let (size, spread) = feature.map_or((0.0, 1.0), |feature| (feature.size, feature.spread));
    let expected = [0.0, 0.0, 0.0, 0.0, size];
    let deviation = [BEND[0], BEND[1], BEND[2], BEND[3], spread];
    for (round, widening) in WIDENING.into_iter().enumerate() {
        let limit = precision / (OUTLIER * OUTLIER * widening * widening);
        let mut normal = [[0.0_f32; PARAMETERS]; PARAMETERS];
        let mut right = [0.0_f32; PARAMETERS];
        for (index, (row, value)) in normal.iter_mut().zip(&mut right).enumerate() {
            for (column, element) in row.iter_mut().enumerate() {
                if column == index {
                    let d = deviation[index];
                    *element = 1.0 / (d * d);
                    *value = expected[index] / (d * d);
                }
            }
        }
        for sample in samples.iter().filter(near) {
            let basis = basis(sample.y);
            let mut weight = sample.weight * precision;
            if round > 0 {
                let residual = sample.x - fit.offset - dot(&basis, &fit.parameters);
                let drop = 1.0 / (1.0 + residual * residual * limit);
                weight *= drop * drop;
            }
            for ((row, value), left) in normal.iter_mut().zip(&mut right).zip(basis) {
                let weighted = weight * left;
                for (element, right) in row.iter_mut().zip(basis) {
                    *element += weighted * right;
                }
                *value += weighted * (sample.x - fit.offset);
            }
        }
        fit.parameters = solve(normal, right);
    }
    let limit = precision / (OUTLIER * OUTLIER);
    for sample in samples.iter().filter(near) {
        let residual = sample.x - fit.offset - dot(&basis(sample.y), &fit.parameters);
        let square = residual * residual;
        fit.cost += 0.5 * sample.weight * square * precision / (1.0 + square * limit);
    }
    for ((value, expected), deviation) in fit.parameters.iter().zip(expected).zip(deviation) {
        let away = (value - expected) / deviation;
        fit.cost += 0.5 * away * away;
    }
    fit
}

fn dot(a: &[f32; PARAMETERS], b: &[f32; PARAMETERS]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// Solves the symmetric positive definite system by Cholesky's factors.
fn solve(matrix: [[f32; PARAMETERS]; PARAMETERS], mut right: [f32; PARAMETERS]) -> [f32; PARAMETERS] {
    let mut lower = [[0.0_f32; PARAMETERS]; PARAMETERS];
    for row in 0..PARAMETERS {
        for column in 0..=row {
            let factors = lower[row].iter().zip(&lower[column]).take(column);
            let rest = factors.fold(matrix[row][column], |sum, (a, b)| sum - a * b);
            lower[row][column] = if row == column {
                // The priors keep the diagonal positive; the floor is for rounding.
                sqrt(rest.max(1e-9))
            } else {
                rest / lower[column][column]
            };
        }
    }
    for row in 0..PARAMETERS {
        let known = lower[row].iter().zip(&right).take(row);
        right[row] = known.fold(right[row], |sum, (l, x)| sum - l * x) / lower[row][row];
    }
    for row in (0..PARAMETERS).rev() {
        let known = lower.iter().zip(&right).skip(row + 1);
        right[row] = known.fold(right[row], |sum, (l, x)| sum - l[row] * x) / lower[row][row];
    }
    right
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
