//! Least squares of a joint's shape: a cubic for the sheets and the joint's feature, robust against outliers.
//!
//! Priors say how much sheets bend and how large the feature is; residuals beyond a few standard deviations lose their
//! weight (Geman–McClure), by reweighted rounds of fixed number. The powers of one variable make the normal matrix a matter
//! of seven sums, and the feature adds six.

use super::joint::{Feature, HALF_WINDOW};
use super::window::Sample;

/// Parameters of a fit: four of the cubic, one of the feature.
const PARAMETERS: usize = 5;
/// Standard deviations of the cubic's parameters over half a window, px: offset free; slope ±0.4 px per row (15° and tilts);
/// curvature and change of curvature of an undulation; a dent is rarer and must earn its bend against the prior.
const BEND: [f32; 4] = [100.0, 22.0, 1.6, 0.5];
/// Residuals beyond this many standard deviations of a row's centre count no more.
const OUTLIER: f32 = 3.0;
/// The rounds after the first, unweighted one look wider at first, so that the line is found among outliers.
const WIDENING: [f32; 2] = [2.0, 1.0];
/// Rows to the unit of the cubic's variable.
const PER_ROW: f32 = 1.0 / HALF_WINDOW as f32;

/// Most samples of a fit: two rows each over its window.
pub const SAMPLES_MAX: usize = HALF_WINDOW;

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
        let u = (y - self.origin) * PER_ROW;
        let [a, b, c, d, _] = self.parameters;
        self.offset + a + u * (b + u * (c + u * d))
    }

    /// Slope of that line at row `y`, px per row.
    pub fn slope(&self, y: f32) -> f32 {
        let u = (y - self.origin) * PER_ROW;
        let [_, b, c, d, _] = self.parameters;
        (b + u * (2.0 * c + u * 3.0 * d)) * PER_ROW
    }

    /// Size of the feature, px.
    pub fn size(&self) -> f32 {
        let [.., size] = self.parameters;
        size
    }
}

/// What is to be fitted.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The line's centres, [`SAMPLES_MAX`] at most; those without weight are passed over.
    pub samples: &'a [Sample],
    /// The window's middle row.
    pub origin: f32,
    /// Standard deviation of a row's centre, px.
    pub sigma: f32,
    /// The feature, or `None` for the cubic alone.
    pub feature: Option<&'a Feature>,
}

impl Problem<'_> {
    /// Fits without the feature, and with it at row `seam`.
    pub fn without_and_with(&self, seam: f32) -> [Fit; 2] {
        let Some(first) = self.seen().next() else {
            return [Fit::default(); 2];
        };
        let start = Fit {
            origin: self.origin,
            offset: first.x,
            ..Fit::default()
        };
        let mut weights = [0.0; SAMPLES_MAX];
        // With nothing yet to be an outlier of, both have the same sums.
        let precision = 1.0 / (self.sigma * self.sigma);
        for (weight, sample) in weights.iter_mut().zip(self.samples) {
            *weight = sample.weight * precision;
        }
        let moments = self.moments(start.offset, &weights);
        let unweighted = weights;
        [None, self.feature].map(|feature| {
            let problem = Self { feature, ..*self };
            let first = problem.solved(seam, &start, moments, &unweighted);
            let fit = WIDENING.into_iter().fold(first, |fit, widening| {
                problem.round(seam, &fit, self.outlier() / (widening * widening), &mut weights)
            });
            problem.priced(seam, fit)
        })
    }

    /// The same, from the fit at a place nearby: one round suffices.
    pub fn refit(&self, seam: f32, nearby: &Fit) -> Fit {
        self.priced(seam, self.round(seam, nearby, self.outlier(), &mut [0.0; SAMPLES_MAX]))
    }

    fn seen(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|sample| sample.weight > 0.0)
    }

    /// A squared residual times this is 1 where it begins to count less.
    fn outlier(&self) -> f32 {
        1.0 / (self.sigma * self.sigma * OUTLIER * OUTLIER)
    }

    /// A sample's place in the cubic's variable.
    fn variable(&self, sample: &Sample) -> f32 {
        (sample.y - self.origin) * PER_ROW
    }

    /// A sample's residual from `fit`.
    fn residual(&self, sample: &Sample, seam: f32, fit: &Fit) -> f32 {
        let u = self.variable(sample);
        let feature = self.feature.map_or(0.0, |feature| feature.at(sample.y - seam));
        let [a, b, c, d, size] = fit.parameters;
        let value = a + u * (b + u * (c + u * d)) + size * feature;
        sample.x - fit.offset - value
    }

    fn prior(&self) -> ([f32; PARAMETERS], [f32; PARAMETERS]) {
        let (size, spread) = self
            .feature
            .map_or((0.0, 1.0), |feature| (feature.size, feature.spread));
        let [a, b, c, d] = BEND;
        ([0.0, 0.0, 0.0, 0.0, size], [a, b, c, d, spread])
    }

    /// Weighted least squares; the weights are those of the residuals from `fit`, and stay in `weights`.
    fn round(&self, seam: f32, fit: &Fit, outlier: f32, weights: &mut [f32; SAMPLES_MAX]) -> Fit {
        // Three passes with few sums each: all of them together do not fit into the registers of the processor.
        self.weigh(seam, fit, outlier, weights);
        self.solved(seam, fit, self.moments(fit.offset, weights), weights)
    }

    /// What the sums of [`Self::moments`] and [`Self::border`] give, from the samples' weights; all else is as in `fit`.
    fn solved(&self, seam: f32, fit: &Fit, moments: ([f32; 7], [f32; 4]), weights: &[f32; SAMPLES_MAX]) -> Fit {
        let (power, [r0, r1, r2, r3]) = moments;
        let (border, r4) = self.border(seam, fit.offset, weights);
        let mut right = [r0, r1, r2, r3, r4];
        let [p0, p1, p2, p3, p4, p5, p6] = power;
        let [f0, f1, f2, f3, ff] = border;
        let mut normal = [
            [p0, p1, p2, p3, f0],
            [p1, p2, p3, p4, f1],
            [p2, p3, p4, p5, f2],
            [p3, p4, p5, p6, f3],
            [f0, f1, f2, f3, ff],
        ];
        let (expected, deviation) = self.prior();
        let priors = expected.into_iter().zip(deviation);
        for (index, ((row, value), (expected, deviation))) in normal.iter_mut().zip(&mut right).zip(priors).enumerate()
        {
            let precision = 1.0 / (deviation * deviation);
            if let Some(diagonal) = row.get_mut(index) {
                *diagonal += precision;
            }
            *value += precision * expected;
        }
        Fit {
            parameters: solve(&normal, right),
            ..*fit
        }
    }

    /// The samples' weights by their residuals from `fit`; zero where the line is not seen.
    #[inline(never)]
    fn weigh(&self, seam: f32, fit: &Fit, outlier: f32, weights: &mut [f32; SAMPLES_MAX]) {
        let precision = 1.0 / (self.sigma * self.sigma);
        for (weight, sample) in weights.iter_mut().zip(self.samples) {
            *weight = 0.0;
            if sample.weight > 0.0 {
                let residual = self.residual(sample, seam, fit);
                let drop = 1.0 / (1.0 + residual * residual * outlier);
                *weight = sample.weight * precision * drop * drop;
            }
        }
    }

    /// Sums of the weights times the powers of the cubic's variable, and of those times the centres less `offset`.
    #[inline(never)]
    fn moments(&self, offset: f32, weights: &[f32; SAMPLES_MAX]) -> ([f32; 7], [f32; 4]) {
        let (mut power, mut right) = ([0.0_f32; 7], [0.0_f32; 4]);
        for (sample, &w) in self.samples.iter().zip(weights) {
            let (u, x) = (self.variable(sample), sample.x - offset);
            let (u2, wu) = (u * u, w * u);
            let (wu2, wu3) = (wu * u, wu * u2);
            let wu5 = wu3 * u2;
            add(&mut power, [w, wu, wu2, wu3, wu2 * u2, wu5, wu5 * u]);
            add(&mut right, [w * x, wu * x, wu2 * x, wu3 * x]);
        }
        (power, right)
    }

    /// The same of the feature: its sums with the powers and with itself, and with the centres.
    #[inline(never)]
    fn border(&self, seam: f32, offset: f32, weights: &[f32; SAMPLES_MAX]) -> ([f32; PARAMETERS], f32) {
        let (mut border, mut right) = ([0.0_f32; PARAMETERS], 0.0_f32);
        let Some(feature) = self.feature else {
            return (border, right);
        };
        for (sample, &w) in self.samples.iter().zip(weights) {
            let feature = feature.at(sample.y - seam);
            // Above a step there is none of it.
            if feature > 0.0 {
                let (u, wf) = (self.variable(sample), w * feature);
                let u2 = u * u;
                add(&mut border, [wf, wf * u, wf * u2, wf * u2 * u, wf * feature]);
                right += wf * (sample.x - offset);
            }
        }
        (border, right)
    }

    fn priced(&self, seam: f32, mut fit: Fit) -> Fit {
        let (precision, outlier) = (1.0 / (self.sigma * self.sigma), self.outlier());
        let misfit = self.seen().fold(0.0, |sum, sample| {
            let residual = self.residual(sample, seam, &fit);
            let square = residual * residual;
            sum + sample.weight * square / (1.0 + square * outlier)
        });
        let (expected, deviation) = self.prior();
        let priors = fit.parameters.iter().zip(expected).zip(deviation);
        let bend = priors.fold(0.0, |sum, ((value, expected), deviation)| {
            let away = (value - expected) / deviation;
            sum + away * away
        });
        fit.cost = 0.5 * (misfit * precision + bend);
        fit
    }
}

fn add<const N: usize>(sums: &mut [f32; N], terms: [f32; N]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum += term;
    }
}

/// Solves the symmetric positive definite system by the factors L·D·Lᵀ.
fn solve(matrix: &[[f32; PARAMETERS]; PARAMETERS], mut right: [f32; PARAMETERS]) -> [f32; PARAMETERS] {
    let mut lower = [[0.0_f32; PARAMETERS]; PARAMETERS];
    let mut scaled = [[0.0_f32; PARAMETERS]; PARAMETERS];
    let mut inverse = [0.0_f32; PARAMETERS];
    for row in 0..PARAMETERS {
        for column in 0..=row {
            let factors = scaled[row].iter().zip(&lower[column]).take(column);
            let rest = factors.fold(matrix[row][column], |sum, (a, b)| sum - a * b);
            if row == column {
                // The priors keep the diagonal positive; the floor is for rounding.
                inverse[row] = 1.0 / rest.max(1e-9);
            } else {
                scaled[row][column] = rest;
                lower[row][column] = rest * inverse[column];
            }
        }
    }
    for row in 0..PARAMETERS {
        let known = lower[row].iter().zip(&right).take(row);
        right[row] = known.fold(right[row], |sum, (l, x)| sum - l * x);
    }
    for row in (0..PARAMETERS).rev() {
        let known = lower.iter().zip(&right).skip(row + 1);
        right[row] = known.fold(right[row] * inverse[row], |sum, (l, x)| sum - l[row] * x);
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::joint::Joint;
    extern crate std;

    #[test]
    fn a_step_on_a_bent_line_is_fitted_past_a_ghost_of_twenty_rows() {
        let joint = Joint::Crank {
            upper_left: true,
            sheet_m: 0.0006,
        };
        let feature = Feature::of(joint, 0.000_12, 1.0);
        let line = |y: f32| 110.0 + 0.1 * y + 0.0002 * (y - 60.0) * (y - 60.0);
        let samples: [Sample; SAMPLES_MAX] = core::array::from_fn(|index| {
            let y = 2.0 * index as f32 + 0.5;
            let ghost = (45..55).contains(&index);
            Sample {
                y,
                x: line(y) + if y > 59.5 { 5.5 } else { 0.0 } + if ghost { 20.0 } else { 0.0 },
                weight: 1.0,
            }
        });
        let problem = Problem {
            samples: &samples,
            origin: 59.5,
            sigma: 0.5,
            feature: Some(&feature),
        };
        let fit_at = |seam| problem.without_and_with(seam)[1];
        let fit = fit_at(59.5);
        assert!((fit.size() - 5.5).abs() < 0.2, "{} px", fit.size());
        assert!((fit.sheet(30.0) - line(30.0)).abs() < 0.2, "{} px", fit.sheet(30.0));
        assert!(fit.cost + 4.0 < fit_at(49.5).cost);
        let again = problem.refit(59.5, &fit_at(57.5));
        assert!((again.cost - fit.cost).abs() < 1.5, "{} for {}", again.cost, fit.cost);
    }

    #[test]
    fn the_solver_solves() {
        let matrix = [
            [4.0, 1.0, 0.5, 0.0, 1.0],
            [1.0, 5.0, 0.0, 1.0, 0.0],
            [0.5, 0.0, 3.0, 0.2, 0.3],
            [0.0, 1.0, 0.2, 6.0, 0.0],
            [1.0, 0.0, 0.3, 0.0, 2.0],
        ];
        let wanted = [1.0, -2.0, 3.0, 0.5, -1.0];
        let right = matrix.map(|row| row.iter().zip(wanted).map(|(a, x)| a * x).sum());
        for (found, wanted) in solve(&matrix, right).into_iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-5);
        }
    }
}
