"""What IFC styles, corrections, boxes and exports say of surfaces that reflect like a mirror."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from bim.colours import GREY
from bim.defaults import CLEAR_GLAZING
from bim.gloss_materials import gltf_factors, mitsuba_bsdf
from bim.ifc.building import read_ifc
from bim.ifc.corrections import read_corrections
from bim.model import COLOURS, Element
from bim.outdoors import mirrors_in_view
from bim.shoebox import shoebox
from bim.solids import triangles_of
from bim.to_gltf import write_gltf
from bim.to_mitsuba import write_mitsuba
from bim.to_radiance import write_radiance
from bim.to_tracer import exterior_surfaces, interior_surfaces
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.gloss import dielectric, lacquer, mirror, pane
from tests.bim.small_ifc import SmallIfc, box_room
from tests.issues import of_code


def building_with(tmp_path, style: str = "wall", **entries):
    """The small room's building, its style with these entries."""
    model = box_room(doubled_wall=True)
    shading = next(s for s in model.by_type("IfcSurfaceStyle") if s.Name == style).Styles[0]
    for name, value in entries.items():
        if isinstance(value, tuple):
            value = model.create_entity(*value)
        setattr(shading, name, value)
    path = tmp_path / "model.ifc"
    model.write(str(path))
    return read_ifc(path)


def wall_of(building):
    return next(face for face in building.spaces[0].faces if face.kind == "wall")


def element_of(building, name: str):
    return next(e for e in building.elements if e.name == name)


def test_a_method_for_the_screen_is_no_gloss(tmp_path):
    for method in ("MATT", "PHONG", "NOTDEFINED"):
        highlight = ("IfcSpecularExponent", 64.0)
        found = building_with(tmp_path, ReflectanceMethod=method, SpecularHighlight=highlight)
        assert wall_of(found).gloss is None
        assert interior_surfaces(found.spaces[0]).gloss == ()


def test_metal_is_all_gloss_of_the_roughness_stated(tmp_path):
    rough = ("IfcSpecularRoughness", 0.15)
    found = building_with(tmp_path, ReflectanceMethod="METAL", SpecularHighlight=rough)
    plain = wall_of(building_with(tmp_path))
    wall, outdoors = wall_of(found), element_of(found, "south again")
    assert wall.gloss == outdoors.gloss == mirror(plain.reflectance_visible, 0.15)
    assert wall.reflectance_visible == wall.reflectance_solar == 0.0
    surfaces = exterior_surfaces(found, found.spaces[0])
    assert surfaces.gloss[surfaces.names.index("south again")] == wall.gloss


def test_an_exponent_is_a_roughness(tmp_path):
    """cos^n about the mirror's direction: at n = 50 as alpha = 0.1."""
    highlight = ("IfcSpecularExponent", 50.0)
    found = building_with(tmp_path, ReflectanceMethod="PLASTIC", SpecularHighlight=highlight)
    gloss = wall_of(found).gloss
    assert gloss is not None and gloss.roughness == pytest.approx(0.1)
    angle = np.radians(4.0)  # of the mirror's direction, twice that of the facet
    assert np.cos(angle) ** 50 == pytest.approx(np.exp(-((np.tan(angle / 2) / 0.1) ** 2)), rel=2e-3)
    plain = wall_of(building_with(tmp_path)).reflectance_visible
    assert wall_of(found).reflectance_visible == pytest.approx(plain * (1 - gloss.at_normal))
    assert gloss.specular == dielectric(1.52).specular


def test_glass_that_says_so_mirrors_the_outdoors(tmp_path):
    found = building_with(tmp_path, "glass", ReflectanceMethod="GLASS")
    window = next(e for e in found.elements if e.gloss is not None)
    assert window.gloss == pane() and window.reflectance_visible == 0.0
    plain = building_with(tmp_path, "glass")
    assert all(e.gloss is None for e in plain.elements)


def pane_before_the_window(low, size) -> Element:
    """A pane whose style says nothing, as the outdoors are read."""
    body = Manifold.cube(size).translate(low)
    body = triangles_of(body)[0]
    return Element("pane", "pane", "IfcPlate", body, 0.0, 0.0, gloss=CLEAR_GLAZING)


def test_panes_that_a_window_sees_mirror_as_clear_glazing():
    """The face opposite the window; edges, the far face and the window's own facade do not."""
    (window,) = shoebox().spaces[0].windows  # faces south from y = 0
    opposite = pane_before_the_window((0, -12.02, 0), (4, 0.02, 3))
    beside = pane_before_the_window((5, -0.05, 0), (2, 0.02, 3))
    behind = pane_before_the_window((0, 9, 0), (2, 0.02, 3))
    parts, issues = mirrors_in_view([opposite, beside, behind], [window])
    bright = [part for part in parts if part.gloss is not None]
    assert [part.triangles[..., 1].mean() for part in bright] == [pytest.approx(-12.0)]
    assert bright[0].gloss is CLEAR_GLAZING and bright[0].reflectance_visible == 0.0
    assert sum(len(part.triangles) for part in parts) == 3 * len(opposite.triangles)
    assert {part.reflectance_visible for part in parts if part.gloss is None} == {0.15}
    (issue,) = issues
    assert (issue.code, issue.values) == ("panes-assumed-mirroring", {"count": 1, "element": "pane"})


def test_clear_glazing_mirrors_as_two_panes():
    """Two panes of 1.52 without absorption: rho = 4 r / (1 + 3 r), r of one surface."""
    r = (0.52 / 2.52) ** 2
    two = pane(1.52, 1.0, panes=2).at_normal
    assert two == pytest.approx(4 * r / (1 + 3 * r), rel=1e-6)
    assert CLEAR_GLAZING.at_normal == pytest.approx(0.15, abs=0.005)
    assert CLEAR_GLAZING.reflectance(0.0) == pytest.approx(1.0)


def test_the_outdoors_of_a_file_mirror_by_default(tmp_path):
    """A glass pane 10 m before the window of a file that says nothing of its gloss."""
    model = box_room()
    (body,) = model.by_type("IfcGeometricRepresentationSubContext")
    small = SmallIfc(model, body, model.by_type("IfcBuildingStorey")[0], 1.0)
    glass = small.style("sheer", 0.9, 0.8)
    small.box("IfcPlate", "opposite", (0.0, -10.0, 0.0), (4.0, 0.02, 3.0), glass)
    path = tmp_path / "street.ifc"
    model.write(str(path))
    found = read_ifc(path)
    panes = [e for e in found.elements if e.name == "opposite" and e.gloss is not None]
    assert panes and all(e.gloss is CLEAR_GLAZING for e in panes)
    assert of_code(found, "panes-assumed-mirroring")


def test_corrections_give_a_gloss(tmp_path):
    path = tmp_path / "model.ifc"
    box_room(doubled_wall=True).write(str(path))
    corrections = tmp_path / "model.corrections.toml"
    entry = "[[reflectance]]\nselect = 'IfcSlab, Name=\"floor\"'\nvisible = 0.2\nspecular = 0.05\n"
    corrections.write_text(entry)
    floor = next(f for f in read_ifc(path).spaces[0].faces if f.kind == "floor")
    assert (floor.reflectance_visible, floor.gloss) == (0.2, lacquer(0.05))
    for wrong, field in (("specular = 0.9", "specular"), ("roughness = 0.8", "roughness")):
        key = wrong.split()[0]
        lines = [line for line in entry.splitlines() if not line.startswith(key)]
        corrections.write_text("\n".join([*lines, wrong]))
        with pytest.raises(DataError, match=field):
            read_corrections(corrections)


def test_a_box_has_the_gloss_of_its_parts():
    room = shoebox(reflectance={"floor": 0.2}, gloss={"floor": lacquer(0.05), "wall": mirror(0.1)})
    gloss = {face.kind: face.gloss for face in room.spaces[0].faces}
    assert gloss["floor"] == lacquer(0.05) and gloss["wall"] == mirror(0.1)
    assert gloss["ceiling"] is None
    with pytest.raises(ValueError, match="reflects more than it gets"):
        shoebox(reflectance={"floor": 0.5}, gloss={"floor": mirror(0.6)})


def test_a_study_box_says_specular_and_roughness():
    from scenes.heat.box import box_building
    from scenes.heat.study_file import BoxTable

    table = {
        "width": 4,
        "depth": 5,
        "height": 3,
        "window": (),
        "specular": {"floor": 0.05},
        "roughness": {"floor": 0.02},
    }
    floor = next(f for f in box_building(BoxTable(**table)).spaces[0].faces if f.kind == "floor")
    assert floor.gloss == lacquer(0.05, 0.02)
    with pytest.raises(DataError, match=r"box\.roughness\.wall: has no `specular` beside it"):
        box_building(BoxTable(**table | {"roughness": {"wall": 0.1}}))


def test_radiance_gets_the_gloss(tmp_path):
    building = shoebox(reflectance={"floor": 0.2}, gloss={"floor": lacquer(0.05, 0.1)})
    files = write_radiance(building.spaces[0], building, tmp_path)
    text = files.materials.read_text()
    colour = 0.2 / 0.95
    assert f"5 {colour:.6g} {colour:.6g} {colour:.6g} 0.05 0.1" in text
    assert text.count("void plastic") == len(set(text.split("void plastic ")[1:]))
    assert "_gloss_" in files.room.read_text()


@pytest.mark.usefixtures("variant")
@pytest.mark.parametrize(
    "diffuse, gloss",
    [
        (0.5, None),
        (0.0, mirror(0.8)),
        (0.0, mirror(0.6, 0.15)),
        (0.3, mirror(0.4, 0.1)),
        (0.3, lacquer(0.05)),
        (0.3, dielectric(1.5, 0.1)),
        (0.0, pane()),
    ],
)
def test_mitsuba_reflects_as_much_at_normal_incidence_by_either_part(diffuse, gloss):
    import mitsuba as mi

    found = mitsuba_bsdf(diffuse, gloss)
    found.set("version", "3.0.0")
    bsdf = mi.load_string(ElementTree.tostring(found, encoding="unicode"))
    count = 200_000
    u = np.random.default_rng(1).random((3, count)).astype(np.float32)
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(0, 0, 1)
    si.sh_frame, si.n = mi.Frame3f(mi.Normal3f(0, 0, 1)), mi.Normal3f(0, 0, 1)
    drawn, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    weight = np.broadcast_to(np.array(weight).reshape(-1, np.array(weight).shape[-1])[0], count)
    diffuse_flag = int(mi.BSDFFlags.DiffuseReflection)
    dull = (np.array(drawn.sampled_type) & diffuse_flag) > 0
    specular = 0.0 if gloss is None else gloss.at_normal
    # 5 sigma of the drawn parts; a lobe of slopes 0.15 loses a hundredth to shadowed facets, and
    # of what comes out of a body with a rough coat Mitsuba's `roughplastic` loses 3 to 4 %
    noise = 5 * weight.std() / np.sqrt(count) + 1e-4
    lost = 0.02 * specular + (0.04 * diffuse if gloss == dielectric(1.5, 0.1) else 0.0)
    assert weight.mean() == pytest.approx(diffuse + specular, abs=noise + lost)
    if gloss is None or gloss.roughness == 0:
        assert np.where(dull, weight, 0).mean() == pytest.approx(diffuse, abs=2 * noise + 1e-3)


def test_the_export_to_mitsuba_has_what_is_glossy(tmp_path):
    rough = ("IfcSpecularRoughness", 0.15)
    found = building_with(tmp_path, ReflectanceMethod="METAL", SpecularHighlight=rough)
    scene = ElementTree.parse(write_mitsuba(found.spaces[0], found, tmp_path / "scene"))
    shapes = scene.getroot().findall("shape")
    metal = {s.get("id"): s.find("bsdf/bsdf[@type='roughconductor']") for s in shapes}
    glossy = {name for name, bsdf in metal.items() if bsdf is not None}
    assert {name.split("_0.")[0] for name in glossy} >= {"room_wall", "outdoors"}
    assert not any("floor" in name for name in glossy)
    assert metal[glossy.pop()].find("float[@name='alpha']").get("value") == "0.15"


def test_gltf_is_metal_and_smooth_as_the_gloss_says(tmp_path):
    assert gltf_factors(0.5, None) == (0.0, 1.0)
    assert gltf_factors(0.0, mirror(0.6, 0.09)) == (1.0, pytest.approx(0.3))
    assert gltf_factors(0.5, lacquer(0.03, 0.04))[0] == 0.0  # no more than any dielectric
    for diffuse, specular in ((0.3, 0.4), (0.5, 0.1)):
        metal, _ = gltf_factors(diffuse, mirror(specular, 0.1))
        base = diffuse / (1 - metal)
        assert 0.04 * (1 - metal) + base * metal == pytest.approx(specular)
    rough = ("IfcSpecularRoughness", 0.09)
    found = building_with(tmp_path, ReflectanceMethod="METAL", SpecularHighlight=rough)
    write_gltf(found, tmp_path / "x.glb")
    scene = trimesh.load(tmp_path / "x.glb")
    walls = [g for name, g in scene.geometry.items() if "R1 Room wall" in name]
    materials = [wall.visual.material for wall in walls]
    assert [(m.metallicFactor, m.roughnessFactor) for m in materials] == [(1.0, pytest.approx(0.3))]


def test_a_styles_colour_is_its_reflectance_in_three_bands(tmp_path):
    """What a screen shows as (0.8, 0.4, 0.2) is these values' linear light (IEC 61966-2-1)."""
    shown, whole = ("IfcColourRgb", None, 0.8, 0.4, 0.2), ("IfcNormalisedRatioMeasure", 1.0)
    found = building_with(tmp_path, SurfaceColour=shown, DiffuseColour=whole)
    linear = np.array([0.603827, 0.132868, 0.033105])
    wall, outdoors = wall_of(found), element_of(found, "south again")
    for surface in (wall, outdoors):
        bands = [surface.reflectance(band) for band in COLOURS]
        assert bands == pytest.approx(linear, rel=1e-4)
        assert np.dot(bands, (0.2126, 0.7152, 0.0722)) == pytest.approx(surface.reflectance_visible)
    faces = interior_surfaces(found.spaces[0], "red").reflectance
    assert np.isclose(faces, linear[0], rtol=1e-4).any()
    bright = replace(wall, reflectance_visible=0.5, gloss=dielectric(1.5, 0.1))
    assert bright.reflectance("red") == 1 - bright.gloss.at_normal, "no more than it gets"
    assert [f.hue for f in shoebox().spaces[0].faces if f.hue != GREY] == []
