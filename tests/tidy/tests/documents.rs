//! What the pages say of the code: links lead somewhere, names stand where the vocabulary says, sentences can be read.

use std::fs;
use std::path::{Path, PathBuf};

use locution_tidy::{check, sources, workspace};

/// Most words of a sentence that is read at once.
const LONG_SENTENCE_WORDS: usize = 40;
/// Share of longer sentences that a page may have.
const LONG_SENTENCES_MAX: f64 = 0.05;

fn pages(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut pending = vec![workspace().join(folder)];
    while let Some(folder) = pending.pop() {
        for entry in fs::read_dir(&folder).expect("the folder is part of the repository") {
            let path = entry.expect("a readable folder entry").path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Pages that a newcomer reads first.
fn first_pages() -> Vec<PathBuf> {
    let mut first = vec![workspace().join("README.md"), workspace().join("ARCHITECTURE.md")];
    first.extend(pages("docs/tour"));
    first
}

#[test]
fn links_lead_somewhere() {
    let mut all = pages("docs");
    all.extend(
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"]
            .map(|name| workspace().join(name)),
    );
    let mut complaints = Vec::new();
    let mut num_links = 0;
    for page in &all {
        let folder = page.parent().expect("a page lies in a folder");
        for target in read(page).split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let path = target.split('#').next().unwrap_or_default();
            if path.is_empty() || path.contains("://") {
                continue;
            }
            num_links += 1;
            if !folder.join(path).exists() {
                complaints.push(format!("{}: `{target}` leads nowhere", page.display()));
            }
        }
    }
    assert!(num_links > 30, "only {num_links} links were found");
    check(complaints);
}

#[test]
fn the_vocabulary_names_types_where_they_stand() {
    let page = read(&workspace().join("docs/vocabulary.md"));
    let mut complaints = Vec::new();
    let mut num_rows = 0;
    for row in page.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| word ")) {
        num_rows += 1;
        let names: Vec<&str> = row.split('`').skip(1).step_by(2).collect();
        let Some(path) = names.iter().find(|name| name.contains('/')) else { continue };
        let Some(name) = names.first().filter(|name| !name.contains('/')) else { continue };
        let place = workspace().join(path);
        if !place.exists() {
            complaints.push(format!("`{path}` of `{name}` does not exist"));
            continue;
        }
        let texts: Vec<String> = if place.is_dir() {
            sources(path).into_iter().map(|source| source.text).collect()
        } else {
            vec![read(&place)]
        };
        let is_there = texts.iter().any(|text| {
            ["struct ", "enum ", "type ", "trait ", "pub "]
                .iter()
                .any(|kind| text.contains(&format!("{kind}{name}")))
        });
        if !is_there {
            complaints.push(format!("`{name}` does not stand in `{path}`"));
        }
    }
    assert!(num_rows >= 40, "{num_rows} rows are not the whole vocabulary");
    check(complaints);
}

#[test]
fn sentences_of_the_first_pages_are_short() {
    let mut complaints = Vec::new();
    for page in first_pages() {
        let text = read(&page);
        // Code, tables and headings are not sentences.
        let prose = text.split("\n```").step_by(2).flat_map(|block| block.lines());
        let prose = prose.filter(|line| !line.starts_with('|') && !line.starts_with('#'));
        let prose =
            prose.map(|line| if line.trim().is_empty() { "." } else { line }).collect::<Vec<_>>().join(" ");
        let sentences: Vec<usize> = prose
            .split(['.', '!', '?', ':', ';'])
            .map(|sentence| {
                sentence.split_whitespace().filter(|word| word.chars().any(char::is_alphanumeric)).count()
            })
            .filter(|num_words| *num_words > 1)
            .collect();
        let num_long = sentences.iter().filter(|num_words| **num_words > LONG_SENTENCE_WORDS).count();
        if num_long as f64 > LONG_SENTENCES_MAX * sentences.len() as f64 {
            complaints.push(format!(
                "{}: {num_long} of {} sentences have more than {LONG_SENTENCE_WORDS} words",
                page.display(),
                sentences.len()
            ));
        }
    }
    check(complaints);
}

#[test]
fn every_section_that_is_cited_stands_in_the_specification() {
    let page = read(&workspace().join("docs/specification.md"));
    let sections: Vec<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("## "))
        .filter_map(|title| title.split('.').next())
        .collect();
    assert!(sections.contains(&"9"), "the sections are {sections:?}");
    let mut complaints = Vec::new();
    for folder in ["engine", "server/src", "clients", "tests"] {
        for source in sources(folder) {
            for (line_idx, line) in source.text.lines().enumerate() {
                for cited in line.split("SPEC section ").skip(1).chain(line.split("SPEC sections ").skip(1)) {
                    let number: String = cited.chars().take_while(char::is_ascii_digit).collect();
                    if !number.is_empty() && !sections.contains(&number.as_str()) {
                        complaints.push(source.complaint(line_idx, &format!("there is no section {number}")));
                    }
                }
            }
        }
    }
    check(complaints);
}
