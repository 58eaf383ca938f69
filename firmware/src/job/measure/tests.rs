use super::places::{aside, frame_of};
use super::*;
use crate::geometry::rotation::{length, log, rot_x, rot_z};
use crate::job::mount::tests::MOUNT;
use crate::job::path::tests::TRAVEL;
use crate::job::start_pose::tests::{SHEET, grey, slit};

/// Half of what the camera sees at the start, m.
const VIEW: f32 = 0.027;

fn path() -> TaughtPath {
    let straight = |s| ([0.4, 0.2 - s, 0.1], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]);
    TaughtPath::new(0.5, &TRAVEL, straight).unwrap()
}

fn motion(shift: [f32; 3]) -> Pose {
    Pose {
        r: rot_z(0.03) * rot_x(-0.05),
        p: Vector3::from(shift),
    }
}

/// Measures a part that lies moved by `motion` with a camera that sees exactly, but for what `spoil` makes of a sighting; where the part
/// was placed in the end, or why not, and how many cycles it took beyond the motions.
fn measure(sections: u8, part: &Pose, spoil: impl FnMut(&mut Sighting)) -> (Result<Pose, Fault>, u32) {
    measure_by(0, sections, part, spoil)
}

/// The same by a light that meets Σ_S's plane so far ahead of its origin, µm.
fn measure_by(
    light_um: i16,
    sections: u8,
    part: &Pose,
    mut spoil: impl FnMut(&mut Sighting),
) -> (Result<Pose, Fault>, u32) {
    let (path, params) = (
        path(),
        MeasureParams {
            start: true,
            edge_height: SHEET,
            bend: false,
            sections,
        },
    );
    let frame = *part * frame_of(&path, 0.0);
    let (mut measure, mut to_part, mut t_b_n) = (Measure::EMPTY, Pose::identity(), Pose::identity());
    let mut due = None;
    for cycle in 0..20_000_u32 {
        let count = (cycle % 240) as u8 + 1;
        match measure.next(&params, &path, &MOUNT, &mut to_part) {
            Ok(Next::Wait) => {}
            Ok(Next::Go(goal)) => t_b_n = goal,
            Ok(Next::Done) => return (Ok(to_part), cycle),
            Err(fault) => return (Err(fault), cycle),
        }
        if measure.exposure(count % 240 + 1) != 0 {
            due = Some((cycle + 4, measure.look()));
        }
        if let Some((_, look)) = due.filter(|(at, _)| *at == cycle) {
            let t_b_s = t_b_n * MOUNT.pose;
            let seen = if look == Look::StartGrey {
                Some(grey(&frame, &t_b_s))
            } else {
                let seen = slit(&frame, &aside(&t_b_s, [1e-6 * f32::from(light_um), 0.0, 0.0]));
                seen.map(|mut sighting| {
                    sighting.point_um[0] += light_um;
                    sighting
                })
            };
            let inside = |s: &Sighting| s.point().iter().all(|m| m.abs() < VIEW);
            let mut sighting = seen.filter(inside).unwrap_or(Sighting {
                look,
                refusal: 1,
                ..Sighting::default()
            });
            spoil(&mut sighting);
            measure.take(&params, &path, &MOUNT, &mut to_part, &sighting, &t_b_n);
        }
    }
    panic!("no end")
}

/// How far apart two motions put the path's start and end, m, and turn it, rad.
fn apart(a: &Pose, b: &Pose) -> (f32, f32) {
    let path = path();
    let off = |s| length(&(*a * path.place(s).point - *b * path.place(s).point));
    (off(0.0).max(off(0.5)), length(&log(&(a.r * b.r.transpose()))))
}

#[test]
fn a_part_20_mm_and_3_degrees_off_is_placed_where_it_lies() {
    for (sections, at_most) in [(0, 0.3e-3), (8, 0.05e-3)] {
        let part = motion([0.018, -0.019, 0.017]);
        let (placed, cycles) = measure(sections, &part, |_| {});
        let (off, turned) = apart(&placed.unwrap(), &part);
        // Of the start alone, the bus resolution over 20 mm is carried 500 mm on.
        assert!(
            off < at_most && turned < 1e-3,
            "{sections} sections: {off} m, {turned} rad"
        );
        assert!(cycles < 700, "{cycles} cycles at rest");
    }
}

#[test]
fn a_start_out_of_view_is_searched_for_and_one_too_far_away_is_refused() {
    let part = motion([0.015, 0.045, 0.0]);
    let (off, _) = apart(&measure(8, &part, |_| {}).0.unwrap(), &part);
    assert!(off < 0.05e-3, "{off} m");
    let (placed, _) = measure(8, &motion([0.0, 0.15, 0.0]), |_| {});
    assert_eq!(placed, Err(Fault::StartNotFound));
}

#[test]
fn a_look_that_is_lost_is_taken_again() {
    let mut looks = 0;
    let part = motion([0.0; 3]);
    let (placed, _) = measure(8, &part, |sighting| {
        looks += 1;
        if looks % 2 != 0 {
            *sighting = Sighting {
                look: sighting.look,
                refusal: 1,
                ..Sighting::default()
            };
        }
    });
    let (off, _) = apart(&placed.unwrap(), &part);
    assert!(off < 0.05e-3, "{off} m");
}

#[test]
fn on_a_wavy_sheet_whose_every_other_view_repeats_itself_the_start_is_between() {
    let (mut view, mut section) = (0, 0);
    let part = motion([0.0; 3]);
    let (placed, _) = measure(8, &part, |sighting| {
        if sighting.look == Look::StartGrey {
            (view, section) = (view + 1, 0);
        } else if view > 0 && section < SLITS {
            // The sections of every other view lie in a sheet that is pitched by 0.4°.
            let pitched = section as i16 * if view % 2 == 0 { 84 } else { 0 };
            sighting.point_um[2] += pitched;
            section += 1;
        }
    });
    let (off, _) = apart(&placed.unwrap(), &part);
    assert!(view >= 3 && off < 0.1e-3, "{off} m after {view} views");
}

#[test]
fn a_start_20_mm_too_high_or_too_low_is_found() {
    for height in [0.020, -0.020] {
        let part = motion([-0.019, 0.018, height]);
        let (off, _) = apart(&measure(8, &part, |_| {}).0.unwrap(), &part);
        assert!(off < 0.05e-3, "{off} m at {height} m");
    }
}

#[test]
fn a_corner_is_refused_that_lies_behind_a_section_or_far_before_the_first() {
    // A section was seen 16 mm behind the start.
    for along_um in [20_000, -8000] {
        let (placed, _) = measure(8, &Pose::identity(), |sighting| {
            if sighting.look == Look::StartGrey {
                match sighting.point_um[0].checked_add(along_um) {
                    Some(moved) => sighting.point_um[0] = moved,
                    None => sighting.refusal = 1,
                }
            }
        });
        assert!(
            matches!(placed, Err(Fault::StartDoubtful | Fault::StartNotFound)),
            "{along_um} µm: {placed:?}"
        );
    }
}

#[test]
fn views_that_contradict_each_other_are_refused() {
    let mut looks = 0;
    let (placed, _) = measure(8, &motion([0.0; 3]), |sighting| {
        looks += 1;
        if sighting.look == Look::StartGrey {
            sighting.point_um[0] += if looks % 2 == 0 { 400 } else { -400 };
        }
    });
    assert_eq!(placed, Err(Fault::StartDoubtful));
}

#[test]
fn a_corner_near_the_real_one_that_both_views_agree_on_is_refused_by_the_sections_next_to_it() {
    // The seam is lit 1.2 mm before the one, and not 1.2 mm behind the other.
    for along_um in [3000, -2000] {
        let (placed, _) = measure(8, &Pose::identity(), |sighting| {
            if sighting.look == Look::StartGrey && sighting.refusal == 0 {
                sighting.point_um[0] += along_um;
            }
        });
        assert!(
            matches!(placed, Err(Fault::StartDoubtful | Fault::StartNotFound)),
            "{along_um} µm: {placed:?}"
        );
    }
}

#[test]
fn after_ten_views_that_contradict_their_sections_no_other_is_taken() {
    let mut views = 0;
    let (placed, _) = measure(8, &Pose::identity(), |sighting| {
        // From wherever it is looked for, a seam 2 mm beside the real one begins 20 mm ahead.
        if sighting.look == Look::StartGrey {
            views += 1;
            *sighting = Sighting {
                look: sighting.look,
                point_um: [20_000, 2000, 0],
                ..Sighting::default()
            };
        }
    });
    assert_eq!((placed, views), (Err(Fault::StartDoubtful), i32::from(VIEWS)));
}

#[test]
fn by_a_light_that_is_mounted_2_mm_off_the_start_is_proven_all_the_same() {
    for light_um in [2000, -2000] {
        let (placed, _) = measure_by(light_um, 8, &Pose::identity(), |_| {});
        let (off, _) = apart(&placed.unwrap(), &Pose::identity());
        assert!(off < 0.1e-3, "{off} m by a light {light_um} µm off");
    }
}

#[test]
fn where_the_images_before_the_start_are_lost_nothing_is_proven_and_it_is_viewed_again() {
    let part = motion([0.004, -0.006, 0.003]);
    let views = |lost: u32| {
        let (mut greys, mut spoilt) = (0, 0);
        let (placed, _) = measure(2, &part, |sighting| {
            greys += u32::from(sighting.look == Look::StartGrey && sighting.refusal == 0);
            // Once the part is placed only the section before the start shows no seam.
            if greys >= 2 && sighting.refusal != 0 && spoilt < lost {
                sighting.refusal = NO_IMAGE;
                spoilt += 1;
            }
        });
        assert_eq!(spoilt, lost);
        assert!(apart(&placed.unwrap(), &part).0 < 1e-4);
        greys
    };
    assert_eq!((views(0), views(1), views(2)), (2, 2, 4));
}

#[test]
fn a_start_that_its_images_hardly_know_is_looked_at_again_and_then_refused() {
    let part = motion([0.004, -0.006, 0.003]);
    let measured = |spoil: fn(&mut Sighting)| {
        let mut views = 0;
        let (placed, _) = measure(2, &part, |sighting| {
            if sighting.look == Look::StartGrey && sighting.refusal == 0 {
                views += 1;
                spoil(sighting);
            }
        });
        (placed.is_ok(), views)
    };
    assert_eq!(measured(|_| {}), (true, 2));
    // The end to 0.08 mm: no further view says more of it than the edge does.
    assert_eq!(measured(|grey| grey.sigma_um = 55), (false, i32::from(VIEWS)));
    // The seam's direction to 0.2°: sections tell it, the more views the better.
    let (found, views) = measured(|grey| grey.quality = 60);
    assert!(found && (3..7).contains(&views), "{found} after {views} views");
}
