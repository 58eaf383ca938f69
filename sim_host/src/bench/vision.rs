//! What vision costs on the camera's image: seams sealed with both images in lock step. And what the neural finder costs, on an
//! image of its own.

use super::series::Series;
use super::{Bench, Row};
use crate::camera::detection::expected_joint;
use crate::camera::optics::Optics;
use crate::camera::scene::Scene;
use crate::camera::{Camera, effects::Effects};
use crate::campaign::Company;
use crate::cell::panel::{Joint, Side, Surface};
use crate::model::{AXES, Model};
use crate::seal::scenario::{JointName, Options, SurfaceName};
use crate::seal::trial;
use crate::target::net::Net;
use crate::target::node::On;
use anyhow::{Context, ensure};
use firmware::vision::camera::Pinhole;
use firmware::vision::image::View;
use firmware::vision::{TwoSlitSensor, net};
use hal::camera::{ONE_SLIT, TWO_SLITS};
use hal::process::Look;
use std::hint::black_box;
use std::time::Instant;

/// Seams, each a line of the table: slits, joint and surface.
const SEAMS: [(&str, u8, JointName, SurfaceName); 6] = [
    ("seam, two slits", 2, JointName::Crank, SurfaceName::Moderate),
    ("seam, two slits, harsh", 2, JointName::Crank, SurfaceName::Harsh),
    ("seam, one slit", 1, JointName::Crank, SurfaceName::Moderate),
    ("seam, one slit, harsh", 1, JointName::Crank, SurfaceName::Harsh),
    ("seam, one slit, vee", 1, JointName::Vee, SurfaceName::Moderate),
    ("seam, one slit, lip", 1, JointName::Lip, SurfaceName::Moderate),
];

/// Seams whose start is measured, two lines each: by what images of each kind cost.
const STARTS: [([&str; 2], JointName); 2] = [
    (["pose, grey view", "pose, slit view"], JointName::Crank),
    (["pose, grey view, vee", "pose, slit view, vee"], JointName::Vee),
];

/// Panels that [`rows`] seals for each trial.
pub const PANELS: u64 = (SEAMS.len() + STARTS.len()) as u64;

/// Images that are looked at for each trial where no panel is sealed: about as many as of a panel's seam.
const IMAGES: u64 = 100;

/// What they show.
const SHOWN: Joint = Joint::crank(Side::Left);

/// A line for each kind of seam, instructions from pixels to sightings, two for each start, and two for the net. `tick` is called after each
/// panel.
pub fn rows(bench: &Bench, tick: &dyn Fn()) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (stage, slits, joint, surface) in SEAMS {
        let options = Options {
            slits,
            joint,
            surface,
            ..Options::told()
        };
        let [costs] = costs(bench, options, [Look::Seam], tick)?;
        rows.push(row(stage, &costs));
    }
    for (stages, joint) in STARTS {
        let options = Options {
            joint,
            ..Options::default()
        };
        let costs = costs(bench, options, [Look::StartGrey, Look::StartSlit], tick)?;
        rows.extend(stages.iter().zip(&costs).map(|(stage, costs)| row(stage, costs)));
    }
    rows.extend(net_rows(bench)?);
    Ok(rows)
}

/// What images of each of `looks` cost in the panels that `options` describes.
fn costs<const N: usize>(
    bench: &Bench,
    options: Options,
    looks: [Look; N],
    tick: &dyn Fn(),
) -> anyhow::Result<[Series; N]> {
    let options = Options {
        on: On::Qemu,
        ..options
    };
    let mut costs = [(); N].map(|()| Series::default());
    for index in 0..bench.trials {
        let company = Company {
            recording: None,
            progress: &|_| {},
            upset: &mut |_, _, _| {},
        };
        let seed = bench.seed.wrapping_add(u64::from(index));
        let score = trial::run(&options, &Model::k3s(), seed, company)?;
        let camera = score.camera.as_ref().context("the camera was on no board")?;
        for (look, costs) in looks.into_iter().zip(&mut costs) {
            camera.of(look).for_each(|instructions| costs.take(instructions));
        }
        tick();
    }
    Ok(costs)
}

/// The net's lines: a whole image, and one window of it. What the target finds must be what this process finds.
fn net_rows(bench: &Bench) -> anyhow::Result<[Row; 2]> {
    let joint = expected_joint(SHOWN);
    let camera = Camera::new(Effects::of(Surface::Moderate), bench.seed);
    let mut target = Net::start()?;
    let (mut frames, mut windows) = (Series::default(), Series::default());
    for index in 0..IMAGES * u64::from(bench.trials) {
        let image = Scene::draw(Surface::Moderate, SHOWN, bench.seed, index).image(&camera, index);
        let view = View::new(&image, ONE_SLIT[0].into(), ONE_SLIT[1].into())?;
        let answer = target.find(joint, &image)?;
        ensure!(
            answer.seam == net::find(&view, joint),
            "the net on the target finds {:?} in image {index}, and not what it finds in this process",
            answer.seam
        );
        frames.take(answer.frame);
        windows.take(answer.window);
    }
    Ok([row("net, image", &frames), row("net, window", &windows)])
}

/// A frame of two slits in this process, ns, from pixels to sightings.
pub fn host_row(bench: &Bench) -> anyhow::Result<Row> {
    let camera = Camera::behind(Optics::TWO_SLITS, Effects::of(Surface::Moderate), bench.seed);
    let sensor = TwoSlitSensor::new(Pinhole::TWO_SLITS, expected_joint(SHOWN));
    let mut times = Series::default();
    for index in 0..IMAGES * u64::from(bench.trials) {
        let scene = Scene::draw_under(&Optics::TWO_SLITS, Surface::Moderate, SHOWN, bench.seed, index);
        let image = scene.image(&camera, index);
        let view = View::new(&image, TWO_SLITS[0].into(), TWO_SLITS[1].into())?;
        let start = Instant::now();
        black_box(sensor.sight(&view));
        times.take(start.elapsed().as_nanos() as u64);
    }
    Ok(row("seam, two slits", &times))
}

fn row(stage: &str, costs: &Series) -> Row {
    Row {
        stage: stage.into(),
        axes: AXES,
        median: costs.median(),
        max: costs.max(),
    }
}
