//! How well the corner is found in grey start views: `start_grey [SEED [IMAGES [SHIFT_MM]]]`
use firmware::vision::start::Workspace;
use sim_host::camera::start::grey::look;
use sim_host::camera::start::scene::Misplacement;
use sim_host::cell::panel::{Joint, Side, Surface};
use std::collections::BTreeMap;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let images: u64 = arguments.next().map_or(Ok(100), |text| text.parse())?;
    let shift: f64 = arguments.next().map_or(Ok(20.0), |text| text.parse())?;
    let misplaced = Misplacement {
        shift: 1e-3 * shift,
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
    Ok(())
}
