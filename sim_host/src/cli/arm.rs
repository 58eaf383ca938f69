//! `arm`: kinematics of a model.

use super::{Outcome, number_in, print_json};
use crate::model::Model;
use crate::seal::setup::inverse;
use anyhow::{Context, bail};
use clap::builder::NonEmptyStringValueParser;
use clap::{Args, Subcommand};
use firmware::arm::JointRange;
use firmware::geometry::Pose;
use nalgebra::{Matrix3, Vector3};
use serde_json::json;
use std::f32::consts::TAU;

/// Options of `arm`.
#[derive(Args)]
pub struct ArmArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Tip pose for joint angles
    Fk(JointArgs),
    /// All joint vectors for a tip pose within the model's limits
    Ik(PoseArgs),
    /// Geometric Jacobian of the tip for joint angles: rows v_x v_y v_z (m/rad), ω_x ω_y ω_z
    Jacobian(JointArgs),
}

#[derive(Args)]
struct JointArgs {
    /// Six joint angles θ_0…θ_5, rad (-100 to 100)
    #[arg(long, value_name = "RAD,…", value_delimiter = ',', allow_hyphen_values = true, required = true, value_parser = number_in(-100.0_f32, 100.0))]
    joints: Vec<f32>,
    #[command(flatten)]
    common: Common,
}

#[derive(Args)]
struct PoseArgs {
    /// Tip pose: the three rows of [R p], 12 numbers, p in m (-10 to 10)
    #[arg(long, value_name = "R11,R12,…", value_delimiter = ',', allow_hyphen_values = true, required = true, value_parser = number_in(-10.0_f32, 10.0))]
    pose: Vec<f32>,
    /// The up to eight solutions as they are, limits or not, each angle in ±π
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    common: Common,
}

#[derive(Args)]
struct Common {
    /// Model: `k3s`, or a TOML file
    #[arg(long, value_name = "NAME_OR_FILE", default_value = "k3s", value_parser = NonEmptyStringValueParser::new())]
    robot: String,
    /// One JSON value on stdout (this verb always answers in JSON)
    #[arg(long)]
    json: bool,
}

/// `arm …`.
pub fn run(args: &ArmArgs) -> Outcome {
    match &args.what {
        What::Fk(joint) => {
            let tip = model(&joint.common)?.arm().forward(&six(&joint.joints)?);
            print_json(&json!({ "pose": rows(&tip) }))?;
        }
        What::Jacobian(joint) => {
            let jacobian = model(&joint.common)?.arm().frames(&six(&joint.joints)?).jacobian();
            let rows: Vec<Vec<f32>> = jacobian.row_iter().map(|row| row.iter().copied().collect()).collect();
            print_json(&json!({ "jacobian": rows }))?;
        }
        What::Ik(pose) => {
            let model = model(&pose.common)?;
            let inverse = inverse(&model)?;
            let goal = pose_of(&pose.pose)?;
            let ranges = model.arm().ranges;
            let middle = ranges.map(|range| 0.5 * (range.min + range.max));
            let all = inverse.solutions(&goal, &middle);
            let solutions: Vec<[f32; 6]> = if pose.all {
                all.to_vec()
            } else {
                all.iter().flat_map(|q| turns_within(q, &ranges)).collect()
            };
            let found = !solutions.is_empty();
            print_json(&json!({ "solutions": solutions }))?;
            return Ok(found);
        }
    }
    Ok(true)
}

/// `q` moved by whole turns, joint by joint, to every place within the limits.
fn turns_within(q: &[f32; 6], ranges: &[JointRange; 6]) -> Vec<[f32; 6]> {
    const EDGE: f32 = 1e-5; // rounding at the limits, rad
    let mut found = vec![*q];
    for (axis, range) in ranges.iter().enumerate() {
        let turned = |q: &[f32; 6]| {
            [-TAU, 0.0, TAU].map(|turn| {
                let mut q = *q;
                q[axis] += turn;
                q
            })
        };
        let inside = |q: &[f32; 6]| (range.min - EDGE..=range.max + EDGE).contains(&q[axis]);
        found = found.iter().flat_map(turned).filter(inside).collect();
    }
    found
}

fn model(common: &Common) -> anyhow::Result<Model> {
    Ok(Model::named(&common.robot)?)
}

fn six(values: &[f32]) -> anyhow::Result<[f32; 6]> {
    values
        .try_into()
        .ok()
        .with_context(|| format!("--joints has {} numbers, must have 6", values.len()))
}

fn pose_of(values: &[f32]) -> anyhow::Result<Pose> {
    let v: [f32; 12] = values
        .try_into()
        .ok()
        .with_context(|| format!("--pose has {} numbers, must have 12", values.len()))?;
    let r = Matrix3::new(v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10]);
    let p = Vector3::new(v[3], v[7], v[11]);
    let off = (r * r.transpose() - Matrix3::identity()).amax();
    if off > 1e-3 {
        bail!("--pose: its rotation is off a rotation matrix by {off}, must be at most 0.001");
    }
    if r.determinant() <= 0.0 {
        bail!("--pose: its rotation is left-handed, must be right-handed");
    }
    Ok(Pose { r, p })
}

fn rows(pose: &Pose) -> Vec<f32> {
    (0..3)
        .flat_map(|i| [pose.r[(i, 0)], pose.r[(i, 1)], pose.r[(i, 2)], pose.p[i]])
        .collect()
}
