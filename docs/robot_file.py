"""Write the page on the robot file and its JSON Schema: ``python docs/robot_file.py``."""

from pathlib import Path

from clie_blocks.analysis.records.gallery import ROBOTS
from clie_blocks.analysis.records.model import DEFAULT_UNITS, MEANINGS
from clie_blocks.analysis.records.robot_file import SECTIONS
from clie_blocks.analysis.records.robot_keys import SCHEMA, TABLES, TOP, keys_of, robot_schema
from clie_blocks.analysis.records.robot_sections import Experiment
from clie_blocks.output import run_main, to_json, write

FOLDER = Path(__file__).parent
PAGE = "robot_file.md"
HEAD = """# The robot file

<!-- written by docs/robot_file.py from the code; change it there -->

`robot.toml` says what is known of a robot, its controller and the units of its logs. Every key
but `joints` may be missing: what is not stated counts as unknown. A list has one value per joint,
and a single number stands for all joints. A key or a value that is wrong is named with its line,
and all that are wrong are named at once.

```sh
clie robot arm.urdf -o arm       # start a file from a URDF or MJCF,
clie robot logs/ -o logs         # from logs: joints, rate, units, encoder steps, control law,
clie robot --gallery             # list known robots,
clie robot ur5e -o ur5e          # start from one of them,
clie robot --joints 3            # or from nothing
clie robot --check robot.toml    # what is wrong, and what each missing line would buy
clie robot --schema              # this page as JSON Schema
```

A file that `clie robot` writes begins with `#:schema ./robot.schema.json`, and has the schema
beside it: editors with a TOML language server (Taplo, "Even Better TOML") then complete keys, show
what they mean and mark what is wrong.
"""
GALLERY = """## Known robots

`clie robot NAME` writes the file of one of these, with its URDF where it has one. Each number
names the paper, manual or datasheet that it comes from; what is not published, mostly rotors and
friction, is a line for you to fill, with what it buys. The URDFs are written by
`docs/robot_gallery.py` from published frames, masses and centres of mass.

| name | robot |
|---|---|
"""
LAWS = """The laws, with v the velocity estimate of `velocity_filter`:

| `law` | command |
|---|---|
| `"pd"` | u = Kp (qd - q) - Kd v + pe, eq. (11); the default where gains are given |
| `"pid"` | u = Kp (qd - q) + Ki sum(qd - q) T - Kd v + pe |
| `"cascade"` | u = Kv w + Ki sum(w) T + pe, w = Kp (qd - q) - v |
| `"servo"` | u = clip(Kp (qd - q), +-saturation), a duty cycle of `supply_v` |
| `"unknown"` | nothing is known; u is the logged torque or current |
| `"my_law.py:controller"` | a block of your own, which `--run-law` runs, see [laws](laws.md) |
| `"my_law.c:controller"` | a function of your own in C, likewise, with `parameters` |
"""
NOTES = {"controller": LAWS + "\n",
         "experiment": "One section per log, called after its file: `[experiment.log-1]` for "
                       "`log-1.csv`.\n\n"}


def page() -> str:
    """Text of the page."""
    parts = [HEAD, _table("Top of the file", [(name, *_top(name), text)
                                              for name, text in TOP.items()])]
    for section, kind in {**SECTIONS, "experiment": Experiment}.items():
        title = f"[{section}]" if section in SECTIONS else "[experiment.NAME]"
        parts.append(f"{_heading(title)}\n{_sentence(kind)}\n\n{NOTES.get(section, '')}"
                     + _rows([(key.name, key.value, key.meaning) for key in keys_of(section)]))
    for name, text in TABLES.items():
        parts.append(f"{_heading(f'[{name}]')}\n{text}\n\n" + "\n".join([
            "| key | signal | unit, where none is stated |", "|---|---|---|",
            *(f"| `{signal}` | {MEANINGS[signal]} | {unit} |"
              for signal, unit in DEFAULT_UNITS.items())]) + "\n")
    parts.append(GALLERY + "".join(f"| `{name}` | {what} |\n" for name, what in ROBOTS.items()))
    return "\n".join(parts)


def _top(name: str) -> tuple[str]:
    return ({"joints": "whole number", "joint_names": "list of names"}.get(name, "text"),)


def _heading(title: str) -> str:
    return f"## {title}\n"


def _sentence(kind: type) -> str:
    """First sentence of a docstring."""
    return (kind.__doc__ or "").strip().splitlines()[0]


def _table(title: str, rows: list[tuple[str, str, str]]) -> str:
    return f"{_heading(title)}\n{_rows(rows)}"


def _rows(rows: list[tuple[str, str, str]]) -> str:
    lines = [f"| `{key}` | {value} | {meaning.replace('``', '`').replace('|', chr(92) + '|')} |"
             for key, value, meaning in rows]
    return "\n".join(["| key | value | meaning |", "|---|---|---|", *lines]) + "\n"


def main() -> None:
    """Write page and schema."""
    print(write(FOLDER / PAGE, page()))
    print(write(FOLDER / SCHEMA, to_json(robot_schema()) + "\n"))


if __name__ == "__main__":
    run_main(lambda argv: main())
