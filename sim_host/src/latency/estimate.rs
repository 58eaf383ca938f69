//! The exposure's delay from what the controller itself has: joint angles by cycle, and what the sensor saw.
//!
//! A sighting is put into Σ_B with the joints of some instant after its stamp. On a straight seam all sightings must lie on one line,
//! whatever the nozzle did meanwhile; they do if the instant is right. So the delay is fitted together with the seam's course, by
//! least squares over the deviations across the seam, linearised in the delay (Gauss and Newton). What depends on where the sensor is, such as an error of its
//! mounting, is in quadrature with its speed, and cancels over whole swings.

use crate::model::AXES;
use anyhow::{Context, Result, ensure};
use firmware::arm::Arm;
use firmware::geometry::Pose;
use firmware::job::seal::PERIOD;
use nalgebra::{DMatrix, DVector, Vector3};

/// Numbers of the seam's course across: a part that was bent by hand needs no more over 0.5 m.
const COURSE: usize = 6;
/// Steps of the fit; it is linear but for the arm's turning within the delay, so three are enough, and the others settle the weights.
const STEPS: usize = 12;
/// Least that can be fitted.
pub const MIN_SIGHTINGS: usize = 60;
/// Least root mean square speed across the seam, m/s: at 0.1 mm of noise 100 sightings then tell 0.5 ms.
pub const MIN_SPEED: f64 = 0.02;
/// Residuals larger than so many median magnitudes have a quarter of their weight, or less: two and a half standard deviations.
const APART: f64 = 3.7;

/// What one sighting of the seam was, and when.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Cycle whose SYNC triggered the exposure.
    pub cycle: usize,
    /// The point, Σ_S, m.
    pub point: Vector3<f32>,
}

/// The delay that was found.
#[derive(Clone, Copy, Debug)]
pub struct Delay {
    /// From SYNC to mid-exposure, s.
    pub value: f64,
    /// Its standard deviation, s.
    pub deviation: f64,
    /// Root mean square of the deviations across the seam that are left, m; as weighted.
    pub residual: f64,
}

/// Fits the delay to `sightings` made by a sensor at `mount` on the nozzle of `arm`, whose `joints` (rad) were these at each SYNC.
pub fn delay(arm: &Arm<AXES>, mount: &Pose, joints: &[[f32; AXES]], sightings: &[Seen]) -> Result<Delay> {
    ensure!(
        sightings.len() >= MIN_SIGHTINGS,
        "sightings: {} of the seam, must be at least {MIN_SIGHTINGS}",
        sightings.len()
    );
    let track = Track { arm, mount, joints };
    let frame = Frame::of(&track, sightings)?;
    // The seam's course by powers of the distance along it, from -1 to 1.
    let mut value = 0.0;
    let mut weights = vec![1.0; sightings.len()];
    let mut found = None;
    for _ in 0..STEPS {
        let mut rows = Vec::with_capacity(sightings.len());
        let mut across = Vec::with_capacity(sightings.len());
        for seen in sightings {
            let Some([before, here, after]) = track.around(seen, value) else {
                continue;
            };
            let (u, y) = frame.place(&here);
            let speed = (frame.place(&after).1 - frame.place(&before).1) / (2.0 * PROBE);
            let mut row = [0.0; COURSE + 1];
            row[0] = -speed;
            (0..COURSE).for_each(|power| row[power + 1] = u.powi(power as i32));
            rows.push(row);
            across.push(y);
        }
        ensure!(
            rows.len() == sightings.len(),
            "delay: {:.1} ms leads out of what was recorded",
            value * 1e3
        );
        let speed = (rows.iter().map(|row| row[0] * row[0]).sum::<f64>() / rows.len() as f64).sqrt();
        ensure!(
            speed >= MIN_SPEED,
            "speed across the seam: {:.1} mm/s, must be at least {:.0}",
            speed * 1e3,
            MIN_SPEED * 1e3
        );
        let fit = Fit::of(&rows, &across, &weights)?;
        value += fit.solution[0];
        let mut magnitudes: Vec<f64> = fit.residuals.iter().map(|r| r.abs()).collect();
        let middle = magnitudes.len() / 2;
        let median = *magnitudes.select_nth_unstable_by(middle, f64::total_cmp).1;
        for (weight, residual) in weights.iter_mut().zip(&fit.residuals) {
            let relative = residual / (APART * median).max(f64::MIN_POSITIVE);
            *weight = (1.0 + relative * relative).powi(-2);
        }
        found = Some(Delay {
            value,
            deviation: fit.deviation,
            residual: fit.sigma,
        });
    }
    found.context("delay: nothing was fitted")
}

/// Half the interval over which a speed is measured, s.
const PROBE: f64 = 0.5e-3;

/// Where the sensor was.
struct Track<'a> {
    arm: &'a Arm<AXES>,
    mount: &'a Pose,
    joints: &'a [[f32; AXES]],
}

impl Track<'_> {
    /// The point of a sighting in Σ_B, m, if it was exposed `delay` (s) after its SYNC.
    fn point(&self, seen: &Seen, delay: f64) -> Option<Vector3<f64>> {
        let at = seen.cycle as f64 + delay / f64::from(PERIOD);
        let whole = at.floor();
        let (index, share) = (whole as usize, (at - whole) as f32);
        let (before, after) = (self.joints.get(index)?, self.joints.get(index + 1)?);
        let joints = std::array::from_fn(|axis| before[axis] + (after[axis] - before[axis]) * share);
        let t_b_s = self.arm.forward(&joints) * *self.mount;
        Some((t_b_s * seen.point).map(f64::from))
    }

    /// The same [`PROBE`] before, at, and after the delay.
    fn around(&self, seen: &Seen, delay: f64) -> Option<[Vector3<f64>; 3]> {
        Some([
            self.point(seen, delay - PROBE)?,
            self.point(seen, delay)?,
            self.point(seen, delay + PROBE)?,
        ])
    }
}

/// The seam as seen without a delay: its middle, half its length, and its direction; and across it, in the sheet.
struct Frame {
    middle: Vector3<f64>,
    half: f64,
    along: Vector3<f64>,
    across: Vector3<f64>,
}

impl Frame {
    fn of(track: &Track, sightings: &[Seen]) -> Result<Self> {
        let points: Vec<Vector3<f64>> = sightings.iter().filter_map(|seen| track.point(seen, 0.0)).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        // The direction of the largest spread.
        let spread: nalgebra::Matrix3<f64> = points.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
        let axes = spread.symmetric_eigen();
        let along: Vector3<f64> = axes.eigenvectors.column(axes.eigenvalues.imax()).into();
        let half = points
            .iter()
            .map(|p| (p - middle).dot(&along).abs())
            .fold(0.0, f64::max);
        let first = sightings.first().and_then(|seen| track.joints.get(seen.cycle));
        let up = track
            .arm
            .forward(first.context("joints: none at the first exposure")?)
            .r
            .column(2)
            .map(f64::from);
        Ok(Self {
            middle,
            half,
            along,
            across: up.cross(&along).normalize(),
        })
    }

    /// Distance along the seam, in halves of its length from the middle, and across it, m.
    fn place(&self, point: &Vector3<f64>) -> (f64, f64) {
        let away = point - self.middle;
        (away.dot(&self.along) / self.half, away.dot(&self.across))
    }
}

/// A weighted linear fit.
struct Fit {
    solution: DVector<f64>,
    residuals: Vec<f64>,
    /// Standard deviation of a residual of weight one.
    sigma: f64,
    /// Of the first unknown.
    deviation: f64,
}

impl Fit {
    fn of(rows: &[[f64; COURSE + 1]], right: &[f64], weights: &[f64]) -> Result<Self> {
        let unknowns = COURSE + 1;
        let (mut matrix, mut vector) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
        for ((row, y), weight) in rows.iter().zip(right).zip(weights) {
            let row = DVector::from_row_slice(row);
            matrix += &row * row.transpose() * *weight;
            vector += row * (*y * *weight);
        }
        let inverse = matrix
            .cholesky()
            .context("sightings: too much alike to fit a delay")?
            .inverse();
        let solution = &inverse * vector;
        let residuals: Vec<f64> = rows
            .iter()
            .zip(right)
            .map(|(row, y)| y - row.iter().zip(&solution).map(|(a, b)| a * b).sum::<f64>())
            .collect();
        let squares: f64 = residuals.iter().zip(weights).map(|(r, w)| w * r * r).sum();
        let sigma = (squares / (weights.iter().sum::<f64>() - unknowns as f64).max(1.0)).sqrt();
        Ok(Self {
            deviation: sigma * inverse[(0, 0)].sqrt(),
            solution,
            residuals,
            sigma,
        })
    }
}
