"""``swarmevo-mcp``: serves agents on standard input and output, or by HTTP."""

from __future__ import annotations

import argparse
import hmac
import ipaddress
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Sequence

from ..extras import needs
from ..settings import Settings

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Receive, Scope, Send

TOKEN_LEN_MIN = 16
CONNECTIONS_MAX = 64


def main(arguments: Sequence[str] | None = None) -> int:
    """Serves until the client leaves or a signal comes. Exit code 2: the arguments permit no server."""
    args = _parser().parse_args(arguments)
    with needs("agents"):
        from .parameters import Budgets
        from .serving import server
    try:
        settings = Settings.find(Settings(args.coordinator))
        made = server(
            args.directory, coordinator=settings.coordinator, allow_submit=args.allow_submit,
            allow_control=args.allow_control, budgets=Budgets(args.seconds, args.episodes),
        )
        if args.http is None:
            made.run("stdio")
        else:
            address = listening(args.http, (args.tls_cert, args.tls_key))
            _serve(made, address, token_of(settings), (args.tls_cert, args.tls_key))
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="swarmevo-mcp", description="Serves agents (MCP): experiments with robot swarms, from an idea to a verified result.")
    parser.add_argument("--directory", type=Path, default=Path(), help="the only directory in which calls read and write files [default: the current one]")
    parser.add_argument("--coordinator", metavar="URL", help="a fleet to look at [default: that of swarmctl's settings, if there is one]")
    parser.add_argument("--allow-submit", action="store_true", help="let agents submit experiments to the fleet")
    parser.add_argument("--allow-control", action="store_true", help="let agents pause, resume, cancel and reprioritise experiments of the fleet")
    parser.add_argument("--seconds", type=float, default=120, help="the most that a call may take [default: 120]")
    parser.add_argument("--episodes", type=int, default=1_000_000, help="the most episodes that a call may compute [default: 1000000]")
    parser.add_argument("--http", metavar="HOST:PORT", help="serve by HTTP at /mcp, instead of standard input and output; needs the client's token: SWARM_CLIENT_TOKEN, or its file in SWARM_CLIENT_TOKEN_FILE or the settings")
    parser.add_argument("--tls-cert", metavar="FILE", help="PEM file of the certificate; needed on addresses other than loopback")
    parser.add_argument("--tls-key", metavar="FILE", help="PEM file of its key")
    return parser


def listening(address: str, tls: tuple[str | None, str | None]) -> tuple[str, int]:
    """The address to listen on, which is on loopback unless there is TLS.

    >>> listening("127.0.0.1:8000", (None, None))
    ('127.0.0.1', 8000)
    >>> listening("0.0.0.0:8000", (None, None))
    Traceback (most recent call last):
    ValueError: 0.0.0.0 is open to a network, on which others would read the token: give --tls-cert and --tls-key, or listen on 127.0.0.1
    """
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    if not host or not port.isdigit() or int(port) > 65535:
        raise ValueError(f"--http is HOST:PORT, such as 127.0.0.1:8000, not {address}")
    if (tls[0] is None) != (tls[1] is None):
        raise ValueError("--tls-cert and --tls-key belong together: give both")
    if tls[0] is None and not _is_loopback(host):
        raise ValueError(f"{host} is open to a network, on which others would read the token: give --tls-cert and --tls-key, or listen on 127.0.0.1")
    return host, int(port)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def token_of(settings: Settings) -> str:
    """The token that requests must send."""
    token = settings.token()
    if not token:
        raise ValueError("HTTP needs the client's token, which requests must send: `(umask 077; openssl rand -hex 32 > client.token)`, then SWARM_CLIENT_TOKEN_FILE=client.token")
    if len(token) < TOKEN_LEN_MIN:
        raise ValueError(f"the token has {len(token)} characters; {TOKEN_LEN_MIN} are the least that nobody guesses: openssl rand -hex 32")
    return token


def _serve(made: Any, address: tuple[str, int], token: str, tls: tuple[str | None, str | None]) -> None:
    import uvicorn

    app = guarded(made.streamable_http_app(host=address[0]), token)
    uvicorn.run(app, host=address[0], port=address[1], log_level="warning", ssl_certfile=tls[0], ssl_keyfile=tls[1], ws="none", limit_concurrency=CONNECTIONS_MAX)


def guarded(app: ASGIApp, token: str) -> ASGIApp:
    """An application that answers only requests with the token."""
    wanted = f"Bearer {token}".encode()

    async def guard(scope: Scope, receive: Receive, send: Send) -> None:
        given = dict(scope.get("headers", ())).get(b"authorization", b"")
        if scope["type"] != "http" or hmac.compare_digest(given, wanted):
            return await app(scope, receive, send)
        body = b'{"error": {"code": "token_refused", "where": "authorization", "message": "the token is missing or wrong", "next": "send the header `authorization: Bearer TOKEN`, with the client\'s token"}}'
        headers = [(b"content-type", b"application/json"), (b"www-authenticate", b"Bearer")]
        await send({"type": "http.response.start", "status": 401, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    return guard


if __name__ == "__main__":
    sys.exit(main())
