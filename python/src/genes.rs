//! Genotypes encoded for a fleet.

use numpy::PyReadonlyArray2;
use prost::Message as _;
use pyo3::{prelude::*, types::PyBytes};
use swarm_proto::v1::Genes;

/// Genotypes `[P, d]`, each as the bytes of a message `Genes`. Going through Python's lists
/// takes ten times as long.
#[pyfunction]
pub fn encode_genes<'py>(
    py: Python<'py>,
    genotypes: PyReadonlyArray2<'py, f64>,
) -> Vec<Bound<'py, PyBytes>> {
    let genotypes = genotypes.as_array();
    let encoded = genotypes.rows().into_iter().map(|genes| Genes { values: genes.to_vec() });
    encoded.map(|genes| PyBytes::new(py, &genes.encode_to_vec())).collect()
}
