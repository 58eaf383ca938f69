//! Stepping a log's inputs through the core again, and comparing what comes out with what came out, bit for bit.

use std::fmt;

use anyhow::Result;
use hal::process::{AxisOutput, Inputs, Outputs};
use hal::stage::{Stage, Trail};

use super::{AXES, Damage, Log, RunHash};

/// What a core makes of the inputs of one cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Its outputs.
    pub outputs: Outputs<AXES>,
    /// What came out of its stages on the way.
    pub trail: Trail,
}

/// What a replay found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplayReport {
    /// Cycles stepped; all of the log's, unless there is a difference.
    pub cycles: u64,
    /// Final hash as recorded.
    pub recorded_hash: u64,
    /// Hash over the parameters, the recorded inputs and the outputs computed anew, of the cycles stepped.
    pub replayed_hash: u64,
    /// The first difference; `None` means that the run is the same in every bit.
    pub difference: Option<Difference>,
}

/// Where a replay parts from its log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Difference {
    /// The log is not what was recorded, so that nothing can be said from there on.
    Damage(Damage),
    /// The core answered otherwise.
    Answer {
        /// Cycle, from zero.
        cycle: u64,
        /// The first stage of the cycle whose result is another in any bit.
        stage: Option<Stage>,
        /// The first output that is another too, if there is one.
        output: Option<OutputDifference>,
    },
}

/// An output that is not as recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputDifference {
    /// The field, as "axis 3 torque".
    pub field: String,
    /// Its value in the log.
    pub recorded: String,
    /// Its value now.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (cycle, stage, output) = match self {
            Self::Damage(damage) => return damage.fmt(f),
            Self::Answer { cycle, stage, output } => (cycle, stage, output),
        };
        write!(f, "cycle {cycle}: ")?;
        if let Some(stage) = stage {
            write!(f, "first in stage {}", stage.name())?;
        }
        match output {
            None => write!(f, ", no output yet"),
            Some(OutputDifference {
                field,
                recorded,
                replayed,
            }) => {
                let after = if stage.is_some() { "; " } else { "" };
                write!(f, "{after}output {field} was {recorded} and is now {replayed}")
            }
        }
    }
}

/// Steps the inputs of `log` through `step`, which holds the core's state, up to the first difference.
pub fn replay(log: &Log, mut step: impl FnMut(&Inputs<AXES>) -> Result<Answer>) -> Result<ReplayReport> {
    let mut hash = RunHash::new(&log.parameters);
    let mut cycles = 0;
    let mut difference = None;
    for cycle in log.cycles() {
        let (inputs, recorded) = match cycle {
            Ok(cycle) => cycle,
            Err(damage) => {
                difference = Some(Difference::Damage(damage));
                break;
            }
        };
        let replayed = step(&inputs)?;
        hash.take(&inputs);
        hash.take(&replayed.outputs);
        if replayed != recorded {
            difference = Some(first_difference(cycles, &recorded, &replayed));
            break;
        }
        cycles += 1;
    }
    Ok(ReplayReport {
        cycles,
        recorded_hash: log.hash,
        replayed_hash: hash.value(),
        difference,
    })
}

fn first_difference(cycle: u64, recorded: &Answer, replayed: &Answer) -> Difference {
    let pairs = fields(&recorded.outputs).into_iter().zip(fields(&replayed.outputs));
    let mut different = pairs.filter(|(recorded, replayed)| recorded != replayed);
    Difference::Answer {
        cycle,
        stage: recorded.trail.first_difference(&replayed.trail),
        output: different
            .next()
            .map(|((field, recorded), (_, replayed))| OutputDifference {
                field,
                recorded,
                replayed,
            }),
    }
}

/// Name and value of every field; the patterns leave none out, so that a new field cannot be forgotten here.
fn fields(outputs: &Outputs<AXES>) -> Vec<(String, String)> {
    let Outputs {
        axes,
        exposure,
        look,
        flow,
        lamp,
        state,
        reason,
        phase,
        sighting,
        station_um,
        taught,
    } = outputs;
    let mut fields = Vec::new();
    for (
        axis,
        AxisOutput {
            request,
            velocity,
            torque,
        },
    ) in (1..).zip(axes)
    {
        fields.push((format!("axis {axis} request"), format!("{request:?}")));
        fields.push((format!("axis {axis} velocity"), format!("{velocity} counts/s")));
        fields.push((format!("axis {axis} torque"), format!("{torque} ‰")));
    }
    let numbers = [
        ("exposure", exposure),
        ("lamp", lamp),
        ("state", state),
        ("reason", reason),
        ("phase", phase),
        ("sighting", sighting),
    ];
    fields.extend(numbers.map(|(name, value)| (name.into(), value.to_string())));
    fields.push(("look".into(), format!("{look:?}")));
    fields.push(("flow".into(), format!("{flow} ‰")));
    fields.push(("station".into(), format!("{station_um} µm")));
    fields.push(("taught point".into(), format!("{taught:?}")));
    fields
}
