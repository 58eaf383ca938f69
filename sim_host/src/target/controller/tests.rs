//! What the comparison between the board and the core in process finds. Needs the image: `cargo xtask target`.

use super::*;
use crate::model::Model;
use crate::seal::scenario::Options;
use crate::seal::setup::Setup;
use crate::target::image;

/// Runs `cycles` without any other node on the bus; the core in process is given what `change` makes of the parameters.
fn run(cycles: u32, change: impl FnOnce(&mut MasterConfig<AXES>)) -> anyhow::Result<()> {
    let setup = Setup::new(&Options::default(), &Model::named("k3s")?, 1)?;
    let mut controller = TargetController::new(&image::find("controller")?, &setup.master, setup.params.clone())?;
    let mut other = setup.master;
    change(&mut other);
    controller.mirror = Controller::new(&other, setup.params).map_err(|error| anyhow!("{}", error.field))?;
    for _ in 0..cycles {
        controller.sync(&mut |_| {})?;
        controller.cycle(&mut |_| {})?;
    }
    Ok(())
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn a_controller_alone_on_the_bus_sends_the_same_frames_on_both() {
    run(400, |_| {}).unwrap();
}

#[test]
#[ignore = "needs the image and QEMU: cargo xtask target"]
fn one_frame_that_differs_is_found_in_its_cycle() {
    // The master's heartbeat is due one cycle later in process.
    let error = run(400, |master| master.master_heartbeat_cycles += 1)
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("cycle 6: frames differ"), "{error}");
}
