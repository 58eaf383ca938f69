//! How good a taught seam is: held against the true part. Nothing that teaches ever sees any of this.

use crate::campaign::tally::{Bar, Run, Tally};
use crate::cell::panel::Panel;
use crate::seal::score::{percentile, rms};
use crate::taught::TaughtSeam;
use nalgebra::Vector3;
use serde::Serialize;

/// The taught seam must begin within this of the true start, m: the operator's error, and a bent start.
const START: f64 = 0.004;
/// And end within this of the true end, m: the way of two images at 0.2 m/s, which may be lost.
const END: f64 = 0.008;
/// Half the length and half the width over which the true orientation is taken, m: a nozzle's is that of both sheets over 30 mm of seam and
/// 14 mm across, what the sensor looks at, and not that of the dent under its tip.
const ORIENTATION_HALF: [f64; 2] = [0.015, 0.007];
/// Samples of that mean along and across: even, so that none lies on the seam itself.
const ORIENTATION_SAMPLES: u32 = 10;

/// A trial's bars (issue: teaching); orientation in degrees, the rest in mm.
#[derive(Clone, Copy, Debug)]
pub struct Bars {
    /// Root mean square of the distance from the true seam.
    pub rms: Option<f64>,
    /// Largest distance.
    pub max: f64,
    /// Largest angle between the taught normal and the true one.
    pub orientation: f64,
}

impl Bars {
    /// Up to 0.1 m/s the finer, up to 0.2 m/s and above 0.8 mm.
    pub fn at(speed: f64) -> Self {
        Self {
            rms: (speed <= 0.1).then_some(0.2),
            max: if speed <= 0.1 { 0.5 } else { 0.8 },
            orientation: 1.0,
        }
    }
}

/// What one trial showed.
#[derive(Clone, Debug, Default)]
pub struct TrialScore {
    /// How it ran.
    pub run: Run,
    /// The seam was lost before its end.
    pub lost: bool,
    /// Distance of each row of the taught seam from the true one, mm.
    pub off: Vec<f32>,
    /// Largest angle between a taught normal and the true one, degrees.
    pub orientation: f64,
    /// Points that came over the bus.
    pub points: usize,
    /// Points of these that were left out.
    pub outliers: usize,
    /// Largest distance of the seam from the middle of the image across it, mm.
    pub view: f64,
}

impl TrialScore {
    /// It failed, if it had not yet, for this reason.
    pub fn fail(&mut self, reason: String) {
        self.run.failure.get_or_insert(reason);
    }

    /// Holds `seam` against `panel`.
    pub fn hold_against(&mut self, seam: &TaughtSeam, panel: &Panel) {
        let mut s = 0.0;
        let places: Vec<f64> = seam
            .rows()
            .iter()
            .map(|row| {
                s = panel.nearest(&row.point, s);
                s
            })
            .collect();
        let ends = places
            .iter()
            .fold((f64::MAX, f64::MIN), |(low, high), s| (low.min(*s), high.max(*s)));
        for (row, s) in seam.rows().iter().zip(places) {
            self.off.push(((row.point - panel.seam(s).p).norm() * 1e3) as f32);
            let angle = row.normal.angle(&normal(panel, s, ends)).to_degrees();
            self.orientation = self.orientation.max(angle);
        }
        let length = panel.path().length();
        if ends.0.abs() > START || ends.1 < length - END {
            let ends = [ends.0, ends.1, length].map(|m| m * 1e3);
            self.fail(format!(
                "taught from {:.1} to {:.1} mm of 0 to {:.1} mm",
                ends[0], ends[1], ends[2]
            ));
        }
    }

    /// Why the trial did not keep the bars at `speed` (m/s); `None` if it did.
    pub fn verdict(&self, speed: f64) -> Option<String> {
        let bars = Bars::at(speed);
        let off = || self.off.iter().copied();
        let bar = |name, value, unit, most| Bar {
            name,
            value,
            unit,
            most,
        };
        self.run.verdict(&[
            bar("taught point off by", percentile(off(), 1.0), "mm", Some(bars.max)),
            bar("taught points off by, rms,", rms(off()), "mm", bars.rms),
            bar("orientation off by", self.orientation, "°", Some(bars.orientation)),
        ])
    }
}

/// The sheets' normal about the seam at `s`, Σ_B: from the mean of their gradients, each sheet's on its own side, over the seam around and
/// between the `ends` of what was taught.
fn normal(panel: &Panel, s: f64, ends: (f64, f64)) -> Vector3<f64> {
    const PROBE: f64 = 1e-4;
    const ELSEWHERE: f64 = 1e-3;
    let [length, width] = ORIENTATION_HALF;
    let seam = |s: f64| panel.t_b_w().inverse_transform_point(&panel.seam(s).p.into()).coords;
    let patch = panel.around(&seam(s), 2.0 * length);
    let share = |k: u32| f64::from(2 * k + 1) / f64::from(2 * ORIENTATION_SAMPLES);
    let (first, last) = ((s - length).max(ends.0), (s + length).min(ends.1));
    let mut sum = Vector3::zeros();
    for i in 0..ORIENTATION_SAMPLES {
        let there = first + (last - first) * share(i);
        let (nominal, point) = (panel.path().at(there), seam(there));
        for j in 0..ORIENTATION_SAMPLES / 2 {
            let away = width * (2.0 * share(ORIENTATION_SAMPLES / 2 + j) - 1.0);
            let look = |along: f64, left: f64| {
                let place = point + nominal.t * along + nominal.b * left;
                patch.clearance(&Vector3::new(place.x, place.y, 0.0))
            };
            // Beyond the middle of a bend it is another place's, and what is across from there does not count alone.
            let sides = [-away, away];
            if sides
                .iter()
                .any(|left| (look(0.0, *left).along - there).abs() > ELSEWHERE)
            {
                continue;
            }
            // The lower of a lap joint, or the right flank, on the right of the seam; the other on the left.
            for (sheet, left) in sides.into_iter().enumerate() {
                let height = |along: f64, aside: f64| -look(along, left + aside).above[sheet];
                let along = (height(PROBE, 0.0) - height(-PROBE, 0.0)) / (2.0 * PROBE);
                let aside = (height(0.0, PROBE) - height(0.0, -PROBE)) / (2.0 * PROBE);
                sum += nominal.n - nominal.t * along - nominal.b * aside;
            }
        }
    }
    panel.t_b_w() * sum.normalize()
}

/// What a campaign of trials showed: the JSON of `teach`.
#[derive(Clone, Debug, Serialize)]
pub struct TeachScore {
    /// What every job adds up.
    #[serde(flatten)]
    pub tally: Tally,
    /// Distance of the taught points from the true seam, rms over all trials.
    pub taught_rms_mm: f64,
    /// The same, greatest.
    pub taught_max_mm: f64,
    /// Greatest angle between a taught normal and the true one.
    pub orientation_max_deg: f64,
    /// Trials in which the seam was lost before its end.
    pub seam_lost: usize,
    /// Path, joint, surface and law by name.
    #[serde(skip)]
    pub names: [String; 4],
    /// Points that came over the bus.
    #[serde(skip)]
    pub points: usize,
    /// Points of these that were left out.
    #[serde(skip)]
    pub outliers: usize,
    /// Furthest that the seam came from the middle of the image, mm.
    #[serde(skip)]
    pub view_mm: f64,
}
