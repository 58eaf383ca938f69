//! The part as it really lies: joint, displacement, deformation, dents. Truth, for rendering and scoring only. Its `form` is how it differs from flat
//! and straight, its `surface` how much; a `patch` of it is what a camera sees.
//!
//! A panel is a nominal [`SeamPath`] in Σ_W whose seam is shifted in the plane by `d_b(s)`, whose sheets are lifted by a
//! smooth height field (deformation, undulation, dents) over the plane, and which lies at `T_b_w` in the base frame Σ_B.
//! Metres, radians, f64.
//!
//! The seam point, the same for this truth and for the sensor:
//! - crank (lap joint): foot of the upper sheet's edge, on the lower sheet;
//! - vee (bend): bottom of the valley;
//! - lip (sheet edge at a hole or drop): upper corner of the sheet's edge.
//!
//! Left out: rolled or burred edges (below 0.1 mm, less than a pixel) and light that enters the gap.

mod form;
mod patch;
mod surface;

pub use patch::{Clearance, Patch, Sheet};
pub use surface::Surface;

use super::path::{SeamFrame, SeamPath};
use firmware::vision::joint::Joint as Pattern;
use form::{Form, Relief};
use nalgebra::{Isometry3, Point3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

/// Sheet thickness of the paper's part (1.2, 4.6), m.
pub const SHEET_M: f64 = 0.0006;
/// A part goes on this far before its seam's start and past its end, m, unless it is made to end there. Assumed: beyond any view from the seam.
pub const RUN_ON_M: f64 = 0.120;
/// The sheets reach this far to either side of the seam, m. Assumed, because it is well beyond the 30 mm view.
pub const HALF_WIDTH_M: f64 = 0.060;
/// Nearer to the seam than this, m, a tip is at its work: over a joint, whose one sheet is higher than the other.
const AT_WORK_M: f64 = 0.003;
/// How far the lower sheet goes on past an end of the part, m. Assumed: the flange that a lapped sheet is set back on.
pub const FLANGE_M: f64 = 0.012;
/// A side of the seam, seen in the direction of travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Toward +b.
    Left,
    /// Toward −b.
    Right,
}

impl Side {
    /// +1 for left, −1 for right.
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// Shape of the joint across the seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Joint {
    /// Lap joint: a sheet of thickness `sheet_m` lies on the other, on the side `upper`. A thickness of zero is a plain
    /// plate without a seam.
    Crank {
        /// Where the upper sheet lies.
        upper: Side,
        /// Its thickness, m.
        sheet_m: f64,
    },
    /// Bend: two flanks that rise by `flank_rad` from the valley in which they meet.
    Vee {
        /// Inclination of each flank, rad.
        flank_rad: f64,
    },
    /// Sheet edge: the sheet lies on the side `sheet`; beyond a gap `gap_m`, another lies `drop_m` lower.
    Lip {
        /// Where the sheet lies.
        sheet: Side,
        /// How far the next sheet lies below, m.
        drop_m: f64,
        /// Width without any surface beside the edge, m.
        gap_m: f64,
    },
}

impl Joint {
    /// The paper's lap joint of 0.6 mm sheet.
    pub const fn crank(upper: Side) -> Self {
        Self::Crank {
            upper,
            sheet_m: SHEET_M,
        }
    }

    /// A plate without a seam.
    pub const PLAIN: Self = Self::Crank {
        upper: Side::Left,
        sheet_m: 0.0,
    };

    /// A valley of 150°: flanks of 15°, assumed, because the paper prints no angle.
    pub fn vee() -> Self {
        Self::Vee {
            flank_rad: 15_f64.to_radians(),
        }
    }

    /// An edge 3 mm above the next sheet with a 1 mm gap: assumed, because the paper draws it without figures.
    pub const fn lip(sheet: Side) -> Self {
        Self::Lip {
            sheet,
            drop_m: 0.003,
            gap_m: 0.001,
        }
    }

    /// The same as a sensor is told: hand, sheet and angle are on the part's drawing.
    pub fn pattern(self) -> Pattern {
        match self {
            Self::Crank { upper, sheet_m } => Pattern::Crank {
                upper_left: upper == Side::Left,
                sheet_m: sheet_m as f32,
            },
            Self::Vee { flank_rad } => Pattern::Vee {
                flank: flank_rad.tan() as f32,
            },
            Self::Lip { sheet, drop_m, gap_m } => Pattern::Lip {
                sheet_left: sheet == Side::Left,
                drop_m: drop_m as f32,
                gap_m: gap_m as f32,
            },
        }
    }
}

/// The true part.
#[derive(Clone, Debug)]
pub struct Panel {
    path: SeamPath,
    joint: Joint,
    surface: Surface,
    t_b_w: Isometry3<f64>,
    form: Form,
    gap: f64,
    lap_tilt: f64,
    /// How far base and other sheet reach before the seam's start, m.
    before_start: [f64; 2],
    /// And past its end.
    past_end: [f64; 2],
}

impl Panel {
    /// A part with the nominal seam `path` and `joint`, really lying at `t_b_w` in Σ_B, with a seam bent sideways and in
    /// height to a peak of `deform_m` (m, either sign) each; `surface` sets dents and gaps. All draws come from `rng`.
    pub fn new(
        path: SeamPath,
        joint: Joint,
        surface: Surface,
        deform_m: f64,
        t_b_w: Isometry3<f64>,
        rng: &mut Pcg64,
    ) -> Self {
        let roughness = surface.roughness();
        let mut form = Form::draw(&path, &roughness, rng);
        form.scale(&path, deform_m);
        Self {
            path,
            joint,
            surface,
            t_b_w,
            form,
            gap: roughness.gap_m * rng.random_range(0.0..1.0),
            lap_tilt: roughness.lap_tilt_rad * rng.random_range(-1.0..1.0),
            before_start: [RUN_ON_M; 2],
            past_end: [RUN_ON_M; 2],
        }
    }

    /// The same part ending where its seam starts, square to the seam.
    pub fn ending_at_start(mut self) -> Self {
        self.before_start = self.flange();
        self
    }

    /// The same part ending where its seam ends.
    pub fn ending_at_end(mut self) -> Self {
        self.past_end = self.flange();
        self
    }

    /// How far base and other sheet reach past an end of the part, m: the sheet whose edge is the seam ends there, and the one below it
    /// [`FLANGE_M`] further on; both flanks of a bend end together.
    fn flange(&self) -> [f64; 2] {
        match self.joint {
            Joint::Crank { .. } => [FLANGE_M, 0.0],
            Joint::Vee { .. } => [0.0, 0.0],
            Joint::Lip { .. } => [0.0, FLANGE_M],
        }
    }

    /// Nominal seam of the part, in Σ_W.
    pub fn path(&self) -> &SeamPath {
        &self.path
    }

    /// The joint.
    pub fn joint(&self) -> Joint {
        self.joint
    }

    /// The surface.
    pub fn surface(&self) -> Surface {
        self.surface
    }

    /// Where the part really lies: pose of Σ_W in Σ_B.
    pub fn t_b_w(&self) -> &Isometry3<f64> {
        &self.t_b_w
    }

    /// Point and derivative of the true seam by nominal arc length, in Σ_W.
    fn seam_w(&self, s: f64) -> (Vector3<f64>, Vector3<f64>, Relief) {
        let nominal = self.path.at(s);
        let (shift, shift_slope) = self.form.sideways(s);
        let p = nominal.p + nominal.b * shift;
        let relief = self.form.relief(p.x, p.y);
        let along = nominal.t * (1.0 - self.path.curvature(s) * shift) + nominal.b * shift_slope;
        (
            Vector3::new(p.x, p.y, relief.height),
            Vector3::new(along.x, along.y, relief.gradient.dot(&along.xy())),
            relief,
        )
    }

    /// The true seam at nominal arc length `s` (m), in Σ_B. `n` is the normal of the sheets without the joint's shape.
    pub fn seam(&self, s: f64) -> SeamFrame {
        let (p, along, relief) = self.seam_w(s);
        let n = Vector3::new(-relief.gradient.x, -relief.gradient.y, 1.0).normalize();
        let t = along.normalize();
        SeamFrame {
            p: (self.t_b_w * Point3::from(p)).coords,
            t: self.t_b_w * t,
            b: self.t_b_w * n.cross(&t),
            n: self.t_b_w * n,
        }
    }

    /// Where the upper sheet's edge is above the seam at nominal arc length `s` (m), in Σ_B; of other joints than a lap, the seam itself.
    pub fn edge(&self, s: f64) -> Vector3<f64> {
        let height = match self.joint {
            Joint::Crank { sheet_m, .. } => self.lapped(sheet_m),
            Joint::Vee { .. } | Joint::Lip { .. } => 0.0,
        };
        let seam = self.seam(s);
        seam.p + seam.n * height
    }

    /// Height of the face of a lapped sheet of this thickness over the sheet below, at the seam, m.
    fn lapped(&self, sheet_m: f64) -> f64 {
        sheet_m + self.gap
    }

    /// Point of the base sheet, continued beyond its edge, at nominal arc length `s` and `left` of the true seam (m), in Σ_B; of a bend, the
    /// plane between its flanks.
    pub fn base_sheet(&self, s: f64, left: f64) -> Vector3<f64> {
        let nominal = self.path.at(s);
        let p = nominal.p + nominal.b * (self.form.sideways(s).0 + left);
        let height = self.form.relief(p.x, p.y).height;
        (self.t_b_w * Point3::new(p.x, p.y, height)).coords
    }

    /// Nominal arc length (m) of the true seam's point nearest to `p` (Σ_B, m), searched by Newton from `s_guess`.
    pub fn nearest(&self, p: &Vector3<f64>, s_guess: f64) -> f64 {
        const STEP_LIMIT_M: f64 = 0.010;
        let p = self.t_b_w.inverse_transform_point(&Point3::from(*p)).coords;
        let mut s = s_guess;
        for _ in 0..20 {
            let (c, along, _) = self.seam_w(s);
            // Without the curvature term the step is that of Gauss and Newton: sure to descend, and quick within a
            // few millimetres of the seam.
            let step = (p - c).dot(&along) / along.norm_squared();
            s += step.clamp(-STEP_LIMIT_M, STEP_LIMIT_M);
            if step.abs() < 1e-10 {
                break;
            }
        }
        s
    }

    /// Height of a tip at `p` (Σ_B, m) over the sheets beside the seam, m; `None` at the seam itself, and where there is no sheet.
    pub fn clearance_beside_seam(&self, p: &Vector3<f64>) -> Option<f64> {
        let point = self.t_b_w.inverse_transform_point(&Point3::from(*p)).coords;
        let patch = self.around(&point, 0.0);
        let place = patch.clearance(&point);
        if !place.on_part || place.left.abs() < AT_WORK_M {
            return None;
        }
        let there = |sheet: &Sheet| patch.reaches(*sheet, place.along) && patch.covers(*sheet, place.left);
        let sheets = [Sheet::Base, Sheet::Other].into_iter().filter(there);
        sheets.map(|sheet| place.above[sheet as usize]).reduce(f64::min)
    }

    /// The part around a point of Σ_W, for a camera that looks at it.
    pub fn around(&self, centre_w: &Vector3<f64>, radius: f64) -> Patch<'_> {
        Patch {
            panel: self,
            dents: self.form.dents_near(centre_w, radius),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
