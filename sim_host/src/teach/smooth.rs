//! One path out of many raw points: by distance, wrong points left out, noise smoothed away.
//!
//! A spline through all points is fitted again and again. Each time a point's place is its foot on the last fit, and its weight falls (Tukey's
//! biweight) with the difference between its own residual and its neighbours': where the spline cannot bend as the seam does, at a corner, all have
//! the same residual and none is wrong. The normal at a place is that of the sheet about it: sloping along the seam as the seam does from end to
//! end of the sensor's view, and across it as the lit lines in that view do on the mean.

use super::collect::RawPoint;
use super::order;
use super::spline::{Sample, Spline};
use crate::taught::{TaughtRow, TaughtSeam};
use anyhow::{Context, Result, ensure};
use nalgebra::Vector3;

/// Distance between the spline's coefficients, m.
const PITCH: f64 = 0.0025;
/// Waves of the seam shorter than this are taken for noise, m: about a bead's width, and short enough for a corner of R5.
const CUT: f64 = 0.009;
/// The same of the first fits, m, so stiff that it does not follow a few wrong points in a row; the corners that it cuts come back later.
const CUT_FIRST: f64 = 0.025;
/// Number of these.
const ROUNDS_FIRST: usize = 4;
/// Half the length over which a direction is taken, m: a nozzle's orientation is that of the sheet under the sensor's 30 mm view, not that of a dent.
const VIEW_HALF: f64 = 0.015;
/// Points to either side with which a point is compared: three wrong ones in a row do not outvote them.
const NEIGHBOURS: usize = 3;
/// Furthest from the fit that a point may have any weight, m: more than a corner's rounding.
const REACH: f64 = 0.001;
/// Fits of the seam, and of the normals.
const ROUNDS: usize = 6;
/// Points further than this from the chain of medians begin without weight, m.
const FIRST_REACH: f64 = 0.002;
/// Weight of the further slit's lines in the normal against the nearer's: where it looks the seam's course is not known yet, and with it how a bend's
/// line lies.
const AHEAD: f64 = 0.25;
/// Length at either end over which a single point draws the curve after itself, m.
const DRAWN: f64 = 0.010;
/// A point is left out where the others leave its place open by more than this many times a point's noise: about 8 mm past the last of them.
const OPEN: f64 = 5.0;
/// Tukey's constant: 95 % efficiency on noise that is all normal.
const TUKEY: f64 = 4.685;
/// Median of the distance of a point with normal noise of 1 in the plane across the seam.
const RAYLEIGH_MEDIAN: f64 = 1.177_41;
/// Least standard deviation that is believed, m and rad: the sensor's and the bus' resolution, and no division by none.
const LEAST_M: f64 = 3e-5;
const LEAST_RAD: f64 = 3e-3;
/// Distance between the rows of the taught seam, m.
const ROW: f64 = 0.002;
/// Furthest that the seam is carried on backwards from the first point to the start that the operator gave, m.
const BACK: f64 = 0.010;
/// Fewest points that make a seam.
const FEWEST: usize = 15;

/// A smoothed seam, and what became of its points.
#[derive(Debug)]
pub struct Smoothed {
    /// The seam.
    pub seam: TaughtSeam,
    /// Points that had no part in it.
    pub outliers: usize,
    /// Standard deviation of the others about it, per direction across, m.
    pub noise: f64,
}

/// Smooths `points`; the seam begins at the foot of `start` (Σ_B, m), where the operator placed the nozzle.
pub fn smooth(points: &[RawPoint], start: &Vector3<f64>) -> Result<Smoothed> {
    ensure!(
        points.len() >= FEWEST,
        "{} points of a seam, must be at least {FEWEST}",
        points.len()
    );
    let feet = order::feet(points).context("the points of the seam lie all in one place")?;
    let mut samples: Vec<Sample> = points
        .iter()
        .zip(&feet)
        .map(|(raw, foot)| Sample {
            t: foot.t,
            value: raw.point,
            weight: f64::from(u8::from(foot.away < FIRST_REACH)),
        })
        .collect();
    let mut noise = 0.0;
    let mut cut = CUT_FIRST;
    let mut curve = fit(&samples, cut)?;
    for round in 0..ROUNDS_FIRST + ROUNDS {
        for sample in &mut samples {
            let (value, slope) = (curve.value(sample.t), curve.slope(sample.t));
            sample.t += (sample.value - value).dot(&slope) / slope.norm_squared();
        }
        let first = round < ROUNDS_FIRST;
        let residuals = residuals(&mut samples, &curve)?;
        let alone = if first {
            residuals.iter().map(Vector3::norm).collect()
        } else {
            apart_from_neighbours(&samples, &residuals)
        };
        noise = (median(&alone) / RAYLEIGH_MEDIAN).max(LEAST_M);
        for ((sample, residual), alone) in samples.iter_mut().zip(&residuals).zip(alone) {
            sample.weight = if residual.norm() < REACH {
                biweight(alone / noise)
            } else {
                0.0
            };
        }
        cut = if first { CUT_FIRST } else { CUT };
        curve = fit(&samples, cut)?;
    }
    let used = || samples.iter().filter(|sample| sample.weight > 0.0);
    let normals = Normals::new(&curve, ends(&samples), points, &samples);
    Ok(Smoothed {
        seam: rows(&normals, start)?,
        outliers: samples.len() - used().count(),
        noise,
    })
}

fn fit(samples: &[Sample], cut: f64) -> Result<Spline> {
    let used = || samples.iter().filter(|sample| sample.weight > 0.0);
    ensure!(
        used().count() >= FEWEST,
        "{} points of the seam agree with each other, must be at least {FEWEST}",
        used().count()
    );
    course(samples, cut)
}

fn course(samples: &[Sample], cut: f64) -> Result<Spline> {
    let [first, last] = ends(samples);
    Spline::fit(samples, first, last, PITCH, cut).context("the points do not determine a seam")
}

/// Places of the first and the last sample with any weight.
fn ends(samples: &[Sample]) -> [f64; 2] {
    let used = samples.iter().filter(|sample| sample.weight > 0.0);
    used.fold([f64::MAX, f64::MIN], |[low, high], sample| {
        [low.min(sample.t), high.max(sample.t)]
    })
}

/// How far each sample lies off `curve`. Near an end and beyond it, where a point alone may draw the curve: off a stiff fit without that point, in
/// units of how open that leaves its place; where it is left too open, nothing speaks for the point.
fn residuals(samples: &mut [Sample], curve: &Spline) -> Result<Vec<Vector3<f64>>> {
    let mut residuals = Vec::with_capacity(samples.len());
    let [begin, end] = ends(samples);
    for index in 0..samples.len() {
        let Sample { t, value, weight } = samples[index];
        residuals.push(if t < begin + DRAWN || t > end - DRAWN {
            samples[index].weight = 0.0;
            let without = course(samples, CUT_FIRST)?;
            samples[index].weight = weight;
            let spread = (1.0 + without.variance(t)).sqrt();
            if spread < OPEN {
                (value - without.value(t)) / spread
            } else {
                Vector3::repeat(f64::INFINITY)
            }
        } else {
            value - curve.value(t)
        });
    }
    Ok(residuals)
}

/// How far each residual is from the median of its neighbours' along the seam, coordinate by coordinate.
fn apart_from_neighbours(samples: &[Sample], residuals: &[Vector3<f64>]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..samples.len()).collect();
    order.sort_by(|a, b| samples[*a].t.total_cmp(&samples[*b].t));
    let mut apart = vec![0.0; samples.len()];
    for (place, index) in order.iter().enumerate() {
        let around = &order[place.saturating_sub(NEIGHBOURS)..(place + NEIGHBOURS + 1).min(order.len())];
        let middle = Vector3::from_fn(|axis, _| {
            let values: Vec<f64> = around.iter().map(|at| residuals[*at][axis]).collect();
            median(&values)
        });
        apart[*index] = (residuals[*index] - middle).norm();
    }
    apart
}

/// The sheet's normal, point by point, for what is seen within [`VIEW_HALF`] of a place.
struct Normals<'a> {
    curve: &'a Spline,
    /// Where the curve begins and ends.
    ends: [f64; 2],
    /// Place, normal and weight of each point that has any, by place.
    seen: Vec<(f64, Vector3<f64>, f64)>,
}

impl<'a> Normals<'a> {
    /// Of `points`, which lie along `curve` as `samples` say.
    fn new(curve: &'a Spline, ends: [f64; 2], points: &[RawPoint], samples: &[Sample]) -> Self {
        let normal = |(raw, sample): (&RawPoint, &Sample)| {
            let normal = curve.slope(sample.t).cross(&raw.across).normalize();
            let share = if raw.slit == 0 { 1.0 } else { AHEAD };
            (sample.t, normal, sample.weight * share)
        };
        let mut seen: Vec<_> = points.iter().zip(samples).map(normal).collect();
        seen.retain(|(.., weight)| *weight > 0.0);
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Where the sensor lingered, a stretch counts no more for that.
        let places: Vec<f64> = seen.iter().map(|(at, ..)| *at).collect();
        for (own, around) in seen[1..].iter_mut().zip(places.windows(3)) {
            own.2 *= around[2] - around[0];
        }
        for end in [0, places.len() - 1] {
            seen[end].2 *= PITCH;
        }
        Self { curve, ends, seen }
    }

    /// At `t`: along the seam the slope of what was seen from end to end, across it the mean of the points', wrong ones left out.
    fn at(&self, t: f64) -> Vector3<f64> {
        let [first, last] = self.ends;
        let (from, to) = ((t - VIEW_HALF).max(first), (t + VIEW_HALF).min(last));
        // At least two, where nothing was seen for longer than the view.
        let begin = self.seen.partition_point(|(at, ..)| *at < from);
        let end = self.seen.partition_point(|(at, ..)| *at <= to);
        let seen = &self.seen[begin.min(end.saturating_sub(2))..end.max(begin + 2).min(self.seen.len())];
        let along = (self.curve.value(to) - self.curve.value(from)).normalize();
        let mut across: Vector3<f64> = seen.iter().map(|(_, normal, weight)| normal * *weight).sum();
        for _ in 0..ROUNDS {
            let off: Vec<f64> = seen.iter().map(|(_, normal, _)| normal.angle(&across)).collect();
            let spread = (median(&off) / NORMAL_MEDIAN).max(LEAST_RAD);
            let weighted = seen.iter().zip(&off);
            across = weighted
                .map(|((_, normal, weight), off)| normal * (weight * biweight(off / spread)))
                .sum();
        }
        (across - along * across.dot(&along)).normalize()
    }
}

/// Median of the magnitude of normal noise of 1.
const NORMAL_MEDIAN: f64 = 0.674_49;

/// Samples curve and normals at equal distances along the curve, from the foot of `start`.
fn rows(normals: &Normals, start: &Vector3<f64>) -> Result<TaughtSeam> {
    const STEP: f64 = 1e-4;
    let Normals {
        curve,
        ends: [first, last],
        ..
    } = *normals;
    // Before the first point the seam goes on as it does past it: a slope at the point itself would carry its error away.
    let slope = (curve.value((first + VIEW_HALF).min(last)) - curve.value(first)).normalize();
    let back = (start - curve.value(first)).dot(&slope);
    let (begin, lead) = if back < 0.0 {
        (first, back.max(-BACK))
    } else {
        let mut t = first + back;
        for _ in 0..5 {
            let slope = curve.slope(t);
            t += (start - curve.value(t)).dot(&slope) / slope.norm_squared();
        }
        (t.clamp(first, last), 0.0)
    };
    // Distance along the curve by t.
    let steps = ((last - begin) / STEP).floor().max(1.0) as usize;
    let mut table = vec![(-lead, begin)];
    for step in 1..=steps {
        let t = begin + STEP * step as f64;
        let before = table[step - 1].0;
        table.push((before + curve.slope(t - 0.5 * STEP).norm() * STEP, t));
    }
    let length = table[steps].0;
    let count = (length / ROW).floor().max(1.0) as usize;
    let row = |index: usize| {
        let s = length * index as f64 / count as f64;
        let (point, t) = if s < -lead {
            (curve.value(begin) + slope * (s + lead), begin)
        } else {
            let at = table.partition_point(|(distance, _)| *distance <= s).clamp(1, steps);
            let ((s0, t0), (s1, t1)) = (table[at - 1], table[at]);
            let t = t0 + (t1 - t0) * (s - s0) / (s1 - s0);
            (curve.value(t), t)
        };
        TaughtRow {
            s,
            point,
            normal: normals.at(t),
        }
    };
    TaughtSeam::new((0..=count).map(row).collect(), length).context("the smoothed seam is none that could be played")
}

fn biweight(x: f64) -> f64 {
    let inside = 1.0 - (x / TUKEY).powi(2);
    if inside > 0.0 { inside * inside } else { 0.0 }
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    let (_, value, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    *value
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    /// Length at either end over which the normal is told from one side, m.
    const END: f64 = 0.008;

    /// 100 mm straight and 300 mm of R150, seen each 2 mm with noise of ±0.15 mm uniform, every 13th point 5 mm wrong.
    fn points() -> Vec<RawPoint> {
        let mut rng = Pcg64::new(5, 9);
        let mut noise = |size: f64| (2.0 * rng.random::<f64>() - 1.0) * size;
        (0..200)
            .map(|k| {
                let s = 0.002 + 0.002 * f64::from(k);
                let (point, tangent) = seam(s);
                let left = Vector3::z().cross(&tangent);
                let wrong = if k % 13 == 4 { 0.005 } else { 0.0 };
                RawPoint {
                    point: point + left * (noise(1.5e-4) + wrong) + Vector3::z() * noise(1.5e-4),
                    across: (left + Vector3::z() * noise(0.03)).normalize(),
                    slit: 0,
                    sigma: 1e-4,
                }
            })
            .collect()
    }

    fn seam(s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (sin, cos) = ((s - 0.1).max(0.0) / 0.15).sin_cos();
        (
            Vector3::new(0.3 + s.min(0.1) + 0.15 * sin, 0.15 * (1.0 - cos), 0.1),
            Vector3::new(cos, sin, 0.0),
        )
    }

    #[test]
    fn wrong_points_are_left_out_and_noise_is_smoothed_away() {
        let Smoothed {
            seam: taught,
            outliers,
            noise,
        } = smooth(&points(), &Vector3::new(0.3, 0.0001, 0.1)).unwrap();
        // The sixteen, and few of those whose noise is at its largest.
        assert!((16..=30).contains(&outliers), "{outliers}");
        assert!((0.5e-4..1.2e-4).contains(&noise), "{noise} m");
        for row in taught.rows() {
            let (point, _) = seam(row.s);
            let off = (row.point - point).norm();
            // An end is known from one side only.
            let at_end = row.s < END || row.s > taught.length() - END;
            assert!(
                off < if at_end { 0.4e-3 } else { 0.25e-3 },
                "{off} m off at {} m",
                row.s
            );
            assert!(row.normal.angle(&Vector3::z()).to_degrees() < 1.2, "{:?}", row);
        }
        assert!((taught.length() - 0.400).abs() < 3e-3, "{} m", taught.length());
    }

    #[test]
    fn a_wrong_point_past_the_end_does_not_make_the_seam_longer() {
        let mut points = points();
        let (end, tangent) = seam(0.409);
        points.push(RawPoint {
            point: end + Vector3::z().cross(&tangent) * 7e-4,
            ..points[199]
        });
        let taught = smooth(&points, &Vector3::new(0.3, 0.0, 0.1)).unwrap().seam;
        assert!((taught.length() - 0.400).abs() < 3e-3, "{} m", taught.length());
    }

    #[test]
    fn the_noise_of_the_last_points_does_not_make_the_seam_shorter() {
        // Straight seams, seen each 2 mm with noise of 0.03 mm, and on the last 10 mm of 0.15 mm.
        let mut rng = Pcg64::new(7, 3);
        for _ in 0..40 {
            let points: Vec<RawPoint> = (0..100)
                .map(|k: i32| {
                    let noise: f64 = rng.sample(StandardNormal);
                    RawPoint {
                        point: Vector3::new(0.002 * f64::from(k), noise * if k < 95 { 3e-5 } else { 1.5e-4 }, 0.0),
                        across: Vector3::y(),
                        slit: 0,
                        sigma: 1e-4,
                    }
                })
                .collect();
            let length = smooth(&points, &Vector3::zeros()).unwrap().seam.length();
            assert!(length > 0.193, "{length} m");
        }
    }

    #[test]
    fn the_normal_follows_the_sheet_within_the_view_and_to_the_ends() {
        // A sheet that rolls by 0.1 rad within 40 mm, and rises with a slope of 0.05 all along.
        let roll = |s: f64| 0.1 * ((s - 0.18) / 0.040).clamp(0.0, 1.0);
        let points: Vec<RawPoint> = (0..200)
            .map(|k| {
                let s = 0.002 * f64::from(k);
                let (sin, cos) = roll(s).sin_cos();
                RawPoint {
                    point: Vector3::new(s, 0.0, 0.05 * s),
                    across: Vector3::new(0.0, cos, sin),
                    slit: 0,
                    sigma: 1e-4,
                }
            })
            .collect();
        let taught = smooth(&points, &Vector3::zeros()).unwrap().seam;
        for row in taught.rows() {
            let normal = Vector3::new(-0.05, -roll(row.point.x).tan(), 1.0);
            let off = row.normal.angle(&normal).to_degrees();
            // The mean of a slope that begins in the middle of the view: 0.1 rad · 15/40 on one side, a quarter of it on the whole, is 0.54°.
            assert!(off < 0.6, "{off}° off at {} m", row.s);
        }
    }

    #[test]
    fn a_few_points_are_no_seam() {
        let error = smooth(&points()[..10], &Vector3::zeros()).unwrap_err().to_string();
        assert!(error.contains("10 points of a seam, must be at least 15"), "{error}");
    }
}
