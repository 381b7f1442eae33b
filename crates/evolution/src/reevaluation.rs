//! The re-evaluation of candidates for the champion.
//!
//! Every candidate meets a block of held-out trials. The leader is the candidate with the largest
//! mean over all held-out trials that it has ever met. Candidates that are not close to the leader
//! are out. While several candidates are left, the candidates with the fewest trials meet another
//! block, up to [`BLOCKS_MAX`] blocks in all. Then the leader becomes the champion.

use determinism::random::TrialSet;

use super::{Champion, Digest, HeldOut, Population, ranking::ranking};

/// Most blocks of trials in one re-evaluation.
pub const BLOCKS_MAX: u8 = 4;

/// A comparison of candidates on held-out trials, block by block.
#[derive(Debug, Clone, PartialEq)]
pub struct Reevaluation {
    /// The generation of the held-out trials.
    generation: u64,
    /// The candidates; a champion that has been re-evaluated before comes first.
    candidates: Vec<Champion>,
    /// Indices of the candidates that meet the next block; empty if the re-evaluation is over.
    participants: Vec<usize>,
    /// The fitness of all blocks so far, as given to [`learn`](Self::learn).
    blocks: Vec<Vec<Vec<f64>>>,
    /// The last link of the generations' digest chain, which the links of this chain cover.
    of_generations: Digest,
    /// The last link.
    digest: Digest,
}

impl Reevaluation {
    /// A re-evaluation before its first block. `of_generations`, `digest`: the last links of the
    /// digest chains of generations and of re-evaluations.
    pub(crate) fn new(
        generation: u64,
        candidates: Vec<Champion>,
        of_generations: Digest,
        digest: Digest,
    ) -> Self {
        let participants = (0..candidates.len()).collect();
        let blocks = Vec::new();
        Self { generation, candidates, participants, blocks, of_generations, digest }
    }

    /// The candidates. A champion that has been re-evaluated before comes first.
    pub fn candidates(&self) -> &[Champion] {
        &self.candidates
    }

    /// Whether no block is left.
    pub fn is_over(&self) -> bool {
        self.participants.is_empty()
    }

    /// The trials of the next block.
    pub fn trial_set(&self) -> TrialSet {
        TrialSet::HeldOut { generation: self.generation, block: self.blocks.len() as u8 }
    }

    /// The genotypes of the candidates that meet the next block.
    pub fn genotypes(&self) -> Population {
        self.participants.iter().map(|&i| self.candidates[i].genotype.clone()).collect()
    }

    /// Learns the fitness of a block. `trial_fitness[i][t]`: fitness of genotype i of
    /// [`genotypes`](Self::genotypes) in trial t, t from 0 in each block.
    pub fn learn(&mut self, trial_fitness: &[Vec<f64>]) {
        assert_eq!(self.participants.len(), trial_fitness.len(), "one fitness per genotype");
        let genotypes = self.participants.iter().map(|&i| &self.candidates[i].genotype[..]);
        self.digest = self.digest.next_champion(self.of_generations, genotypes, trial_fitness);
        for (&i, values) in self.participants.iter().zip(trial_fitness) {
            let block = HeldOut::from_values(values, self.generation);
            let held_out = &mut self.candidates[i].held_out;
            // A candidate without a finite mean has lost, and meets no further block.
            *held_out = match *held_out {
                Some(so_far) => block.and_then(|block| so_far.with(block)),
                None => block,
            };
        }
        self.blocks.push(trial_fitness.to_vec());
        self.participants = self.next_participants();
    }

    /// The fitness of all blocks so far, as given to [`learn`](Self::learn); shape
    /// `[block][candidate][trial]`.
    pub fn blocks(&self) -> &[Vec<Vec<f64>>] {
        &self.blocks
    }

    /// The winner, once the re-evaluation is over, and the last link of the digest chain. The
    /// first of equal candidates wins; `None` if no candidate has a finite mean.
    pub(crate) fn outcome(&self) -> (Option<&Champion>, Digest) {
        (self.leader().map(|(leader, _)| &self.candidates[leader]), self.digest)
    }

    fn leader(&self) -> Option<(usize, HeldOut)> {
        let mean =
            |candidate: &Champion| candidate.held_out.map_or(f64::NAN, |known| known.mean.get());
        let means: Vec<f64> = self.candidates.iter().map(mean).collect();
        let leader = ranking(&means)[0];
        self.candidates[leader].held_out.map(|known| (leader, known))
    }

    fn next_participants(&self) -> Vec<usize> {
        let Some((leader, best)) =
            self.leader().filter(|_| self.blocks.len() < usize::from(BLOCKS_MAX))
        else {
            return Vec::new();
        };
        let known = self.candidates.iter().map(|candidate| candidate.held_out).enumerate();
        let left: Vec<(usize, HeldOut)> = known
            .filter_map(|(i, held_out)| Some((i, held_out?)))
            .filter(|(i, held_out)| *i == leader || held_out.is_close_to(&best))
            .collect();
        let fewest = left.iter().map(|(_, held_out)| held_out.n_trials).min();
        let needs_more =
            |&(i, held_out): &(usize, HeldOut)| (Some(held_out.n_trials) == fewest).then_some(i);
        if left.len() < 2 { Vec::new() } else { left.iter().filter_map(needs_more).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChampionSource;

    /// A re-evaluation before its first block; `held_out`: earlier results of each candidate.
    fn reevaluation(held_out: &[Option<HeldOut>]) -> Reevaluation {
        let candidate = |(i, &held_out)| Champion {
            generation: 9,
            source: ChampionSource::Individual(i as u32),
            genotype: vec![i as f64],
            trial_fitness: vec![9.0],
            held_out,
            judged: None,
        };
        let candidates = held_out.iter().enumerate().map(candidate).collect();
        Reevaluation::new(9, candidates, Digest::default(), Digest::default())
    }

    /// Four trials with this mean and s = 1.
    fn around(mean: f64) -> Vec<f64> {
        let deviation = 0.75f64.sqrt();
        [-1.0, 1.0, -1.0, 1.0].map(|sign| mean + sign * deviation).to_vec()
    }

    fn winner(reevaluation: &Reevaluation) -> Option<ChampionSource> {
        reevaluation.outcome().0.map(|winner| winner.source)
    }

    fn participants(reevaluation: &Reevaluation) -> Vec<f64> {
        reevaluation.genotypes().concat()
    }

    #[test]
    fn a_candidate_that_leads_clearly_wins_after_one_block() {
        let mut round = reevaluation(&[None, None, None]);
        assert_eq!(round.trial_set(), TrialSet::HeldOut { generation: 9, block: 0 });
        assert_eq!(participants(&round), [0.0, 1.0, 2.0]);
        round.learn(&[around(1.0), around(5.0), vec![f64::NAN, 9.0]]);
        assert!(round.is_over());
        assert_eq!(winner(&round), Some(ChampionSource::Individual(1)));
        let held_out = round.outcome().0.unwrap().held_out.unwrap();
        assert!((held_out.mean.get() - 5.0).abs() < 1e-12);
        assert_eq!((held_out.n_trials, held_out.generation), (4, 9));
    }

    #[test]
    fn candidates_that_are_close_meet_more_blocks_and_all_their_trials_count() {
        let mut round = reevaluation(&[None, None, None]);
        round.learn(&[around(5.0), around(1.0), around(5.5)]);
        assert!(!round.is_over());
        assert_eq!(round.trial_set(), TrialSet::HeldOut { generation: 9, block: 1 });
        assert_eq!(participants(&round), [0.0, 2.0], "the second is out");
        round.learn(&[around(9.0), around(4.5)]);
        assert!(round.is_over(), "7 is clearly more than 5");
        assert_eq!(winner(&round), Some(ChampionSource::Individual(0)));
        assert!((round.outcome().0.unwrap().held_out.unwrap().mean.get() - 7.0).abs() < 1e-12);
    }

    #[test]
    fn candidates_with_more_trials_wait_for_the_others() {
        let known = HeldOut::from_values(&[around(5.0), around(5.0)].concat(), 3);
        let mut round = reevaluation(&[known, None]);
        round.learn(&[around(5.0), around(5.5)]);
        for block in 1..BLOCKS_MAX {
            assert_eq!(round.trial_set(), TrialSet::HeldOut { generation: 9, block });
            let expected: &[f64] = if block < 3 { &[1.0] } else { &[0.0, 1.0] };
            assert_eq!(participants(&round), expected, "block {block}");
            let blocks: Vec<Vec<f64>> = expected.iter().map(|_| around(5.2)).collect();
            round.learn(&blocks);
        }
        assert!(round.is_over(), "there are no more blocks");
        assert_eq!(winner(&round), Some(ChampionSource::Individual(1)));
    }

    #[test]
    fn one_lucky_block_does_not_beat_a_mean_of_many_blocks() {
        let known = HeldOut::from_values(&[around(5.0), around(5.0), around(5.0)].concat(), 3);
        let mut round = reevaluation(&[known, None]);
        round.learn(&[around(2.0), around(5.1)]);
        assert_eq!(participants(&round), [1.0], "4.25 and 5.1 are close");
        round.learn(&[around(3.0)]);
        while !round.is_over() {
            let blocks: Vec<Vec<f64>> = round.genotypes().iter().map(|_| around(4.0)).collect();
            round.learn(&blocks);
        }
        assert_eq!(winner(&round), Some(ChampionSource::Individual(0)));
    }

    #[test]
    fn the_first_of_equal_candidates_wins_without_more_trials() {
        let mut round = reevaluation(&[None, None]);
        round.learn(&[vec![1.0], vec![1.0]]);
        assert!(round.is_over());
        assert_eq!(winner(&round), Some(ChampionSource::Individual(0)));
    }

    #[test]
    fn without_a_finite_mean_nobody_wins() {
        let mut round = reevaluation(&[None, None]);
        round.learn(&[vec![f64::NAN], vec![f64::INFINITY]]);
        assert!(round.is_over());
        assert_eq!(winner(&round), None);
    }

    #[test]
    fn every_bit_of_every_block_enters_the_digest() {
        let digest = |first: f64, second: f64| {
            let mut round = reevaluation(&[None, None]);
            round.learn(&[vec![first, 1.0], vec![0.5, 1.0]]);
            round.learn(&[vec![second, 1.0], vec![0.5, 1.0]]);
            round.outcome().1
        };
        assert_ne!(digest(0.5, 0.5), digest(0.5f64.next_up(), 0.5));
        assert_ne!(digest(0.5, 0.5), digest(0.5, 0.5f64.next_up()));
    }
}
