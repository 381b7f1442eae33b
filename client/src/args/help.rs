//! What `--help` says below the options: formats, exit codes, examples.

/// Below the list of commands.
pub const SWARMCTL: &str = "\
Examples:
  swarmctl validate experiments/*.json
  swarmctl run experiment.json --generations 20
  swarmctl submit experiment.json --seed 7 --watch
  swarmctl explain 3
  swarmctl history 3 --output csv > history.csv
  swarmctl champion 3 > champion.json

The way to the coordinator, in this order: the options, their variables, and the
settings file, which is named by SWARM_CONFIG or else is
~/.config/swarmevo/config.json, and contains for example
  {\"coordinator\": \"https://fleet.example:7700\", \"tls-ca\": \"ca.pem\",
   \"token-file\": \"client.token\"}

Exit codes:
  0    done
  1    internal error
  2    bad input: arguments, settings, a token, a certificate, a genotype, an
       experiment file, a directory, a file to write
  3    no such experiment, or not in a state for this (no champion yet, ended)
  4    the coordinator cannot be reached
  5    the experiment failed (run, watch, wait, submit --watch)
  6    the experiment was cancelled (the same)
  7    the coordinator does not accept the token
  8    no TLS connection: there is no TLS, or the certificate is not trusted
  9    what answers is no coordinator, or one of another version
  10   the time of wait --timeout is over
  130  interrupted";

/// Of `run`.
pub const RUN: &str = "\
With --output json it prints a line per generation (numbered from 0), then one
with state, digest and champion.

Examples:
  swarmctl run experiment.json
  swarmctl run experiment.json --generations 20 --seed 7 --data-dir /tmp/try";

/// Of `submit`.
pub const SUBMIT: &str = "\
Examples:
  swarmctl submit experiment.json --watch
  swarmctl submit experiment.json --priority 200 --output json | jq .id";

/// Of `watch`.
pub const WATCH: &str = "\
With --output json it prints a line per generation (numbered from 0), then one
with state, digest and champion.

Example:
  swarmctl watch 3 --output json | jq .best";

/// Of `champion`.
pub const CHAMPION: &str = "\
Examples:
  swarmctl champion 3 > champion.json
  swarmctl champion 3 | jq .network";

/// Of `bench`.
pub const BENCH: &str = "\
Examples:
  swarmctl bench
  swarmctl bench configs/borderline_snes.json --cores 1 --output json";

/// Of `simulate`.
pub const SIMULATE: &str = "\
Examples:
  swarmctl simulate experiment.json --experiment 3 --trials 100
  swarmctl simulate experiment.json --genotype champion.json --trace trace.csv";

/// Of `evaluate`.
pub const EVALUATE: &str = "\
Paths name places of the experiment file, as its error messages do; values are
JSON, or text. docs/evaluation.md explains files, measures and statistics.

Examples:
  swarmctl evaluate 3 --robots 5,10,20,30,50 --to leader/scalability
  swarmctl evaluate 3 --perturb leader_failure:time_to_failure=50 --to leader/fault
  swarmctl evaluate 3 --inhibit msg,receiving_direction,state --to leader/stimuli
  swarmctl evaluate 5 --steps 2000 --to light/path \\
      --set world.objects.light_red.controller=light_rnd_pos_controller
  swarmctl evaluate --genotype champion.json --config experiment.json --local --to out";

/// Of `plot`.
pub const PLOT: &str = "\
Examples:
  swarmctl plot 3 4 --to fitness.svg
  swarmctl plot ga.csv snes.csv --to fitness.png
  swarmctl plot --steps results/borderline --metric accuracy --to accuracy.svg";

/// Of `completions`.
pub const COMPLETIONS: &str = "\
Examples:
  source <(swarmctl completions bash)             # in ~/.bashrc
  swarmctl completions zsh > ~/.zfunc/_swarmctl   # a directory in $fpath
  swarmctl completions fish > ~/.config/fish/completions/swarmctl.fish";

/// Of `history`.
pub const HISTORY: &str = "\
Tables and CSV have one row per generation; best, mean, min and standard
deviation are over the individuals' mean fitness. CSV and JSON have every digit.

Examples:
  swarmctl history 3 | tail -1
  swarmctl history 3 --output csv > history.csv
  swarmctl history 3 --output json | jq '.[].best'";

/// Of `wait`.
pub const WAIT: &str = "\
Exit codes:
  0   it ended as wanted
  5   it failed, and --for is completed
  6   it was cancelled, and --for is completed
  10  it has not ended within --timeout

Examples:
  swarmctl wait 3 && swarmctl champion 3 > champion.json
  swarmctl wait 3 --for ended --timeout 2h";

/// Of `logs`.
pub const LOGS: &str = "\
A log of all experiments is printed in the order of time. With --output json
each event is an object on a line of its own, with kind generation, state or
notice.

Examples:
  swarmctl logs 3 --follow
  swarmctl logs --follow
  swarmctl logs 3 --from 120 --output json | jq 'select(.kind == \"notice\")'";
