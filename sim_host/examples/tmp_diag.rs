use sim_host::camera::detection::{expected_joint};
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::{Effects,Effect}};
use sim_host::cell::panel::{Side, Surface};
use firmware::vision::{SeamSensor, camera::Pinhole, image::View};
fn main() {
    let kind = JointKind::Crank(Side::Left);
    for surface in [Surface::Clean, Surface::Moderate, Surface::Harsh] {
        for off in [None::<Effect>] {
            let eff = match off { Some(e) => Effects::of(surface).without(e), None => Effects::of(surface) };
            let camera = Camera::new(eff, 1);
            let (mut sq, mut n, mut out, mut unseen, mut refused) = (0.0, 0, 0, 0, [0;7]);
            let mut wn = 0.0;
            for i in 0..200 {
                let scene = Scene::draw(surface, kind, 1, i);
                let image = scene.image(&camera, i);
                let view = View::new(&image, 250, 250).unwrap();
                let sensor = SeamSensor::new(Pinhole::TRACKING, expected_joint(kind));
                match sensor.find(&view) { Ok(_) => refused[0]+=1, Err(r) => refused[r as usize]+=1 }
                let Ok(line) = sensor.trace(&view) else { continue };
                let cols = sim_host::camera::section_columns(&scene.panel, &scene.t_b_s);
                for y in 0..250 {
                    let best = cols[y].iter().flatten().map(|c| line.x[y] as f64 - c).min_by(|a,b| a.abs().total_cmp(&b.abs()));
                    let Some(e) = best else {continue};
                    if line.weight[y] <= 0.0 { unseen += 1; continue }
                    if e.abs() > 4.0 { out += 1 } else { sq += line.weight[y] as f64*e*e; wn += line.weight[y] as f64; n += 1 }
                }
            }
            println!("{surface:?} without {off:?}: rms {:.2} px, outliers {:.1} %, unseen {:.1} %, found/refused {refused:?}", (sq/wn).sqrt(), 100.0*out as f64/(n+out+unseen) as f64, 100.0*unseen as f64/(n+out+unseen) as f64);
        }
    }
}
