use super::*;
use crate::geometry::rotation::{length, log, product, rot_x, rot_y};
use crate::job::mount::tests::MOUNT;
use crate::job::path::Place;
use crate::job::seal::StartPose;
use proptest::prelude::*;

pub const SHEET: f32 = 0.0006;

fn um(v: Vector3<f32>) -> [i16; 3] {
    [v.x, v.y, v.z].map(|m| (m * 1e6).round() as i16)
}

/// What an exact camera at `t_b_s` says of the corner of a part at `frame`.
pub fn grey(frame: &Pose, t_b_s: &Pose) -> Sighting {
    let to_s = t_b_s.inverse() * *frame;
    let on_ground = |along: f32| {
        let p = to_s * Vector3::new(along, 0.0, SHEET);
        p * (0.150 / (0.150 - p.z))
    };
    let (corner, ahead) = (on_ground(0.0), on_ground(0.010));
    Sighting {
        look: Look::StartGrey,
        point_um: um(Vector3::new(corner.x, corner.y, 0.0)),
        angle_e4: (1e4 * (ahead.y - corner.y).atan2(ahead.x - corner.x)).round() as i16,
        quality: 255,
        ..Sighting::default()
    }
}

/// What an exact slit says there, or `None` where it misses the seam.
pub fn slit(frame: &Pose, t_b_s: &Pose) -> Option<Sighting> {
    let to_s = t_b_s.inverse() * *frame;
    let before = |p: Vector3<f32>| p.x + p.z; // the slit plane is x = −z
    let edge = |along: f32| to_s * Vector3::new(along, 0.0, SHEET);
    let along = before(edge(0.0)) / (before(edge(0.0)) - before(edge(1.0)));
    let foot = to_s * Vector3::new(along, 0.0, 0.0);
    // Two points of the lower sheet in the slit's light, and where they appear.
    let pixel = |left: f32| {
        let at = |along: f32| to_s * Vector3::new(along, left, 0.0);
        let along = before(at(0.0)) / (before(at(0.0)) - before(at(1.0)));
        let p = at(along);
        p * (0.150 / (0.150 - p.z))
    };
    let (left, right) = (pixel(0.010), pixel(-0.010));
    (along > 0.0).then(|| Sighting {
        look: Look::StartSlit,
        point_um: um(foot),
        angle_e4: (1e4 * (-(left.x - right.x) / (left.y - right.y)).atan()).round() as i16,
        ..Sighting::default()
    })
}

fn ahead(t_b_s: &Pose, by: f32) -> Pose {
    Pose {
        p: t_b_s.p + t_b_s.r.column(0) * by,
        ..*t_b_s
    }
}

fn looks(frame: &Pose, t_b_s: &Pose, advances: &[f32]) -> StartLooks {
    let mut looks = StartLooks::new();
    looks.take(&grey(frame, t_b_s), &MOUNT, t_b_s).unwrap();
    for &by in advances {
        let t_b_s = ahead(t_b_s, by);
        looks.take(&slit(frame, &t_b_s).unwrap(), &MOUNT, &t_b_s).unwrap();
    }
    looks
}

fn part(shift: [f32; 3], tilt: [f32; 3]) -> (Pose, Pose) {
    let sensor = Pose {
        r: rot_y(0.35) * rot_z(-1.57),
        p: Vector3::new(0.55, 0.2, 0.1),
    };
    let off = Pose {
        r: rot_x(tilt[0]) * rot_y(tilt[1]) * rot_z(tilt[2]),
        p: Vector3::from(shift),
    };
    (sensor * off, sensor)
}

fn apart(a: &Pose, b: &Pose) -> (f32, f32) {
    (length(&(a.p - b.p)), length(&log(&product(&a.r, &b.r.transpose()))))
}

proptest! {
    #[test]
    fn a_part_within_20_mm_and_5_degrees_is_found_exactly(
        shift in prop::array::uniform3(-0.020f32..0.020), tilt in prop::array::uniform3(-0.087f32..0.087),
    ) {
        let (frame, sensor) = part(shift, tilt);
        let found = looks(&frame, &sensor, &[0.050, 0.075]).frame(&MOUNT, SHEET).unwrap();
        let (shift, turn) = apart(&found.pose, &frame);
        // A sighting is rounded to 1 µm and 0.1 mrad: the corner lies up to 70 mm outside the sections, whose pitch is off by 1 µm in 25 mm.
        prop_assert!(shift < 12e-6 && turn < 1.5e-4, "{shift} m, {turn} rad");
    }

    #[test]
    fn measured_again_from_near_by_it_is_found_to_the_bus_resolution(
        shift in prop::array::uniform3(-0.001f32..0.001), tilt in prop::array::uniform3(-0.01f32..0.01),
    ) {
        let (frame, sensor) = part(shift, tilt);
        let found = looks(&frame, &sensor, &[0.005, 0.020, 0.035]).frame(&MOUNT, SHEET).unwrap();
        let (shift, turn) = apart(&found.pose, &frame);
        prop_assert!(shift < 3e-6 && turn < 1.2e-4, "{shift} m, {turn} rad");
    }

    #[test]
    fn six_numbers_of_a_motion_give_the_motion_back(
        shift in prop::array::uniform3(-0.020f32..0.020), tilt in prop::array::uniform3(-0.3f32..0.3),
    ) {
        let (frame, taught) = part(shift, tilt);
        let motion = frame * taught.inverse();
        let back = StartPose::of_motion(&motion, &taught).motion(&taught);
        let (shift, turn) = apart(&back, &motion);
        prop_assert!(shift < 1e-6 && turn < 2e-6, "{shift} m, {turn} rad");
    }
}

#[test]
fn the_motion_takes_the_taught_corner_to_the_measured_one() {
    let (frame, sensor) = part([0.004, -0.006, 0.002], [0.02, -0.03, 0.05]);
    let found = looks(&frame, &sensor, &[0.010, 0.030]).frame(&MOUNT, SHEET).unwrap();
    let place = Place {
        point: sensor.p,
        tangent: sensor.r.column(0).into(),
        normal: sensor.r.column(2).into(),
        heading: sensor.r.column(1).into(),
    };
    let motion = found.motion(&place);
    let (shift, turn) = apart(&(motion * sensor), &frame);
    assert!(shift < 5e-6 && turn < 2e-4, "{shift} m, {turn} rad");
}

#[test]
fn what_is_missing_or_contradicts_itself_is_refused_by_its_number() {
    let (frame, sensor) = part([0.001, -0.001, 0.001], [0.0; 3]);
    let good = looks(&frame, &sensor, &[0.005, 0.020]);
    let mut changed = good.clone();
    changed.grey = None;
    assert_eq!(changed.frame(&MOUNT, SHEET), Err(StartRefusal::Incomplete));
    let near = looks(&frame, &sensor, &[0.005, 0.011]);
    assert_eq!(near.frame(&MOUNT, SHEET), Err(StartRefusal::TooNear));
    // A seam point half a millimetre beside the seam.
    let mut changed = good.clone();
    changed.sections[0].point += frame.r.column(1) * 0.0005;
    assert_eq!(changed.frame(&MOUNT, SHEET), Err(StartRefusal::OffSeam));
    // A section that leans 8° against the other.
    let mut changed = good.clone();
    changed.sections[1].across += frame.r.column(2) * 0.14;
    assert_eq!(changed.frame(&MOUNT, SHEET), Err(StartRefusal::Uneven));
    // A ghost: the line of a third section lies 2 mm too high.
    let mut changed = looks(&frame, &sensor, &[0.005, 0.020, 0.035]);
    changed.sections[1].point += frame.r.column(2) * 0.002;
    assert_eq!(changed.frame(&MOUNT, SHEET), Err(StartRefusal::Uneven));
    let mut changed = good.clone();
    changed.sections[1].point.x = f32::NAN;
    assert!(changed.frame(&MOUNT, SHEET).is_err());
    let refused = Sighting {
        look: Look::StartGrey,
        refusal: 3,
        ..Sighting::default()
    };
    assert_eq!(changed.take(&refused, &MOUNT, &sensor), Err(StartRefusal::Unseen));
    let more = slit(&frame, &ahead(&sensor, 0.030)).unwrap();
    let mut full = looks(&frame, &sensor, &[0.005, 0.010, 0.015, 0.020]);
    assert_eq!(full.take(&more, &MOUNT, &sensor), Err(StartRefusal::TooMany));
}

#[test]
fn two_measurements_agree_within_the_accuracy_asked_for_and_no_further() {
    let (frame, sensor) = part([0.0; 3], [0.0; 3]);
    let one = looks(&frame, &sensor, &[0.005, 0.020]).frame(&MOUNT, SHEET).unwrap();
    let moved = |shift: f32, turn: f32| StartFrame {
        variance: one.variance,
        pose: Pose {
            r: product(&rot_x(turn), &one.pose.r),
            p: one.pose.p + Vector3::new(0.0, shift, 0.0),
        },
    };
    assert!(one.agrees(&moved(1.4e-4, 0.0)) && one.agrees(&moved(0.0, 0.005)));
    assert!(!one.agrees(&moved(1.6e-4, 0.0)) && !one.agrees(&moved(0.0, 0.0055)));
}

/// The paper's formulas, as corrected in sealing.md: (5.10)–(5.13), with the height of the slit's point for the corner's, (5.14), (5.15). In
/// Σ_S as this code has it (z toward the camera, y left) instead of the paper's (z into the work, y down): z, y, θ_y and θ_z change sign.
#[test]
fn the_papers_formulas_agree_for_small_deviations_and_are_off_by_what_is_known_for_larger() {
    let printed = |shift: [f32; 3], tilt: [f32; 3]| {
        let (frame, sensor) = part(shift, tilt);
        let corner = grey(&frame, &sensor).point();
        let section = |by: f32| slit(&frame, &ahead(&sensor, by)).unwrap();
        let (near, far) = (section(0.008), section(0.028));
        let (p, q) = (near.point(), far.point());
        let s = 0.020;
        let along = q[0] + s - p[0];
        let roll = near.angle().tan().atan();
        let pitch = -((q[2] - p[2]) / along).atan();
        let yaw = ((q[1] - p[1]) / along).atan();
        ([corner[0], corner[1], p[2]], [roll, pitch, yaw])
    };
    let off = |shift: [f32; 3], tilt: [f32; 3]| {
        let (p, r) = printed(shift, tilt);
        let most = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).fold(0.0_f32, |m, (a, b)| m.max((a - b).abs()));
        (most(p, shift), most(r, tilt))
    };
    let (shift, turn) = off([0.0005, -0.0005, 0.0002], [0.002, -0.003, 0.003]);
    assert!(shift < 6e-5 && turn < 2e-4, "{shift} m, {turn} rad");
    // 2 mm of height and 3° of pitch: the height is the slit point's, 8 mm on, not the corner's.
    let (shift, _) = off([0.0, 0.0, 0.002], [0.0, 0.052, 0.0]);
    assert!(shift > 0.25e-3, "{shift} m");
}
