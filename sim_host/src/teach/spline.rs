//! Penalised cubic B-splines in one variable (Eilers and Marx, Statistical Science 11, 1996) with values in space.
//!
//! Coefficients stand at a fixed pitch; differences of the third order between them are penalised, so that arcs are left as they are. The normal
//! equations have three bands beside the diagonal and are solved by Cholesky's method in time linear in the length.

use nalgebra::Vector3;
use std::ops::{DivAssign, Mul, SubAssign};

/// Bands below the diagonal: four splines overlap, and a third difference spans as many.
const BANDS: usize = 3;

/// What a spline is fitted to.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where.
    pub t: f64,
    /// What.
    pub value: Vector3<f64>,
    /// With which weight, ≥ 0.
    pub weight: f64,
}

/// A fitted spline.
#[derive(Clone, Debug)]
pub struct Spline {
    first: f64,
    pitch: f64,
    coefficients: Vec<Vector3<f64>>,
    /// Cholesky factor of the normal equations.
    factor: Factor,
}

impl Spline {
    /// Fits samples between `first` and `last`; waves shorter than `cut` are smoothed away by more than half, wherever samples are as dense as on
    /// the mean. `None` if the samples do not determine it.
    pub fn fit(samples: &[Sample], first: f64, last: f64, pitch: f64, cut: f64) -> Option<Self> {
        let spans = ((last - first) / pitch).ceil().max(1.0) as usize;
        let count = spans + BANDS;
        let mut matrix = vec![[0.0; BANDS + 1]; count];
        let mut right = vec![Vector3::zeros(); count];
        let mut total = 0.0;
        let mut spline = Self {
            first,
            pitch,
            coefficients: vec![Vector3::zeros(); count],
            factor: Factor(Vec::new()),
        };
        for sample in samples {
            let (span, u) = spline.span(sample.t);
            let basis = cubic(u);
            total += sample.weight;
            for (i, b) in basis.iter().enumerate() {
                right[span + i] += sample.value * (sample.weight * b);
                for (j, c) in basis.iter().enumerate().take(i + 1) {
                    matrix[span + i][i - j] += sample.weight * b * c;
                }
            }
        }
        // Gain of a wave is 1 / (1 + λ (2 sin(π h/Λ))⁶ / weight per coefficient): one half at Λ = cut.
        let density = total / spans as f64;
        let penalty = density / (2.0 * (std::f64::consts::PI * pitch / cut).sin()).powi(6);
        const THIRD: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
        for row in 0..count.saturating_sub(BANDS) {
            for (i, b) in THIRD.iter().enumerate() {
                for (j, c) in THIRD.iter().enumerate().take(i + 1) {
                    matrix[row + i][i - j] += penalty * b * c;
                }
            }
        }
        spline.factor = Factor::of(matrix)?;
        spline.factor.forward(&mut right, 0);
        spline.factor.back(&mut right);
        spline.coefficients = right;
        Some(spline)
    }

    /// Variance of the value at `t` in each coordinate, of samples whose own is 1 over their weight: what their noise, and what the seam may do
    /// that no sample saw, leave open. It grows fast beyond the ends.
    pub fn variance(&self, t: f64) -> f64 {
        let (span, u) = self.span(t);
        let mut basis = vec![0.0; self.coefficients.len()];
        basis[span..=span + BANDS].copy_from_slice(&cubic(u));
        self.factor.forward(&mut basis, span);
        basis.iter().map(|part| part * part).sum()
    }

    /// The span in which `t` lies and how far into it; outside, the nearest one and beyond its ends.
    fn span(&self, t: f64) -> (usize, f64) {
        let position = (t - self.first) / self.pitch;
        let last = (self.coefficients.len() - BANDS - 1) as f64;
        let span = position.floor().clamp(0.0, last);
        (span as usize, position - span)
    }

    /// The value at `t`.
    pub fn value(&self, t: f64) -> Vector3<f64> {
        let (span, u) = self.span(t);
        self.blend(span, &cubic(u))
    }

    /// The derivative by `t`.
    pub fn slope(&self, t: f64) -> Vector3<f64> {
        let (span, u) = self.span(t);
        let v = 1.0 - u;
        let basis = [-0.5 * v * v, 1.5 * u * u - 2.0 * u, -1.5 * u * u + u + 0.5, 0.5 * u * u];
        self.blend(span, &basis) / self.pitch
    }

    fn blend(&self, span: usize, basis: &[f64; 4]) -> Vector3<f64> {
        let terms = self.coefficients[span..].iter().zip(basis);
        terms.fold(Vector3::zeros(), |sum, (c, b)| sum + c * *b)
    }
}

/// The four cubic B-splines on a span, `u` from 0 to 1.
fn cubic(u: f64) -> [f64; 4] {
    let v = 1.0 - u;
    let (u2, u3) = (u * u, u * u * u);
    [
        v * v * v / 6.0,
        0.5 * u3 - u2 + 2.0 / 3.0,
        -0.5 * u3 + 0.5 * u2 + 0.5 * u + 1.0 / 6.0,
        u3 / 6.0,
    ]
}

/// Cholesky's factor of a banded matrix: row i holds the elements (i, i), (i, i − 1), … .
#[derive(Clone, Debug)]
struct Factor(Vec<[f64; BANDS + 1]>);

impl Factor {
    /// Of `matrix`, whose rows are held in the same way; `None` if it is not positive definite.
    fn of(mut matrix: Vec<[f64; BANDS + 1]>) -> Option<Self> {
        let scale = matrix.iter().map(|row| row[0]).fold(0.0, f64::max);
        for i in 0..matrix.len() {
            for back in (0..=BANDS.min(i)).rev() {
                let j = i - back;
                let mut sum = matrix[i][back];
                for more in 1..=BANDS.min(j) {
                    if back + more <= BANDS {
                        sum -= matrix[i][back + more] * matrix[j][more];
                    }
                }
                if back > 0 {
                    matrix[i][back] = sum / matrix[j][0];
                } else if sum > 1e-14 * scale {
                    matrix[i][0] = sum.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Self(matrix))
    }

    /// Solves L y = `right` in place; `right` is zero before row `from`.
    fn forward<T: Linear>(&self, right: &mut [T], from: usize) {
        for i in from..right.len() {
            for back in 1..=BANDS.min(i) {
                let above = right[i - back];
                right[i] -= above * self.0[i][back];
            }
            right[i] /= self.0[i][0];
        }
    }

    /// Solves Lᵀ x = `right` in place.
    fn back<T: Linear>(&self, right: &mut [T]) {
        let count = right.len();
        for i in (0..count).rev() {
            for ahead in 1..=BANDS.min(count - 1 - i) {
                let below = right[i + ahead];
                right[i] -= below * self.0[i + ahead][ahead];
            }
            right[i] /= self.0[i][0];
        }
    }
}

/// A number or a vector of numbers.
trait Linear: Copy + Mul<f64, Output = Self> + SubAssign + DivAssign<f64> {}

impl<T: Copy + Mul<f64, Output = T> + SubAssign + DivAssign<f64>> Linear for T {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn wave(length: f64, amplitude: f64) -> Vec<Sample> {
        (0..=400)
            .map(|k| {
                let t = f64::from(k) * 0.001;
                Sample {
                    t,
                    value: Vector3::new(t, amplitude * (TAU * t / length).sin(), 0.0),
                    weight: 1.0,
                }
            })
            .collect()
    }

    #[test]
    fn a_wave_of_the_cut_is_halved_and_one_twice_as_long_passes() {
        let largest = |length: f64| {
            let spline = Spline::fit(&wave(length, 1.0), 0.0, 0.4, 0.004, 0.025).unwrap();
            (100..300)
                .map(|k| spline.value(f64::from(k) * 0.001).y)
                .fold(0.0, f64::max)
        };
        assert!((largest(0.025) - 0.5).abs() < 0.1, "{}", largest(0.025));
        assert!(largest(0.050) > 0.97, "{}", largest(0.050));
        assert!(largest(0.012) < 0.03, "{}", largest(0.012));
    }

    #[test]
    fn a_parabola_is_left_as_it_is_to_the_ends() {
        let parabola = |t: f64| Vector3::new(t, 3.0 * t * t, 1.0 - t);
        let samples: Vec<Sample> = (0..=50)
            .map(|k| f64::from(k) * 0.004)
            .map(|t| Sample {
                t,
                value: parabola(t),
                weight: 1.0,
            })
            .collect();
        let spline = Spline::fit(&samples, 0.0, 0.2, 0.004, 0.030).unwrap();
        for t in [0.0, 0.0033, 0.1, 0.17, 0.2] {
            assert!((spline.value(t) - parabola(t)).norm() < 1e-9, "at {t}");
            assert!(
                (spline.slope(t) - Vector3::new(1.0, 6.0 * t, -1.0)).norm() < 1e-6,
                "at {t}"
            );
        }
    }

    #[test]
    fn a_stiff_fit_leaves_its_values_as_open_as_a_parabola_through_the_same_samples() {
        let samples = wave(1.0, 0.0);
        let spline = Spline::fit(&samples, 0.0, 0.4, 0.020, 2.0).unwrap();
        // Orthogonal polynomials: (1 + 3 x² + 5 (3 x² − 1)²/4)/n, x from −1 to 1 between the ends, and more beyond.
        for x in [-1.2f64, -1.0, -0.4, 0.0, 0.7, 1.0, 1.2] {
            let expected = (1.0 + 3.0 * x * x + 1.25 * (3.0 * x * x - 1.0).powi(2)) / samples.len() as f64;
            let variance = spline.variance(0.2 * (1.0 + x));
            assert!(
                (variance / expected - 1.0).abs() < 0.05,
                "{variance} at {x}, must be {expected}"
            );
        }
    }

    #[test]
    fn too_few_samples_give_no_spline() {
        let samples = wave(1.0, 0.0);
        assert!(Spline::fit(&samples[..1], 0.0, 0.4, 0.004, 0.025).is_none());
    }
}
