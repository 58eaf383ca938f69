//! Contact sheets of seeded start views, a PNG per joint: rows clean, moderate, harsh.
use clap::Parser;
use sim_host::camera::optics::Optics;
use sim_host::camera::start::light::SpotLight;
use sim_host::camera::start::scene::{Misplacement, StartScene};
use sim_host::camera::start::{GreyView, SIDE};
use sim_host::cell::panel::{Joint, Side, Surface};
use sim_host::image_file::GreyImage;
use sim_host::whole_file;
use std::path::PathBuf;

const COLUMNS: usize = 4;
const SURFACES: [Surface; 3] = [Surface::Clean, Surface::Moderate, Surface::Harsh];
const MISPLACED: Misplacement = Misplacement {
    shift: 0.010,
    turn: 0.087,
    deform: 0.002,
};

/// Contact sheets of seeded start views, a PNG per joint: rows clean, moderate, harsh
#[derive(Parser)]
struct Arguments {
    /// Where they are written to
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    out: PathBuf,
    /// Seed of the parts
    #[arg(long, default_value = "1")]
    seed: u64,
}

fn main() -> anyhow::Result<()> {
    let Arguments { out, seed } = Arguments::parse();
    for (joint, name) in [
        (Joint::crank(Side::Left), "start_crank"),
        (Joint::vee(), "start_vee"),
        (Joint::lip(Side::Right), "start_lip"),
    ] {
        let width = COLUMNS * SIDE;
        let mut sheet = vec![0; width * SIDE * SURFACES.len()];
        for (row, surface) in SURFACES.into_iter().enumerate() {
            for column in 0..COLUMNS {
                let scene = StartScene::draw(surface, joint, &MISPLACED, seed, column as u64);
                let image = GreyView::new(Optics::START, SpotLight::of(surface), seed + column as u64).expose(
                    0,
                    &scene.panel,
                    &scene.taught,
                );
                for (y, pixels) in image.chunks_exact(SIDE).enumerate() {
                    let at = (row * SIDE + y) * width + column * SIDE;
                    sheet[at..at + SIDE].copy_from_slice(pixels);
                }
            }
        }
        let all = GreyImage {
            width,
            height: SIDE * SURFACES.len(),
            pixels: sheet,
        };
        let path = out.join(format!("{name}.png"));
        whole_file::write(&path, &all.to_png()?)?;
    }
    Ok(())
}
