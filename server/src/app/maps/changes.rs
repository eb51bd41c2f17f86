//! What changed between the runs of two sessions, as the engine compares them at their map poses.

use locution_engine::geometry::{Point2, Pose2};
use locution_engine::mapping::{Change, Keyframe, PlacedRun, find_changes};
use locution_engine::scan::ScanGeometry;

use crate::app::site::Site;
use crate::app::{App, AppError, on_blocking_thread};
use crate::records::{Map, MapRecord, MapRun};

/// The runs of two sessions in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Sessions {
    /// The frame that they share.
    pub component: u32,
    /// Runs of the first session.
    pub before: Vec<MapRun>,
    /// Runs of the second.
    pub after: Vec<MapRun>,
}

/// Why two sets of runs cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoSessions {
    /// A run that is not in the map.
    UnknownRun(String),
    /// The field that names it, and what is wrong.
    Invalid(&'static str, String),
}

impl Sessions {
    /// Names two sessions. Unless said, the second is the latest run of the map and the first all other runs of its
    /// component.
    ///
    /// # Errors
    /// Names that are not in the map, runs without a common frame, a run in both sessions, a session without runs.
    pub fn new(
        map: &MapRecord,
        before: Option<&[String]>,
        after: Option<&[String]>,
    ) -> Result<Self, NoSessions> {
        let placed = || map.runs.iter().filter(|run| run.num_poses > 0);
        let named = |names: &[String]| -> Result<Vec<MapRun>, NoSessions> {
            let mut named = Vec::new();
            for name in names {
                let found: Vec<MapRun> = placed().filter(|run| run.name == *name).cloned().collect();
                if found.is_empty() {
                    return Err(NoSessions::UnknownRun(name.clone()));
                }
                named.extend(found);
            }
            Ok(named)
        };
        let after = match after {
            Some(names) => named(names)?,
            None => placed().next_back().into_iter().cloned().collect(),
        };
        let Some(component) = after.first().map(|run| run.component) else {
            return Err(NoSessions::Invalid("after", "the map has no run to compare".into()));
        };
        let is_after = |run: &&MapRun| after.iter().any(|other| other.run == run.run);
        let before = match before {
            Some(names) => named(names)?,
            None => placed().filter(|run| run.component == component && !is_after(run)).cloned().collect(),
        };
        if before.is_empty() {
            return Err(NoSessions::Invalid(
                "before",
                "no other run shares the frame of the second session".into(),
            ));
        }
        if let Some(twice) = before.iter().find(is_after) {
            return Err(NoSessions::Invalid("before", format!("`{}` is in both sessions", twice.name)));
        }
        for (field, runs) in [("before", &before), ("after", &after)] {
            if let Some(apart) = runs.iter().find(|run| run.component != component) {
                let detail = format!("`{}` shares no frame with `{}`", apart.name, after[0].name);
                return Err(NoSessions::Invalid(field, detail));
            }
        }
        Ok(Self { component, before, after })
    }
}

/// A visit that saw a changed area.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChangeVisit {
    /// Name of the run.
    pub run: String,
    /// When it ended, if it saw the area as it was; when it began, if it saw it as it is. Nanoseconds.
    pub timestamp_ns: i64,
}

/// A change, and between which two visits it happened.
#[derive(Clone, Debug)]
pub struct DatedChange {
    pub change: Change,
    /// The last that saw it as it was.
    pub last_as_before: Option<ChangeVisit>,
    /// The first that saw it as it is.
    pub first_as_after: Option<ChangeVisit>,
}

/// A run as the comparison wants it.
struct LoadedRun {
    geometry: ScanGeometry,
    keyframes: Vec<Keyframe>,
    poses: Vec<Pose2>,
    densities: Vec<(Point2, f32)>,
}

impl LoadedRun {
    async fn load(map: &Map, map_run: &MapRun) -> Result<Self, AppError> {
        let run = map.reader().run(map_run.run).await?;
        let poses: Vec<Pose2> = map.poses(map_run).await?.iter().map(|pose| pose.map_from_robot).collect();
        // Other pieces lie elsewhere, and what was sent after the map was built has no place in it.
        let of_piece = run.keyframes().await?.into_iter().skip(map_run.first_keyframe as usize);
        let keyframes = of_piece.take(poses.len()).collect();
        let observations = run.all_observations().await?;
        let trajectory = map.trajectory(map_run).await?;
        let densities = observations
            .iter()
            .filter(|observation| map_run.scans().contains(&observation.scan_seq))
            .filter_map(|observation| {
                let pose = trajectory.at(observation.scan_seq, &observation.run_from_robot)?;
                Some((pose.position(), *observation.densities.first()?))
            })
            .collect();
        let geometry = run.record.geometry.clone();
        Ok(Self { geometry, keyframes, poses, densities })
    }

    fn as_placed(&self) -> PlacedRun<'_> {
        PlacedRun {
            geometry: &self.geometry,
            keyframes: &self.keyframes,
            map_from_keyframes: &self.poses,
            densities: &self.densities,
        }
    }
}

fn placed(runs: &[LoadedRun]) -> Vec<PlacedRun<'_>> {
    runs.iter().map(LoadedRun::as_placed).collect()
}

impl App {
    /// What changed from one session to the other, largest first.
    pub async fn changes(
        &self,
        site: &Site,
        map: &Map,
        sessions: &Sessions,
    ) -> Result<Vec<DatedChange>, AppError> {
        // One comparison or drawing at a time bounds the memory that they take.
        let _turn = self.drawing.lock().await;
        let (mut before, mut after) = (Vec::new(), Vec::new());
        for run in &sessions.before {
            before.push(LoadedRun::load(map, run).await?);
        }
        for run in &sessions.after {
            after.push(LoadedRun::load(map, run).await?);
        }
        let config = site.state().config.mapping.changes.clone();
        let runs = sessions.before.iter().chain(&sessions.after).map(|run| run.name.clone());
        let loaded = before.iter().chain(&after);
        let visits: Vec<(String, Option<i64>, Option<i64>)> = runs
            .zip(loaded)
            .map(|(name, run)| {
                let time = |keyframe: Option<&Keyframe>| keyframe.map(|keyframe| keyframe.timestamp_ns);
                (name, time(run.keyframes.first()), time(run.keyframes.last()))
            })
            .collect();
        let changes = on_blocking_thread(move || find_changes(&placed(&before), &placed(&after), &config))
            .await?
            .map_err(AppError::internal)?;
        let visit = |(name, timestamp_ns): (&String, Option<i64>)| {
            timestamp_ns.map(|timestamp_ns| ChangeVisit { run: name.clone(), timestamp_ns })
        };
        let dated = |change: Change| {
            let last = change.last_as_before.and_then(|idx| visits.get(idx));
            let first = change.first_as_after.and_then(|idx| visits.get(idx));
            DatedChange {
                last_as_before: last.and_then(|(name, _, ended_ns)| visit((name, *ended_ns))),
                first_as_after: first.and_then(|(name, began_ns, _)| visit((name, *began_ns))),
                change,
            }
        };
        Ok(changes.into_iter().map(dated).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> MapRecord {
        let run = |idx: u32, component| MapRun {
            run: idx,
            name: format!("r{idx}"),
            component,
            first_pose: 0,
            num_poses: 5,
            first_label: 0,
            num_labels: 0,
            num_scans: 9,
            length_m: 1.0,
            first_scan: 0,
            first_observation: 0,
            first_keyframe: 0,
        };
        MapRecord {
            version: 1,
            num_components: 2,
            runs: vec![run(0, 0), run(1, 1), run(2, 0), run(3, 0)],
            ..MapRecord::default()
        }
    }

    fn names(runs: &[MapRun]) -> Vec<&str> {
        runs.iter().map(|run| run.name.as_str()).collect()
    }

    #[test]
    fn the_latest_run_is_compared_with_the_others_of_its_frame_unless_said() {
        let found = Sessions::new(&map(), None, None).unwrap();
        assert_eq!((names(&found.before), names(&found.after)), (vec!["r0", "r2"], vec!["r3"]));
        let found = Sessions::new(&map(), None, Some(&["r0".into()])).unwrap();
        assert_eq!((found.component, names(&found.before)), (0, vec!["r2", "r3"]));
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let map = map();
        let ask = |before: &str, after: &str| {
            Sessions::new(&map, Some(&[before.to_owned()]), Some(&[after.to_owned()])).unwrap_err()
        };
        assert_eq!(ask("r0", "r9"), NoSessions::UnknownRun("r9".into()));
        assert!(matches!(ask("r1", "r0"), NoSessions::Invalid("before", _)));
        assert!(matches!(ask("r0", "r0"), NoSessions::Invalid("before", _)));
        let alone = Sessions::new(&map, None, Some(&["r1".into()])).unwrap_err();
        assert!(matches!(alone, NoSessions::Invalid("before", _)));
    }
}
