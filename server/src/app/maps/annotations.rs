//! What people draw into a map. It belongs to places, not to a version: the keyframes around it say where it lies in any.

use std::collections::{BTreeMap, BTreeSet};

use locution_engine::semantics::{Anchor, MovedPose, anchors_near, carry_point};

use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{Annotation, Key, Map, MapPose, RunIdx, Shape};
use crate::storage::Batch;

/// No site holds more: every answer that shows rooms reads them all.
const NUM_ANNOTATIONS_MAX: usize = 10_000;

/// What a person wants to have drawn.
#[derive(Clone, Debug)]
pub struct GivenAnnotation {
    pub kind: String,
    pub name: String,
    /// The component of the map in whose frame the shape is.
    pub component: u32,
    pub shape: Shape,
}

/// An annotation in a map.
#[derive(Clone, Debug)]
pub struct PlacedAnnotation {
    /// Its number in the site.
    pub id: u64,
    pub annotation: Annotation,
    /// The component and where in it; `None` in a map that holds none of the runs that drove there.
    pub place: Option<(u32, Shape)>,
}

/// The annotations of a component, or all, as far as they are of a kind, in the order of their making.
///
/// # Errors
/// Those of the storage.
pub async fn annotations(
    map: &Map,
    component: Option<u32>,
    kind: Option<&str>,
) -> Result<Vec<PlacedAnnotation>, AppError> {
    let mut poses = Poses::of(map);
    let mut placed = Vec::new();
    for (id, annotation) in map.reader().annotations().await? {
        if kind.is_some_and(|kind| kind != annotation.kind) {
            continue;
        }
        let place = poses.place(&annotation).await?;
        if component.is_none_or(|wanted| place.as_ref().is_some_and(|(component, _)| *component == wanted)) {
            placed.push(PlacedAnnotation { id, annotation, place });
        }
    }
    Ok(placed)
}

/// One annotation.
///
/// # Errors
/// [`AppError::NotFound`].
pub async fn an_annotation(map: &Map, id: u64) -> Result<PlacedAnnotation, AppError> {
    let annotation =
        map.reader().annotation(id).await?.ok_or_else(|| AppError::not_found("annotation", id))?;
    let place = Poses::of(map).place(&annotation).await?;
    Ok(PlacedAnnotation { id, annotation, place })
}

/// Draws something; answers its number.
///
/// # Errors
/// [`AppError::NotFound`] for a component without runs, [`AppError::Invalid`] when there are too many.
pub async fn annotate(site: &Site, map: &Map, given: GivenAnnotation) -> Result<u64, AppError> {
    if map.reader().annotations().await?.len() >= NUM_ANNOTATIONS_MAX {
        let problem = format!("a site holds at most {NUM_ANNOTATIONS_MAX} annotations");
        return Err(AppError::invalid("geometry", problem));
    }
    let annotation = anchored(map, given).await?;
    site.change(|record, batch| {
        let number = record.next_decision;
        record.next_decision += 1;
        batch.put(Key::Annotation(number).encode(), annotation.encode());
        Ok(number)
    })
    .await
}

/// Draws something else in the place of an annotation.
///
/// # Errors
/// [`AppError::NotFound`].
pub async fn change_annotation(
    site: &Site,
    map: &Map,
    id: u64,
    given: GivenAnnotation,
) -> Result<(), AppError> {
    let annotation = anchored(map, given).await?;
    write_over(site, id, |batch| batch.put(Key::Annotation(id).encode(), annotation.encode())).await
}

/// Forgets an annotation.
///
/// # Errors
/// [`AppError::NotFound`].
pub async fn delete_annotation(site: &Site, id: u64) -> Result<(), AppError> {
    write_over(site, id, |batch| batch.delete(Key::Annotation(id).encode())).await
}

/// Ties annotations that hang on runs which were deleted to others that drove there, as the map knows that still holds all
/// of them.
///
/// # Errors
/// Those of the storage.
pub async fn keep_annotations(site: &Site, map: &Map, deleted: &[RunIdx]) -> Result<(), AppError> {
    if deleted.is_empty() {
        return Ok(());
    }
    let mut poses = Poses::of(map);
    for (id, annotation) in map.reader().annotations().await? {
        if !annotation.anchors.iter().any(|anchor| deleted.contains(&anchor.run_idx)) {
            continue;
        }
        let Some((component, shape)) = poses.place(&annotation).await? else { continue };
        let mut keyframes = keyframes_of(map, component).await?;
        keyframes.retain(|anchor| !deleted.contains(&anchor.run_idx));
        let anchors = anchors_near(&shape.points(), &keyframes);
        if !anchors.is_empty() {
            let annotation = Annotation { shape, anchors, ..annotation };
            match write_over(site, id, |batch| batch.put(Key::Annotation(id).encode(), annotation.encode()))
                .await
            {
                // Somebody deleted it meanwhile.
                Ok(()) | Err(AppError::NotFound { .. }) => {}
                Err(error) => return Err(error),
            }
        }
    }
    Ok(())
}

/// Writes an annotation that is still there; what others write meanwhile is not lost.
async fn write_over(site: &Site, id: u64, write: impl Fn(&mut Batch)) -> Result<(), AppError> {
    loop {
        let seen = site.state().record.next_decision;
        if site.reader().annotation(id).await?.is_none() {
            return Err(AppError::not_found("annotation", id));
        }
        let is_written = site
            .change(|record, batch| {
                let is_as_seen = record.next_decision == seen;
                if is_as_seen {
                    record.next_decision += 1;
                    write(batch);
                }
                Ok(is_as_seen)
            })
            .await?;
        if is_written {
            return Ok(());
        }
    }
}

async fn anchored(map: &Map, given: GivenAnnotation) -> Result<Annotation, AppError> {
    let anchors = anchors_near(&given.shape.points(), &keyframes_of(map, given.component).await?);
    if anchors.is_empty() {
        return Err(AppError::not_found("component", given.component));
    }
    Ok(Annotation { kind: given.kind, name: given.name, shape: given.shape, anchors })
}

/// All keyframes of a component, in the order of runs.
async fn keyframes_of(map: &Map, component: u32) -> Result<Vec<Anchor>, AppError> {
    let mut keyframes = Vec::new();
    for run in map.record.runs.iter().filter(|run| run.component == component) {
        let anchor = |pose: &MapPose| Anchor {
            run_idx: run.run,
            scan_seq: pose.scan_seq,
            map_from_robot: pose.map_from_robot,
        };
        keyframes.extend(map.poses(run).await?.iter().map(anchor));
    }
    Ok(keyframes)
}

/// Poses of the keyframes of a map, read once for each run.
struct Poses<'a> {
    map: &'a Map,
    /// The component of every pose beside it.
    runs: BTreeMap<RunIdx, Vec<(u32, MapPose)>>,
}

impl<'a> Poses<'a> {
    fn of(map: &'a Map) -> Self {
        Self { map, runs: BTreeMap::new() }
    }

    /// Where an annotation lies: in the component that holds most of its anchors.
    async fn place(&mut self, annotation: &Annotation) -> Result<Option<(u32, Shape)>, AppError> {
        let mut by_component: BTreeMap<u32, Vec<MovedPose>> = BTreeMap::new();
        let runs: BTreeSet<RunIdx> = annotation.anchors.iter().map(|anchor| anchor.run_idx).collect();
        for run_idx in runs {
            if self.runs.contains_key(&run_idx) {
                continue;
            }
            let mut poses = Vec::new();
            for piece in self.map.record.pieces_of(run_idx) {
                poses.extend(self.map.poses(piece).await?.into_iter().map(|pose| (piece.component, pose)));
            }
            self.runs.insert(run_idx, poses);
        }
        for anchor in &annotation.anchors {
            let Some(poses) = self.runs.get(&anchor.run_idx) else { continue };
            if let Ok(idx) = poses.binary_search_by_key(&anchor.scan_seq, |(_, pose)| pose.scan_seq) {
                let (component, pose) = poses[idx];
                let moved = MovedPose { from: anchor.map_from_robot, to: pose.map_from_robot };
                by_component.entry(component).or_default().push(moved);
            }
        }
        let most = by_component.into_iter().rev().max_by_key(|(_, moved)| moved.len());
        Ok(most.and_then(|(component, moved)| {
            Some((component, annotation.shape.moved(|point| carry_point(point, &moved))?))
        }))
    }
}
