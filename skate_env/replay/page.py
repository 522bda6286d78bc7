"""The page in the browser: recordings as HTML files, and a server for the page.

`make web` builds the page into the folder ``web`` of the package.
"""

import base64
import html
import io
import json
import sys
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from mimetypes import guess_type
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np

from .._core import Scene

FOLDER = Path(__file__).parents[1] / "web"
_PLAYER, _PAGE = "player.html", "index.html"
_PLACE = "%RECORDING%"
# Names of this machine in requests.
_HOSTS = ("127.0.0.1", "localhost")
# The page reads arrays of at most 64 MiB; `segments` is the largest.
MOST_SAMPLES = 160_000
# Positions and forces are rounded to multiples of these [m], [N]: the file is a sixth smaller.
_LENGTH, _FORCE = 2.0**-13, 2.0**-4
# Height of a recording in a notebook [px].
_HEIGHT = 560


class NotBuilt(OSError):
    """The page is missing in this installation."""


def check_built() -> None:
    """Raise `NotBuilt`, which says what to do, unless the page is there."""
    if not all((FOLDER / name).is_file() for name in (_PLAYER, _PAGE)):
        raise NotBuilt(
            "the page is not part of this installation: run `make web` in a checkout (needs "
            "Node.js), then install the package again from there"
        )


def packed(fields: Mapping[str, Any]) -> bytes:
    """Pack what the page shows of a recording's fields: an ``.npz`` archive in single precision.

    Raises
    ------
    ValueError
        If it has more than `MOST_SAMPLES` samples.
    """
    if len(fields["t"]) > MOST_SAMPLES:
        raise ValueError(
            f"{len(fields['t'])} samples: the page shows at most {MOST_SAMPLES}; record fewer "
            "steps, or every n-th action"
        )
    given = fields["metadata"]
    metadata = {
        "scene": given["scene"],
        "fields": json.loads(Scene.from_toml(given["scene"]).to_json()),
        "termination": given["termination"],
        "policy": given["policy"] is not None or None,
    }
    data = io.BytesIO()
    np.savez_compressed(
        data,
        **{name: fields[name] for name in ("t", "state_number", "right_support")},
        contact_forces=_rounded(fields["contact_forces"], _FORCE),
        head=_rounded(fields["head"], _LENGTH),
        segments=_rounded(fields["segments"], _LENGTH),
        metadata=np.array(json.dumps(metadata)),
    )
    return data.getvalue()


def player(recording: bytes) -> str:
    """Return a page that plays a packed recording; it needs no other file and no network.

    Raises
    ------
    NotBuilt
        If the page is missing in this installation.
    """
    check_built()
    page = (FOLDER / _PLAYER).read_text(encoding="utf-8")
    return page.replace(_PLACE, base64.b64encode(recording).decode())


def element(fields: Mapping[str, Any]) -> str:
    """Return an element that plays a recording in a notebook, or says why it does not."""
    try:
        page = player(packed(fields))
    except (NotBuilt, ValueError) as error:
        duration = fields["t"][-1] - fields["t"][0]
        name = Scene.from_toml(fields["metadata"]["scene"]).name
        text = f"Recording of {name}, {duration:.2f} s; not shown: {error}"
        return f"<p>{html.escape(text)}</p>"
    style = f"width: 100%; height: {_HEIGHT}px; border: 0"
    return f'<iframe style="{style}" srcdoc="{html.escape(page)}"></iframe>'


class PageServer(ThreadingHTTPServer):
    """A server of the page, for this machine only; use it as a context.

    Parameters
    ----------
    port
        Port, or 0 for a free one.
    file
        Name and content of a file beside the page's own, which its address can name as the scene.

    Raises
    ------
    NotBuilt
        If the page is missing in this installation.
    OSError
        If the port is in use.
    """

    daemon_threads = True

    def __init__(self, port: int = 0, file: tuple[str, bytes] | None = None) -> None:
        check_built()
        # No request reaches the file system.
        self.contents = {
            f"/{path.relative_to(FOLDER).as_posix()}": path.read_bytes()
            for path in FOLDER.rglob("*")
            if path.is_file()
        }
        self.contents["/"] = self.contents[f"/{_PAGE}"]
        if file is not None:
            self.contents[f"/{file[0]}"] = file[1]
        super().__init__(("127.0.0.1", port), _Handler)

    def address(self, entries: Mapping[str, str]) -> str:
        """Return the address of the page with entries; docs/browser.md lists them."""
        state = "&".join(f"{name}={quote(value)}" for name, value in entries.items())
        return f"http://127.0.0.1:{self.server_port}/" + (f"#{state}" if state else "")

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that has closed its connection."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers with the contents of a `PageServer`."""

    server: PageServer

    def do_HEAD(self) -> bytes:
        """Answer without the content, which is returned."""
        # A stranger's page whose name has been made to mean this machine sends its own name.
        if self.headers.get("Host", "").partition(":")[0] not in _HOSTS:
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
            return b""
        path = unquote(self.path.partition("?")[0])
        content = self.server.contents.get(path)
        if content is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return b""
        kind = "text/html" if path == "/" else guess_type(path)[0]
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind or "application/octet-stream")
        self.send_header("Content-Length", str(len(content)))
        # The next server on this port may have another file.
        self.send_header("Cache-Control", "no-cache")
        self.end_headers()
        return content

    def do_GET(self) -> None:
        """Answer with the content."""
        self.wfile.write(self.do_HEAD())

    def log_message(self, format: str, *arguments: Any) -> None:
        """Write no log."""


def _rounded(values: Any, unit: float) -> Any:
    return (np.round(np.asarray(values) / unit) * unit).astype(np.float32)
