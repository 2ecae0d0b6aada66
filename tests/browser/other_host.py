"""A recording as another host's, with the same pids, tids and ids."""
import pathlib
import re
import shutil
import uuid


def on_host(trace, host: str, folder, later_ns: int = 0) -> pathlib.Path:
    """A copy of `trace` as `folder`, with the host's name, boot and trace ids; it was booted and recorded so much later."""
    folder = pathlib.Path(folder)
    shutil.copytree(trace, folder, copy_function=shutil.copyfile)
    for metadata in folder.rglob("metadata"):
        old = uuid.UUID(re.search(rb'uuid = "([^"]*)"', metadata.read_bytes()).group(1).decode())
        new = uuid.uuid5(old, host)
        for path in [file for file in metadata.parent.iterdir() if file.is_file()]:
            content = path.read_bytes().replace(old.bytes, new.bytes).replace(str(old).encode(), str(new).encode())
            content = re.sub(rb'hostname = "[^"]*"', b'hostname = "' + host.encode() + b'"', content)
            if path.name == "metadata":
                content = re.sub(rb"(\boffset = )(\d+)", lambda found: found[1] + str(int(found[2]) + later_ns).encode(), content)
            path.write_bytes(content)
    return folder
