//! The experiments that are part of this program, so that users can evolve or copy one without the
//! repository.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use experiment_file::{ScriptConfig, inline_script, script_path};

use crate::experiment_file::ExperimentFile;

/// An experiment of `configs/`.
#[derive(Debug, PartialEq, Eq)]
pub struct Example {
    /// The name of the experiment, which its file gives.
    pub name: &'static str,
    /// A shorter name, which commands take as well.
    alias: Option<&'static str>,
    /// The experiment file.
    pub config: &'static str,
    /// The script of its task, unless the task is built in.
    pub script: Option<&'static str>,
    /// The experiment, in a sentence.
    pub about: &'static str,
}

macro_rules! example {
    ($name:literal, $folder:literal, $alias:expr, $script:expr, $about:literal) => {
        Example {
            name: $name,
            alias: $alias,
            config: include_str!(concat!("../../configs/", $folder, $name, ".json")),
            script: $script,
            about: $about,
        }
    };
}

/// An experiment whose task is built in.
macro_rules! built_in {
    ($name:literal, $folder:literal, $alias:literal, $about:literal) => {
        example!($name, $folder, Some($alias), None, $about)
    };
}

/// An experiment whose task is a script.
macro_rules! scripted {
    ($name:literal, $about:literal) => {
        example!(
            $name,
            "tasks/",
            None,
            Some(include_str!(concat!("../../configs/tasks/", $name, ".star"))),
            $about
        )
    };
}

/// All examples, from the quickest to those that take minutes.
pub const EXAMPLES: [Example; 21] = [
    built_in!("quickstart", "", "leader", "Five robots agree on a leader by radio, in seconds"),
    scripted!("dispersion", "Robots spread out; they sense how near others are"),
    scripted!("aggregation", "Robots gather; they sense where others are"),
    scripted!("scent", "Robots find a source with a sensor that the script defines"),
    scripted!("flocking", "Robots travel together; the fitness is a product of three measures"),
    scripted!("foraging", "Robots carry food to a nest; the script remembers the loaded robots"),
    scripted!(
        "predator",
        "Robots flee from a light that the script moves; caught robots stand still"
    ),
    scripted!("chain", "Robots connect two areas: each hears the next"),
    scripted!("division_of_labour", "Robots divide: half of them on each of two areas"),
    scripted!("synchronisation", "Robots flash together, without a clock that they share"),
    scripted!("transport", "Robots with bodies push a box through a door; one cannot move it"),
    scripted!("slalom", "Robots with bodies drive to a lamp behind a field of obstacles"),
    scripted!("gather", "Robots with bodies gather in a room, with one bit of sight"),
    scripted!("harvest", "Robots with bodies carry food through a door to a nest"),
    scripted!("maze", "Robots with bodies explore a maze"),
    scripted!("cluster", "Kilobots gather in a room; they sense distances only"),
    built_in!(
        "leader_selection_snes",
        "",
        "leader_selection",
        "Experiment A of the thesis: robots agree on a leader by radio"
    ),
    built_in!(
        "borderline_snes",
        "",
        "borderline",
        "Experiment B: robots find out whether they are at the border of the swarm"
    ),
    built_in!(
        "orientation_consensus_snes",
        "",
        "orientation_consensus",
        "Experiment C: robots agree on a direction"
    ),
    built_in!(
        "light_follower_snes",
        "",
        "light_follower",
        "Experiment D: robots follow a light that few of them see"
    ),
    built_in!(
        "leader_selection_lif",
        "spiking/",
        "leader_selection_spiking",
        "Experiment A with neurons that spike"
    ),
];

impl Example {
    /// The experiment file, its script within it.
    pub fn file(&self) -> ExperimentFile {
        let text = match (script_path(self.config), self.script) {
            (Some((name, place)), Some(script)) => {
                let script = ScriptConfig { text: script.into(), name };
                inline_script(self.config, place, &script)
            }
            _ => self.config.to_owned(),
        };
        ExperimentFile::new(PathBuf::from(format!("{}.json", self.name)), text)
    }
}

/// Reads the name of an example from a command line.
pub fn parser() -> impl TypedValueParser<Value = &'static Example> {
    let value = |example: &'static Example| {
        PossibleValue::new(example.name).aliases(example.alias).help(example.about)
    };
    PossibleValuesParser::new(EXAMPLES.iter().map(value)).map(|name| {
        let is_it = |example: &&Example| example.name == name || example.alias == Some(&name);
        EXAMPLES.iter().find(is_it).expect("the parser takes no other")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment_file::{Overrides, tests::shipped};

    #[test]
    fn an_example_is_the_experiment_of_its_file_to_the_bit() {
        let folders = ["", "tasks/", "spiking/"];
        for example in &EXAMPLES {
            let paths = folders.map(|folder| shipped(&format!("{folder}{}", example.name)));
            let path = paths.iter().find(|path| path.exists()).unwrap();
            let canonical = |file: &ExperimentFile| {
                file.compile(&Overrides::default()).unwrap().config.to_canonical_json()
            };
            let of_file = canonical(&ExperimentFile::read(path).unwrap());
            assert_eq!(canonical(&example.file()), of_file);
            assert_eq!(example.file().name().as_deref(), Some(example.name));
        }
    }

    #[test]
    fn no_two_examples_have_a_name_in_common() {
        let mut names: Vec<&str> = EXAMPLES.iter().map(|example| example.name).collect();
        names.extend(EXAMPLES.iter().filter_map(|example| example.alias));
        let n_names = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), n_names);
    }
}
