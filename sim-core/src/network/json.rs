//! Writes a network with its values as JSON, for people and other programs.

use serde_json::{Map, Value, json};

use super::connections::Source;
use super::{Network, Phenotype};

impl Network {
    /// Stimuli, neurons and synapses with their values. Inputs, neurons and nodes of encoders each
    /// have numbers from 0, in the order of the experiment file. A neuron has a key for every
    /// parameter of the neuron model.
    pub fn to_json(&self, phenotype: &Phenotype) -> Value {
        let n_neurons = self.n_neurons();
        let mut weights_of_fields = phenotype.encoders.iter();
        let stimuli = self.stimuli.iter().map(|(name, stimulus)| {
            let mut json = json!({
                "name": name,
                "sensor": stimulus.sensor,
                "first_input": stimulus.inputs.start,
                "n": stimulus.inputs.len(),
            });
            if let Some(encoder) = &stimulus.encoder {
                json["encoder"] = json!(encoder.config);
                json["encoder"]["first_node"] = json!(encoder.nodes.start);
                json["encoder"]["n_nodes"] = json!(encoder.nodes.len());
                let axons = n_neurons + encoder.nodes.start..n_neurons + encoder.nodes.end;
                if let Some(delays) = phenotype.delays.get(axons) {
                    json["encoder"]["delays"] = json!(delays);
                }
                let weights = weights_of_fields.next().expect("every encoder has weights or none");
                if !weights.is_empty() {
                    json["encoder"]["weights"] =
                        weights.chunks_exact(stimulus.inputs.len()).collect();
                }
            }
            json
        });
        let neurons = self.ensembles.iter().flat_map(|(name, ensemble)| {
            ensemble.neurons.clone().map(move |neuron| {
                let parameters = phenotype.neurons.iter();
                let mut keys: Map<String, Value> = parameters
                    .map(|(&name, values)| (name.into(), values[neuron].into()))
                    .collect();
                keys.insert("ensemble".into(), json!(name));
                if let Some(delay) = phenotype.delays.get(neuron) {
                    keys.insert("delay".into(), json!(delay));
                }
                if let Some(activation) = ensemble.activation {
                    keys.insert("activation".into(), json!(activation));
                }
                Value::Object(keys)
            })
        });
        let synapses = self.groups.iter().flat_map(|(name, group)| {
            group.synapses.clone().map(move |index| {
                let synapse = self.synapses[index];
                let pre = match synapse.pre {
                    Source::Input(input) => json!({ "input": input }),
                    Source::Neuron(neuron) => json!({ "neuron": neuron }),
                    Source::Encoded(node) => json!({ "node": node }),
                };
                let mut json = json!({
                    "group": name,
                    "pre": pre,
                    "post": synapse.post,
                    "weight": phenotype.weights[index],
                    "trainable": group.trainable,
                });
                if let Some(transmitter) = group.transmitter {
                    json["transmitter"] = json!(transmitter);
                }
                json
            })
        });
        let outputs = self.outputs.iter().zip(&phenotype.decoders).map(|(output, weights)| {
            let mut json = json!({
                "actuator": output.actuator,
                "first_neuron": output.neurons.start,
                "n": output.neurons.len(),
            });
            if !weights.is_empty() {
                json["weights"] = weights.chunks_exact(output.neurons.len()).collect();
            }
            json
        });
        let mut json = json!({
            "dt": self.dt,
            "time_scale": self.n_substeps,
            "neuron_model": self.model,
            "stimuli": stimuli.collect::<Vec<_>>(),
            "neurons": neurons.collect::<Vec<_>>(),
            "synapses": synapses.collect::<Vec<_>>(),
            "outputs": outputs.collect::<Vec<_>>(),
        });
        if let Some(learning) = &self.learning {
            let groups = self.groups.iter().zip(&phenotype.learning);
            let plastic = groups.filter(|((_, group), _)| group.is_plastic);
            let coefficients: Map<String, Value> =
                plastic.map(|((name, _), abcd)| (name.clone(), json!(abcd))).collect();
            json["learning"] = json!({
                "learning_rate": learning.learning_rate,
                "max_weight": learning.max_weight,
                "reward": learning.reward,
                "coefficients": coefficients,
            });
        }
        json
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use crate::Simulation;
    use experiment_file::ExperimentConfig;

    fn network(file: &str) -> serde_json::Value {
        let (config, _) = ExperimentConfig::from_json(file, "test", evolution::ALGORITHMS).unwrap();
        let simulation = Simulation::compile(&config).unwrap();
        simulation.network_json(&vec![0.5; simulation.genotype_len()]).unwrap()
    }

    #[test]
    fn synapses_start_from_the_nodes_of_encoders() {
        let network =
            network(include_str!("../../../configs/spiking/light_follower_lif_encoded.json"));
        let stimuli = network["stimuli"].as_array().unwrap();
        let nodes = |index: usize| {
            let encoder = &stimuli[index]["encoder"];
            [&encoder["scheme"], &encoder["first_node"], &encoder["n_nodes"]]
        };
        assert_eq!(stimuli[0].get("encoder"), None);
        assert_eq!(nodes(2), [&json!("LIF_Encoding"), &json!(0), &json!(2)]);
        assert_eq!(nodes(3), [&json!("RankOrderCoding"), &json!(2), &json!(3)]);
        assert_eq!(nodes(4), [&json!("PoissonRateCoding"), &json!(5), &json!(12)]);
        assert_eq!(stimuli[4]["first_input"], 6);
        let synapses = network["synapses"].as_array().unwrap();
        let from =
            |key: &str| synapses.iter().filter_map(|synapse| synapse["pre"][key].as_u64()).max();
        assert_eq!((from("node"), from("input")), (Some(16), Some(3)));
        assert_eq!(network.get("learning"), None);
    }

    #[test]
    fn plastic_groups_have_their_coefficients() {
        let network =
            network(include_str!("../../../configs/spiking/leader_selection_lif_plastic.json"));
        let learning = &network["learning"];
        assert_eq!(learning["coefficients"].as_object().unwrap().len(), 3);
        assert_eq!(learning["coefficients"]["H1-H2"], json!([0.0, 0.0, 0.0, 0.0]));
        assert_eq!(learning["reward"], json!({"delay": 30, "discount": 0.9}));
    }
}
