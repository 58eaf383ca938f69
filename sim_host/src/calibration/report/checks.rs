//! What a calibration is held to.

use serde::Serialize;

use super::Report;

/// Limits that a calibration is held to.
///
/// RMS: twice what good corners on a good lens leave (OpenCV's photographs: 0.2 px). Focal length: 1 % of it is 1.5 mm of
/// height at 150 mm. Hand-eye, and both directions of travel: what seam tracking is held to.
const MAX_RMS_PX: f64 = 0.5;
const MAX_FOCAL_DEVIATION_PERCENT: f64 = 1.0;
const MAX_HAND_EYE_MM: f64 = 0.2;
const MAX_HAND_EYE_DEG: f64 = 0.1;
const MAX_SLIT_RMS_PX: f64 = 0.5;
const MAX_DIRECTIONS_MM: f64 = 0.2;

/// A figure with its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// What is checked.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// The largest that passes.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Whether it passed.
    pub passed: bool,
}

/// The figures of `report` that have a limit.
pub fn of(report: &Report) -> Vec<Check> {
    let worst_focal = (report.deviations[0] / report.fx).max(report.deviations[1] / report.fy);
    let estimated = worst_focal > 0.0;
    let figures = [
        ("corners, rms", Some(report.rms_px), MAX_RMS_PX, "px"),
        (
            "focal length, deviation",
            estimated.then_some(worst_focal * 100.0),
            MAX_FOCAL_DEVIATION_PERCENT,
            "%",
        ),
        ("slit's line, rms", report.slit_rms_px, MAX_SLIT_RMS_PX, "px"),
        ("two slits' lines, rms", report.pair_rms_px, MAX_SLIT_RMS_PX, "px"),
        (
            "arm against image, rms",
            report.hand_eye_residual_mm,
            MAX_HAND_EYE_MM,
            "mm",
        ),
        (
            "arm against image, rms",
            report.hand_eye_residual_deg,
            MAX_HAND_EYE_DEG,
            "°",
        ),
        (
            "camera on the arm, deviation",
            report.hand_eye_deviation_mm,
            MAX_HAND_EYE_MM,
            "mm",
        ),
        (
            "camera on the arm, deviation",
            report.hand_eye_deviation_deg,
            MAX_HAND_EYE_DEG,
            "°",
        ),
        (
            "camera on the arm, true error",
            report.hand_eye_error_mm,
            MAX_HAND_EYE_MM,
            "mm",
        ),
        (
            "camera on the arm, true error",
            report.hand_eye_error_deg,
            MAX_HAND_EYE_DEG,
            "°",
        ),
        (
            "travelling −x against +x, rms",
            report.directions_rms_mm,
            MAX_DIRECTIONS_MM,
            "mm",
        ),
    ];
    let check = |(name, value, limit, unit): (&'static str, Option<f64>, f64, &'static str)| {
        value.map(|value| Check {
            name,
            value,
            limit,
            unit,
            passed: value <= limit,
        })
    };
    figures.into_iter().filter_map(check).collect()
}
