"""How the threads that a callback ran on followed each other: what M3, M4 and the report's `isolation` ask."""

from typing import NamedTuple

from .entities import Callback
from .proof import Proof


class Succession(NamedTuple):
    together: bool  # two of them were alive at one time
    moved: bool  # one replaced another, and the callback was not registered again
    lost: bool  # for two of them that is not known


def succession(c: Callback, proof: Proof) -> Succession:
    threads = sorted({i.thread for i in c.instances}, key=lambda t: t.first_seen)
    together = lost = moved = False
    for k, a in enumerate(threads):
        for b in threads[k + 1:]:
            if a.tid != b.tid and a.last_seen >= b.first_seen:
                together = True
            elif b.init is None and a.fini is not None and not proof.whole[c.process]:
                lost = True  # the same thread, perhaps, whose new announcement is missing
            elif a.tid == b.tid or (a.exit is not None and b.start_ns is not None):
                last = max(i.start for i in a.instances if i.callback is c)
                first = min(i.start for i in b.instances if i.callback is c)
                moved |= not any(last < e.time < first for e in c.inits)
            else:
                lost = True
    return Succession(together, moved, lost)
