//! Simulated runs as the map builder sees them, and a building for them.

use locution_engine::config::EngineConfig;
use locution_engine::geometry::{Point2, Pose2};
use locution_engine::mapping::{Keyframe, RunRecord};
use locution_engine::scan::ScanGeometry;
use locution_engine::text::{Observation, Word};
use locution_engine::translator::{Translation, Translator};
use locution_lab::simulation::{SimulatedRun, SimulationConfig, Task, World, simulate_run};

/// A run as the map builder sees it, with the truth of the simulator.
pub struct Driven {
    pub geometry: ScanGeometry,
    pub observations: Vec<Observation>,
    pub words: Vec<Word>,
    pub keyframes: Vec<Keyframe>,
    pub simulated: SimulatedRun,
}

impl Driven {
    pub fn new(world: &World, waypoints: &[(f64, f64)], seed: u64) -> Self {
        let task = Task::Route(waypoints.iter().map(|&(x, y)| Point2::new(x, y)).collect());
        let simulated = simulate_run(world, &task, &SimulationConfig::default(), seed).unwrap();
        let config = EngineConfig::default().translator;
        let mut translator = Translator::new(&config, simulated.geometry.clone()).unwrap();
        let (mut observations, mut words, mut keyframes) = (Vec::new(), Vec::new(), Vec::new());
        let mut take = |translation: Translation| {
            observations.extend(translation.observations);
            words.extend(translation.words);
            if let Some(pose) = translation.keyframe {
                keyframes.push(Keyframe {
                    scan_seq: pose.scan_seq,
                    timestamp_ns: pose.timestamp_ns,
                    odom_from_robot: pose.odom_from_robot,
                    run_from_robot: pose.run_from_robot,
                    motion_covariance: pose.motion_covariance,
                    ranges_m: simulated.scans[pose.scan_seq as usize].ranges_m.clone(),
                });
            }
        };
        for scan in &simulated.scans {
            take(translator.push(scan));
        }
        take(translator.finish());
        Self { geometry: simulated.geometry.clone(), observations, words, keyframes, simulated }
    }

    pub fn record(&self) -> RunRecord<'_> {
        RunRecord {
            geometry: &self.geometry,
            observations: &self.observations,
            words: &self.words,
            keyframes: &self.keyframes,
            area: None,
        }
    }

    pub fn world_from(&self, keyframe_idx: usize) -> Pose2 {
        self.simulated.truth[self.keyframes[keyframe_idx].scan_seq as usize].truth_from_robot
    }
}

/// A corridor round a block, 30 m × 20 m, with niches and side rooms that make every part of it its own.
pub fn ring_world() -> World {
    let rooms = [
        (1.0, 1.0, 29.0, 3.0),
        (1.0, 17.0, 29.0, 19.0),
        (1.0, 1.0, 3.0, 19.0),
        (27.0, 1.0, 29.0, 19.0),
        (6.0, 3.0, 7.2, 7.0),
        (10.0, 3.0, 15.0, 8.0),
        (19.0, 15.0, 20.0, 17.0),
        (22.0, 12.0, 26.0, 17.0),
        (3.0, 10.0, 5.5, 11.5),
        (24.0, 5.0, 27.0, 6.0),
    ];
    world(&rooms)
}

/// A world of rectangles that are free.
pub fn world(rooms: &[(f64, f64, f64, f64)]) -> World {
    let (width, height, resolution_m) = (600, 400, 0.05);
    let mut is_free = vec![false; width * height];
    for &(x0, y0, x1, y1) in rooms {
        for y in (y0 / resolution_m) as usize..(y1 / resolution_m) as usize {
            for x in (x0 / resolution_m) as usize..(x1 / resolution_m) as usize {
                is_free[y * width + x] = true;
            }
        }
    }
    World::new(width, height, resolution_m, Point2::new(0.0, 0.0), is_free).unwrap()
}
