//! What holds for every algorithm with every operator.
