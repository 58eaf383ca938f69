//! TMP: tmp_view SEED kind surface out idx...
use firmware::vision::{SeamSensor, camera::Pinhole, image::View};
use sim_host::camera::detection::expected_joint;
use sim_host::camera::scene::{JointKind, Scene};
use sim_host::camera::{Camera, effects::Effects};
use sim_host::cell::panel::{Side, Surface};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let seed: u64 = a[1].parse().unwrap();
    let kind = match a[2].as_str() { "c" => JointKind::Crank(Side::Left), "r" => JointKind::Crank(Side::Right), "v" => JointKind::Vee, "l" => JointKind::Lip(Side::Left), "k" => JointKind::Lip(Side::Right), _ => JointKind::Plain };
    let surface = match a[3].as_str() { "h" => Surface::Harsh, "m" => Surface::Moderate, _ => Surface::Clean };
    let idx: Vec<u64> = a[5..].iter().map(|t| t.parse().unwrap()).collect();
    let camera = Camera::new(Effects::of(surface), seed);
    let z = 2usize;
    let (w, h) = (500 * z, 250 * z);
    let cols = 2.min(idx.len());
    let rowsn = idx.len().div_ceil(cols);
    let mut out = vec![0u8; w * cols * h * rowsn * 3];
    for (n, &i) in idx.iter().enumerate() {
        let scene = Scene::draw(surface, kind, seed, i);
        let image = scene.image(&camera, i);
        let view = View::new(&image, 250, 250).unwrap();
        let sensor = SeamSensor::new(Pinhole::TRACKING, expected_joint(kind));
        let find = sensor.find(&view);
        println!("{i}: truth {:.1?} {:?}", scene.truth.pixel, find);
        let line = sensor.trace(&view).ok();
        let (ox, oy) = (n % cols * w, n / cols * h);
        let mut put = |x: usize, y: usize, c: [u8; 3]| { let k = ((oy + y) * w * cols + ox + x) * 3; out[k..k + 3].copy_from_slice(&c); };
        for y in 0..h { for x in 0..w {
            let v = image[y / z * 250 + (x / z) % 250];
            put(x, y, [v; 3]);
        } }
        if let Some(line) = line { for y in 0..250 { if line.weight[y] > 0.0 {
            let x = (250.0 + line.x[y].clamp(0.0, 249.0)) * z as f32;
            let g = (line.weight[y] * 255.0) as u8;
            for d in 0..z { put(x as usize, y * z + d, [255 - g, g, 0]); }
        } } }
        let (tx, ty) = scene.truth.pixel;
        for d in 0..20 { put(((tx + 250.0 + 12.0) * z as f64) as usize + d, (ty * z as f64) as usize, [0, 128, 255]); }
        if let Ok(f) = find { for d in 0..20 { put(((f.x + 250.0 - 12.0) * z as f32) as usize - d, (f.y * z as f32) as usize, [255, 0, 255]); } }
    }
    let file = std::io::BufWriter::new(std::fs::File::create(&a[4]).unwrap());
    let mut png = png::Encoder::new(file, (w * cols) as u32, (h * rowsn) as u32);
    png.set_color(png::ColorType::Rgb);
    png.write_header().unwrap().write_image_data(&out).unwrap();
}
