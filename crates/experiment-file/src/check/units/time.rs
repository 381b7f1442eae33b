//! Times and voltages: seconds or milliseconds, steps, millivolts.

use super::Doubts;
use crate::report::Path;
use crate::{
    EnsembleConfig, EnsembleSelector, GenotypeQuery, NeuronParameter, RobotConfig, TopologyConfig,
};

/// Longest and shortest plausible step of robots with wheels, s.
const STEP_MAX: f64 = 10.0;
const STEP_MIN: f64 = 0.001;
/// Longest step of a network of rate neurons, s.
const DT_MAX: f64 = 1.0;
/// Shortest step of a network of spiking neurons, ms.
const DT_MIN: f64 = 0.01;
/// Voltages of neurons are tens of mV; a value nearer to 0 than this may be in V.
const VOLTAGE_MIN: f64 = 1.0;

pub(super) fn check(doubts: &Doubts<'_>) {
    let topology = &doubts.config.topology;
    for (name, robot) in doubts.config.robots() {
        let path = Path::from(["world", "objects", name]);
        wheels(robot, &path, doubts);
        perturbations(robot, &path, doubts);
    }
    let (dt, path) = (topology.dt, Path::from(["topology", "dt"]));
    if topology.neuron_model.is_spiking() && dt < DT_MIN {
        doubts.add(&path, format!("{dt} ms"), "s instead of ms");
    } else if !topology.neuron_model.is_spiking() && dt > DT_MAX {
        doubts.add(&path, format!("{dt} s"), "ms instead of s");
    }
    for (name, ensemble) in &topology.ensembles {
        neurons(name, ensemble, doubts);
    }
    genes(doubts);
    receptors(topology, doubts);
    if let Some(tau) = topology.motor_tau {
        slow(tau, tau.to_string(), &Path::from(["topology", "motor_tau"]), doubts);
    }
    let steps = doubts.config.algorithm.evaluation_steps;
    if let Some(reward) = topology.learning.as_ref().and_then(|learning| learning.reward)
        && reward.delay >= steps
    {
        let path = Path::from(["topology", "learning", "reward", "delay"]);
        never(u64::from(reward.delay), &path, doubts);
    }
}

fn wheels(robot: &RobotConfig, path: &Path, doubts: &Doubts<'_>) {
    let Some(wheels) = &robot.actuators.wheel_actuator else { return };
    let path = path.key("actuators").key("wheel_actuator").key("step_duration");
    let step = wheels.step_duration;
    if step > STEP_MAX {
        doubts.add(&path, format!("a step of {step} s"), "ms instead of s");
    } else if step < STEP_MIN {
        doubts.add(&path, format!("a step of {step} s"), "another unit than s");
    }
}

/// Perturbations begin before the end of a trial.
fn perturbations(robot: &RobotConfig, path: &Path, doubts: &Doubts<'_>) {
    let perturbations = &robot.perturbations;
    let path = path.key("perturbations");
    let failure = perturbations.leader_failure.as_ref().map(|failure| failure.time_to_failure);
    let switch = perturbations.topology_switch.as_ref().map(|switch| switch.every);
    let rotation = perturbations.uncontrollable_rotation.as_ref().map(|rotation| rotation.start);
    for (kind, key, step) in [
        ("leader_failure", "time_to_failure", failure),
        ("topology_switch", "every", switch),
        ("uncontrollable_rotation", "start", rotation),
    ] {
        let steps = doubts.config.algorithm.evaluation_steps;
        if let Some(step) = step.filter(|step| *step >= steps) {
            never(step.into(), &path.key(kind).key(key), doubts);
        }
    }
}

fn never(step: u64, path: &Path, doubts: &Doubts<'_>) {
    let steps = doubts.config.algorithm.evaluation_steps;
    let what = format!("a trial of {steps} steps never reaches step {step}");
    doubts.add(path, what, "ms instead of steps");
}

/// The parameters of an ensemble that do not evolve.
fn neurons(name: &str, ensemble: &EnsembleConfig, doubts: &Doubts<'_>) {
    let topology = &doubts.config.topology;
    let path = Path::from(["topology", "ensembles", name, "params"]);
    for parameter in topology.neuron_model.spec().parameters {
        let Some(&value) = ensemble.params.get(parameter.name()) else { continue };
        let is_own = value != parameter.default();
        if !is_own || evolves(parameter, name, doubts) {
            continue;
        }
        let path = path.key(parameter.name());
        if parameter.is_time_constant {
            slow(value, value.to_string(), &path, doubts);
        }
        if is_voltage(parameter) && value.abs() < VOLTAGE_MIN {
            doubts.add(&path, format!("{value} mV is nearly 0"), "V instead of mV");
        }
    }
}

/// Whether a query of the genotype covers a parameter of an ensemble.
fn evolves(parameter: &NeuronParameter, ensemble: &str, doubts: &Doubts<'_>) -> bool {
    let populations = doubts.config.algorithm.populations.values();
    populations.flat_map(|population| &population.objects).any(|query| match query {
        GenotypeQuery::Neurons(name, EnsembleSelector::All) => *name == parameter.name(),
        GenotypeQuery::Neurons(name, EnsembleSelector::Named(named)) => {
            *name == parameter.name() && named == ensemble
        }
        _ => false,
    })
}

/// Checks the decoded bounds of genes.
fn genes(doubts: &Doubts<'_>) {
    let spec = doubts.config.topology.neuron_model.spec();
    for (name, population) in &doubts.config.algorithm.populations {
        let path = Path::from(["algorithm", "populations", name]);
        let bounds = population.min_vals.iter().zip(&population.max_vals);
        for (i, (query, (&min, &max))) in population.objects.iter().zip(bounds).enumerate() {
            let GenotypeQuery::Neurons(name, _) = query else { continue };
            let Some(parameter) = spec.parameter(name) else { continue };
            let Some(scale) = parameter.gene else { continue };
            let (low, high) = (scale.value(min), scale.value(max));
            let max_path = path.key("max_vals").index(i);
            if parameter.is_time_constant {
                slow(high, scale.formula(max), &max_path, doubts);
            }
            if is_voltage(parameter) && low.abs().max(high.abs()) < VOLTAGE_MIN {
                let what = format!("{low} to {high} mV are nearly 0");
                doubts.add(&max_path, what, "V instead of mV");
            }
        }
    }
}

/// Whether values are usually tens of mV.
fn is_voltage(parameter: &NeuronParameter) -> bool {
    parameter.parameter.unit == "mV" && parameter.default().abs() >= 10.0 * VOLTAGE_MIN
}

fn receptors(topology: &TopologyConfig, doubts: &Doubts<'_>) {
    let Some(params) = topology.synapse_params else { return };
    let path = Path::from(["topology", "synapse_params"]);
    for (receptor, key, tau) in [
        ("AMPA", "tau", params.ampa.tau),
        ("GABA", "tau", params.gaba.tau),
        ("NMDA", "tau_rise", params.nmda.tau_rise),
        ("NMDA", "tau_decay", params.nmda.tau_decay),
    ] {
        slow(tau, tau.to_string(), &path.key(receptor).key(key), doubts);
    }
    if let Some(reversal) = params.gaba.reversal
        && reversal != 0.0
        && reversal.abs() < VOLTAGE_MIN
    {
        let what = format!("{reversal} mV is nearly 0");
        doubts.add(&path.key("GABA").key("E"), what, "V instead of mV");
    }
}

/// A time constant is shorter than a trial.
fn slow(tau: f64, shown: String, path: &Path, doubts: &Doubts<'_>) {
    let topology = &doubts.config.topology;
    let steps = f64::from(doubts.config.algorithm.evaluation_steps);
    let trial = topology.dt * f64::from(topology.time_scale) * steps;
    if tau <= trial {
        return;
    }
    let is_spiking = topology.neuron_model.is_spiking();
    let (unit, likely) = if is_spiking {
        ("ms", "us instead of ms, or a `topology.dt` that is too short")
    } else if shown == tau.to_string() {
        ("s", "ms instead of s")
    } else {
        ("s", "the time constant itself instead of its exponent")
    };
    let what = format!(
        "a time constant of {shown} {unit} is longer than a trial, {trial} {unit} of the network"
    );
    doubts.add(path, what, likely);
}
