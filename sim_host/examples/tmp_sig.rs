//! TMP
use firmware::vision::{SeamSensor, camera::Pinhole, image::View};
use sim_host::camera::detection::expected_joint;
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::Effects};
use sim_host::cell::panel::{Side, Surface};
fn main() {
    let kind = match std::env::args().nth(1).as_deref() { Some("v") => JointKind::Vee, Some("l") => JointKind::Lip(Side::Left), Some("k") => JointKind::Lip(Side::Right), Some("r") => JointKind::Crank(Side::Right), _ => JointKind::Crank(Side::Left) };
    for surface in [Surface::Moderate, Surface::Harsh] {
        let camera = Camera::new(Effects::of(surface), 2);
        let mut bins = [(0, 0.0, 0.0f64); 14];
        for i in 0..400 {
            let scene = Scene::draw(surface, kind, 2, i);
            let image = scene.image(&camera, i);
            let view = View::new(&image, 250, 250).unwrap();
            if let Ok(f) = SeamSensor::new(Pinhole::TRACKING, expected_joint(kind)).find(&view) {
                let e = f.y as f64 - scene.truth.pixel.1;
                let b = ((f.sigma * 2.0) as usize).min(13);
                bins[b].0 += 1; bins[b].1 += e * e; bins[b].2 = bins[b].2.max(e.abs());
            } else { }
        }
        for (b, (n, s, m)) in bins.iter().enumerate() { if *n > 0 { println!("{surface:?} sigma {:.1}..: n {n}, rms {:.2} px, max {m:.1}", b as f64 / 2.0, (s / *n as f64).sqrt()); } }
    }
}
