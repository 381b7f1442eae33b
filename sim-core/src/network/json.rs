//! A network with its values, for people and other programs to read.

use serde_json::{Map, Value, json};

use super::connections::Source;
use super::{Network, Phenotype};

impl Network {
    /// Stimuli, neurons and synapses with their values. Inputs and neurons are
    /// numbered each from 0 in the order of the experiment file. A neuron has a key
    /// for every parameter of the neuron model.
    pub fn to_json(&self, phenotype: &Phenotype) -> Value {
        let stimuli = self.stimuli.iter().map(|(name, stimulus)| {
            json!({
                "name": name,
                "sensor": stimulus.sensor,
                "first_input": stimulus.inputs.start,
                "n": stimulus.inputs.len(),
            })
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
        json!({
            "dt": self.dt,
            "time_scale": self.n_substeps,
            "neuron_model": self.model,
            "stimuli": stimuli.collect::<Vec<_>>(),
            "neurons": neurons.collect::<Vec<_>>(),
            "synapses": synapses.collect::<Vec<_>>(),
            "outputs": outputs.collect::<Vec<_>>(),
        })
    }
}
