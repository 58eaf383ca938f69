//! The seam's row, from the line's shape and from its light.
//!
//! A bend's feature is fitted at places about the coarse one: their costs are the logarithm of a likelihood, its mean and
//! deviation the seam. Where a sheet ends the fit gives the sheets' lines, and the rows say where the light goes over from one to the
//! other ([`exchange`]) or where it ends ([`ending`]). Where that is likelier wrong than right, the image is refused.

use super::edge::{self, Change, Edge};
use super::ending::Profile;
use super::fit::{Fit, Problem, SAMPLES_MAX};
use super::image::View;
use super::joint::{Feature, HALF_WINDOW};
use super::sensor::Refusal;
use super::window::{EACH, Line};
use super::{exchange, search};
use crate::geometry::trig::sqrt;

/// Places to either side of the coarse one at which a bend is tried, and rows between them.
const PLACES: usize = 4;
/// See [`PLACES`].
const PLACE_ROWS: f32 = 2.5;
/// Where the rows about the coarse place put a sheet's end farther than this from there, px, those about that end are asked, by the lines there. The
/// net of a lap joint has learnt from the coarse lines, and asked again says the same.
const NEAR: f32 = 14.0;
/// Farther than this from where they were asked the rows say nothing of the step, px: the track left the line for a reflection of it.
const FAR: f32 = 28.0;
/// Standard deviations by which the feature's size may differ from the expected: a step to the other hand is no seam.
const SURPRISE: f32 = 3.0;
/// A place that is likelier wrong than right is no answer. A bend's is tried within one place only.
const SHARE: f32 = 0.5;
/// Grains of speckle, of two rows each, that must be seen to either side of the joint within the window.
const SIDE_SAMPLES: f32 = 6.0;

/// The seam's place along the line.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Its row and that row's standard deviation, px.
    pub edge: Edge,
    /// The fit there.
    pub fit: Fit,
    /// Logarithm of the likelihood ratio joint : no joint.
    pub evidence: f32,
    /// The row about which the rows were asked.
    middle: f32,
}

impl Place {
    /// Refuses what is likelier wrong than right: `proof` is the logarithm of the likelihood ratio joint : no joint that is asked for.
    pub fn judge(&self, proof: f32) -> Result<(), Refusal> {
        let moved = self.edge.y - self.middle;
        if self.evidence < proof {
            Err(Refusal::NoStep)
        } else if moved * moved > FAR * FAR || self.edge.share < SHARE {
            Err(Refusal::Unclear)
        } else {
            Ok(())
        }
    }
}

/// The feature's shape about a band in which the joint is likely.
struct Coarse<'a> {
    with: Problem<'a>,
    /// The best fit without the feature, and the best with it there.
    without: Fit,
    fit: Fit,
    /// The band's row.
    start: usize,
}

impl<'a> Coarse<'a> {
    fn of(line: &'a Line, feature: &'a Feature, band: usize, sigma: f32) -> Self {
        let start = band * search::PITCH;
        let first = start.saturating_sub(HALF_WINDOW);
        let (_, samples) = line.in_image().split_at_checked(first / EACH).unwrap_or_default();
        let with = Problem {
            samples: samples.get(..SAMPLES_MAX).unwrap_or(samples),
            origin: start as f32 - 0.5,
            sigma,
            feature: Some(feature),
        };
        let [without, fit] = with.without_and_with(with.origin);
        Self {
            with,
            without,
            fit,
            start,
        }
    }
}

/// Columns of the line above the edge and of the one below in row `y`.
fn lines(fit: &Fit, y: f32) -> (f32, f32) {
    (fit.sheet(y), fit.sheet(y) + fit.size())
}

/// What the rows about a band show that are asked first for a lap joint's edge; `sigma` as for [`find`].
pub fn rows(view: &View, line: &Line, feature: &Feature, band: usize, sigma: f32) -> exchange::Asked {
    let Coarse { fit, start, .. } = Coarse::of(line, feature, band, sigma);
    exchange::Asked::about(view, line.light, start, |y| lines(&fit, y))
}

/// Finds the seam, sure or not, about a band in which the joint is likely; `sigma` is the standard deviation of a row's centre, px. What the
/// rows say of the end of a sheet beside a gap is left in `ending`.
pub fn find(
    view: &View,
    line: &Line,
    feature: &Feature,
    band: usize,
    sigma: f32,
    ending: &mut Option<Profile>,
) -> Result<Place, Refusal> {
    let Coarse {
        with,
        without,
        fit: coarse,
        mut start,
    } = Coarse::of(line, feature, band, sigma);
    let mut middle = with.origin;
    let mut ask = |fit: &Fit, start: usize| {
        let lines = |y: f32| lines(fit, y);
        let profile = match feature.change {
            None => return by_shape(&with, fit),
            Some(Change::Exchange) => return exchange::locate(view, line.light, start, lines),
            Some(Change::Ends) => Profile::read(view, start, false, lines),
            Some(Change::Begins) => Profile::read(view, start, true, |y| {
                let (next, own) = lines(y);
                (own, next)
            }),
        };
        ending.insert(profile).edge()
    };
    let mut fit = coarse;
    let mut edge = ask(&fit, start);
    let moved = edge.y - middle;
    let ends = matches!(feature.change, Some(Change::Ends | Change::Begins));
    if ends && moved * moved > NEAR * NEAR {
        fit = with.refit(edge.y, &fit);
        middle = edge.y;
        start = (middle + 0.5).max(0.0) as usize;
        edge = ask(&fit, start);
    }
    let fit = with.refit(edge.y, &fit);
    let surprise = (fit.size() - feature.size) / feature.spread;
    let evidence = without.cost - fit.cost;
    if surprise * surprise > SURPRISE * SURPRISE || evidence < 0.0 {
        return Err(Refusal::NoStep);
    }
    let seen = |below: bool| {
        let side = with.samples.iter().filter(|sample| (sample.y > edge.y) == below);
        side.fold(0.0, |sum, sample| sum + sample.weight)
    };
    if seen(false).min(seen(true)) < SIDE_SAMPLES {
        return Err(Refusal::AtEdge);
    }
    Ok(Place {
        edge,
        fit,
        evidence,
        middle,
    })
}

/// Where the fit's cost, the negative logarithm of the likelihood, has the feature; from the middle outward, so that each fit
/// begins with its neighbour's.
fn by_shape(problem: &Problem, middle: &Fit) -> Edge {
    let mut places = [(0.0_f32, middle.cost); 1 + 2 * PLACES];
    let mut least = middle.cost;
    for (direction, side) in [-1.0, 1.0].into_iter().zip(places.chunks_exact_mut(PLACES)) {
        let (mut fit, mut away) = (*middle, 0.0);
        for place in side {
            away += direction * PLACE_ROWS;
            fit = problem.refit(problem.origin + away, &fit);
            *place = (away, fit.cost);
            least = least.min(fit.cost);
        }
    }
    // What the shape leaves unexplained, once a glint shifts rows for longer than neighbours differ, makes its place as much less certain (Birge).
    let weights = problem.samples.iter().fold(0.0, |sum, sample| sum + sample.weight);
    let unexplained = (2.0 * least / weights.max(1.0)).max(1.0);
    let (mut mass, mut moment, mut square) = (0.0_f32, 0.0_f32, 0.0_f32);
    for (away, cost) in places {
        let likelihood = edge::decay(cost - least);
        mass += likelihood;
        moment += likelihood * away;
        square += likelihood * away * away;
    }
    let mean = moment / mass;
    // Known no better than the grid: uniform over one step; at its end, where it may lie beyond, a whole one.
    let inner = (PLACES - 1) as f32 * PLACE_ROWS;
    let known = if mean * mean > inner * inner { 1.0 } else { 1.0 / 12.0 };
    Edge {
        y: problem.origin + mean,
        sigma: sqrt((square / mass - mean * mean).max(known * PLACE_ROWS * PLACE_ROWS) * unexplained),
        share: 1.0,
        far: 0.0,
    }
}
