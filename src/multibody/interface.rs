//! Force law of an interface: elastic, or elastic-plastic with memory.

use crate::curve::Envelope;

/// What happens when the deflection falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unloading {
    /// The envelope is followed back (the reference model, which has no memory).
    Elastic,
    /// A straight line of this stiffness in N/m; reloading follows it back up.
    Memory { stiffness_n_per_m: f64 },
}

/// What the force does beyond the envelope's last point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvelopeEnd {
    /// The last force is held.
    Hold,
    /// The last segment is continued if it rises, else the last force is held.
    Slope,
    /// The run ends with an error that names the interface.
    Error,
}

/// Force over deflection at an interface.
///
/// Invariant: with memory, the unloading stiffness is at least the envelope's steepest
/// rise, so that no deflection creates energy.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceLaw {
    envelope: Envelope,
    unloading: Unloading,
    end: EnvelopeEnd,
    end_slope_n_per_m: f64,
}

impl ForceLaw {
    /// A softer unloading than the envelope's steepest rise is raised to it; forces below
    /// zero become zero, because an interface only pushes.
    pub fn new(envelope: Envelope, unloading: Unloading, end: EnvelopeEnd) -> Self {
        let envelope = envelope.pushing();
        let n = envelope.deflection_m().len();
        let (d, f) = (envelope.deflection_m(), envelope.force_n());
        let end_slope_n_per_m = match end {
            EnvelopeEnd::Slope => ((f[n - 1] - f[n - 2]) / (d[n - 1] - d[n - 2])).max(0.0),
            EnvelopeEnd::Hold | EnvelopeEnd::Error => 0.0,
        };
        let unloading = match unloading {
            Unloading::Elastic => Unloading::Elastic,
            Unloading::Memory { stiffness_n_per_m } => {
                Unloading::Memory { stiffness_n_per_m: stiffness_n_per_m.max(envelope.max_slope()) }
            }
        };
        Self { envelope, unloading, end, end_slope_n_per_m }
    }

    pub fn unloading(&self) -> Unloading {
        self.unloading
    }

    /// Whether the run may not go to this deflection.
    pub fn is_beyond_end(&self, deflection_m: f64) -> bool {
        self.end == EnvelopeEnd::Error && deflection_m > self.envelope.end_m()
    }

    /// Deflection at which the envelope's table ends, in m.
    pub fn end_m(&self) -> f64 {
        self.envelope.end_m()
    }

    /// Largest stiffness the integrator meets, in N/m.
    pub fn max_stiffness_n_per_m(&self) -> f64 {
        match self.unloading {
            Unloading::Elastic => self.envelope.max_slope().max(self.steepest_fall()),
            Unloading::Memory { stiffness_n_per_m } => stiffness_n_per_m,
        }
    }

    fn steepest_fall(&self) -> f64 {
        let (d, f) = (self.envelope.deflection_m(), self.envelope.force_n());
        (1..d.len()).map(|i| (f[i - 1] - f[i]) / (d[i] - d[i - 1])).fold(0.0, f64::max)
    }

    /// `F_e(δ)` on the loading branch, in N; `δ ≥ 0`.
    pub fn envelope_n(&self, deflection_m: f64) -> f64 {
        let beyond = (deflection_m - self.envelope.end_m()).max(0.0);
        self.envelope.force_at(deflection_m) + self.end_slope_n_per_m * beyond
    }

    /// `A(δ) = ∫₀^δ F_e`, exact for the table, in J; `δ ≥ 0`.
    fn envelope_work_j(&self, deflection_m: f64) -> f64 {
        let beyond = (deflection_m - self.envelope.end_m()).max(0.0);
        self.envelope.work_to(deflection_m) + 0.5 * self.end_slope_n_per_m * beyond * beyond
    }

    /// Force in N at `deflection_m` after the deflection has once been `largest_m`
    /// (`largest_m ≥ deflection_m`, `largest_m ≥ 0`).
    pub fn force_n(&self, deflection_m: f64, largest_m: f64) -> f64 {
        if deflection_m <= 0.0 {
            return 0.0;
        }
        match self.unloading {
            Unloading::Elastic => self.envelope_n(deflection_m),
            Unloading::Memory { .. } if deflection_m >= largest_m => self.envelope_n(deflection_m),
            Unloading::Memory { stiffness_n_per_m } => {
                let top = self.envelope_n(largest_m);
                (top - stiffness_n_per_m * (largest_m - deflection_m)).max(0.0)
            }
        }
    }

    /// Stored and dissipated energy in J at a deflection, given the largest so far.
    pub fn energies_j(&self, deflection_m: f64, largest_m: f64) -> (f64, f64) {
        if largest_m <= 0.0 {
            return (0.0, 0.0); // never in contact
        }
        match self.unloading {
            Unloading::Elastic => (self.envelope_work_j(deflection_m.max(0.0)), 0.0),
            Unloading::Memory { stiffness_n_per_m } => {
                let stored = |force: f64| force * force / (2.0 * stiffness_n_per_m);
                let top = self.envelope_n(largest_m);
                let dissipated = self.envelope_work_j(largest_m) - stored(top);
                (stored(self.force_n(deflection_m, largest_m)), dissipated)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(unloading: Unloading) -> ForceLaw {
        let envelope = Envelope::new(vec![0.0, 0.1, 0.5], vec![0.0, 1e6, 0.6e6]).unwrap();
        ForceLaw::new(envelope, unloading, EnvelopeEnd::Hold)
    }

    #[test]
    fn unloads_and_reloads_on_one_line() {
        let law = law(Unloading::Memory { stiffness_n_per_m: 40e6 });
        let top = law.force_n(0.3, 0.3);
        assert_eq!(top, 0.8e6);
        assert!((law.force_n(0.29, 0.3) - 0.4e6).abs() < 1e-6);
        assert!(law.force_n(0.28, 0.3) < 1e-6, "residual crush is 0.28 m");
        assert_eq!(law.force_n(0.1, 0.3), 0.0);
        assert_eq!(law.force_n(-0.1, 0.3), 0.0);
    }

    #[test]
    fn stored_and_dissipated_add_up_to_the_work_done() {
        let law = law(Unloading::Memory { stiffness_n_per_m: 40e6 });
        let (stored, dissipated) = law.energies_j(0.3, 0.3);
        assert!((stored + dissipated - (0.05e6 + 0.18e6)).abs() < 1e-6);
        assert!((stored - 0.8e6 * 0.8e6 / 80e6).abs() < 1e-6);
        let (stored, same) = law.energies_j(0.2, 0.3);
        assert_eq!((stored, same), (0.0, dissipated));
    }

    #[test]
    fn soft_unloading_is_raised_to_the_steepest_rise() {
        let law = law(Unloading::Memory { stiffness_n_per_m: 1.0 });
        assert_eq!(law.unloading(), Unloading::Memory { stiffness_n_per_m: 10e6 });
    }

    #[test]
    fn ends_of_the_envelope() {
        let envelope = || Envelope::new(vec![0.0, 1.0], vec![0.0, 1.0]).unwrap();
        let hold = ForceLaw::new(envelope(), Unloading::Elastic, EnvelopeEnd::Hold);
        assert_eq!(hold.force_n(3.0, 3.0), 1.0);
        let slope = ForceLaw::new(envelope(), Unloading::Elastic, EnvelopeEnd::Slope);
        assert_eq!(slope.force_n(3.0, 3.0), 3.0);
        assert_eq!(slope.energies_j(3.0, 3.0).0, 4.5);
        let error = ForceLaw::new(envelope(), Unloading::Elastic, EnvelopeEnd::Error);
        assert!(error.is_beyond_end(1.1) && !error.is_beyond_end(1.0));
    }
}
