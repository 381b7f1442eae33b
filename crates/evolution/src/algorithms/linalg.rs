//! Matrices: storage of symmetric matrices, eigendecomposition, products.
//!
//! Every result has the same bits on every machine. This module uses only those operations of
//! nalgebra that consist of +, -, *, / and square roots in a fixed order. nalgebra is built without
//! its `matrixmultiply` kernels, which choose instructions by the processor, and with `libm-force`.
//! Products of matrices consist of products with vectors, which never use such kernels, under any
//! features.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use serde::{Deserialize, Serialize};

/// A symmetric matrix, stored as the rows of its lower triangle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Symmetric(Vec<Vec<f64>>);

impl Symmetric {
    /// Zeros, `n` x `n`.
    pub fn zero(n: usize) -> Self {
        Self((0..n).map(|i| vec![0.0; i + 1]).collect())
    }

    /// Ones on the diagonal, `n` x `n`.
    pub fn identity(n: usize) -> Self {
        let mut identity = Self::zero(n);
        identity.raise_diagonal(1.0);
        identity
    }

    /// Multiplies every entry by `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.0.iter_mut().flatten().for_each(|entry| *entry *= factor);
    }

    /// Adds `weight` * `v` `v`^T.
    pub fn add_outer(&mut self, weight: f64, v: &[f64]) {
        for (row, v_i) in self.0.iter_mut().zip(v) {
            let weighted = weight * v_i;
            for (entry, v_j) in row.iter_mut().zip(v) {
                *entry += weighted * v_j;
            }
        }
    }

    /// Raises the entries of the diagonal to at least `min`.
    pub fn raise_diagonal(&mut self, min: f64) {
        for (i, row) in self.0.iter_mut().enumerate() {
            row[i] = row[i].max(min);
        }
    }

    /// Whether the absolute value of every entry is at most `max`.
    pub fn is_within(&self, max: f64) -> bool {
        self.0.iter().flatten().all(|entry| entry.abs() <= max)
    }

    /// The full matrix.
    pub fn to_dense(&self) -> DMatrix<f64> {
        let n = self.0.len();
        DMatrix::from_fn(n, n, |i, j| self.0[i.max(j)][i.min(j)])
    }
}

/// V diag(values) V^T of a symmetric matrix, V orthogonal.
#[derive(Debug, Clone)]
pub struct Eigen {
    /// V; column k belongs to the k-th eigenvalue.
    pub vectors: DMatrix<f64>,
    /// The eigenvalues, in no particular order.
    pub values: DVector<f64>,
}

/// Most iterations per row of the eigendecomposition; two usually suffice.
const ITERATIONS_PER_ROW: usize = 100;

impl Eigen {
    /// Decomposes a symmetric matrix of finite numbers.
    ///
    /// The absolute error of the eigenvalues is about 1e-15 of the largest. If the iteration does
    /// not converge, which has never been seen, the result is the matrix's diagonal: worse, but
    /// deterministic and finite.
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        Self::within(matrix, ITERATIONS_PER_ROW * matrix.nrows())
    }

    fn within(matrix: &DMatrix<f64>, n_iterations_max: usize) -> Self {
        let n = matrix.nrows();
        // nalgebra iterates until the off-diagonal entries are small against their neighbours on
        // the diagonal. If those are zero, it iterates until squares underflow, and divides zero
        // by zero. The shift makes it compare with the norm of the matrix instead.
        let shift = 2.0 * matrix.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
        let mut shifted = matrix.clone();
        for i in 0..n {
            shifted[(i, i)] += shift;
        }
        match SymmetricEigen::try_new(shifted, f64::EPSILON, n_iterations_max) {
            Some(eigen) => {
                Self { vectors: eigen.eigenvectors, values: eigen.eigenvalues.add_scalar(-shift) }
            }
            None => Self { vectors: DMatrix::identity(n, n), values: matrix.diagonal() },
        }
    }

    /// V diag(`scales`) V^T `x`.
    pub fn apply(&self, scales: &DVector<f64>, x: &DVector<f64>) -> DVector<f64> {
        &self.vectors * self.vectors.tr_mul(x).component_mul(scales)
    }
}

/// `a` * `b`.
pub fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut result = DMatrix::zeros(a.nrows(), b.ncols());
    for (mut column, b_column) in result.column_iter_mut().zip(b.column_iter()) {
        column.gemv(1.0, a, &b_column, 0.0);
    }
    result
}

#[cfg(test)]
mod tests {
    use determinism::random::{Purpose, Stream};

    use super::*;

    fn recompose(eigen: &Eigen) -> DMatrix<f64> {
        &eigen.vectors * DMatrix::from_diagonal(&eigen.values) * eigen.vectors.transpose()
    }

    fn assert_decomposes(matrix: &DMatrix<f64>) {
        let n = matrix.nrows();
        let eigen = Eigen::new(matrix);
        let error = (recompose(&eigen) - matrix).amax();
        assert!(error <= 1e-13 * matrix.amax() * n as f64, "{error:e} {matrix}");
        let gram = eigen.vectors.transpose() * &eigen.vectors;
        assert!((gram - DMatrix::identity(n, n)).amax() < 1e-12 * n as f64, "{matrix}");
    }

    fn random_factor(rows: usize, columns: usize) -> DMatrix<f64> {
        let mut rng = Stream::new(3, 0, 0, Purpose::Evolution, 0);
        DMatrix::from_fn(rows, columns, |_, _| rng.normal())
    }

    #[test]
    fn symmetric_matrices_of_every_kind_decompose() {
        for n in [1, 2, 3, 10, 40] {
            let a = random_factor(n, n);
            assert_decomposes(&(&a * a.transpose()));
            assert_decomposes(&(&a + a.transpose()));
            assert_decomposes(&DMatrix::identity(n, n));
            assert_decomposes(&DMatrix::zeros(n, n));
            assert_decomposes(&DMatrix::from_element(n, n, 1.0));
            let low_rank = random_factor(n, n.div_ceil(8));
            assert_decomposes(&(&low_rank * low_rank.transpose()));
            let powers = DVector::from_fn(n, |i, _| libm::pow(10.0, -(i as f64)));
            assert_decomposes(&DMatrix::from_diagonal(&powers));
        }
    }

    /// Without the shift, some of these matrices decompose to NaN.
    #[test]
    fn sparse_matrices_of_low_rank_decompose() {
        let n = 33;
        let mut rng = Stream::new(5, 0, 0, Purpose::Evolution, 0);
        for _ in 0..200 {
            let mut matrix = DMatrix::zeros(n, n);
            for _ in 0..10 {
                let (i, j) = (rng.below(n), rng.below(n));
                matrix[(i, j)] = 1.0;
                matrix[(j, i)] = 1.0;
            }
            assert_decomposes(&matrix);
        }
    }

    #[test]
    fn a_decomposition_that_runs_out_of_iterations_is_the_diagonal() {
        let a = random_factor(10, 10);
        let matrix = &a * a.transpose();
        let eigen = Eigen::within(&matrix, 1);
        assert_eq!(recompose(&eigen), DMatrix::from_diagonal(&matrix.diagonal()));
    }

    #[test]
    fn symmetric_storage_agrees_with_dense_arithmetic() {
        let v = DVector::from_vec(vec![1.0, -2.0, 0.5]);
        let mut symmetric = Symmetric::identity(3);
        symmetric.scale(0.5);
        symmetric.add_outer(3.0, v.as_slice());
        let dense = DMatrix::identity(3, 3) * 0.5 + &v * v.transpose() * 3.0;
        assert_eq!(symmetric.to_dense(), dense);
        symmetric.raise_diagonal(4.0);
        assert_eq!(symmetric.to_dense().diagonal(), DVector::from_vec(vec![4.0, 12.5, 4.0]));
        assert_eq!(symmetric.to_dense()[(2, 1)], dense[(2, 1)]);
    }

    #[test]
    fn products_agree_with_the_library() {
        let (a, b) = (random_factor(7, 5), random_factor(5, 6));
        assert!((product(&a, &b) - a * b).amax() < 1e-14);
    }

    /// These bits come from an x86-64 machine with fused multiply-add, which the code must not
    /// use. A version of nalgebra that changes them changes runs by xNES and CMA-ES.
    #[test]
    fn the_bits_of_a_decomposition_are_fixed() {
        let a = random_factor(30, 30);
        let symmetric = &a + a.transpose();
        let eigen = Eigen::new(&symmetric);
        let ones = DVector::from_element(30, 1.0);
        let scales = eigen.values.map(libm::exp);
        let y = eigen.apply(&scales, &ones);
        let z = product(&symmetric, &eigen.vectors);
        let bits = [y[0], y[29], z[(0, 0)], z[(29, 29)]].map(f64::to_bits);
        assert_eq!(bits, GOLDEN, "{bits:#x?}");
    }

    const GOLDEN: [u64; 4] = [
        0x4133_942e_9814_c1b3,
        0xc0f4_e856_254b_2dc6,
        0x3fe3_09af_8381_7472,
        0xbfcd_73a7_c30e_e9d6,
    ];
}
