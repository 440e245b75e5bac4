"""Scene files of Radiance as triangles by material: `read_radiance`.

Circles become polygons of the same area.  Source of the arguments: "The RADIANCE 5.1 Synthetic
Imaging System", 3.1; of the generators `genbox` and `genprism`: their manual pages.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
import shapely
import trimesh
from numpy.typing import NDArray

from bim.planes import newell_normal, plane_through, triangulated
from bim.radiance.materials import MATERIALS, MIXTURE, PATTERNS, RadianceMaterial, material_of, mixed_material
from bim.radiance.patterns import COMPUTED_PATTERNS, EVEN, pattern_values
from bim.radiance.primitives import VOID, Command, Definition, Primitive, count_of, number_of, read_statements
from bim.radiance.xform import Xform, read_xform
from bim.report.issue import Issue, area_words
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.surfaces import triangle_areas

CIRCLE_SIDES = 32  # of a circle
LARGEST = 1e10  # of a coordinate, in units of the file
SUBDIVISIONS = 2  # of an icosahedron: 320 triangles

INWARD = {"bubble": "sphere", "tube": "cylinder", "cup": "cone"}
ARGUMENTS = {"sphere": 4, "cylinder": 7, "cone": 8, "ring": 8}
KINDS = ("polygon", *ARGUMENTS, *INWARD)


def triangles_of(primitive: Primitive) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of an object, counter-clockwise seen from its front; [0, 3, 3] if flat.

    Raises: `DataError` naming file and line for wrong arguments.
    """
    kind = INWARD.get(primitive.kind, primitive.kind)
    numbers = np.asarray(primitive.numbers)
    if not np.abs(numbers).max(initial=0.0) <= LARGEST:
        raise primitive.fault(f"a coordinate or size is above {LARGEST:g}")
    if kind == "polygon":
        if len(numbers) < 9 or len(numbers) % 3:
            raise primitive.fault(f"expected three numbers of each corner, got {len(numbers)} numbers")
        return polygon_triangles(numbers.reshape(-1, 3))
    if len(numbers) != ARGUMENTS[kind]:
        raise primitive.fault(f"expected {ARGUMENTS[kind]} numbers, got {len(numbers)}")
    if (numbers[6:] < 0).any() or (kind == "sphere" and numbers[3] <= 0):
        raise primitive.fault("a radius is negative")
    triangles = sphere(numbers[:3], numbers[3]) if kind == "sphere" else strip(kind, numbers)
    return triangles[:, ::-1] if primitive.kind in INWARD else triangles


def polygon_triangles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """A plane polygon [n, 3] as triangles, concave or with holes on seams."""
    area = newell_normal(corners)
    if not np.linalg.norm(area) > 0:
        return np.empty((0, 3, 3))
    plane = plane_through(corners[0], area)
    whole = shapely.make_valid(shapely.Polygon(plane.to_plane(corners)[:, :2]))
    parts = [part for part in shapely.get_parts(whole) if part.geom_type == "Polygon"]
    flat = np.concatenate([np.empty((0, 3, 2)), *map(triangulated, parts)])
    return plane.to_world(flat.reshape(-1, 2)).reshape(-1, 3, 3)


def sphere(centre: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """A sphere's triangles, of its area."""
    mesh = trimesh.creation.icosphere(subdivisions=SUBDIVISIONS)
    return mesh.triangles * (radius * np.sqrt(4 * np.pi / mesh.area)) + centre


def strip(kind: str, numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """The strip between two circles; the front is outside, of a ring where its normal points."""
    if kind == "ring":
        start = end = numbers[:3]
        axis, radii = numbers[3:6], numbers[6:8][::-1]
    else:
        start, end = numbers[:3], numbers[3:6]
        axis, radii = end - start, (numbers[6], numbers[7] if kind == "cone" else numbers[6])
    if not np.linalg.norm(axis) > 0:
        return np.empty((0, 3, 3))
    u, v, _ = plane_through(start, axis).axes
    angles = np.linspace(0.0, 2 * np.pi, CIRCLE_SIDES + 1)
    size = np.sqrt((2 * np.pi / CIRCLE_SIDES) / np.sin(2 * np.pi / CIRCLE_SIDES))
    round_ = size * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
    low, high = start + radii[0] * round_, end + radii[1] * round_
    first = np.stack([low[:-1], low[1:], high[1:]], axis=1)
    second = np.stack([low[:-1], high[1:], high[:-1]], axis=1)
    both = np.concatenate([first, second])
    areas = np.linalg.norm(np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0]), axis=1)
    return both[areas > 0]


Polygon = tuple[str, NDArray[np.float64]]  # name, corners [n, 3]

# corners of a unit box's sides, counter-clockwise seen from outside
SIDES = {
    "x0": ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)),
    "x1": ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)),
    "y0": ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)),
    "y1": ((0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)),
    "z0": ((0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)),
    "z1": ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
}


def genbox(words: tuple[str, ...]) -> tuple[str, list[Polygon]]:
    """Material and sides of `genbox material name x y z [-i]`.

    Raises: `ValueError` for rounded or bevelled boxes, or wrong numbers.
    """
    if len(words) < 6:
        raise ValueError("takes a material, a name and three sizes")
    material, name, *rest = words[1:]
    size = _numbers(rest[:3])
    if set(rest[3:]) - {"-i"}:
        raise ValueError(f"option {next(w for w in rest[3:] if w != '-i')} is not read")
    turn = -1 if "-i" in rest[3:] else 1
    return material, [(f"{name}.{side}", np.array(corners, float)[::turn] * size) for side, corners in SIDES.items()]


def genprism(words: tuple[str, ...]) -> tuple[str, list[Polygon]]:
    """Material and sides of `genprism material name N x1 y1 .. xN yN [-l x y z] [-c] [-e]`.

    Raises: `ValueError` for rounded prisms, outlines from files, or wrong numbers.
    """
    if len(words) < 4:
        raise ValueError("takes a material, a name, the number of corners and their x and y")
    material, name, count = words[1], words[2], count_of(words[3])
    outline = _numbers(words[4 : 4 + 2 * count])
    if count < 3 or len(outline) < 2 * count:
        raise ValueError(f"expected the x and y of {words[3]} corners, at least three")
    ring = np.column_stack([outline.reshape(-1, 2), np.zeros(count)])
    along, is_open, has_ends, rest = (np.array([0.0, 0.0, 1.0]), False, True, list(words[4 + 2 * count :]))
    while rest:
        option = rest.pop(0)
        if option == "-l":
            along, rest = _numbers(rest[:3]), rest[3:]
            if len(along) < 3:
                raise ValueError("-l takes three numbers")
        elif option in ("-c", "-e"):
            is_open, has_ends = is_open or option == "-c", has_ends and option != "-e"
        else:
            raise ValueError(f"option {option} is not read")
    sides = [
        (f"{name}.{i + 1}", np.array([ring[i], ring[i] + along, ring[j] + along, ring[j]]))
        for i, j in ((i, (i + 1) % count) for i in range(count - is_open))
    ]
    ends = [(f"{name}.b", ring), (f"{name}.t", (ring + along)[::-1])] if has_ends else []
    return material, ends + sides


GENERATORS = {"genbox": genbox, "genprism": genprism}


def _numbers(words: tuple[str, ...] | list[str]) -> NDArray[np.float64]:
    return np.array([number_of(word) for word in words])


DEEPEST = 32  # files that call each other
MOST_OBJECTS = 5_000_000
FARTHEST = 1e7  # of a coordinate [m]
BEHIND = 5e-4  # from the front of a mirror to its back [m]
INHERITED = "inherit"  # modifier of an alias that keeps the material's own
PLAIN = RadianceMaterial("void", VOID)


@dataclass(frozen=True, slots=True)
class RadianceObject:
    """One surface with its material."""

    name: str
    material: RadianceMaterial
    modifiers: tuple[str, ...]  # names from the surface to its material
    triangles: NDArray[np.float64]  # [T, 3, 3] [m], counter-clockwise seen from the front
    primitive: Primitive
    definitions: tuple[Definition, ...] = ()  # patterns and, last, the material
    parts: tuple[RadianceObject, ...] = ()  # of a mixture: of the foreground and background alone

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normal [3] of the front."""
        return normal_of(self.triangles)


@dataclass(frozen=True, slots=True)
class RadianceScene:
    """Surfaces of scene files, and which parts of the files are not used."""

    objects: tuple[RadianceObject, ...]
    files: tuple[Path, ...]  # all that were read
    issues: tuple[Issue, ...]

    def of_modifiers(self, names: Iterable[str]) -> list[RadianceObject]:
        """The surfaces that one of these materials or modifiers colours.

        Raises: `DataError` for a name that no surface has.
        """
        wanted = list(dict.fromkeys(names))
        known = {modifier for thing in self.objects for modifier in thing.modifiers}
        for name in wanted:
            if name not in known:
                there = ", ".join(sorted(known)[:12])
                raise DataError(f"no surface has it; there are {there}", file=self.files[0], element=name)
        return [thing for thing in self.objects if set(thing.modifiers) & set(wanted)]


def read_radiance(
    *files: str | PathLike[str], scale: float = 1.0, root: str | PathLike[str] | None = None
) -> RadianceScene:
    """The surfaces of Radiance scene files, read one after the other as `oconv` does.

    Read are polygon, sphere, bubble, cylinder, tube, cone, cup, ring, alias, all materials, and
    the commands `xform`, `genbox` and `genprism`; the scene's `issues` name what else there is.
    Paths in commands hold from the working directory of the files: their own folder, or `root`.

    Args:
        scale: metres in a unit of length of the files.
        root: folder that no file may lie outside of, and that paths start from.

    Raises: `DataError` with file and line for what is no scene, for files that call each other in
        a circle or lie outside the folder, and for other commands.
    """
    if not files:
        raise DataError("no scene file is given", field="files")
    paths = [Path(file) for file in files]
    reader = _Reader(Path(root) if root is not None else None, scale)
    whole = Xform((np.diag([scale, scale, scale, 1.0]),), ())
    for path in paths:
        reader.read(path, (whole,), ())
    return RadianceScene(tuple(reader.objects), tuple(reader.files), tuple(reader.issues()))


@dataclass(frozen=True, slots=True)
class _Modifier:
    """Material, names and definitions of a surface's modifier; of a mixture those of both."""

    material: RadianceMaterial
    names: tuple[str, ...]
    definitions: tuple[Definition, ...]
    parts: tuple[_Modifier, ...] = ()


class _Reader:
    """State of one reading: the definitions so far, as later files use those of earlier ones."""

    def __init__(self, root: Path | None, scale: float) -> None:
        if not 0 < scale < np.inf:
            raise DataError(f"must be positive, got {scale}", field="scale")
        self.root = root
        self.defined: dict[str, Definition] = {}
        self.objects: list[RadianceObject] = []
        self.files: list[Path] = []
        self.left_out: Counter[tuple[str, str]] = Counter()  # by code and type
        self.areas: Counter[tuple[str, str]] = Counter()  # [m2] of surfaces that are left out
        self.first: dict[tuple[str, str], Primitive] = {}

    def read(self, path: Path, outer: tuple[Xform, ...], above: tuple[Path, ...]) -> None:
        """Add what a file holds, in the places that the `xform`s around it give."""
        if path.resolve() in above:
            raise DataError(f"{path.name} calls itself", file=above[-1])
        if len(above) >= DEEPEST:
            raise DataError(f"more than {DEEPEST} files call each other", file=path)
        if path not in self.files:
            self.files.append(path)
        for statement in read_statements(path):
            if isinstance(statement, Command):
                self._run(statement, outer, (*above, path.resolve()))
            else:
                self._take(statement, outer)

    def _run(self, command: Command, outer: tuple[Xform, ...], above: tuple[Path, ...]) -> None:
        first, *rest = command.programs
        made: list[Primitive] = []
        try:
            moves = [read_xform(program) for program in reversed(rest) if _is_xform(program)]
            if len(moves) < len(rest):
                other = next(program for program in rest if not _is_xform(program))
                raise ValueError(f"{other[0]} is not run; give its output")
            if first[0] in GENERATORS:
                made = _primitives(command, *GENERATORS[first[0]](first))
            elif _is_xform(first):
                moves.append(read_xform(first))
            else:
                raise ValueError("is not run; give its output in its place")
        except ValueError as error:
            raise command.fault(str(error)) from None
        for primitive in made:
            self._take(primitive, (*outer, *moves))
        if _is_xform(first):
            if not moves[-1].files:
                raise command.fault("names no file")
            for name in moves[-1].files:
                self.read(self._inside(name, command), (*outer, *moves), above)

    def _inside(self, name: str, command: Command) -> Path:
        root = command.file.parent if self.root is None else self.root
        if os.path.isabs(name):
            raise command.fault(f"{name}: an absolute path; files are read from the scene's folder")
        path = root / name
        if not path.resolve().is_relative_to(root.resolve()):
            raise command.fault(f"{name}: lies outside the scene's folder")
        return path

    def _take(self, primitive: Primitive, outer: tuple[Xform, ...]) -> None:
        kind = primitive.kind
        if kind in KINDS:
            self._add(primitive, outer)
        elif kind in ("alias", MIXTURE) or kind in MATERIALS or kind in PATTERNS:
            self.defined[primitive.name] = Definition(primitive, _places(outer)[0])
        else:
            if kind not in ("source", "instance", "mesh"):
                # a mixture, a prism ...
                self.defined[primitive.name] = Definition(primitive, _places(outer)[0])
            self._leave_out("primitives-not-read", primitive, kind)

    def _add(self, primitive: Primitive, outer: tuple[Xform, ...]) -> None:
        modifier = next((x.modifier for x in outer if x.modifier is not None), primitive.modifier)
        triangles = triangles_of(primitive)
        if not len(triangles):
            self._leave_out("surfaces-without-area", primitive)
            return
        copies = [triangles @ place[:3, :3].T + place[:3, 3] for place in _places(outer)]
        area = sum(float(triangle_areas(copy).sum()) for copy in copies)
        known = self._material(modifier, primitive, area)
        if known is None:
            return
        is_inverted = sum(x.is_inverted for x in outer) % 2 == 1
        for place, moved in zip(_places(outer), copies, strict=True):
            if not np.abs(moved).max() <= FARTHEST:
                raise primitive.fault(f"lies farther than {FARTHEST:g} m from the origin")
            if (np.linalg.det(place[:3, :3]) < 0) != is_inverted:
                moved = moved[:, ::-1]
            if len(self.objects) >= MOST_OBJECTS:
                raise primitive.fault(f"more than {MOST_OBJECTS} surfaces")
            thing = self._object(_name(primitive, outer), known, moved, primitive)
            if thing is None:
                return
            self.objects.append(thing)
            if thing.material.kind == "mirror":  # black behind, as in Radiance
                dark = replace(thing.material, gloss=None)
                self.objects.append(replace(thing, material=dark, triangles=_behind(moved)))

    def _object(
        self, name: str, known: _Modifier, triangles: NDArray[np.float64], surface: Primitive
    ) -> RadianceObject | None:
        """A surface of a material; None for a mixture of parts or functions that are not read."""
        parts = []
        for part in known.parts:
            thing = self._object(name, part, triangles, surface)
            if thing is None:
                return None
            parts.append(thing)
        material = self._with_patterns(known.material, known.definitions, triangles)
        if parts:
            mixture = known.definitions[-1]
            try:
                values = pattern_values(triangles, normal_of(triangles), [mixture], np.zeros(1))
            except DataError:
                area = float(triangle_areas(triangles).sum())
                self._leave_out("surfaces-not-read", surface, MIXTURE, area)
                return None
            share = float(np.clip(values, 0.0, 1.0).mean())
            material = mixed_material(material.name, share, *(part.material for part in parts))
            if not material.is_translucent and np.ptp(values) > EVEN:
                self._leave_out("material-mixture-averaged", mixture.primitive)
        return RadianceObject(name, material, known.names, triangles, surface, known.definitions, tuple(parts))

    def _material(self, modifier: str, surface: Primitive, area: float) -> _Modifier | None:
        """The material of a surface of that area [m2]; None where none is read."""
        names: list[str] = []
        patterns: list[Definition] = []
        above: Primitive | None = None  # the outermost alias
        while modifier != VOID:
            known = self.defined.get(modifier)
            if known is None:
                raise surface.fault(f"its modifier {modifier} is not defined before it")
            definition = known.primitive
            if modifier in names:
                raise surface.fault(f"its modifier {modifier} modifies itself")
            names.append(modifier)
            if definition.kind == "alias":
                above = above or definition
                modifier = definition.strings[0]
            elif definition.kind == "illum":  # what it replaces is there instead
                self._leave_out("illum-replaced", surface)
                modifier = definition.strings[0] if definition.strings else VOID
                if modifier == VOID:
                    return None
            elif definition.kind in MATERIALS:
                # an alias has the patterns that it names, or inherits those of the material
                is_alias = above is not None and above.modifier != INHERITED
                patterns += self._patterns(above if is_alias else definition, surface)
                material = replace(material_of(definition), name=definition.name)
                return _Modifier(material, tuple(names), (*patterns, known))
            elif definition.kind == MIXTURE:
                return self._mixture(known, tuple(names), tuple(patterns), surface, area)
            elif definition.kind in PATTERNS:
                patterns.append(known)
                modifier = definition.modifier
            else:
                self._leave_out("surfaces-not-read", surface, definition.kind, area)
                return None
        self._leave_out("surfaces-without-material", surface, area=area)
        return None

    def _mixture(
        self,
        mixture: Definition,
        names: tuple[str, ...],
        patterns: tuple[Definition, ...],
        surface: Primitive,
        area: float,
    ) -> _Modifier | None:
        """A mixture of two modifiers; None where one of them is not read."""
        parts = []
        for name in mixture.primitive.strings[:2]:
            if name in names:
                raise surface.fault(f"its modifier {name} modifies itself")
            part = _Modifier(PLAIN, (), ())
            if name != VOID:
                known = self._material(name, surface, area)
                if known is None:
                    return None
                part = replace(known, definitions=(*patterns, *known.definitions))
            parts.append(part)
        if len(parts) < 2:
            raise mixture.primitive.fault("names no two modifiers")
        material = RadianceMaterial(mixture.primitive.name, MIXTURE)
        return _Modifier(material, names, (mixture,), tuple(parts))

    def _with_patterns(
        self, material: RadianceMaterial, definitions: Sequence[Definition], triangles: NDArray[np.float64]
    ) -> RadianceMaterial:
        """An opaque material with the mean of its patterns over a surface."""
        patterns = definitions[:-1]
        if not patterns or not material.is_opaque:
            return material
        first = next((one.primitive for one in patterns if one.primitive.kind not in COMPUTED_PATTERNS), None)
        patterns = [one for one in patterns if one.primitive.kind in COMPUTED_PATTERNS]
        if first is not None:
            self._leave_out("material-patterns-left-out", first, first.kind)
        if not patterns or material.diffuse == 0:
            return material
        try:
            values = pattern_values(triangles, normal_of(triangles), patterns, np.zeros(1))
            mean = float(values.mean())
        except DataError:
            self._leave_out("material-patterns-left-out", patterns[0].primitive)
            return material
        if np.ptp(values) > EVEN:
            self._leave_out("material-pattern-averaged", patterns[0].primitive)
        shine = 0.0 if material.gloss is None else material.gloss.at_normal
        return replace(material, diffuse=min(material.diffuse * mean, 1.0 - shine))

    def _patterns(self, material: Primitive, surface: Primitive) -> list[Definition]:
        """The patterns and textures of a material."""
        patterns: list[Definition] = []
        modifier = material.modifier
        while modifier != VOID:
            known = self.defined.get(modifier)
            if known is None or any(one is known for one in patterns):
                raise surface.fault(f"modifier {modifier} of {material.name} is not defined before it")
            if known.primitive.kind == "alias":
                modifier = known.primitive.strings[0]
                continue
            patterns.append(known)
            modifier = known.primitive.modifier
        return patterns

    def _leave_out(self, code: str, primitive: Primitive, kind: str = "", area: float = 0.0) -> None:
        self.left_out[code, kind] += 1
        self.areas[code, kind] += area
        self.first.setdefault((code, kind), primitive)

    def issues(self) -> Iterator[Issue]:
        """Parts of the files that are not used, each kind once."""
        for (code, kind), count in self.left_out.items():
            if code == "primitives-not-read" and ("surfaces-not-read", kind) in self.left_out:
                continue  # the definitions of surfaces that are reported
            first, area = self.first[code, kind], area_words(self.areas[code, kind])
            values = {"count": count, "type": kind, "first": first.name, "area": area}
            yield Issue(code, f"{first.file}:{first.line}", values)


def normal_of(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normal [3] of triangles [T, 3, 3]: of their area vector."""
    area = np.cross(*np.diff(triangles, axis=1).transpose(1, 0, 2)).sum(axis=0)
    return area / np.linalg.norm(area)


def _is_xform(program: Sequence[str]) -> bool:
    return program[0] == "xform"


def _places(outer: tuple[Xform, ...]) -> list[NDArray[np.float64]]:
    """Every place of an object inside the given `xform`s, the outermost first."""
    places = [np.eye(4)]
    for xform in outer:
        places = [place @ copy for place in places for copy in xform.copies]
    return places


def _behind(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """The back of a sheet [T, 3, 3], seen from behind."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return (triangles - BEHIND * normals[:, None])[:, ::-1]


def _name(primitive: Primitive, outer: tuple[Xform, ...]) -> str:
    return ".".join([*(x.prefix for x in outer if x.prefix), primitive.name])


def _primitives(command: Command, material: str, polygons: list[Polygon]) -> list[Primitive]:
    return [
        Primitive(material, "polygon", name, (), tuple(corners.ravel().tolist()), command.file, command.line)
        for name, corners in polygons
    ]
