//! The state at the first contact.

use super::super::chain::{Chain, Tension};
use super::super::contacts::{Contacts, Direction, StepPoint};
use super::super::recorder::EventRecorder;
use super::super::rows::{Layout, Rows};
use super::state::{Engine, Fixed, Losses, Scheme};

impl<'a> Engine<'a> {
    /// The chain at its first contact.
    pub(crate) fn new(chain: &'a Chain, scheme: Scheme, step_s: f64) -> Self {
        let (bodies, interfaces) = (chain.bodies(), chain.interfaces());
        let layout = Layout::new(bodies.len());
        let laws: Vec<_> = interfaces.iter().map(|i| (Some(&*i.law), i.gap_m)).collect();
        let couples = interfaces.iter().any(|i| i.tension.is_some());
        let pull = couples.then(|| {
            let law = |t: &'a Tension| (Some(&*t.law), t.slack_m);
            let laws: Vec<_> =
                interfaces.iter().map(|i| i.tension.as_ref().map_or((None, 0.0), law)).collect();
            Contacts::new(&layout, &laws, Direction::Tension)
        });
        let of = |value: &dyn Fn(usize) -> f64| Rows::of(&layout, bodies.len(), value);
        let has_net = couples || chain.has_rates();
        let rates = if interfaces.iter().any(|i| i.rate.is_some()) { interfaces.len() } else { 0 };
        let mut engine = Self {
            mass_kg: of(&|i| bodies[i].mass_kg),
            per_kg: of(&|i| 1.0 / bodies[i].mass_kg),
            rate_factors: vec![1.0; rates],
            x_m: of(&|_| 0.0),
            v: of(&|i| bodies[i].speed_m_per_s),
            a: of(&|_| 0.0),
            a_start: of(&|_| 0.0),
            by_contacts: chain.has_resistance().then(|| of(&|_| 0.0)),
            push: Contacts::new(&layout, &laws, Direction::Compression),
            net_n: has_net.then(|| of(&|_| 0.0)),
            pull,
            crossings: Vec::new(),
            left: Vec::new(),
            end_s: 0.0,
            losses: Losses::default(),
            wall_impulse: 0.0,
            events: EventRecorder::new(chain, &layout),
            fixed: Fixed { chain, scheme, step_s, layout },
        };
        engine.move_to_first_contact();
        engine.accelerate_and_kick::<0>(StepPoint::End, 0.0, 0.0);
        engine.record_first_contacts();
        engine
    }

    /// Free motion until the first gap closes; none if no interface closes.
    fn move_to_first_contact(&mut self) {
        let (flight_s, flights) = self.fixed.chain.flights();
        self.drift::<0>(flight_s);
        for (k, interface) in self.fixed.chain.interfaces().iter().enumerate() {
            let closing = self.closing(k);
            // Exactly 0 where contact begins, whatever the rounding.
            let at = |begins_s: f64, closing: f64, gap_m: f64| {
                if begins_s == flight_s { 0.0 } else { closing * flight_s - gap_m }
            };
            let deflection = at(flights[k].0, closing, interface.gap_m);
            self.push.set_start(k, deflection, closing > 0.0);
            if let (Some(pull), Some(tension)) = (&mut self.pull, &interface.tension) {
                pull.set_start(k, at(flights[k].1, -closing, tension.slack_m), closing < 0.0);
            }
        }
    }

    fn record_first_contacts(&mut self) {
        for k in 0..self.fixed.chain.interfaces().len() {
            if !self.push.is_loading(k) {
                continue;
            }
            let closing = self.closing(k);
            self.events.interfaces[k].contact_began(closing);
            if self.push.presses(k) {
                for i in self.sides(k) {
                    self.events.touched(i, 0.0);
                }
            }
        }
    }
}
