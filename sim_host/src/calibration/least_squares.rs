//! Least squares by Levenberg and Marquardt: the one solver of every calibration here.
//!
//! A problem hands over the normal equations at a state and takes steps from it, so a state may be anything (poses step
//! on the rotation group) and no problem stores a Jacobian. Dense: up to a thousand unknowns. An unknown on which no
//! residual depends is held.
//!
//! Source: K. Levenberg (1944), D. Marquardt (1963); damping by the diagonal.

use anyhow::{Context, Result, ensure};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Steps after which the solver gives up; calibrations here take 5 to 30.
const MAX_STEPS: usize = 200;
/// Damping to begin with, relative to the diagonal, and the factor by which it falls and rises.
const FIRST_DAMPING: f64 = 1e-3;
const DAMPING_FACTOR: f64 = 10.0;
/// Damping with which a step that is not downhill shows that f64 has no better state.
const LAST_DAMPING: f64 = 1e12;
/// Relative decrease of the cost at which the state stands still.
const STANDSTILL: f64 = 1e-14;

/// Normal equations of a sum of squared residuals, under construction.
pub struct NormalEquations {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    cost: f64,
    residuals: usize,
}

impl NormalEquations {
    fn new(unknowns: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
            cost: 0.0,
            residuals: 0,
        }
    }

    /// Adds one residual: its value, and its derivatives by the unknowns on which it depends, as (index, derivative).
    pub fn add(&mut self, residual: f64, derivatives: &[(usize, f64)]) {
        for &(row, by_row) in derivatives {
            self.gradient[row] += by_row * residual;
            for &(column, by_column) in derivatives {
                self.matrix[(row, column)] += by_row * by_column;
            }
        }
        self.cost += residual * residual;
        self.residuals += 1;
    }

    /// The matrix with its diagonal raised by `damping`, factored; an unknown that nothing depends on gets a 1.
    fn factor(&self, damping: f64) -> Option<Cholesky<f64, Dyn>> {
        let mut matrix = self.matrix.clone();
        for at in 0..matrix.nrows() {
            let diagonal = matrix[(at, at)];
            matrix[(at, at)] = if diagonal == 0.0 {
                1.0
            } else {
                diagonal * (1.0 + damping)
            };
        }
        matrix.cholesky()
    }
}

/// A sum of squares to be made least.
pub trait Problem {
    /// What is looked for.
    type State: Clone;
    /// How many numbers a step has.
    fn unknowns(&self) -> usize;
    /// Adds every residual at `state`, with its derivatives by the step.
    fn linearise(&self, state: &Self::State, equations: &mut NormalEquations);
    /// The state after a step.
    fn advance(&self, state: &Self::State, step: &DVector<f64>) -> Self::State;
}

/// A least sum of squares.
pub struct Solution<S> {
    /// Where it is.
    pub state: S,
    /// Root of the mean squared residual, in the residual's unit.
    pub rms: f64,
    /// Standard deviation of each unknown, from the scatter of the residuals; zero where it was held.
    pub deviations: Vec<f64>,
}

/// Goes downhill from `start` until the cost stands still.
///
/// An error says that the unknowns are not determined, or that the residuals are no numbers.
pub fn solve<P: Problem>(problem: &P, start: P::State) -> Result<Solution<P::State>> {
    let equations_at = |state: &P::State| {
        let mut equations = NormalEquations::new(problem.unknowns());
        problem.linearise(state, &mut equations);
        equations
    };
    let mut state = start;
    let mut equations = equations_at(&state);
    ensure!(equations.cost.is_finite(), "start: its residuals are no numbers");
    let mut damping = FIRST_DAMPING;
    for _ in 0..MAX_STEPS {
        let moved = equations.factor(damping).map(|factors| {
            let moved = problem.advance(&state, &-factors.solve(&equations.gradient));
            let there = equations_at(&moved);
            (moved, there)
        });
        match moved {
            Some((moved, there)) if there.cost <= equations.cost => {
                let decrease = equations.cost - there.cost;
                let still = decrease <= STANDSTILL * equations.cost;
                (state, equations) = (moved, there);
                damping /= DAMPING_FACTOR;
                if still {
                    break;
                }
            }
            _ if damping > LAST_DAMPING => break,
            _ => damping *= DAMPING_FACTOR,
        }
    }
    let held = |at: usize| equations.matrix[(at, at)] == 0.0;
    let estimated = (0..problem.unknowns()).filter(|at| !held(*at)).count();
    ensure!(
        equations.residuals > estimated,
        "measurements {}: must be more than the {estimated} unknowns",
        equations.residuals
    );
    let inverse = equations
        .factor(0.0)
        .context("measurements: they do not determine every unknown")?
        .inverse();
    let variance = equations.cost / (equations.residuals - estimated) as f64;
    let deviation = |at: usize| {
        if held(at) {
            0.0
        } else {
            (variance * inverse[(at, at)]).sqrt()
        }
    };
    Ok(Solution {
        rms: (equations.cost / equations.residuals as f64).sqrt(),
        deviations: (0..problem.unknowns()).map(deviation).collect(),
        state,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// a·exp(−b·t) at t = 0, 1, 2, 3, and a third unknown that nothing depends on.
    struct Decay([f64; 4]);

    impl Problem for Decay {
        type State = [f64; 3];
        fn unknowns(&self) -> usize {
            3
        }
        fn linearise(&self, [a, b, _]: &[f64; 3], equations: &mut NormalEquations) {
            for (t, measured) in self.0.iter().enumerate() {
                let decay = (-b * t as f64).exp();
                equations.add(a * decay - measured, &[(0, decay), (1, -a * t as f64 * decay)]);
            }
        }
        fn advance(&self, state: &[f64; 3], step: &DVector<f64>) -> [f64; 3] {
            std::array::from_fn(|at| state[at] + step[at])
        }
    }

    #[test]
    fn a_decay_is_found_from_afar_and_a_held_unknown_keeps_its_value() {
        let exact = Decay(std::array::from_fn(|t| 3.0 * (-0.7 * t as f64).exp()));
        let solution = solve(&exact, [1.0, 0.1, 42.0]).expect("solved");
        let [a, b, held] = solution.state;
        assert!((a - 3.0).abs() < 1e-9 && (b - 0.7).abs() < 1e-9, "{a} {b}");
        assert_eq!((held, solution.deviations[2]), (42.0, 0.0));
        assert!(solution.rms < 1e-9);
    }

    #[test]
    fn deviations_follow_the_scatter_of_the_residuals() {
        // With b known to be 0 the model is a mean: its deviation is that of four values over the root of four, with
        // one degree of freedom more spent on b.
        let scattered = Decay([1.1, 0.9, 0.9, 1.1]);
        let solution = solve(&scattered, [1.0, 0.0, 0.0]).expect("solved");
        assert!((solution.rms - 0.1).abs() < 1e-6, "{}", solution.rms);
        let expected = (0.04_f64 / 2.0).sqrt() * (14.0_f64 / (4.0 * 14.0 - 36.0)).sqrt();
        assert!(
            (solution.deviations[0] - expected).abs() < 1e-3,
            "{:?}",
            solution.deviations
        );
    }
}
