//! How often a direction comes from the guide, and from which of its sets: learnt by following the gradient of the
//! divergence between what is sampled and what would be ideal (Müller 2019, section 10.5).

use lucerna_core::interfaces::{GuideRecord, RecordKind};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};

/// Parameters of the descent: Kingma and Ba 2015; rate and regularisation from Müller 2019, algorithm 3.
const RATE: f32 = 0.01;
const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;
const REGULARISATION: f32 = 0.01;

/// The latent variable stays within this: probabilities from 4e-4.
const MOST: f32 = 8.0;

/// A learnt probability stays within these, so that neither way of sampling is given up.
pub const LIMITS: (f32, f32) = (0.05, 0.95);

/// The probability of the guide stays below this, so that light the guide has not seen counts at most 3.3 times what it
/// would by the BSDF alone, and not 20 times. Light it has seen counts at most 1.36 times what it would at 0.95.
const MOST_LEARNT: f32 = 0.7;

/// The state of the descent in one leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mixing {
    /// The probability of the BSDF, or of the first of two sets, is the logistic function of it.
    theta: f32,
    /// First and second moment of the gradient.
    m: f32,
    v: f32,
    /// The decay of both since the first step.
    decay_1: f32,
    decay_2: f32,
    steps: u32,
    /// Sum and number of the radiance scattered: gradients are measured by its mean. The text leaves them as they are,
    /// since the descent does not depend on their size; but the regularisation, which is added to them, then does.
    sum: f64,
    count: f64,
}

impl Mixing {
    /// Writes it.
    pub fn pack(&self, to: &mut Packer) {
        let Mixing { theta, m, v, decay_1, decay_2, steps, sum, count } = *self;
        [theta, m, v, decay_1, decay_2].into_iter().for_each(|value| to.f32(value));
        to.u32(steps);
        to.f64(sum);
        to.f64(count);
    }

    /// Reads what was written.
    ///
    /// # Errors
    /// If no descent could have come there.
    pub fn unpack(from: &mut Cursor<'_>) -> Result<Self> {
        let mut next = || from.f32("a probability's descent");
        let (theta, m, v, decay_1, decay_2) = (next()?, next()?, next()?, next()?, next()?);
        let steps = from.u32("a probability's descent")?;
        let (sum, count) = (from.f64("a probability's descent")?, from.f64("a probability's descent")?);
        let within = |x: f32, low: f32, high: f32| (low..=high).contains(&x);
        let usable = within(theta, -MOST, MOST)
            && m.is_finite()
            && within(v, 0.0, f32::MAX)
            && within(decay_1, 0.0, 1.0)
            && within(decay_2, 0.0, 1.0)
            && [sum, count].into_iter().all(|x| (0.0..=f64::MAX).contains(&x));
        match usable {
            true => Ok(Mixing { theta, m, v, decay_1, decay_2, steps, sum, count }),
            false => Err(IoError::new("the descent of a probability has come where it cannot")),
        }
    }

    /// Probability of the guide.
    pub fn p_guide(&self) -> f32 {
        (1.0 - self.p()).clamp(LIMITS.0, MOST_LEARNT)
    }

    /// Probability of the first of two sets, given that the direction comes from the guide. Before anything was learnt it
    /// is the logistic function of `origin`.
    pub fn p_first(&self, origin: f32) -> f32 {
        self.p_from(origin).clamp(LIMITS.0, LIMITS.1)
    }

    fn p(&self) -> f32 {
        self.p_from(0.0)
    }

    fn p_from(&self, origin: f32) -> f32 {
        1.0 / (1.0 + (-(self.theta + origin)).exp())
    }

    /// Takes in a record, to learn the probability of the BSDF.
    pub fn step(&mut self, record: &GuideRecord) {
        let GuideRecord { scattered, pdf_bsdf, pdf_guide, kind, .. } = *record;
        match kind {
            RecordKind::Unguided => {}
            // The guide has no part in a delta lobe.
            RecordKind::Delta => self.follow(scattered, 0.0, |p| 1.0 / p),
            RecordKind::Mixed => {
                self.follow(scattered, 0.0, |p| (pdf_bsdf - pdf_guide) / (p * pdf_bsdf + (1.0 - p) * pdf_guide));
            }
        }
    }

    /// Takes in a record, to learn the probability of the first of two sets in a guide that has this probability itself.
    pub fn step_sets(&mut self, record: &GuideRecord, p_guide: f32, origin: f32) {
        let GuideRecord { scattered, pdf_bsdf, pdf_sets: [first, second], kind, .. } = *record;
        // A delta lobe says nothing about either, nor does a place that has one alone.
        if kind == RecordKind::Mixed && first != second {
            let rest = (1.0 - p_guide) * pdf_bsdf;
            self.follow(scattered, origin, |p| {
                p_guide * (first - second) / (rest + p_guide * (p * first + (1.0 - p) * second))
            });
        }
    }

    /// Goes a step, where a mixture in which the first part has probability p has the density q, and (∂q/∂p)/q is
    /// `slope(p)`.
    #[inline(always)]
    fn follow(&mut self, scattered: f32, origin: f32, slope: impl FnOnce(f32) -> f32) {
        self.sum += f64::from(scattered);
        self.count += 1.0;
        if scattered <= 0.0 {
            return;
        }
        let p = self.p_from(origin);
        let share = slope(p);
        let product = (f64::from(scattered) / (self.sum / self.count)) as f32;
        let gradient = -product * share * p * (1.0 - p) + REGULARISATION * self.theta;
        if gradient.is_finite() {
            self.descend(gradient);
        }
    }

    fn descend(&mut self, gradient: f32) {
        if self.steps == 0 {
            (self.decay_1, self.decay_2) = (1.0, 1.0);
        }
        self.steps = self.steps.saturating_add(1);
        self.decay_1 *= BETA_1;
        self.decay_2 *= BETA_2;
        self.m = BETA_1 * self.m + (1.0 - BETA_1) * gradient;
        self.v = BETA_2 * self.v + (1.0 - BETA_2) * gradient * gradient;
        let rate = RATE * (1.0 - self.decay_2).sqrt() / (1.0 - self.decay_1);
        self.theta = (self.theta - rate * self.m / (self.v.sqrt() + EPSILON)).clamp(-MOST, MOST);
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use lucerna_core::math::Vec3;
    use lucerna_core::sampling::Pcg32;

    /// What a path finds where directions are numbers in [0, 1): the BSDF is uniform, the guide has probability `p_guide`
    /// and is uniform on the first `part`, and `inside` of the light comes from there, the rest from elsewhere.
    pub fn found_in_a_part(p_guide: f32, part: f32, inside: f32, pcg: &mut Pcg32) -> GuideRecord {
        let (choice, u) = (pcg.next_f32(), pcg.next_f32());
        let x = if choice < p_guide { part * u } else { u };
        let pdf_guide = if x < part { 1.0 / part } else { 0.0 };
        let pdf = p_guide * pdf_guide + (1.0 - p_guide);
        let radiance = if x < part { inside / part } else { (1.0 - inside) / (1.0 - part) };
        GuideRecord {
            p: Vec3::ZERO,
            d: Vec3::Z,
            radiance,
            direct: 0.0,
            scattered: radiance / pdf,
            pdf,
            pdf_bsdf: 1.0,
            pdf_guide,
            pdf_sets: [0.0; 2],
            kind: RecordKind::Mixed,
            primary: false,
        }
    }

    /// Learns the probability of a guide that knows a tenth of the directions; what is ideal is known in closed form.
    fn learn(inside: f32, scale: f32, steps: u32) -> f32 {
        let (mut mixing, mut pcg) = (Mixing::default(), Pcg32::new(7, 7));
        for _ in 0..steps {
            let record = found_in_a_part(mixing.p_guide(), 0.1, inside, &mut pcg);
            mixing.step(&GuideRecord { scattered: scale * record.scattered, ..record });
        }
        assert_eq!(mixing.p_guide(), (1.0 - mixing.p()).clamp(0.05, MOST_LEARNT));
        1.0 - mixing.p()
    }

    /// The mixture can be what is ideal: then p + (1 − p)/10 of the samples are inside.
    #[test]
    fn the_ideal_probability_is_found_at_any_scale() {
        for ideal in [0.2_f32, 0.5, 0.8] {
            let inside = ideal + 0.1 * (1.0 - ideal);
            for scale in [1e-12, 1e-4, 1.0, 1e8] {
                let found = learn(inside, scale, 20_000);
                assert!((found - ideal).abs() < 0.08, "{ideal} at {scale}: {found}");
            }
        }
    }

    /// The same with two sets, one uniform on the first tenth, the other on the next two. What is ideal is the mixture of
    /// given probabilities; both are learnt at once, by what they are at the start of a round of 500 records.
    fn learn_sets(ideal: [f32; 2], scale: f32, rounds: u32) -> [f32; 2] {
        let densities = |x: f32| [if x < 0.1 { 10.0 } else { 0.0 }, if (0.1..0.3).contains(&x) { 5.0 } else { 0.0 }];
        let mixture = |[p, c]: [f32; 2], x: f32| {
            let [first, second] = densities(x);
            (1.0 - p) + p * (c * first + (1.0 - c) * second)
        };
        let (mut of_guide, mut of_first, mut pcg) = (Mixing::default(), Mixing::default(), Pcg32::new(7, 7));
        for _ in 0..rounds {
            let used = [of_guide.p_guide(), of_first.p_first(0.0)];
            for _ in 0..500 {
                let u = pcg.next_f32();
                let x = match (pcg.next_f32() < used[0], pcg.next_f32() < used[1]) {
                    (false, _) => u,
                    (true, true) => 0.1 * u,
                    (true, false) => 0.1 + 0.2 * u,
                };
                let [first, second] = densities(x);
                let c = of_first.p_first(0.0);
                let record = GuideRecord {
                    p: Vec3::ZERO,
                    d: Vec3::Z,
                    radiance: 1.0,
                    direct: 0.0,
                    scattered: scale * mixture(ideal, x) / mixture(used, x),
                    pdf: 1.0,
                    pdf_bsdf: 1.0,
                    pdf_guide: c * first + (1.0 - c) * second,
                    pdf_sets: [first, second],
                    kind: RecordKind::Mixed,
                    primary: false,
                };
                let p_guide = of_guide.p_guide();
                of_guide.step(&record);
                of_first.step_sets(&record, p_guide, 0.0);
            }
        }
        [of_guide.p_guide(), of_first.p_first(0.0)]
    }

    #[test]
    fn the_ideal_part_of_each_set_is_found_at_any_scale() {
        for ideal in [[0.7, 0.2], [0.7, 0.8], [0.4, 0.5], [0.5, 0.9]] {
            for scale in [1e-12, 1.0, 1e8] {
                let found = learn_sets(ideal, scale, 80);
                let far = found.iter().zip(ideal).any(|(found, ideal)| (found - ideal).abs() > 0.08);
                assert!(!far, "{ideal:?} at {scale}: {found:?}");
            }
        }
    }

    /// Nothing is learnt about sets of which there is one, or from a delta lobe; extremes leave a probability.
    #[test]
    fn the_part_of_a_set_stays_where_nothing_tells_of_it() {
        let record = GuideRecord {
            p: Vec3::ZERO,
            d: Vec3::Z,
            radiance: 1.0,
            direct: 1.0,
            scattered: 1.0,
            pdf: 0.5,
            pdf_bsdf: 1.0,
            pdf_guide: 0.5,
            pdf_sets: [0.5; 2],
            kind: RecordKind::Mixed,
            primary: false,
        };
        let mut mixing = Mixing::default();
        mixing.step_sets(&record, 0.5, 0.0);
        mixing.step_sets(&GuideRecord { kind: RecordKind::Delta, pdf_sets: [0.0, 1.0], ..record }, 0.5, 0.0);
        assert_eq!(mixing, Mixing::default());
        for scattered in [f32::MAX, 1e-38, 0.0, 1.0] {
            for pdf_sets in [[0.0, 1.0], [f32::MAX, 0.0], [f32::INFINITY, 1.0], [1e-38, 0.0]] {
                mixing.step_sets(&GuideRecord { scattered, pdf_bsdf: 0.0, pdf_sets, ..record }, 0.95, 0.0);
                assert!(mixing.theta.is_finite() && (LIMITS.0..=LIMITS.1).contains(&mixing.p_first(0.0)));
            }
        }
    }

    #[test]
    fn hc_p07_delta_lobes_draw_towards_the_bsdf_but_not_all_the_way() {
        let mut mixing = Mixing::default();
        let record = GuideRecord {
            p: Vec3::ZERO,
            d: Vec3::Z,
            radiance: 1.0,
            direct: 0.0,
            scattered: 1.0,
            pdf: 0.5,
            pdf_bsdf: 1.0,
            pdf_guide: 0.0,
            pdf_sets: [0.0; 2],
            kind: RecordKind::Delta,
            primary: false,
        };
        for _ in 0..10_000 {
            mixing.step(&record);
        }
        assert!(mixing.p_guide() < 0.1 && mixing.p_guide() >= LIMITS.0);
        for scattered in [f32::MAX, 1e-38, 0.0] {
            mixing.step(&GuideRecord { scattered, pdf_bsdf: 0.0, ..record });
            mixing.step(&GuideRecord { scattered, pdf_bsdf: 0.0, kind: RecordKind::Mixed, ..record });
            assert!(mixing.theta.is_finite() && (LIMITS.0..=MOST_LEARNT).contains(&mixing.p_guide()));
        }
    }
}
