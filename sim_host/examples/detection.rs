//! Seam finders on seeded scenes: a Markdown table of how often each is right, refuses, is in doubt, or is wrong and sure of it, and on request
//! a contact sheet of the images that ours lost. "Dented" are clean images of harshly dented sheet.
use anyhow::Context;
use clap::{Parser, ValueEnum};
use firmware::vision::SeamSensor;
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use sim_host::camera::Camera;
use sim_host::camera::detection::{Detection, Method, expected_joint};
use sim_host::camera::effects::Effects;
use sim_host::camera::optics::Optics;
use sim_host::camera::pair::PairDetection;
use sim_host::camera::scene::Scene;
use sim_host::cell::panel::{Joint, Side, Surface};
use sim_host::image_file::GreyImage;
use sim_host::table::Table;
use std::path::PathBuf;

/// Seam finders on seeded scenes: right is within 0.5 mm across the seam, wrong is further off and not refused
#[derive(Parser)]
struct Arguments {
    /// Scenes to a cell of the table (1 to 100000)
    #[arg(long, default_value = "400", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    frames: u64,
    /// Seed of the scenes
    #[arg(long, default_value = "41")]
    seed: u64,
    /// Joints, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["crank-left", "crank-right", "vee", "lip-left", "lip-right", "none"])]
    joint: Vec<JointName>,
    /// Images, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values = ["clean", "dented", "moderate", "harsh"])]
    surface: Vec<Images>,
    /// Thickness of a lap joint's upper sheet, µm (200 to 3000)
    #[arg(long, default_value = "600", value_parser = clap::value_parser!(u16).range(200..=3000))]
    sheet: u16,
    /// Slits of the sensor; with two the pose is measured, too
    #[arg(long, default_value = "1", value_parser = clap::value_parser!(u8).range(1..=2))]
    slits: u8,
    /// Beside it the paper's D_i, the neural finder and the plain centroid of each row
    #[arg(long, conflicts_with = "lost")]
    peers: bool,
    /// Writes the first 24 images that the sensor with one slit lost to this PNG: a tick at either side marks the true seam's row, a tick
    /// further in the row that was reported
    #[arg(long, value_name = "FILE", conflicts_with = "slits")]
    lost: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum JointName {
    CrankLeft,
    CrankRight,
    Vee,
    LipLeft,
    LipRight,
    /// A plate without a seam.
    None,
}

impl JointName {
    /// The joint, with a lapped sheet of this thickness, m.
    fn of(self, sheet_m: f64) -> Joint {
        let lap = |upper| Joint::Crank { upper, sheet_m };
        match self {
            Self::CrankLeft => lap(Side::Left),
            Self::CrankRight => lap(Side::Right),
            Self::Vee => Joint::vee(),
            Self::LipLeft => Joint::lip(Side::Left),
            Self::LipRight => Joint::lip(Side::Right),
            Self::None => Joint::PLAIN,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Images {
    Clean,
    Dented,
    Moderate,
    Harsh,
}

impl Images {
    /// What disturbs the images, and the sheet's surface.
    fn of(self) -> (Effects, Surface) {
        let (images, sheet) = match self {
            Self::Clean => (Surface::Clean, Surface::Clean),
            Self::Dented => (Surface::Clean, Surface::Harsh),
            Self::Moderate => (Surface::Moderate, Surface::Moderate),
            Self::Harsh => (Surface::Harsh, Surface::Harsh),
        };
        (Effects::of(images), sheet)
    }
}

/// The option's word for a value.
fn word(value: impl ValueEnum) -> String {
    value
        .to_possible_value()
        .map_or_else(String::new, |word| word.get_name().to_owned())
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    println!("seed {}, {} frames a cell", arguments.seed, arguments.frames);
    let sheet_m = f64::from(arguments.sheet) / 1e6;
    let cells = || {
        let surfaces = &arguments.surface;
        arguments
            .joint
            .iter()
            .flat_map(move |&joint| surfaces.iter().map(move |&images| (joint, images)))
    };
    let single = |method, joint: JointName, images: Images| {
        let (effects, sheet) = images.of();
        Detection::measure_in(
            effects,
            method,
            sheet,
            joint.of(sheet_m),
            arguments.seed,
            arguments.frames,
        )
    };
    if arguments.peers {
        let mut table = Table::new(["joint", "images", "local fit", "D_i", "net", "row centroid"]);
        for (joint, images) in cells() {
            let [ours, printed, net, centroid] = [Method::Sensor, Method::Printed, Method::Net, Method::RowCentroid]
                .map(|method| brief(&single(method, joint, images)));
            table.row([word(joint), word(images), ours, printed, net, centroid]);
        }
        println!("right / refused / wrong by more than 1 mm, %\n{table}");
        return Ok(());
    }
    let mut table = Table::new([
        "joint",
        "images",
        "slit",
        "right %",
        "refused",
        "doubtful %",
        "wrong by > 0.5 mm",
        "by > 1 mm",
        "and sure",
        "rms mm",
    ]);
    let mut poses = Table::new(["joint", "images", "d_y mm", "d_z mm", "θ_x °", "θ_y °", "θ_z °"]);
    let mut sheet = Sheet::default();
    for (joint, images) in cells() {
        if arguments.slits == 1 {
            let found = single(Method::Sensor, joint, images);
            if arguments.lost.is_some() {
                sheet.add(&found, &word(joint), joint.of(sheet_m), images, arguments.seed)?;
            }
            table.row(row(joint, images, "1", &found));
        } else {
            let (effects, surface) = images.of();
            let pair = PairDetection::measure(effects, surface, joint.of(sheet_m), arguments.seed, arguments.frames);
            for (slit, found) in ["nearer", "ahead"].into_iter().zip(&pair.slits) {
                table.row(row(joint, images, slit, found));
            }
            let (error, stated) = pair.pose_rms();
            let units = [1e3, 1e3, 57.296, 57.296, 57.296];
            let [d_y, d_z, x, y, z] =
                std::array::from_fn(|at| format!("{} ({})", rms(error[at] * units[at]), rms(stated[at] * units[at])));
            poses.row([word(joint), word(images), d_y, d_z, x, y, z]);
        }
    }
    print!("{table}");
    if arguments.slits == 2 {
        print!("\nrms of the pose's errors (and of what was stated)\n{poses}");
    }
    if let Some(path) = arguments.lost {
        std::fs::write(&path, sheet.to_png()?).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    Ok(())
}

/// Shares in %: right, refused, wrong by more than a millimetre.
fn brief(found: &Detection) -> String {
    let share = |count: usize| 100.0 * count as f64 / found.frames as f64;
    format!(
        "{:.1} / {:.1} / {:.2}",
        100.0 * found.within(0.0005),
        share(found.refused.values().sum()),
        share(found.wrong(0.001).count())
    )
}

fn row(joint: JointName, images: Images, slit: &str, found: &Detection) -> [String; 10] {
    [
        word(joint),
        word(images),
        slit.to_owned(),
        format!("{:.2}", 100.0 * found.within(0.0005)),
        found.refused.values().sum::<usize>().to_string(),
        format!(
            "{:.1}",
            100.0 * (found.found.len() as f64 / found.frames as f64 - found.sure())
        ),
        found.wrong(0.0005).count().to_string(),
        found.wrong(0.001).count().to_string(),
        found.unflagged(0.001).len().to_string(),
        rms(1e3 * found.rms().0),
    ]
}

/// A root mean square, or that there was nothing to take it of.
fn rms(value: f64) -> String {
    if value > 0.0 {
        format!("{value:.3}")
    } else {
        "–".to_owned()
    }
}

/// Size of the images, px.
const WIDTH: usize = Optics::TRACKING.width;
const HEIGHT: usize = Optics::TRACKING.height;
/// Frames on a contact sheet: columns, rows.
const COLUMNS: usize = 6;
const ROWS: usize = 4;

/// A contact sheet.
#[derive(Default)]
struct Sheet {
    images: Vec<Vec<u8>>,
}

impl Sheet {
    /// Adds what the sensor lost, and says on standard error what became of it.
    fn add(&mut self, found: &Detection, name: &str, joint: Joint, images: Images, seed: u64) -> anyhow::Result<()> {
        let right = |index| {
            found
                .found
                .iter()
                .any(|find| find.scene == index && find.lateral.abs() <= 0.0005)
        };
        let (effects, surface) = images.of();
        let camera = Camera::new(effects, seed);
        for index in (0..found.frames as u64).filter(|&index| !right(index)) {
            if self.images.len() == COLUMNS * ROWS {
                break;
            }
            let scene = Scene::draw(surface, joint, seed, index);
            let mut image = scene.image(&camera, index);
            let sensor = SeamSensor::new(Pinhole::TRACKING, expected_joint(joint));
            let answer = sensor.find(&View::new(&image, WIDTH, HEIGHT)?);
            let (_, true_row) = scene.truth.pixel;
            let said = match &answer {
                Ok(find) => format!("row {:.1}, standard deviation {:.1}", find.y, find.sigma),
                Err(refusal) => format!("{refusal:?}"),
            };
            eprintln!(
                "{}: {name} {} {index}: {said}; true row {true_row:.1}",
                self.images.len(),
                word(images)
            );
            tick(&mut image, true_row, 0);
            if let Ok(find) = answer {
                tick(&mut image, f64::from(find.y), 12);
            }
            self.images.push(image);
        }
        Ok(())
    }

    fn to_png(&self) -> anyhow::Result<Vec<u8>> {
        let width = COLUMNS * WIDTH;
        let mut pixels = vec![0; width * HEIGHT * ROWS];
        for (number, image) in self.images.iter().enumerate() {
            for (y, row) in image.chunks_exact(WIDTH).enumerate() {
                let at = (number / COLUMNS * HEIGHT + y) * width + number % COLUMNS * WIDTH;
                pixels[at..at + WIDTH].copy_from_slice(row);
                pixels[at] = 128;
            }
        }
        let height = HEIGHT * ROWS;
        GreyImage { width, height, pixels }.to_png()
    }
}

/// Marks a row at both sides, `inward` px from the border.
fn tick(image: &mut [u8], row: f64, inward: usize) {
    const LENGTH: usize = 8;
    let row = (row.round().max(0.0) as usize).min(HEIGHT - 1);
    for side in [inward, WIDTH - LENGTH - inward] {
        image[row * WIDTH + side..row * WIDTH + side + LENGTH].fill(255);
    }
}
