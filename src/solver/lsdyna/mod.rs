//! LS-DYNA's time histories: one module per file, named as the solver names it.

mod ascii;
pub mod binout;
mod e12;
pub mod glstat;
pub(super) mod header;
pub mod line;
mod lsda;
pub mod matsum;
pub mod nodout;
pub mod rcforc;
pub mod rwforc;
pub mod secforc;
