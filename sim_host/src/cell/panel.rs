//! The part as it really lies: joint, displacement, deformation, dents. Truth, for rendering and scoring only.
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

use super::path::{SeamFrame, SeamPath};
use firmware::vision::joint::Joint as Pattern;
use nalgebra::{Isometry3, Point3, Vector2, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::{PI, TAU};

/// Sheet thickness of the paper's part (1.2, 4.6), m.
pub const SHEET_M: f64 = 0.0006;
/// A part goes on this far before its seam's start and past its end, m, unless it is made to end there. Assumed: beyond any view from the seam.
pub const RUN_ON_M: f64 = 0.120;
/// The sheets reach this far to either side of the seam, m. Assumed, because it is well beyond the 30 mm view.
pub const HALF_WIDTH_M: f64 = 0.060;
/// How far the lower sheet goes on past an end of the part, m. Assumed: the flange that a lapped sheet is set back on.
pub const FLANGE_M: f64 = 0.012;
/// Shortest and longest wavelength of the deformation, m (issue 2: "deformed ±2 mm over 150–400 mm").
pub const DEFORMATION_WAVELENGTH_M: [f64; 2] = [0.150, 0.400];

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

/// State of the part's surface; also chooses the optical disturbances that the camera renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Surface {
    /// Matt, flat sheet, no gap in the joint.
    Clean,
    /// Primed sheet after spot welding: the ordinary part.
    #[default]
    Moderate,
    /// Oily, scratched and dented sheet.
    Harsh,
}

/// How far sheets differ from flat and the joint from tight.
struct Roughness {
    /// Amplitude of each of the undulation's [`UNDULATIONS`] waves, m.
    undulation_m: f64,
    /// Largest depth of a dent, m.
    dent_m: f64,
    /// Dents per metre of seam, within 25 mm of it.
    dents_per_m: f64,
    /// Largest gap between lapped sheets, m (2.3: "gaps of the joint make the step larger than the sheet").
    gap_m: f64,
    /// Largest inclination of one sheet against the other across the seam, rad.
    lap_tilt_rad: f64,
}

impl Surface {
    /// Assumed, because the paper speaks of dented panels without figures; chosen so that a dent is shallower than the
    /// sheet is thick (moderate) or nearly as deep (harsh).
    fn roughness(self) -> Roughness {
        match self {
            Self::Clean => Roughness {
                undulation_m: 0.00001,
                dent_m: 0.0,
                dents_per_m: 0.0,
                gap_m: 0.0,
                lap_tilt_rad: 0.0,
            },
            Self::Moderate => Roughness {
                undulation_m: 0.00004,
                dent_m: 0.00025,
                dents_per_m: 15.0,
                gap_m: 0.00015,
                lap_tilt_rad: 1_f64.to_radians(),
            },
            Self::Harsh => Roughness {
                undulation_m: 0.00008,
                dent_m: 0.0005,
                dents_per_m: 25.0,
                gap_m: 0.00025,
                lap_tilt_rad: 1.5_f64.to_radians(),
            },
        }
    }
}

const DEFORMATION_WAVES: usize = 3;
const UNDULATIONS: usize = 4;
/// Wavelengths of the undulation, m; radii of the dents, m.
const UNDULATION_WAVELENGTH_M: [f64; 2] = [0.025, 0.080];
const DENT_RADIUS_M: [f64; 2] = [0.006, 0.015];
/// Dents are drawn within this distance of the seam, m.
const DENT_REACH_M: f64 = 0.025;

/// One wave along the seam.
#[derive(Clone, Copy, Debug)]
struct Sway {
    amplitude: f64,
    wave_number: f64,
    phase: f64,
}

/// One plane wave of height over the plate.
#[derive(Clone, Copy, Debug)]
struct Swell {
    amplitude: f64,
    kx: f64,
    ky: f64,
    phase: f64,
}

impl Swell {
    fn draw(rng: &mut Pcg64, amplitude: f64, wavelength: [f64; 2], spread: f64) -> Self {
        let k = TAU / rng.random_range(wavelength[0]..wavelength[1]);
        let (sin, cos) = rng.random_range(-spread..spread).sin_cos();
        Self {
            amplitude,
            kx: k * cos,
            ky: k * sin,
            phase: rng.random_range(0.0..TAU),
        }
    }
}

/// A smooth dent or bump of finite reach: depth·(1 − r²/R²)³.
#[derive(Clone, Copy, Debug)]
struct Dent {
    x: f64,
    y: f64,
    radius: f64,
    height: f64,
}

/// Height of the sheets over the plane of Σ_W, without the joint, and its gradient.
#[derive(Clone, Copy, Debug)]
struct Relief {
    height: f64,
    gradient: Vector2<f64>,
}

/// The true part.
#[derive(Clone, Debug)]
pub struct Panel {
    path: SeamPath,
    joint: Joint,
    surface: Surface,
    t_b_w: Isometry3<f64>,
    sways: [Sway; DEFORMATION_WAVES],
    swells: [Swell; DEFORMATION_WAVES + UNDULATIONS],
    dents: Vec<Dent>,
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
        let sways = std::array::from_fn(|_| Sway {
            amplitude: rng.random_range(0.3..1.0),
            wave_number: TAU / rng.random_range(DEFORMATION_WAVELENGTH_M[0]..DEFORMATION_WAVELENGTH_M[1]),
            phase: rng.random_range(0.0..TAU),
        });
        // Within 60° of the first tangent, so that a straight seam meets them at nearly their own wavelength.
        let swells = std::array::from_fn(|index| {
            if index < DEFORMATION_WAVES {
                let amplitude = rng.random_range(0.3..1.0);
                Swell::draw(rng, amplitude, DEFORMATION_WAVELENGTH_M, PI / 3.0)
            } else {
                Swell::draw(rng, roughness.undulation_m, UNDULATION_WAVELENGTH_M, PI)
            }
        });
        let seam_span = -RUN_ON_M..path.length() + RUN_ON_M;
        let dent_count = (roughness.dents_per_m * (path.length() + 2.0 * RUN_ON_M)).round() as usize;
        let dents = (0..dent_count)
            .map(|_| {
                let frame = path.at(rng.random_range(seam_span.clone()));
                let centre = frame.p + frame.b * rng.random_range(-DENT_REACH_M..DENT_REACH_M);
                Dent {
                    x: centre.x,
                    y: centre.y,
                    radius: rng.random_range(DENT_RADIUS_M[0]..DENT_RADIUS_M[1]),
                    height: roughness.dent_m * rng.random_range(-1.0..1.0),
                }
            })
            .collect();
        let mut panel = Self {
            path,
            joint,
            surface,
            t_b_w,
            sways,
            swells,
            dents,
            gap: roughness.gap_m * rng.random_range(0.0..1.0),
            lap_tilt: roughness.lap_tilt_rad * rng.random_range(-1.0..1.0),
            before_start: [RUN_ON_M; 2],
            past_end: [RUN_ON_M; 2],
        };
        panel.scale_deformation(deform_m);
        panel
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

    /// Scales both deformations so that their peaks along the seam are `peak`.
    fn scale_deformation(&mut self, peak: f64) {
        let steps = (self.path.length() / 0.002).ceil() as usize;
        let (mut sideways, mut height) = (0.0_f64, 0.0_f64);
        for step in 0..=steps {
            let s = self.path.length() * step as f64 / steps as f64;
            let p = self.path.at(s).p;
            sideways = sideways.max(self.sideways(s).0.abs());
            height = height.max(relief_of(&self.swells[..DEFORMATION_WAVES], p.x, p.y).height.abs());
        }
        for sway in &mut self.sways {
            sway.amplitude *= peak / sideways;
        }
        for swell in &mut self.swells[..DEFORMATION_WAVES] {
            swell.amplitude *= peak / height;
        }
    }

    /// d_b(s), m, and its derivative.
    fn sideways(&self, s: f64) -> (f64, f64) {
        self.sways.iter().fold((0.0, 0.0), |(value, slope), sway| {
            let (sin, cos) = (sway.wave_number * s + sway.phase).sin_cos();
            (
                value + sway.amplitude * sin,
                slope + sway.amplitude * sway.wave_number * cos,
            )
        })
    }

    fn relief(&self, x: f64, y: f64, dents: &[Dent]) -> Relief {
        let mut relief = relief_of(&self.swells, x, y);
        for dent in dents {
            let (dx, dy) = (x - dent.x, y - dent.y);
            let inside = 1.0 - (dx * dx + dy * dy) / (dent.radius * dent.radius);
            if inside > 0.0 {
                relief.height += dent.height * inside * inside * inside;
                let slope = -6.0 * dent.height * inside * inside / (dent.radius * dent.radius);
                relief.gradient += Vector2::new(dx, dy) * slope;
            }
        }
        relief
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
        let (shift, shift_slope) = self.sideways(s);
        let p = nominal.p + nominal.b * shift;
        let relief = self.relief(p.x, p.y, &self.dents);
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

    /// Point of the base sheet, continued beyond its edge, at nominal arc length `s` and `left` of the true seam (m), in Σ_B; of a bend, the
    /// plane between its flanks.
    pub fn base_sheet(&self, s: f64, left: f64) -> Vector3<f64> {
        let nominal = self.path.at(s);
        let p = nominal.p + nominal.b * (self.sideways(s).0 + left);
        let height = self.relief(p.x, p.y, &self.dents).height;
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

    /// The part around a point of Σ_W, for a camera that looks at it.
    pub fn around(&self, centre_w: &Vector3<f64>, radius: f64) -> Patch<'_> {
        let near = |dent: &&Dent| (dent.x - centre_w.x).hypot(dent.y - centre_w.y) < radius + dent.radius;
        Patch {
            panel: self,
            dents: self.dents.iter().filter(near).copied().collect(),
        }
    }
}

fn relief_of(swells: &[Swell], x: f64, y: f64) -> Relief {
    let mut relief = Relief {
        height: 0.0,
        gradient: Vector2::zeros(),
    };
    for swell in swells {
        let (sin, cos) = (swell.kx * x + swell.ky * y + swell.phase).sin_cos();
        relief.height += swell.amplitude * sin;
        relief.gradient += Vector2::new(swell.kx, swell.ky) * (swell.amplitude * cos);
    }
    relief
}

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
    panel: &'a Panel,
    dents: Vec<Dent>,
}

impl Patch<'_> {
    /// Where `point` of Σ_W lies against the part.
    pub fn clearance(&self, point: &Vector3<f64>) -> Clearance {
        let panel = self.panel;
        let (s, across) = panel.path.project(point.x, point.y);
        let left = across - panel.sideways(s).0;
        let above = point.z - panel.relief(point.x, point.y, &self.dents).height;
        let levels = match panel.joint {
            Joint::Crank { sheet_m: 0.0, .. } => [0.0, 0.0],
            Joint::Crank { upper, sheet_m } => [0.0, sheet_m + panel.gap + panel.lap_tilt * left * upper.sign()],
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
            (Joint::Crank { upper, sheet_m }, Sheet::Base) => (upper.sign(), sheet_m + self.panel.gap),
            (Joint::Lip { sheet, drop_m, .. }, Sheet::Other) => (sheet.sign(), drop_m),
            _ => return false,
        };
        let toward_wall = sideways * wall_sign;
        toward_wall > 0.0 && left.abs() * up < wall_height * toward_wall
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    fn part(path: SeamPath, joint: Joint, seed: u64) -> Panel {
        let lie = Isometry3::from_parts(
            Vector3::new(0.4, -0.1, 0.2).into(),
            UnitQuaternion::from_euler_angles(0.02, 0.35, -0.5),
        );
        let mut rng = Pcg64::new(u128::from(seed), 7);
        Panel::new(path, joint, Surface::Moderate, 0.002, lie, &mut rng)
    }

    #[test]
    fn a_deformed_seam_leaves_the_nominal_one_by_its_stated_peak() {
        for seed in 0..20 {
            let panel = part(SeamPath::panel(), Joint::crank(Side::Left), seed);
            let steps = 2000;
            let sideways = (0..=steps)
                .map(|step| {
                    panel
                        .sideways(panel.path.length() * f64::from(step) / f64::from(steps))
                        .0
                })
                .fold(0.0_f64, |peak, value| peak.max(value.abs()));
            assert!((sideways - 0.002).abs() < 2e-5, "peak {sideways} m with seed {seed}");
        }
    }

    #[test]
    fn the_seam_point_lies_on_the_base_sheet_at_zero_distance() {
        for joint in [Joint::crank(Side::Right), Joint::vee(), Joint::lip(Side::Left)] {
            let panel = part(SeamPath::arc(), joint, 3);
            for step in 0..50 {
                let point = panel.seam(0.01 * f64::from(step)).p;
                let in_w = panel.t_b_w.inverse_transform_point(&point.into()).coords;
                let clearance = panel.around(&in_w, 0.02).clearance(&in_w);
                assert!(clearance.left.abs() < 1e-5, "{clearance:?}");
                // A flank of 15° lifts by 0.27 of what the seam's obliqueness moves the nearest station.
                assert!(clearance.above[0].abs() < 3e-6, "{clearance:?}");
            }
        }
    }

    #[test]
    fn a_lap_joint_steps_up_by_the_sheet_and_its_gap_on_the_stated_side() {
        for (side, sign) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
            let panel = part(SeamPath::straight(), Joint::crank(side), 5);
            let frame = panel.seam(0.2);
            for (offset, here, there) in [(-0.001, Sheet::Base, Sheet::Other), (0.001, Sheet::Other, Sheet::Base)] {
                let point = frame.p + frame.b * (sign * offset);
                let in_w = panel.t_b_w.inverse_transform_point(&point.into()).coords;
                let patch = panel.around(&in_w, 0.02);
                let clearance = patch.clearance(&in_w);
                assert!(patch.covers(here, clearance.left) && !patch.covers(there, clearance.left));
                let step = clearance.above[0] - clearance.above[1];
                assert!((0.00055..0.00085).contains(&step), "step {step} m");
            }
        }
    }

    proptest! {
        #[test]
        fn the_nearest_station_of_a_point_beside_the_seam_is_found(
            seed in 0_u64..5, s in 0.0_f64..0.6, guess in -0.02_f64..0.02,
            left in -0.003_f64..0.003, up in -0.003_f64..0.003,
        ) {
            let panel = part(SeamPath::panel(), Joint::crank(Side::Left), seed);
            let frame = panel.seam(s);
            let point = frame.p + frame.b * left + frame.n * up;
            let found = panel.nearest(&point, s + guess);
            prop_assert!((found - s).abs() < 1e-6, "{} m for {} m", found, s);
        }

        #[test]
        fn frames_of_the_true_seam_are_orthonormal_and_follow_it(seed in 0_u64..5, s in 0.0_f64..0.75) {
            let panel = part(SeamPath::arc(), Joint::vee(), seed);
            let (here, next) = (panel.seam(s), panel.seam(s + 1e-6));
            prop_assert!(here.t.dot(&here.n).abs() < 1e-12 && (here.b.norm() - 1.0).abs() < 1e-12);
            prop_assert!(((next.p - here.p).normalize() - here.t).norm() < 1e-4);
        }
    }
}
