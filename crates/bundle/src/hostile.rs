//! Bundles made to exhaust memory. A separate process refuses each of them, and the test measures
//! the peak memory of that process.

use std::{env, fs, io::Write as _, process::Command};

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::{
    description::{self, DESCRIPTION},
    tests::{bundle, contents, forked},
    *,
};

/// Size of a bundle's hostile part, bytes.
const LEN: usize = 48 << 20;

/// Largest memory of a bundle, per byte of its content.
const FACTOR: usize = 4;

/// Further memory of a process, bytes. Lists without numbers have a constant bound, whatever the
/// size of the content.
const BASE: usize = 160 << 20;

/// Names the bundle that a process of this test reads.
const VARIABLE: &str = "SWARM_TEST_BUNDLE";

fn repeated(text: &str) -> Vec<u8> {
    text.repeat(LEN / text.len()).into()
}

fn between(begin: &str, repeated: Vec<u8>, end: &str) -> Vec<u8> {
    [begin.as_bytes(), &repeated, end.as_bytes()].concat()
}

/// A bundle with another content of one file, and a matching description.
fn with(bundle: &Bundle, name: &str, content: Vec<u8>) -> Vec<u8> {
    let mut files = bundle.to_files();
    if let Some(file) = files.iter_mut().find(|file| file.name == name) {
        file.content.clone_from(&content);
    }
    let description = match name {
        DESCRIPTION => content,
        _ => description::describe(bundle, &files).into_bytes(),
    };
    let files = files.into_iter().map(|file| (file.name, file.content));
    archive([(DESCRIPTION, description)].into_iter().chain(files))
}

fn archive(files: impl IntoIterator<Item = (&'static str, Vec<u8>)>) -> Vec<u8> {
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in files {
        archive.start_file(name, options).unwrap();
        archive.write_all(&content).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// An entry of the log, or a state, with a list of 40 million empty lists.
fn empty_lists(before: &[u8]) -> Vec<u8> {
    // The length 40 million as a number of variable length, and then zeros.
    let mut bytes = [before, &[0x80, 0xb4, 0x89, 0x13]].concat();
    bytes.resize(40_000_000, 0);
    bytes
}

/// A bundle whose log begins with this entry.
fn with_entry(entry: Vec<u8>) -> Vec<u8> {
    let mut bundle = bundle().clone();
    bundle.log[0] = entry;
    with(&bundle, "", Vec::new())
}

/// A bundle of a fork that begins with this state.
fn with_state(state: Vec<u8>) -> Vec<u8> {
    let mut fork = forked();
    fork.keyframes[0].1 = state;
    with(&fork, "", Vec::new())
}

/// An archive with more entries than a ZIP directory without extensions can count.
fn many_entries() -> Vec<u8> {
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    (0..70_000).for_each(|entry| archive.start_file(format!("{entry}"), options).unwrap());
    archive.finish().unwrap().into_inner()
}

/// A bundle that states four billion bytes for a file of a few bytes.
fn lying_lengths() -> Vec<u8> {
    let mut bytes = archive(contents(bundle()));
    let marks: Vec<(usize, usize)> = bytes
        .windows(4)
        .enumerate()
        .filter_map(|(at, mark)| match mark {
            b"PK\x03\x04" => Some((at, 22)),
            b"PK\x01\x02" => Some((at, 24)),
            _ => None,
        })
        .collect();
    for (at, field) in marks {
        bytes[at + field..at + field + 4].copy_from_slice(&0xffff_fff0_u32.to_le_bytes());
    }
    bytes
}

fn cases() -> Vec<(&'static str, Vec<u8>)> {
    let original = bundle();
    let graph = |begin, repeated| between(begin, repeated, "0]}");
    let short = |bytes: Vec<u8>| bytes[..(4 << 20) - 100].to_vec();
    let entities = repeated("{\"\":0},");
    let manifest = String::from_utf8(original.to_files()[0].content.clone()).unwrap();
    let (before, _) = manifest.split_once("\"fork\": null").unwrap();
    let changes = |content| {
        let link = "0".repeat(64);
        let fork = format!(r#"{before}"fork": {{"generation": 0, "link": "{link}", "changes": ["#);
        between(&fork, content, "\"\"]}}")
    };
    let texts = repeated("\"\",");
    vec![
        ("entities", with(original, DESCRIPTION, graph("{\"@graph\":[", entities.clone()))),
        ("fewer", with(original, DESCRIPTION, graph("{\"@graph\":[", short(entities)))),
        ("deep", with(original, DESCRIPTION, short(graph("{\"@graph\":[", repeated("["))))),
        ("keys", with(original, DESCRIPTION, graph("{\"@graph\":[{", repeated("\"a\":[],")))),
        ("changes", with(original, "bundle.json", changes(texts.clone()))),
        ("fewer changes", with(original, "bundle.json", changes(texts[..3 << 20].to_vec()))),
        ("file", with(original, "experiment.json", repeated("[0,"))),
        ("commas", with(original, "history.csv", repeated(","))),
        ("lines", with(original, "history.csv", repeated("\n"))),
        ("quotes", with(original, "history.csv", repeated("\"\n\","))),
        ("champion", with(original, "champion.json", repeated("[0,"))),
        ("entries", with(original, "fitness-log.bin", vec![0; LEN])),
        ("states", with(original, "keyframes.bin", vec![0; LEN])),
        ("entry", with_entry(empty_lists(&[2]))),
        ("older entry", with_entry(empty_lists(&[1]))),
        ("state", with_state(empty_lists(&[1, 0, 0, 0]))),
        ("archive", many_entries()),
        ("lengths", lying_lengths()),
    ]
}

/// Reads and verifies a bundle; returns why it is refused.
fn refusal(bytes: &[u8]) -> String {
    let read = match Bundle::read(bytes) {
        Ok(read) => read,
        Err(error) => return error.to_string(),
    };
    let _: Result<ExperimentConfig, _> =
        ExperimentConfig::from_json(&read.config_json, "", ALGORITHMS).map(|(config, _)| config);
    let mut verification = match Verification::begin(&read, Sample::Drawn(0)) {
        Ok(verification) => verification,
        Err(flaw) => return flaw.to_string(),
    };
    loop {
        match verification.advance() {
            Ok(Some(_)) => {}
            Ok(None) => return String::new(),
            Err(flaw) => return flaw.to_string(),
        }
    }
}

/// Peak memory of this process, bytes; `None` if the system does not report it.
fn peak() -> Option<usize> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.trim().parse::<usize>().ok()? << 10)
}

#[test]
fn no_bundle_takes_more_memory_than_a_few_times_its_content() {
    if let Some(path) = env::var_os(VARIABLE) {
        let refusal = refusal(&fs::read(path).unwrap());
        // With a single thread, a test's name comes before on the same line.
        println!("\nrefused: {refusal}\npeak: {}\n", peak().unwrap());
        return;
    }
    if peak().is_none() {
        println!("SKIPPED: this system does not report the memory of a process");
        return;
    }
    let path = env::temp_dir().join(format!("swarm-hostile-{}.zip", std::process::id()));
    for (name, bytes) in cases() {
        fs::write(&path, &bytes).unwrap();
        let test = "hostile::no_bundle_takes_more_memory_than_a_few_times_its_content";
        let child = Command::new(env::current_exe().unwrap())
            .args(["--exact", test, "--nocapture"])
            .env(VARIABLE, &path)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&child.stdout).into_owned();
        assert!(child.status.success(), "{name}: {said}");
        let line = |key| said.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_default();
        let (why, peak): (&str, usize) = (line("refused: "), line("peak: ").parse().unwrap());
        assert!(!why.is_empty() && why.len() < 400, "{name}: {why}");
        let most = BASE + FACTOR * bytes.len();
        println!("{name}: {} MiB of {}: {why}", peak >> 20, bytes.len() >> 20);
        assert!(peak < most, "{name}: {} MiB, not {}; {why}", peak >> 20, most >> 20);
    }
    fs::remove_file(&path).unwrap();
}
