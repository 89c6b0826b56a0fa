//! `cargo bench -p footplate-bench --bench profiles [-- PART-OF-A-GROUP]`: motion profiles beside public crates.

fn main() {
    footplate_bench::contest::run(footplate_bench::profiles::operations());
}
