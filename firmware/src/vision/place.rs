//! The seam's row, from the line's shape and from its light.
//!
//! The joint's feature is fitted at places about the coarse one: their costs are the logarithm of a likelihood, its mean and
//! deviation the seam by shape. Where a sheet ends the light of the rows says where ([`edge`]). What a glint does to the one
//! it rarely does to the other: where they disagree, or where neither is sure, the image is refused.

use super::edge::{self, Change, Edge};
use super::fit::{Fit, Problem, SAMPLES_MAX};
use super::image::View;
use super::joint::{Feature, HALF_WINDOW};
use super::search;
use super::sensor::Refusal;
use super::window::{EACH, Line};
use crate::geometry::trig::sqrt;

/// Places to either side of the coarse one that are tried, rows between them: finely where shape is all there is, coarsely where the
/// light says the rest.
const FINELY: (usize, f32) = (4, 2.0);
/// See [`FINELY`].
const COARSELY: (usize, f32) = (3, 2.5);
/// Rows by which light and shape may disagree on the seam, px: what a glint beside the joint does to the shape.
const DISAGREEMENT: f32 = 16.0;
/// Standard deviation of what light and shape do not share, px: the same rows speak for both, so the shape's own is too small.
const ALIKE: f32 = 3.0;
/// The light looks again where it found the edge farther than this from where the sheets' lines were fitted for, px.
const NEAR: f32 = 3.0;
/// Logarithm of the likelihood ratio joint : no joint that is asked of the final fit.
const PROOF: f32 = 7.0;
/// Standard deviations by which the feature's size may differ from the expected: a step to the other hand is no seam.
const SURPRISE: f32 = 3.0;
/// Largest standard deviation of the seam's row, px: 0.3 mm.
pub const SIGMA_LIMIT: f32 = 2.5;
/// Half the widest gap beside a sheet's edge, rows: 1 mm of gap, 1 mm of shadow, and what drop-outs add.
const GAP: f32 = 28.0;
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
}

/// Finds the seam about a band in which the joint is likely; `sigma` is the standard deviation of a row's centre, px.
pub fn find(view: &View, line: &Line, feature: &Feature, band: usize, sigma: f32) -> Result<Place, Refusal> {
    let start = band * search::PITCH;
    let first = start.saturating_sub(HALF_WINDOW);
    let (_, samples) = line.in_image().split_at_checked(first / EACH).unwrap_or_default();
    let samples = samples.get(..SAMPLES_MAX).unwrap_or(samples);
    let middle = start as f32 - 0.5;
    let with = Problem {
        samples,
        origin: middle,
        sigma,
        feature: Some(feature),
    };
    let without = Problem { feature: None, ..with }.fit(middle);
    let coarse = with.fit(middle);
    let shape = by_shape(&with, &coarse, if feature.change.is_some() { COARSELY } else { FINELY });
    let fit = with.refit(shape.y, &coarse);
    let lines = |y: f32| (fit.sheet(y), fit.sheet(y) + fit.size());
    let light = |change| edge::locate(view, line.light, start, change, lines);
    let edge = match feature.change {
        None => shape,
        Some(Change::Exchange) => {
            let first = light(Change::Exchange);
            let moved = first.y - middle;
            let again = moved * moved > NEAR * NEAR;
            let fit = if again { with.refit(first.y, &fit) } else { fit };
            let lines = |y: f32| (fit.sheet(y), fit.sheet(y) + fit.size());
            let light = if again {
                edge::locate(view, line.light, start, Change::Exchange, lines)
            } else {
                first
            };
            agree(light, shape)?
        }
        Some(change) => beside(light(change), shape)?,
    };
    let fit = with.refit(edge.y, &fit);
    let surprise = (fit.size() - feature.size) / feature.spread;
    let evidence = without.cost - fit.cost;
    if surprise * surprise > SURPRISE * SURPRISE || evidence < PROOF {
        return Err(Refusal::NoStep);
    }
    let seen = |below: bool| {
        let side = samples.iter().filter(|sample| (sample.y > edge.y) == below);
        side.fold(0.0, |sum, sample| sum + sample.weight)
    };
    if seen(false).min(seen(true)) < SIDE_SAMPLES {
        return Err(Refusal::AtEdge);
    }
    if edge.sigma > SIGMA_LIMIT {
        return Err(Refusal::Unclear);
    }
    Ok(Place { edge, fit, evidence })
}

/// Where the fit's cost, the negative logarithm of the likelihood, has the feature; from the middle outward, so that each fit
/// begins with its neighbour's.
fn by_shape(problem: &Problem, middle: &Fit, (count, step): (usize, f32)) -> Edge {
    // Places that are not tried cost too much to count.
    let mut places = [(0.0_f32, f32::MAX); 1 + 2 * FINELY.0];
    if let Some(last) = places.last_mut() {
        last.1 = middle.cost;
    }
    let mut least = middle.cost;
    for (direction, side) in [-1.0, 1.0].into_iter().zip(places.chunks_exact_mut(FINELY.0)) {
        let (mut fit, mut away) = (*middle, 0.0);
        for place in side.iter_mut().take(count) {
            away += direction * step;
            fit = problem.refit(problem.origin + away, &fit);
            *place = (away, fit.cost);
            least = least.min(fit.cost);
        }
    }
    let (mut mass, mut moment, mut square) = (0.0_f32, 0.0_f32, 0.0_f32);
    for (away, cost) in places {
        let likelihood = edge::decay(cost - least);
        mass += likelihood;
        moment += likelihood * away;
        square += likelihood * away * away;
    }
    let mean = moment / mass;
    Edge {
        y: problem.origin + mean,
        // Known no better than the grid: uniform over one step.
        sigma: sqrt((square / mass - mean * mean).max(step * step / 12.0)),
    }
}

/// Light and shape must agree: what a glint does to the one it rarely does to the other.
fn agree(light: Edge, shape: Edge) -> Result<Edge, Refusal> {
    let apart = light.y - shape.y;
    if apart * apart > DISAGREEMENT * DISAGREEMENT {
        return Err(Refusal::Unclear);
    }
    let (a, b) = (
        1.0 / (light.sigma * light.sigma),
        1.0 / (shape.sigma * shape.sigma + ALIKE * ALIKE),
    );
    Ok(Edge {
        y: (a * light.y + b * shape.y) / (a + b),
        sigma: sqrt(1.0 / (a + b)),
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
