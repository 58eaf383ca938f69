//! Promise 2: a run's log, stepped again, gives the same outputs bit for bit; and what was altered is found.

use firmware::cycle::Params;
use firmware::job::phase::Phase;
use hal::stage::Stage;
use hal::wire::Wire;
use sim_host::log::{Log, ReplayReport, replay};
use sim_host::model::Model;
use sim_host::seal::campaign::{self, Campaign};
use sim_host::seal::scenario::{Options, PathName};
use sim_host::target::core::Core;
use sim_host::target::node::On;
use sim_host::teach;
use sim_host::teach::scenario::TeachOptions;
use std::fs;
use std::path::PathBuf;

/// A folder of this test's own, gone with it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("tesaki-{name}-{}", std::process::id())))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The log of one sealed straight seam, and the hash that the run reported.
fn logged(folder: &Folder) -> (Vec<u8>, String) {
    let options = Options {
        path: PathName::Straight,
        ..Options::told()
    };
    let campaign = Campaign {
        options,
        seed: 21,
        trials: 1,
    };
    let result = campaign::run(&campaign, &Model::k3s(), Some(&folder.0)).expect("the trial runs");
    (
        fs::read(folder.0.join("run.tlog")).expect("the log is there"),
        result.score.tally.log_hash,
    )
}

fn replayed(bytes: &[u8]) -> ReplayReport {
    let log = Log::from_bytes(bytes).expect("a whole log");
    let params = Params::read(&mut log.parameters.as_slice()).expect("parameters of this version");
    let mut core = Core::new(On::Host, params).expect("a core");
    replay(&log, |inputs| core.step(inputs, None)).expect("replayed")
}

#[test]
fn a_log_replays_to_the_hash_that_the_run_reported() {
    let (bytes, hash) = logged(&Folder::new("same"));
    let report = replayed(&bytes);
    assert_eq!(report.difference, None);
    assert_eq!(format!("{:016x}", report.replayed_hash), hash);
    assert!(report.cycles > 500, "{} cycles", report.cycles);
}

#[test]
fn a_log_of_teaching_replays_to_the_hash_that_the_run_reported() {
    let folder = Folder::new("taught");
    let campaign = teach::campaign::Campaign {
        options: TeachOptions {
            cell: Options {
                path: PathName::Straight,
                speed: 0.2,
                ..TeachOptions::default().cell
            },
            ..TeachOptions::default()
        },
        seed: 22,
        trials: 1,
    };
    let result = teach::campaign::run(&campaign, &Model::k3s(), Some(&folder.0)).expect("the trial runs");
    assert!(result.taught.is_some(), "{:?}", result.score);
    let report = replayed(&fs::read(folder.0.join("run.tlog")).expect("the log is there"));
    assert_eq!(report.difference, None);
    assert_eq!(format!("{:016x}", report.replayed_hash), result.score.tally.log_hash);
}

#[test]
fn one_flipped_bit_of_one_input_is_named_by_its_cycle() {
    let (mut bytes, _) = logged(&Folder::new("flipped"));
    let cycles = Log::from_bytes(&bytes).expect("a whole log").len();
    // A cycle is 300 bytes, the trailer 24: the first byte of the inputs of cycle 400.
    let at = bytes.len() - 24 - (cycles - 400) * 300;
    bytes[at] ^= 0x10;
    let difference = replayed(&bytes).difference.expect("found").to_string();
    assert!(difference.starts_with("cycle 400:"), "{difference}");
}

#[test]
fn other_parameters_than_the_runs_own_give_other_outputs() {
    // A replay that could not fail would prove nothing.
    let (bytes, _) = logged(&Folder::new("other"));
    let log = Log::from_bytes(&bytes).expect("a whole log");
    let mut params = Params::read(&mut log.parameters.as_slice()).expect("parameters of this version");
    params.servo.gains[3].proportional *= 1.001;
    let mut core = Core::new(On::Host, params).expect("a core");
    let report = replay(&log, |inputs| core.step(inputs, None)).expect("replayed");
    assert!(report.difference.is_some(), "a thousandth of one gain");
}

#[test]
fn the_last_bit_of_any_stage_of_a_cycle_along_the_seam_is_found_and_the_stage_named() {
    let (bytes, _) = logged(&Folder::new("stages"));
    let log = Log::from_bytes(&bytes).expect("a whole log");
    let params = Params::read(&mut log.parameters.as_slice()).expect("parameters of this version");
    // The middle one of the cycles along the seam, in which every stage runs.
    let phases = log.cycles().map(|cycle| cycle.expect("undamaged").1.outputs.phase);
    let follows: Vec<usize> = (0..)
        .zip(phases)
        .filter_map(|(at, phase)| (phase == Phase::Follow as u8).then_some(at))
        .collect();
    let at = follows[follows.len() / 2];
    for stage in Stage::ALL {
        let mut core = Core::new(On::Host, params.clone()).expect("a core");
        let mut cycles = 0..;
        let flip = |cycle| (cycle == Some(at)).then_some(stage);
        let report = replay(&log, |inputs| core.step(inputs, flip(cycles.next()))).expect("replayed");
        let difference = report.difference.expect("found").to_string();
        let expected = format!("cycle {at}: first in stage {}", stage.name());
        assert!(difference.starts_with(&expected), "{difference}");
    }
}
