"""Tries what the table `[opcua]` says: whether the port is free, and who is trusted."""

import asyncio

from bridges.common.checks import Say
from bridges.opcua.certificates import ENDINGS
from bridges.opcua.settings import OpcuaFile


async def check(file: OpcuaFile, say: Say) -> list[str]:
    """Open the port for a moment; gives what is wrong, a sentence each."""
    troubles = []
    host, port = file.place
    try:
        server = await asyncio.start_server(lambda _reader, writer: writer.close(), host, port)
    except OSError as error:
        troubles.append(f"opcua.listen: {host}:{port} cannot be listened at: {error.strerror or error}")
    else:
        server.close()
        await server.wait_closed()
        say(f"opcua.listen: {host}:{port} is free")
    folder = file.opcua.trusted
    if folder is None:
        return troubles
    if not folder.is_dir():
        return [*troubles, f"opcua.trusted: {folder} is no folder"]
    count = sum(file.suffix.lower() in ENDINGS for file in folder.iterdir())
    say(f"opcua.trusted: {count} certificates")
    if count == 0:
        troubles.append(
            f"opcua.trusted: {folder} is empty, so no client can connect: copy their certificates there"
        )
    return troubles
