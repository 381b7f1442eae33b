//! A repertoire of three elites, judged at its end.

use swarm_proto::v1::{
    CorrectedFigures, DescriptorAxis, Elite, GetRepertoireResponse, JudgedElite,
};

/// The repertoire after a generation; the last one is judged.
pub fn repertoire(generation: Option<u64>) -> GetRepertoireResponse {
    let is_judged = generation.is_none();
    let axis = |measure: &str, cells| DescriptorAxis {
        measure: measure.into(),
        of: "mean".into(),
        low: 0.0,
        high: 1.0,
        cells,
    };
    // The last one was born before a fork.
    let elite = |experiment_id, individual, [x, y]: [f64; 2], fitness: f64| {
        let cell = vec![(4.0 * x) as u32, (2.0 * y) as u32];
        let judged = JudgedElite {
            fitness: fitness - 0.25,
            descriptors: vec![x, y / 2.0],
            cell: vec![cell[0], y as u32],
        };
        Elite {
            generation: 1,
            individual,
            cell,
            fitness,
            descriptors: vec![x, y],
            trials: 6,
            judged: is_judged.then_some(judged),
            experiment_id,
        }
    };
    let corrected = CorrectedFigures { qd_score: 1.25, coverage: 0.25, stay: 1.0 / 3.0 };
    GetRepertoireResponse {
        generation: generation.unwrap_or(2),
        axes: vec![axis("order", 4), axis("together", 2)],
        elites: vec![
            elite(3, 5, [0.125, 0.25], 0.5),
            elite(3, 2, [0.125, 0.75], 1.0),
            elite(1, 7, [0.75, 0.75], 1.25),
        ],
        shown: if is_judged { vec![1, 2] } else { vec![0, 1, 2] },
        corrected: is_judged.then_some(corrected),
    }
}
