//! The paper's small-angle formulas, as corrected and as printed, with the errors that sealing.md states for them.

use super::*;
extern crate std;
use nalgebra::{Matrix3, Rotation3, Vector3};

const L_CD: f64 = 0.021_25;

/// Uniform numbers in −1..=1.
struct Uniform(u64);

impl Uniform {
    fn draw(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// d_y, d_z (m), θ_x, θ_y, θ_z (rad), Rot(x)·Rot(y)·Rot(z).
type Numbers = [f64; 5];

/// What a slit shows, as chapter 3 has it: image coordinates on the plane z = 0 (m, y up) and the angle α of its line from the image's
/// x axis.
#[derive(Clone, Copy)]
struct Shown {
    x: f64,
    y: f64,
    alpha: f64,
}

/// The two cuts of a seam with φ = 45°, the paper's order: slit 1 at +l_CD/2, then slit 2. `h_z` infinite is the orthographic camera.
fn shown(numbers: Numbers, h_z: f64) -> [(Shown, Cut); 2] {
    let [d_y, d_z, x, y, z] = numbers;
    let turn = |axis, angle| Rotation3::from_axis_angle(&axis, angle).into_inner();
    let r: Matrix3<f64> = turn(Vector3::x_axis(), x) * turn(Vector3::y_axis(), y) * turn(Vector3::z_axis(), z);
    let (t, b) = (r.column(0).into_owned(), r.column(1).into_owned());
    let origin = Vector3::new(0.0, d_y, d_z);
    [0.5 * L_CD, -0.5 * L_CD].map(|c| {
        let point = origin + t * ((c - origin.x - origin.z) / (t.x + t.z));
        let line = b - t * ((b.x + b.z) / (t.x + t.z));
        let image = |p: Vector3<f64>| (p.x / (1.0 - p.z / h_z), p.y / (1.0 - p.z / h_z));
        let ((x0, y0), (x1, y1)) = (image(point - line * 1e-6), image(point + line * 1e-6));
        let (x, y) = image(point);
        let cut = Cut {
            point: point.map(|v| v as f32),
            direction: line.map(|v| v as f32),
        };
        (
            Shown {
                x,
                y,
                alpha: (y1 - y0).atan2(x1 - x0),
            },
            cut,
        )
    })
}

/// (3.20)–(3.28) as corrected.
fn corrected([one, two]: [Shown; 2]) -> Numbers {
    // (3.10) with the slit's own offset; y as the image shows it.
    let point = |shown: Shown, c: f64| Vector3::new(shown.x, shown.y, c - shown.x);
    let p21 = point(one, 0.5 * L_CD) - point(two, -0.5 * L_CD);
    let quarter = std::f64::consts::FRAC_PI_2;
    let theta_x = [one, two].map(|shown| -(shown.alpha.cos() / shown.alpha.sin()).atan());
    [
        0.5 * (one.y + two.y),
        -0.5 * (one.x + two.x),
        0.5 * (theta_x[0] + theta_x[1]),
        (p21.z / p21.norm()).acos() - quarter,
        quarter - (p21.y / p21.norm()).acos(),
    ]
}

/// The same as printed: d_y with the other sign, y and z exchanged in the angles, θ_y with the other sign.
fn printed(shown: [Shown; 2]) -> Numbers {
    let [d_y, d_z, x, y, z] = corrected(shown);
    [-d_y, d_z, x, z, -y]
}

/// Root mean square and largest error by component over random poses within ±`shift` (m) and ±`turn` (rad).
fn errors(shift: f64, turn: f64, h_z: f64, formulas: fn([Shown; 2]) -> Numbers) -> [(f64, f64); 5] {
    const POSES: usize = 4000;
    let mut uniform = Uniform(3);
    let mut errors = [(0.0_f64, 0.0_f64); 5];
    for _ in 0..POSES {
        let truth: Numbers = core::array::from_fn(|i| uniform.draw() * if i < 2 { shift } else { turn });
        let found = formulas(shown(truth, h_z).map(|(shown, _)| shown));
        for ((rms, most), (found, truth)) in errors.iter_mut().zip(found.iter().zip(truth)) {
            let error = (found - truth).abs();
            *rms += error * error / POSES as f64;
            *most = most.max(error);
        }
    }
    errors.map(|(square, most)| (square.sqrt(), most))
}

/// Equal to what the table says to its last digit, and a tenth for the luck of the draw.
fn about(value: f64, stated: f64) -> bool {
    (value / stated - 1.0).abs() < 0.1
}

#[test]
fn the_small_angle_formulas_err_as_the_spec_says() {
    for (mm, deg, [shift_rms, angle_rms], [shift_max, angle_max]) in [
        (1.0_f64, 1.0_f64, [0.006, 0.006], [0.018, 0.017]),
        (5.0, 3.0, [0.088, 0.052], [0.27, 0.16]),
        (10.0, 5.0, [0.30, 0.15], [0.93, 0.47]),
    ] {
        let error = errors(mm * 1e-3, deg.to_radians(), f64::INFINITY, corrected);
        let rms = |part: &[(f64, f64)]| (part.iter().map(|e| e.0 * e.0).sum::<f64>() / part.len() as f64).sqrt();
        let most = |part: &[(f64, f64)]| part.iter().map(|e| e.1).fold(0.0, f64::max);
        let (shift, angle) = error.split_at(2);
        for (what, value, stated) in [
            ("mm rms", rms(shift) * 1e3, shift_rms),
            ("mm", most(shift) * 1e3, shift_max),
            ("deg rms", rms(angle).to_degrees(), angle_rms),
            ("deg", most(angle).to_degrees(), angle_max),
        ] {
            assert!(about(value, stated), "±{mm} mm, ±{deg}°: {value} {what} for {stated}");
        }
    }
}

#[test]
fn as_printed_they_are_useless() {
    let error = errors(0.005, 3_f64.to_radians(), f64::INFINITY, printed);
    assert!(about(error[0].0, 0.0058), "d_y {} m rms", error[0].0);
    for angle in &error[3..] {
        assert!((2.2..2.8).contains(&angle.0.to_degrees()), "{} rad rms", angle.0);
    }
}

#[test]
fn an_orthographic_camera_reads_height_as_pitch() {
    for (h_z, stated) in [
        (0.100, [0.122, 0.150, 0.074, 1.63, 0.073]),
        (0.150, [0.104, 0.118, 0.062, 1.09, 0.062]),
        (0.300, [0.090, 0.096, 0.056, 0.55, 0.056]),
    ] {
        let error = errors(0.005, 3_f64.to_radians(), h_z, corrected);
        let units = [1e3, 1e3, 1_f64.to_degrees(), 1_f64.to_degrees(), 1_f64.to_degrees()];
        for ((error, unit), stated) in error.iter().zip(units).zip(stated) {
            assert!(
                about(error.0 * unit, stated),
                "{} for {stated} at {h_z} m",
                error.0 * unit
            );
        }
    }
}

#[test]
fn the_exact_pose_has_no_error() {
    let mut uniform = Uniform(5);
    for _ in 0..2000 {
        let truth: Numbers = core::array::from_fn(|i| uniform.draw() * if i < 2 { 0.010 } else { 0.09 });
        let [(_, ahead), (_, near)] = shown(truth, 0.150);
        let found = from_cuts(&near, &ahead).unwrap();
        for (found, truth) in found.iter().zip(truth) {
            assert!((f64::from(*found) - truth).abs() < 4e-7, "{found} for {truth}");
        }
    }
}
