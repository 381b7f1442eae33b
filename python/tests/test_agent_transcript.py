"""An agent's way from an idea to a verified bundle: the transcript in docs/agents.md.

``UPDATE_DOCS=1 pytest python/tests/test_agent_transcript.py`` writes the page.
"""

import base64
import json
import os
import re

import pytest
from agents import drive, put_on_path
from conftest import PROJECT

from swarmevo.agents import server

PAGE = PROJECT / "docs/agents.md"
BEGIN, END = "<!-- generated: transcript -->\n", "<!-- end: transcript -->"
ANSWER_MAX = 600
SCRIPT = '''"""Robots gather at the darker of two areas."""

def darker(world):
    return min(world.areas, key=lambda area: area.colour)

def sense(robot):
    """Whether the robot is on an area, and whether that is the darker one."""
    for area in robot.world.areas:
        if robot.distance(area) <= area.range:
            return [1, 1 if area.id == darker(robot.world).id else -1]
    return [0, 0]

def gathered(world):
    place = darker(world)
    return len([robot for robot in world.robots if robot.distance(place) <= place.range]) / len(world.robots)

def fitness(world):
    return gathered(world) if world.step >= 2 * world.steps / 3 else None

def measures(world):
    return {"gathered": gathred(world)}
'''
RIGHT = SCRIPT.replace("colour", "color").replace("gathred", "gathered")


async def from_idea_to_bundle(call):
    """What an agent calls, and what it looks at in the answers."""
    await call.facts("examples")
    read = await call.facts("examples", name="division_of_labour")
    assert "black" in read["division_of_labour.json"] and "white" in read["division_of_labour.json"]
    assert "color" in (await call.facts("docs", section="tasks#what-a-script-sees"))["text"]
    wrong = await call.facts("draft", name="dark", task="division_of_labour", script=SCRIPT)
    messages = " ".join(it["message"] for it in wrong["problems"])
    assert len(wrong["problems"]) == 2 and "colour" in messages and "gathred" in messages
    right = await call.facts("draft", name="dark", task="division_of_labour", script=RIGHT)
    assert right["ok"] and right["genotype_len"] == 6
    ran = await call.facts("run", file="dark.json", generations=8, seconds=120)
    assert ran["state"] == "completed" and ran["champion"]["judged"]["mean"] > 0.7
    await call.facts("history", experiment="1", rows=4)
    champion = await call.facts("individual", address="1")
    assert champion["judged"]["ci95"][0] > 0.7
    tested = await call.facts("evaluate", address="1", trials=40, robots=[5, 20])
    assert [it["name"] for it in tested["conditions"]] == ["nominal", "robots=5", "robots=20"]
    await call.facts("picture", address="1")
    image = call.made[-1][2].content[0]
    assert base64.b64decode(image.data).startswith(b"\x89PNG")
    await call.facts("export", experiment="1", file="dark.zip")
    proven = await call.facts("verify", file="dark.zip", generations=2)
    assert {it["claim"] for it in proven["proven"]} >= {"experiment", "chain", "history", "champion", "simulation"}
    return call.made


def test_an_agent_comes_from_an_idea_to_a_verified_bundle(tmp_path, monkeypatch, programs):
    put_on_path(monkeypatch, programs)
    made = drive(server(tmp_path), from_idea_to_bundle)
    before, _, rest = PAGE.read_text().partition(BEGIN)
    kept, _, after = rest.partition(END)
    text = "".join(shown(*it) for it in made)
    if os.environ.get("UPDATE_DOCS"):
        PAGE.write_text(before + BEGIN + text + END + after)
    elif kept != text:
        pytest.fail("docs/agents.md has another transcript; UPDATE_DOCS=1 writes this one:\n" + text)


def test_the_example_of_the_page_runs(monkeypatch):
    monkeypatch.chdir(PROJECT)
    [block] = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    names = {}
    exec(compile(block, str(PAGE), "exec"), names)
    good, bad = names["verdicts"]
    assert good.error is None and good.measures and "candidate.star:2" in bad.error


def shown(tool, arguments, answer):
    """A call as the page shows it, without what differs from run to run."""
    given = ", ".join(f"{name}={value(it)}" for name, it in arguments.items())
    lines = [f"{tool}({given})"]
    for it in answer.content:
        lines.append(brief(it.text) if it.type == "text" else f"[a picture, {it.mime_type}]")
    return "\n```text\n> " + "\n".join(lines) + "\n```\n"


def value(it):
    if isinstance(it, str) and "\n" in it:
        return "(the script above, mended)" if it == RIGHT else f'"""\n{it}"""'
    return json.dumps(it)


def brief(text):
    """The beginning of an answer, with its next step; long answers are abbreviated on the page only."""
    text = re.sub(r'("(?:sha256|swarmctl|simulation)": )("[^"]*"|\d+)', r'\1"..."', text)
    text = re.sub(r'("bytes": )\d+', r"\g<1>...", text)
    body, _, steps = text.partition("\nnext: ")
    body = body if len(body) <= ANSWER_MAX else body[:ANSWER_MAX].rstrip() + " ..."
    return f"{body}\nnext: {steps}"
