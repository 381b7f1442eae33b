//! The judgement of a champion, and of every elite of a repertoire or of a front: their honest
//! fitness, on trials that selected nothing.

use determinism::random::TrialSet;

use super::{
    Champion, Digest, End, Genotype, Population, champion::Judged, finite_mean, interval::interval,
};

/// A champion to judge, and the elites of its repertoire or front.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    generation: u64,
    champion: Champion,
    /// Empty without a repertoire or a front.
    elites: Vec<Genotype>,
    /// Numbers of a trial: its fitness, and its descriptors.
    values_per_trial: usize,
    /// The last link of the generations' digest chain, which the next link covers.
    of_generations: Digest,
    /// The last link of the chain of re-evaluations.
    digest: Digest,
}

impl Judgement {
    /// Prepares the judgement after a generation. `of_generations`, `digest`: the last links of
    /// the digest chains of generations and of re-evaluations.
    pub(crate) fn new(
        generation: u64,
        champion: Champion,
        of_generations: Digest,
        digest: Digest,
    ) -> Self {
        let elites = Vec::new();
        Self { generation, champion, elites, values_per_trial: 1, of_generations, digest }
    }

    /// The same together with elites.
    #[must_use]
    pub(crate) fn with_elites(self, elites: Vec<Genotype>, n_descriptors: usize) -> Self {
        Self { elites, values_per_trial: 1 + n_descriptors, ..self }
    }

    /// The trials of the judgement.
    pub fn trial_set(&self) -> TrialSet {
        TrialSet::Judgement(self.generation)
    }

    /// The champion's genotype, and then those of the elites.
    pub fn genotypes(&self) -> Population {
        [&self.champion.genotype].into_iter().chain(&self.elites).cloned().collect()
    }

    /// Numbers of a trial: its fitness, and its descriptors in repertoires and fronts.
    pub fn values_per_trial(&self) -> usize {
        self.values_per_trial
    }

    /// The judgement as [`End`] keeps it, without blocks. `values`: for each of
    /// [`genotypes`](Self::genotypes) the numbers of all trials.
    pub fn end(&self, values: &[Vec<f64>]) -> End {
        let (champion, elites) =
            values.split_first().map_or((&[][..], &[][..]), |(first, rest)| (&first[..], rest));
        let judgement = champion.iter().copied().step_by(self.values_per_trial).collect();
        End { blocks: Vec::new(), judgement, elites: elites.to_vec() }
    }

    /// Whether an end has a judgement of these genotypes.
    pub(crate) fn fits(&self, end: &End) -> bool {
        let len = end.judgement.len() * self.values_per_trial;
        end.elites.len() == self.elites.len() && end.elites.iter().all(|row| row.len() == len)
    }

    /// The champion with its judgement, and the new last link of the digest chain of
    /// re-evaluations. `values`: as for [`end`](Self::end). The champion stays without a judgement
    /// if the fitness of a trial is not finite.
    pub fn decide(self, values: &[Vec<f64>]) -> (Champion, Digest) {
        let end = self.end(values);
        self.decide_by(&end)
    }

    /// The same, by an end that [fits](Self::fits).
    pub(crate) fn decide_by(self, end: &End) -> (Champion, Digest) {
        let Self { generation, champion, elites, of_generations, digest, .. } = self;
        let genotype = [&champion.genotype[..]].into_iter();
        let judgement = std::slice::from_ref(&end.judgement);
        let mut digest = digest.next_champion(of_generations, genotype, judgement);
        if !elites.is_empty() {
            let genotypes = elites.iter().map(|elite| &elite[..]);
            digest = digest.next_champion(of_generations, genotypes, &end.elites);
        }
        let values = &end.judgement[..];
        let n_trials = values.len() as u32;
        let judged = finite_mean(values).zip(interval(values)).map(|(mean, (low, high))| Judged {
            mean,
            low,
            high,
            n_trials,
            generation,
        });
        (Champion { judged, ..champion }, digest)
    }
}
