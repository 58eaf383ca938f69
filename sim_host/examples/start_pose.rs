//! How well the start pose is measured, on rendered images alone.
use clap::Parser;
use firmware::vision::start::Workspace;
use rayon::prelude::*;
use sim_host::camera::start::measure::{Measured, measure};
use sim_host::camera::start::scene::Misplacement;
use sim_host::cell::panel::{Joint, Side, Surface};
use sim_host::cli::number_in;
use sim_host::seal::scenario::{JointName, SurfaceName};
use std::collections::BTreeMap;

/// The accuracy that is asked for: m, rad.
const SHIFT: f64 = 0.15e-3;
const TURN: f64 = 0.3 * std::f64::consts::PI / 180.0;

/// How well the start pose is measured, on rendered images alone
#[derive(Parser)]
struct Arguments {
    /// Parts of each joint and surface (1 to 100000)
    #[arg(long, default_value = "100", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    trials: u64,
    /// Seed of the parts
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Part misplaced by up to this along each axis, mm (0 to 50)
    #[arg(long, value_name = "MM", default_value = "20", allow_negative_numbers = true, value_parser = number_in(0.0, 50.0))]
    shift_mm: f64,
    /// The same about each axis, degrees (0 to 20)
    #[arg(long, value_name = "DEG", default_value = "5", allow_negative_numbers = true, value_parser = number_in(0.0, 20.0))]
    turn_deg: f64,
    /// Peak deformation of the part, mm (0 to 10)
    #[arg(long, value_name = "MM", default_value = "0", allow_negative_numbers = true, value_parser = number_in(0.0, 10.0))]
    deform_mm: f64,
    /// Joints, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["crank"])]
    joint: Vec<JointName>,
    /// Surfaces, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["moderate"])]
    surface: Vec<SurfaceName>,
    /// Every joint on the moderate surface, lap joints and lips of either hand, and lap joints on every surface
    #[arg(long, conflicts_with_all = ["joint", "surface"])]
    all: bool,
}

fn main() {
    let arguments = Arguments::parse();
    let Arguments { trials, seed, all, .. } = arguments;
    let misplaced = Misplacement {
        shift: 1e-3 * arguments.shift_mm,
        turn: arguments.turn_deg.to_radians(),
        deform: 1e-3 * arguments.deform_mm,
    };
    let left = Joint::crank(Side::Left);
    let cases = if all {
        vec![
            (left, Surface::Clean),
            (left, Surface::Moderate),
            (left, Surface::Harsh),
            (Joint::crank(Side::Right), Surface::Moderate),
            (Joint::vee(), Surface::Moderate),
            (Joint::lip(Side::Left), Surface::Moderate),
            (Joint::lip(Side::Right), Surface::Moderate),
        ]
    } else {
        let surfaces = |joint: &JointName| {
            let shape = joint.shape();
            arguments.surface.iter().map(move |surface| (shape, surface.state()))
        };
        arguments.joint.iter().flat_map(surfaces).collect()
    };
    let Arguments {
        shift_mm,
        turn_deg,
        deform_mm,
        ..
    } = arguments;
    println!(
        "{trials} parts each, seed {seed}, up to {shift_mm} mm and {turn_deg}° off, bent by {deform_mm} mm; bars 0.15 mm and 0.3°"
    );
    println!("rms along and about x, y, z of the start");
    for (joint, surface) in cases {
        let found: Vec<_> = (0..trials)
            .into_par_iter()
            .map_init(
                || Box::new(Workspace::new()),
                |workspace, index| (index, measure(surface, joint, &misplaced, seed, index, workspace)),
            )
            .collect();
        let mut refused = BTreeMap::<String, Vec<u64>>::new();
        let mut measured: Vec<(u64, Measured)> = Vec::new();
        for (index, outcome) in found {
            match outcome {
                Ok(one) => measured.push((index, one)),
                Err(fault) => refused.entry(format!("{fault:?}")).or_default().push(index),
            }
        }
        let within = |one: &Measured| one.shift.norm() <= SHIFT && one.turn.norm() <= TURN;
        let good = measured.iter().filter(|(_, one)| within(one)).count();
        let wrong: Vec<_> = measured
            .iter()
            .filter(|(_, one)| !within(one))
            .map(|(index, one)| {
                let (mm, deg) = (1e3 * one.shift, one.turn.map(f64::to_degrees));
                format!(
                    "{index}: {:.2} {:.2} {:.2} mm {:.2} {:.2} {:.2}°",
                    mm.x, mm.y, mm.z, deg.x, deg.y, deg.z
                )
            })
            .collect();
        let rms = |value: &dyn Fn(&Measured) -> f64| {
            (measured.iter().map(|(_, one)| value(one).powi(2)).sum::<f64>() / measured.len().max(1) as f64).sqrt()
        };
        let axes = |scale: f64, value: &dyn Fn(&Measured, usize) -> f64| {
            let axis = |axis: usize| scale * rms(&|one: &Measured| value(one, axis));
            format!("{:.3} {:.3} {:.3}", axis(0), axis(1), axis(2))
        };
        println!(
            "{joint:?} {surface:?}: {good} of {trials} within, {} beyond, refused {refused:?}; rms {} mm, {}° (to the rigid part {}°); {:.1} images",
            wrong.len(),
            axes(1e3, &|one, axis| one.shift[axis]),
            axes(1_f64.to_degrees(), &|one, axis| one.turn[axis]),
            axes(1_f64.to_degrees(), &|one, axis| one.rigid_turn[axis]),
            measured.iter().map(|(_, one)| f64::from(one.images)).sum::<f64>() / measured.len().max(1) as f64,
        );
        wrong.iter().for_each(|line| println!("  {line}"));
    }
}
