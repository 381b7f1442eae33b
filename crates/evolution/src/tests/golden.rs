//! The bits of runs stay.

use sha2::{Digest as _, Sha256};

use super::{
    suite::{Variant, evolution_strategies, genetic_algorithms, start},
    *,
};

/// These values come from the first version of each algorithm. A change of a value changes runs:
/// it needs a reason, and a new format of the digest's first link.
#[test]
fn the_bits_of_runs_are_fixed() {
    let digest = |variant: &Variant| {
        let mut evolution = start(variant, &[5, 4], 7);
        for _ in 0..10 {
            step(&mut evolution);
        }
        evolution.digest().to_string()[..16].to_owned()
    };
    let mut digests: Vec<String> = evolution_strategies().iter().map(digest).collect();
    // First the variants with only operators of the first version, then those with an operator of
    // the second.
    let mut operators = [Sha256::new(), Sha256::new()];
    for variant in genetic_algorithms(|_| true) {
        let is_second = variant.1.iter().any(|(_, value)| {
            ["`combination`", "`bitflip`", "`categorical`"].contains(&&*value.to_string())
        });
        operators[usize::from(is_second)].update(digest(&variant));
    }
    digests.extend(operators.map(|operators| {
        operators.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect()
    }));
    assert_eq!(digests, GOLDEN);
}

/// SNES, xNES, CMA-ES, sep-CMA-ES, OpenAI-ES, PGPE, and the genetic algorithm with all its
/// operators, in two versions.
const GOLDEN: [&str; 8] = [
    "6fb8d048de5de8e0",
    "41ffd25be8e06a87",
    "7543959c50e2b6a3",
    "53343ca8678515e2",
    "6034a8fe33e233c7",
    "29205570bb848a63",
    "edcd5c7c5cf85dc3",
    "736f382e179211d5",
];
