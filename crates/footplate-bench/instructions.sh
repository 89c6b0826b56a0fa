#!/usr/bin/env bash
# Prints how many instructions each operation takes: what two runs of different length differ by, counted by
# valgrind's callgrind. Unlike times, these do not depend on what else the machine does.
#
#   crates/footplate-bench/instructions.sh [PART-OF-A-NAME]
#
# RUSTFLAGS chooses the processor, as everywhere; valgrind knows no AVX-512.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

readonly SHORT=20000
readonly LONG=60000
readonly PART="${1:-}"
readonly TARGET="${CARGO_TARGET_DIR:-$PWD/target}"

if ! command -v valgrind >/dev/null; then
  echo "instructions.sh: needs valgrind (on Debian: apt-get install valgrind)" >&2
  exit 1
fi

# The profile of the benchmarks, so that what is counted is what is timed.
cargo build --quiet --profile bench -p footplate-bench --bin once
readonly ONCE="$TARGET/release/once"

# Instructions of the whole program while it does the operation $1 so many times ($2).
counted() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null "$ONCE" "$1" "$2" 2>&1 |
    sed -n 's/.*Collected : \([0-9]*\)$/\1/p'
}

"$ONCE" | while IFS= read -r name; do
  [[ $name == *"$PART"* ]] || continue
  short=$(counted "$name" "$SHORT")
  long=$(counted "$name" "$LONG")
  awk -v name="$name" -v short="$short" -v long="$long" -v more=$((LONG - SHORT)) \
    'BEGIN { printf "%-60s %8.1f\n", name, (long - short) / more }'
done
