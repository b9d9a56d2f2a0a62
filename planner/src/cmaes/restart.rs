//! Restarts: where a search has converged without reaching its target, another one
//! begins with more candidates, which sees more of a rugged landscape.
//!
//! IPOP after A. Auger and N. Hansen, "A Restart CMA Evolution Strategy With Increasing
//! Population Size" (CEC 2005); BIPOP after N. Hansen, "Benchmarking a BI-Population
//! CMA-ES on the BBOB-2009 Function Testbed".

use super::{Best, CmaError, CmaEs, CmaOptions, StopReason};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

/// How the next search differs from the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RestartRule {
    /// The population doubles every time.
    Ipop,
    /// Searches with doubled populations take turns with small ones of random size and
    /// spread; whichever has used fewer evaluations goes next.
    Bipop,
}

/// A sequence of searches, asked and told as one.
#[derive(Debug, Clone)]
pub struct Restarted {
    first: CmaOptions,
    rule: RestartRule,
    evaluations_max: usize,
    search: CmaEs,
    rng: ChaCha12Rng,
    /// Searches begun.
    runs: u64,
    /// Population of the latest large search.
    large: usize,
    /// Whether the current search is one of the small ones.
    is_small: bool,
    evaluations: usize,
    /// Evaluations of large and of small searches.
    spent: [usize; 2],
    best: Option<Best>,
    ended: Option<StopReason>,
}

impl Restarted {
    /// The first search, as [`CmaEs::new`], and what follows it until `evaluations_max`.
    ///
    /// # Errors
    /// As [`CmaEs::new`].
    pub fn new(
        first: CmaOptions,
        rule: RestartRule,
        evaluations_max: usize,
    ) -> Result<Self, CmaError> {
        Ok(Self {
            search: CmaEs::new(first.clone())?,
            rng: ChaCha12Rng::seed_from_u64(first.seed ^ 0xb190_9000),
            large: first.population,
            first,
            rule,
            evaluations_max,
            runs: 1,
            is_small: false,
            evaluations: 0,
            spent: [0; 2],
            best: None,
            ended: None,
        })
    }

    /// As [`CmaEs::ask`].
    ///
    /// # Errors
    /// As [`CmaEs::ask`].
    pub fn ask(
        &mut self,
        feasible: &mut dyn FnMut(&[f64]) -> bool,
    ) -> Result<Vec<Vec<f64>>, CmaError> {
        self.search.ask(feasible)
    }

    /// As [`CmaEs::tell`]; begins the next search if this one has ended.
    ///
    /// # Errors
    /// As [`CmaEs::tell`].
    pub fn tell(&mut self, fitness: &[f64]) -> Result<(), CmaError> {
        self.search.tell(fitness)?;
        self.evaluations += fitness.len();
        self.spent[usize::from(self.is_small)] += fitness.len();
        if let Some(best) = self.search.best()
            && self.best.as_ref().is_none_or(|b| best.fitness < b.fitness)
        {
            self.best = Some(best.clone());
        }
        match self.search.stop() {
            Some(StopReason::FitnessTarget) => self.ended = Some(StopReason::FitnessTarget),
            _ if self.evaluations >= self.evaluations_max => {
                self.ended = Some(StopReason::Generations);
            }
            Some(_) => self.restart()?,
            None => {}
        }
        Ok(())
    }

    /// Why everything should end, if it should.
    #[must_use]
    pub fn stop(&self) -> Option<StopReason> {
        self.ended
    }

    /// Best candidate of all searches.
    #[must_use]
    pub fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    /// Candidates valued so far.
    #[must_use]
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Searches begun.
    #[must_use]
    pub fn runs(&self) -> u64 {
        self.runs
    }

    fn restart(&mut self) -> Result<(), CmaError> {
        self.is_small = self.rule == RestartRule::Bipop && self.spent[1] < self.spent[0];
        let mut options = self.first.clone();
        options.seed = self.first.seed.wrapping_add(self.runs << 40);
        if self.is_small {
            let ratio = 0.5 * self.large as f64 / self.first.population as f64;
            let [size, spread]: [f64; 2] = [self.rng.random(), self.rng.random()];
            let population = self.first.population as f64 * ratio.powf(size * size);
            options.population = (population as usize).max(self.first.population);
            let narrower = 10f64.powf(-2.0 * spread);
            options.std_dev.iter_mut().for_each(|s| *s *= narrower);
        } else {
            self.large *= 2;
            options.population = self.large;
        }
        self.search = CmaEs::new(options)?;
        self.runs += 1;
        Ok(())
    }
}
