//! Criterion benches, in `benches/`, and the peer that `pinocchio/run.py` holds against Pinocchio.
