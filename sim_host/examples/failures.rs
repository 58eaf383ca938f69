//! What the seam sensor makes of seeded scenes, and a contact sheet of those it lost:
//! `failures JOINT SURFACE SEED,SEED… FRAMES [PNG]`; joints crank, left, right, vee, lip, plain; surfaces clean, moderate, harsh.
//!
//! On the sheet a tick at either side marks the true seam's row, a tick further in the row that was reported.
use firmware::vision::SeamSensor;
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use rayon::prelude::*;
use sim_host::camera::detection::{Method, expected_joint};
use sim_host::camera::optics::Optics;
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::Effects};
use sim_host::cell::panel::{Side, Surface};
use std::{fs::File, io::BufWriter};

/// Size of the images, px.
const WIDTH: usize = Optics::TRACKING.width;
const HEIGHT: usize = Optics::TRACKING.height;
/// Frames on a contact sheet: columns, rows.
const SHEET: (usize, usize) = (6, 4);

struct Lost {
    seed: u64,
    index: u64,
    image: Vec<u8>,
    text: String,
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [joint, surface, seeds, frames, rest @ ..] = &arguments[..] else {
        anyhow::bail!("failures JOINT SURFACE SEED,SEED… FRAMES [PNG]");
    };
    let (left, right) = (Side::Left, Side::Right);
    let kinds = match joint.as_str() {
        "crank" => vec![JointKind::Crank(left), JointKind::Crank(right)],
        "left" => vec![JointKind::Crank(left)],
        "right" => vec![JointKind::Crank(right)],
        "vee" => vec![JointKind::Vee],
        "lip" => vec![JointKind::Lip(left), JointKind::Lip(right)],
        "plain" => vec![JointKind::Plain],
        other => anyhow::bail!("joint is {other}, allowed crank, left, right, vee, lip, plain"),
    };
    let surface = match surface.as_str() {
        "clean" => Surface::Clean,
        "moderate" => Surface::Moderate,
        "harsh" => Surface::Harsh,
        other => anyhow::bail!("surface is {other}, allowed clean, moderate, harsh"),
    };
    let seeds: Vec<u64> = seeds.split(',').map(str::parse).collect::<Result<_, _>>()?;
    let frames: u64 = frames.parse()?;
    let mut lost = Vec::new();
    for &seed in &seeds {
        for &kind in &kinds {
            let camera = Camera::new(Effects::of(surface), seed);
            let outcomes: Vec<(bool, Option<u8>, f64, Lost)> = (0..frames)
                .into_par_iter()
                .filter_map(|index| {
                    let scene = Scene::draw(surface, kind, seed, index);
                    let mut image = scene.image(&camera, index);
                    let answer = Method::Sensor.find(kind, &image);
                    let error = answer.map(|point| {
                        let (lateral, height) = scene.errors(&point);
                        (lateral, height)
                    });
                    let good =
                        matches!(error, Ok((lateral, height)) if lateral.abs() <= 0.0005 && height.abs() <= 0.001);
                    if good && kind != JointKind::Plain || error.is_err() && kind == JointKind::Plain {
                        return None;
                    }
                    let view = View::new(&image, WIDTH, HEIGHT).ok()?;
                    let found = SeamSensor::new(Pinhole::TRACKING, expected_joint(kind)).find(&view);
                    let (x, y) = scene.truth.pixel;
                    let text = match (&found, error) {
                        (Ok(f), Ok((lateral, height))) => format!(
                            "off {:.2} mm across {:.2} high, row {:.1} for {y:.1} sigma {:.2} evidence {:.1}",
                            1e3 * lateral,
                            1e3 * height,
                            f.y,
                            f.sigma,
                            f.evidence
                        ),
                        (Err(reason), _) => format!("{reason:?}, true {x:.0} {y:.1}"),
                        _ => String::new(),
                    };
                    let mut tick = |row: f64, from: usize| {
                        let row = (row.round().max(0.0) as usize).min(HEIGHT - 1);
                        for side in [from, WIDTH - 8 - from] {
                            image[row * WIDTH + side..row * WIDTH + side + 8].fill(255);
                        }
                    };
                    let row = found.ok().map(|f| f64::from(f.y));
                    tick(y, 0);
                    if let Some(row) = row {
                        tick(row, 12);
                    }
                    let wrong = error.is_ok();
                    let far = matches!(error, Ok((l, h)) if l.abs().max(h.abs()) > 0.001);
                    Some((
                        far,
                        error.err(),
                        if wrong { 1.0 } else { 0.0 },
                        Lost {
                            seed,
                            index,
                            image,
                            text,
                        },
                    ))
                })
                .collect();
            let refused = outcomes.iter().filter(|o| o.1.is_some()).count();
            let wrong = outcomes.len() - refused;
            let far = outcomes.iter().filter(|o| o.0).count();
            println!(
                "{kind:?} {surface:?} seed {seed}: {:.3} % right, {refused} refused, {wrong} off by > 0.5 mm, of which {far} by > 1 mm",
                100.0 - 100.0 * outcomes.len() as f64 / frames as f64
            );
            lost.extend(outcomes.into_iter().map(|o| o.3));
        }
    }
    let Some(path) = rest.first() else { return Ok(()) };
    let stride = SHEET.0 * WIDTH;
    let mut sheet = vec![0; stride * HEIGHT * SHEET.1];
    for (number, frame) in lost.iter().take(SHEET.0 * SHEET.1).enumerate() {
        println!("{number}: seed {} frame {}: {}", frame.seed, frame.index, frame.text);
        let (row, column) = (number / SHEET.0, number % SHEET.0);
        for (y, pixels) in frame.image.chunks_exact(WIDTH).enumerate() {
            let at = (row * HEIGHT + y) * stride + column * WIDTH;
            sheet[at..at + WIDTH].copy_from_slice(pixels);
            sheet[at] = 128;
        }
    }
    let mut png = png::Encoder::new(
        BufWriter::new(File::create(path)?),
        stride as u32,
        (HEIGHT * SHEET.1) as u32,
    );
    png.set_color(png::ColorType::Grayscale);
    png.write_header()?.write_image_data(&sheet)?;
    Ok(())
}
