//! Maps of simulated runs: robots that never met share a frame, look-alikes do not, and a person's word holds.

#![allow(clippy::unwrap_used)]

mod driven;

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use locution_engine::config::EngineConfig;
use locution_engine::geometry::wrap_angle;
use locution_engine::mapping::{
    Decision, MapStage, MapStep, MappingError, MatchState, RegistrationMemo, RejectionReason, RunRecord,
    SiteMap, Watch, map_site, map_site_watched,
};
use locution_lab::simulation::World;

use driven::{Driven, ring_world, world};

fn mapped(runs: &[&Driven], decisions: &[Decision], memo: &mut RegistrationMemo) -> SiteMap {
    let records: Vec<RunRecord<'_>> = runs.iter().map(|run| run.record()).collect();
    map_site(&EngineConfig::default().mapping, &records, decisions, memo).unwrap()
}

/// A corridor of the same width with other corners and other rooms.
fn other_world() -> World {
    world(&[
        (1.0, 1.0, 29.0, 3.0),
        (13.0, 1.0, 15.0, 19.0),
        (4.0, 3.0, 9.0, 5.0),
        (15.0, 9.0, 24.0, 13.0),
        (18.0, 3.0, 19.0, 6.0),
    ])
}

fn two_robots() -> (Driven, Driven) {
    let world = ring_world();
    let once_round = [(4.0, 2.0), (27.5, 2.0), (28.0, 18.0), (2.0, 18.0), (2.0, 2.0), (14.0, 2.0)];
    let other_way = [(25.0, 18.0), (28.0, 16.0), (28.0, 2.0), (2.0, 2.0), (2.0, 14.0)];
    (Driven::new(&world, &once_round, 3), Driven::new(&world, &other_way, 4))
}

#[test]
fn runs_of_different_areas_are_never_joined_whatever_they_see() {
    let (first, second) = two_robots();
    let in_areas = |areas: [Option<&'static str>; 2]| {
        let records = [&first, &second].map(Driven::record);
        let records: Vec<RunRecord<'_>> =
            records.into_iter().zip(areas).map(|(record, area)| RunRecord { area, ..record }).collect();
        let mut memo = RegistrationMemo::default();
        map_site(&EngineConfig::default().mapping, &records, &[], &mut memo).unwrap()
    };
    assert_eq!(in_areas([Some("first floor"), Some("second floor")]).num_components, 2);
    assert_eq!(in_areas([Some("first floor"), Some("first floor")]).num_components, 1);
    assert_eq!(in_areas([Some("first floor"), None]).num_components, 1);
}

#[test]
fn robots_that_never_met_share_a_frame_until_a_person_parts_them() {
    let (first, second) = two_robots();
    let runs = [&first, &second];
    let mut memo = RegistrationMemo::default();
    let map = mapped(&runs, &[], &mut memo);
    assert_eq!(map.num_components, 1);

    // Where the second robot is, seen from the beginning of the first, is where it truly was.
    let map_from_world = map.runs[0].map_from_keyframes[0].compose(&first.world_from(0).inverse());
    for (keyframe_idx, map_from_robot) in map.runs[1].map_from_keyframes.iter().enumerate() {
        let expected = map_from_world.compose(&second.world_from(keyframe_idx));
        assert!(map_from_robot.distance(&expected) < 0.3, "{map_from_robot:?} should be {expected:?}");
        assert!(wrap_angle(map_from_robot.theta - expected.theta).abs() < 0.05);
    }

    let across = |map: &SiteMap| {
        map.matches.iter().find(|found| found.earlier.run_idx != found.later.run_idx).cloned()
    };
    let found = across(&map).unwrap();
    assert_eq!(found.state, MatchState::Verified);
    let word = |is_same_place| Decision {
        earlier: found.earlier,
        later: found.later,
        direction: found.direction,
        is_same_place,
    };
    assert_eq!(mapped(&runs, &[word(false)], &mut memo).num_components, 2);
    let confirmed = mapped(&runs, &[word(false), word(true)], &mut memo);
    // Both words stand; the veto keeps the frames apart, the latest word settles the match where it is listed.
    assert!(across(&confirmed).is_none_or(|found| found.state == MatchState::Verified));
}

#[test]
fn a_veto_within_a_run_is_listed_as_such() {
    let (first, _) = two_robots();
    let mut memo = RegistrationMemo::default();
    let map = mapped(&[&first], &[], &mut memo);
    let found = map.matches.iter().find(|found| found.state == MatchState::Verified).unwrap().clone();
    let veto = Decision {
        earlier: found.earlier,
        later: found.later,
        direction: found.direction,
        is_same_place: false,
    };
    let again = mapped(&[&first], &[veto], &mut memo);
    let listed = again.matches.iter().filter(|other| {
        other.direction == found.direction
            && other.earlier.first <= found.earlier.last
            && found.earlier.first <= other.earlier.last
            && other.later.first <= found.later.last
            && found.later.first <= other.later.last
    });
    assert!(listed.clone().all(|other| other.state == MatchState::Rejected(RejectionReason::Vetoed)));
}

#[test]
fn the_order_of_the_runs_does_not_matter() {
    let (first, second) = two_robots();
    let one = mapped(&[&first, &second], &[], &mut RegistrationMemo::default());
    let other = mapped(&[&second, &first], &[], &mut RegistrationMemo::default());
    assert_eq!((one.num_components, other.num_components), (1, 1));
    // Each map stands in the frame of the run that was given first; apart from that they are the same.
    let one_from_other = one.runs[1].map_from_keyframes[0];
    for (pose, of_other) in one.runs[0].map_from_keyframes.iter().zip(&other.runs[1].map_from_keyframes) {
        assert!(pose.distance(&one_from_other.compose(of_other)) < 1e-6);
    }
    assert!(other.matches.iter().all(|found| found.earlier <= found.later));
}

#[test]
fn different_buildings_stay_apart() {
    let here = two_robots().0;
    let route = [(2.0, 2.0), (13.0, 2.0), (14.0, 17.0), (14.0, 3.0), (28.0, 2.0)];
    let there = Driven::new(&other_world(), &route, 5);
    let map = mapped(&[&here, &there], &[], &mut RegistrationMemo::default());
    assert_eq!(map.num_components, 2);
    assert!(map.matches.iter().all(|found| found.earlier.run_idx == found.later.run_idx));
}

#[test]
fn what_the_memo_holds_does_not_change_the_map() {
    let (first, second) = two_robots();
    let mut memo = RegistrationMemo::default();
    mapped(&[&second], &[], &mut memo);
    mapped(&[&first, &second], &[], &mut memo);
    let remembered = mapped(&[&first, &second], &[], &mut memo);
    assert_eq!(remembered, mapped(&[&first, &second], &[], &mut RegistrationMemo::default()));
    assert_eq!(mapped(&[], &[], &mut memo), SiteMap::default());
    let last = first.keyframes.last().unwrap();
    let trajectory = remembered.runs[0].trajectory(&first.keyframes);
    assert!(trajectory.at(last.scan_seq, &last.run_from_robot).is_some());
}

/// Ends the making of a map after some steps, several times with one memory; then lets it be made.
#[test]
fn a_map_that_was_ended_half_way_is_made_in_the_end_as_if_nothing_had_been() {
    let world = ring_world();
    let runs = [
        Driven::new(&world, &[(4.0, 2.0), (28.0, 2.0), (28.0, 18.0), (2.0, 18.0), (2.0, 3.0)], 3),
        Driven::new(&world, &[(28.0, 10.0), (28.0, 18.0), (2.0, 18.0), (2.0, 2.0), (20.0, 2.0)], 4),
    ];
    let records: Vec<RunRecord<'_>> = runs.iter().map(Driven::record).collect();
    let config = EngineConfig::default().mapping;
    let steps = Mutex::new(Vec::new());
    let told = |step: MapStep| {
        steps.lock().unwrap().push(step);
        ControlFlow::Continue(())
    };
    let watch = Watch::new(&told);
    let expected = map_site_watched(&config, &records, &[], &mut RegistrationMemo::default(), watch).unwrap();
    let steps = steps.into_inner().unwrap();
    assert!(steps.iter().all(|step| (0.0..=1.0).contains(&step.share)));
    assert!(MapStage::ALL.iter().all(|stage| steps.iter().any(|step| step.stage == *stage)));

    let mut memo = RegistrationMemo::default();
    for end in [0, steps.len() / 4, steps.len() / 2] {
        let num_steps = AtomicUsize::new(0);
        let stopping = |_| match num_steps.fetch_add(1, Ordering::Relaxed) >= end {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let ended = map_site_watched(&config, &records, &[], &mut memo, Watch::new(&stopping));
        assert_eq!(ended, Err(MappingError::Stopped));
        assert!(end == 0 || !memo.is_empty(), "what was registered is remembered");
        memo = postcard::from_bytes(&postcard::to_allocvec(&memo).unwrap()).unwrap();
    }
    assert_eq!(map_site(&config, &records, &[], &mut memo).unwrap(), expected);
}
