"""A cable between a client and a gateway, for tests that pull it out."""

import socket
import threading
from urllib.parse import urlsplit


class Cable:
    """Passes bytes between clients and a gateway, until it is pulled out."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        self._gateway = (str(parts.hostname), int(parts.port or 0))
        self._ends: list[socket.socket] = []
        self.plugged = True
        self.answers = bytearray()
        """Bytes that have come back from the gateway."""
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def pull(self) -> None:
        """Break every connection; new ones break at once until `plug`."""
        self.plugged = False
        self._break()

    def plug(self) -> None:
        """Let new connections through again."""
        self.plugged = True

    def close(self) -> None:
        """End it."""
        self.plugged = False
        # A thread in `accept` goes on where the socket is only closed.
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._break()

    def _break(self) -> None:
        while self._ends:
            _shut(self._ends.pop())

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            if not self.plugged:
                client.close()
                continue
            gateway = socket.create_connection(self._gateway)
            self._ends += [client, gateway]
            for source, target in ((client, gateway), (gateway, client)):
                threading.Thread(target=self._pump, args=(source, target), daemon=True).start()

    def _pump(self, source: socket.socket, target: socket.socket) -> None:
        try:
            while content := source.recv(65_536):
                target.sendall(content)
                if source.getpeername() == self._gateway:
                    self.answers += content
        except OSError:
            pass
        finally:
            for end in (source, target):
                _shut(end)
            source.close()


def _shut(end: socket.socket) -> None:
    try:
        end.shutdown(socket.SHUT_RDWR)
    except OSError:
        return
