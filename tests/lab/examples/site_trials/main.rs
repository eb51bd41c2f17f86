//! Trials of the map builder without a server: fleets, strangers, orders of making, growth (SPEC section 9).
//!
//! - `fleets 200 1 ipa-office-c stage-hospital`: three robots of 150 m with unknown starts in each world, two people
//!   walking; false and missed joins. The numbers are the first seed and how many fleets of a world.
//! - `strangers 200 ipa-lab-a ipa-office-a`: one robot in each world, all in one site; nothing may be joined.
//! - `recordings wean1 wean3 intel/1/2 intel/2/2`: recordings or parts of them in one site, judged by their truth.
//! - `order recordings wean1 wean3 wean4`, `order fleet ipa-lab-a 200`: every order must give the same map.
//! - `growth 20 ipa-lab-a`: so many runs of 80 m in a world and its furnished twin, three people walking; one is added
//!   after the other, a line for each, and in the end all are mapped from nothing.
//!
//! A line of JSON for every site, a sum at the end. `LOCUTION_DATASETS` says where worlds and recordings are;
//! `LOCUTION_DRIVES` names a folder in which drives are kept, for trials of the map builder alone: empty it when
//! simulation or translation change.

mod driven;
mod fleets;
mod growth;
mod order;

use driven::Driven;
use fleets::{FleetReport, judged, mapped};

type Failure = anyhow::Error;

/// Metres that each robot of a fleet drives.
const LENGTH_M: f64 = 150.0;
/// People who walk about meanwhile.
const NUM_PEOPLE: usize = 2;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["fleets", first_seed, num_fleets, worlds @ ..] => {
            all_fleets(first_seed.parse()?, num_fleets.parse()?, worlds)
        }
        ["strangers", seed, worlds @ ..] => strangers(seed.parse()?, worlds),
        ["order", "recordings", names @ ..] => {
            let runs = names.iter().map(|name| Driven::recorded(name)).collect::<Result<Vec<_>, _>>()?;
            order::all_orders(&names.join(" "), &runs)
        }
        ["order", "fleet", world, first_seed] => {
            let first_seed: u64 = first_seed.parse()?;
            let runs = (first_seed..first_seed + 3)
                .map(|seed| Driven::wandering(world, LENGTH_M, NUM_PEOPLE, seed))
                .collect::<Result<Vec<_>, _>>()?;
            order::all_orders(&format!("{world} {first_seed}"), &runs)
        }
        ["recordings", names @ ..] => {
            let runs = names.iter().map(|name| Driven::recorded(name)).collect::<Result<Vec<_>, _>>()?;
            let (map, seconds) = mapped(&runs)?;
            println!("{}", serde_json::to_string(&judged(&names.join(" "), &runs, &map, seconds))?);
            Ok(())
        }
        ["growth", num_runs, world] => growth::grow(num_runs.parse()?, world),
        _ => {
            Err(anyhow::anyhow!("say fleets, strangers, order or growth; the head of the program tells how"))
        }
    }
}

fn all_fleets(first_seed: u64, num_fleets: u64, worlds: &[&str]) -> Result<(), Failure> {
    let mut reports = Vec::new();
    for world in worlds {
        for fleet in 0..num_fleets {
            let seeds = (0..3).map(|robot| first_seed + 3 * fleet + robot);
            let runs = seeds
                .map(|seed| Driven::wandering(world, LENGTH_M, NUM_PEOPLE, seed))
                .collect::<Result<Vec<_>, _>>()?;
            let (map, seconds) = mapped(&runs)?;
            let report = judged(&format!("{world} {}", first_seed + 3 * fleet), &runs, &map, seconds);
            println!("{}", serde_json::to_string(&report)?);
            reports.push(report);
        }
    }
    let count = |of: &dyn Fn(&FleetReport) -> bool| reports.iter().filter(|report| of(report)).count();
    println!(
        "{} fleets: {} with false joins, {} with missed joins, {} of {} that should be one are",
        reports.len(),
        count(&|report| !report.false_joins.is_empty()),
        count(&|report| !report.missed_joins.is_empty()),
        count(&|report| report.should_be_one && report.num_components == 1),
        count(&|report| report.should_be_one)
    );
    Ok(())
}

fn strangers(seed: u64, worlds: &[&str]) -> Result<(), Failure> {
    let runs = worlds
        .iter()
        .map(|world| Driven::wandering(world, LENGTH_M, NUM_PEOPLE, seed))
        .collect::<Result<Vec<_>, _>>()?;
    let (map, seconds) = mapped(&runs)?;
    let report = judged(&format!("strangers {seed}"), &runs, &map, seconds);
    println!("{}", serde_json::to_string(&report)?);
    Ok(())
}
