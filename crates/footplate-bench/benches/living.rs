//! `cargo bench -p footplate-bench --bench living`: a second of two trains on Track A behind the bytes of a 6051.

fn main() {
    footplate_bench::contest::run(footplate_bench::living::operations());
}
