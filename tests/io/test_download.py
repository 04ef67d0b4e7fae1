"""Downloads from a server on this machine: whole, cut short, gone on with, changed at the source."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from idtool.errors import InputError
from idtool.io.download import download

CONTENT = bytes(range(256)) * 2000
SUM = hashlib.sha256(CONTENT).hexdigest()


class Server(HTTPServer):
    """Serves CONTENT at /file; breaks off after `most` bytes; may not know how to go on."""

    most = len(CONTENT)
    resumes = True
    asked: list[str | None]


class Handler(BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        self.server.asked.append(self.headers.get("Range"))
        if self.path != "/file":
            self.send_error(404)
            return
        wanted = self.headers.get("Range")
        start = int(wanted.removeprefix("bytes=").rstrip("-")) if wanted and self.server.resumes else 0
        if start >= len(CONTENT):
            self.send_response(416)
            self.send_header("Content-Range", f"bytes */{len(CONTENT)}")
            self.end_headers()
            return
        rest = CONTENT[start:]
        self.send_response(206 if start else 200)
        self.send_header("Content-Length", str(len(rest)))
        self.end_headers()
        self.wfile.write(rest[: self.server.most])

    def log_message(self, format: str, *arguments: Any) -> None:
        pass


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server(("127.0.0.1", 0), Handler)
    made.asked = []
    thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    yield made
    made.shutdown()
    thread.join()
    made.server_close()


def address(server: Server, name: str = "file") -> str:
    return f"http://127.0.0.1:{server.server_port}/{name}"


@pytest.mark.parametrize("resumes", [True, False])
def test_what_was_cut_short_is_gone_on_with(server: Server, tmp_path: Path, resumes: bool) -> None:
    server.resumes, server.most = resumes, 100_000
    path = tmp_path / "recording.mat"
    with pytest.raises(
        InputError, match=r"ended after 100000 of 512000 bytes.*goes on where this one stopped"
    ):
        download(address(server), path, sha256=SUM)
    assert not path.exists()
    assert (tmp_path / "recording.mat.part").read_bytes() == CONTENT[:100_000]

    server.most = len(CONTENT)
    seen: list[tuple[int, int]] = []
    assert download(address(server), path, sha256=SUM, progress=lambda *at: seen.append(at)) == SUM
    assert path.read_bytes() == CONTENT
    assert server.asked == [None, "bytes=100000-"]
    assert seen[-1] == (len(CONTENT), len(CONTENT))
    assert sorted(file.name for file in tmp_path.iterdir()) == ["recording.mat"]


def test_a_whole_part_needs_no_more_bytes(server: Server, tmp_path: Path) -> None:
    (tmp_path / "x.part").write_bytes(CONTENT)
    assert download(address(server), tmp_path / "x") == SUM
    assert (tmp_path / "x").read_bytes() == CONTENT


def test_a_part_longer_than_the_file_is_none_of_it(server: Server, tmp_path: Path) -> None:
    (tmp_path / "x.part").write_bytes(CONTENT + b"of another file")
    assert download(address(server), tmp_path / "x") == SUM
    assert (tmp_path / "x").read_bytes() == CONTENT
    assert server.asked == [f"bytes={len(CONTENT) + 15}-", None]


def test_another_file_than_expected_is_refused_and_not_kept(server: Server, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not the file that was expected"):
        download(address(server), tmp_path / "x", sha256="0" * 64)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "expected"),
    [("nothing", "the server answers 404"), ("gone", "cannot be fetched"), ("ftp", "is no http address")],
)
def test_what_cannot_be_fetched_is_one_sentence(
    server: Server, tmp_path: Path, name: str, expected: str
) -> None:
    url = {"nothing": address(server, "nothing"), "gone": "http://127.0.0.1:9/x", "ftp": "ftp://x/y"}[name]
    with pytest.raises(InputError, match=expected) as raised:
        download(url, tmp_path / "x")
    assert str(raised.value).startswith(url)
    assert not (tmp_path / "x").exists()
