"""The server for agents: what its tools answer, what they refuse, and what they cost at most."""

import base64
import json
import subprocess
import sys
import time

import anyio
import pytest
from agents import Calls, drive, put_on_path
from mcp import Client, StdioServerParameters, stdio_client
from processes import fleet

from swarmevo.agents import server
from swarmevo.agents.answers import CHARACTERS_MAX
from swarmevo.agents.failures import STEPS, of_program
from swarmevo.agents.parameters import Budgets
from swarmevo.agents.program import swarmctl
from swarmevo.agents.serving import server as served

DEFAULT = {"docs", "examples", "schema", "validate", "experiments", "explain", "follow", "history", "individual", "compare",
           "draft", "run", "resume", "fork", "evaluate", "picture", "export", "verify"}
WRONG = "def fitness(world):\n    return brightness(world)\n\ndef measures(world):\n    return {'x': wrld.step}\n"


@pytest.fixture(autouse=True)
def path(monkeypatch, programs):
    put_on_path(monkeypatch, programs)


@pytest.fixture(scope="module")
def ran(tmp_path_factory, programs):
    """A directory in which a short run has completed."""
    directory = tmp_path_factory.mktemp("ran")
    with pytest.MonkeyPatch.context() as patch:
        put_on_path(patch, programs)

        async def script(call):
            small = {"algorithm.judgement_trials": 10, "algorithm.champion_trials": 4, "algorithm.evaluation_steps": 60}
            await call.facts("draft", name="small", task="division_of_labour", changes=small)
            return await call.facts("run", file="small.json", generations=3)

        ended = drive(server(directory), script)
    assert ended["state"] == "completed" and ended["champion"]["judged"]["trials"] == 10
    return directory


def test_a_server_looks_and_computes_here_unless_more_is_allowed(tmp_path):
    async def names(call):
        return {it.name: it for it in (await call.client.list_tools()).tools}

    tools = drive(server(tmp_path), names)
    assert set(tools) == DEFAULT
    assert all(it.description and len(it.description) < 400 for it in tools.values())
    assert tools["history"].annotations.read_only_hint and not tools["run"].annotations.read_only_hint
    assert set(drive(server(tmp_path, allow_submit=True), names)) == DEFAULT | {"submit", "fork_on_fleet"}
    everything = drive(server(tmp_path, allow_submit=True, allow_control=True), names)
    assert set(everything) == DEFAULT | {"submit", "fork_on_fleet", "control"} and everything["control"].annotations.destructive_hint


def test_calls_that_it_does_not_understand_are_explained(tmp_path):
    async def script(call):
        error = await call.error("submit", file="a.json")
        assert error["code"] == "not_allowed" and "--allow-submit" in error["next"]
        error = await call.error("runn", file="a.json")
        assert error["code"] == "bad_argument" and "validate" in error["message"]
        error = await call.error("run", file="a.json", second=3)
        assert error["where"] == "second" and "did you mean `seconds`" in error["message"]
        error = await call.error("history", rows="many")
        assert error["where"] == "experiment, rows" and "field required" in error["message"] and "many" in error["message"]

    drive(server(tmp_path), script)


def test_the_steps_are_for_codes_of_the_program():
    schema = json.loads(subprocess.run([swarmctl(), "schema", "--of", "error"], capture_output=True, check=True).stdout)
    assert set(STEPS) <= {it["const"] for it in schema["$defs"]["Code"]["oneOf"]}


def test_a_program_that_ends_without_an_error_is_a_bug():
    for stderr in ("", "killed\n", '{"error": 3}\n', "[1]\n"):
        failure = of_program(-9, stderr, "a.json")
        assert failure.code == "internal" and failure.where == "a.json" and "-9" in failure.message


def test_examples_schema_and_manual_answer_questions(tmp_path):
    async def script(call):
        listed = await call.facts("examples")
        assert ["aggregation", "Robots gather; they sense where others are"] in listed["examples"]
        for name, _ in listed["examples"]:
            read = await call.facts("examples", name=name)
            assert f"{name}.json" in read and not any("cut here" in it for it in read.values())
        read = await call.facts("examples", name="aggregation")
        assert set(read) == {"aggregation.json", "aggregation.star"} and "def fitness(world)" in read["aggregation.star"]
        assert "did you mean 'aggregation'" in (await call.error("examples", name="agregation"))["message"]
        top = await call.facts("schema")
        assert {"world", "topology", "algorithm"} <= set(top["below"])
        size = await call.facts("schema", key="algorithm.population_size")
        assert size["types"] == ["integer"] and size["minimum"] >= 1 and "individuals" in size["description"].lower()
        assert (await call.facts("schema", key="world.objects.my_robots.num_instances"))["description"]
        error = await call.error("schema", key="algorithm.population_sise")
        assert error["code"] == "unknown_key" and "did you mean `population_size`" in error["message"]
        pages = (await call.facts("docs"))["pages"]
        assert "the-language" in pages["tasks"] and "agents" in pages
        for page, sections in pages.items():
            assert (await call.facts("docs", section=page))["text"].startswith("# ")
            assert sections and (await call.facts("docs", section=f"{page}#{sections[-1]}"))["text"].startswith("#")
        assert (await call.error("docs", section="taks"))["code"] == "not_found"

    drive(server(tmp_path), script)


def test_pages_are_resources(tmp_path):
    async def script(call):
        listed = {str(it.uri) for it in (await call.client.list_resources()).resources}
        assert "swarmevo://docs/tasks" in listed
        read = await call.client.read_resource("swarmevo://docs/tasks")
        return read.contents[0].text

    assert "def fitness(world)" in drive(server(tmp_path), script)


def test_a_draft_is_validated_mended_and_never_replaces_a_file_of_a_person(tmp_path):
    async def script(call):
        wrong = await call.facts("draft", name="mine", task="aggregation", script=WRONG)
        problems = [it["message"] for it in wrong["problems"]]
        assert not wrong["ok"] and len(problems) >= 2 and any("wrld" in it for it in problems)
        error = await call.error("run", file="mine.json")
        assert error["code"] == "invalid_experiment" and "brightness" in error["message"] and "validate" in error["next"]
        right = await call.facts("draft", name="mine", task="aggregation", script=WRONG.replace("brightness(world)", "1").replace("wrld", "world"))
        assert not right["ok"], "the example's sensor needs `sense`"
        right = await call.facts("draft", name="mine", task="aggregation", changes={"world.objects.robot.num_instances": 7})
        assert right["ok"] and right["robots"] == 7
        several = await call.facts("draft", name="odd", changes={"algorithm.population_size": -1, "world.width": "wide"})
        assert len(several["problems"]) == 2
        assert (await call.error("draft", name="odd", changes={"../x": 1}))["where"] == "changes"
        assert (await call.error("draft", name="odd", changes={"seed.x": 1}))["where"] == "changes"
        (tmp_path / "mine.star").write_text("# edited by a person\n")
        assert (await call.error("draft", name="mine"))["code"] == "exists"
        assert (tmp_path / "mine.star").read_text() == "# edited by a person\n"

    drive(server(tmp_path), script)


def test_no_path_leads_out_of_the_directory(tmp_path):
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (outside / "secret.star").write_text("secret of the machine")
    (outside / "secret.json").write_text('{"secret": 1}')
    (inside / "link.json").symlink_to(outside / "secret.json")
    (inside / "folder").symlink_to(outside)
    (inside / "dangling.zip").symlink_to(outside / "new.zip")
    (inside / "steals.json").write_text('{"task": {"script": "../outside/secret.star"}}')
    (inside / "follows.json").write_text('{"task": {"script": "folder/secret.star"}}')

    async def script(call):
        for name in ("../outside/secret.json", str(outside / "secret.json"), "link.json", "folder/secret.json"):
            assert (await call.error("validate", file=name))["code"] == "outside_directory"
        for name in ("steals.json", "follows.json"):
            error = await call.error("validate", file=name)
            assert error["code"] == "outside_directory" and "secret of" not in error["message"]
            assert (await call.error("run", file=name))["code"] == "outside_directory"
        for name in ("", ".", "a\0b", "x" * 300):
            assert (await call.error("validate", file=name))["code"] in ("bad_argument", "outside_directory")
        for name in ("--help", "-", "--data-dir=/"):
            assert (await call.error("validate", file=name))["code"] == "not_found"
            assert (await call.error("explain", experiment=name))["code"] == "bad_argument"
            assert (await call.error("picture", address=name))["code"] == "bad_argument"
        assert (await call.error("verify", file="../outside/a.zip"))["code"] == "outside_directory"
        (inside / "swarm-data").mkdir()
        assert (await call.error("export", experiment="1", file="dangling.zip"))["code"] == "outside_directory"
        assert (await call.error("export", experiment="1", file="a.txt"))["code"] == "bad_argument"
        assert (await call.error("draft", name="../outside/x"))["code"] == "bad_argument"
        assert (await call.error("compare", of=["steals.json", "link.json"]))["code"] == "bad_argument"
        assert not (outside / "new.zip").exists()

    drive(server(inside), script)


def test_budgets_end_a_run_which_the_same_call_continues(tmp_path):
    async def script(call):
        # A whole run of these is more than the three budgets of this test afford on any machine.
        await call.facts("draft", name="long", task="aggregation", changes={
            "algorithm.judgement_trials": 5, "algorithm.champion_trials": 2, "algorithm.evaluation_steps": 600})
        error = await call.error("run", file="long.json", seconds=1000)
        assert error["code"] == "budget" and "10 s" in error["message"]
        error = await call.error("run", file="long.json", episodes=1000)
        assert error["code"] == "budget" and "3200 episodes" in error["message"] and "6 or less" in error["next"]
        error = await call.error("run", file="long.json", generations=200, episodes=100_000_000)
        assert error["code"] == "budget" and "the bound of this server" in error["message"]
        started = time.monotonic()
        stopped = await call.facts("run", file="long.json", generations=100, seconds=3)
        assert time.monotonic() - started < 13
        assert stopped["state"] == "stopped by the budget" and stopped["generations_done"]["1"] < 100, stopped
        assert "the same arguments" in call.made[-1][2].content[0].text
        again = await call.facts("run", file="long.json", generations=100, seconds=3)
        assert again["generations_done"]["1"] > stopped["generations_done"]["1"]
        resumed = await call.facts("resume", experiment="1", seconds=3)
        assert resumed["generations_done"]["1"] > again["generations_done"]["1"]
        assert (await call.error("resume", experiment="1", episodes=5))["code"] == "budget"
        several = await call.facts("run", file="long.json", generations=1, seeds=[1, 2], seconds=9)
        assert [it["state"] for it in several["runs"]] == ["completed"] * 2

    drive(served(tmp_path, budgets=Budgets(10, 20_000)), script)


def test_an_agent_that_leaves_stops_the_computation(tmp_path):
    import psutil

    def programs():
        return [it for it in psutil.Process().children(recursive=True) if it.name() == "swarmctl"]

    async def script(call):
        await call.facts("draft", name="long", task="aggregation")
        with anyio.move_on_after(2):
            await call("run", file="long.json", seconds=60)
        with anyio.fail_after(10):
            while programs():
                await anyio.sleep(0.1)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(lambda: call("run", file="long.json", seconds=4))
            await anyio.sleep(1.5)
            assert (await call.error("run", file="long.json"))["code"] == "busy"

    drive(server(tmp_path), script)


def test_a_run_is_looked_at_from_all_sides(ran):
    async def script(call):
        [row] = (await call.facts("experiments"))["rows"]
        assert row[0] == 1 and row[3] == "completed"
        history = await call.facts("history", experiment="1", rows=2)
        assert [it[0] for it in history["rows"]] == [0, 2] and history["rows_left_out"] == 1
        champion = await call.facts("individual", address="1")
        assert champion["genes"] == 6 and champion["judged"]["trials"] == 10 and champion["network"]["neurons"] == 2
        assert (await call.facts("individual", address="1@0/3"))["individual"] == 3
        tested = await call.facts("evaluate", address="1", trials=6, robots=[4], perturb=["uncontrollable_rotation"], changes={"world.width": 500})
        assert [it["name"] for it in tested["conditions"]] == ["nominal", "robots=4", "uncontrollable_rotation", "world.width=500"]
        assert {"on_black", "on_white", "solved"} == set(tested["conditions"][0]["measures"])
        assert (await call.facts("explain", experiment="1"))["experiment"]["state"] == "completed"
        assert (await call.facts("follow", experiment="1", seconds=2))["experiment"]["state"] == "completed"
        fork = await call.facts("fork", address="1@1", generations=4, seed=5, changes={"world.objects.robot.num_instances": 12})
        assert fork["state"] == "completed" and fork["experiment"] == 2
        assert "1, 2" in (await call.error("explain", experiment="small"))["message"]
        compared = await call.facts("compare", of=["1", "2"])
        assert compared

    drive(server(ran), script)


def test_a_picture_is_an_image_that_a_model_sees(ran):
    async def script(call):
        await call.facts("picture", address="1", step=3)
        image, _ = call.made[-1][2].content
        assert image.type == "image" and image.mime_type == "image/png"
        assert base64.b64decode(image.data).startswith(b"\x89PNG") and len(image.data) < 400_000
        error = await call.error("picture", address="1@0/999")
        assert error["code"] in ("bad_input", "not_found") and "999" in error["message"]

    drive(server(ran), script)


def test_a_bundle_is_exported_once_and_verified(ran):
    async def script(call):
        await call.facts("export", experiment="1", file="proof.zip")
        assert (await call.error("export", experiment="1", file="proof.zip"))["code"] == "exists"
        proven = await call.facts("verify", file="proof.zip", generations=1)
        assert {"chain", "champion", "simulation"} <= {it["claim"] for it in proven["proven"]}
        whole = (ran / "proof.zip").read_bytes()
        (ran / "forged.zip").write_bytes(whole[:-200])
        assert (await call.error("verify", file="forged.zip"))["code"] in ("unreadable_file", "claim_false")

    drive(server(ran), script)


def test_a_bundle_is_verified_here_even_if_a_fleet_is_in_the_environment(ran, monkeypatch):
    nobody = "http://127.0.0.1:9"
    monkeypatch.setenv("SWARM_COORDINATOR", nobody)

    async def script(call):
        await call.facts("export", experiment="1", file="here.zip")
        proven = await call.facts("verify", file="here.zip", generations=1)
        assert "simulation" in {it["claim"] for it in proven["proven"]}

    drive(server(ran, coordinator=nobody), script)


def test_errors_of_experiments_that_do_not_exist_name_the_next_step(tmp_path, ran):
    async def nothing(call):
        assert "`run`" in (await call.error("experiments"))["next"]
        assert (await call.error("experiments", place="fleet"))["code"] == "no_fleet"

    async def unknown(call):
        error = await call.error("history", experiment="9")
        assert error["code"] == "not_found" and "`experiments`" in error["next"] and "working on" not in error["message"]
        assert (await call.error("fork", address="1"))["where"] == "address"
        assert (await call.error("individual", address="1@0"))["where"] == "address"

    drive(server(tmp_path), nothing)
    drive(server(ran), unknown)


def test_long_answers_are_cut_and_say_so(tmp_path):
    (tmp_path / "long.json").write_text(json.dumps({f"key_{i}": 1 for i in range(200)}))

    async def script(call):
        text = await call("validate", file="long.json")
        assert "left out" in text and len(text) <= CHARACTERS_MAX
        error = await call.error("run", file="long.json")
        assert "cut here" in error["message"]

    drive(server(tmp_path), script)


def test_a_fleet_is_submitted_to_followed_and_controlled(programs, tmp_path):
    with fleet(programs, tmp_path) as running:
        running.start_worker()

        async def script(call):
            await call.facts("draft", name="ours", task="division_of_labour", changes={
                "algorithm.judgement_trials": 5, "algorithm.champion_trials": 2, "algorithm.evaluation_steps": 20})
            submitted = await call.facts("submit", file="ours.json", seeds=[1, 2], generations=2, group="pair")
            assert [it["seed"] for it in submitted["submitted"]] == [1, 2]
            for number in ("1", "2"):
                ended = await call.facts("follow", experiment=number, seconds=30, place="fleet")
                assert ended["experiment"]["state"] == "completed"
            assert len((await call.facts("experiments", place="fleet"))["rows"]) == 2
            forked = await call.facts("fork_on_fleet", address="1@1", generations=100_000)
            number = str(forked["submitted"]["id"])
            await call.facts("control", experiment=number, action="priority", priority=10)
            await call.facts("control", experiment=number, action="pause", reason="lunch")
            assert (await call.facts("explain", experiment=number, place="fleet"))["experiment"]["state"] == "paused"
            await call.facts("control", experiment=number, action="resume")
            await call.facts("control", experiment=number, action="cancel")
            assert (await call.facts("evaluate", address="1", trials=3, place="fleet"))["conditions"]

        drive(server(tmp_path, coordinator=running.url, allow_submit=True, allow_control=True), script)

    async def gone(call):
        assert (await call.error("experiments", place="fleet"))["code"] == "unreachable"

    drive(server(tmp_path, coordinator=running.url), gone)


def test_it_serves_on_standard_input_and_output(tmp_path):
    parameters = StdioServerParameters(command=sys.executable, args=["-m", "swarmevo.agents.main", "--directory", str(tmp_path)], env={"PATH": __import__("os").environ["PATH"]})

    async def main():
        async with Client(stdio_client(parameters)) as client:
            call = Calls(client)
            assert (await call.facts("draft", name="one"))["ok"]
            assert (await call.error("experiments"))["code"] == "not_found"

    anyio.run(main)
    assert (tmp_path / "one.star").exists()
