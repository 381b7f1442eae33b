"""Agents by HTTP: on loopback with the client's token, and nowhere else without TLS."""

import os
import socket
import subprocess
import sys
import time
from contextlib import contextmanager

import anyio
import pytest

pytest.importorskip("mcp")
import httpx2
from agents import Calls
from mcp import Client
from mcp.client.streamable_http import streamable_http_client

TOKEN = "a token that nobody guesses"
COMMAND = [sys.executable, "-m", "swarmevo.agents.main"]


@pytest.fixture
def environment(tmp_path):
    kept = {key: it for key, it in os.environ.items() if not key.startswith("SWARM_")}
    return kept | {"SWARM_CLIENT_TOKEN": TOKEN, "XDG_CONFIG_HOME": str(tmp_path / "none")}


@contextmanager
def serving(directory, environment):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen([*COMMAND, "--directory", directory, "--http", f"127.0.0.1:{port}"], env=environment)
    try:
        give_up_at = time.monotonic() + 60
        while process.poll() is None and time.monotonic() < give_up_at:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.05)
        yield f"http://127.0.0.1:{port}/mcp"
    finally:
        process.terminate()
        process.wait(20)


def test_only_requests_with_the_token_are_answered(tmp_path, environment):
    async def main(url):
        for headers in ({}, {"authorization": "Bearer wrong"}, {"authorization": TOKEN}):
            async with httpx2.AsyncClient(headers=headers) as http:
                refused = await http.post(url, json={})
                assert refused.status_code == 401 and "client's token" in refused.json()["error"]["next"]
        async with httpx2.AsyncClient(headers={"authorization": f"Bearer {TOKEN}"}) as http:
            evil = await http.post(url, json={}, headers={"host": "evil.example"})
            assert evil.status_code >= 400
            async with Client(streamable_http_client(url, http_client=http)) as client:
                assert "agents" in (await Calls(client).facts("docs"))["pages"]

    with serving(tmp_path, environment) as url:
        anyio.run(main, url)


@pytest.mark.parametrize(("arguments", "token", "why"), [
    (["--http", "0.0.0.0:8000"], TOKEN, "--tls-cert"),
    (["--http", "example.org:8000"], TOKEN, "--tls-cert"),
    (["--http", "127.0.0.1:8000"], "", "client's token"),
    (["--http", "127.0.0.1:8000"], "short", "16"),
    (["--http", "8000"], TOKEN, "HOST:PORT"),
    (["--http", "127.0.0.1:8000", "--tls-cert", "a.pem"], TOKEN, "--tls-key"),
    (["--directory", "nowhere/at/all"], TOKEN, "nowhere"),
])
def test_it_refuses_to_serve_a_network_in_the_clear_or_without_a_token(arguments, token, why, environment):
    done = subprocess.run([*COMMAND, *arguments], env=environment | {"SWARM_CLIENT_TOKEN": token}, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and why in done.stderr and done.stderr.count("\n") == 1, done.stderr
