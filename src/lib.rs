//! crumple
pub mod history;
pub mod file;
pub mod solver;
pub mod unit;
pub mod database;
