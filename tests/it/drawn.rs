//! Floors drawn from rectangles, and robots that drive there and send what they see.

use locution_engine::geometry::{Point2, Pose2};
use locution_engine::scan::Scan;
use locution_lab::simulation::{SimulationConfig, Task, World, simulate_run};
use locution_tests::Api;
use serde_json::{Value, json};

/// A rectangle of floor or of furniture: lower left and upper right corner, metres.
pub type Block = (f64, f64, f64, f64);

/// Edge of a cell, metres.
const RESOLUTION_M: f64 = 0.05;

/// A world of so many cells with some floor and something that stands on it.
pub fn drawn_world((width, height): (usize, usize), floor: &[Block], standing: &[Block]) -> World {
    let mut is_free = vec![false; width * height];
    let mut draw = |(x0, y0, x1, y1): Block, value: bool| {
        for y in (y0 / RESOLUTION_M) as usize..(y1 / RESOLUTION_M) as usize {
            for x in (x0 / RESOLUTION_M) as usize..(x1 / RESOLUTION_M) as usize {
                is_free[y * width + x] = value;
            }
        }
    };
    floor.iter().for_each(|block| draw(*block, true));
    standing.iter().for_each(|block| draw(*block, false));
    World::new(width, height, RESOLUTION_M, Point2::new(0.0, 0.0), is_free).unwrap()
}

/// Drives a route, sends it as a finished run of a site, and answers where the robot truly began.
pub async fn drive_route(
    api: &Api,
    (site, run): (&str, &str),
    world: &World,
    route: &[(f64, f64)],
    seed: u64,
) -> Pose2 {
    let task = Task::Route(route.iter().map(|&(x, y)| Point2::new(x, y)).collect());
    let simulated = simulate_run(world, &task, &SimulationConfig::default(), seed).unwrap();
    let geometry = &simulated.geometry;
    let pose = |pose: &Pose2| json!({"x": pose.x, "y": pose.y, "theta": pose.theta});
    let made = json!({"geometry": {
        "num_ranges": geometry.num_ranges,
        "angle_min_rad": geometry.angle_min_rad,
        "angle_increment_rad": geometry.angle_increment_rad,
        "range_max_m": geometry.range_max_m,
        "robot_from_laser": pose(&geometry.robot_from_laser),
    }});
    api.put(&format!("/v1/sites/{site}/runs/{run}"), &made).await.ok();
    let reading = |&range_m: &f32| if geometry.is_return(range_m) { json!(range_m) } else { Value::Null };
    let scan = |scan: &Scan| {
        json!({
            "timestamp_ns": scan.timestamp_ns,
            "odom_from_robot": pose(&scan.odom_from_robot),
            "ranges_m": scan.ranges_m.iter().map(reading).collect::<Vec<_>>(),
        })
    };
    let scans: Vec<Value> = simulated.scans.iter().map(scan).collect();
    api.post_all(site, run, &scans, 200).await;
    api.post(&format!("/v1/sites/{site}/runs/{run}/finish"), &json!({})).await.ok();
    simulated.truth[0].truth_from_robot
}
