//! Where the slit's light meets the sheets, row by row.
//!
//! A row of pixels and the camera's centre span a plane that meets the slit plane in a line; along it each sheet,
//! continued beyond its edge, is met once. These meeting points are solved on every fourth row of the image, where the
//! sheets are smooth (nothing shorter than 12 mm, 100 px), and interpolated by cubics; which sheet is really there, and
//! what the joint's edge hides from the camera or from the projector, is decided at each point asked for.

use super::optics::Optics;
use crate::cell::panel::{Panel, Patch, Sheet};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// Rows between solved rows; besides those of the image one beyond its top and two below its bottom are solved, for the cubics.
const PITCH: usize = 4;
/// The line is looked for this far beyond the image's sides, px, for its halo.
const BESIDE: f64 = 40.0;
/// And this far beyond the field of view for dents, m.
const AROUND_M: f64 = 0.004;
/// Edges are looked for this near to the seam, m: 3 mm deep at an incidence of 45° cannot throw a longer shadow.
const SHADOW_REACH_M: f64 = 0.004;

/// A seam that turns by more than this between the sensor's middle and the slit has its edges looked for in another direction at each point, rad.
/// Below it (R150 turns by 4°) one direction serves for all.
const TURNING_RAD: f64 = 0.3;

/// A point of light on a sheet as the camera sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Spot {
    x_px: f64,
    left: f64,
    along: f64,
    /// 1 on the part and within the columns, 0 elsewhere.
    lit: f64,
}

/// The light section of one slit from one pose.
#[derive(Clone, Debug)]
pub struct Section<'a> {
    optics: Optics,
    slit: usize,
    patch: Patch<'a>,
    knots: [Vec<Spot>; 2],
    /// Directions to the left across the seam and up from the sheet, in Σ_S.
    across: Vector3<f64>,
    up: Vector3<f64>,
    /// Of a seam that turns within the view: its part and how that lies in Σ_S.
    turning: Option<(&'a Panel, UnitQuaternion<f64>)>,
}

impl<'a> Section<'a> {
    /// Solves the light section of slit number `slit` for a sensor at `t_b_s`.
    pub fn of(panel: &'a Panel, optics: &Optics, slit: usize, t_b_s: &Isometry3<f64>) -> Self {
        let t_w_s = panel.t_b_w().inverse() * t_b_s;
        let patch = panel.around(&t_w_s.translation.vector, optics.reach_m() + AROUND_M);
        let (s, _) = panel.path().project(t_w_s.translation.x, t_w_s.translation.y);
        let seam = panel.seam(s);
        let level = optics.project(&Vector3::new(optics.slit(slit), 0.0, 0.0)).0;
        let at_slit = t_w_s * Point3::new(optics.slit(slit), 0.0, 0.0);
        let (slit_s, _) = panel.path().project(at_slit.x, at_slit.y);
        let turn = panel.path().at(s).t.angle(&panel.path().at(slit_s).t);
        let knots = [0, 1].map(|sheet| {
            let mut guess = level;
            (0..optics.height / PITCH + 4)
                .map(|knot| {
                    let y_px = (knot * PITCH) as f64 - PITCH as f64;
                    let spot = meet(&patch, optics, slit, &t_w_s, sheet, y_px, guess);
                    if spot.lit > 0.0 {
                        guess = spot.x_px;
                    }
                    spot
                })
                .collect()
        });
        Self {
            optics: *optics,
            slit,
            patch,
            knots,
            across: t_b_s.inverse_transform_vector(&seam.b),
            up: t_b_s.inverse_transform_vector(&seam.n),
            turning: (turn > TURNING_RAD).then(|| (panel, t_w_s.rotation.inverse())),
        }
    }

    /// Point of the slit's plane (Σ_S, m) that appears at pixel (x, y).
    pub fn point(&self, x_px: f64, y_px: f64) -> Vector3<f64> {
        self.optics.on_slit_plane(self.slit, x_px, y_px)
    }

    /// Columns at which row `y_px` shows light: base sheet, other sheet; both at once where the slit cuts both.
    pub fn columns(&self, y_px: f64) -> [Option<f64>; 2] {
        [self.column(Sheet::Base, y_px), self.column(Sheet::Other, y_px)]
    }

    fn column(&self, sheet: Sheet, y_px: f64) -> Option<f64> {
        let spot = interpolate(&self.knots[sheet as usize], y_px)?;
        if !self.patch.covers(sheet, spot.left) || !self.patch.reaches(sheet, spot.along) {
            return None;
        }
        if spot.left.abs() < SHADOW_REACH_M {
            let point = self.point(spot.x_px, y_px);
            let across = self
                .turning
                .map_or(self.across, |(panel, s_w)| s_w * panel.path().at(spot.along).b);
            for source in [self.optics.camera(), self.optics.projector(self.slit)] {
                let toward = source - point;
                let (sideways, up) = (toward.dot(&across), toward.dot(&self.up));
                if self.patch.hidden(sheet, spot.left, sideways, up) {
                    return None;
                }
            }
        }
        Some(spot.x_px)
    }
}

/// The meeting point of row `y_px` with one sheet, by secants from `guess` (px).
fn meet(
    patch: &Patch,
    optics: &Optics,
    slit: usize,
    t_w_s: &Isometry3<f64>,
    sheet: usize,
    y_px: f64,
    guess: f64,
) -> Spot {
    let (first, last) = (-BESIDE, optics.width as f64 + BESIDE);
    let clearance = |x_px: f64| {
        let point = optics.on_slit_plane(slit, x_px, y_px);
        patch.clearance(&(t_w_s * nalgebra::Point3::from(point)).coords)
    };
    // Height changes by about one pixel's size per pixel, downward: good enough to begin with.
    let mut slope = -optics.pixel_m;
    let mut x_px = guess;
    let mut here = clearance(x_px);
    for _ in 0..4 {
        let above = here.above[sheet];
        let next_px = (x_px - above / slope).clamp(first, last);
        if (next_px - x_px).abs() < 0.002 {
            break;
        }
        let next = clearance(next_px);
        let secant = (next.above[sheet] - above) / (next_px - x_px);
        if secant < 0.0 {
            slope = secant;
        }
        (x_px, here) = (next_px, next);
    }
    let inside = x_px > first && x_px < last;
    Spot {
        x_px,
        left: here.left,
        along: here.along,
        lit: f64::from(u8::from(here.on_part && inside)),
    }
}

/// Cubic (Catmull-Rom) through the knots.
fn interpolate(knots: &[Spot], y_px: f64) -> Option<Spot> {
    let at = y_px / PITCH as f64 + 1.0;
    let index = (at.floor() as usize).clamp(1, knots.len() - 3);
    let f = at - index as f64;
    let four = &knots[index - 1..index + 3];
    if four[1].lit + four[2].lit < 2.0 {
        return None;
    }
    let weights = [
        0.5 * f * (-1.0 + f * (2.0 - f)),
        1.0 + 0.5 * f * f * (-5.0 + 3.0 * f),
        0.5 * f * (1.0 + f * (4.0 - 3.0 * f)),
        0.5 * f * f * (f - 1.0),
    ];
    let mix = |value: fn(&Spot) -> f64| four.iter().zip(weights).map(|(spot, w)| w * value(spot)).sum();
    Some(Spot {
        x_px: mix(|spot| spot.x_px),
        left: mix(|spot| spot.left),
        along: mix(|spot| spot.along),
        lit: 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::panel::tests::{harsh_arc, level};
    use crate::cell::panel::{Joint, Side, Surface};
    use crate::cell::path::SeamPath;
    use nalgebra::{Translation3, UnitQuaternion};
    use rand_pcg::Pcg64;

    #[test]
    fn a_flat_lap_joint_shows_two_straight_lines_five_pixels_apart() {
        let mut rng = Pcg64::new(1, 1);
        let joint = Joint::crank(Side::Left);
        let panel = Panel::new(
            SeamPath::straight(),
            joint,
            Surface::Clean,
            0.0,
            Isometry3::identity(),
            &mut rng,
        );
        let pose = Isometry3::translation(0.1, 0.0, 0.0);
        let section = Section::of(&panel, &Optics::TRACKING, 0, &pose);
        // Left is up in the image: the upper sheet's line, nearer to the camera, lies at smaller x.
        let [none, upper] = section.columns(60.0);
        let [lower, none_either] = section.columns(190.0);
        assert!(none.is_none() && none_either.is_none());
        let step = lower.unwrap() - upper.unwrap();
        assert!((step - 5.02).abs() < 0.4, "{step} px");
    }

    #[test]
    fn the_line_changes_sheets_at_the_true_seams_row() {
        for seed in 0..40 {
            let joint = Joint::crank(if seed % 2 == 0 { Side::Left } else { Side::Right });
            let panel = harsh_arc(joint, seed);
            let seam = panel.seam(0.3);
            let tilt = UnitQuaternion::from_euler_angles(0.03, -0.04, 0.25);
            let pose = Isometry3::from_parts(Translation3::from(seam.p), level(&seam) * tilt);
            let section = Section::of(&panel, &Optics::TRACKING, 0, &pose);
            let (x, y) = Optics::TRACKING.true_sighting(0, &panel, &pose, 0.3).pixel;
            let on = |offset: f64| section.columns(y + offset);
            let base_side = if matches!(joint, Joint::Crank { upper: Side::Left, .. }) {
                1.0
            } else {
                -1.0
            };
            // A shadow or an overlap of up to 0.25 mm may stand between.
            let base = on(2.5 * base_side)[0].expect("the lower sheet is lit beside the seam");
            assert!((base - x).abs() < 1.0, "{base} px for {x} px with seed {seed}");
            assert!(on(-2.5 * base_side)[1].is_some() && on(-2.5 * base_side)[0].is_none());
        }
    }
}
