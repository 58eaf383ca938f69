//! Seeded scenes on which seam sensors are measured: a deformed part and a sensor somewhere over its seam.

use super::optics::{Optics, TrueSighting};
use super::{Camera, Motion};
use crate::cell::panel::{Joint, Panel, Surface};
use crate::cell::path::SeamPath;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

/// Stream of random numbers that belongs to scenes.
const STREAM: u128 = 0x73_6365_6e65;

/// The sensor's displacement from the seam, to either side: lateral and height (m), each angle (rad). On the arm these
/// come from the part's misplacement of ±10 mm and ±3°, most of which the start correction has removed.
const OFFSET_M: f64 = 0.004;
const TILT_RAD: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// Further yaw, to either side, rad: what is left of the sensor's lead on a curve of R150 (80 mm: asin(40/150) = 15.5°).
const CURVE_YAW_RAD: f64 = 16.0 * std::f64::consts::PI / 180.0;
/// Speed of the seal, m/s.
const SPEED: f64 = 0.3;
/// A seam counts as in view if it appears this far inside the image, px: half the 3.4 mm that a joint's shape takes.
const VIEW_MARGIN_PX: f64 = 15.0;

/// A part, a sensor over it, and what it should find.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The part.
    pub panel: Panel,
    /// Pose of the sensor at mid-exposure.
    pub t_b_s: Isometry3<f64>,
    /// Its motion.
    pub motion: Motion,
    /// The truth: what the first slit should find.
    pub truth: TrueSighting,
    /// What the second should, of a sensor with two.
    pub ahead: Option<TrueSighting>,
}

impl Scene {
    /// Scene number `index` of `seed` under the sensor with one slit.
    pub fn draw(surface: Surface, joint: Joint, seed: u64, index: u64) -> Self {
        Self::draw_under(&Optics::TRACKING, surface, joint, seed, index)
    }

    /// Scene number `index` of `seed` under a sensor of `optics`, with the seam in view of each slit.
    pub fn draw_under(optics: &Optics, surface: Surface, joint: Joint, seed: u64, index: u64) -> Self {
        let mut rng = Pcg64::new(u128::from(seed), (STREAM << 64) | u128::from(index));
        let paths = [SeamPath::straight, SeamPath::arc, SeamPath::panel];
        let path = paths[rng.random_range(0..paths.len())]();
        let length = path.length();
        let panel = Panel::new(path, joint, surface, 0.002, Isometry3::identity(), &mut rng);
        loop {
            let s = rng.random_range(0.0..length);
            let seam = panel.seam(s);
            let mut within = |reach: f64| rng.random_range(-reach..reach);
            let offset = Vector3::new(0.0, within(OFFSET_M), within(OFFSET_M));
            let (roll, pitch) = (within(TILT_RAD), within(TILT_RAD));
            let yaw = within(TILT_RAD) + within(CURVE_YAW_RAD);
            let axes = Matrix3::from_columns(&[seam.t, seam.b, seam.n]);
            let rotation = UnitQuaternion::from_matrix(&axes) * UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let t_b_s = Isometry3::from_parts(Translation3::from(seam.p + axes * offset), rotation);
            let truth = |slit: usize| optics.true_sighting(slit, &panel, &t_b_s, s);
            let inside = |at: f64, size: usize| at > VIEW_MARGIN_PX && at < size as f64 - 1.0 - VIEW_MARGIN_PX;
            let in_view = |truth: &TrueSighting| {
                let (x, y) = truth.pixel;
                inside(x, optics.width) && inside(y, optics.height)
            };
            let first = truth(0);
            let ahead = (optics.slits_m.len() > 1).then(|| truth(1));
            if in_view(&first) && ahead.as_ref().is_none_or(in_view) {
                let motion = Motion {
                    linear: t_b_s * Vector3::new(SPEED, 0.0, 0.0),
                    angular: Vector3::zeros(),
                };
                return Self {
                    panel,
                    t_b_s,
                    motion,
                    truth: first,
                    ahead,
                };
            }
        }
    }

    /// Its image, as frame `index` of `camera`.
    pub fn image(&self, camera: &Camera, index: u64) -> Vec<u8> {
        camera.expose(index, Some(&self.panel), &self.t_b_s, &self.motion)
    }

    /// Errors of a found seam point (Σ_S, m): across the seam in the sheet's plane, and along its normal.
    pub fn errors(&self, found: &Vector3<f64>) -> (f64, f64) {
        self.errors_from(&self.truth, found)
    }

    /// The same of a point that should be `truth`.
    pub fn errors_from(&self, truth: &TrueSighting, found: &Vector3<f64>) -> (f64, f64) {
        let seam = self.panel.seam(truth.s);
        let error = self.t_b_s * (found - truth.point);
        (error.dot(&seam.b), error.dot(&seam.n))
    }

    /// Tangent of the angle at which the seam runs to the sensor's x axis, positive to the left: what a controller knows from
    /// the taught path and its own pose.
    pub fn turn(&self) -> f64 {
        let along = self.t_b_s.inverse_transform_vector(&self.panel.seam(self.truth.s).t);
        along.y / along.x
    }
}
