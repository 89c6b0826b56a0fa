//! `cargo bench -p footplate-bench --bench replay`: what an event of a sensor log costs the full estimator.

fn main() {
    footplate_bench::contest::run(footplate_bench::replay::operations());
}
