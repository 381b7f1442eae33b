//! Sweeps: the runs that arguments make, and refused arguments.

use clap::Parser as _;

use super::*;
use crate::{
    cli::Args,
    commands::{Command, RemoteCommand, submit::Evolve},
    experiment_file::tests::quickstart,
};

/// The runs of `submit quickstart.json` with more arguments.
fn swept(more: &[&str]) -> Result<Vec<SweepRun>, Error> {
    let path = quickstart();
    let line =
        ["swarmctl", "submit", path.to_str().unwrap()].into_iter().chain(more.iter().copied());
    let args = Args::try_parse_from(line).map_err(|error| Error::Input(error.to_string()))?;
    let Command::Remote(RemoteCommand::Evolve(Evolve::Submit(args))) = args.command else {
        panic!()
    };
    runs(&args.experiment)
}

fn refusal(more: &[&str]) -> String {
    swept(more).unwrap_err().report()
}

fn labels(runs: &[SweepRun]) -> Vec<(Option<u64>, &str)> {
    runs.iter().map(|run| (run.request.seed, &*run.request.variant)).collect()
}

#[test]
fn seeds_are_listed_or_spanned_with_both_ends() {
    let seeds = |text: &str| Seeds::from_str(text).map(|Seeds(seeds)| seeds);
    assert_eq!(seeds("0..4").unwrap(), [0, 1, 2, 3, 4]);
    assert_eq!(seeds("7,1..2, 1").unwrap(), [1, 2, 7]);
    assert_eq!(seeds("18446744073709551615").unwrap(), [u64::MAX]);
    for text in ["0..4", "1..2,7", "7", "18446744073709551614..18446744073709551615"] {
        assert_eq!(Seeds::from_str(text).unwrap().to_string(), text, "they are written alike");
    }
    for text in ["", "a", "1..", "4..2", "1,,2", "-1", "0..18446744073709551615", "0..1000"] {
        seeds(text).unwrap_err();
    }
    assert_eq!(seeds("0..499,250..999").unwrap().len(), 1000);
    assert_eq!(seeds("0..499,500..999,1000").unwrap_err(), "more than 1000 seeds");
}

#[test]
fn one_run_is_a_group_only_on_request() {
    for more in [&[][..], &["--seed", "3"], &["--set", "algorithm.population_size=8"]] {
        let runs = swept(more).unwrap();
        assert_eq!((runs.len(), runs[0].group()), (1, None), "{more:?}");
        assert!(runs[0].request.request_id.starts_with("submit-"));
    }
    assert_eq!(swept(&["--group", "mine"]).unwrap()[0].group(), Some("mine"));
    assert_eq!(swept(&["--seeds", "3"]).unwrap()[0].group(), Some("quickstart"));
}

#[test]
fn a_group_has_all_combinations_of_seeds_and_values() {
    let runs = swept(&[
        "--seeds",
        "1..2",
        "--set",
        "algorithm.population_size=8,16",
        "--set",
        "algorithm.evaluation_steps=9",
    ])
    .unwrap();
    let (small, large) = ("algorithm.population_size=8", "algorithm.population_size=16");
    assert_eq!(
        labels(&runs),
        [(Some(1), small), (Some(2), small), (Some(1), large), (Some(2), large)]
    );
    for (run, population) in runs.iter().zip([8, 8, 16, 16]) {
        let (config, _) =
            ExperimentConfig::from_json(&run.request.config_json, "", evolution::ALGORITHMS)
                .unwrap();
        assert_eq!(config.algorithm.population_size, population);
        assert_eq!(config.algorithm.evaluation_steps, 9);
    }
    let ids: BTreeSet<&str> = runs.iter().map(|run| &*run.request.request_id).collect();
    assert_eq!(ids.len(), 4);
}

#[test]
fn the_request_of_a_run_depends_on_all_its_settings() {
    let id = |more: &[&str]| {
        let runs = swept(&[&["--seeds", "5"], more].concat()).unwrap();
        runs[0].request.request_id.clone()
    };
    assert_eq!(id(&[]), id(&[]));
    assert_eq!(id(&[]), id(&["--group", "quickstart"]));
    let others = [
        id(&["--group", "b"]),
        id(&["--generations", "7"]),
        id(&["--set", "algorithm.num_evaluations=2"]),
    ];
    for other in others {
        assert_ne!(id(&[]), other);
    }
}

#[test]
fn each_mistake_of_all_values_is_reported_once() {
    let report = refusal(&[
        "--seeds",
        "0..4",
        "--set",
        "algorithm.population_sise=8,16",
        "--set",
        "algorithm.num_evaluations=0,1,-1",
    ]);
    let lines: Vec<&str> = report.lines().collect();
    assert_eq!(lines.len(), 3, "{report}");
    assert!(report.contains("did you mean `population_size`?"), "{report}");
    for found in ["0", "-1"] {
        let problem = format!("algorithm.num_evaluations: must be between 1 and 1000, is {found}");
        assert!(lines.iter().any(|line| line.ends_with(&problem)), "{report}");
    }

    // Five robots find no place on a strip of one centimetre.
    let report = refusal(&["--set", "world.width=1000,1; world.height=1000"]);
    assert!(report.ends_with("(with world.width=1)"), "{report}");
    assert_eq!(first_few(&["a=1", "a=2"]), "a=1 and a=2");
    assert_eq!(first_few(&["a=1", "a=2", "a=3"]), "a=1 and 2 others");

    let report = refusal(&["--set", "x", "--set", "a=1", "--set", "a=2", "--set", "seed=1,2"]);
    for part in ["`x`: expected PATH=VALUE", "a is given twice", "give --seeds"] {
        assert!(report.contains(part), "{report}");
    }
    assert!(refusal(&["--seeds", "0..1", "--seed", "3"]).contains("cannot be used with"));
    assert!(refusal(&["--seeds", "1..0"]).contains("ends before it begins"));
    assert!(refusal(&["--seeds", "0", "--group", "7"]).contains("--group"));
    let many = (0..34).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
    let set = [format!("a={many}"), format!("b={many}")];
    assert!(refusal(&["--set", &set[0], "--set", &set[1]]).contains("more than 1000 runs"));
}

#[test]
fn semicolons_separate_changes_like_repeated_options() {
    let [size, steps] = ["algorithm.population_size=8,16", "algorithm.evaluation_steps=9,10"];
    let together = swept(&["--set", &format!("{size}; {steps}")]).unwrap();
    let apart = swept(&["--set", size, "--set", steps]).unwrap();
    assert_eq!((together.len(), labels(&together)), (4, labels(&apart)));
}
