"""An evaluator for ShinkaEvolve, whose programs are controllers: scripts with ``control(robot)``.

``LocalJobConfig(eval_program_path="python/examples/judge_for_shinka.py", extra_cmd_args={"task":
"configs/tasks/aggregation.json"})`` runs it as a process for each program. A model reads the error of a bad script.
"""

import argparse
from pathlib import Path

from shinka.core.wrap_eval import save_json_results

import swarmevo

parser = argparse.ArgumentParser()
for name in ("program_path", "results_dir", "task"):
    parser.add_argument(f"--{name}", required=True)
args = parser.parse_args()
task = swarmevo.Experiment.from_file(args.task)
[verdict] = swarmevo.judge([Path(args.program_path).read_text()], task, trials=10)
good = verdict.error is None
metrics = {"combined_score": verdict.fitness, "public": verdict.measures} if good else {"combined_score": 0.0}
save_json_results(args.results_dir, metrics, good, verdict.error)
