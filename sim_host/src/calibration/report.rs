//! What a calibration says about itself: figures, limits, pass or fail.

mod checks;

use nalgebra::Isometry3;
use serde::Serialize;

use super::given::Refused;
use super::procedure::{Calibration, Measurements};
use super::simulated::Truth;
use super::slit_plane::{FittedSlit, SlitPlane};
pub use checks::Check;

/// One view.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ViewReport {
    /// Image file, or number of the simulated view.
    pub view: String,
    /// Why it does not count; null if it does.
    pub refused: Option<String>,
    /// Root mean square distance of its corners from where the camera puts them, px.
    pub rms_px: Option<f64>,
    /// The same for the slit's line, px.
    pub slit_rms_px: Option<f64>,
    /// Distance between the board's centre as the arm and as the image place it, mm.
    pub hand_eye_mm: Option<f64>,
    /// Angle between the two boards, degrees.
    pub hand_eye_deg: Option<f64>,
}

/// The calibration as `calibrate --json` prints it. What was not asked for is null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// `calibrate`.
    pub job: &'static str,
    /// Of the simulated cell.
    pub seed: Option<u64>,
    /// Width of the images, px.
    pub image_width: usize,
    /// Height of the images, px.
    pub image_height: usize,
    /// Views in which the board was found.
    pub views_used: usize,
    /// Root mean square distance of a corner from where the camera puts it, px.
    pub rms_px: f64,
    /// Focal length along x, px.
    pub fx: f64,
    /// Focal length along y, px.
    pub fy: f64,
    /// Principal point, x, px.
    pub cx: f64,
    /// Principal point, y, px.
    pub cy: f64,
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Standard deviations of fx, fy, cx, cy (px), k1, k2, p1, p2, k3 from the board alone; 0 where held.
    pub deviations: [f64; 9],
    /// Angle between the slit's plane and the camera's axis, degrees.
    pub slit_angle_deg: Option<f64>,
    /// Where the slit's plane crosses the camera's axis, mm in front of it.
    pub slit_crossing_mm: Option<f64>,
    /// Unit normal of the slit's plane in Σ_C and its distance from the camera's centre, mm.
    pub slit_plane: Option<[f64; 4]>,
    /// Root mean square distance of the slit's line from that of the plane, px.
    pub slit_rms_px: Option<f64>,
    /// The same planes of a sensor's two slits, the nearer to the nozzle first.
    pub pair_planes: Option<[[f64; 4]; 2]>,
    /// Root mean square distance of their lines from those of the planes, px; the larger.
    pub pair_rms_px: Option<f64>,
    /// Pose of the camera in Σ_5: rows of [R p], p in m.
    pub hand_eye: Option<[f64; 12]>,
    /// Root mean square distance between the board's centre as arm and image place it, mm.
    pub hand_eye_residual_mm: Option<f64>,
    /// Root mean square angle between the board as arm and image place it, degrees.
    pub hand_eye_residual_deg: Option<f64>,
    /// Standard deviation of the camera's place on the arm, mm.
    pub hand_eye_deviation_mm: Option<f64>,
    /// Standard deviation of the camera's orientation on the arm, degrees.
    pub hand_eye_deviation_deg: Option<f64>,
    /// In simulation: distance of the camera's place on the arm from the truth, mm.
    pub hand_eye_error_mm: Option<f64>,
    /// In simulation: angle of the camera on the arm from the truth, degrees.
    pub hand_eye_error_deg: Option<f64>,
    /// Distance of a seam seen travelling −x from where it is seen travelling +x, root mean square, mm.
    pub directions_rms_mm: Option<f64>,
    /// The largest, mm.
    pub directions_max_mm: Option<f64>,
    /// The views, then the images that do not count.
    pub views: Vec<ViewReport>,
    /// Every figure that has a limit.
    pub checks: Vec<Check>,
    /// Whether all of them passed.
    pub passed: bool,
}

impl Report {
    /// The report of a calibration; `truth` where the cell is simulated, with its seed.
    pub fn new(
        measured: &Measurements,
        refused: &[Refused],
        found: &Calibration,
        truth: Option<(u64, &Truth)>,
    ) -> Self {
        let hand_eye = found.hand_eye.as_ref();
        let [slit, near, far] = found.slits.each_ref().map(Option::as_ref);
        let pair = near.zip(far);
        let error = truth
            .zip(hand_eye)
            .map(|((_, truth), hand_eye)| truth.t_5_c.inv_mul(&hand_eye.t_5_c));
        let mut report = Self {
            job: "calibrate",
            seed: truth.map(|(seed, _)| seed),
            image_width: measured.size.0,
            image_height: measured.size.1,
            views_used: measured.views.len(),
            rms_px: found.rms_px,
            fx: found.camera.fx,
            fy: found.camera.fy,
            cx: found.camera.cx,
            cy: found.camera.cy,
            distortion: found.camera.distortion,
            deviations: found.deviations,
            slit_angle_deg: slit.map(|slit| slit.plane.angle().to_degrees()),
            slit_crossing_mm: slit.map(|slit| slit.plane.crossing() * 1e3),
            slit_plane: slit.map(plane),
            slit_rms_px: slit.map(|slit| slit.rms_px),
            pair_planes: pair.map(|(near, far)| [near, far].map(plane)),
            pair_rms_px: pair.map(|(near, far)| near.rms_px.max(far.rms_px)),
            hand_eye: hand_eye.map(|hand_eye| rows(&hand_eye.t_5_c)),
            hand_eye_residual_mm: hand_eye.map(|hand_eye| hand_eye.residual.position_m * 1e3),
            hand_eye_residual_deg: hand_eye.map(|hand_eye| hand_eye.residual.turn_rad.to_degrees()),
            hand_eye_deviation_mm: hand_eye.map(|hand_eye| hand_eye.deviation.position_m * 1e3),
            hand_eye_deviation_deg: hand_eye.map(|hand_eye| hand_eye.deviation.turn_rad.to_degrees()),
            hand_eye_error_mm: error.map(|error| error.translation.vector.norm() * 1e3),
            hand_eye_error_deg: error.map(|error| error.rotation.angle().to_degrees()),
            directions_rms_mm: found.agreement.map(|agreement| agreement.offset_m * 1e3),
            directions_max_mm: found.agreement.map(|agreement| agreement.offset_max_m * 1e3),
            views: views(measured, refused, found),
            checks: Vec::new(),
            passed: false,
        };
        report.checks = checks::of(&report);
        report.passed = report.checks.iter().all(|check| check.passed);
        report
    }
}

fn views(measured: &Measurements, refused: &[Refused], found: &Calibration) -> Vec<ViewReport> {
    let mut slit_rms = found.slits[0].iter().flat_map(|slit| slit.view_rms_px.iter().copied());
    let used = measured.views.iter().enumerate().map(|(at, view)| {
        let station = found.hand_eye.as_ref().map(|hand_eye| hand_eye.stations[at]);
        ViewReport {
            view: view.name.clone(),
            refused: None,
            rms_px: Some(found.view_rms_px[at]),
            slit_rms_px: if view.slits[0].is_empty() {
                None
            } else {
                slit_rms.next()
            },
            hand_eye_mm: station.map(|station| station.position_m * 1e3),
            hand_eye_deg: station.map(|station| station.turn_rad.to_degrees()),
        }
    });
    let used: Vec<ViewReport> = used.collect();
    let refused = refused.iter().map(|refused| ViewReport {
        view: refused.name.clone(),
        refused: Some(refused.reason.clone()),
        rms_px: None,
        slit_rms_px: None,
        hand_eye_mm: None,
        hand_eye_deg: None,
    });
    used.into_iter().chain(refused).collect()
}

/// Unit normal, and distance in mm.
fn plane(slit: &FittedSlit) -> [f64; 4] {
    let SlitPlane { normal, distance_m } = slit.plane;
    [normal.x, normal.y, normal.z, distance_m * 1e3]
}

/// Rows of [R p].
fn rows(pose: &Isometry3<f64>) -> [f64; 12] {
    let matrix = pose.to_homogeneous();
    std::array::from_fn(|at| matrix[(at / 4, at % 4)])
}

#[cfg(test)]
mod tests {
    use super::super::camera::Distortion;
    use super::super::procedure::{self, Options};
    use super::super::simulated;
    use super::*;

    fn simulate(seed: u64, views: usize) -> Report {
        let (truth, measured) = simulated::cell(seed, views).expect("a cell");
        let options = Options {
            distortion: Distortion::Brown,
            camera: None,
            arm: simulated::ARM,
        };
        let found = procedure::calibrate(&measured, &options).expect("calibrated");
        Report::new(&measured, &[], &found, Some((seed, &truth)))
    }

    #[test]
    fn the_simulated_cell_is_calibrated_to_two_tenths_of_a_millimetre_and_a_tenth_of_a_degree() {
        for seed in 1..=10 {
            let report = simulate(seed, simulated::VIEWS);
            assert!(
                report.hand_eye_error_mm.is_some_and(|error| error <= 0.2),
                "seed {seed}: {:?} mm",
                report.hand_eye_error_mm
            );
            assert!(
                report.hand_eye_error_deg.is_some_and(|error| error <= 0.1),
                "seed {seed}: {:?}°",
                report.hand_eye_error_deg
            );
            assert!(
                report.hand_eye_residual_mm.is_some_and(|residual| residual <= 0.2),
                "seed {seed}"
            );
            assert!(
                report.hand_eye_residual_deg.is_some_and(|residual| residual <= 0.1),
                "seed {seed}"
            );
            assert!(
                report.directions_rms_mm.is_some_and(|offset| offset <= 0.1),
                "seed {seed}: {:?}",
                report.directions_rms_mm
            );
            assert!(report.passed, "seed {seed}: {:?}", report.checks);
        }
    }

    #[test]
    fn a_seed_gives_the_same_report_twice_and_another_seed_another() {
        assert_eq!(simulate(5, 12), simulate(5, 12));
        assert_ne!(simulate(5, 12).fx, simulate(6, 12).fx);
    }

    #[test]
    fn stated_deviations_cover_the_true_errors() {
        // Over many seeds the mean square of error over deviation is 1; 20 seeds scatter it by a fifth or so.
        let ratios = (21..=40).map(|seed| {
            let report = simulate(seed, 24);
            let ratio =
                |error: Option<f64>, deviation: Option<f64>| error.unwrap_or(f64::NAN) / deviation.unwrap_or(f64::NAN);
            [
                ratio(report.hand_eye_error_mm, report.hand_eye_deviation_mm),
                ratio(report.hand_eye_error_deg, report.hand_eye_deviation_deg),
            ]
        });
        let squares: Vec<f64> = ratios.flatten().map(|ratio| ratio * ratio).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        assert!((0.5..=2.0).contains(&mean), "{mean}");
    }

    #[test]
    fn a_figure_over_its_limit_fails_the_calibration() {
        let (truth, mut measured) = simulated::cell(1, 12).expect("a cell");
        for (at, view) in measured.views.iter_mut().enumerate() {
            // An arm whose positions are off by a millimetre, to and fro.
            let off = if at % 2 == 0 { 0.001 } else { -0.001 };
            view.t_b_5 = view
                .t_b_5
                .map(|t_b_5| nalgebra::Translation3::new(off, 0.0, 0.0) * t_b_5);
        }
        let options = Options {
            distortion: Distortion::Brown,
            camera: None,
            arm: simulated::ARM,
        };
        let found = procedure::calibrate(&measured, &options).expect("calibrated");
        let report = Report::new(&measured, &[], &found, Some((1, &truth)));
        let failed: Vec<&str> = report
            .checks
            .iter()
            .filter(|check| !check.passed)
            .map(|check| check.name)
            .collect();
        assert!(
            !report.passed && failed.contains(&"arm against image, rms"),
            "{:?}",
            report.checks
        );
    }
}
