//! All tests in one binary: `cargo test --release --test all MODULE::` runs one file's.

mod common;

mod binout;
mod clients;
mod commands;
mod contact;
mod damage;
mod deck;
mod documents;
mod engine;
mod examples;
mod exports;
mod files;
mod fmu;
mod forest;
mod growing;
mod house_rules;
mod import;
mod known_solutions;
mod models;
mod nsdm;
mod openradioss;
mod overwritten;
mod rating;
mod readers;
mod readme;
mod samples;
mod slurm;
mod stride;
mod sweep;
mod trains;
mod wrong_input;
