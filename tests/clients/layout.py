"""Holds a Foxglove layout against what Foxglove publishes of layouts.

    layout.py LAYOUT.json

The package foxglove-sdk declares the settings of every panel, with their types.
Every setting in the layout must be one of them and of its type. Exits with a
traceback at the first that is not.
"""

import json
import sys
import types
import typing

from foxglove import layouts

# Of panels in a layout file, and not of their settings.
TITLE = "foxglovePanelTitle"


def check(what, value, kind):
    """Whether a JSON value is of an annotated type."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        kinds = [kind for kind in arguments if kind is not type(None)]
        if len(kinds) == 1:
            return check(what, value, kinds[0])
        assert any(fits(value, kind) for kind in kinds), (what, value, kind)
    elif origin is typing.Literal:
        assert value in arguments, (what, value, arguments)
    elif origin is list:
        assert isinstance(value, list), (what, value)
        for number, item in enumerate(value):
            check(f"{what}[{number}]", item, arguments[0])
    elif isinstance(kind, type) and issubclass(kind, layouts._BaseModel):
        settings(what, value, kind)
    else:
        assert fits(value, kind), (what, value, kind)


def fits(value, kind):
    if kind is float:
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    return isinstance(kind, type) and isinstance(value, kind)


def settings(what, found, kind):
    hints = typing.get_type_hints(kind, vars(layouts))
    names = hints.keys()
    # The names in files are not those in Python; a model that holds them as values
    # tells which is which.
    in_file = {name: key for key, name in kind(**{name: name for name in names})._to_dict().items()}
    by_key = {key: name for name, key in in_file.items()}
    for key, value in found.items():
        assert key in by_key, f"{what}: {kind.__name__} has no {key}"
        check(f"{what}.{key}", value, hints[by_key[key]])


def leaves(node):
    if isinstance(node, str):
        return [node]
    assert node["direction"] in ("row", "column") and 0 < node["splitPercentage"] < 100, node
    assert set(node) == {"direction", "splitPercentage", "first", "second"}, node
    return leaves(node["first"]) + leaves(node["second"])


if __name__ == "__main__":
    with open(sys.argv[1]) as file:
        layout = json.load(file)
    panels = layout["configById"]
    for panel, found in panels.items():
        config = getattr(layouts, panel.split("!")[0] + "Config")
        settings(panel, {key: value for key, value in found.items() if key != TITLE}, config)
    shown = leaves(layout["layout"])
    assert sorted(shown) == sorted(panels) and len(set(shown)) == len(shown), shown
    print(f"{len(panels)} panels")
