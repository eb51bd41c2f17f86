//! The last metres in pieces, each short enough that refined odometry does not bend it, and how they lie in a map.
//!
//! The newest piece grows with the drive, the others are finished. A supposed place of the robot puts the newest piece
//! into the map; where that comes to rest says where the one before it must lie, and so back through all of them. The
//! right place takes every piece with little bending between them.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3};

use super::track::Moment;
use crate::geometry::{Pose2, angle_between};
use crate::recall::{PlaceIndex, worst_sd_m};
use crate::registration::{AreaFit, Submap, SubmapConfig, SubmapScan};
use crate::scan::ScanGeometry;

/// Scans that make one piece, at most.
const NUM_SCANS_MAX: usize = 40;
/// A finished piece is expected within this of where the chain puts it, or its fit is looked for anew, metres and radians.
const SAME_FIT: (f64, f64) = (0.3, 0.1);
/// How far one piece may be off beside the next, one standard deviation, metres.
const JOINT_SD_M: f64 = 0.1;

/// Some metres of a drive as one body.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Pieces are numbered in order of driving.
    number: usize,
    run_from_submap: Pose2,
    submap: Submap,
}

impl Piece {
    /// The piece that some moments make, in the frame of the one in their middle.
    pub fn of<'a>(
        number: usize,
        moments: impl ExactSizeIterator<Item = &'a Moment> + Clone,
        geometry: &ScanGeometry,
        config: &SubmapConfig,
    ) -> Self {
        let num = moments.len();
        let middle =
            moments.clone().nth(num / 2).map_or_else(Pose2::identity, |moment| moment.run_from_robot);
        let scans: Vec<SubmapScan<'_>> = moments
            .step_by(num.div_ceil(NUM_SCANS_MAX).max(1))
            .map(|moment| SubmapScan { frame_from_robot: moment.run_from_robot, ranges_m: &moment.ranges_m })
            .collect();
        let submap = Submap::of_lasting_things(geometry, &scans, &middle, config);
        Self { number, run_from_submap: middle, submap }
    }

    /// How the piece lies in a component for a robot whose run lies at `map_from_run`; none where nothing is known.
    pub fn fit(
        &self,
        (index, component, config): (&PlaceIndex, u32, &SubmapConfig),
        map_from_run: &Pose2,
    ) -> Option<AreaFit> {
        index.fit(component, &self.submap, &map_from_run.compose(&self.run_from_submap), config)
    }
}

/// The finished pieces of a drive that still count.
#[derive(Clone, Debug, Default)]
pub(super) struct FinishedPieces {
    pieces: VecDeque<Arc<Piece>>,
    num_ever: usize,
    /// Travel at the end of the last one, metres.
    until_m: f64,
}

impl FinishedPieces {
    /// Travel at the end of the last one, metres.
    pub const fn until_m(&self) -> f64 {
        self.until_m
    }

    /// The number of the piece that is still being driven.
    pub const fn num_ever(&self) -> usize {
        self.num_ever
    }

    /// Takes a piece that is finished and forgets those beyond as many as count.
    pub fn push(&mut self, piece: Piece, until_m: f64, num_max: usize) {
        self.pieces.push_back(Arc::new(piece));
        self.num_ever += 1;
        self.until_m = until_m;
        while self.pieces.len() > num_max {
            self.pieces.pop_front();
        }
    }

    /// Forgets all; the next begins at some travel.
    pub fn clear(&mut self, until_m: f64) {
        self.pieces.clear();
        self.until_m = until_m;
    }
}

/// How a chain of pieces lies in a map.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainFit {
    /// All pieces as one; the pose is that of the newest.
    pub whole: AreaFit,
    /// The pieces with their numbers, newest first.
    pub pieces: Vec<(usize, AreaFit)>,
    /// How far neighbours are off beside what the drive says, root mean square, metres.
    pub bend_m: f64,
    /// Standard deviation of the newest pose in its worst direction, metres.
    pub sd_m: f64,
}

impl ChainFit {
    /// The largest share of its returns that a piece is contradicted in; pieces of which the map knows little say nothing.
    pub fn worst_contradicted(&self) -> f64 {
        let told = self.pieces.iter().filter(|(_, fit)| fit.num_opinions >= NUM_OPINIONS_MIN);
        told.map(|(_, fit)| fit.contradicted.max(fit.contradicts)).fold(self.whole.contradicted, f64::max)
    }
}

/// Opinions from which on what a map says of a piece is worth asking for.
const NUM_OPINIONS_MIN: u32 = 40;

/// Lays the newest piece and all finished ones into a component; none where nothing is known of the newest. Fits of
/// finished pieces that are known already and lie where they should are taken over.
pub(super) fn lay_chain(
    newest: &Piece,
    finished: &FinishedPieces,
    map: (&PlaceIndex, u32, &SubmapConfig),
    map_from_run: &Pose2,
    known: Option<&ChainFit>,
) -> Option<ChainFit> {
    let fit = newest.fit(map, map_from_run)?;
    let mut map_from_run = fit.map_from_submap.compose(&newest.run_from_submap.inverse());
    let mut pieces = vec![(newest.number, fit)];
    let (mut squares, mut num_joints) = (0.0, 0);
    for piece in finished.pieces.iter().rev() {
        let expected = map_from_run.compose(&piece.run_from_submap);
        let known_fit = known
            .and_then(|chain| chain.pieces.iter().find(|(number, _)| *number == piece.number))
            .map(|(_, fit)| *fit)
            .filter(|fit| is_near(&expected, &fit.map_from_submap));
        let fit = known_fit
            .or_else(|| piece.fit(map, &map_from_run))
            .unwrap_or_else(|| AreaFit::of_unknown(&piece.submap, &expected));
        if fit.num_opinions > 0 {
            squares += expected.distance(&fit.map_from_submap).powi(2);
            num_joints += 1;
        }
        map_from_run = fit.map_from_submap.compose(&piece.run_from_submap.inverse());
        pieces.push((piece.number, fit));
    }
    let others: Vec<AreaFit> = pieces[1..].iter().map(|(_, fit)| *fit).collect();
    Some(ChainFit {
        whole: fit.pooled_with(&others),
        sd_m: worst_sd_m(&covariance_of(&pieces)),
        pieces,
        bend_m: (squares / f64::from(num_joints.max(1))).sqrt(),
    })
}

/// Covariance of the newest pose: what every piece knows of its place, less for every joint between them.
fn covariance_of(pieces: &[(usize, AreaFit)]) -> Matrix3<f64> {
    let place = |fit: &AreaFit| fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let known = |(joints, (_, fit)): (usize, &(usize, AreaFit))| {
        (place(fit) + Matrix2::identity() * (joints as f64 * JOINT_SD_M * JOINT_SD_M)).try_inverse()
    };
    let information: Matrix2<f64> = pieces.iter().enumerate().filter_map(known).sum();
    let mut covariance = pieces[0].1.covariance;
    if let Some(joint) = information.try_inverse() {
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&joint);
    }
    covariance
}

fn is_near(a: &Pose2, b: &Pose2) -> bool {
    a.distance(b) < SAME_FIT.0 && angle_between(a.theta, b.theta) < SAME_FIT.1
}
