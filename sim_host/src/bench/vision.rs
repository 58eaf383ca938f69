//! What vision costs on the camera's image: seams sealed with both images in lock step.

use super::series::Series;
use super::{Bench, Row};
use crate::campaign::Company;
use crate::model::{AXES, Model};
use crate::seal::scenario::Options;
use crate::seal::trial;
use crate::target::node::On;
use anyhow::bail;
use hal::process::Look;

/// What an image can be of, and how that is called here. The start's two views are one stage each.
const STAGES: [(Look, &str); 3] = [
    (Look::Seam, "seam"),
    (Look::StartGrey, "start, grey"),
    (Look::StartSlit, "start, slit"),
];

/// A line for each kind of image that came: instructions from pixels to sightings. `tick` is called after each panel.
pub fn rows(bench: &Bench, tick: &dyn Fn()) -> anyhow::Result<Vec<Row>> {
    let options = Options {
        on: On::Qemu,
        ..Options::told()
    };
    let mut costs: [Series; STAGES.len()] = Default::default();
    for index in 0..bench.trials {
        let company = Company {
            recording: None,
            progress: &|_| {},
            upset: &mut |_, _, _| {},
        };
        let seed = bench.seed.wrapping_add(u64::from(index));
        let score = trial::run(&options, &Model::k3s(), seed, company)?;
        let Some(camera) = &score.camera else {
            bail!("the camera was on no board");
        };
        for ((look, _), series) in STAGES.iter().zip(&mut costs) {
            camera.of(*look).for_each(|instructions| series.take(instructions));
        }
        tick();
    }
    let rows = STAGES.iter().zip(&costs).map(|((_, stage), series)| Row {
        stage: stage.to_string(),
        axes: AXES,
        median: series.median(),
        max: series.max(),
    });
    Ok(rows.filter(|row| row.max > 0).collect())
}
