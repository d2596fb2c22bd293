//! Curve database
pub fn histories_to_hdf5(_f:&crate::solver::SolverFile)->Result<Vec<u8>, std::io::Error>{ Ok(vec![]) }
