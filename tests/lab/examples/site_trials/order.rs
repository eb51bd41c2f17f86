//! The same recordings in every order: do they give the same map?

use locution_engine::geometry::Pose2;

use crate::Failure;
use crate::driven::Driven;
use crate::fleets::mapped;

/// Maps the runs in every order and says how far the maps differ.
pub fn all_orders(name: &str, runs: &[Driven]) -> Result<(), Failure> {
    let mut first: Option<Vec<(u32, Vec<Pose2>)>> = None;
    let (mut num_orders, mut num_other, mut worst_m) = (0, 0, 0.0f64);
    for order in orders((0..runs.len()).collect()) {
        let ordered: Vec<Driven> = order.iter().map(|&run| runs[run].clone()).collect();
        let (map, _) = mapped(&ordered)?;
        // By run as it was named, whatever its place in this order.
        let mut placed: Vec<(u32, Vec<Pose2>)> = vec![(0, Vec::new()); runs.len()];
        for (&run, mapped) in order.iter().zip(&map.runs) {
            placed[run] = (mapped.component, mapped.map_from_keyframes.clone());
        }
        println!("{name} {order:?}: {} components", map.num_components);
        num_orders += 1;
        match &first {
            Some(first) => {
                let same = |a: usize, b: usize| (first[a].0 == first[b].0) == (placed[a].0 == placed[b].0);
                let is_same = (0..runs.len()).all(|a| (0..a).all(|b| same(a, b)));
                num_other += u32::from(!is_same);
                worst_m = worst_m.max(differ_m(first, &placed));
            }
            None => first = Some(placed),
        }
    }
    println!(
        "{name}: {num_orders} orders, {num_other} with other components than the first, poses differ by at most {worst_m:.4} m"
    );
    Ok(())
}

/// How far keyframes lie from each other in two maps, seen from the beginning of the first run of their component.
fn differ_m(a: &[(u32, Vec<Pose2>)], b: &[(u32, Vec<Pose2>)]) -> f64 {
    let mut worst_m = 0.0f64;
    for (run, (component, poses)) in a.iter().enumerate() {
        let by = a.iter().position(|(other, _)| other == component).unwrap_or(run);
        for (pose, other) in poses.iter().zip(&b[run].1) {
            let relative = (a[by].1[0].between(pose), b[by].1[0].between(other));
            if b[by].0 == b[run].0 {
                worst_m = worst_m.max(relative.0.distance(&relative.1));
            }
        }
    }
    worst_m
}

/// All orders of a few numbers.
fn orders(left: Vec<usize>) -> Vec<Vec<usize>> {
    if left.is_empty() {
        return vec![Vec::new()];
    }
    let mut found = Vec::new();
    for &first in &left {
        let others = left.iter().copied().filter(|&other| other != first).collect();
        found.extend(orders(others).into_iter().map(|rest| [vec![first], rest].concat()));
    }
    found
}
