//! Watches one trial from outside and keeps its score.

use super::cell::Cell;
use super::score::TrialScore;
use super::setup::{Setup, isometry};
use crate::camera::start::scene::true_start;
use crate::campaign::tally::Run;
use crate::model::AXES;
use crate::target::node::Node;
use firmware::cycle::Params;
use firmware::fault::Fault;
use firmware::geometry::Pose;
use firmware::job::correction::Use;
use firmware::job::phase::Phase;
use firmware::job::seal::PERIOD;
use hal::process::{Inputs, Look, Outputs};

/// A correction further off the true seam than this is wrong, m.
const WRONG: f64 = 0.5e-3;
/// The bead must reach to within this of both ends of the seam, and have no longer gap, m: two cycles at 0.4 m/s.
const BEAD_ENDS: f64 = 4e-3;

/// The watcher.
pub struct Watch {
    score: TrialScore,
    ends: [f64; 2],
    velocity: [f64; AXES],
    params: Params,
    /// Station of the newest correction, m.
    corrected: f32,
    /// A sighting waits for confirmation.
    waiting: bool,
    deviation: (f64, f64, f64),
    /// First and last place of the bead along the true seam, m.
    bead: (f64, f64),
    /// Length of the path as the controller has it, m.
    length: f64,
    /// Speed along the seam without any loss, m/s.
    speed: f64,
    /// Time on the seam so far, stops included, s.
    on_seam: f64,
    /// Longest stretch of the seam without bead between two places with it, m.
    gap: f64,
}

impl Watch {
    /// At power-up.
    pub fn new(setup: &Setup) -> Self {
        Self {
            score: TrialScore::default(),
            ends: setup.ends,
            velocity: [0.0; AXES],
            params: setup.params.clone(),
            corrected: f32::MIN,
            waiting: false,
            deviation: (0.0, 0.0, 0.0),
            bead: (f64::MAX, f64::MIN),
            length: f64::from(setup.params.seal.path.length()),
            speed: f64::from(setup.params.seal.speed),
            on_seam: 0.0,
            gap: 0.0,
        }
    }

    /// One cycle of the controller, seen in the middle of it.
    pub fn cycle(&mut self, cell: &Cell, controller: &Node, inputs: &Inputs<AXES>, outputs: &Outputs<AXES>) {
        let score = &mut self.score;
        let velocity = cell.plant.joint_velocities();
        let phase = controller.state().phase();
        let station = f64::from(outputs.station_um) * 1e-6;
        if phase == Phase::Turn || phase == Phase::Follow && (0.0..self.length).contains(&station) {
            self.on_seam += f64::from(PERIOD);
        }
        if phase == Phase::Follow || cell.flow() > 0 {
            self.deviation = cell.deviation();
        }
        let (s, lateral, height) = self.deviation;
        if cell.flow() > 0 {
            score.lateral.push((lateral * 1e3) as f32);
            score.height_max = score.height_max.max((height * 1e3).abs());
            for (now, before) in velocity.iter().zip(self.velocity) {
                score.joint_accel = score.joint_accel.max((now - before).abs() / f64::from(PERIOD));
            }
            let (first, last) = self.bead;
            if last > f64::MIN {
                self.gap = self.gap.max(s - last);
            }
            self.bead = (first.min(s), last.max(s));
        }
        self.velocity = velocity;
        if inputs.sighting.is_some_and(|sighting| sighting.look == Look::Seam) {
            score.seam_frames += 1;
            let fate = |fate: Use| outputs.sighting == fate as u8;
            if fate(Use::Used) {
                self.waiting = false;
            } else if fate(Use::Waiting) {
                // One that waited before, and found no second that agrees, was refused.
                score.seam_refused += u32::from(std::mem::replace(&mut self.waiting, true));
            } else {
                score.seam_refused += 1;
            }
        }
        if let Some((station, nozzle)) = controller.state().seam_ahead(&self.params)
            && station != self.corrected
        {
            self.corrected = station;
            let point = isometry(&nozzle).translation.vector;
            let nearest = cell.panel.seam(cell.panel.nearest(&point, f64::from(station)));
            score.seam_wrong += u32::from((point - nearest.p).norm() > WRONG);
        }
    }

    /// Tip against true seam: nominal arc length, lateral, height, m.
    pub fn deviation(&self) -> (f64, f64, f64) {
        self.deviation
    }

    /// The measured start frame against the true one, mm and degrees.
    fn start_error(&self, cell: &Cell, measured: &Pose) -> (f64, f64) {
        let measured = isometry(measured);
        let true_start = true_start(&cell.panel);
        let off = measured.translation.vector - true_start.translation.vector;
        let turned = measured.rotation.angle_to(&true_start.rotation);
        (off.norm() * 1e3, turned.to_degrees())
    }

    /// What is wrong with the bead, if it was not laid from end to end.
    fn bead_failure(&self) -> Option<String> {
        let ((first, last), [begin, end]) = (self.bead, self.ends);
        if first > begin + BEAD_ENDS || last < end - BEAD_ENDS {
            let [first, last, begin, end] = [first, last, begin, end].map(|m| m * 1e3);
            Some(format!(
                "bead from {first:.1} to {last:.1} mm of {begin:.1} to {end:.1} mm"
            ))
        } else if self.gap > BEAD_ENDS {
            Some(format!("a gap of {:.1} mm in the bead", self.gap * 1e3))
        } else {
            None
        }
    }

    /// The score at the end of a trial that ran like that.
    pub fn score(mut self, cell: &Cell, controller: &Node, mut run: Run) -> TrialScore {
        if run.failure.is_none() {
            run.failure = self.bead_failure();
        }
        self.score.run = run;
        self.score.time_lost = (self.on_seam - self.length / self.speed).max(0.0);
        let fault = controller.state().trip().fault;
        self.score.start_refused = matches!(fault, Fault::StartNotFound | Fault::StartDoubtful);
        let start = controller.state().start().filter(|_| !self.score.start_refused);
        self.score.start_pose = start.map(|start| self.start_error(cell, &start.pose));
        self.score
    }
}
