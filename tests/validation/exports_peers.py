"""What honeybee and OpenStudio read of an export, as JSON; run by a Python that has them.

    python exports_peers.py MODEL.hbjson MODEL.xml FOLDER

Into FOLDER go honeybee's Radiance folder and its EnergyPlus input.  Needs honeybee-energy,
honeybee-radiance, honeybee-openstudio and openstudio, and nothing of this project.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any


def honeybee(path: Path, folder: Path) -> dict[str, Any]:
    """Faults that honeybee finds in a model, and its glazing."""
    import honeybee_energy  # noqa: F401  (extends the model)
    import honeybee_radiance  # noqa: F401
    import openstudio
    from honeybee.model import Model
    from honeybee_openstudio.writer import model_to_openstudio

    model = Model.from_hbjson(str(path))
    faults = model.check_all(raise_exception=False, detailed=True)
    model.to.rad_folder(model, str(folder / "radiance"))
    workspace = openstudio.energyplus.ForwardTranslator().translateModel(model_to_openstudio(model))
    workspace.save(openstudio.toPath(str(folder / "honeybee.idf")), True)
    panes = []
    for aperture in model.apertures:
        (material,) = aperture.properties.energy.construction.materials
        modifier = aperture.properties.radiance.modifier.to_dict()
        values = [getattr(material, field, None) for field in ("u_factor", "shgc", "vt")]
        panes.append([aperture.display_name, aperture.area, *values, modifier.get("bsdf_data")])
    return {"faults": [fault["message"] for fault in faults], "panes": panes, "rooms": len(model.rooms)}


def gbxml(path: Path) -> dict[str, Any]:
    """Errors against the schema that OpenStudio holds, and the glazing that OpenStudio reads."""
    import openstudio

    validator = openstudio.XMLValidator.gbxmlValidator()
    validator.validate(openstudio.toPath(str(path)))
    errors = [error.logMessage() for error in validator.errors()]
    model = openstudio.gbxml.GbXMLReverseTranslator().loadModel(openstudio.toPath(str(path)))
    if not model.is_initialized():
        return {"faults": errors, "panes": [], "rooms": 0}
    model = model.get()
    panes = []
    for surface in model.getSubSurfaces():
        values = [None, None, None]
        construction = surface.construction()
        if construction.is_initialized():
            layered = construction.get().to_LayeredConstruction().get()
            layers = list(layered.layers())
            simple = layers[0].to_SimpleGlazing() if layers else None
            if simple is not None and simple.is_initialized():
                glass = simple.get()
                visible = glass.visibleTransmittance()
                values = [
                    glass.uFactor(),
                    glass.solarHeatGainCoefficient(),
                    visible.get() if visible.is_initialized() else None,
                ]
        panes.append([surface.nameString(), surface.grossArea(), *values, None])
    return {"faults": errors, "panes": panes, "rooms": len(model.getSpaces())}


if __name__ == "__main__":
    model, xml, folder = map(Path, sys.argv[1:])
    result = {"honeybee": honeybee(model, folder), "gbXML": gbxml(xml)}
    (folder / "peers.json").write_text(json.dumps(result))
