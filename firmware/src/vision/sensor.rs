//! The seam sensor: image in, seam point in Σ_S or refusal out.

use super::band::{self, BANDS, CANDIDATES, Candidate};
use super::camera::Pinhole;
use super::edge::{self, Change, Edge};
use super::image::View;
use super::joint::{self, Feature, Fit, HALF_WINDOW, Joint, Sample};
use super::number::{atan, limit, sqrt};
use super::track::{self, Track};
use super::window::{self, Line};
use hal::process::Sighting;
use nalgebra::Vector3;

/// Why no seam is reported. The numbers are those of [`Sighting::refusal`]; 0 is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// No line runs through the image.
    NoLine = 1,
    /// Two lines are about as long and bright: which is a reflection cannot be told.
    TwoLines = 2,
    /// Too much of the line is saturated.
    Glare = 3,
    /// The line is whole, but shows no joint.
    NoStep = 4,
    /// There may be a joint, but where it is is not clear enough.
    Unclear = 5,
    /// The joint lies too near to the end of the line or of the image.
    AtEdge = 6,
}

/// Weakest line, grey levels over the background: twice the noise of a dark image summed over a candidate's area.
const FAINTEST: f32 = 4.0;
/// A line is seen in at least this share of the bands.
const SEEN: f32 = 0.5;
/// A second line with this share of the first one's score makes it doubtful which is which.
const RIVAL: f32 = 0.88;
/// Share of rows with glare beyond which the image is refused.
const GLARE: f32 = 0.4;
/// Neighbouring rows share speckle grains: so many rows count as one.
const ROWS_PER_GRAIN: f32 = 2.0;
/// Half a coarse fit's window, bands.
const HALF_BANDS: usize = HALF_WINDOW / band::PITCH;
/// Rows about the coarse place that are searched, to either side, in steps of so many.
const SEARCH: f32 = 8.0;
const SEARCH_STEP: usize = 2;
const SEARCHED: usize = 9;
/// Rows by which light and shape may disagree on the seam, px: 0.7 mm.
const DISAGREEMENT: f32 = 6.0;
/// Logarithm of the likelihood ratio joint : no joint that is asked for.
const EVIDENCE: f32 = 4.0;
/// The same, of the final fit over rows.
const PROOF: f32 = 7.0;
/// Standard deviations by which the feature's size may differ from the expected: a step to the other hand is no seam.
const SURPRISE: f32 = 3.0;
/// Logarithm of the likelihood ratio between the place and the next best one elsewhere.
const ADVANTAGE: f32 = 4.0;
/// Places nearer than this to the best are the same place, bands.
const SAME: usize = 4;
/// Largest standard deviation of the seam's row, px: 0.3 mm.
const SIGMA_LIMIT: f32 = 2.5;
/// Half the widest gap beside a sheet's edge, rows: 1 mm of gap, 1 mm of shadow, and what drop-outs add.
const GAP: f32 = 16.0;
/// Rows of line that must be seen to either side of the joint within the window.
const SIDE_ROWS: f32 = 12.0;

/// A seam in an image.
#[derive(Clone, Copy, Debug)]
pub struct Find {
    /// The seam point's pixel.
    pub x: f32,
    /// See [`Self::x`].
    pub y: f32,
    /// Column in which the sheet with the edge ends in row [`Self::y`]; that of the seam itself where the edge is the seam.
    pub edge_x: f32,
    /// Slope of the slit line on the seam's own sheet, px of x per px of y.
    pub slope: f32,
    /// Standard deviation of `y`, px.
    pub sigma: f32,
    /// Logarithm of the likelihood ratio joint : no joint.
    pub evidence: f32,
    /// Quality: 0 worst, 255 best.
    pub quality: u8,
}

/// The sensor of one joint.
#[derive(Clone, Copy, Debug)]
pub struct SeamSensor {
    camera: Pinhole,
    feature: Feature,
}

impl SeamSensor {
    /// A sensor for `joint` behind `camera`.
    pub fn new(camera: Pinhole, joint: Joint) -> Self {
        Self {
            camera,
            feature: Feature::of(joint, camera.pixel_m, camera.tan_slit),
        }
    }

    /// Sees the seam, or refuses; the caller fills in stamp, look and slit.
    pub fn sight(&self, view: &View) -> Sighting {
        self.sighting(&self.find(view))
    }

    /// What was found, as the camera reports it.
    pub fn sighting(&self, found: &Result<Find, Refusal>) -> Sighting {
        match found {
            Ok(find) => {
                let point = self.place(find);
                let micrometres = |m: f32| (m * 1e6) as i16;
                Sighting {
                    point_um: [micrometres(point.x), micrometres(point.y), micrometres(point.z)],
                    angle_e4: (atan(limit(find.slope, -1.0, 1.0)) * 1e4) as i16,
                    quality: find.quality,
                    sigma_um: (find.sigma * self.camera.pixel_m * 1e6) as u8,
                    ..Sighting::default()
                }
            }
            Err(refusal) => Sighting {
                refusal: *refusal as u8,
                ..Sighting::default()
            },
        }
    }

    /// The seam point in Σ_S, m. What ends in the seam's row is the edge of the upper sheet; the seam is its foot, a sheet's thickness
    /// below along the sheet's normal. Where the slit crosses the seam at a slant ψ, that foot is not where the slit meets the lower
    /// sheet: it lies a thickness times tan ψ aside (0.16 mm on R150 with 80 mm of lead).
    pub fn place(&self, find: &Find) -> Vector3<f32> {
        let edge = self.camera.point(find.edge_x, find.y);
        let lower = self.camera.point(find.x, find.y);
        let thickness = edge.z - lower.z;
        let inclination = find.slope / self.camera.tan_slit; // dz/dy of the sheet in Σ_S
        Vector3::new(edge.x, edge.y + thickness * inclination, lower.z)
    }

    /// Finds the seam in an image.
    pub fn find(&self, view: &View) -> Result<Find, Refusal> {
        let line = self.trace(view)?;
        let sigma = roughness(&line);
        let coarse = self.coarse(&line, sigma)?;
        self.fine(view, &line, coarse, sigma)
    }

    /// Traces the line through the image, whatever joint it may show.
    pub fn trace(&self, view: &View) -> Result<Line, Refusal> {
        let (track, typical) = follow(view)?;
        let line = window::read(view, &track, typical);
        let rows = line.rows as f32;
        if line.glare as f32 > GLARE * rows {
            return Err(Refusal::Glare);
        }
        if (line.seen as f32) < SEEN * rows {
            return Err(Refusal::NoLine);
        }
        Ok(line)
    }

    /// The band at which the joint is likeliest.
    fn coarse(&self, line: &Line, sigma: f32) -> Result<usize, Refusal> {
        let mut samples = [Sample::default(); BANDS];
        let rows = line.x.iter().zip(&line.weight).take(line.rows);
        let mut rows = rows.enumerate();
        let bands = band::count(line.rows);
        for sample in samples.iter_mut().take(bands) {
            let (mut weight, mut moment, mut height) = (0.0_f32, 0.0_f32, 0.0_f32);
            for (y, (x, w)) in rows.by_ref().take(band::PITCH) {
                weight += w;
                moment += w * x;
                height += w * y as f32;
            }
            if weight > 0.0 {
                *sample = Sample {
                    y: height / weight,
                    x: moment / weight,
                    weight: weight / ROWS_PER_GRAIN,
                };
            }
        }
        let mut evidence = [0.0_f32; BANDS];
        let mut best = (0.0_f32, 0_usize);
        for (band, evidence) in evidence.iter_mut().enumerate().take(bands).skip(2) {
            let first = band.saturating_sub(HALF_BANDS);
            let last = (band + HALF_BANDS).min(bands);
            let window = samples.get(first..last).unwrap_or(&[]);
            let seam = (band * band::PITCH) as f32 - 0.5;
            let without = joint::fit(window, seam, seam, None, sigma);
            let with = joint::fit(window, seam, seam, Some(&self.feature), sigma);
            *evidence = without.cost - with.cost;
            if *evidence > best.0 {
                best = (*evidence, band);
            }
        }
        if best.0 < EVIDENCE {
            return Err(Refusal::NoStep);
        }
        let elsewhere = |&(band, _): &(usize, &f32)| band + SAME < best.1 || band > best.1 + SAME;
        let next = evidence
            .iter()
            .enumerate()
            .filter(elsewhere)
            .fold(0.0_f32, |most, (_, &e)| most.max(e));
        if best.0 - next < ADVANTAGE {
            return Err(Refusal::Unclear);
        }
        Ok(best.1)
    }

    /// The seam's row about a band, to a fraction of a row.
    fn fine(&self, view: &View, line: &Line, band: usize, sigma: f32) -> Result<Find, Refusal> {
        let origin = (band * band::PITCH) as i32;
        let first = (origin - HALF_WINDOW as i32).max(0) as usize;
        let mut samples = [Sample::default(); 2 * HALF_WINDOW];
        let rows = line.x.iter().zip(&line.weight).take(line.rows).enumerate().skip(first);
        for (sample, (y, (&x, weight))) in samples.iter_mut().zip(rows) {
            *sample = Sample {
                y: y as f32,
                x,
                weight: weight / ROWS_PER_GRAIN,
            };
        }
        let middle = origin as f32 - 0.5;
        let fit_at = |seam: f32| joint::fit(&samples, middle, seam, Some(&self.feature), sigma);
        let without = joint::fit(&samples, middle, middle, None, sigma);
        let shape = by_shape(middle, |seam| fit_at(seam).cost);
        let place = match self.feature.change {
            None => shape,
            Some(change) => {
                let fit = fit_at(shape.y);
                let lines = |y: f32| (fit.sheet(y), fit.sheet(y) + fit.size());
                let light = edge::locate(view, line.light, band * band::PITCH, change, lines);
                if change == Change::Exchange {
                    agree(light, shape)?
                } else {
                    beside(light, shape)?
                }
            }
        };
        let (seam, deviation) = (place.y, place.sigma);
        let fit = fit_at(seam);
        let surprise = (fit.size() - self.feature.size) / self.feature.spread;
        if surprise * surprise > SURPRISE * SURPRISE {
            return Err(Refusal::NoStep);
        }
        let evidence = without.cost - fit.cost;
        if evidence < PROOF {
            return Err(Refusal::NoStep);
        }
        let seen = |below: bool| {
            let side = samples.iter().filter(|sample| (sample.y > seam) == below);
            side.fold(0.0, |sum, sample| sum + sample.weight)
        };
        if seen(false).min(seen(true)) * ROWS_PER_GRAIN < SIDE_ROWS {
            return Err(Refusal::AtEdge);
        }
        if deviation > SIGMA_LIMIT {
            return Err(Refusal::Unclear);
        }
        Ok(self.report(&fit, seam, deviation, evidence))
    }

    fn report(&self, fit: &Fit, seam: f32, sigma: f32, evidence: f32) -> Find {
        let (above, below) = (fit.sheet(seam), fit.sheet(seam) + fit.size());
        let (own, other) = if self.feature.seam_below {
            (below, above)
        } else {
            (above, below)
        };
        let sharpness = 1.0 - sigma / SIGMA_LIMIT;
        let strength = (evidence / (4.0 * EVIDENCE)).min(1.0);
        Find {
            x: own,
            y: seam,
            // A lap joint's seam is the foot of the other sheet's edge.
            edge_x: if self.feature.change == Some(Change::Exchange) {
                other
            } else {
                own
            },
            slope: fit.slope(seam),
            sigma,
            evidence,
            quality: limit(255.0 * sharpness * strength, 0.0, 255.0) as u8,
        }
    }
}

/// Where the fit's cost, the negative logarithm of the likelihood, has the feature about row `middle`.
fn by_shape(middle: f32, cost: impl Fn(f32) -> f32) -> Edge {
    let mut costs = [0.0_f32; SEARCHED];
    let mut least = f32::MAX;
    let away = |step: usize| (SEARCH_STEP * step) as f32 - SEARCH;
    for (step, value) in costs.iter_mut().enumerate() {
        *value = cost(middle + away(step));
        least = least.min(*value);
    }
    let (mut mass, mut moment, mut square) = (0.0_f32, 0.0_f32, 0.0_f32);
    for (step, value) in costs.iter().enumerate() {
        let likelihood = edge::decay(value - least);
        mass += likelihood;
        moment += likelihood * away(step);
        square += likelihood * away(step) * away(step);
    }
    let mean = moment / mass;
    Edge {
        y: middle + mean,
        // Known no better than the grid: uniform over one step, 2/√12.
        sigma: sqrt((square / mass - mean * mean).max(0.33)),
    }
}

/// Light and shape must agree: what a glint does to the one it rarely does to the other.
fn agree(light: Edge, shape: Edge) -> Result<Edge, Refusal> {
    let apart = light.y - shape.y;
    if apart * apart > DISAGREEMENT * DISAGREEMENT {
        return Err(Refusal::Unclear);
    }
    let (a, b) = (1.0 / (light.sigma * light.sigma), 1.0 / (shape.sigma * shape.sigma));
    Ok(Edge {
        y: (a * light.y + b * shape.y) / (a + b),
        sigma: sqrt(1.0 / (a + b) + 0.25 * apart * apart),
    })
}

/// A sheet's edge lies beside the gap, in whose middle the shape has its step. If it does not, light goes on past the step:
/// the track left the sheet for a reflection.
fn beside(light: Edge, shape: Edge) -> Result<Edge, Refusal> {
    let apart = light.y - shape.y;
    if apart * apart > GAP * GAP {
        return Err(Refusal::Unclear);
    }
    Ok(light)
}

/// Finds the line: its track and its usual contrast.
fn follow(view: &View) -> Result<(Track, f32), Refusal> {
    let mut bands = [[Candidate::default(); CANDIDATES]; BANDS];
    let count = band::count(view.height());
    let (mut sum, mut lit) = (0.0_f32, 0.0_f32);
    for (index, band) in bands.iter_mut().take(count).enumerate() {
        *band = band::candidates(view, index, FAINTEST);
        let [strongest, ..] = band;
        if strongest.contrast > 0.0 {
            sum += strongest.contrast;
            lit += 1.0;
        }
    }
    if lit < SEEN * count as f32 {
        return Err(Refusal::NoLine);
    }
    let in_image = bands.get(..count).unwrap_or(&[]);
    // The strongest are the line's where it is lit; glints raise the mean, drop-outs lower it.
    let first_guess = sum / lit;
    let track = track::best(in_image, first_guess);
    if (track.seen as f32) < SEEN * count as f32 {
        return Err(Refusal::NoLine);
    }
    let mut rest = bands;
    for (band, x) in rest.iter_mut().zip(&track.x) {
        let Some(x) = x else { continue };
        for candidate in band {
            let away = candidate.x - x;
            if away * away < 8.0 * 8.0 {
                candidate.contrast = 0.0;
            }
        }
    }
    let rival = track::best(rest.get(..count).unwrap_or(&[]), first_guess);
    if rival.score > RIVAL * track.score {
        return Err(Refusal::TwoLines);
    }
    let (mut sum, mut seen) = (0.0_f32, 0.0_f32);
    for (band, x) in bands.iter().zip(&track.x) {
        let Some(x) = x else { continue };
        for candidate in band {
            if candidate.x == *x {
                sum += candidate.contrast.min(2.0 * first_guess);
                seen += 1.0;
            }
        }
    }
    Ok((track, sum / seen))
}

/// Standard deviation of a row's centre, px, from second differences over eight rows.
fn roughness(line: &Line) -> f32 {
    const LAG: usize = 4;
    /// What a step or an outlier may add at most, px.
    const CUT: f32 = 5.0;
    let mut rows = [(0.0_f32, 0.0_f32); super::image::SIDE_MAX];
    for (row, pair) in rows.iter_mut().zip(line.x.iter().zip(&line.weight)).take(line.rows) {
        *row = (*pair.0, *pair.1);
    }
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    for ((a, b), c) in rows.iter().zip(rows.iter().skip(LAG)).zip(rows.iter().skip(2 * LAG)) {
        if a.1 > 0.5 && b.1 > 0.5 && c.1 > 0.5 {
            let bend = a.0 - 2.0 * b.0 + c.0;
            sum += bend.max(-bend).min(CUT);
            count += 1.0;
        }
    }
    if count < 8.0 {
        return 1.5;
    }
    // The mean of |N(0, s)| is 0.80 s; the second difference has √6 times the deviation of one centre.
    limit(sum / count / (0.8 * 2.45), 0.3, 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    const SIDE: usize = 250;
    const LAP: Joint = Joint::Crank {
        upper_left: true,
        sheet_m: 0.0006,
    };

    /// An image with a line 7 px wide whose centre is `column(row)`.
    fn image(level: u8, column: impl Fn(f32) -> f32) -> Vec<u8> {
        let mut pixels = vec![10; SIDE * SIDE];
        draw(&mut pixels, level, column);
        pixels
    }

    fn draw(pixels: &mut [u8], level: u8, column: impl Fn(f32) -> f32) {
        for (y, row) in pixels.chunks_exact_mut(SIDE).enumerate() {
            let centre = column(y as f32);
            for (x, pixel) in row.iter_mut().enumerate() {
                // Anti-aliased borders.
                let inside = limit(4.0 - (x as f32 - centre).abs(), 0.0, 1.0);
                *pixel = (*pixel).max((f32::from(level) * inside) as u8);
            }
        }
    }

    fn step(y: f32) -> f32 {
        let slant = 110.0 + 0.08 * y;
        if y < 130.0 { slant } else { slant + 5.5 }
    }

    fn find(pixels: &[u8]) -> Result<Find, Refusal> {
        let view = View::new(pixels, SIDE, SIDE).unwrap();
        SeamSensor::new(Pinhole::TRACKING, LAP).find(&view)
    }

    #[test]
    fn a_step_is_found_at_its_row_on_the_lower_sheets_line() {
        let found = find(&image(120, step)).unwrap();
        assert!((found.y - 129.5).abs() < 0.6, "row {} for 129.5", found.y);
        assert!(
            (found.x - (110.0 + 0.08 * 129.5 + 5.5)).abs() < 0.2,
            "column {}",
            found.x
        );
        assert!((found.slope - 0.08).abs() < 0.01, "slope {}", found.slope);
    }

    #[test]
    fn a_step_to_the_other_hand_is_no_seam() {
        let mirrored = image(120, |y| 249.0 - step(y));
        assert_eq!(find(&mirrored).unwrap_err(), Refusal::NoStep);
    }

    #[test]
    fn every_refusal_has_its_reason() {
        assert_eq!(find(&vec![10; SIDE * SIDE]).unwrap_err(), Refusal::NoLine);
        assert_eq!(find(&image(120, |y| 120.0 + 0.05 * y)).unwrap_err(), Refusal::NoStep);
        assert_eq!(find(&image(255, step)).unwrap_err(), Refusal::Glare);
        let mut two = image(120, step);
        draw(&mut two, 120, |y| step(y) + 40.0);
        assert_eq!(find(&two).unwrap_err(), Refusal::TwoLines);
        let late = |y: f32| if y < 243.0 { 110.0 } else { 115.5 };
        assert!(matches!(
            find(&image(120, late)).unwrap_err(),
            Refusal::AtEdge | Refusal::NoStep
        ));
    }

    #[test]
    fn a_sighting_is_the_foot_of_the_edge_in_micrometres() {
        let pixels = image(120, step);
        let view = View::new(&pixels, SIDE, SIDE).unwrap();
        let sensor = SeamSensor::new(Pinhole::TRACKING, LAP);
        let (found, sighting) = (sensor.find(&view).unwrap(), sensor.sight(&view));
        let edge = Pinhole::TRACKING.point(found.edge_x, found.y);
        let lower = Pinhole::TRACKING.point(found.x, found.y);
        // The sheet rises by 0.08 m per metre across the seam: its normal leans by that much of the thickness.
        let foot = [edge.x, edge.y + 0.08 * (edge.z - lower.z), lower.z];
        for (um, m) in sighting.point_um.into_iter().zip(foot) {
            assert!((f32::from(um) - m * 1e6).abs() <= 4.0, "{um} µm for {m} m");
        }
        assert!((f32::from(sighting.angle_e4) * 1e-4 - 0.08).abs() < 0.01);
        assert!(sighting.refusal == 0 && sighting.quality > 180 && sighting.sigma_um < 100);
    }

    #[test]
    fn the_papers_method_finds_a_clean_step_within_its_own_millimetre() {
        let pixels = image(120, step);
        let view = View::new(&pixels, SIDE, SIDE).unwrap();
        let (_, y) = crate::vision::printed::seam(&view).unwrap();
        assert!((y - 129.5).abs() * 0.12 < 1.0, "row {y}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn any_bytes_are_answered_and_always_the_same(seed in any::<u64>(), bright in 1_u8..=255) {
            let mut state = seed | 1;
            let pixels: Vec<u8> = (0..SIDE * SIDE)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (state >> 56) as u8 % bright
                })
                .collect();
            let view = View::new(&pixels, SIDE, SIDE).unwrap();
            let sensor = SeamSensor::new(Pinhole::TRACKING, LAP);
            prop_assert_eq!(sensor.sight(&view), sensor.sight(&view));
        }
    }
}
