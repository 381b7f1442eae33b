//! Every algorithm finds the optimum of functions that it should.
