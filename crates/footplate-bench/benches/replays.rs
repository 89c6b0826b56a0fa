//! `cargo bench -p footplate-bench --bench replays`: recorded sensor logs through the full estimator.

fn main() {
    footplate_bench::contest::run(footplate_bench::replays::operations());
}
