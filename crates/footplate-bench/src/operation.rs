//! One thing that can be timed.

use core::hint::black_box;

/// How many inputs an operation goes through before it begins again: too many for a branch predictor to learn,
/// few enough for the second level of cache.
pub const INPUTS: usize = 8192;

/// An operation with its input, made ready beforehand.
pub struct Operation {
    /// What is done. Operations of one group do the same, by different means.
    pub group: &'static str,
    /// By what means.
    pub means: &'static str,
    body: Box<dyn FnMut(usize) -> f64>,
}

impl Operation {
    /// `once` does the operation on one of the inputs and gives a number that depends on all of its result.
    pub fn new<Input: 'static>(
        group: &'static str,
        means: &'static str,
        inputs: Vec<Input>,
        mut once: impl FnMut(&Input) -> f64 + 'static,
    ) -> Self {
        let body = move |mut count: usize| {
            let mut sum = 0.0;
            while count > 0 {
                let turn = inputs.get(..count).unwrap_or(&inputs);
                for input in turn {
                    sum += once(input);
                }
                count -= turn.len();
            }
            sum
        };
        Self::with_body(group, means, body)
    }

    /// `body` does the operation so many times and gives a number that depends on all of their results.
    pub fn with_body(
        group: &'static str,
        means: &'static str,
        body: impl FnMut(usize) -> f64 + 'static,
    ) -> Self {
        Self { group, means, body: Box::new(body) }
    }

    /// Does it so many times, with the inputs in turn; the sum is there to be used, so that nothing is left out.
    pub fn run(&mut self, count: usize) -> f64 {
        black_box((self.body)(black_box(count)))
    }

    /// Its name in full.
    pub fn name(&self) -> String {
        format!("{}/{}", self.group, self.means)
    }
}
