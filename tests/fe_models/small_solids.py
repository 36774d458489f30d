"""Small CAD files, made by gmsh's OpenCASCADE kernel: a plate with a bore, two blocks, a ball and the like."""

import re
from contextlib import contextmanager

import numpy as np

from fe_models.files.cad.gmsh_model import gmsh_call, gmsh_model

__all__ = ["PLATE", "drawn", "iges_unit", "in_unit", "painted", "plate_file"]

PLATE = {"size": (100.0, 40.0, 10.0), "bore": 6.0, "at": (20.0, 20.0)}  #: mm; the bore runs along z
PLATE_VOLUME = 100.0 * 40.0 * 10.0 - np.pi * 36.0 * 10.0
MM = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"


@contextmanager
def drawn(path):
    """Yield gmsh's OpenCASCADE kernel; what is drawn with it is written to the file at the end."""
    with gmsh_model("drawn", {"Geometry.OCCTargetUnit": "MM"}) as gmsh:
        yield gmsh.model.occ
        gmsh.model.occ.synchronize()
        with gmsh_call("drawing", advice="mend the test"):
            gmsh.write(str(path))


def plate_file(path):
    """Write the plate with its bore as STEP, IGES or BREP; return the path."""
    with drawn(path) as occ:
        box = occ.addBox(0, 0, 0, *PLATE["size"])
        tool = occ.addCylinder(*PLATE["at"], -5, 0, 0, 20, PLATE["bore"])
        occ.cut([(3, box)], [(3, tool)])
    return path


def in_unit(path, unit):
    """Change the length unit of a STEP file in millimetres, numbers left as they are; return the path."""
    text = path.read_text()
    assert text.count(MM) == 1
    if unit == "inch":
        text = text.replace(MM, "( CONVERSION_BASED_UNIT('INCH',#90001) LENGTH_UNIT() NAMED_UNIT(#90003) )")
        more = f"""#90001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#90002);
#90002 = {MM};
#90003 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
"""
        end = text.rindex("ENDSEC;")
        text = text[:end] + more + text[end:]
    else:
        prefix = {"m": "$", "cm": ".CENTI.", "mm": ".MILLI."}[unit]
        text = text.replace(MM, MM.replace(".MILLI.", prefix))
    path.write_text(text)
    return path


def iges_unit(path, flag, name):
    """Change the unit of an IGES file in millimetres, numbers left as they are; return the path."""
    text = path.read_text()
    assert text.count(",1.,2,2HMM,1,") == 1
    path.write_text(text.replace(",1.,2,2HMM,1,", f",1.,{flag},{len(name)}H{name},1,".ljust(13)[:13]))
    return path


def painted(path, number, rgb):
    """Give one face of a STEP file, by its place in the file from 0, a colour, as CAD programs do; return the path."""
    text = path.read_text()
    face = re.findall(r"(#\d+) = ADVANCED_FACE\(", text)[number]
    context = re.search(r"(#\d+) = \( GEOMETRIC_REPRESENTATION_CONTEXT", text)[1]
    more = f"""#91001 = STYLED_ITEM('color',(#91002),{face});
#91002 = PRESENTATION_STYLE_ASSIGNMENT((#91003));
#91003 = SURFACE_STYLE_USAGE(.BOTH.,#91004);
#91004 = SURFACE_SIDE_STYLE('',(#91005));
#91005 = SURFACE_STYLE_FILL_AREA(#91006);
#91006 = FILL_AREA_STYLE('',(#91007));
#91007 = FILL_AREA_STYLE_COLOUR('',#91008);
#91008 = COLOUR_RGB('',{rgb[0]:.1f},{rgb[1]:.1f},{rgb[2]:.1f});
#91009 = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(#91001),{context});
"""
    end = text.rindex("ENDSEC;")
    path.write_text(text[:end] + more + text[end:])
    return path
