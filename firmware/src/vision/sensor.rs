//! The seam sensor: image in, seam point in Σ_S or refusal out.

use super::camera::Pinhole;
use super::edge::{Change, Edge};
use super::ending::Profile;
use super::exchange::Asked;
use super::image::View;
use super::joint::{Feature, Joint};
use super::number::limit;
use super::place::{self, Place};
use super::window::{self, Line};
use super::{search, track};
use crate::geometry::trig::{atan2, sqrt};
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

/// Rows of the tracking view, of which the line is to be seen in [`SEEN`]; of a higher view in as many.
pub(super) const TRACKED: usize = 250;
/// See [`TRACKED`].
pub(super) const SEEN: f32 = 0.5;
/// Share of rows with glare beyond which the image is refused.
const GLARE: f32 = 0.4;

/// Logarithm of the likelihood ratio joint : no joint that is asked for.
pub(super) const PROOF: f32 = 7.0;
/// What one slit alone does not know of a lap joint's row, px: half of the rows that both sheets' lines share where the seam is turned, by 0.15 in
/// the mean.
const TURN_SIGMA: f32 = 0.4;
/// What a find must show to be sure.
struct Sure {
    /// Standard deviation of its row, px, at most.
    sigma: f32,
    /// How likely it is more than a millimetre off, at most, by what the rows say: less than true, as rows that one glint deceives say the same.
    far: f32,
    /// Logarithm of the likelihood ratio joint : no joint, at least.
    evidence: f32,
}

impl Sure {
    /// A plate without a lap joint has shown 22 of evidence.
    const LAP: Self = Self {
        sigma: 0.5,
        far: 1e-10,
        evidence: 20.0,
    };
    /// The tall step of a sheet's end shows 80 and more; less, if a reflection is taken for one of the lines.
    const END: Self = Self {
        sigma: 1.5,
        far: 2e-5,
        evidence: 75.0,
    };
    /// A bend has a shape only. A glint beside it has shown 26.
    const BEND: Self = Self {
        sigma: 1.2,
        far: 1.0,
        evidence: 30.0,
    };

    fn of(feature: &Feature) -> &'static Self {
        match feature.change {
            Some(Change::Exchange) => &Self::LAP,
            Some(Change::Ends | Change::Begins) => &Self::END,
            None => &Self::BEND,
        }
    }

    /// 1 for what is just sure, more for what is surer.
    fn measure(&self, edge: &Edge, evidence: f32) -> f32 {
        let far = self.far / edge.far.max(f32::MIN_POSITIVE);
        (self.sigma / edge.sigma).min(far).min(evidence / self.evidence)
    }
}

/// A seam in an image.
#[derive(Clone, Copy, Debug)]
pub struct Find {
    /// The seam point's pixel.
    pub x: f32,
    /// See [`Self::x`].
    pub y: f32,
    /// Column in which the sheet with the edge ends in row [`Self::y`]; that of the seam itself where the edge is the seam.
    pub edge_x: f32,
    /// Slope of the slit line on the seam's own sheet as it appears, px of x per px of y.
    pub slope: f32,
    /// Standard deviation of `y`, px.
    pub sigma: f32,
    /// Logarithm of the likelihood ratio joint : no joint.
    pub evidence: f32,
    /// Quality: 0 worst, 255 best, sure from [`Sighting::SURE`] on.
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
                    angle_e4: (atan2(limit(self.slope(find), -1.0, 1.0), 1.0) * 1e4) as i16,
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
        let inclination = self.slope(find) / self.camera.tan_slit; // dz/dy of the sheet in Σ_S
        Vector3::new(edge.x, edge.y + thickness * inclination, lower.z)
    }

    /// Slope of the slit line on the seam's own sheet, px of x per px of y, without what the lens adds.
    pub(super) fn slope(&self, find: &Find) -> f32 {
        self.camera.slope(find.x, find.y, find.slope)
    }

    /// Finds the seam in an image.
    pub fn find(&self, view: &View) -> Result<Find, Refusal> {
        let place = self.seek(view, &mut None)?;
        place.judge(PROOF)?;
        let mut find = self.report(&place);
        if self.feature.change == Some(Change::Exchange) {
            find.sigma = sqrt(find.sigma * find.sigma + TURN_SIGMA * TURN_SIGMA);
        }
        Ok(find)
    }

    /// Finds what looks most like the seam, sure or not; `ending` as in [`place::find`].
    pub(super) fn seek(&self, view: &View, ending: &mut Option<Profile>) -> Result<Place, Refusal> {
        let mut line = Line::EMPTY;
        let (band, sigma) = self.band(view, &mut line)?;
        place::find(view, &line, &self.feature, band, sigma, ending)
    }

    /// What the rows about a lap joint's edge show, as [`exchange`](super::exchange)'s net is asked of them first: to learn from.
    pub fn rows(&self, view: &View) -> Result<Asked, Refusal> {
        let mut line = Line::EMPTY;
        let (band, sigma) = self.band(view, &mut line)?;
        Ok(place::rows(view, &line, &self.feature, band, sigma))
    }

    /// Traces the line; gives the band in which the joint is likeliest, and the standard deviation of a row's centre, px.
    fn band(&self, view: &View, line: &mut Line) -> Result<(usize, f32), Refusal> {
        self.trace_into(view, line)?;
        let sigma = window::roughness(line);
        Ok((search::likeliest(line, &self.feature, sigma)?, sigma))
    }

    /// Traces the line through the image, whatever joint it may show.
    pub fn trace(&self, view: &View) -> Result<Line, Refusal> {
        let mut line = Line::EMPTY;
        self.trace_into(view, &mut line)?;
        Ok(line)
    }

    fn trace_into(&self, view: &View, line: &mut Line) -> Result<(), Refusal> {
        let (track, typical) = track::follow(view, self.feature.step())?;
        line.read(view, &track, typical);
        let rows = line.rows as f32;
        if line.glare as f32 > GLARE * rows {
            return Err(Refusal::Glare);
        }
        if (line.seen as f32) < SEEN * rows.min(TRACKED as f32) {
            return Err(Refusal::NoLine);
        }
        Ok(())
    }

    /// What is found at a place.
    pub(super) fn report(&self, place: &Place) -> Find {
        let Place {
            edge, fit, evidence, ..
        } = *place;
        let (seam, sigma) = (edge.y, edge.sigma);
        let (above, below) = (fit.sheet(seam), fit.sheet(seam) + fit.size());
        let (own, other) = if self.feature.seam_below {
            (below, above)
        } else {
            (above, below)
        };
        let surety = Sure::of(&self.feature).measure(&edge, evidence);
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
            quality: limit(f32::from(Sighting::SURE) * surety, 0.0, 255.0) as u8,
        }
    }
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
    fn a_bend_is_known_less_well_the_less_its_shape_explains_the_line() {
        let found = |shift: f32| {
            let pixels = image(120, |y| {
                let aside = 1.0 - (y - 148.0) * (y - 148.0) / 225.0;
                120.0 - 0.27 * (y - 129.5).abs() + shift * aside.max(0.0)
            });
            let view = View::new(&pixels, SIDE, SIDE).unwrap();
            let bend = SeamSensor::new(Pinhole::TRACKING, Joint::Vee { flank: 0.27 });
            bend.find(&view).unwrap()
        };
        let (plain, shifted) = (found(0.0), found(3.0));
        assert!(
            (plain.y - 129.5).abs() < 0.5 && plain.quality >= Sighting::SURE,
            "{plain:?}"
        );
        assert!(shifted.sigma > 1.2 * plain.sigma, "{shifted:?} for {plain:?}");
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
        assert!((sighting.angle() - 0.08).abs() < 0.01);
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
