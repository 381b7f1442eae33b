//! The files of a bundle: writes the content of each as bytes, and reads it back.

use evolution::{Champion, ChampionSource};
use experiment_file::limits;

use super::{
    Bundle, BundleError, GenerationRow, Manifest,
    archive::{File, UNPACKED_LEN_MAX},
};

const MANIFEST: &str = "bundle.json";
const EXPERIMENT: &str = "experiment.json";
const HISTORY: &str = "history.csv";
const LOG: &str = "fitness-log.bin";
const KEYFRAMES: &str = "keyframes.bin";
const CHAMPION: &str = "champion.json";

/// All files except the description, still empty, in the order of the archive.
pub fn all() -> [File; 6] {
    let file = |name, about, encoding, len_max| File {
        name,
        about,
        encoding,
        len_max,
        content: Vec::new(),
    };
    let (json, binary) = ("application/json", "application/octet-stream");
    let file_len_max = limits::FILE_BYTES as u64;
    let (about, most) = ("Versions, digests and how the experiment ended", UNPACKED_LEN_MAX);
    [
        // The manifest of a fork lists the differences between two experiment files.
        file(MANIFEST, about, json, 4 * file_len_max),
        file(
            EXPERIMENT,
            "The experiment file in canonical form, with its seed",
            json,
            file_len_max,
        ),
        file(HISTORY, "Fitness, time and digest of every generation", "text/csv", most),
        file(LOG, "The fitness of every individual in every trial, bit for bit", binary, most),
        file(KEYFRAMES, "The state of evolution after some generations", binary, most),
        file(CHAMPION, "The champion, and what it is worth", json, most),
    ]
}

/// Largest length of a line of `history.csv`, bytes; a usual line has 200.
const LINE_LEN_MAX: usize = 1 << 10;

impl Bundle {
    /// The files except the description.
    pub(super) fn to_files(&self) -> [File; 6] {
        let mut files = all();
        files[0].content = write_manifest(&self.manifest);
        files[1].content = self.config_json.clone().into();
        files[2].content = write_history(&self.history);
        for entry in &self.log {
            frame(&mut files[3].content, entry);
        }
        for (n_generations, state) in &self.keyframes {
            files[4].content.extend(n_generations.to_le_bytes());
            frame(&mut files[4].content, state);
        }
        files[5].content = self.champion_json.clone().into();
        files
    }

    /// Reads a bundle from these files.
    pub(super) fn from_files(files: [File; 6]) -> Result<Self, BundleError> {
        let [manifest, experiment, history, log, keyframes, champion] = files;
        let malformed = BundleError::malformed;
        let text = |file: File| {
            String::from_utf8(file.content).map_err(|error| malformed(file.name, &error))
        };
        let about: Manifest = serde_json::from_slice(&manifest.content)
            .map_err(|error| malformed(MANIFEST, &error))?;
        // Each file has only one valid encoding, so every bit counts.
        let other_way = |file| malformed(file, &"it is not in the only valid encoding");
        if write_manifest(&about) != manifest.content {
            return Err(other_way(MANIFEST));
        }
        let rows = read_history(&history.content, limits::GENERATIONS)
            .map_err(|what| malformed(HISTORY, &what))?;
        if write_history(&rows) != history.content {
            return Err(other_way(HISTORY));
        }
        drop(history);
        // In memory, a row of the history takes more than an empty entry or state. So the number of
        // rows bounds the memory for entries and states. Entries of other generations are wrong; a
        // later check reports them.
        let n_max = rows.len() as u64 + 1;
        let entries = read_frames(&log.content, n_max).map_err(|what| malformed(LOG, &what))?;
        drop(log);
        Ok(Self {
            manifest: about,
            config_json: text(experiment)?,
            history: rows,
            log: entries,
            keyframes: read_keyframes(&keyframes.content, n_max)
                .map_err(|what| malformed(KEYFRAMES, &what))?,
            champion_json: text(champion)?,
        })
    }
}

/// A champion as JSON: `swarmctl simulate --genotype` takes it.
pub fn champion_json(champion: &Champion) -> String {
    // Databases do not keep the sign of zero, so this file omits the sign where it may be lost.
    let Champion { generation, source, genotype, trial_fitness, held_out, judged } = champion;
    let individual = match source {
        ChampionSource::Individual(index) => Some(index),
        ChampionSource::Mean => None,
    };
    let document = serde_json::json!({
        "generation": generation,
        "individual": individual,
        "trial_fitness": trial_fitness,
        "selection": held_out.map(|selection| serde_json::json!({
            "mean": selection.mean.get() + 0.0, "ci95": selection.ci95,
            "trials": selection.n_trials, "generation": selection.generation,
        })),
        "judged": judged.map(|judgement| serde_json::json!({
            "mean": judgement.mean.get() + 0.0,
            "low": judgement.low.get() + 0.0, "high": judgement.high.get() + 0.0,
            "trials": judgement.n_trials, "generation": judgement.generation,
        })),
        "genotype": genotype,
    });
    serde_json::to_string_pretty(&document).expect("JSON serialises")
}

fn write_manifest(manifest: &Manifest) -> Vec<u8> {
    serde_json::to_vec_pretty(manifest).expect("plain data serialises")
}

fn write_history(history: &[GenerationRow]) -> Vec<u8> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in history {
        table.serialize(row).expect("numbers and text are a row");
    }
    table.into_inner().expect("memory can be written")
}

/// Reads the history. `n_max`: largest number of generations.
fn read_history(bytes: &[u8], n_max: u64) -> Result<Vec<GenerationRow>, String> {
    // A comma takes many bytes in a parsed record, and a quote would hide line ends.
    let is_long = |line: &[u8]| line.len() > LINE_LEN_MAX;
    if bytes.contains(&b'"') || bytes.split(|&byte| byte == b'\n').any(is_long) {
        return Err(format!("a line has a quote, or more than {LINE_LEN_MAX} bytes"));
    }
    let mut history = Vec::new();
    for (generation, row) in (0..).zip(csv::Reader::from_reader(bytes).into_deserialize()) {
        let row: GenerationRow = row.map_err(|error| error.to_string())?;
        if generation >= n_max {
            return Err(too_many(n_max));
        }
        if row.generation != generation {
            return Err(format!("generation {generation} is out of place"));
        }
        history.push(row);
    }
    Ok(history)
}

/// Appends the length of `bytes`, in 8 bytes, little-endian, and then `bytes`.
fn frame(file: &mut Vec<u8>, bytes: &[u8]) {
    file.extend((bytes.len() as u64).to_le_bytes());
    file.extend(bytes);
}

/// The number at the beginning, and the remaining bytes.
fn number(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u64::from_le_bytes(*number), rest))
}

/// The bytes of the first [`frame`], and the remaining bytes.
fn unframe(bytes: &[u8]) -> Option<(Vec<u8>, &[u8])> {
    let (len, rest) = number(bytes)?;
    let (content, rest) = rest.split_at_checked(usize::try_from(len).ok()?)?;
    Some((content.to_vec(), rest))
}

/// Reads frames. `n_max`: largest number of frames.
fn read_frames(mut bytes: &[u8], n_max: u64) -> Result<Vec<Vec<u8>>, String> {
    let mut frames = Vec::new();
    while !bytes.is_empty() {
        let (content, rest) = unframe(bytes).ok_or_else(cut_off)?;
        frames.push(content);
        bytes = rest;
        if frames.len() as u64 > n_max {
            return Err(too_many(n_max));
        }
    }
    Ok(frames)
}

/// Reads keyframes. `n_max`: largest number of keyframes.
fn read_keyframes(mut bytes: &[u8], n_max: u64) -> Result<Vec<(u64, Vec<u8>)>, String> {
    let mut keyframes = Vec::new();
    while !bytes.is_empty() {
        let (n_generations, rest) = number(bytes).ok_or_else(cut_off)?;
        let (state, rest) = unframe(rest).ok_or_else(cut_off)?;
        if keyframes.last().is_some_and(|&(before, _)| before >= n_generations) {
            return Err("its keyframes are not in order".to_owned());
        }
        keyframes.push((n_generations, state));
        if keyframes.len() as u64 > n_max {
            return Err(too_many(n_max));
        }
        bytes = rest;
    }
    Ok(keyframes)
}

fn cut_off() -> String {
    "it is cut off".to_owned()
}

fn too_many(n_max: u64) -> String {
    format!("it has more than {n_max} generations")
}

#[cfg(test)]
mod tests {
    use evolution::{Digest, Statistics};

    use super::*;

    /// Frames of these lengths.
    fn frames(lengths: &[usize]) -> Vec<u8> {
        let mut file = Vec::new();
        lengths.iter().for_each(|&len| frame(&mut file, &vec![7; len]));
        file
    }

    fn keyframes(numbers: &[u64]) -> Vec<u8> {
        let mut file = Vec::new();
        for number in numbers {
            file.extend(number.to_le_bytes());
            frame(&mut file, b"state");
        }
        file
    }

    #[test]
    fn a_log_has_at_most_one_entry_per_generation() {
        assert_eq!(read_frames(&frames(&[3, 0, 5]), 3).unwrap()[2], [7; 5]);
        assert_eq!(read_frames(&frames(&[3, 0, 5]), 2), Err(too_many(2)));
    }

    #[test]
    fn no_length_leads_beyond_the_end() {
        let whole = frames(&[3, 5]);
        for len in (1..whole.len()).filter(|&len| len != 8 + 3) {
            assert_eq!(read_frames(&whole[..len], 9), Err(cut_off()), "{len}");
        }
        for huge in [6, u64::from(u32::MAX), u64::MAX] {
            let mut lie = whole.clone();
            lie[11..19].copy_from_slice(&huge.to_le_bytes());
            assert_eq!(read_frames(&lie, 9), Err(cut_off()), "{huge}");
        }
        let whole = keyframes(&[1, 2]);
        for len in (1..whole.len()).filter(|&len| len != whole.len() / 2) {
            assert_eq!(read_keyframes(&whole[..len], 9), Err(cut_off()), "{len}");
        }
    }

    #[test]
    fn keyframes_are_in_order_and_at_most_one_per_generation() {
        assert_eq!(read_keyframes(&keyframes(&[1, 4]), 2).unwrap()[1].0, 4);
        for numbers in [[4, 1], [4, 4]] {
            let error = read_keyframes(&keyframes(&numbers), 2).unwrap_err();
            assert!(error.contains("not in order"), "{error}");
        }
        assert_eq!(read_keyframes(&keyframes(&[1, 4, 7]), 2), Err(too_many(2)));
    }

    #[test]
    fn a_history_has_one_row_per_generation_each_in_its_place() {
        let Statistics { best, mean, min, standard_deviation } =
            Statistics::from_fitness(&[1.0, 0.0]);
        let row = GenerationRow {
            generation: 0,
            best,
            mean,
            min,
            standard_deviation,
            episodes: 1,
            duration_ms: 1,
            completed_at_ms: 1,
            workers: 1,
            idle_share: 0.0,
            digest: Digest::default(),
        };
        let two = write_history(&[row.clone(), GenerationRow { generation: 1, ..row }]);
        assert_eq!(read_history(&two, 2).unwrap().len(), 2);
        assert_eq!(read_history(&two, 1).unwrap_err(), too_many(1));
        let twice = String::from_utf8(two).unwrap().replace("\n1,", "\n0,");
        let error = read_history(twice.as_bytes(), 9).unwrap_err();
        assert!(error.contains("generation 1 is out of place"), "{error}");
    }
}
