"""The verbs of the program: its options by their names, objects where it has files."""

import contextlib
import difflib
import functools
import json
import numbers
import operator
import os
import shutil
import tempfile

from . import _nephele
from ._nephele import Error, Grid, MatrixField, Mesh, Picture, ScalarField, VectorField
from ._objects import PATHS, as_mesh, grids_of, named_grids, read, write

# What each output beside the main one is, for those that are asked for with True.
_OUTPUTS = {"surface": ".vdb", "shape_mesh": ".ply", "map": ".vdb", "points": ".ply", "warp": ".vdb",
            "warped_mesh": ".ply"}
_FIELDS = (ScalarField, VectorField, MatrixField)


@functools.lru_cache(maxsize=None)
def options(verb):
    """The options of a verb, as --help has them: a dict by name of dicts with type, default, help and group."""
    table = {}
    for option in _nephele._options(verb)["options"]:
        if not option["is_input"]:
            table[option["name"].replace("-", "_")] = option
    return table


class _Bar:
    """Progress in tqdm's bars, one for each stage."""

    def __init__(self):
        from tqdm.auto import tqdm

        self._tqdm, self._bar, self._stage = tqdm, None, None

    def __call__(self, stage, fraction):
        if stage != self._stage:
            self.close()
            self._stage = stage
            self._bar = self._tqdm(total=100, desc=stage, bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}")
        self._bar.update(round(100 * fraction) - self._bar.n)

    def close(self):
        if self._bar is not None:
            self._bar.close()


@contextlib.contextmanager
def _callback(progress):
    """What is called with (stage, fraction): True shows bars, where tqdm is installed."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        try:
            bar = _Bar()
        except ImportError:
            bar = None
        try:
            yield bar
        finally:
            if bar is not None:
                bar.close()
    elif callable(progress):
        yield progress
    else:
        raise TypeError(f"progress is True or a function of (stage, fraction), not a {type(progress).__name__}")


def _number(value):
    """A number as it would be typed."""
    return repr(int(value) if isinstance(value, numbers.Integral) else float(value))


def _take_stats(named):
    """Whether statistics are to be returned. A path of a file for them stays an option."""
    return named.get("stats") is True and named.pop("stats")


class _Call:
    """The arguments of one call, and the objects that stand for its files."""

    def __init__(self, verb):
        self.verb = verb
        self.arguments = []
        self.files = []

    def _file(self, file, name):
        self.files.append((file, name))
        return file.path

    def path(self, thing, name):
        """The path of a file, or one that stands for an object."""
        if isinstance(thing, PATHS):
            return os.fsdecode(thing)
        if isinstance(thing, Grid):
            return self._file(_nephele._file_of_grids(name, [thing]), name)
        if isinstance(thing, dict) and thing and all(isinstance(grid, Grid) for grid in thing.values()):
            return self._file(_nephele._file_of_grids(name, named_grids(thing)), name)
        if isinstance(thing, Picture):
            return self._file(_nephele._file_of_picture(name, thing), name)
        if isinstance(thing, _FIELDS):
            hint = "; field.bake makes one" if isinstance(thing, ScalarField) else ""
            raise TypeError(f"{self.verb}: a grid is needed, not a field{hint}")
        return self._file(_nephele._file_of_mesh(name, as_mesh(thing)), name)

    def add_input(self, thing, name):
        path = self.path(thing, name)
        # Names that begin with a dash are no options.
        self.arguments.append("./" + path if path.startswith("-") else path)

    def _text(self, value, name):
        if isinstance(value, str):
            return value
        if isinstance(value, PATHS):
            return os.fsdecode(value)
        if hasattr(value, "item") and getattr(value, "ndim", None) == 0:
            value = value.item()
        if isinstance(value, numbers.Number):
            return _number(value)
        if getattr(value, "ndim", None) == 2:
            return self.path(value, name)
        if hasattr(value, "tolist") and not isinstance(value, (Mesh, Grid, Picture)):
            value = value.tolist()
        if isinstance(value, (tuple, list)) and all(
                isinstance(item, (numbers.Number, str)) for item in value):
            # 640x480, but 1,2,3.
            mark = "x" if name == "size" else ","
            return mark.join(item if isinstance(item, str) else _number(item) for item in value)
        return self.path(value, name)

    def add_option(self, name, value):
        key = name.rstrip("_")
        table = options(self.verb)
        if key not in table:
            near = difflib.get_close_matches(key, table, 1)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            raise TypeError(f"{self.verb}() has no option '{name}'{hint}")
        option = table[key]
        if value is None or value is False:
            return
        if option["is_flag"]:
            if value is not True:
                raise TypeError(f"{self.verb}: '{name}' is True or False, not {value!r}")
            self.arguments.append("--" + option["name"])
            return
        if value is True:
            raise TypeError(f"{self.verb}: '{name}' needs a value")
        several = value if option["repeats"] and isinstance(value, list) else [value]
        self.arguments += [f"--{option['name']}={self._text(item, key)}" for item in several]

    def room(self, name, extension, option):
        """An output that stays in memory."""
        file = _nephele._room(name, extension)
        self.files.append((file, name))
        self.arguments.append(f"--{option}={file.path}")
        return file

    def run(self, progress, kept=None):
        try:
            with _callback(progress) as callback:
                return _nephele._call_verb(self.verb, self.arguments, callback, kept)
        except Error as error:
            text = str(error)
            for file, name in self.files:
                text = text.replace(file.path, name)
            if text == str(error):
                raise
            raise type(error)(text) from None


def _content(file, name):
    content = file.content
    if isinstance(content, list) and content and isinstance(content[0], Grid):
        return grids_of(content, name)
    return content


def _made(verb, inputs, extension, named, *, name="output", before=(), session=None):
    """Runs a verb whose main output stays in memory, and returns that; with what else was asked for by True, a
    tuple."""
    progress = named.pop("progress", None)
    output = named.pop("output", None)
    wants_stats = _take_stats(named)
    several = next((name for name in ("frames", "wedge") if named.get(name)), None)
    if several and output is None:
        raise TypeError(f"{verb}: '{several}' makes several files; give output, too")
    call = _Call(verb)
    kept = None
    if session is not None:
        kept = session._kept
        call.files += session._files
    for option, thing, what in before:
        call.arguments.append(f"--{option}={call.path(thing, what)}")
    for thing, what in inputs:
        call.add_input(thing, what)
    output = None if output is None else os.fsdecode(output)
    # Pictures for the screen are made by the verb, which knows how they are to look.
    for_screen = verb == "render" and output is not None and output.lower().endswith(".png")
    preview = named.setdefault("preview", output) if for_screen else None
    others = {}
    for option, value in named.items():
        if value is True and option in _OUTPUTS and option in options(verb):
            if several:
                raise TypeError(f"{verb}: '{several}' makes several files; give a path as '{option}'")
            others[option] = call.room(option, _OUTPUTS[option], option.replace("_", "-"))
        else:
            call.add_option(option, value)
    if several:
        if not for_screen or preview != output:
            call.arguments.append("--output=" + output)
        return call.run(progress, kept)
    if output is not None:
        _nephele._try_output(output)
    main = call.room(name, extension, "output")
    statistics = call.run(progress, kept)
    result = _content(main, name)
    if for_screen and preview != output:
        shutil.copyfile(preview, output)
    elif output is not None and not for_screen:
        write(output, result)
    extras = [_content(file, option) for option, file in others.items()] + ([statistics] if wants_stats else [])
    return (result, *extras) if extras else result


def _listed(thing, name):
    if isinstance(thing, list):
        return [(item, f"{name} {i + 1}") for i, item in enumerate(thing)]
    return [] if thing is None else [(thing, name)]


def levelset(shapes, /, **named):
    return _made("levelset", _listed(shapes, "mesh"), ".vdb", named, name="surface")


def cloud(shape=None, /, **named):
    return _made("cloud", _listed(shape, "shape"), ".vdb", named, name="density")


def advect(what, /, *arguments, **named):
    if isinstance(what, _FIELDS):
        return _nephele._call("advect", (what, *arguments), named)
    if arguments:
        raise TypeError("advect: options of a grid are given by name")
    return _made("advect", [(what, "grid")], ".vdb", named, name="grids")


def wisps(source=None, /, **named):
    return _made("wisps", [] if source is None else [(source, "points")], ".vdb", named, name="density")


def mesh(what, /, **named):
    kind = "volume" if isinstance(what, (Grid, dict)) else "mesh"
    return _made("mesh", [(what, kind)], ".ply", named, name="mesh")


def transform(what, /, **named):
    is_volume = isinstance(what, (Grid, dict)) or (
        isinstance(what, PATHS) and os.fsdecode(what).lower().endswith(("vdb",)))
    return _made("transform", [(what, "input")], ".vdb" if is_volume else ".ply", named, name="moved")


def transfer(reference, object, /, **named):
    return _made("transfer", [], ".ply", named, name="object",
                 before=(("from", reference, "reference"), ("to", object, "object")))


def render(volumes, /, **named):
    return _made("render", _listed(volumes, "volume"), ".exr", named, name="picture")


class Session:
    """Pictures of the same volumes, one after another. `session.render(...)` makes what `render(volumes, ...)` does,
    and for another camera, size or exposure only marches: volumes and light are kept for as long as the session lives.
    Objects are seen as they were when it began; scripts, and paths that are traced, begin anew each time."""

    def __init__(self, volumes, /):
        call = _Call("render")
        self._inputs = [(call.path(thing, name), name) for thing, name in _listed(volumes, "volume")]
        self._files = call.files
        self._kept = _nephele._Kept()

    def render(self, **named):
        """A picture, with the options of `render`."""
        return _made("render", self._inputs, ".exr", named, name="picture", session=self)


def cut(model, /, **named):
    folder = named.pop("output", None)
    if folder is None or named.get("wedge"):
        return _made("cut", [(model, "model")], "", dict(named, output=folder), name="pieces")
    progress = named.pop("progress", None)
    wants_stats = _take_stats(named)
    call = _Call("cut")
    call.add_input(model, "model")
    for option, value in dict(named, output=folder).items():
        call.add_option(option, value)
    statistics = call.run(progress)
    with open(os.path.join(os.fsdecode(folder), "pieces.json"), encoding="utf-8") as file:
        pieces = json.load(file)["pieces"]
    return (pieces, statistics) if wants_stats else pieces


def turntable(volumes, /, *, frames, output=None, progress=None, **named):
    wants_stats = _take_stats(named)
    if output is None:
        with tempfile.TemporaryDirectory() as folder:
            paths, statistics = turntable(volumes, frames=frames, output=os.path.join(folder, "frame.####.exr"),
                                          progress=progress, stats=True, **named)
            pictures = [read(path) for path in paths]
            return (pictures, statistics) if wants_stats else pictures
    if isinstance(frames, numbers.Integral):
        frames = f"1-{operator.index(frames)}"
    call = _Call("turntable")
    for thing, name in _listed(volumes, "volume"):
        call.add_input(thing, name)
    for option, value in dict(named, frames=frames, output=output).items():
        call.add_option(option, value)
    statistics = call.run(progress)
    paths = [_nephele._frame_path(os.fsdecode(output), frame["frame"]) for frame in statistics.get("frames", [])]
    return (paths, statistics) if wants_stats else paths


_TEXTS = {
    "levelset": "Shapes (meshes, level sets, paths, or a list of them) as a signed distance Grid, positive inside.",
    "cloud": "Grows a cloud on a mesh, a level set or, with species=..., a shape of its own; returns its density as a "
             "Grid. surface=True returns the level set, too.",
    "advect": "Carries a Grid, or a dict of them, along with a velocity. Given a field it is the word of Felt: "
              "advect(field, velocity, dt). map=True returns the map, too.",
    "wisps": "Grows wisps of fine dots on guide points, or within shape=...; returns the density as a Grid, or a dict of grids. points=True "
             "returns the dots, too.",
    "mesh": "Turns a level set or a density into a Mesh, or decimates, smooths and subdivides one.",
    "transform": "Moves, turns and scales a mesh or grids, or changes their up axis or unit.",
    "transfer": "Carries texture coordinates and other attributes from the mesh `reference` to the mesh `object`; returns "
                "`object` with them.",
    "render": "A Picture of a Grid, a path, a dict of grids or a list of such: R, G, B, A in .array, the layers of "
              "aov=... in .layers. output=NAME.png writes it for the screen, as preview= does.",
    "cut": "Cuts a model by knives; returns its pieces as dicts with name, code, volume, area, centroid, neighbours and "
           "mesh. With output=FOLDER it writes them and returns what pieces.json lists of each.",
    "turntable": "The frames of a turn around volumes: a list of Pictures, or with output=\"DIR/NAME.####.exr\" the paths "
                 "of the files. frames is a number or 1-48.",
}
_COMMON = """

Options are those of `nephele {verb} --help-all`, with underscores, and nephele.options("{verb}") lists them: numbers,
texts as on the command line ("5%"), tuples for lists of numbers, and objects or paths where files are read. output=PATH
also writes the result; with frames=... or wedge=... there are only files, and the statistics are returned. progress=True shows bars, or a function is called with (stage, fraction). stats=True returns
the statistics, too. Raises Error, and TypeError for options that it does not have."""

for _name, _text in _TEXTS.items():
    globals()[_name].__doc__ = _text + _COMMON.format(verb=_name)
    globals()[_name].__module__ = "nephele"
