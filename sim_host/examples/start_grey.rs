//! How well the corner is found in grey start views.
use clap::Parser;
use firmware::vision::start::Workspace;
use sim_host::camera::start::grey::look;
use sim_host::camera::start::scene::Misplacement;
use sim_host::cell::panel::{Joint, Side, Surface};
use sim_host::cli::number_in;
use std::collections::BTreeMap;

/// How well the corner is found in grey start views of every joint and surface
#[derive(Parser)]
struct Arguments {
    /// Seed of the parts
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Images of each joint and surface (1 to 100000)
    #[arg(long, default_value = "100", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    images: u64,
    /// Part misplaced by up to this along each axis, mm (0 to 50)
    #[arg(long, value_name = "MM", default_value = "20", value_parser = number_in(0.0, 50.0))]
    shift_mm: f64,
}

fn main() {
    let Arguments { seed, images, shift_mm } = Arguments::parse();
    let misplaced = Misplacement {
        shift: 1e-3 * shift_mm,
        turn: 5_f64.to_radians(),
        deform: 0.0,
    };
    let mut workspace = Box::new(Workspace::new());
    for joint in [
        Joint::crank(Side::Left),
        Joint::crank(Side::Right),
        Joint::vee(),
        Joint::lip(Side::Left),
        Joint::lip(Side::Right),
    ] {
        for surface in [Surface::Clean, Surface::Moderate, Surface::Harsh] {
            let mut refused = BTreeMap::<u8, Vec<u64>>::new();
            let (mut off, mut turn, mut wrong) = (Vec::new(), Vec::new(), Vec::new());
            for index in 0..images {
                match look(surface, joint, &misplaced, seed, index, &mut workspace) {
                    Ok(find) => {
                        let distance = find.off_px[0].hypot(find.off_px[1]);
                        if distance > 4.0 {
                            wrong.push((index, find.off_px.map(|px| px.round())));
                        } else {
                            off.push(distance);
                            turn.push(find.turn.abs().to_degrees());
                        }
                    }
                    Err(refusal) => refused.entry(refusal as u8).or_default().push(index),
                }
            }
            let rank = |values: &mut Vec<f64>| {
                values.sort_by(f64::total_cmp);
                let at = |share: f64| {
                    values
                        .get(((values.len() as f64 - 1.0) * share) as usize)
                        .copied()
                        .unwrap_or(0.0)
                };
                format!("{:.2} {:.2} {:.2}", at(0.5), at(0.99), at(1.0))
            };
            println!(
                "{joint:?} {surface:?}: {} found, corner off by {} px, direction by {}° (50, 99, 100 %); wrong {wrong:?}; refused {refused:?}",
                off.len(),
                rank(&mut off),
                rank(&mut turn),
            );
        }
    }
}
