"""Runs Trace Compass's data-driven XML over events, as far as cie.xml uses that language.

What it does not know it refuses, so that the file cannot grow beyond what is tested.
"""
import collections


class Path:
    """Where stateAttribute elements lead in a state system, for an event."""

    def __init__(self, locations):
        self.locations = locations

    def resolve(self, elements, event, scenario=()):
        path = ()
        for element in elements:
            kind, value = element.get("type"), element.get("value")
            if kind == "constant":
                path += scenario if value == "#CurrentScenario" else (value,)
            elif kind == "eventField":
                path += (str(event.field(value)),)
            elif kind == "location":
                path += self.resolve(self.locations[value], event, scenario)
            else:
                raise ValueError(f"stateAttribute of type {kind}")
        return path


class States:
    """The values of attributes over time."""

    def __init__(self):
        self.now = {}
        self.since = {}
        self.intervals = collections.defaultdict(list)  # by path: (begin, end, value), null ones left out

    def set(self, path, value, time):
        before = self.now.get(path)
        if before is not None and self.since[path] < time:
            self.intervals[path].append((self.since[path], time, before))
        self.now[path] = value
        self.since[path] = time


class Machine:
    """What stateProvider and pattern have in common: locations, named values, values, conditions, changes."""

    def __init__(self, element):
        self.element = element
        self.path = Path({location.get("id"): list(location) for location in element.findall("location")})
        self.named = {value.get("name"): value.get("value") for value in element.findall("definedValue")}
        self.states = States()

    def value(self, element, event, scenario=()):
        kind, value = element.get("type"), element.get("value")
        if kind == "null":
            return None
        if kind == "int":
            return int(self.named[value[1:]] if value.startswith("$") else value)
        if kind == "eventField":
            return event.field(value)
        if kind == "query":
            return self.states.now.get(self.path.resolve(element, event, scenario))
        raise ValueError(f"stateValue of type {kind}")

    def holds(self, element, event, scenario=()):
        if element.tag in ("if", "not", "and"):
            parts = [self.holds(child, event, scenario) for child in element]
            return not parts[0] if element.tag == "not" else all(parts)
        if element.tag != "condition" or element.get("operator", "eq") != "eq":
            raise ValueError(f"condition {element.tag}")
        *attributes, last = list(element)
        first = (self.states.now.get(self.path.resolve(attributes, event, scenario))
                 if attributes[0].tag == "stateAttribute" else self.value(attributes[0], event, scenario))
        return first == self.value(last, event, scenario)

    def change(self, element, event, scenario=()):
        if element[0].tag == "if":
            if self.holds(element.find("if"), event, scenario):
                self.change(element.find("then"), event, scenario)
            elif element.find("else") is not None:
                self.change(element.find("else"), event, scenario)
            return
        *attributes, value = list(element)
        self.states.set(self.path.resolve(attributes, event, scenario), self.value(value, event, scenario), event.time)


class StateProvider(Machine):
    def handle(self, event):
        for handler in self.element.findall("eventHandler"):
            if handler.get("eventName") == event.name:
                for change in handler.findall("stateChange"):
                    self.change(change, event)


class Pattern(Machine):
    """Its scenarios: of each machine those that run, and one that waits for its first transition."""

    def __init__(self, element):
        super().__init__(element)
        handler = element.find("patternHandler")
        self.tests = {test.get("id"): test.find("if") for test in handler.findall("test")}
        self.actions = {action.get("id"): action for action in handler.findall("action")}
        self.machines = {fsm.get("id"): fsm for fsm in handler.findall("fsm")}
        self.segments = []  # (begin, end, name, {field: value})
        self.scenarios = {name: [] for name in handler.get("initial").split(":")}
        self.count = 0

    def handle(self, event):
        for name, scenarios in self.scenarios.items():
            fsm = self.machines[name]
            events = [precondition.get("event") for precondition in fsm.findall("precondition")]
            if events and event.name not in events:
                continue
            if not any(scenario["begin"] is None for scenario in scenarios) and (
                    fsm.get("multiple") != "false" or not scenarios):
                self.count += 1
                scenarios.append({"state": fsm.get("initial"), "begin": None, "path": (f"scenario {self.count}",)})
            # The machine consumes an event: the first scenario that it moves takes it.
            next((True for scenario in scenarios if self.move(fsm, scenario, event)), False)
            finals = {final.get("id") for final in fsm.findall("final")}
            self.scenarios[name] = [scenario for scenario in scenarios if scenario["state"] not in finals]

    def move(self, fsm, scenario, event):
        for state in fsm.findall("state"):
            if state.get("id") != scenario["state"]:
                continue
            for transition in state.findall("transition"):
                condition = transition.get("cond")
                if transition.get("event") != event.name or (
                        condition and not self.holds(self.tests[condition], event, scenario["path"])):
                    continue
                if scenario["begin"] is None:
                    scenario["begin"] = event.time
                for action in filter(None, (transition.get("action") or "").split(":")):
                    self.act(self.actions[action], scenario, event)
                scenario["state"] = transition.get("target")
                return True
        return False

    def act(self, action, scenario, event):
        for element in action:
            if element.tag == "stateChange":
                self.change(element, event, scenario["path"])
            elif element.tag == "segment":
                name = self.value(element.find("segType/segName/stateValue"), event, scenario["path"])
                fields = {field.get("name"): self.value(field.find("stateValue"), event, scenario["path"])
                          for field in element.findall("segContent/segField")}
                self.segments.append((scenario["begin"], event.time, name, fields))
            else:
                raise ValueError(f"action {element.tag}")
