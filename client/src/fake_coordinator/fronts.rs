//! A front of three elites, judged at its end.

use swarm_proto::v1::{Aim, Elite, FrontFigures, GetFrontRequest, GetFrontResponse, JudgedElite};

/// The front after a generation; the last one is judged.
pub fn front(request: GetFrontRequest) -> GetFrontResponse {
    let GetFrontRequest { generation, reference, .. } = request;
    let is_judged = generation.is_none();
    // The last one was born before a fork.
    let elite = |experiment_id, individual, fitness: f64, turning: f64| {
        let judged = JudgedElite {
            fitness: fitness - 0.25,
            descriptors: vec![turning + 0.125],
            cell: Vec::new(),
        };
        Elite {
            generation: 1,
            individual,
            cell: Vec::new(),
            fitness,
            descriptors: vec![turning],
            trials: 6,
            judged: is_judged.then_some(judged),
            experiment_id,
        }
    };
    let reference = if reference.is_empty() { vec![0.25, 0.875] } else { reference };
    GetFrontResponse {
        generation: generation.unwrap_or(2),
        aims: vec![Aim {
            measure: "turning".into(),
            of: "mean".into(),
            direction: "minimise".into(),
        }],
        elites: vec![elite(3, 5, 0.5, 0.25), elite(3, 2, 1.0, 0.5), elite(1, 7, 1.25, 0.75)],
        shown: if is_judged { vec![0, 2] } else { vec![0, 1, 2] },
        figures: Some(FrontFigures {
            hypervolume: 0.375,
            reference,
            stay: is_judged.then_some(2.0 / 3.0),
        }),
    }
}
