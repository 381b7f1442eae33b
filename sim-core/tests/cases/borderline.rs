//! Experiment B: alpha shapes, components, the border of the torus, positions that change while
//! the networks keep their state.

use experiment_file::{Initializer, TopologySwitchConfig};

use crate::configs::{experiment_b, receiver_mut, swarm_mut, transmitter_mut};
use crate::{assert_agreement, random_genotype, spread};

/// Seeds of genotypes whose LEDs vary over time.
const LIVELY: [u64; 3] = [4, 14, 15];

#[test]
fn experiments_with_an_interior_agree() {
    for n in [7, 20, 30] {
        let mut config = experiment_b();
        config.algorithm.evaluation_steps = 100;
        swarm_mut(&mut config).num_instances = n;
        for seed in LIVELY {
            let episodes = assert_agreement(&config, &random_genotype(&config, seed), 1, 0..3);
            assert!(spread(episodes.iter().map(|episode| episode.fitness)) > 0.01);
            let n_interior: usize = episodes.iter().map(|episode| episode.witness.n_interior).sum();
            assert!(n_interior > 0, "all of {n} robots on the border");
        }
    }
}

#[test]
fn borders_of_other_alpha_shapes_agree() {
    let n_interior = [5.0, 15.0, 40.0].map(|alpha| {
        let mut config = experiment_b();
        config.algorithm.evaluation_steps = 40;
        config.algorithm.fitness_params.alpha = alpha;
        let episodes = assert_agreement(&config, &random_genotype(&config, LIVELY[0]), 0, 0..3);
        episodes.iter().map(|episode| episode.witness.n_interior).sum::<usize>()
    });
    // With a larger alpha, the shape is more concave, and more robots are on its border.
    assert!(n_interior[0] > n_interior[1] && n_interior[1] > n_interior[2], "{n_interior:?}");
}

#[test]
fn swarms_across_the_border_of_an_oblong_world_agree() {
    let mut config = experiment_b();
    config.algorithm.evaluation_steps = 40;
    config.world.width = 900.0;
    config.world.height = 700.0;
    swarm_mut(&mut config).initializers.positions =
        Initializer::RandomGraph { max_rad: 70.0, initial_pos: [0.0, 690.0] };
    for seed in LIVELY {
        for episode in assert_agreement(&config, &random_genotype(&config, seed), 0, 0..5) {
            assert!(episode.witness.n_interior > 0 && episode.fitness > 0.0);
        }
    }
}

#[test]
fn scattered_swarms_agree() {
    let mut config = experiment_b();
    config.algorithm.evaluation_steps = 40;
    config.world.height = 600.0;
    receiver_mut(&mut config).range = 110.0;
    transmitter_mut(&mut config).range = 110.0;
    let swarm = swarm_mut(&mut config);
    swarm.num_instances = 24;
    // Positions with y beyond 600 cm wrap to the lower edge of the world.
    swarm.initializers.positions = Initializer::RandomUniform { low: 0.0, high: 650.0, size: 2 };
    swarm.perturbations.topology_switch = Some(TopologySwitchConfig { every: 4 });
    let mut n_interior = 0;
    for seed in LIVELY {
        let episodes = assert_agreement(&config, &random_genotype(&config, seed), 0, 0..5);
        n_interior += episodes.iter().map(|episode| episode.witness.n_interior).sum::<usize>();
        assert!(spread(episodes.iter().map(|episode| episode.fitness)) > 0.01);
    }
    assert!(n_interior > 100, "{n_interior}");
}

#[test]
fn positions_that_are_redrawn_agree() {
    let mut config = experiment_b();
    config.algorithm.evaluation_steps = 100;
    let genotype = random_genotype(&config, 15);
    let fixed = assert_agreement(&config, &genotype, 0, 0..1);
    let swarm = swarm_mut(&mut config);
    swarm.perturbations.topology_switch = Some(TopologySwitchConfig { every: 30 });
    let redrawn = assert_agreement(&config, &genotype, 0, 0..1);
    assert_eq!(redrawn[0].witness.n_redrawn, 3);
    assert_ne!(fixed[0].fitness, redrawn[0].fitness);
}

#[test]
fn robots_around_a_hole_are_interior() {
    // Two rings of 8 and 14 robots. The circle through the inner ring is too wide for the shape, so
    // there is a hole. Still, only the outer ring is the border.
    const INNER: [[f64; 2]; 8] = [
        [582.0, 497.0],
        [560.0, 557.0],
        [498.0, 579.0],
        [445.0, 564.0],
        [420.0, 503.0],
        [447.0, 438.0],
        [504.0, 418.0],
        [558.0, 445.0],
    ];
    const OUTER: [[f64; 2]; 14] = [
        [640.0, 516.0],
        [619.0, 573.0],
        [571.0, 614.0],
        [514.0, 638.0],
        [460.0, 628.0],
        [400.0, 595.0],
        [366.0, 545.0],
        [360.0, 483.0],
        [379.0, 428.0],
        [423.0, 382.0],
        [488.0, 366.0],
        [539.0, 370.0],
        [601.0, 406.0],
        [629.0, 455.0],
    ];
    let mut config = experiment_b();
    config.algorithm.evaluation_steps = 20;
    // A robot in the middle closes the hole.
    for (middle, n_interior) in [(vec![], 8 * 20), (vec![[500.0, 500.0]], 9 * 20)] {
        let positions = [&INNER[..], &OUTER[..], &middle].concat();
        let swarm = swarm_mut(&mut config);
        swarm.num_instances = positions.len() as u32;
        swarm.initializers.positions =
            Initializer::Fixed { values: positions.iter().map(|p| p.to_vec()).collect() };
        for seed in LIVELY {
            let episodes = assert_agreement(&config, &random_genotype(&config, seed), 0, 0..1);
            assert_eq!(episodes[0].witness.n_interior, n_interior);
            assert!(episodes[0].fitness > 0.0);
        }
    }
}
