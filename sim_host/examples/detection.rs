//! Detection rates of the seam sensor and of two references on seeded scenes: `detection [SEED [FRAMES]]`.
use sim_host::camera::detection::{Detection, Method};
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::Effects};
use sim_host::cell::panel::{Side, Surface};
use std::time::Instant;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let seed = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let frames = arguments.next().map_or(Ok(400), |text| text.parse())?;
    println!("seed {seed}, {frames} frames; within 0.25 / 0.5 / 1 mm across the seam, in % of all frames");
    for (method, kinds) in [
        (Method::RowCentroid, &[JointKind::Crank(Side::Left)][..]),
        (Method::Printed, &[JointKind::Crank(Side::Left)]),
        (
            Method::Sensor,
            &[
                JointKind::Crank(Side::Left),
                JointKind::Crank(Side::Right),
                JointKind::Vee,
                JointKind::Lip(Side::Left),
                JointKind::Lip(Side::Right),
                JointKind::Plain,
            ],
        ),
    ] {
        for &kind in kinds {
            for surface in [Surface::Clean, Surface::Moderate, Surface::Harsh] {
                let result = Detection::measure(method, surface, kind, seed, frames);
                let percent = |limit| 100.0 * result.within(limit);
                let (lateral, height) = result.rms();
                println!(
                    "{method:?} {kind:?} {surface:?}: {:.1} / {:.1} / {:.1} %, rms {:.3} mm across {:.3} mm high, refused {:?}, {} wrong by > 1 mm",
                    percent(0.00025),
                    percent(0.0005),
                    percent(0.001),
                    1e3 * lateral,
                    1e3 * height,
                    result.refused,
                    result.unflagged(0.001).len(),
                );
            }
        }
        let camera = Camera::new(Effects::of(Surface::Harsh), seed);
        let images: Vec<_> = (0..50)
            .map(|index| Scene::draw(Surface::Harsh, kinds[0], seed, index).image(&camera, index))
            .collect();
        let start = Instant::now();
        let found = images
            .iter()
            .filter(|image| method.find(kinds[0], image).is_ok())
            .count();
        println!(
            "{method:?}: {:.0} µs per frame ({found} of 50 answered)",
            start.elapsed().as_secs_f64() / 50.0 * 1e6
        );
    }
    Ok(())
}
