"""What an HTTP server of cie bears: raw sockets, for `cie view` and `cie live --listen` alike."""
import http.client
import os
import re
import socket
import time

PATIENCE = 90  # seconds, for what a busy machine does late
CROWD = 300  # connections
AT_ONCE = 3  # seconds; below the five that a connection may take for its request


class HostileClients:
    """For a TestCase with `port`, `process` (the server's id) and `fetched` (a path that is served)."""

    def connect(self):
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE)
        self.addCleanup(connection.close)
        return connection

    def request(self, method="GET", host=None, fields="", path=None):
        return (f"{method} {path or self.fetched} HTTP/1.1\r\nHost: {host or f'127.0.0.1:{self.port}'}\r\n"
                f"{fields}\r\n").encode("latin-1")

    @staticmethod
    def all_of(connection):
        """What comes up to the end of the connection."""
        parts = []
        try:
            while part := connection.recv(65536):
                parts.append(part)
        except ConnectionError:
            pass
        return b"".join(parts)

    def statuses(self, sent):
        """Of the answers to bytes, until the server closes the connection."""
        connection = self.connect()
        connection.sendall(sent)
        return [int(status) for status in re.findall(rb"HTTP/1\.[01] (\d{3}) ", self.all_of(connection))]

    def fetch_seconds(self):
        """How long a client that behaves waits."""
        begin = time.monotonic()
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        self.addCleanup(connection.close)
        connection.request("GET", self.fetched)
        answer = connection.getresponse()
        answer.read()
        self.assertEqual(answer.status, 200)
        return time.monotonic() - begin

    def memory(self):
        """Of the server, in bytes."""
        with open(f"/proc/{self.process}/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")

    def test_a_connection_is_kept_for_the_next_request(self):
        two = self.request() + self.request(fields="Connection: close\r\n")
        self.assertEqual(self.statuses(two), [200, 200])

    def test_every_request_of_a_connection_says_whom_it_calls(self):
        for host in ("evil.example", f"evil.example:{self.port}", "127.0.0.1", f"127.0.0.1:{self.port}.evil.example"):
            self.assertEqual(self.statuses(self.request() + self.request(host=host) + self.request()), [200, 403], host)
        self.assertEqual(self.statuses(f"GET {self.fetched} HTTP/1.0\r\n\r\n".encode()), [403], "no Host at all")
        self.assertEqual(self.statuses(self.request(fields="Host: evil.example\r\n")), [403], "two of them")

    def test_what_a_refused_request_carries_is_no_request(self):
        # A page may send any bytes as a POST's body, but not say whom it calls.
        inner = self.request()
        for fields in (f"Content-Length: {len(inner)}\r\n", "Transfer-Encoding: chunked\r\n"):
            for method in ("POST", "GET", "PUT", "BREW"):
                for host in ("evil.example", None):
                    statuses = self.statuses(self.request(method, host, fields) + inner)
                    self.assertEqual(len(statuses), 1, (method, host, fields, statuses))
                    self.assertGreaterEqual(statuses[0], 400)

    def test_nothing_but_fetching_is_answered(self):
        for method in ("POST", "PUT", "DELETE", "TRACE", "CONNECT", "PATCH"):
            self.assertEqual(self.statuses(self.request(method) + self.request()), [405], method)
        self.assertEqual(self.statuses(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + self.request()), [400], "TLS")

    def test_a_body_is_refused_before_it_comes(self):
        before = self.memory()
        for fields in ("Content-Length: 600000000\r\n", "Transfer-Encoding: chunked\r\n"):
            connection = self.connect()
            connection.sendall(self.request("POST", fields=fields))
            begin = time.monotonic()
            sent = 0
            try:
                while sent < 600_000_000:
                    sent += connection.send(b"7fffff\r\n" + b"x" * 65536)
            except OSError:
                pass
            self.assertLess(time.monotonic() - begin, PATIENCE / 2)
            self.assertLess(self.memory() - before, 16_000_000)
        self.assertEqual(self.statuses(self.request("POST", fields="Content-Length: 600000000\r\n")), [413])

    def test_a_request_is_short(self):
        long = "x" * 9000
        self.assertEqual(self.statuses(self.request(path="/" + long)), [431])
        self.assertEqual(self.statuses(self.request(fields=f"X-Long: {long}\r\n")), [431])
        self.assertEqual(self.statuses(self.request(fields="".join(f"X-{i}: {i}\r\n" for i in range(1000)))), [431])

    def test_a_crowd_that_is_slow_keeps_nobody_waiting(self):
        for beginning in (b"", b"GET / HT", self.request()[:-2] + b"X: "):
            crowd = [self.connect() for _ in range(CROWD)]
            for connection in crowd:
                if beginning:
                    connection.sendall(beginning)
            self.assertLess(self.fetch_seconds(), AT_ONCE, beginning)
            for connection in crowd:
                connection.close()

    def test_a_crowd_that_does_not_read_keeps_nobody_waiting(self):
        for _ in range(CROWD):
            connection = self.connect()
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.sendall(20 * self.request())
        self.assertLess(self.fetch_seconds(), AT_ONCE)

    def test_a_request_that_drips_is_cut_off(self):
        connection = self.connect()
        connection.sendall(self.request()[:-2])
        begin = time.monotonic()
        try:
            while time.monotonic() - begin < PATIENCE:
                connection.sendall(b"X: y\r\n")
                time.sleep(0.3)
        except ConnectionError:
            pass
        self.assertLess(time.monotonic() - begin, 5 + AT_ONCE)
