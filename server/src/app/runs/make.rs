//! Runs are made, or found as they stand.

use locution_engine::scan::ScanGeometry;

use crate::app::site::{RunChange, RunTranslator, Site, SiteEvent};
use crate::app::{App, AppError, Name};
use crate::records::{Key, ReadingRules, Run, RunHead, RunRecord, SiteRecord, codec};
use crate::storage::Batch;

/// What a client says of a run before it sends scans.
#[derive(Clone, Debug, PartialEq)]
pub struct NewRun {
    /// The robot, when there is more to say than the run's name.
    pub robot: Option<String>,
    /// The laser, checked.
    pub geometry: ScanGeometry,
    /// What is said of its readings, checked.
    pub readings: ReadingRules,
    /// Where the run belongs; it is never joined to runs of another area.
    pub area: Option<String>,
}

impl NewRun {
    fn is_like(&self, run: &RunRecord) -> bool {
        run.geometry == self.geometry
            && run.robot == self.robot
            && run.readings == self.readings
            && run.area == self.area
    }
}

impl App {
    /// Makes a run or finds it as it stands; true when it was made.
    ///
    /// # Errors
    /// [`AppError::Exists`] when the run stands with another geometry, robot or area, [`AppError::Invalid`] when the site
    /// is full.
    pub async fn make_run(&self, site: &Site, name: &Name, new: NewRun) -> Result<(Run, bool), AppError> {
        match site.run(name).await {
            Ok(run) if new.is_like(&run.record) => Ok((run, false)),
            Ok(_) => {
                let detail = format!("the run `{name}` stands with another geometry, robot or area");
                Err(AppError::Exists { detail })
            }
            Err(AppError::NotFound { .. }) => {
                // A laser that no translator takes is refused here, not at the first batch.
                let text_config = site.state().text_config()?;
                RunTranslator::new(&text_config.engine, &new.geometry, text_config.quantizer)?;
                self.create_run(site, name, new).await
            }
            Err(error) => Err(error),
        }
    }

    async fn create_run(&self, site: &Site, name: &Name, new: NewRun) -> Result<(Run, bool), AppError> {
        let num_runs_max = self.config().limits.num_runs_per_site_max;
        let NewRun { robot, geometry, readings, area } = new;
        let run = RunRecord { name: name.to_string(), robot, geometry, readings, area };
        let create = |record: &mut SiteRecord, batch: &mut Batch| {
            if record.num_runs - record.num_deleted_runs >= num_runs_max {
                return Err(AppError::invalid(
                    "run",
                    format!("the site holds {num_runs_max} runs, its limit"),
                ));
            }
            let idx = record.num_runs;
            record.num_runs += 1;
            batch.put(Key::RunName(run.name.clone()).encode(), codec::encode(&idx));
            batch.put(Key::Run(idx).encode(), run.encode());
            batch.put(Key::RunHead(idx).encode(), codec::encode(&RunHead::default()));
            Ok(())
        };
        let made = create_unless_named(site, name, create).await?;
        if made {
            site.events().tell(SiteEvent::Run { run: name.to_string(), change: RunChange::Made });
        }
        Ok((site.run(name).await?, made))
    }
}

/// Runs `create` unless a run of the name was made meanwhile; true when it ran.
async fn create_unless_named(
    site: &Site,
    name: &Name,
    create: impl FnOnce(&mut SiteRecord, &mut Batch) -> Result<(), AppError>,
) -> Result<bool, AppError> {
    let _queue = site.making_runs.lock().await;
    if site.reader().run_idx(name.as_str()).await?.is_some() {
        return Ok(false);
    }
    site.change(create).await?;
    Ok(true)
}
