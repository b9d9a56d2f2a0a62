//! Checks of the equations that need the inside of a step.

mod energy;
mod isolation;
