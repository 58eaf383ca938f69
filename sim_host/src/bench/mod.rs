//! What the control cycle costs, stage by stage: on the emulated Cortex-M in instructions, in this process in nanoseconds.
//!
//! Real runs: panels are sealed in lock step, first by the image as it is, which gives the cycle's own figures, then by the same image
//! with a mark between any two stages, which gives the stages'. A mark costs a few instructions, so the stages add up to a little more
//! than the cycle. Medians are over the cycles in which everything is on, along the seam; greatest values over all cycles from power-up.

pub mod gate;
pub mod image;
mod series;
mod vision;
pub mod words;

use crate::campaign::Company;
use crate::model::Model;
use crate::node::Nodes;
use crate::progress;
use crate::seal::cell::Cell;
use crate::seal::scenario::Options;
use crate::seal::second::ALL;
use crate::seal::setup::Setup;
use crate::seal::trial;
use crate::target::node::{Node, On};
use anyhow::bail;
use firmware::job::phase::Phase;
use firmware::job::seal::AXES;
use hal::board::report::Instruments;
use hal::canopen::emcy::code;
use hal::stage::{STAGES, Stage};
use image::ImageFigures;
use serde::Serialize;
use series::Series;

/// What is to be measured.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    /// Seed of the first panel.
    pub seed: u64,
    /// Panels to seal, each with the next seed.
    pub trials: u32,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Row {
    /// The stage.
    pub stage: String,
    /// Axes that the cycle moves.
    pub axes: usize,
    /// Median over the cycles along the seam.
    pub median: u64,
    /// Greatest over all cycles.
    pub max: u64,
}

/// The figures.
#[derive(Clone, Debug, Serialize)]
pub struct BenchResult {
    /// The whole control cycle of the image without marks, along the seam.
    pub cycle_median_instructions: u64,
    /// The same, greatest over all cycles.
    pub cycle_max_instructions: u64,
    /// The whole control cycle where everything comes together: frequent and old sightings, destroyed frames, drives at their limits, and then all of
    /// them failing at once.
    pub worst: Row,
    /// Both figures where a second arm of five axes moves beside the sealing one, in the same cycle.
    pub second_arm: [Row; 2],
    /// Instructions per stage, from the images with marks: of the sealing arm alone, and of both.
    pub stages: Vec<Row>,
    /// Instructions of the camera's image.
    pub vision: Vec<Row>,
    /// Bytes of the controller's image, and its panics.
    #[serde(flatten)]
    pub image: ImageFigures,
    /// Deepest stack since the first timer event, painted and looked at.
    pub stack_painted_bytes: u32,
    /// Bytes of the image with the second arm, and its panics.
    pub second_arm_image: ImageFigures,
    /// Its deepest stack.
    pub second_arm_stack_painted_bytes: u32,
    /// The same stages and a frame of two slits in this process, ns; greatest values are this machine's interruptions as much as the core's.
    pub host_stages_ns: Vec<Row>,
    /// Control cycles measured on the target, and panels sealed in them.
    pub cycles: u64,
    /// Panels sealed.
    pub trials: u32,
    /// Seed of the first.
    pub seed: u64,
}

/// How hard a panel is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Course {
    /// As it is sealed otherwise, its start measured first.
    Ordinary,
    /// Sightings as often and as old as the camera can make them, frames destroyed on the bus, a servo model so wrong that drives are at their
    /// limits; and in the middle of the seam every drive fails in the same cycle and the I/O node is cut off.
    Worst,
}

impl Course {
    fn options(self, axes: usize) -> Options {
        let options = match self {
            Self::Ordinary => Options::default(),
            Self::Worst => Options {
                vision_period: 4,
                vision_latency: 10,
                error_frames: 3,
                model_error: 0.3,
                ..Options::told()
            },
        };
        Options {
            second_arm: axes == ALL,
            ..options
        }
    }

    /// Breaks what is to break, with the nozzle at `station` (m).
    fn upset(self, station: f64, cell: &mut Cell) {
        if self == Self::Worst && station > WORST_AT {
            cell.cut = Some(Nodes::<AXES>::IO);
            let beside = cell.second.iter_mut().flat_map(|second| &mut second.drives);
            for drive in cell.nodes.drives.iter_mut().chain(beside) {
                drive.servo().fail(code::OVER_CURRENT);
            }
        }
    }
}

/// Lines of the whole cycle.
const CYCLE: &str = "cycle";
const WORST: &str = "cycle, at worst";

/// Where along the seam the worst happens, m.
const WORST_AT: f64 = 0.2;

/// Costs of many cycles.
struct Costs {
    /// Axes that the cycles moved: those of the sealing arm, or of both.
    axes: usize,
    /// Of cycles along the seam: all of it, then stage by stage.
    following: [Series; STAGES + 1],
    /// Of all cycles.
    all: [Series; STAGES + 1],
    instruments: Instruments,
}

impl Costs {
    /// Of panels sealed by the controller that `node` makes, which moves so many `axes`.
    fn of(
        bench: &Bench,
        axes: usize,
        course: Course,
        tick: &dyn Fn(),
        node: impl Fn(&Setup) -> anyhow::Result<Node>,
    ) -> anyhow::Result<Self> {
        let mut costs = Self {
            axes,
            following: Default::default(),
            all: Default::default(),
            instruments: Instruments::default(),
        };
        for index in 0..bench.trials {
            let company = Company {
                recording: None,
                progress: &|_| {},
                upset: &mut |_, station, cell| course.upset(station, cell),
            };
            let seed = bench.seed.wrapping_add(u64::from(index));
            let score = trial::run_with(
                &course.options(axes),
                &Model::k3s(),
                seed,
                company,
                &node,
                &mut |node, outputs| {
                    let Some(cost) = node.cost() else { return };
                    let follows = outputs.phase == Phase::Follow as u8;
                    for (at, value) in std::iter::once(cost.total).chain(cost.stages).enumerate() {
                        costs.all[at].take(value);
                        if follows {
                            costs.following[at].take(value);
                        }
                    }
                },
            )?;
            match (course, score.run.failure) {
                (Course::Ordinary, Some(reason)) => bail!("the panel of seed {seed} was not sealed: {reason}"),
                (Course::Worst, None) => bail!("the panel of seed {seed} was sealed by drives that had failed"),
                _ => {}
            }
            if let Some(instruments) = &score.run.instruments {
                costs.instruments.merge(instruments);
            }
            tick();
        }
        Ok(costs)
    }

    fn row(&self, at: usize, stage: &str) -> Row {
        Row {
            stage: stage.into(),
            axes: self.axes,
            median: self.following[at].median(),
            max: self.all[at].max(),
        }
    }

    fn stages(&self) -> Vec<Row> {
        let named = Stage::ALL.into_iter().enumerate();
        named.map(|(at, stage)| self.row(at + 1, stage.name())).collect()
    }
}

/// Measures.
pub fn run(bench: &Bench) -> anyhow::Result<BenchResult> {
    let bar = progress::bar((7 + vision::PANELS) * u64::from(bench.trials), "panels");
    let tick = || bar.inc(1);
    let plain = |setup: &Setup| Node::for_setup(On::Qemu, setup, false);
    let marked = |setup: &Setup| Node::for_setup(On::Qemu, setup, true);
    let whole = Costs::of(bench, AXES, Course::Ordinary, &tick, plain)?;
    let worst = Costs::of(bench, AXES, Course::Worst, &tick, plain)?;
    let stages = Costs::of(bench, AXES, Course::Ordinary, &tick, marked)?;
    let both = Costs::of(bench, ALL, Course::Ordinary, &tick, plain)?;
    let both_worst = Costs::of(bench, ALL, Course::Worst, &tick, plain)?;
    let both_stages = Costs::of(bench, ALL, Course::Ordinary, &tick, marked)?;
    let host = Costs::of(bench, AXES, Course::Ordinary, &tick, |setup| {
        Node::timed(&setup.master, setup.params.clone())
    })?;
    let vision = vision::rows(bench, &tick)?;
    bar.finish_and_clear();
    let cycle = whole.row(0, CYCLE);
    Ok(BenchResult {
        cycle_median_instructions: cycle.median,
        cycle_max_instructions: cycle.max,
        worst: worst.row(0, WORST),
        second_arm: [both.row(0, CYCLE), both_worst.row(0, WORST)],
        stages: [stages.stages(), both_stages.stages()].concat(),
        vision,
        image: ImageFigures::read("controller")?,
        stack_painted_bytes: whole.instruments.stack[1],
        second_arm_image: ImageFigures::read("second-arm")?,
        second_arm_stack_painted_bytes: both.instruments.stack[1],
        host_stages_ns: [host.stages(), vec![vision::host_row(bench)?]].concat(),
        cycles: whole.instruments.cycle.count(),
        trials: bench.trials,
        seed: bench.seed,
    })
}

impl BenchResult {
    /// Every line that counts instructions, the whole cycle first.
    pub fn rows(&self) -> Vec<Row> {
        let cycle = Row {
            stage: CYCLE.into(),
            axes: AXES,
            median: self.cycle_median_instructions,
            max: self.cycle_max_instructions,
        };
        let cycles = [&cycle, &self.worst].into_iter().chain(&self.second_arm);
        cycles.chain(&self.stages).chain(&self.vision).cloned().collect()
    }
}
