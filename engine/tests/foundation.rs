//! Sites that grow: full generations settle, what follows is laid over them, and the map is the same as from nothing.

#![allow(clippy::unwrap_used)]

mod driven;

use std::sync::LazyLock;

use locution_engine::config::EngineConfig;
use locution_engine::geometry::Pose2;
use locution_engine::mapping::{
    Decision, Foundation, MapSettings, MappingConfig, RegistrationMemo, RunRecord, SiteMap, Watch, map_site,
};

use driven::{Driven, ring_world};

/// Two robots in different halves of the ring, then two that go all round it.
static RUNS: LazyLock<[Driven; 4]> = LazyLock::new(|| {
    let world = ring_world();
    let south = [(2.0, 9.0), (2.0, 2.0), (28.0, 2.0), (28.0, 9.0), (28.0, 2.0), (2.0, 2.0)];
    let north = [(28.0, 12.0), (28.0, 18.0), (2.0, 18.0), (2.0, 12.0), (2.0, 18.0), (28.0, 18.0)];
    let round = [(4.0, 2.0), (27.5, 2.0), (28.0, 18.0), (2.0, 18.0), (2.0, 2.0), (14.0, 2.0)];
    let other_way = [(25.0, 18.0), (28.0, 16.0), (28.0, 2.0), (2.0, 2.0), (2.0, 14.0)];
    [
        Driven::new(&world, &south, 3),
        Driven::new(&world, &north, 4),
        Driven::new(&world, &round, 5),
        Driven::new(&world, &other_way, 6),
    ]
});

fn generations_of(generation_runs: usize) -> MappingConfig {
    MappingConfig { generation_runs, ..EngineConfig::default().mapping }
}

fn from_nothing(config: &MappingConfig, runs: &[RunRecord<'_>], decisions: &[Decision]) -> SiteMap {
    map_site(config, runs, decisions, &mut RegistrationMemo::default()).unwrap()
}

/// How far the map puts a place of a run from where it truly is, when another run of the map is where it truly is.
fn error_m(map: &SiteMap, runs: &[Driven], (a, b): (usize, usize)) -> f64 {
    let map_from_world = |run: usize, at: usize| {
        map.runs[run].map_from_keyframes[at].compose(&runs[run].world_from(at).inverse())
    };
    let of_first = map_from_world(a, runs[a].keyframes.len() / 2);
    let at = runs[b].keyframes.len() / 2;
    of_first.compose(&runs[b].world_from(at)).distance(&map.runs[b].map_from_keyframes[at])
}

#[test]
fn a_site_that_grew_is_the_same_as_one_from_nothing_and_settled_poses_stay() {
    let runs = &*RUNS;
    let records: Vec<RunRecord<'_>> = runs.iter().map(Driven::record).collect();
    let config = generations_of(2);
    let settings = MapSettings { mapping: &config, matching: None };
    let (mut memo, mut foundation) = (RegistrationMemo::default(), Foundation::default());
    let mut maps: Vec<SiteMap> = Vec::new();
    for num_runs in 1..=records.len() {
        let new = &records[foundation.num_runs()..num_runs];
        let extended = foundation.extended(settings, new, &[], &mut memo, Watch::nobody()).unwrap();
        if let Some(next) = extended.foundation {
            // What is remembered may be stored meanwhile.
            foundation = postcard::from_bytes(&postcard::to_allocvec(&next).unwrap()).unwrap();
        }
        assert_eq!(extended.map, from_nothing(&config, &records[..num_runs], &[]), "{num_runs} runs");
        maps.push(extended.map);
    }
    assert_eq!(maps[1].num_components, 2, "the halves share nothing");
    assert_eq!(maps[2].num_components, 1, "who goes round joins two settled components");
    assert_eq!(maps[2].runs[0], maps[1].runs[0], "the component that was first stays where it is");
    assert_eq!(maps[3].runs[0], maps[1].runs[0]);
    let moved = |map: &SiteMap, at: usize| {
        map.runs[1].map_from_keyframes[at].between(&map.runs[1].map_from_keyframes[at + 40])
    };
    let difference = moved(&maps[1], 10).between(&moved(&maps[2], 10));
    assert!(difference.distance(&Pose2::identity()) < 1e-9, "the other is moved as a whole: {difference:?}");
    for pair in [(0, 1), (0, 2), (1, 3)] {
        assert!(error_m(&maps[3], runs, pair) < 0.3, "{pair:?}: {}", error_m(&maps[3], runs, pair));
    }
    let across = |found: &&locution_engine::mapping::PlaceMatch| {
        (found.earlier.run_idx, found.later.run_idx) == (0, 3)
    };
    let found = maps[3].matches.iter().find(across).expect("the last run passes where the first was");
    let (earlier, later) = (found.earlier.first as usize, found.later.first as usize);
    assert!(earlier < runs[0].observations.len() && later < runs[3].observations.len());
}

#[test]
fn a_site_of_one_generation_is_mapped_as_if_there_were_none() {
    let records: Vec<RunRecord<'_>> = RUNS[2..].iter().map(Driven::record).collect();
    let expected = from_nothing(&generations_of(100), &records, &[]);
    assert_eq!(from_nothing(&generations_of(2), &records, &[]), expected);
    assert_eq!(from_nothing(&generations_of(10), &records, &[]), expected);
}

#[test]
fn a_veto_between_a_settled_run_and_a_new_one_keeps_them_apart() {
    let records: Vec<RunRecord<'_>> = [&RUNS[2], &RUNS[3]].map(Driven::record).to_vec();
    let config = generations_of(1);
    let map = from_nothing(&config, &records, &[]);
    assert_eq!(map.num_components, 1);
    let across = map.matches.iter().filter(|found| found.earlier.run_idx != found.later.run_idx);
    let vetoes: Vec<Decision> = across
        .map(|found| Decision {
            earlier: found.earlier,
            later: found.later,
            direction: found.direction,
            is_same_place: false,
        })
        .collect();
    assert!(!vetoes.is_empty());
    assert_eq!(from_nothing(&config, &records, &vetoes[..1]).num_components, 2);
}

#[test]
fn a_settled_run_that_changed_is_another_foundation() {
    let records: Vec<RunRecord<'_>> = RUNS[1..].iter().map(Driven::record).collect();
    let nothing = RunRecord { observations: &[], words: &[], keyframes: &[], ..records[0] };
    let config = generations_of(2);
    let without = from_nothing(&config, &[nothing, records[1], records[2]], &[]);
    assert_eq!((without.num_components, without.runs.len()), (2, 3), "a run that saw nothing is on its own");
    assert!(without.runs[0].map_from_keyframes.is_empty());
    assert_eq!(without.runs[1].component, without.runs[2].component);
    assert_ne!(without.runs[0].component, without.runs[1].component);
}
