//! Contact sheets of seeded scenes, a PNG per joint: rows clean, moderate, harsh. `scenes [FOLDER [SEED]]`
use sim_host::camera::optics::Optics;
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::Effects};
use sim_host::cell::panel::{Side, Surface};
use std::{fs::File, io::BufWriter};

const WIDTH: usize = Optics::TRACKING.width;
const HEIGHT: usize = Optics::TRACKING.height;
const COLUMNS: usize = 6;
const SURFACES: [Surface; 3] = [Surface::Clean, Surface::Moderate, Surface::Harsh];

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().unwrap_or_else(|| ".".into());
    let seed = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let cameras = SURFACES.map(|surface| Camera::new(Effects::of(surface), seed));
    for (kind, name) in [
        (JointKind::Crank(Side::Left), "crank"),
        (JointKind::Vee, "vee"),
        (JointKind::Lip(Side::Right), "lip"),
    ] {
        let stride = COLUMNS * WIDTH;
        let mut sheet = vec![0; stride * HEIGHT * SURFACES.len()];
        for (row, (surface, camera)) in SURFACES.into_iter().zip(&cameras).enumerate() {
            for column in 0..COLUMNS {
                let image = Scene::draw(surface, kind, seed, column as u64).image(camera, column as u64);
                for (y, pixels) in image.chunks_exact(WIDTH).enumerate() {
                    let at = (row * HEIGHT + y) * stride + column * WIDTH;
                    sheet[at..at + WIDTH].copy_from_slice(pixels);
                }
            }
        }
        let file = BufWriter::new(File::create(format!("{folder}/{name}.png"))?);
        let mut png = png::Encoder::new(file, stride as u32, (HEIGHT * SURFACES.len()) as u32);
        png.set_color(png::ColorType::Grayscale);
        png.write_header()?.write_image_data(&sheet)?;
    }
    Ok(())
}
