//! A 24 t car on a curve of one's own against a rigid wall, without any file.
//!
//!     cargo run --example wall_impact

use std::error::Error;

use crumple::curve::Envelope;
use crumple::multibody::{
    Body, Chain, EnvelopeEnd, ForceLaw, Interface, RunSettings, Unloading, simulate,
};

fn main() -> Result<(), Box<dyn Error>> {
    let curve = Envelope::new(vec![0.0, 0.1, 0.3, 1.5], vec![0.0, 3.0e6, 1.8e6, 2.4e6])?;
    let unloading = Unloading::Memory { stiffness_n_per_m: 120e6 };
    let chain = Chain::new(
        vec![Body::new("car", 24e3, 50.0 / 3.6)],
        vec![Interface::new("car|wall", ForceLaw::new(curve, unloading, EnvelopeEnd::Hold), 0.0)],
    )?;
    let settings = RunSettings::new(0.3, 0.75e-3);
    let run = simulate(&chain, &settings)?;
    let contact = &run.interfaces[0];
    println!("peak force {:.3} MN", contact.peak_force_n / 1e6);
    println!("max crush  {:.4} m", contact.max_deflection_m);
    println!("energy off by {:.0e}", run.ledger.max_energy_error);
    Ok(())
}
