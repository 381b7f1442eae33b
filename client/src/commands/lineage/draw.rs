//! Lineages as text: trees for people, graphs for Graphviz.

use std::collections::{BTreeMap, BTreeSet};

use swarm_proto::v1::{Ancestor, GenesOfParent, PopulationLineage};

use super::{Operator, operator};
use crate::text;

/// Ancestors by generation and index.
type Ancestors<'a> = BTreeMap<(u64, u32), &'a Ancestor>;

/// A tree per population: below each individual are its parents.
pub fn trees(populations: &[PopulationLineage], experiment: u64) -> String {
    let mut lines = Vec::new();
    for PopulationLineage { population, ancestors } in populations {
        if populations.len() > 1 {
            lines.push(format!("population {population}"));
        }
        let all: Ancestors<'_> = ancestors
            .iter()
            .map(|ancestor| ((ancestor.generation, ancestor.individual), ancestor))
            .collect();
        let Some(root) = ancestors.first() else { continue };
        let mut tree = Tree { experiment, all, shown: BTreeSet::new(), lines: Vec::new() };
        tree.grow(root, String::new(), "", "");
        lines.append(&mut tree.lines);
    }
    lines.join("\n")
}

struct Tree<'a> {
    experiment: u64,
    all: Ancestors<'a>,
    /// Individuals whose parents are already in the tree.
    shown: BTreeSet<(u64, u32)>,
    lines: Vec<String>,
}

impl Tree<'_> {
    /// Adds an individual and its ancestors. `before`: the prefix of all lines. After
    /// it, `branch` begins the line of the individual, and `below` the lines of its ancestors.
    fn grow(&mut self, of: &Ancestor, before: String, branch: &str, below: &str) {
        let place = (of.generation, of.individual);
        let is_new = self.shown.insert(place);
        let again = if is_new || of.parents.is_empty() { "" } else { ", see above" };
        let born = match operator(of) {
            Some(Operator::Crossover) => format!(
                ", crossover of {}, {} new",
                of.parents
                    .iter()
                    .map(|parent| format!("{} ({} genes)", parent.individual, parent.genes))
                    .collect::<Vec<_>>()
                    .join(" and "),
                of.new_genes
            ),
            Some(Operator::Copy) => format!(", copy with {} new", of.new_genes),
            Some(Operator::Elite) => ", elite".to_owned(),
            Some(Operator::Line) => {
                let parents = of.parents.iter().filter_map(|parent| place_of(of, parent));
                let named: Vec<String> =
                    parents.map(|(generation, i)| format!("{generation}/{i}")).collect();
                format!(", near the line through {}", named.join(" and "))
            }
            Some(Operator::First) => ", first generation".to_owned(),
            None => String::new(),
        };
        self.lines.push(format!(
            "{before}{branch}{}@{}/{}  fitness {}, {} genes{born}{again}",
            self.experiment,
            of.generation,
            of.individual,
            text::number(of.fitness, 6),
            of.genes
        ));
        if !is_new {
            return;
        }
        let parents: Vec<&Ancestor> = of
            .parents
            .iter()
            .filter_map(|parent| self.all.get(&place_of(of, parent)?).copied())
            .collect();
        for (i, parent) in parents.iter().enumerate() {
            let (branch, under) = match i + 1 == parents.len() {
                true => ("└─ ", "   "),
                false => ("├─ ", "│  "),
            };
            self.grow(parent, format!("{before}{below}"), branch, under);
        }
    }
}

/// Generation and index of a parent.
fn place_of(child: &Ancestor, parent: &GenesOfParent) -> Option<(u64, u32)> {
    Some((parent.generation.or(child.generation.checked_sub(1))?, parent.individual))
}

/// A graph in Graphviz's language: children point to their parents, with the number of genes.
pub fn graph(populations: &[PopulationLineage]) -> String {
    let mut lines = vec!["digraph lineage {".to_owned(), "  node [shape=box];".to_owned()];
    for (p, PopulationLineage { population, ancestors }) in populations.iter().enumerate() {
        let known: BTreeSet<(u64, u32)> =
            ancestors.iter().map(|ancestor| (ancestor.generation, ancestor.individual)).collect();
        let label = match populations.len() {
            1 => String::new(),
            _ => format!("{}\\n", population.replace(['"', '\\'], "_")),
        };
        for of in ancestors {
            let (g, i) = (of.generation, of.individual);
            lines.push(format!(
                "  \"{p}_{g}_{i}\" [label=\"{label}{g}/{i}\\n{}\\n{} genes\"];",
                text::number(of.fitness, 4),
                of.genes
            ));
            for parent in &of.parents {
                let Some((before, j)) = place_of(of, parent) else { continue };
                if known.contains(&(before, j)) {
                    let genes = parent.genes;
                    lines.push(format!(
                        "  \"{p}_{g}_{i}\" -> \"{p}_{before}_{j}\" [label={genes}];"
                    ));
                }
            }
        }
    }
    lines.push("}".to_owned());
    lines.join("\n")
}
