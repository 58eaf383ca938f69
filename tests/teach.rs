//! Teaching, host in the loop: the controller drives along seams that nobody has shown it, and what it taught is played.

use sim_host::campaign::Company;
use sim_host::model::Model;
use sim_host::seal;
use sim_host::seal::scenario::{JointName, Options, PathName};
use sim_host::taught::TaughtSeam;
use sim_host::teach::campaign::{self, Campaign, CampaignResult};
use sim_host::teach::scenario::{LawName, TeachOptions};
use sim_host::teach::trial;

fn teach(cell: Options, law: LawName, seed: u64, trials: usize) -> CampaignResult {
    let campaign = Campaign {
        options: TeachOptions { cell, law },
        seed,
        trials,
    };
    campaign::run(&campaign, &Model::k3s(), None).expect("the trials run")
}

fn cell(path: PathName, speed: f64) -> Options {
    Options {
        path,
        speed,
        ..TeachOptions::default().cell
    }
}

#[test]
fn unknown_panels_are_taught_within_the_bars() {
    let score = teach(cell(PathName::Panel, 0.1), LawName::Lead, 3000, 6).score;
    assert!(score.tally.all_succeeded(), "{score:#?}");
    let score = teach(cell(PathName::Panel, 0.2), LawName::Lead, 3100, 6).score;
    assert!(score.tally.all_succeeded(), "{score:#?}");
}

#[test]
fn bends_lips_and_lap_joints_of_either_hand_are_taught_within_the_bars() {
    for joint in [
        JointName::Vee,
        JointName::Lip,
        JointName::LipRight,
        JointName::CrankRight,
    ] {
        let bent = Options {
            joint,
            ..cell(PathName::Arc, 0.1)
        };
        let score = teach(bent, LawName::Lead, 3150, 2).score;
        assert!(score.tally.all_succeeded(), "{score:#?}");
    }
}

#[test]
fn a_taught_panel_is_sealed_on_other_parts_that_lie_elsewhere() {
    // The master is as bent as the others.
    let taught = teach(cell(PathName::Panel, 0.1), LawName::Lead, 3200, 1)
        .taught
        .unwrap();
    // Through its file, as a person would have it.
    let seam = TaughtSeam::from_toml(&taught.to_toml("a test's")).unwrap();
    let campaign = seal::campaign::Campaign {
        options: Options {
            taught: Some(Box::leak(Box::new(seam))),
            ..Options::default()
        },
        seed: 3300,
        trials: 4,
    };
    let score = seal::campaign::run(&campaign, &Model::k3s(), None).unwrap().score;
    assert!(score.passed(), "{score:#?}");
}

#[test]
fn a_corner_of_90_degrees_is_looked_round_taught_and_sealed_on_another_part() {
    let CampaignResult { score, taught, .. } = teach(cell(PathName::Corner, 0.1), LawName::Lead, 3220, 2);
    assert!(score.tally.all_succeeded(), "{score:#?}");
    let campaign = seal::campaign::Campaign {
        options: Options {
            path: PathName::Corner,
            taught: taught.map(|seam| &*Box::leak(Box::new(seam))),
            ..Options::default()
        },
        seed: 3320,
        trials: 2,
    };
    let score = seal::campaign::run(&campaign, &Model::k3s(), None).unwrap().score;
    assert!(score.passed(), "{score:#?}");
}

#[test]
fn looking_round_a_corner_of_a_bend_the_nozzle_stays_out_of_the_flanks() {
    let bent = Options {
        joint: JointName::Vee,
        ..cell(PathName::Corner, 0.1)
    };
    let score = teach(bent, LawName::Lead, 3240, 1).score;
    assert!(score.tally.all_succeeded(), "{score:#?}");
    // It is over a flank of 60 mm, and that is how high it is to be everywhere.
    assert!(score.tally.clearance_min_mm.is_some_and(|mm| mm > 2.0), "{score:#?}");
    let campaign = seal::campaign::Campaign {
        options: Options {
            path: PathName::Corner,
            joint: JointName::Vee,
            ..Options::default()
        },
        seed: 3340,
        trials: 1,
    };
    let score = seal::campaign::run(&campaign, &Model::k3s(), None).unwrap().score;
    assert!(score.passed(), "{score:#?}");
    assert!(score.tally.clearance_min_mm.is_some_and(|mm| mm > 2.0), "{score:#?}");
}

#[test]
fn an_arm_that_cannot_turn_the_sensor_about_a_corner_stops_and_says_so() {
    let k3s = include_str!("../sim_host/models/k3s.toml");
    let stiff = k3s.replace("range_deg = [-270.0, 270.0]", "range_deg = [0.0, 140.0]");
    let model = Model::parse(&stiff).expect("but for one range it is the K3S");
    let campaign = Campaign {
        options: TeachOptions {
            cell: cell(PathName::Corner, 0.1),
            law: LawName::Lead,
        },
        seed: 3230,
        trials: 1,
    };
    let score = campaign::run(&campaign, &model, None).expect("the trial runs").score;
    let [failure] = &score.tally.failures[..] else {
        panic!("{score:#?}")
    };
    assert!(failure.reason.contains("the arm cannot turn the sensor"), "{failure:?}");
    assert_eq!(score.seam_lost, 1);
}

#[test]
fn the_papers_loop_teaches_an_arc_at_its_limit_and_loses_it_at_0_2_m_per_s() {
    let paper = |speed| Options {
        vision_period: 20,
        ..cell(PathName::Arc, speed)
    };
    let score = teach(paper(0.04), LawName::Paper, 3400, 1).score;
    assert!(score.tally.all_succeeded(), "{score:#?}");
    let score = teach(paper(0.2), LawName::Paper, 3400, 1).score;
    assert_eq!(score.seam_lost, 1, "{score:#?}");
}

#[test]
fn the_papers_loop_stops_at_a_corner_and_says_that_the_seam_is_lost() {
    let paper = Options {
        vision_period: 20,
        ..cell(PathName::Corner, 0.04)
    };
    let score = teach(paper, LawName::Paper, 3410, 1).score;
    let [failure] = &score.tally.failures[..] else {
        panic!("{score:#?}")
    };
    assert!(
        failure.reason.contains("the seam was lost before its end"),
        "{failure:?}"
    );
    assert_eq!(score.seam_lost, 1);
}

#[test]
fn a_seam_that_is_no_longer_seen_stops_the_arm_and_is_said_to_be_lost() {
    let options = TeachOptions {
        cell: cell(PathName::Straight, 0.1),
        law: LawName::Lead,
    };
    let company = Company {
        recording: None,
        progress: &|_| {},
        upset: &mut |_, station, cell| {
            // From here on no image comes.
            if station > 0.2 {
                cell.nodes.camera.lose_images(1.0);
            }
        },
    };
    let score = trial::run(&options, &Model::k3s(), 3500, company).unwrap().score;
    assert!(score.lost, "{score:?}");
    assert!(
        score
            .run
            .failure
            .is_some_and(|reason| reason.contains("the seam was lost before its end"))
    );
}
