//! crumple
pub mod forest;
pub mod history;
pub mod file;
pub mod solver;
pub mod manifest;
pub mod study;
pub mod unit;
pub mod build;
pub mod curve;
pub mod database;
