//! `swarmctl lineage`: the ancestors of an individual.

mod draw;

use clap::Args;
use clap_complete::ArgValueCompleter;
use model::Address;
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{Ancestor, BirthOperator, GetLineageResponse, PopulationLineage};

use crate::{
    address::NamedAddress, args::whole, complete, connection::Connection, error::Error,
    progress::Progress, remote::Remote,
};

/// Print the ancestors of an individual of a genetic algorithm, a repertoire or a front, and the
/// genes inherited from each.
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
#[derive(Debug, Serialize, JsonSchema)]
pub struct LineageDocument<'a> {
    /// Address of the individual: ID@G/I.
    address: String,
    /// One for each object that evolves.
    populations: Vec<PopulationDocument<'a>>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Population")]
struct PopulationDocument<'a> {
    /// Name of the population.
    population: &'a str,
    /// The individual itself, then its ancestors by generation, the latest first.
    ancestors: Vec<AncestorDocument>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Ancestor")]
struct AncestorDocument {
    /// Its generation, from 0.
    generation: u64,
    /// Its index in the generation, from 0.
    individual: u32,
    /// Mean fitness of its trials; null if it is no finite number.
    fitness: Option<f64>,
    /// The operator that made it; null in the earliest generation of the lineage.
    operator: Option<Operator>,
    /// Its parents.
    parents: Vec<ParentDocument>,
    /// Number of its genes that mutated or blend both parents.
    new_genes: u32,
    /// Number of genes of the individual that descend unchanged from this ancestor.
    genes: u32,
}

/// An operator of a genetic algorithm or of a repertoire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Operator {
    /// Of the first generation.
    First,
    /// Unchanged, because it was among the best.
    Elite,
    /// A copy of one parent, with mutations.
    Copy,
    /// Of two parents, with mutations.
    Crossover,
    /// Near the line through two elites of a repertoire.
    Line,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Parent")]
struct ParentDocument {
    /// The generation of its birth, if it is not the generation before: elites of repertoires live
    /// long.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "u64")]
    generation: Option<u64>,
    /// Its index in its generation, from 0.
    individual: u32,
    /// Number of genes that come from it.
    genes: u32,
}

impl Remote for LineageArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let address = connection.resolve(&self.address).await?;
        let GetLineageResponse { populations, experiment_id } =
            connection.lineage(address, self.depth).await?;
        match (self.dot, progress.is_json()) {
            (true, true) => Err(Error::option("--dot", "prints no JSON; leave out --output json")),
            (true, false) => progress.print(&draw::graph(&populations)),
            (false, true) => progress.print_document(&LineageDocument::new(address, &populations)),
            (false, false) => progress.print(&draw::trees(&populations, experiment_id)),
        }
    }
}

/// The operators that made an individual; none in the earliest generation of a lineage.
fn operator(ancestor: &Ancestor) -> Option<Operator> {
    match ancestor.operator() {
        BirthOperator::Unspecified => None,
        BirthOperator::First => Some(Operator::First),
        BirthOperator::Elite => Some(Operator::Elite),
        BirthOperator::Copy => Some(Operator::Copy),
        BirthOperator::Crossover => Some(Operator::Crossover),
        BirthOperator::Line => Some(Operator::Line),
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
                .map(|of| ParentDocument {
                    generation: of.generation,
                    individual: of.individual,
                    genes: of.genes,
                })
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
