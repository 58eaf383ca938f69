//! What every job's trials show, one by one and added up.

use super::{Campaign, Trials};
use crate::seal::cell::Cell;
use crate::target::figures::TargetFigures;
use crate::target::node::Node;
use firmware::fault::Fault;
use firmware::job::phase::Phase;
use firmware::job::seal::PERIOD;
use hal::board::report::Instruments;
use hal::wire::{Fnv64, Sink};
use serde::Serialize;

/// Busiest cycle of the bus that a campaign without injected errors may have, percent.
pub const BUS_LOAD_MAX: f64 = 45.0;
/// The same with a second arm on it, percent: as much as is to be planned (worst-case stuffing gives 65.7 % for 11 drives, without camera
/// and I/O node).
pub const BUS_LOAD_MAX_OF_TWO: f64 = 70.0;

/// How one trial ran, whatever its job.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Its seed.
    pub seed: u64,
    /// Why it failed; `None` is success.
    pub failure: Option<String>,
    /// Cycles run.
    pub cycles: u64,
    /// Cycles in which a frame of the cyclic exchange came after its deadline.
    pub deadline_misses: u64,
    /// Busiest cycle of the bus, percent.
    pub bus_load: f64,
    /// Least height of the nozzle tip over a sheet beside the seam, mm; `None` if it was never over one.
    pub clearance: Option<f64>,
    /// Simulated seconds.
    pub simulated: f64,
    /// Hash of all inputs and outputs.
    pub hash: u64,
    /// What the board measured of itself, if the controller ran on one.
    pub instruments: Option<Box<Instruments>>,
}

impl Run {
    /// The trial of `seed` after so many `cycles`, with this `hash`.
    pub fn of(seed: u64, cell: &Cell, controller: &Node, cycles: u64, hash: u64) -> Self {
        Self {
            seed,
            failure: failure(cell, controller),
            cycles,
            deadline_misses: cell.late(),
            bus_load: 100.0 * cell.bus.load().max(),
            clearance: cell.clearance().map(|m| m * 1e3),
            simulated: cell.now(),
            hash,
            instruments: None,
        }
    }

    /// Why the trial failed: the nozzle met the part; and as it says itself, by the first of `bars` that was not kept, or by its timing.
    pub fn verdict(&self, bars: &[Bar]) -> Option<String> {
        let misses = self.deadline_misses;
        let inside = self.clearance.filter(|mm| *mm < 0.0);
        let met = inside.map(|mm| format!("the nozzle was {:.1} mm inside the sheet beside the seam", -mm));
        let other = self
            .failure
            .clone()
            .or_else(|| bars.iter().find_map(Bar::shortfall))
            .or_else(|| (misses > 0).then(|| format!("{misses} deadlines missed")));
        // That it met the part is said whatever else went wrong.
        match (met, other) {
            (Some(met), Some(other)) => Some(format!("{met}; {other}")),
            (met, other) => met.or(other),
        }
    }
}

/// Why the job did not come to its end, if it did not.
fn failure(cell: &Cell, controller: &Node) -> Option<String> {
    let state = controller.state();
    let trip = state.trip();
    if trip.fault != Fault::None {
        let seconds = f64::from(trip.cycle) * f64::from(PERIOD);
        Some(format!(
            "fault {} at {seconds:.3} s, place {}: {}",
            trip.fault as u8,
            trip.place,
            trip.fault.line()
        ))
    } else if state.phase() != Phase::Done {
        Some(format!("not done in time: phase {:?}", state.phase()))
    } else if !cell.powered_down() {
        Some("drives still powered at the end".into())
    } else {
        None
    }
}

/// A figure and the most that it may be; `None` where it may be anything.
#[derive(Clone, Copy, Debug)]
pub struct Bar {
    /// What it is.
    pub name: &'static str,
    /// How much.
    pub value: f64,
    /// In which unit.
    pub unit: &'static str,
    /// The most that it may be.
    pub most: Option<f64>,
}

impl Bar {
    /// By how much it is over, in words.
    pub fn shortfall(&self) -> Option<String> {
        let Self {
            name,
            value,
            unit,
            most,
        } = self;
        let most = most.filter(|most| value > most)?;
        Some(format!("{name} {value:.3} {unit}, allowed {most} {unit}"))
    }
}

/// One failed trial.
#[derive(Clone, Debug, Serialize)]
pub struct Failure {
    /// Seed that repeats it.
    pub seed: u64,
    /// Why.
    pub reason: String,
}

/// What a campaign of trials came to, whatever its job: the part of the JSON that all have.
#[derive(Clone, Debug, Serialize)]
pub struct Tally {
    /// The verb.
    pub job: &'static str,
    /// First seed; trial i has seed + i.
    pub seed: u64,
    /// Trials run.
    pub trials: usize,
    /// Trials that kept every bar.
    pub succeeded: usize,
    /// The others.
    pub failures: Vec<Failure>,
    /// Speed along the seam.
    pub speed_m_per_s: f64,
    /// Sum.
    pub cycles: u64,
    /// Sum.
    pub deadline_misses: u64,
    /// Largest.
    pub bus_load_max_percent: f64,
    /// Least height of the nozzle tip over a sheet more than 3 mm beside the seam, if it was ever over one; below zero it hit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_min_mm: Option<f64>,
    /// Simulated over elapsed time of one core.
    pub sim_speed_x: f64,
    /// What the board measured of itself, over all trials; absent where the controller ran in process.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<TargetFigures>,
    /// Hash of the run's log; of several trials FNV-1a over their hashes in the order of their seeds.
    pub log_hash: String,
}

impl Tally {
    /// Adds up `trials` of `job` at `speed` (m/s); `run` is what a trial has in common with all others, `verdict` why it did not keep its bars.
    pub fn of<Options, Trial>(
        job: &'static str,
        campaign: &Campaign<Options>,
        speed: f64,
        trials: &Trials<Trial>,
        run: impl Fn(&Trial) -> &Run,
        verdict: impl Fn(&Trial) -> Option<String>,
    ) -> Self {
        let runs = || trials.each.iter().map(&run);
        let failure = |trial| {
            let reason = verdict(trial)?;
            Some(Failure {
                seed: run(trial).seed,
                reason,
            })
        };
        let failures: Vec<Failure> = trials.each.iter().filter_map(failure).collect();
        let hash = match trials.each.as_slice() {
            [alone] => run(alone).hash,
            _ => {
                let mut hash = Fnv64::default();
                runs().for_each(|run| hash.put(&run.hash.to_le_bytes()));
                hash.0
            }
        };
        let instruments = runs()
            .filter_map(|run| run.instruments.as_deref())
            .fold(None, |sum, one| {
                let mut sum: Instruments = sum.unwrap_or_default();
                sum.merge(one);
                Some(sum)
            });
        let simulated: f64 = runs().map(|run| run.simulated).sum();
        Self {
            job,
            seed: campaign.seed,
            trials: trials.each.len(),
            succeeded: trials.each.len() - failures.len(),
            failures,
            speed_m_per_s: speed,
            cycles: runs().map(|run| run.cycles).sum(),
            deadline_misses: runs().map(|run| run.deadline_misses).sum(),
            bus_load_max_percent: runs().map(|run| run.bus_load).fold(0.0, f64::max),
            clearance_min_mm: runs().filter_map(|run| run.clearance).reduce(f64::min),
            sim_speed_x: if trials.elapsed > 0.0 {
                simulated / trials.elapsed
            } else {
                0.0
            },
            target: instruments.as_ref().map(TargetFigures::new),
            log_hash: format!("{hash:016x}"),
        }
    }

    /// Every trial kept its bars.
    pub fn all_succeeded(&self) -> bool {
        self.succeeded == self.trials
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_campaign_adds_up_its_trials_and_names_those_that_failed() {
        let campaign = Campaign {
            options: (),
            seed: 7,
            trials: 3,
        };
        let trials = Trials {
            each: (7..10)
                .map(|seed| Run {
                    seed,
                    cycles: 100,
                    simulated: 0.5,
                    hash: seed,
                    deadline_misses: u64::from(seed == 8),
                    clearance: Some(seed as f64 - 7.5).filter(|_| seed < 9),
                    ..Run::default()
                })
                .collect(),
            elapsed: 0.1,
        };
        let error = |run: &Run| Bar {
            name: "error",
            value: run.seed as f64,
            unit: "mm",
            most: Some(8.5),
        };
        let tally = Tally::of(
            "seal",
            &campaign,
            0.3,
            &trials,
            |run| run,
            |run| run.verdict(&[error(run)]),
        );
        let reasons: Vec<_> = tally.failures.iter().map(|f| (f.seed, f.reason.as_str())).collect();
        assert_eq!(
            reasons,
            [
                (7, "the nozzle was 0.5 mm inside the sheet beside the seam"),
                (8, "1 deadlines missed"),
                (9, "error 9.000 mm, allowed 8.5 mm")
            ]
        );
        assert_eq!(tally.clearance_min_mm, Some(-0.5));
        assert_eq!((tally.succeeded, tally.cycles, tally.deadline_misses), (0, 300, 1));
        assert!((tally.sim_speed_x - 15.0).abs() < 1e-9, "{}", tally.sim_speed_x);
        let alone = Trials {
            each: trials.each[..1].to_vec(),
            elapsed: 0.1,
        };
        let one = Tally::of("seal", &campaign, 0.3, &alone, |run| run, |_| None);
        assert_eq!(one.log_hash, "0000000000000007");
        assert_ne!(tally.log_hash, one.log_hash);
    }
}
