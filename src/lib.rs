//! crumple
pub mod forest;
pub mod history;
pub mod export;
pub mod file;
pub mod multibody;
pub mod scenario;
pub mod solver;
pub mod manifest;
pub mod study;
pub mod surrogate;
pub mod unit;
pub mod build;
pub mod compare;
pub mod curve;
pub mod database;
pub mod dataset;
