"""What two runs of one recipe must have in common."""

import json


def timeless(path):
    """A file's content; of a manifest all but what made it, as commit and date change between two runs."""
    if path.name == "manifest.json":
        return json.loads(path.read_text()) | {"made_with": []}
    return path.read_bytes()
