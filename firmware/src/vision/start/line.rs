//! A line fitted to edge pixels: across = intercept + slope · (along − middle).

use super::edges::Points;
use crate::geometry::trig::sqrt;

/// Pixels of an edge within this distance of the line belong to it, px, from the first fit to the last.
const REACH: [f32; 4] = [3.0, 2.0, 1.2, 1.0];
/// Fewest pixels of a line.
const FEWEST: f32 = 12.0;
/// Standard deviation that is believed at best, px: edges are not that straight.
const SIGMA_LEAST: f32 = 0.15;
/// Neighbouring pixels of an edge share grain, blur and burr: so many count as one.
const SHARED: f32 = 4.0;
/// Times that the mean answer of a line's pixels is taken, and how many quarters of it one that is no glint's is at most.
const ROUNDS: u8 = 2;
const GLINT: u32 = 7;
/// Length of a stretch of a line, px: 2 mm, within which its pixels err together.
const STRETCH: usize = 16;

/// A straight line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Line {
    /// Across at `middle`, px.
    pub intercept: f32,
    /// Change of across per px along.
    pub slope: f32,
    /// The along about which it turns, px.
    pub middle: f32,
}

/// A line with what is known of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fitted {
    /// The line.
    pub line: Line,
    /// Variances of the intercept (at `mean`), px², and of the slope.
    pub variance: [f32; 2],
    /// Mean along of its pixels, px.
    pub mean: f32,
    /// Its pixels, weighted.
    pub count: f32,
}

impl Line {
    /// Across at `along`.
    pub fn at(&self, along: f32) -> f32 {
        self.intercept + self.slope * (along - self.middle)
    }
}

impl Fitted {
    /// Variance of across at `along`, px².
    pub fn variance_at(&self, along: f32) -> f32 {
        let d = along - self.mean;
        let [intercept, slope] = self.variance;
        intercept + slope * d * d
    }
}

/// Fits the pixels of `points` that lie near `first` and between `from` and `to` along and answer by no more than `most`; the nearer the more they
/// count (Tukey's biweight). `None` where too few do.
pub fn fit(points: &Points, first: &Line, from: f32, to: f32, most: u16) -> Option<Fitted> {
    let mut fitted = Fitted {
        line: *first,
        ..Fitted::default()
    };
    for reach in REACH {
        let line = fitted.line;
        let (mut w, mut wu, mut wuu, mut wv, mut wuv, mut square) =
            (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        for point in points {
            let along = f32::from(point.along);
            if along < from || along > to || point.strength > most {
                continue;
            }
            let v = point.off(&line);
            let share = v * (1.0 / reach);
            let rest = 1.0 - share * share;
            if rest <= 0.0 {
                continue;
            }
            let weight = rest * rest;
            let u = along - line.middle;
            w += weight;
            wu += weight * u;
            wuu += weight * u * u;
            wv += weight * v;
            wuv += weight * u * v;
            square += weight * v * v;
        }
        if w < FEWEST {
            return None;
        }
        let (mean_u, mean_v) = (wu / w, wv / w);
        let spread = wuu - wu * mean_u;
        if spread < FEWEST * FEWEST {
            return None;
        }
        let slope = (wuv - wu * mean_v) / spread;
        fitted.line.slope += slope;
        fitted.line.intercept += mean_v - slope * mean_u;
        let sigma = sqrt(square / w).max(SIGMA_LEAST);
        let noise = SHARED * sigma * sigma;
        fitted.variance = [noise / w, noise / spread];
        fitted.mean = line.middle + mean_u;
        fitted.count = w;
    }
    Some(fitted)
}

/// The strongest answer that is no glint's of the pixels of `points` near `line` and between `from` and `to` along: an edge's own vary less than
/// twofold. Where an edge mirrors the light it looks to lie up to a pixel aside.
fn steady(points: &Points, line: &Line, from: f32, to: f32) -> u16 {
    let mut most = u16::MAX;
    let [near, ..] = REACH;
    for _ in 0..ROUNDS {
        let (mut sum, mut count) = (0_u32, 0_u32);
        for point in points {
            let along = f32::from(point.along);
            if along >= from && along <= to && point.strength <= most && point.off(line).abs() < near {
                sum += u32::from(point.strength);
                count += 1;
            }
        }
        let mean = sum.checked_div(count).unwrap_or(0);
        most = (mean * GLINT / 4).min(u32::from(u16::MAX)) as u16;
    }
    most
}

/// Fits a line's pixels, but not those that glint; its variances are what its stretches say, of which each errs by itself.
pub fn refit(points: &Points, first: &Line, from: f32, to: f32) -> Option<Fitted> {
    let most = steady(points, first, from, to);
    let mut fitted = fit(points, first, from, to, most)?;
    let [.., reach] = REACH;
    let mut stretches = [[0.0_f32; 2]; super::SIDE.div_ceil(STRETCH)];
    let (mut w, mut wuu) = (0.0_f32, 0.0_f32);
    for point in points {
        let along = f32::from(point.along);
        let v = point.off(&fitted.line);
        let share = v * (1.0 / reach);
        let rest = 1.0 - share * share;
        if along < from || along > to || point.strength > most || rest <= 0.0 {
            continue;
        }
        if let Some([zeroth, first]) = stretches.get_mut(usize::from(point.along) / STRETCH) {
            let (weight, u) = (rest * rest, along - fitted.mean);
            *zeroth += weight * v;
            *first += weight * v * u;
            w += weight;
            wuu += weight * u * u;
        }
    }
    let (mut offset, mut slope) = (0.0_f32, 0.0_f32);
    for [zeroth, first] in stretches {
        offset += zeroth * zeroth;
        slope += first * first;
    }
    let [a, b] = fitted.variance;
    fitted.variance = [a.max(offset / (w * w)), b.max(slope / (wuu * wuu))];
    Some(fitted)
}

#[cfg(test)]
mod tests {
    use super::super::edges::{FRACTION, Point};
    use super::*;

    #[test]
    fn a_line_is_fitted_past_outliers_to_a_hundredth_of_a_pixel() {
        let mut points = Points::new();
        for along in 50..350_u16 {
            let noise = f32::from(along * 37 % 11) / 11.0 - 0.45;
            let across = 120.3 + 0.08 * (f32::from(along) - 224.5) + noise;
            // Every third pixel belongs to a scratch that crosses.
            let across = if along % 3 == 0 { f32::from(along) } else { across };
            let across = (across * FRACTION as f32) as u16;
            points
                .push(Point {
                    along,
                    across,
                    strength: 500,
                })
                .unwrap();
        }
        let first = Line {
            intercept: 121.5,
            slope: 0.075,
            middle: 224.5,
        };
        let found = fit(&points, &first, 0.0, 449.0, u16::MAX).unwrap();
        assert!((found.line.intercept - 120.3).abs() < 0.03, "{found:?}");
        assert!((found.line.slope - 0.08).abs() < 5e-4, "{found:?}");
        assert!(fit(&points, &first, 0.0, 60.0, u16::MAX).is_none());
    }

    #[test]
    fn an_edge_that_glints_over_a_third_of_its_length_and_looks_half_a_pixel_aside_there_is_not_turned_by_it() {
        let mut points = Points::new();
        for along in 50..350_u16 {
            let glint = along > 250;
            let (across, strength) = if glint { (119.7, 3000) } else { (120.3, 500) };
            points
                .push(Point {
                    along,
                    across: (across * FRACTION as f32) as u16,
                    strength,
                })
                .unwrap();
        }
        let first = Line {
            intercept: 120.0,
            slope: 0.0,
            middle: 224.5,
        };
        let turned = fit(&points, &first, 0.0, 449.0, u16::MAX).unwrap();
        let found = refit(&points, &first, 0.0, 449.0).unwrap();
        assert!(turned.line.slope.abs() > 1e-3, "{turned:?}");
        assert!(
            found.line.slope.abs() < 1e-5 && (found.line.at(300.0) - 120.3).abs() < 0.02,
            "{found:?}"
        );
    }

    #[test]
    fn where_each_stretch_errs_by_itself_the_slope_is_a_third_more_uncertain_than_stated() {
        // A quarter of a pixel to either side from stretch to stretch, in 200 orders. The fit takes some of that off what it sees, so that the slopes
        // spread by a third more than each states; start_pose's `OF_STATED` counts on it.
        let (mut square, mut stated) = (0.0_f32, 0.0_f32);
        let mut state = 1_u32;
        for _ in 0..200 {
            let mut points = Points::new();
            let mut off = 0.0;
            for along in 48..352_u16 {
                if usize::from(along) % STRETCH == 0 {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    off = if state >> 31 == 0 { 0.25 } else { -0.25 };
                }
                let across = ((120.0 + off) * FRACTION as f32) as u16;
                let _ = points.push(Point {
                    along,
                    across,
                    strength: 500,
                });
            }
            let first = Line {
                intercept: 120.0,
                slope: 0.0,
                middle: 224.5,
            };
            let found = refit(&points, &first, 0.0, 449.0).unwrap();
            square += found.line.slope * found.line.slope;
            stated += found.variance[1];
        }
        let ratio = sqrt(square / stated);
        assert!((1.2..1.5).contains(&ratio), "{ratio} of what is stated");
    }
}
