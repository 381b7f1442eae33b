//! `swarmctl examples`: the experiments that are part of the program.

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use crate::{
    error::Error,
    examples::EXAMPLES,
    experiment_file::Overrides,
    progress::Progress,
    table::{Column, Table},
};

/// List the experiments that are part of this program.
///
/// `run --example NAME` and `submit --example NAME` evolve one of them, without a file.
/// `new NAME --task EXAMPLE` writes a copy for you to change.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ExamplesArgs {}

const HELP: &str = "\
Examples:
  swarmctl examples
  swarmctl run --example quickstart
  swarmctl new my_swarm --task flocking";

/// An example.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Example")]
pub struct Listed {
    /// Its name, for `--example` and `--task`.
    name: &'static str,
    /// Number of generations.
    generations: u64,
    /// What the robots do.
    about: &'static str,
}

/// Prints the list.
pub fn examples(progress: &mut Progress) -> Result<(), Error> {
    let mut documents = Vec::new();
    let mut table =
        Table::new([Column::new("name"), Column::number("generations"), Column::text("about")]);
    for example in &EXAMPLES {
        let file = example.file();
        let compiled = file.compile(&Overrides::default());
        let generations =
            compiled.map_err(|error| file.invalid(&error))?.config.algorithm.generations;
        table.push([example.name.into(), generations.to_string(), example.about.into()]);
        documents.push(Listed { name: example.name, generations, about: example.about });
    }
    progress.print_table(&table, &["name", "generations", "about"], &documents, "no examples")
}
