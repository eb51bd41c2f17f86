//! Environment variables that begin like ours and are none: told, since a misspelled setting is otherwise not heard of.

use locution_server::config::ServerConfig;
use toml::Value;

/// What every one of our variables begins with.
const PREFIX: &str = "LOCUTION_";
/// Variables that are no setting of the server: of the command line, and of tests.
const OTHERS: [&str; 12] = [
    "URL",
    "API_KEY",
    "CONFIG",
    "DATASETS",
    "CASES",
    "BIN",
    "BINARY",
    "GOLDEN",
    "WORLDS",
    "CHECK_TOOLS",
    "CHECK_EXAMPLES",
    "CHECK_SECONDS",
];

/// Says on standard error which variables of our prefix nobody reads.
pub fn warn_of_unknown_variables() {
    let known = known_names();
    let names = std::env::vars_os().filter_map(|(name, _)| name.into_string().ok());
    for warning in names.filter_map(|name| warning(&name, &known)) {
        eprintln!("warning: {warning}");
    }
}

/// What is to be said of a variable, if anything.
fn warning(name: &str, known: &[String]) -> Option<String> {
    let setting = name.strip_prefix(PREFIX)?;
    if known.iter().any(|known| known == setting) {
        return None;
    }
    let likeness = |known: &&String| strsim::jaro_winkler(known, setting);
    let nearest = known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    let hint = match nearest.filter(|nearest| likeness(nearest) > 0.8) {
        Some(nearest) => format!("; did you mean {PREFIX}{nearest}?"),
        None => String::new(),
    };
    Some(format!("the environment variable {name} is not known and changes nothing{hint}"))
}

/// All names behind the prefix: every field of the server's configuration by its path, and the others.
fn known_names() -> Vec<String> {
    let mut names: Vec<String> = OTHERS.map(str::to_owned).to_vec();
    if let Ok(config) = Value::try_from(ServerConfig::default()) {
        add_paths(&config, String::new(), &mut names);
    }
    names
}

fn add_paths(value: &Value, path: String, names: &mut Vec<String>) {
    if let Value::Table(table) = value {
        for (key, value) in table {
            let separator = if path.is_empty() { "" } else { "__" };
            add_paths(value, format!("{path}{separator}{}", key.to_ascii_uppercase()), names);
        }
    }
    if !path.is_empty() {
        names.push(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspelled_variables_are_told_with_the_name_that_was_meant() {
        let known = known_names();
        for name in [
            "LOCUTION_ADDRESS",
            "LOCUTION_LIMITS__NUM_BATCHES_MAX",
            "LOCUTION_URL",
            "LOCUTION_LIMITS",
            "PATH",
        ] {
            assert_eq!(warning(name, &known), None);
        }
        let told = warning("LOCUTION_ADRESS", &known).unwrap();
        assert!(
            told.contains("LOCUTION_ADRESS") && told.contains("did you mean LOCUTION_ADDRESS?"),
            "{told}"
        );
        let told = warning("LOCUTION_LIMITS_NUM_BATCHES_MAX", &known).unwrap();
        assert!(told.contains("did you mean LOCUTION_LIMITS__NUM_BATCHES_MAX?"), "{told}");
        assert!(!warning("LOCUTION_QQQ", &known).unwrap().contains("did you mean"));
    }
}
