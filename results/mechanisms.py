#!/usr/bin/env python3
"""Prints tables of the messages of champions, and of their reactions to frames and light.

    results/mechanisms.py [DIRECTORY] [--trials N]    champions in it; results/ by default

Simulates every champion in N trials, 20 by default, that had no part in its evolution. Steps 0 to 9,
in which robots must send, count for negotiations only. A robot acts on the stimuli of the
same row of the trace.
Needs swarmctl in the PATH, Python 3.9 and nothing else.
"""

import argparse
import json
import math
import statistics
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

from report import RESULTS, read_csv, swarmctl, table

WINDOW = 10  # number of steps over which heard sectors are counted


def percent(values):
    """Share of true values with its standard error over trials, because rows of a trial depend on each other."""
    shares = [100 * statistics.fmean(of) for of in by_trial(values).values()]
    error = statistics.stdev(shares) / math.sqrt(len(shares)) if len(shares) > 1 else math.nan
    return f"{100 * statistics.fmean(value for _, value in values):.1f} ± {error:.1f} %"


def by_trial(values):
    of = defaultdict(list)
    for trial, value in values:
        of[trial].append(value)
    return of


def quartiles(values):
    if len(values) < 20:
        return "–"
    first, median, third = statistics.quantiles(values, n=4)
    return f"{median:+.2f} ({first:+.2f} to {third:+.2f})"


def is_lit(row):
    return row["led"] not in ("", "0")


def message(row):
    return tuple(value for key, value in row.items() if key.startswith("message_"))


def conditional(title, condition, event, rows):
    """The share of rows where `event` is true, for each `condition`; rows with the condition None do not count."""
    groups = defaultdict(list)
    for row in rows:
        groups[condition(row)].append((row["trial"], event(row)))
    groups.pop(None, None)
    total = sum(map(len, groups.values()))
    table([title, "share of rows", "share with the LED on"],
          [[key, f"{100 * len(values) / total:.1f} %", percent(values)] for key, values in sorted(groups.items())])


def senders(rows):
    modes = Counter(row["mode"] for row in rows)
    print(", ".join(f"{100 * n / len(rows):.2f} % {mode}" for mode, n in modes.most_common()) + "\n")
    sent = [row for row in rows if row["mode"] == "send"]
    symbols = Counter(map(message, sent))
    frequent = [symbol for symbol, _ in symbols.most_common(4)]
    table(["symbol sent", "share"], [[f"({', '.join(symbol)})", f"{100 * symbols[symbol] / len(sent):.2f} %"] for symbol in frequent])
    return frequent


def leds(rows, frequent):
    conditional("mode", lambda row: row["mode"], is_lit, rows)
    name = lambda row: f"({', '.join(message(row))})" if message(row) in frequent else "others"
    conditional("symbol sent", lambda row: name(row) if row["mode"] == "send" else None, is_lit, rows)


def negotiations(rows):
    """For each trial: the time until one robot is the only leader for ten steps, and whether all LEDs went
    off again before."""
    lit = defaultdict(lambda: defaultdict(list))
    for row in rows:
        lit[row["trial"]][int(row["step"])].extend([row["robot"]] if is_lit(row) else [])
    settled, silent = [], 0
    for of in lit.values():
        term = lambda step: len(of[step]) == 1 and all(of.get(step + i) == of[step] for i in range(10))
        first = next((step for step in sorted(of) if term(step)), None)
        if first is not None:
            settled.append(first)
            claimed = next(step for step in sorted(of) if of[step])
            silent += any(not of[step] for step in range(claimed, first))
    when = f", from step {statistics.median(settled):.0f} on (median), {max(settled)} at the latest" if settled else ""
    print(f"one leader for ten steps in {len(settled)} of {len(lit)} trials{when}; in {silent} of them all LEDs had gone off before\n")


def neighbours(rows):
    """Fig. 6.19: the LED by the number of sectors from which frames came within the window."""
    heard = defaultdict(list)
    sectors = {}
    for row in rows:
        of = heard[row["trial"], row["robot"]]
        of.append(row["frame_sector"])
        sectors[id(row)] = len({sector for sector in of[-WINDOW:] if sector}) if len(of) >= WINDOW else None
    conditional(f"sectors heard within {WINDOW} steps", lambda row: sectors[id(row)], is_lit, rows)
    wrong = [(row["trial"], is_lit(row) != (row["led_target"] == "1")) for row in rows if row["led_target"]]
    print(f"wrong LEDs: {percent(wrong)}\n")
    near = defaultdict(list)
    steps = defaultdict(list)
    for row in rows:
        steps[row["trial"], row["step"]].append(row)
    for swarm in steps.values():
        for row in swarm:
            x, y = float(row["x_cm"]), float(row["y_cm"])
            within = sum(math.hypot(float(other["x_cm"]) - x, float(other["y_cm"]) - y) < 100 for other in swarm) - 1
            near[min(within, 8)].append((row["trial"], is_lit(row) != (row["led_target"] == "1")))
    table(["robots within 100 cm", "share of rows", "wrong"],
          [[f"{n}{' or more' if n == 8 else ''}", f"{100 * len(of) / len(rows):.1f} %", percent(of)] for n, of in sorted(near.items())])


def angle(row, stimulus):
    """The direction in degrees of a sector, which is given as (x, y) in [0, 1]; None without a frame."""
    if row["frame_sector"] == "":
        return None
    x, y = (float(row[f"stimulus_{stimulus}_{i}"]) for i in (0, 1))
    return round(math.degrees(math.atan2(y, x))) % 360


def alignment(rows, stimuli):
    """Fig. 6.27 and 6.28: wheels and symbols by the directions of receiving and sending."""
    receiving, sending = stimuli["receiving_direction"], stimuli["sending_direction"]
    turns, symbols = defaultdict(list), defaultdict(Counter)
    for row in rows:
        rx, tx = angle(row, receiving), angle(row, sending)
        if rx is None:
            continue
        turns[rx, tx].append(float(row["wheel_right"]))
        symbols["aligned" if abs(rx - tx) == 180 else "not aligned"][message(row)] += 1
    sectors = sorted({rx for rx, _ in turns} | {tx for _, tx in turns})
    print("wheel, median (quartiles); rows: direction of receiving, columns: of sending, degrees\n")
    table(["", *sectors], [[rx, *(quartiles(turns[rx, tx]) for tx in sectors)] for rx in sectors])
    frequent = [symbol for symbol, _ in sum(symbols.values(), Counter()).most_common(4)]
    table(["sender and receiver", *(f"({', '.join(s)})" for s in frequent)],
          [[name, *(f"{100 * of[s] / sum(of.values()):.1f} %" for s in frequent)] for name, of in sorted(symbols.items())])


def signals(rows, config):
    """Compares the strength of frames with the value that section 3.3.2 uses instead: the reading of the
    distance sensor in that sector, which is the largest over all robots within 60 cm, here with the decay of
    the receiver."""
    robot = config["world"]["objects"][config["algorithm"]["evolvable_object"]]
    receiver, sides = robot["sensors"]["wireless_receiver"], (config["world"]["width"], config["world"]["height"])
    if "decay_rho" not in receiver:
        return  # this file leaves the signal to its key `semantics`
    swarms = defaultdict(dict)
    for row in rows:
        heading = float(row["heading_rad"])
        swarms[row["trial"], int(row["step"])][row["robot"]] = (float(row["x_cm"]), float(row["y_cm"]), heading)
    differences = []
    for row in rows:
        # Rows have the positions after a step, but robots hear at the positions before it.
        swarm = swarms.get((row["trial"], int(row["step"]) - 1))
        if swarm is None or row["frame_sector"] == "":
            continue
        x, y, heading = swarm[row["robot"]]
        sector = heading + 2 * math.pi * int(row["frame_sector"]) / receiver["n_sectors"]
        reading = 0.0
        for other, (other_x, other_y, _) in swarm.items():
            away = [math.remainder(way, side) for way, side in zip((other_x - x, other_y - y), sides)]
            if other != row["robot"] and math.hypot(*away) <= 60:
                off = abs(math.remainder(math.atan2(away[1], away[0]) - sector, 2 * math.pi))
                strength = math.exp(-receiver["decay_rho"] * math.hypot(*away) - receiver["decay_phi"] * off)
                reading = max(reading, strength)
        differences.append(reading - float(row["frame_signal"]))
    share = lambda of: f"{100 * sum(map(of, differences)) / len(differences):.1f} %"
    print(f"distance sensor instead of the frame's strength: higher in {share(lambda it: it > 1e-6)} of frames, "
          f"lower in {share(lambda it: it < -1e-6)}, different by {statistics.fmean(map(abs, differences)):.4f} on average\n")


def following(rows, stimuli):
    """Fig. 6.37: the difference of the wheels, left minus right, by where light and frames are."""
    light = sorted(key for key in rows[0] if key.startswith(f"stimulus_{stimuli['light_sensor']}_"))
    sees = lambda row: "sees the light" if any(float(row[key]) > 0 for key in light) else "does not"
    modes = Counter((sees(row), row["mode"]) for row in rows)
    table(["robot", "sends", "relays"],
          [[who, *(f"{100 * modes[who, mode] / sum(modes[who, it] for it in ('send', 'relay')):.1f} %" for mode in ("send", "relay"))]
           for who in ("sees the light", "does not")])
    by_light, by_frame, blind, speed = defaultdict(list), defaultdict(list), [], []
    for row in rows:
        turn = float(row["wheel_left"]) - float(row["wheel_right"])
        seen = [float(row[key]) for key in light]
        if max(seen) > 0:
            by_light[seen.index(max(seen))].append(turn)
        elif (direction := angle(row, stimuli["receiving_direction"])) is not None:
            by_frame[direction].append(turn)
        else:
            blind.append(turn)
            speed.append((float(row["wheel_left"]) + float(row["wheel_right"])) / 2)
    print("left wheel minus right wheel, median (quartiles); positive turns right\n")
    table(["strongest light in sector of", "rows", "difference"],
          [[f"{360 * sector // len(light)}°", len(of), quartiles(of)] for sector, of in sorted(by_light.items())])
    table(["no light; frame from", "rows", "difference"], [[f"{at}°", len(of), quartiles(of)] for at, of in sorted(by_frame.items())])
    print(f"neither: {len(blind)} rows, difference {quartiles(blind)}, mean of both wheels {quartiles(speed)}\n")


def simulated(path, config, n_trials):
    with tempfile.TemporaryDirectory() as scratch:
        trace = Path(scratch) / "trace.csv"
        swarmctl("simulate", config, "--genotype", path, "--trace", trace, "--trace-columns", "targets",
                 "--generation", 1000000, "--trials", n_trials)
        return read_csv(trace)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=Path, nargs="?", default=RESULTS)
    parser.add_argument("--trials", type=int, default=20)
    args = parser.parse_args()
    for path in sorted((args.directory / "champions").glob("*.json")):
        name = json.loads(path.read_text())["name"]
        places = [RESULTS.parent / "configs" / folder / f"{name}.json" for folder in ("", "original")]
        config = next((place for place in places if place.exists()), None)
        if config is None:
            continue  # a task of another folder
        stimuli = {of["sensor"].rpartition(":")[2]: key for key, of in json.loads(config.read_text())["topology"]["stimuli"].items()}
        all_rows = simulated(path, config, args.trials)
        rows = [row for row in all_rows if int(row["step"]) >= 10]
        print(f"## {path.stem}\n")
        frequent = senders(rows)
        if name.startswith("leader_selection"):
            leds(rows, frequent)
            negotiations(all_rows)
        elif name.startswith("borderline"):
            neighbours(rows)
        elif name.startswith("orientation_consensus"):
            alignment(rows, stimuli)
        elif name.startswith("light_follower"):
            following(rows, stimuli)
            signals(rows, json.loads(config.read_text()))


if __name__ == "__main__":
    main()
