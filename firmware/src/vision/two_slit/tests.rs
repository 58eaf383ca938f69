use super::*;
extern crate std;
use crate::geometry::rotation::{rot_x, rot_y, rot_z};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

const BEND: Joint = Joint::Vee { flank: 0.27 };

/// What an ideal sensor finds of a seam at `pose`: by intersecting line and plane with the slit planes in f64.
fn ideal(pose: [f32; 5]) -> [Find; 2] {
    let [d_y, d_z, x, y, z] = pose;
    let r: Matrix3<f64> = (rot_x(x) * rot_y(y) * rot_z(z)).map(f64::from);
    let origin = Vector3::new(0.0, f64::from(d_y), f64::from(d_z));
    Pinhole::TWO_SLITS.map(|slit| {
        let (c, h) = (f64::from(slit.slit_offset_m), f64::from(slit.height_m));
        // The slit plane is x + z = c.
        let level = |v: &Vector3<f64>| v.x + v.z;
        let (t, b) = (r.column(0).into_owned(), r.column(1).into_owned());
        let point = origin + t * ((c - level(&origin)) / level(&t));
        let line = b - t * (level(&b) / level(&t));
        let pixel = |p: Vector3<f64>| {
            let scale = h / (h - p.z) / 0.000_125;
            (199.5 + p.x * scale, 119.5 - p.y * scale)
        };
        let ((x0, y0), (x1, y1)) = (pixel(point - line * 1e-4), pixel(point + line * 1e-4));
        let (x, y) = pixel(point);
        Find {
            x: x as f32,
            y: y as f32,
            edge_x: x as f32,
            slope: ((x1 - x0) / (y1 - y0)) as f32,
            sigma: 1.0,
            evidence: 20.0,
            quality: 200,
        }
    })
}

proptest! {
    #[test]
    fn any_pose_within_reach_is_recovered_through_the_pinhole(
        d_y in -0.005_f32..0.005, d_z in -0.010_f32..0.010,
        x in -0.10_f32..0.10, y in -0.10_f32..0.10, z in -0.4_f32..0.4,
    ) {
        let sensor = TwoSlitSensor::new(Pinhole::TWO_SLITS, BEND);
        let found = sensor.pose(&ideal([d_y, d_z, x, y, z])).unwrap().value;
        let off: std::vec::Vec<f32> = found.iter().zip([d_y, d_z, x, y, z]).map(|(a, b)| (a - b).abs()).collect();
        prop_assert!(off[0] < 5e-7 && off[1] < 5e-7, "{:?} m", off);
        // The slopes are rounded to f32 pixels over short lines.
        prop_assert!(off[2] < 2e-4 && off[3] < 2e-5 && off[4] < 2e-5, "{:?} rad", off);
    }
}

/// Standard normal deviates: the sum of twelve uniform numbers, less six.
struct Normal(u64);

impl Normal {
    fn draw(&mut self) -> f32 {
        let uniform = || {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / 16_777_216.0
        };
        core::iter::repeat_with(uniform).take(12).sum::<f32>() - 6.0
    }
}

#[test]
fn the_covariance_is_that_of_many_noisy_poses() {
    let sensor = TwoSlitSensor::new(Pinhole::TWO_SLITS, BEND);
    let finds = ideal([0.002, -0.003, 0.03, -0.04, 0.2]);
    let stated = sensor.pose(&finds).unwrap();
    let mut normal = Normal(7);
    let mut sum = SMatrix::<f64, 5, 5>::zeros();
    const DRAWS: usize = 20_000;
    for _ in 0..DRAWS {
        let mut noisy = finds;
        for find in &mut noisy {
            for quantity in [Quantity::Row, Quantity::Column, Quantity::Slope] {
                let by = quantity.sigma(find) * normal.draw();
                quantity.shift(find, by);
            }
        }
        let value = sensor.pose(&noisy).unwrap().value;
        let error = (SVector::from(value) - SVector::from(stated.value)).map(f64::from);
        sum += error * error.transpose();
    }
    let measured = sum / DRAWS as f64;
    let deviation = |i: usize| measured[(i, i)].sqrt();
    for i in 0..5 {
        for j in 0..=i {
            let off = (f64::from(stated.covariance[(i, j)]) - measured[(i, j)]) / (deviation(i) * deviation(j));
            assert!(off.abs() < 0.04, "element {i}, {j}: {off} of its deviations");
        }
    }
    // Pitch is by far the worst channel, as the spec finds: sqrt(2)·σ·ζ·cot φ / l_CD.
    assert!(deviation(3) > 0.5 * 1.414 * 0.25 * 0.000_125 / 0.021_25);
}

#[test]
fn lines_in_the_wrong_order_are_no_seam() {
    let sensor = TwoSlitSensor::new(Pinhole::TWO_SLITS, BEND);
    let [near, ahead] = ideal([0.0; 5]);
    assert_eq!(sensor.pose(&[ahead, near]), None);
}

/// Both slits' light on a level lip under a seam straight ahead, the sheet above row 120 of the image and dark in rows `dropped` of the nearer
/// slit's light.
fn lip(dropped: core::ops::Range<usize>) -> std::vec::Vec<u8> {
    let mut pixels: std::vec::Vec<u8> = (0..400 * 240).map(|at| 20 + (at * 7 % 5 % 3) as u8).collect();
    for (y, row) in pixels.chunks_exact_mut(400).enumerate() {
        for (slit, x) in [114.0, 284.0].into_iter().enumerate() {
            if slit == 0 && dropped.contains(&y) {
                continue;
            }
            // 3 mm lower, and 1 mm further away: 24 and 8 px, a fiftieth less from afar.
            let x = match y {
                0..120 => x,
                128.. => x + 23.5,
                _ => continue,
            } as usize;
            row[x - 3..=x + 3].fill(100);
        }
    }
    pixels
}

#[test]
fn a_seam_that_seems_to_rise_steeply_from_slit_to_slit_is_doubtful() {
    let joint = Joint::Crank {
        upper_left: true,
        sheet_m: 0.0006,
    };
    let sure = |ahead: usize| {
        let mut pixels: std::vec::Vec<u8> = (0..400 * 240).map(|at| 20 + (at * 7 % 5 % 3) as u8).collect();
        for (y, row) in pixels.chunks_exact_mut(400).enumerate() {
            for x in [114, ahead] {
                let x = if y < 120 { x } else { x + 6 };
                row[x - 3..=x + 3].fill(100);
            }
        }
        let view = View::new(&pixels, 400, 240).unwrap();
        TwoSlitSensor::new(Pinhole::TWO_SLITS, joint)
            .sight(&view)
            .map(|sighting| (sighting.refusal, sighting.is_sure()))
    };
    assert_eq!(sure(284), [(0, true); 2]);
    // 3.6 mm higher, over 21 mm.
    assert_eq!(sure(256), [(0, false); 2]);
}

#[test]
fn a_drop_out_beside_a_gap_is_told_from_it_by_the_other_slit() {
    let joint = Joint::Lip {
        sheet_left: true,
        drop_m: 0.003,
        gap_m: 0.001,
    };
    let pixels = lip(114..120);
    let view = View::new(&pixels, 400, 240).unwrap();
    let alone = SeamSensor::new(Pinhole::TWO_SLITS[0], joint)
        .find(&view.columns(30, 168))
        .unwrap();
    let [near, ahead] = TwoSlitSensor::new(Pinhole::TWO_SLITS, joint)
        .find(&view)
        .map(Result::unwrap);
    assert!((alone.y - 113.5).abs() < 2.0, "row {} alone", alone.y);
    assert!((near.y - 119.0).abs() < 3.0, "row {} of 119.0", near.y);
    assert!((ahead.y - 119.0).abs() < 1.0, "row {} of 119.0", ahead.y);
}
