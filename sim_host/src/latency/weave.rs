//! The path of the measurement: to and fro across a straight seam, so that where the sensor is seen to be depends on when.

use crate::seal::scenario::PathName;
use crate::taught::{TaughtRow, TaughtSeam};
use anyhow::Result;
use nalgebra::{Point3, Vector3};
use std::f64::consts::{PI, TAU};

/// Furthest to either side, m: with a part's bend and a start pose's error well inside the sensor's view of ±15 mm.
const AMPLITUDE_M: f64 = 0.005;
/// Length of a swing, m: the sensor's lead, so that it swings with the nozzle and the tool need not turn. At 0.3 m/s it takes 0.27 s,
/// with 2.8 m/s² and 0.12 m/s across.
const SWING_M: f64 = 0.080;
/// Distance between rows, m: a fortieth of a swing.
const ROW_M: f64 = 0.002;

/// The straight seam of the drawing, swung about; it begins and ends on the seam and along it.
pub fn weave() -> Result<TaughtSeam> {
    let (drawing, placing) = (PathName::Straight.seam(), PathName::Straight.placing());
    let length = drawing.length();
    let count = (length / ROW_M).round() as usize;
    let mut rows: Vec<TaughtRow> = Vec::with_capacity(count + 1);
    for row in 0..=count {
        let x = length * row as f64 / count as f64;
        let frame = drawing.at(x);
        // The swing grows over the first half of one, and dies away over the last.
        let from_end = (x.min(length - x) / (0.5 * SWING_M)).min(1.0);
        let growth = (0.5 * PI * from_end).sin().powi(2);
        let aside = AMPLITUDE_M * growth * (TAU * x / SWING_M).sin();
        let point: Vector3<f64> = (placing * Point3::from(frame.p + frame.b * aside)).coords;
        let s = rows.last().map_or(0.0, |last| last.s + (point - last.point).norm());
        rows.push(TaughtRow {
            s,
            point,
            normal: placing * frame.n,
        });
    }
    let length = rows.last().map_or(0.0, |last| last.s);
    TaughtSeam::new(rows, length)
}
