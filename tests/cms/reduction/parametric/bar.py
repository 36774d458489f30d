"""A bar of variable thickness between two rigid ends, as a job."""

N = 8  #: elements
THICKNESSES = (0.012, 0.017, 0.024)  #: bending in both planes crosses at the width
#: tables of a job with a parameter `thickness`
BAR = """
[materials.steel]
young = 210e9
poisson = 0.3
density = 7850
[sections.bar]
shape = "rectangle"
width = 0.02
height = "{thickness}"
lines = "bar"
[interfaces.root]
kind = "rigid"
nodes = "root"
[interfaces.tip]
kind = "rigid"
nodes = "tip"
"""


def write_job(folder, nodes, text, sets=None):
    """Write a job of a bar through these nodes, with names of further node sets by node; return its path."""
    sets = {0: "root", N: "tip"} | (sets or {})
    rows = "".join(f"{k},{x},{y},{z},{sets.get(k, '')}\n" for k, (x, y, z) in enumerate(nodes))
    (folder / "nodes.csv").write_text("node,x,y,z,sets\n" + rows)
    (folder / "lines.csv").write_text("node1,node2,group\n" + "".join(f"{k},{k + 1},bar\n" for k in range(N)))
    (folder / "bar.toml").write_text(text)
    return folder / "bar.toml"
