//! Prints the verified matches of a site: `cargo run --example matches -- http://127.0.0.1:7070 office`

use locution_client::{Client, ClientError, MatchFilter, MatchState};

#[tokio::main]
async fn main() -> Result<(), ClientError> {
    let mut arguments = std::env::args().skip(1);
    let url = arguments.next().unwrap_or("http://127.0.0.1:7070".into());
    let site = arguments.next().unwrap_or("office".into());
    let client = Client::new(&url)?;
    let filter = MatchFilter { state: Some(MatchState::Verified), ..MatchFilter::default() };
    for found in client.matches(&site, &filter).await? {
        let (earlier, later) = (&found.earlier, &found.later);
        println!(
            "{} {}–{} is where {} {}–{} was, with probability {:.3}",
            later.run, later.first, later.last, earlier.run, earlier.first, earlier.last, found.probability
        );
    }
    Ok(())
}
