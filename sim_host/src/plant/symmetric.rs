//! A symmetric positive matrix, factored and inverted.
#![expect(clippy::needless_range_loop, reason = "matrix algebra reads best in its indices")]

/// Lower Cholesky factor with the reciprocals of its diagonal.
pub struct Factor<const N: usize> {
    lower: [[f64; N]; N],
    reciprocal: [f64; N],
}

impl<const N: usize> Factor<N> {
    /// Of a positive definite matrix, of which the lower triangle is read.
    pub fn of(matrix: &[[f64; N]; N]) -> Self {
        let mut lower = [[0.0; N]; N];
        let mut reciprocal = [0.0; N];
        for i in 0..N {
            for j in 0..=i {
                let mut sum = matrix[i][j];
                for k in 0..j {
                    sum -= lower[i][k] * lower[j][k];
                }
                if i == j {
                    lower[i][i] = sum.sqrt();
                    reciprocal[i] = 1.0 / lower[i][i];
                } else {
                    lower[i][j] = sum * reciprocal[j];
                }
            }
        }
        Self { lower, reciprocal }
    }

    /// The inverse, by way of the factor's own: L⁻ᵀ·L⁻¹.
    pub fn inverse(&self) -> [[f64; N]; N] {
        let mut l = [[0.0; N]; N];
        for j in 0..N {
            l[j][j] = self.reciprocal[j];
            for i in j + 1..N {
                let mut sum = 0.0;
                for k in j..i {
                    sum -= self.lower[i][k] * l[k][j];
                }
                l[i][j] = sum * self.reciprocal[i];
            }
        }
        let mut inverse = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let mut sum = 0.0;
                for row in &l[i..] {
                    sum += row[i] * row[j];
                }
                inverse[i][j] = sum;
                inverse[j][i] = sum;
            }
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXES: usize = 6;

    #[test]
    fn a_matrix_times_its_inverse_is_one() {
        let matrix: [[f64; AXES]; AXES] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i == j {
                    3.0 + i as f64
                } else {
                    1.0 / (1.0 + (i + j) as f64)
                }
            })
        });
        let inverse = Factor::of(&matrix).inverse();
        for i in 0..AXES {
            for j in 0..AXES {
                let product: f64 = (0..AXES).map(|k| matrix[i][k] * inverse[k][j]).sum();
                assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14);
            }
        }
    }
}
