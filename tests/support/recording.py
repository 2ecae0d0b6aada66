"""What a recording says without cie: its manifest, and its events as babeltrace2 reads them."""
import json
import re
import subprocess
from pathlib import Path


def manifest_of(recording):
    return json.loads(Path(recording, "manifest.json").read_text("utf-8"))


def starts_of(trace):
    """Numbers of the timer's instances, in order, where live_traced_app was recorded."""
    text = subprocess.run(["babeltrace2", str(trace)], capture_output=True, text=True, timeout=90, check=False).stdout
    return [int(seq) for seq in re.findall(r"cie:callback_start: .*?\{ callback_id = 0, seq = (\d+)", text)]
