"""The register of scenarios: one fault each, and what the rules must say about it and why.

The reason for each expected verdict stands beside it, in terms of the table of rules. Verdicts not
mentioned are those of a flawless trace. OPEN marks what the documents do not decide.
"""

from collections.abc import Callable

from .scenario import Scenario

ALL: dict[str, Callable[[int], Scenario]] = {}
BUILDERS: dict[str, Callable[[Scenario], None]] = {}
CPUS = (2, 1, 4)


def scenario(build: Callable[[Scenario], None]) -> Callable[[Scenario], None]:
    """Registers `build`; the number of CPUs follows the seed."""

    def make(seed: int) -> Scenario:
        s = Scenario(build.__name__, seed, cpus=CPUS[seed % 3])
        build(s)
        return s

    ALL[build.__name__] = make
    BUILDERS[build.__name__] = build
    return build
