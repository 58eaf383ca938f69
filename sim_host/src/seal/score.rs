//! How good it was: read from the plant's truth, in every cycle in which the dispenser is on. The controller never sees any of this.

use crate::campaign::tally::{Bar, Run, Tally};
use crate::target::vision::{CameraFigures, VisionFigures};
use serde::Serialize;

/// A trial's bars (issue: sealing line).
#[derive(Clone, Copy, Debug)]
pub struct Bars {
    /// Largest lateral error, mm.
    pub lateral_max: f64,
    /// 99.9th percentile of the lateral error over the campaign, mm.
    pub lateral_p999: Option<f64>,
    /// Root mean square of the lateral error over the campaign, mm.
    pub lateral_rms: Option<f64>,
    /// Largest height error, mm.
    pub height_max: Option<f64>,
}

impl Bars {
    /// The bars at `speed`, m/s: up to 0.3 m/s the line's, above it only the maximum, 0.8 mm.
    pub fn at(speed: f64) -> Self {
        if speed <= 0.3 {
            Self {
                lateral_max: 0.6,
                lateral_p999: Some(0.4),
                lateral_rms: Some(0.15),
                height_max: Some(0.6),
            }
        } else {
            Self {
                lateral_max: 0.8,
                lateral_p999: None,
                lateral_rms: None,
                height_max: None,
            }
        }
    }
}

/// What one trial showed.
#[derive(Clone, Debug, Default)]
pub struct TrialScore {
    /// How it ran.
    pub run: Run,
    /// Lateral error per cycle with the bead on, mm, signed: positive to the left of travel.
    pub lateral: Vec<f32>,
    /// Largest height error with the bead on, mm.
    pub height_max: f64,
    /// The start pose as measured and accepted against the true seam's start, mm and degrees; `None` if none was measured, or it was refused.
    pub start_pose: Option<(f64, f64)>,
    /// The start pose was refused.
    pub start_refused: bool,
    /// Sightings of the seam that the controller heard: of each exposure one by each slit, those of lost images included.
    pub seam_frames: u32,
    /// Of these, refused: by the sensor, or by the controller, for one too to which no second agreed.
    pub seam_refused: u32,
    /// Corrections more than 0.5 mm off the true seam, each counted when the controller makes it of the sightings that agree, were they sure or
    /// doubtful, or guesses it beyond them. A wrong sighting that is outvoted is not in it.
    pub seam_wrong: u32,
    /// Peak joint acceleration with the bead on, rad/s²: mean over a cycle, of the plant's joints.
    pub joint_accel: f64,
    /// Time from one end of the seam to the other beyond its length over the speed, s: for bends, and for looking round corners.
    pub time_lost: f64,
    /// Furthest that the second arm's tip was from where its reference had it, mm; `None` if there is none.
    pub second_max: Option<f64>,
    /// What the camera's board measured of itself, if the camera was on one.
    pub camera: Option<CameraFigures>,
}

impl TrialScore {
    /// Why the trial did not keep the bars at `speed` (m/s); `None` if it did.
    pub fn verdict(&self, speed: f64) -> Option<String> {
        let bars = Bars::at(speed);
        let bar = |name, value, most| Bar {
            name,
            value,
            unit: "mm",
            most,
        };
        let lateral = percentile(self.lateral.iter().copied(), 1.0);
        let bars = [
            bar("lateral error", lateral, Some(bars.lateral_max)),
            bar("height error", self.height_max, bars.height_max),
        ];
        let wrong = self.seam_wrong;
        self.run
            .verdict(&bars)
            .or_else(|| (wrong > 0).then(|| format!("{wrong} wrong corrections made")))
    }
}

/// What a campaign of trials showed: the JSON of `seal`.
#[derive(Clone, Debug, Serialize)]
pub struct SealScore {
    /// What every job adds up.
    #[serde(flatten)]
    pub tally: Tally,
    /// Path name.
    pub path: String,
    /// Joint shape.
    pub joint: String,
    /// Surface.
    pub surface: String,
    /// Hold.
    pub hold: String,
    /// Over all cycles of all trials.
    pub lateral_rms_mm: f64,
    /// Over all cycles of all trials.
    pub lateral_p999_mm: f64,
    /// Over all cycles of all trials.
    pub lateral_max_mm: f64,
    /// Over all cycles of all trials.
    pub height_max_mm: f64,
    /// Largest distance of a start that was measured and accepted from the true seam's; zero if there is none. Refused ones are counted apart.
    pub start_pose_max_mm: f64,
    /// Largest angle, of the same starts, between the measured frame and the true seam's over the stretch that was seen.
    pub start_pose_max_deg: f64,
    /// Trials whose start pose was refused, with a reason.
    pub start_refused: usize,
    /// Sum of [`TrialScore::seam_frames`].
    pub seam_frames: u64,
    /// Sum of [`TrialScore::seam_refused`].
    pub seam_refused: u64,
    /// Sum of [`TrialScore::seam_wrong`]: corrections, not sightings. Unflagged, for the controller goes by each; how sure the sightings behind it were
    /// does not enter.
    pub seam_wrong_unflagged: u64,
    /// Largest.
    pub joint_accel_max_rad_per_s2: f64,
    /// Largest time that a trial lost to bends and to looking round corners.
    pub time_lost_max_s: f64,
    /// Furthest that the second arm's tip was from where its reference had it, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_arm_max_mm: Option<f64>,
    /// Most that the bus may be busy in a cycle, percent; with injected errors, which are not counted against it, as much as there is.
    #[serde(skip)]
    pub bus_load_bar: Option<f64>,
    /// Most instructions that vision may take for one image of the seam.
    #[serde(skip)]
    pub vision_bar: u64,
    /// What the camera's board measured of itself, if the camera was on one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<VisionFigures>,
}

/// Magnitude below which a share `share` of the values lies, by nearest rank; zero for none.
pub fn percentile(values: impl Iterator<Item = f32>, share: f64) -> f64 {
    let mut magnitudes: Vec<f32> = values.map(f32::abs).collect();
    if magnitudes.is_empty() {
        return 0.0;
    }
    let rank = ((share * magnitudes.len() as f64).ceil() as usize).clamp(1, magnitudes.len()) - 1;
    let (_, value, _) = magnitudes.select_nth_unstable_by(rank, f32::total_cmp);
    f64::from(*value)
}

/// Root mean square; zero for none.
pub fn rms(values: impl Iterator<Item = f32>) -> f64 {
    let (mut sum, mut count) = (0.0, 0u64);
    for value in values {
        sum += f64::from(value) * f64::from(value);
        count += 1;
    }
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}

impl SealScore {
    /// The campaign kept its bars: every trial did, and the figures over all of them do.
    pub fn passed(&self) -> bool {
        self.tally.all_succeeded() && self.shortfalls().is_empty()
    }

    /// Bars over all trials that were not kept, each in a line.
    pub fn shortfalls(&self) -> Vec<String> {
        let bars = Bars::at(self.tally.speed_m_per_s);
        [
            ("lateral error, rms", self.lateral_rms_mm, "mm", bars.lateral_rms),
            ("lateral error, 99.9 %", self.lateral_p999_mm, "mm", bars.lateral_p999),
            ("bus load", self.tally.bus_load_max_percent, "%", self.bus_load_bar),
        ]
        .into_iter()
        .filter_map(|(name, value, unit, most)| {
            Bar {
                name,
                value,
                unit,
                most,
            }
            .shortfall()
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_percentile_is_the_nearest_rank_of_the_magnitudes() {
        let values = || (1..=1000).map(|i| if i % 2 == 0 { i as f32 } else { -(i as f32) });
        assert_eq!(percentile(values(), 0.999), 999.0);
        assert_eq!(percentile(values(), 1.0), 1000.0);
        assert_eq!(percentile(std::iter::empty(), 0.999), 0.0);
    }

    #[test]
    fn the_rms_of_a_square_wave_is_its_amplitude() {
        assert!((rms([0.3f32, -0.3, 0.3, -0.3].into_iter()) - 0.3).abs() < 1e-7);
    }
}
