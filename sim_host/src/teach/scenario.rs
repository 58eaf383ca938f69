//! What one teaching trial is about: the cell and the part of [`crate::seal::scenario`], and how the operator and the controller go about it.

use crate::model::Model;
use crate::seal::scenario::{Draw, Options, Stream, stream};
use crate::seal::setup::{ACCELERATION, Setup, access, exposure_delay, known_mount, master, pose, servo, stance};
use clap::ValueEnum;
use firmware::cycle::Params;
use firmware::job::seal::SealParams;
use firmware::job::teach::{Law, TeachParams};
use hal::wire::Wire;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;

/// How the tool is led.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LawName {
    /// Nozzle on the seam that was seen, sensor over the seam ahead: without lag.
    #[default]
    Lead,
    /// The paper's critically damped loop (chapter 4), up to 0.04 m/s on R150.
    Paper,
}

impl LawName {
    /// The core's name for it.
    pub fn law(self) -> Law {
        match self {
            Self::Lead => Law::Lead,
            Self::Paper => Law::Paper,
        }
    }

    /// Cycles from one exposure to the next. The paper's 100 ms; and by default as soon as the image before is through, so that a corner of
    /// R5 is seen by several points at 0.2 m/s.
    pub fn vision_period(self) -> u8 {
        match self {
            Self::Lead => Options::default().vision_latency,
            Self::Paper => 20,
        }
    }
}

/// The cell and how the job is run in it.
#[derive(Clone, Copy, Debug)]
pub struct TeachOptions {
    /// Everything that the sealing cell has too; its vision period is from one exposure to the next.
    pub cell: Options,
    /// How the tool is led.
    pub law: LawName,
}

impl Default for TeachOptions {
    fn default() -> Self {
        Self {
            cell: Options {
                speed: 0.1,
                vision_period: LawName::default().vision_period(),
                ..Options::told()
            },
            law: LawName::Lead,
        }
    }
}

/// Everything that is settled before a trial: the part is drawn, and the operator places the nozzle at its start.
pub fn setup(options: &TeachOptions, model: &Model, seed: u64) -> anyhow::Result<Setup> {
    let cell = &options.cell;
    let draw = Draw::new(cell, seed);
    let mount = known_mount(cell, model);
    let teach = TeachParams {
        law: options.law.law(),
        start: pose(&placed(cell, &draw, seed)),
        mount,
        flank: cell.joint.pattern().flank(),
        search: stance(cell, &mount),
        vision_period: cell.vision_period,
        speed: cell.speed as f32,
        acceleration: ACCELERATION,
        access: access(model)?,
    };
    Ok(Setup {
        second: None,
        params: Params {
            arm: model.arm(),
            servo: servo(cell, model),
            seal: SealParams::EMPTY,
            teach: Some(teach),
            exposure_delay: exposure_delay(cell),
        },
        master: master(cell, model),
        mount,
        ends: [0.0, draw.panel.path().length()],
        panel: draw.panel.ending_at_start(),
    })
}

/// Where the operator places the nozzle, T_b_n: at the start of the part as it lies, unbent, x along the seam, with the error of a start pose.
fn placed(options: &Options, draw: &Draw, seed: u64) -> Isometry3<f64> {
    let frame = options.path.seam().at(0.0);
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[frame.t, frame.b, frame.n]));
    let nominal = Isometry3::from_parts(Translation3::from(frame.p), UnitQuaternion::from_rotation_matrix(&axes));
    let mut rng = stream(seed, Stream::StartPose);
    let mut within = |limit: f64| Vector3::from_fn(|_, _| (2.0 * rng.random::<f64>() - 1.0) * limit);
    let (shift, turn) = (within(options.start_error.0), within(options.start_error.1));
    let error = Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn));
    draw.displacement * options.path.placing() * nominal * error
}
