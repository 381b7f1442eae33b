//! `swarmctl lineage`: the ancestors of an individual.

mod draw;

use clap::Args;
use clap_complete::ArgValueCompleter;
use model::Address;
use serde::Serialize;
use swarm_proto::v1::{Ancestor, BirthOperator, GetLineageResponse, PopulationLineage};

use crate::{
    address::NamedAddress, args::whole, complete, connection::Connection, error::Error, json,
    progress::Progress, remote::Remote,
};

/// Print the ancestors of an individual of a genetic algorithm, and the genes inherited from
/// each.
///
/// The command recomputes the generations from the fitness log. A gene is inherited if a parent
/// has exactly the same value; all other genes mutated, or blend both parents. `genes` is the
/// number of the individual's genes that descend unchanged from an ancestor.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct LineageArgs {
    /// The individual: ID@G/I, individual I of generation G of the experiment with that
    /// number or name.
    #[arg(value_name = "ID@G/I", add = ArgValueCompleter::new(complete::experiments))]
    address: NamedAddress,
    /// Number of generations to go back.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole::<u32>(1..=1000))]
    depth: u32,
    /// Print a graph for Graphviz instead of a tree.
    #[arg(long)]
    dot: bool,
}

const HELP: &str = "\
Examples:
  swarmctl lineage 3@40/7
  swarmctl lineage 3@40/7 --depth 40 --output json | jq '.populations[].ancestors[-1]'
  swarmctl lineage 3@40/7 --depth 6 --dot | dot -Tsvg > lineage.svg";

/// A lineage, for programs.
#[derive(Debug, Serialize)]
struct LineageDocument<'a> {
    address: String,
    populations: Vec<PopulationDocument<'a>>,
}

#[derive(Debug, Serialize)]
struct PopulationDocument<'a> {
    population: &'a str,
    ancestors: Vec<AncestorDocument>,
}

#[derive(Debug, Serialize)]
struct AncestorDocument {
    generation: u64,
    individual: u32,
    fitness: Option<f64>,
    operator: Option<&'static str>,
    parents: Vec<ParentDocument>,
    new_genes: u32,
    genes: u32,
}

#[derive(Debug, Serialize)]
struct ParentDocument {
    individual: u32,
    genes: u32,
}

impl Remote for LineageArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let address = connection.resolve(&self.address).await?;
        let GetLineageResponse { populations } = connection.lineage(address, self.depth).await?;
        progress.print(&match (self.dot, progress.is_json()) {
            (true, _) => draw::graph(&populations),
            (_, true) => json::document(&LineageDocument::new(address, &populations)),
            _ => draw::trees(&populations, address.experiment.0),
        })
    }
}

/// The operators that made an individual; none in the earliest generation of a lineage.
fn operator(ancestor: &Ancestor) -> Option<&'static str> {
    match ancestor.operator() {
        BirthOperator::Unspecified => None,
        BirthOperator::First => Some("first"),
        BirthOperator::Elite => Some("elite"),
        BirthOperator::Copy => Some("copy"),
        BirthOperator::Crossover => Some("crossover"),
    }
}

impl<'a> LineageDocument<'a> {
    fn new(address: Address, populations: &'a [PopulationLineage]) -> Self {
        let ancestor = |ancestor: &Ancestor| AncestorDocument {
            generation: ancestor.generation,
            individual: ancestor.individual,
            fitness: Some(ancestor.fitness).filter(|fitness| fitness.is_finite()),
            operator: operator(ancestor),
            parents: ancestor
                .parents
                .iter()
                .map(|of| ParentDocument { individual: of.individual, genes: of.genes })
                .collect(),
            new_genes: ancestor.new_genes,
            genes: ancestor.genes,
        };
        let population = |population: &'a PopulationLineage| PopulationDocument {
            population: &population.population,
            ancestors: population.ancestors.iter().map(ancestor).collect(),
        };
        Self {
            address: address.to_string(),
            populations: populations.iter().map(population).collect(),
        }
    }
}
