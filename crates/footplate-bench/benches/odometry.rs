//! `cargo bench -p footplate-bench --bench odometry`: a period of on-board odometry, and its fusion beside public
//! crates.

fn main() {
    footplate_bench::contest::run(footplate_bench::odometry::operations());
}
