//! Writes images of seeded scenes as PNG files into a folder: `scenes FOLDER [SEED]`, and says what they cost.
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::Effects, optics};
use sim_host::cell::panel::{Side, Surface};
use std::io::BufWriter;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().unwrap_or_else(|| "scenes".into());
    let seed = arguments.next().map_or(Ok(1), |text| text.parse())?;
    std::fs::create_dir_all(&folder)?;
    for (surface, name) in [
        (Surface::Clean, "clean"),
        (Surface::Moderate, "moderate"),
        (Surface::Harsh, "harsh"),
    ] {
        let camera = Camera::new(Effects::of(surface), seed);
        for (kind, joint) in [
            (JointKind::Crank(Side::Left), "crank"),
            (JointKind::Vee, "vee"),
            (JointKind::Lip(Side::Right), "lip"),
        ] {
            for index in 0..6 {
                let scene = Scene::draw(surface, kind, seed, index);
                let start = std::time::Instant::now();
                let image = scene.image(&camera, index);
                println!(
                    "{name} {joint} {index}: seam at {:.1?}, {:.0?}",
                    scene.truth.pixel,
                    start.elapsed()
                );
                let file = BufWriter::new(std::fs::File::create(format!("{folder}/{name}-{joint}-{index}.png"))?);
                let mut png = png::Encoder::new(file, optics::WIDTH as u32, optics::HEIGHT as u32);
                png.set_color(png::ColorType::Grayscale);
                png.write_header()?.write_image_data(&image)?;
            }
        }
    }
    Ok(())
}
