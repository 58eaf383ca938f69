//! The seam sensor alone on 20 moderate and 20 harsh frames, for counting instructions:
//! `valgrind --tool=callgrind --toggle-collect='*measured*' target/release/examples/sensor_cost`, count divided by 40.
use sim_host::camera::detection::Method;
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::Effects};
use sim_host::cell::panel::{Side, Surface};

const SEED: u64 = 1;
const KIND: JointKind = JointKind::Crank(Side::Left);

#[inline(never)]
fn measured(image: &[u8]) -> bool {
    Method::Sensor.find(KIND, image).is_ok()
}

fn main() {
    for surface in [Surface::Moderate, Surface::Harsh] {
        let camera = Camera::new(Effects::of(surface), SEED);
        let found = (0..20)
            .filter(|&index| measured(&Scene::draw(surface, KIND, SEED, index).image(&camera, index)))
            .count();
        println!("{surface:?}: {found} of 20 found");
    }
}
