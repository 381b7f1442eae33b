"""The connection to the coordinator, found like that of ``swarmctl``.

Settings come from arguments, else the environment, else the settings file, else the default
address.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from . import _core

DEFAULT_COORDINATOR = "http://127.0.0.1:7700"
TOKEN_VARIABLE = "SWARM_CLIENT_TOKEN"
FILE_VARIABLE = "SWARM_CONFIG"


@dataclass(frozen=True)
class Settings:
    """Address of a coordinator and credentials, if set."""

    coordinator: str | None = None
    """``http://`` or ``https://``, host and port."""
    token_file: str | None = None
    """File with the token."""
    tls_ca: str | None = None
    """PEM file of the certificate authorities that must have signed the coordinator's
    certificate."""
    tls_cert: str | None = None
    """PEM file of the client's own certificate."""
    tls_key: str | None = None
    """PEM file of its key."""
    tls_domain: str | None = None
    """Name in the coordinator's certificate, if it differs from the name in the address."""
    plaintext: bool = False
    """Send the token unencrypted to another machine."""

    @classmethod
    def find(cls, given: Settings) -> Settings:
        """``given``, completed from the environment and from the settings file."""
        environment = cls._of_environment()
        named = given.coordinator
        if named is not None and environment.coordinator not in (None, named):
            # Credentials for one coordinator must not reach another.
            environment = cls()
        settings = given._or(environment)
        file = cls._of_file()
        address = settings.coordinator
        if address is not None and address != (file.coordinator or DEFAULT_COORDINATOR):
            return settings
        if TOKEN_VARIABLE in os.environ:
            file = replace(file, token_file=None)
        return settings._or(file)

    @property
    def address(self) -> str:
        """The coordinator's address."""
        return self.coordinator or DEFAULT_COORDINATOR

    def token(self) -> str | None:
        """The token, from its file or the environment."""
        if self.token_file is None:
            return os.environ.get(TOKEN_VARIABLE)
        if TOKEN_VARIABLE in os.environ:
            raise ValueError(
                f"there are two tokens: in {self.token_file} and in {TOKEN_VARIABLE}; give one"
            )
        return Path(self.token_file).read_text(encoding="utf-8").strip()

    def _or(self, others: Settings) -> Settings:
        chosen = {it.name: getattr(self, it.name) or getattr(others, it.name) for it in fields(self)}
        return Settings(**chosen)

    @classmethod
    def _of_environment(cls) -> Settings:
        def variable(name: str) -> str | None:
            return os.environ.get(f"SWARM_{name}") or None

        return cls(
            coordinator=variable("COORDINATOR"),
            token_file=variable("CLIENT_TOKEN_FILE"),
            tls_ca=variable("TLS_CA"),
            tls_cert=variable("TLS_CERT"),
            tls_key=variable("TLS_KEY"),
            tls_domain=variable("TLS_DOMAIN"),
            plaintext=(variable("PLAINTEXT") or "").lower() not in ("", "0", "f", "false", "n", "no", "off"),
        )

    @classmethod
    def _of_file(cls) -> Settings:
        named = os.environ.get(FILE_VARIABLE)
        directory = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
        path = Path(named) if named else Path(directory) / "swarmevo" / "config.json"
        if not named and not path.is_file():
            return cls()
        settings = cls(**_read(path))

        def beside(file: str | None) -> str | None:
            return None if file is None else str(path.parent / file)

        return replace(
            settings,
            token_file=beside(settings.token_file),
            tls_ca=beside(settings.tls_ca),
            tls_cert=beside(settings.tls_cert),
            tls_key=beside(settings.tls_key),
        )


def _read(path: Path) -> dict[str, Any]:
    """The settings in a file by the names of the fields. ValueError with file and line if it has a mistake."""
    try:
        # Comments and trailing commas are as in experiment files.
        text = _core.plain(path.read_text(encoding="utf-8-sig"))
        found = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}: line {error.lineno}: {error.msg}") from None
    except UnicodeDecodeError:
        raise ValueError(f"{path}: it is not UTF-8") from None
    if not isinstance(found, dict):
        raise ValueError(f"{path}: line 1: settings are an object, not {type(found).__name__}")
    names = {it.name.replace("_", "-"): it.name for it in fields(Settings)}
    for key, value in found.items():
        line = _line_of(key, text)
        if key not in names:
            raise ValueError(f"{path}: line {line}: unknown key `{key}`; known: {', '.join(names)}")
        if key == "plaintext":
            if not isinstance(value, bool):
                raise ValueError(f"{path}: line {line}: `{key}` is true or false, not {type(value).__name__}")
        elif not isinstance(value, str) and value is not None:
            raise ValueError(f"{path}: line {line}: `{key}` is text, not {type(value).__name__}")
    return {names[key]: value for key, value in found.items()}


def _line_of(key: str, text: str) -> int:
    """The line of a key of an object, from 1."""
    found = re.search(rf"{re.escape(json.dumps(key, ensure_ascii=False))}\s*:", text)
    return 1 + text.count("\n", 0, found.start() if found else 0)
