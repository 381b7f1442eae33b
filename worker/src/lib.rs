//! (see lib)
