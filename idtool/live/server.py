"""The process that serves the live page: rows in on standard input, Server-Sent Events out to browsers.

Only the standard library, no package of ours: it starts in a tenth of a second. It keeps the newest rows
only; a browser that comes late gets those, one that reads slowly misses rows.
"""

from __future__ import annotations

import itertools
import sys
import threading
import time
from collections import deque
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

#: Rows that are kept, about a minute of a real axis.
KEPT = 3000
#: Events a second to a browser, and rows in one at most.
_RATE_HZ, _MOST = 20.0, 500
_PAGE = Path(__file__).with_name("page.html")


class Rows:
    """The newest rows, numbered."""

    def __init__(self) -> None:
        self._rows: deque[tuple[int, str]] = deque(maxlen=KEPT)
        self._lock = threading.Lock()
        self.count = 0
        self.ended = False

    def add(self, row: str) -> None:
        """Take in a row, a JSON list."""
        with self._lock:
            self.count += 1
            self._rows.append((self.count, row))

    def since(self, number: int) -> tuple[int, list[str]]:
        """The last number, and the rows after a number, the newest ones if there are too many."""
        with self._lock:
            fresh = list(itertools.takewhile(lambda one: one[0] > number, reversed(self._rows)))[:_MOST]
            return self.count, [row for _, row in reversed(fresh)]


def handler(rows: Rows, names: str) -> type[BaseHTTPRequestHandler]:
    """What answers a browser."""
    page = _PAGE.read_text(encoding="utf-8").replace("{{names}}", names.replace("<", "\\u003c")).encode()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self.path == "/":
                self._head("text/html; charset=utf-8", len(page))
                self.wfile.write(page)
            elif self.path == "/rows":
                self._head("text/event-stream")
                self._stream()
            else:
                self.send_error(404)

        def _head(self, kind: str, length: int | None = None) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Cache-Control", "no-store")
            if length is not None:
                self.send_header("Content-Length", str(length))
            self.end_headers()

        def _stream(self) -> None:
            seen = 0
            try:
                while True:
                    ended = rows.ended
                    seen, fresh = rows.since(seen)
                    if fresh:
                        self.wfile.write(f"data: [{','.join(fresh)}]\n\n".encode())
                    if ended:
                        self.wfile.write(b"event: end\ndata: 0\n\n")
                        return
                    if not fresh:
                        self.wfile.write(b": still here\n\n")
                    time.sleep(1.0 / _RATE_HZ)
            except OSError:
                return  # the browser went away

        def log_message(self, format: str, *args: object) -> None:
            """Nothing to standard error, which is the terminal of the run."""

    return Handler


def main() -> None:
    """Serve until standard input ends: `server.py PORT NAMES`."""
    rows = Rows()
    server = ThreadingHTTPServer(("127.0.0.1", int(sys.argv[1])), handler(rows, sys.argv[2]))
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    print(f"http://127.0.0.1:{server.server_port}/", flush=True)
    for line in sys.stdin:
        rows.add(line.strip())
    rows.ended = True
    time.sleep(3.0 / _RATE_HZ)  # the last rows and the word that it is over reach the browsers


if __name__ == "__main__":
    try:
        main()
    except OSError:
        sys.exit(1)  # the port is taken: the one who asked reads no address
