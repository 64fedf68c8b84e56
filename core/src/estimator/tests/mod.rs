//! Tests of the filter's parts against independent arithmetic, and of the whole on made-up flights.

mod attack;
mod contrary;
mod covariance;
mod faults;
mod flight;
mod outage;
mod rows;
mod start;
mod tilt;
mod window;
