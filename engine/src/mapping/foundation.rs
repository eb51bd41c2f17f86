//! What a map is founded upon, so that one more run costs the same after years: the fold over the runs of a site.
//!
//! Runs are mapped in generations, in the order in which the site lists them. When a generation is full its map becomes the
//! foundation: components whose poses stay, each with a bounded number of exemplars of runs that stand for its places, and
//! what is to be served of the runs in it. Whatever follows is laid over those exemplars.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::component::{Component, Workshop};
use super::condense::condensed;
use super::config::MappingConfig;
use super::exemplar::Exemplar;
use super::finish::{Finished, finished};
use super::indices::BodyIdx;
use super::joining::join;
use super::judgements::{Judgements, settle};
use super::memo::RegistrationMemo;
use super::null::Null;
use super::place_match::{Channel, Decision, PlaceMatch};
use super::placement::place_observations;
use super::run::RunRecord;
use super::site_anchors::SiteAnchors;
use super::site_map::{MappedRun, SiteMap};
use super::text_evidence::{NUM_CLAIMS_MAX, weigh_new_texts};
use super::told::Told;
use super::watch::{MapStage, MappingError, Watch};
use crate::geometry::Pose2;
use crate::matching::MatchingConfig;
use crate::registration::Opinions;

/// Refused matches of settled runs that are listed, the latest.
const NUM_REFUSED_MAX: usize = 400;

/// The settled part of a site: all its full generations.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Foundation {
    /// Runs in the order of the site.
    runs: Vec<SettledRun>,
    bodies: Vec<Body>,
    #[serde(with = "super::stored_matches")]
    matches: Vec<PlaceMatch>,
    #[serde(with = "super::stored_matches")]
    refused: Vec<PlaceMatch>,
    null: Null,
}

/// Where a settled run is.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct SettledRun {
    /// The body in whose frame the poses are; none when it never moved.
    body: Option<u32>,
    map_from_keyframes: Vec<Pose2>,
}

/// A settled component.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Body {
    /// What its places said of each other.
    opinions: Opinions,
    /// What stands for it, in the order in which it was driven.
    exemplars: Vec<Exemplar>,
}

/// The settings of a map, and what is done for it beside registration.
#[derive(Clone, Copy, Debug)]
pub struct MapSettings<'a> {
    /// How runs become one map.
    pub mapping: &'a MappingConfig,
    /// What the texts say of its matches; none when nobody asks.
    pub matching: Option<&'a MatchingConfig>,
}

/// A map of all runs, and the foundation of those that come next.
#[derive(Clone, Debug)]
pub struct Extended {
    /// Of all runs, the settled ones included.
    pub map: SiteMap,
    /// With the runs that were added, if these fill a generation.
    pub foundation: Option<Foundation>,
}

impl Foundation {
    /// Number of runs that are settled in it.
    pub fn num_runs(&self) -> usize {
        self.runs.len()
    }

    /// Number of keyframes that are kept to stand for all that was driven.
    pub fn num_keyframes(&self) -> usize {
        self.bodies
            .iter()
            .flat_map(|body| &body.exemplars)
            .map(|exemplar| exemplar.record().keyframes.len())
            .sum()
    }

    /// The map of the settled runs and of those behind them, at most a generation.
    ///
    /// # Errors
    /// Whatever the pose graph cannot solve; [`MappingError::Stopped`].
    pub fn extended(
        &self,
        settings: MapSettings<'_>,
        runs: &[RunRecord<'_>],
        decisions: &[Decision],
        memo: &mut RegistrationMemo,
        watch: Watch<'_>,
    ) -> Result<Extended, MappingError> {
        let config = settings.mapping;
        memo.prepare(&config.submap);
        let exemplars: Vec<Vec<RunRecord<'_>>> =
            self.bodies.iter().map(|body| body.exemplars.iter().map(Exemplar::record).collect()).collect();
        let told = Told::new(self.bodies.iter().flat_map(|body| &body.exemplars), self.num_runs());
        let records: Vec<RunRecord<'_>> = exemplars.iter().flatten().chain(runs).copied().collect();
        let told_decisions = told.decisions(decisions);
        let mut made = self.made((&exemplars, runs), (config, &told_decisions), &records, memo, watch)?;
        if let Some(matching) = settings.matching {
            weigh_new_texts(&records, told.num_exemplars(), &mut made.map, matching);
        }
        memo.turn();
        let map = self.with_settled(&made, &told, decisions);
        let foundation = is_full(runs, config).then(|| self.closed(&made, &map, runs, config));
        Ok(Extended { map, foundation })
    }

    /// The map of exemplars and new runs.
    fn made(
        &self,
        (exemplars, runs): (&[Vec<RunRecord<'_>>], &[RunRecord<'_>]),
        (config, decisions): (&MappingConfig, &[Decision]),
        records: &[RunRecord<'_>],
        memo: &RegistrationMemo,
        watch: Watch<'_>,
    ) -> Result<Finished, MappingError> {
        let site = SiteAnchors::new(exemplars, runs, config);
        let judgements = Judgements::new(decisions, &site);
        let workshop =
            Workshop { site: &site, judgements: &judgements, memo, span: watch.stage(MapStage::Settling) };
        let body = |(idx, body): (usize, &Body)| Component::of_body(&site, BodyIdx::new(idx), body.opinions);
        let bodies = self.bodies.iter().enumerate().map(body).collect::<Result<Vec<_>, _>>()?;
        let alone = Component::all_alone(workshop)?;
        let workshop = Workshop { span: watch.stage(MapStage::Joining), ..workshop };
        let joined = join((bodies, &self.null), alone, workshop)?;
        Ok(finished(joined, workshop, records, is_full(runs, config)))
    }

    /// A map of exemplars and new runs as one of all runs of the site.
    fn with_settled(&self, made: &Finished, told: &Told, decisions: &[Decision]) -> SiteMap {
        let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
        let mut num_components = 0;
        let mut number = |made_number: Option<u32>| {
            let next = num_components;
            let number = made_number.map_or(next, |made| *numbers.entry(made).or_insert(next));
            num_components = num_components.max(number + 1);
            number
        };
        let first_exemplars = self.first_exemplars();
        let settled = self.runs.iter().map(|run| {
            let place =
                run.body.map(|body| (first_exemplars[body as usize], made.map_from_bodies[body as usize]));
            let component = number(place.map(|(exemplar, _)| made.map.runs[exemplar].component));
            let moved = place.map(|(_, map_from_body)| map_from_body).filter(|by| *by != Pose2::identity());
            let moved = |pose: &Pose2| moved.map_or(*pose, |by| by.compose(pose));
            MappedRun { component, map_from_keyframes: run.map_from_keyframes.iter().map(moved).collect() }
        });
        let mut runs: Vec<MappedRun> = settled.collect();
        for run in &made.map.runs[told.num_exemplars()..] {
            runs.push(MappedRun { component: number(Some(run.component)), ..run.clone() });
        }
        let named = |found: &PlaceMatch| told.named(found);
        let mut matches = self.matches.clone();
        matches.iter_mut().for_each(|found| settle(decisions, found));
        matches.extend(made.map.matches.iter().map(named));
        let refused = self.refused.iter().cloned().chain(made.map.refused.iter().map(named)).collect();
        SiteMap { matches, refused, runs, num_components }
    }

    /// For each body the place of its first exemplar among those of all.
    fn first_exemplars(&self) -> Vec<usize> {
        let mut next = 0;
        let first = |body: &Body| {
            next += body.exemplars.len();
            next - body.exemplars.len()
        };
        self.bodies.iter().map(first).collect()
    }

    /// The foundation with the new runs in it, where the map puts them.
    fn closed(&self, made: &Finished, map: &SiteMap, runs: &[RunRecord<'_>], config: &MappingConfig) -> Self {
        let num_exemplars = made.map.runs.len() - runs.len();
        // Components of the finished map by their number in it, with their exemplars and how many of these were chosen before.
        let mut grown: BTreeMap<u32, (Opinions, Vec<Exemplar>, usize)> = BTreeMap::new();
        for ((body, &first), map_from_body) in
            self.bodies.iter().zip(&self.first_exemplars()).zip(&made.map_from_bodies)
        {
            let made_number = made.map.runs[first].component;
            let of_it =
                grown.entry(made_number).or_insert((made.opinions[made_number as usize], Vec::new(), 0));
            of_it.0 += body.opinions;
            of_it.1.extend(body.exemplars.iter().map(|exemplar| exemplar.moved(map_from_body)));
            // The others were chosen for another body, and may stand where this one has exemplars already.
            of_it.2 = if of_it.2 == 0 { body.exemplars.len() } else { of_it.2 };
        }
        for (idx, (record, mapped)) in runs.iter().zip(&made.map.runs[num_exemplars..]).enumerate() {
            if mapped.map_from_keyframes.is_empty() {
                continue;
            }
            let opinions = made.opinions[mapped.component as usize];
            let observed = place_observations(record, mapped);
            let run = (self.num_runs() + idx) as u32;
            let exemplar = Exemplar::whole(run, record, &mapped.map_from_keyframes, &observed);
            grown.entry(mapped.component).or_insert((opinions, Vec::new(), 0)).1.push(exemplar);
        }
        let body_of: BTreeMap<u32, u32> = grown.keys().copied().zip(0..).collect();
        let made_number = |place: usize| match place.checked_sub(self.num_runs()) {
            Some(new) => made.map.runs[num_exemplars + new].component,
            None => self.runs[place]
                .body
                .map_or(u32::MAX, |body| made.map.runs[self.first_exemplars()[body as usize]].component),
        };
        let settled = |(place, run): (usize, &MappedRun)| SettledRun {
            body: body_of.get(&made_number(place)).copied(),
            map_from_keyframes: run.map_from_keyframes.clone(),
        };
        let body = |(opinions, exemplars, num_kept): (Opinions, Vec<Exemplar>, usize)| {
            let area = exemplars.iter().find_map(Exemplar::area).map(str::to_owned);
            let chosen = condensed(&exemplars, num_kept, config).into_iter();
            Body {
                opinions: opinions.faded(),
                exemplars: chosen.map(|exemplar| exemplar.in_area(area.clone())).collect(),
            }
        };
        Self {
            runs: map.runs.iter().enumerate().map(settled).collect(),
            bodies: grown.into_values().map(body).collect(),
            matches: with_few_claims(&map.matches),
            refused: map.refused[map.refused.len().saturating_sub(NUM_REFUSED_MAX)..].to_vec(),
            null: made.null.clone(),
        }
    }
}

/// True when these runs fill a generation.
fn is_full(runs: &[RunRecord<'_>], config: &MappingConfig) -> bool {
    runs.len() >= config.generation_runs.max(1)
}

/// Matches without all but the most surprising of the claims that words alone make.
fn with_few_claims(matches: &[PlaceMatch]) -> Vec<PlaceMatch> {
    let is_claim = |found: &&PlaceMatch| found.channel == Channel::Words;
    let mut chances: Vec<f64> =
        matches.iter().filter(is_claim).map(|found| found.evidence.expected_chance_matches).collect();
    chances.sort_by(f64::total_cmp);
    let least_sure = chances.get(NUM_CLAIMS_MAX.saturating_sub(1)).copied().unwrap_or(f64::INFINITY);
    let is_kept = |found: &&PlaceMatch| {
        found.channel != Channel::Words || found.evidence.expected_chance_matches <= least_sure
    };
    matches.iter().filter(is_kept).cloned().collect()
}
