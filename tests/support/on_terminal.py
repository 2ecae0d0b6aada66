"""What a command prints where somebody looks at it: a terminal of 24 lines."""
import fcntl
import os
import pty
import struct
import termios


def on_terminal(command, environment, columns, user=None):
    """Exit code and lines; as the user of that number, if there is one."""
    pid, terminal = pty.fork()
    if pid == 0:
        fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        if user is not None:
            os.setgroups([])
            os.setresgid(user, user, user)
            os.setresuid(user, user, user)
        os.execvpe(command[0], command, environment)
    output = b""
    while True:
        try:
            part = os.read(terminal, 65536)
        except OSError:  # so ends a terminal
            break
        if not part:
            break
        output += part
    os.close(terminal)
    _, status = os.waitpid(pid, 0)
    return os.waitstatus_to_exitcode(status), output.decode().replace("\r\n", "\n").splitlines()
