//! Closures taken in one after the other, the surest first.
//!
//! A closure can only be checked where the graph without it is already sure of the pose it claims. So odometry alone
//! judges the closures over short drives; those that fit make the graph surer, which then can judge longer ones, and so
//! on (a chain of innovation tests, as incremental consensus methods run them in the order of driving). Wrong closures
//! that agree with one another gain nothing by their number here: each meets what the graph knew before any of them.

use std::collections::BTreeMap;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::components::DisjointSets;
use super::covariance::CovarianceSolver;
use super::paths::{Paths, Search};
use super::robust::solve_accepted;
use super::support::Uncertain;
use super::{PoseConstraint, PoseGraph, PoseGraphConfig, PoseGraphError, Trust};
use crate::geometry::Pose2;

/// What is known of one constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Standing {
    /// Trusted, or it fitted where that says something.
    Accepted,
    /// It did not fit.
    Refuted,
    /// Nothing that is accepted is sure enough to judge it.
    Open,
}

/// Rounds of accepting and solving before a guess.
const MAX_ROUNDS: usize = 60;
/// Guesses, and how many places are tried for each.
const MAX_GUESSES: usize = 20;
const MAX_PLACES: usize = 12;
/// A fit counts only where a constraint drawn at random would fit with at most this probability.
const CHANCE_MAX: f64 = 0.001;
/// In one round closures are accepted up to this multiple of the smallest volume of doubt among those that fit.
const VOLUME_RATIO: f64 = 4.0;
/// Beyond this standard deviation of the heading, radians, a covariance to first order refutes nothing.
const HEADING_SD_MAX: f64 = 0.5;
/// χ² beyond this multiple of the bound refutes; between one and this a closure stays open.
const CONTRADICTION: f64 = 2.0;

/// Judges every doubtful constraint by those that are surer, moving the poses of `graph` along.
///
/// `bound` is the largest χ² of a right constraint, `num_steps_max` how many poses apart the ends of two closures of one
/// place are at most. Cost: for each of at most some hundred rounds one solution and a search of the poses about each
/// open constraint, and for each guess a factorisation.
///
/// # Errors
/// As [`super::optimize`].
pub(super) fn judge_surest_first(
    graph: &mut PoseGraph,
    config: &PoseGraphConfig,
    bound: f64,
    num_steps_max: u32,
) -> Result<Vec<Standing>, PoseGraphError> {
    let standing_of =
        |trust: &Trust| if *trust == Trust::Trusted { Standing::Accepted } else { Standing::Open };
    let standings = graph.trusts().iter().map(standing_of).collect();
    let rests = vec![Rest::default(); graph.constraints().len()];
    let mut growth = Growth { graph: graph.clone(), standings, rests, config, bound };
    growth.settle()?;
    growth.reopen();
    growth.settle()?;
    for _ in 0..MAX_GUESSES {
        growth.reopen();
        let Some(next) = growth.guess(num_steps_max)? else { break };
        growth = next;
    }
    graph.replace_poses(growth.graph.poses().to_vec());
    Ok(growth.standings)
}

/// A graph that grows by the constraints it is sure of.
#[derive(Clone)]
struct Growth<'a> {
    graph: PoseGraph,
    standings: Vec<Standing>,
    /// For every constraint in how many rounds it is looked at again.
    rests: Vec<Rest>,
    config: &'a PoseGraphConfig,
    bound: f64,
}

/// A constraint whose other end was not reached rests, longer each time.
#[derive(Clone, Copy, Default)]
struct Rest {
    num_left: u32,
    num_rounds: u32,
}

impl Growth<'_> {
    /// Accepts what fits, the surest first, until nothing more does.
    fn settle(&mut self) -> Result<(), PoseGraphError> {
        let mut level = 0.0_f64;
        self.rests.fill(Rest::default());
        for _ in 0..MAX_ROUNDS {
            let accepted = self.solve()?;
            let limits = self.limits(CHANCE_MAX);
            let mut fitting = self.look(&accepted, &limits);
            if fitting.is_empty() {
                // Those that rested have their turn before this ends.
                self.rests.iter_mut().for_each(|rest| rest.num_left = 0);
                fitting = self.look(&accepted, &limits);
            }
            let Some(surest) = fitting.first() else { break };
            level = level.max(surest.volume * VOLUME_RATIO);
            for fit in fitting.iter().take_while(|fit| fit.volume <= level) {
                self.standings[fit.index] = Standing::Accepted;
            }
        }
        Ok(())
    }

    /// Weighs the open constraints that do not rest by what accepted paths say.
    fn look(&mut self, accepted: &PoseGraph, limits: &Limits) -> Vec<Fit> {
        let is_asked =
            |index: usize| self.standings[index] == Standing::Open && self.rests[index].num_left == 0;
        let beliefs = over_paths(&self.graph, accepted, is_asked, limits);
        let mut is_reached = vec![false; self.standings.len()];
        beliefs.iter().for_each(|belief| is_reached[belief.index] = true);
        for (index, rest) in self.rests.iter_mut().enumerate() {
            if rest.num_left > 0 {
                rest.num_left -= 1;
            } else if !is_reached[index] {
                rest.num_rounds = 2 * rest.num_rounds + 1;
                rest.num_left = rest.num_rounds;
            }
        }
        self.weigh(&beliefs, limits)
    }

    /// What was refuted when little was known may fit now.
    fn reopen(&mut self) {
        let refuted = self.standings.iter_mut().filter(|standing| **standing == Standing::Refuted);
        refuted.for_each(|standing| *standing = Standing::Open);
    }

    /// Where nothing is sure any more, tries the places that may fit and keeps the one that most others then agree with:
    /// a wrong place agrees with itself only.
    fn guess(&mut self, num_steps_max: u32) -> Result<Option<Self>, PoseGraphError> {
        let accepted = self.solve()?;
        let limits = self.limits(f64::INFINITY);
        let fitting = self.weigh(
            &over_all(&self.graph, &accepted, |index| self.standings[index] == Standing::Open, &limits)?,
            &limits,
        );
        let mut best: Option<(usize, Self)> = None;
        let num_before = self.num_accepted();
        for place in places(&self.graph, &fitting, num_steps_max).into_iter().take(MAX_PLACES) {
            let mut trial = self.clone();
            for &index in &place {
                trial.standings[index] = Standing::Accepted;
            }
            trial.settle()?;
            let num_own = place.iter().filter(|&&index| trial.standings[index] == Standing::Accepted).count();
            let num_agreeing = trial.num_accepted().saturating_sub(num_before + num_own);
            if num_agreeing > best.as_ref().map_or(0, |(most, _)| *most) {
                best = Some((num_agreeing, trial));
            }
            if 2 * (num_agreeing + num_own) > fitting.len() {
                break;
            }
        }
        Ok(best.map(|(_, trial)| trial))
    }

    fn num_accepted(&self) -> usize {
        self.standings.iter().filter(|standing| **standing == Standing::Accepted).count()
    }

    fn limits(&self, chance_max: f64) -> Limits {
        Limits { bound: self.bound, volume_max: chance_max * pose_space(&self.graph) }
    }

    /// Solves with what is accepted, without closures that no longer fit the graph they helped to make.
    fn solve(&mut self) -> Result<PoseGraph, PoseGraphError> {
        let mut accepted = self.graph.with_constraints(|index| self.standings[index] == Standing::Accepted);
        solve_accepted(&mut accepted, self.config)?;
        self.graph.replace_poses(accepted.poses().to_vec());
        for (index, standing) in self.standings.iter_mut().enumerate() {
            let is_closure = self.graph.trusts()[index] == Trust::Doubtful && *standing == Standing::Accepted;
            let fits = |chi2: f64| chi2 <= CONTRADICTION * self.bound;
            if is_closure && !self.graph.constraint_chi2(index as u32).is_some_and(fits) {
                *standing = Standing::Refuted;
            }
        }
        Ok(accepted)
    }

    /// Refutes constraints that cannot be and returns those that fit, where fitting says something, the surest first.
    fn weigh(&mut self, beliefs: &[Belief], limits: &Limits) -> Vec<Fit> {
        let mut fitting = Vec::new();
        for Belief { index, measured, believed } in beliefs {
            let Some(chi2) = believed.chi2_against(measured) else { continue };
            if chi2 > CONTRADICTION * limits.bound {
                if believed.covariance[(2, 2)].sqrt() <= HEADING_SD_MAX {
                    self.standings[*index] = Standing::Refuted;
                }
                continue;
            }
            let volume = limits.volume(&(believed.covariance + measured.covariance));
            if volume <= limits.volume_max && chi2 <= limits.bound {
                fitting.push(Fit { index: *index, volume });
            }
        }
        fitting.sort_by(|a, b| a.volume.total_cmp(&b.volume).then(a.index.cmp(&b.index)));
        fitting
    }
}

/// Fitting closures by place: those whose ends are close in the drive belong together. The surest place comes first.
fn places(graph: &PoseGraph, fitting: &[Fit], num_steps_max: u32) -> Vec<Vec<usize>> {
    let ends = |fit: &Fit| {
        let constraint = &graph.constraints()[fit.index];
        (constraint.i.min(constraint.j), constraint.i.max(constraint.j))
    };
    let mut sets = DisjointSets::new(fitting.len());
    for (position, fit) in fitting.iter().enumerate() {
        let (first, second) = ends(fit);
        for (other_position, other) in fitting[..position].iter().enumerate() {
            let (other_first, other_second) = ends(other);
            if first.abs_diff(other_first) <= num_steps_max && second.abs_diff(other_second) <= num_steps_max
            {
                sets.union(position as u32, other_position as u32);
            }
        }
    }
    let mut places = Vec::<Vec<usize>>::new();
    let mut place_of_set = BTreeMap::new();
    for (position, fit) in fitting.iter().enumerate() {
        let place = *place_of_set.entry(sets.find(position as u32)).or_insert(places.len());
        places.resize(places.len().max(place + 1), Vec::new());
        places[place].push(fit.index);
    }
    places
}

/// When a test says something.
struct Limits {
    /// Largest χ² of a right constraint.
    bound: f64,
    /// Largest space of relative poses that may fit, m² rad.
    volume_max: f64,
}

impl Limits {
    /// Space of relative poses within the bound, m² rad.
    fn volume(&self, covariance: &Matrix3<f64>) -> f64 {
        volume(covariance, self.bound)
    }
}

/// What accepted constraints believe of the relative pose that constraint `index` measured.
struct Belief {
    index: usize,
    measured: Uncertain,
    believed: Uncertain,
}

/// Constraints by the pose they begin at.
fn by_pose(
    graph: &PoseGraph,
    is_asked: impl Fn(usize) -> bool,
) -> BTreeMap<u32, Vec<(usize, u32, Uncertain)>> {
    let mut by_pose = BTreeMap::<u32, Vec<_>>::new();
    for (index, constraint) in graph.constraints().iter().enumerate() {
        let measured = Uncertain::of(constraint).filter(|_| is_asked(index));
        if let Some(measured) = measured {
            by_pose.entry(constraint.i).or_default().push((index, constraint.j, measured));
        }
    }
    by_pose
}

fn over_paths(
    graph: &PoseGraph,
    accepted: &PoseGraph,
    is_asked: impl Fn(usize) -> bool,
    limits: &Limits,
) -> Vec<Belief> {
    let paths = Paths::of(accepted);
    let by_pose: Vec<_> = by_pose(graph, is_asked).into_iter().collect();
    let of_pose =
        |search: &mut Search, (pose, claims): &(u32, Vec<(usize, u32, Uncertain)>)| -> Vec<Belief> {
            let wanted: Vec<u32> = claims.iter().map(|(_, other, _)| *other).collect();
            paths.search(*pose, &wanted, |covariance| limits.volume(covariance) <= limits.volume_max, search);
            let belief = |&(index, other, measured): &(usize, u32, Uncertain)| {
                let pose = graph.poses()[*pose as usize].between(&graph.poses()[other as usize]);
                let covariance = search.reached(other)?.covariance;
                Some(Belief { index, measured, believed: Uncertain { pose, covariance } })
            };
            claims.iter().filter_map(belief).collect()
        };
    let search = || Search::new(graph.poses().len());
    by_pose.par_iter().map_init(search, of_pose).collect::<Vec<_>>().into_iter().flatten().collect()
}

fn over_all(
    graph: &PoseGraph,
    accepted: &PoseGraph,
    is_asked: impl Fn(usize) -> bool,
    limits: &Limits,
) -> Result<Vec<Belief>, PoseGraphError> {
    let mut solver = CovarianceSolver::new(accepted)?;
    let mut beliefs = Vec::new();
    for (pose, claims) in by_pose(graph, is_asked) {
        let mut may_fit = Vec::new();
        for (index, other, measured) in claims {
            let loose = match solver.relative_bound(pose, other) {
                Ok((pose, covariance)) => Uncertain { pose, covariance },
                Err(PoseGraphError::NotConnected { .. }) => continue,
                Err(error) => return Err(error),
            };
            // Most wrong constraints fail even the test that needs no solve.
            if loose.chi2_against(&measured).is_some_and(|chi2| chi2 > CONTRADICTION * limits.bound) {
                beliefs.push(Belief { index, measured, believed: loose });
            } else {
                may_fit.push((index, other, measured));
            }
        }
        let others: Vec<u32> = may_fit.iter().map(|(_, other, _)| *other).collect();
        if !others.is_empty() {
            let believed = solver.relatives(&[(pose, others)])?;
            beliefs.extend(may_fit.into_iter().zip(believed.into_iter().flatten()).map(
                |((index, _, measured), (pose, covariance))| Belief {
                    index,
                    measured,
                    believed: Uncertain { pose, covariance },
                },
            ));
        }
    }
    Ok(beliefs)
}

/// A closure that fits where that says something.
struct Fit {
    index: usize,
    /// Space of relative poses that would fit as well, m² rad.
    volume: f64,
}

/// What the accepted constraints say of others.
pub(super) struct Judge {
    pub solver: CovarianceSolver,
    pub bound: f64,
    pub chance_max: f64,
    /// Size of the space of relative poses, m² rad.
    pub space: f64,
}

impl Judge {
    /// Whether a constraint fits what is accepted, where it would not do so by chance.
    pub fn admits(&mut self, constraint: &PoseConstraint) -> bool {
        let Some(measured) = Uncertain::of(constraint) else { return false };
        let fits = |believed| chi2(believed, &measured).is_some_and(|chi2| chi2 <= self.bound);
        let loose = self.solver.relative_bound(constraint.i, constraint.j);
        if !loose.is_ok_and(fits) {
            return false;
        }
        let Ok(believed) = self.solver.relative(constraint.i, constraint.j) else { return false };
        let volume = volume(&(believed.1 + measured.covariance), self.bound);
        volume <= self.chance_max * self.space && fits(believed)
    }
}

fn chi2((pose, covariance): (Pose2, Matrix3<f64>), measured: &Uncertain) -> Option<f64> {
    Uncertain { pose, covariance }.chi2_against(measured)
}

/// Space of relative poses whose χ² is within the bound, m² rad.
fn volume(covariance: &Matrix3<f64>, bound: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * (covariance * bound).determinant().max(0.0).sqrt()
}

/// Size of the space of relative poses in this map: its bounding box times all headings, m² rad.
pub(super) fn pose_space(graph: &PoseGraph) -> f64 {
    let extent = |coordinate: fn(&Pose2) -> f64| {
        let (low, high) = graph
            .poses()
            .iter()
            .map(coordinate)
            .fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
        high - low
    };
    extent(|pose| pose.x) * extent(|pose| pose.y) * std::f64::consts::TAU
}
