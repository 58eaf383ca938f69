use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use anyhow::Result;
use hal::process::{AxisInput, AxisOutput, PowerRequest, Sighting};
use hal::stage::{Stage, Stopwatch};
use proptest::prelude::*;
use serde_json::json;

use super::*;
use crate::whole_file::tests::folder;

const CYCLES: u8 = 20;
/// Where in a cycle inputs and outputs end, each with its hash.
const INPUTS_END: usize = Inputs::<AXES>::BYTES + 8;
const OUTPUTS_END: usize = INPUTS_END + Outputs::<AXES>::BYTES + 8;
/// Stands for the core's parameters: the torque asked for per cycle.
const PARAMETERS: [u8; 3] = [3, 1, 4];

fn inputs(cycle: u8) -> Inputs<AXES> {
    let mut inputs = Inputs {
        sync: cycle + 1,
        bus_ready: true,
        ..Inputs::default()
    };
    inputs.axes = [AxisInput {
        position: 1000 * cycle as i32,
        statusword: 0x0237,
        age: 0,
        ..AxisInput::default()
    }; AXES];
    inputs.sighting = cycle.is_multiple_of(5).then_some(Sighting {
        stamp: cycle,
        point_um: [80_00, -120, 5],
        quality: 200,
        ..Sighting::default()
    });
    inputs
}

/// A core with state: it sums what it was given, in the stage that estimates.
fn core() -> impl FnMut(&Inputs<AXES>) -> Result<Answer> {
    let mut sum = 0;
    move |inputs| {
        let mut trail = Trail::default();
        sum += inputs.axes[2].position;
        trail.result(Stage::Estimate, &mut sum);
        let axis = AxisOutput {
            request: PowerRequest::Enable,
            velocity: sum,
            torque: inputs.sync as i16,
        };
        let mut outputs = Outputs {
            axes: [axis; AXES],
            exposure: inputs.sync,
            station_um: 10 * sum,
            ..Outputs::default()
        };
        trail.result(Stage::Encode, &mut outputs);
        Ok(Answer { outputs, trail })
    }
}

fn record(path: &Path) -> u64 {
    let mut step = core();
    let mut log = LogWriter::create(path, &PARAMETERS, &json!({"job": "seal", "seed": 1})).expect("created");
    for inputs in (0..CYCLES).map(inputs) {
        let Answer { outputs, trail } = step(&inputs).expect("an answer");
        log.cycle(&inputs, &outputs, &trail).expect("written");
    }
    log.finish().expect("finished")
}

/// The bytes of a recorded log, and where its cycles begin.
static RECORDED: LazyLock<(Vec<u8>, usize)> = LazyLock::new(|| {
    let folder = folder("log-recorded");
    let path = folder.join("run.tlog");
    record(&path);
    let bytes = fs::read(path).expect("readable");
    let header = bytes.len() - TRAILER_BYTES - CYCLES as usize * CYCLE_BYTES;
    (bytes, header)
});

fn error(bytes: &[u8]) -> String {
    format!("{:#}", Log::from_bytes(bytes).expect_err("damaged"))
}

#[test]
fn a_log_replays_to_its_own_hash() {
    let folder = folder("log-replays");
    let path = folder.join("run.tlog");
    let hash = record(&path);
    let log = Log::read(&path).expect("readable");
    assert_eq!(
        (log.len(), &log.parameters[..], &log.description["seed"]),
        (20, &PARAMETERS[..], &json!(1))
    );
    let report = replay(&log, core()).expect("replayed");
    assert_eq!(
        report,
        ReplayReport {
            cycles: 20,
            recorded_hash: hash,
            replayed_hash: hash,
            difference: None
        }
    );
}

#[test]
fn a_cycle_takes_300_bytes() {
    assert_eq!(CYCLE_BYTES, 300);
}

#[test]
fn what_was_recorded_is_read_back() {
    let log = Log::from_bytes(&RECORDED.0).expect("whole");
    let read: Vec<_> = log.cycles().map(|cycle| cycle.expect("undamaged").0).collect();
    assert_eq!(read, (0..CYCLES).map(inputs).collect::<Vec<_>>());
}

#[test]
fn the_hash_of_a_run_is_that_of_its_log_and_does_not_depend_on_the_description() {
    let mut hash = RunHash::new(&PARAMETERS);
    let mut step = core();
    for inputs in (0..CYCLES).map(inputs) {
        hash.take(&inputs);
        hash.take(&step(&inputs).expect("an answer").outputs);
    }
    assert_eq!(hash.value(), Log::from_bytes(&RECORDED.0).expect("whole").hash);
    assert_ne!(hash.value(), RunHash::new(&PARAMETERS).value());
}

#[test]
fn a_core_that_answers_otherwise_is_found_with_cycle_field_and_values() {
    let log = Log::from_bytes(&RECORDED.0).expect("whole");
    let mut step = core();
    let report = replay(&log, |inputs| {
        let mut answer = step(inputs)?;
        answer.outputs.axes[2].torque += (inputs.sync == 8) as i16;
        Ok(answer)
    })
    .expect("replayed");
    let difference = report.difference.expect("one torque differs");
    assert_eq!(
        difference.to_string(),
        "cycle 7: output axis 3 torque was 8 ‰ and is now 9 ‰"
    );
    assert_eq!(report.cycles, 7);
    assert_ne!(report.replayed_hash, report.recorded_hash);
}

#[test]
fn a_stage_that_comes_to_something_else_is_named_before_any_output_shows_it() {
    let log = Log::from_bytes(&RECORDED.0).expect("whole");
    let mut step = core();
    let report = replay(&log, |inputs| {
        let mut answer = step(inputs)?;
        if inputs.sync == 8 {
            answer.trail = Trail::default();
            answer.trail.result(Stage::Estimate, &mut 0);
            answer.trail.result(Stage::Encode, &mut answer.outputs);
        }
        Ok(answer)
    })
    .expect("replayed");
    let difference = report.difference.expect("one stage differs");
    assert_eq!(
        difference.to_string(),
        "cycle 7: first in stage estimate, no output yet"
    );
}

#[test]
fn a_core_with_other_parameters_differs_in_hash() {
    let mut log = Log::from_bytes(&RECORDED.0).expect("whole");
    log.parameters[0] ^= 1;
    assert_eq!(
        replay(&log, core()).expect("replayed").difference,
        Some(Difference::Damage(Damage::Inputs(0)))
    );
}

#[test]
fn an_unfinished_log_leaves_no_file() {
    let folder = folder("log-unfinished");
    let mut log = LogWriter::create(&folder.join("run.tlog"), &PARAMETERS, &json!(null)).expect("created");
    log.cycle(&inputs(0), &Outputs::default(), &Trail::default())
        .expect("written");
    drop(log);
    assert_eq!(fs::read_dir(&*folder).expect("folder").count(), 0);
}

#[test]
fn a_missing_log_is_named() {
    let error = Log::read(&folder("log-missing").join("run.tlog")).expect_err("there is none");
    let text = format!("{error:#}");
    assert!(
        text.starts_with("log ") && text.contains("run.tlog: cannot be read: "),
        "{text}"
    );
}

#[test]
fn another_file_or_another_version_is_refused() {
    assert_eq!(error(b""), "not a run log: it does not begin as a .tlog does");
    assert_eq!(
        error(b"(0000000000.005000) can0 080#01"),
        "not a run log: it does not begin as a .tlog does"
    );
    let mut bytes = RECORDED.0.clone();
    bytes[MAGIC.len()] = 9;
    assert_eq!(error(&bytes), "version 9: this program reads version 2");
}

#[test]
fn a_log_cut_anywhere_is_refused_with_the_cycle_it_ends_in() {
    let (bytes, header) = &*RECORDED;
    for length in 1..bytes.len() {
        let text = error(&bytes[..length]);
        let expected = match length.checked_sub(*header) {
            None => format!("truncated in its header, after {length} bytes"),
            Some(body) => format!("truncated in cycle {}: no end mark", body / CYCLE_BYTES),
        };
        assert_eq!(text, expected, "{length} bytes");
    }
}

#[test]
fn a_log_that_lost_a_cycle_from_its_middle_is_refused() {
    let (bytes, header) = &*RECORDED;
    let mut bytes = bytes.clone();
    bytes.drain(header + CYCLE_BYTES..header + 2 * CYCLE_BYTES);
    assert_eq!(
        error(&bytes),
        "its trailer counts 20 cycles of 300 bytes, not 5700 bytes"
    );
}

proptest! {
    #[test]
    fn any_flipped_bit_of_a_cycle_is_found_and_the_cycle_named(
        at in 0..CYCLES as usize * CYCLE_BYTES, bit in 0..8_u32,
    ) {
        let (bytes, header) = &*RECORDED;
        let mut bytes = bytes.clone();
        bytes[header + at] ^= 1 << bit;
        let report = replay(&Log::from_bytes(&bytes).expect("the structure is whole"), core())
            .expect("replayed");
        let cycle = (at / CYCLE_BYTES) as u64;
        let damage = match at % CYCLE_BYTES {
            0..INPUTS_END => Damage::Inputs(cycle),
            INPUTS_END..OUTPUTS_END => Damage::Outputs(cycle),
            _ => Damage::Trail(cycle),
        };
        prop_assert_eq!(report.difference, Some(Difference::Damage(damage)));
        prop_assert_eq!(report.cycles, cycle);
    }

    #[test]
    fn any_flipped_bit_outside_the_cycles_is_found(at in 0..1000_usize, bit in 0..8_u32) {
        let (bytes, header) = &*RECORDED;
        let mut bytes = bytes.clone();
        let outside = header + TRAILER_BYTES;
        let place = at % outside;
        let place = if place < *header { place } else { bytes.len() - outside + place };
        bytes[place] ^= 1 << bit;
        let found = match Log::from_bytes(&bytes) {
            Err(_) => true,
            Ok(log) => replay(&log, core()).expect("replayed").difference == Some(Difference::Damage(Damage::Trailer)),
        };
        prop_assert!(found);
    }
}
