//! Seam finders side by side on seeded scenes, as a Markdown table: `detection [--slits 2] [SEED [FRAMES]]`.
//!
//! Each cell: share of all frames in which the seam is found within 0.5 mm across the seam / share refused / share that is off by
//! more than 1 mm and was not refused, in %. "Dented" are clean images of harshly dented sheet.
use sim_host::camera::detection::{Detection, Method};
use sim_host::camera::effects::Effects;
use sim_host::camera::pair::PairDetection;
use sim_host::camera::scene::JointKind;
use sim_host::cell::panel::{Side, Surface};

const KINDS: [(&str, JointKind); 6] = [
    ("crank, left", JointKind::Crank(Side::Left)),
    ("crank, right", JointKind::Crank(Side::Right)),
    ("vee", JointKind::Vee),
    ("lip, left", JointKind::Lip(Side::Left)),
    ("lip, right", JointKind::Lip(Side::Right)),
    ("no seam", JointKind::Plain),
];

fn main() -> anyhow::Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let two = arguments.first().is_some_and(|first| first == "--slits");
    if two {
        arguments.drain(..2.min(arguments.len()));
    }
    let number = |at: usize, default: u64| arguments.get(at).map_or(Ok(default), |text| text.parse());
    let (seed, frames) = (number(0, 41)?, number(1, 400)?);
    println!("seed {seed}, {frames} frames a cell");
    if two {
        pairs(seed, frames)
    } else {
        singles(seed, frames)
    }
    Ok(())
}

fn cell(result: &Detection) -> String {
    let frames = result.frames as f64;
    let refused: usize = result.refused.values().sum();
    format!(
        "{:.1} / {:.1} / {:.2}",
        100.0 * result.within(0.0005),
        100.0 * refused as f64 / frames,
        100.0 * result.unflagged(0.001).len() as f64 / frames
    )
}

fn singles(seed: u64, frames: u64) {
    println!("| joint | images | local fit | D_i | net | row centroid |\n| --- | --- | ---: | ---: | ---: | ---: |");
    for (name, kind) in KINDS {
        for (images, effects, surface) in [
            ("clean", Surface::Clean, Surface::Clean),
            ("dented", Surface::Clean, Surface::Harsh),
            ("moderate", Surface::Moderate, Surface::Moderate),
            ("harsh", Surface::Harsh, Surface::Harsh),
        ] {
            let cells = [Method::Sensor, Method::Printed, Method::Net, Method::RowCentroid].map(|method| {
                cell(&Detection::measure_in(
                    Effects::of(effects),
                    method,
                    surface,
                    kind,
                    seed,
                    frames,
                ))
            });
            println!("| {name} | {images} | {} |", cells.join(" | "));
        }
    }
}

fn pairs(seed: u64, frames: u64) {
    println!(
        "| joint | images | nearer slit | slit ahead | pose rms (stated): d_y, d_z mm; θ_x, θ_y, θ_z deg |\n| --- | --- | ---: | ---: | --- |"
    );
    for (name, kind) in KINDS {
        for surface in [Surface::Clean, Surface::Moderate, Surface::Harsh] {
            let pair = PairDetection::measure(surface, kind, seed, frames);
            let (error, stated) = pair.pose_rms();
            let units = [1e3, 1e3, 57.296, 57.296, 57.296];
            let pose: Vec<String> = (0..5)
                .map(|at| format!("{:.3} ({:.3})", error[at] * units[at], stated[at] * units[at]))
                .collect();
            let [near, ahead] = pair.slits.each_ref().map(cell);
            println!("| {name} | {surface:?} | {near} | {ahead} | {} |", pose.join(", "));
        }
    }
}
