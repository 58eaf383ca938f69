//! The part around a place, for a camera that looks at it: where points lie against its two sheets, and what hides them.

use super::form::Dent;
use super::{HALF_WIDTH_M, Joint, Panel, RUN_ON_M};
use nalgebra::Vector3;

/// One of the two sheets (or flanks) of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sheet {
    /// The one on which the seam point lies: lower sheet, right flank, sheet with the edge.
    Base,
    /// The other: upper sheet, left flank, the sheet below.
    Other,
}

/// Where a point of Σ_W lies against the part.
#[derive(Clone, Copy, Debug)]
pub struct Clearance {
    /// Height above the base sheet and above the other, each continued beyond its edge, m.
    pub above: [f64; 2],
    /// Distance to the left of the true seam, m.
    pub left: f64,
    /// Nominal arc length, m; negative before the seam's start.
    pub along: f64,
    /// The point lies over the part, not past its border.
    pub on_part: bool,
}

/// A part seen from near by.
#[derive(Clone, Debug)]
pub struct Patch<'a> {
    pub(super) panel: &'a Panel,
    pub(super) dents: Vec<Dent>,
}

impl Patch<'_> {
    /// Where `point` of Σ_W lies against the part.
    pub fn clearance(&self, point: &Vector3<f64>) -> Clearance {
        let panel = self.panel;
        let (s, across) = panel.path.project(point.x, point.y);
        let left = across - panel.form.sideways(s).0;
        let above = point.z - panel.form.relief_with(point.x, point.y, &self.dents).height;
        let levels = match panel.joint {
            Joint::Crank { sheet_m: 0.0, .. } => [0.0, 0.0],
            Joint::Crank { upper, sheet_m } => [0.0, panel.lapped(sheet_m) + panel.lap_tilt * left * upper.sign()],
            Joint::Vee { flank_rad } => [-flank_rad.tan() * left, flank_rad.tan() * left],
            Joint::Lip { sheet, drop_m, .. } => [0.0, -drop_m + panel.lap_tilt * left * sheet.sign()],
        };
        Clearance {
            above: levels.map(|level| above - level),
            left,
            along: s,
            on_part: s > -RUN_ON_M && s < panel.path.length() + RUN_ON_M && across.abs() < HALF_WIDTH_M,
        }
    }

    /// Whether `sheet` reaches to `along` (m) from the seam's start.
    pub fn reaches(&self, sheet: Sheet, along: f64) -> bool {
        let (panel, sheet) = (self.panel, sheet as usize);
        (-panel.before_start[sheet]..=panel.path.length() + panel.past_end[sheet]).contains(&along)
    }

    /// Whether `sheet` reaches to `left` (m) of the seam.
    pub fn covers(&self, sheet: Sheet, left: f64) -> bool {
        let inside = match self.panel.joint {
            Joint::Crank { upper: side, .. } | Joint::Lip { sheet: side, .. } => left * side.sign(),
            Joint::Vee { .. } => left,
        };
        match (self.panel.joint, sheet) {
            (Joint::Lip { .. }, Sheet::Base) => inside >= 0.0,
            (Joint::Lip { gap_m, .. }, Sheet::Other) => inside < -gap_m,
            (_, Sheet::Base) => inside < 0.0,
            (_, Sheet::Other) => inside >= 0.0,
        }
    }

    /// Whether the joint's edge stands between a point on `sheet`, `left` of the seam, and something that lies in the
    /// direction (`sideways` to the left, `up`). Only the lower sheet can be hidden, and only by the edge beside it.
    pub fn hidden(&self, sheet: Sheet, left: f64, sideways: f64, up: f64) -> bool {
        let (wall_sign, wall_height) = match (self.panel.joint, sheet) {
            (Joint::Crank { upper, sheet_m }, Sheet::Base) => (upper.sign(), self.panel.lapped(sheet_m)),
            (Joint::Lip { sheet, drop_m, .. }, Sheet::Other) => (sheet.sign(), drop_m),
            _ => return false,
        };
        let toward_wall = sideways * wall_sign;
        toward_wall > 0.0 && left.abs() * up < wall_height * toward_wall
    }
}
