//! Force law of an interface: elastic, or elastic-plastic with memory.

use crate::curve::Envelope;

/// What happens when the deflection falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unloading {
    /// The envelope is followed back (the reference model, which has no memory).
    Elastic,
    /// A straight line of this stiffness in N/m; reloading follows it back up. Where the
    /// envelope rises more steeply than that, the line is stiffer: see [`ForceLaw`].
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
/// Invariant: with memory, the dissipated energy never falls while the deflection grows, so
/// that no deflection creates energy. One stiffness `k` for all deflections keeps to this
/// only if it is at least the envelope's steepest rise `k_s`: FE curves begin with a spike
/// whose flank is far steeper than the line on which the vehicle rebounds at the end, and
/// one stiff line for both would lose most of the rebound. Therefore the line at δ stores
/// `U = max(A − D, S(k_s))` with `S(k) = min(F_e²/2k, F_e δ/2)` and
/// `D = max over s ≤ δ of A(s) − S(k)(s)`, not below 0; its stiffness is `F_e²/2U`. The bound
/// `F_e δ/2` keeps the line from reaching zero deflection with a force left, whose energy would
/// be lost. With `k ≥ k_s` and an envelope from (0, 0) this is the law of one stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceLaw {
    envelope: Envelope,
    unloading: Unloading,
    end: EnvelopeEnd,
    end_slope_n_per_m: f64,
    /// Steepest rise of the envelope, or the unloading stiffness if that is more.
    steepest_n_per_m: f64,
    /// `D` at each point of the envelope, in J.
    dissipated_j: Vec<f64>,
}

/// `S`: energy that a line of this stiffness, or the stiffer one to (0, 0), can store.
fn storable(deflection_m: f64, force_n: f64, stiffness_n_per_m: f64) -> f64 {
    0.5 * force_n * (force_n / stiffness_n_per_m).min(deflection_m)
}

impl ForceLaw {
    /// Forces below zero become zero, because an interface only pushes.
    pub fn new(envelope: Envelope, unloading: Unloading, end: EnvelopeEnd) -> Self {
        let envelope = envelope.pushing();
        let n = envelope.deflection_m().len();
        let (d, f) = (envelope.deflection_m(), envelope.force_n());
        let end_slope_n_per_m = match end {
            EnvelopeEnd::Slope => ((f[n - 1] - f[n - 2]) / (d[n - 1] - d[n - 2])).max(0.0),
            EnvelopeEnd::Hold | EnvelopeEnd::Error => 0.0,
        };
        let (mut steepest_n_per_m, mut dissipated_j) = (envelope.max_slope(), Vec::new());
        if let Unloading::Memory { stiffness_n_per_m } = unloading {
            steepest_n_per_m = steepest_n_per_m.max(stiffness_n_per_m);
            let mut most = 0.0_f64;
            for (&d, &f) in d.iter().zip(f) {
                most = most.max(envelope.work_to(d) - storable(d, f, stiffness_n_per_m));
                dissipated_j.push(most);
            }
        }
        Self { envelope, unloading, end, end_slope_n_per_m, steepest_n_per_m, dissipated_j }
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
            Unloading::Memory { .. } => self.steepest_n_per_m,
        }
    }

    /// Force on the envelope at δ and the energy stored there, in N and J.
    fn stored_at(&self, deflection_m: f64, stiffness_n_per_m: f64) -> (f64, f64) {
        let force = self.envelope_n(deflection_m);
        let work = self.envelope_work_j(deflection_m);
        let before = self.envelope.deflection_m().partition_point(|&d| d <= deflection_m);
        // Within a segment A − S is monotone for either bound, so its ends and δ decide.
        let dissipated = self.dissipated_j[before.max(1) - 1]
            .max(work - storable(deflection_m, force, stiffness_n_per_m));
        let least = storable(deflection_m, force, self.steepest_n_per_m);
        (force, (work - dissipated).max(least))
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
                let (top, stored) = self.stored_at(largest_m, stiffness_n_per_m);
                if stored <= 0.0 {
                    return 0.0; // the envelope itself has no force here
                }
                let stiffness = 0.5 * top * top / stored;
                (top - stiffness * (largest_m - deflection_m)).max(0.0)
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
                let (top, stored) = self.stored_at(largest_m, stiffness_n_per_m);
                let dissipated = self.envelope_work_j(largest_m) - stored;
                if top <= 0.0 {
                    return (0.0, dissipated);
                }
                let share = self.force_n(deflection_m, largest_m) / top;
                (share * share * stored, dissipated)
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

    /// Softer than the spike's flank: the rebound at the end follows the stiffness asked
    /// for, and on the way there no step of the deflection gives energy back.
    #[test]
    fn soft_unloading_never_creates_energy() {
        let envelope =
            || Envelope::new(vec![0.0, 0.01, 0.02, 0.5], vec![0.0, 3e6, 1e6, 2e6]).unwrap();
        let with = |stiffness_n_per_m| {
            let unloading = Unloading::Memory { stiffness_n_per_m };
            ForceLaw::new(envelope(), unloading, EnvelopeEnd::Hold)
        };
        let soft = with(40e6);
        assert_eq!(soft.max_stiffness_n_per_m(), 300e6);
        let (stored, _) = soft.energies_j(0.4, 0.4);
        let top = soft.force_n(0.4, 0.4);
        assert!((stored - top * top / 80e6).abs() < 1e-6, "on its own line at the end");
        let mut before = 0.0;
        for i in 1..=600 {
            let largest = 1e-3 * f64::from(i);
            let (stored, dissipated) = soft.energies_j(largest, largest);
            assert!(dissipated >= before - 1e-9, "at {largest} m");
            let line = with(300e6).energies_j(largest, largest);
            assert!(stored >= line.0 - 1e-9 && dissipated <= line.1 + 1e-9);
            before = dissipated;
            // What is stored comes back on the way to zero deflection, all of it.
            let steps = 20_000;
            let at = |k: i32| largest * f64::from(k) / f64::from(steps);
            let force = |k: i32| soft.force_n(at(k).max(1e-15), largest);
            let work: f64 =
                (0..steps).map(|k| 0.5 * (force(k) + force(k + 1)) * (at(k + 1) - at(k))).sum();
            assert!((work - stored).abs() < 1e-3 * stored, "{work} of {stored} at {largest} m");
        }
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
