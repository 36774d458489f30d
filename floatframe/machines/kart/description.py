"""Dimensions of the kart, and the nodes and tubes of its chassis."""

from dataclasses import dataclass

__all__ = ["Kart", "chassis_tables"]


@dataclass(frozen=True)
class Kart:
    """Dimensions of the kart [m], as in kart.toml. x forward from the rear axle, y left, z up."""

    wheelbase: float = 1.05
    front_half_track: float = 0.53
    rear_half_track: float = 0.55
    front_height: float = 0.125  #: height of the front wheel centres above the ground
    rear_height: float = 0.137
    rail_height: float = 0.06  #: height of the frame tubes
    kingpin_y: float = 0.42


def chassis_nodes(kart: Kart) -> dict[str, tuple[float, float, float]]:
    """Return the nodes of the frame by name."""
    h, L = kart.rail_height, kart.wheelbase
    nodes: dict[str, tuple[float, float, float]] = {}
    for side, s in (("left", 1.0), ("right", -1.0)):
        rail = [(-0.10, 0.31), (0.0, 0.32), (0.15, 0.33), (0.35, 0.33), (0.55, 0.31), (0.75, 0.28), (0.95, 0.26)]
        rail += [(L, 0.255), (1.25, 0.24)]
        for k, (x, y) in enumerate(rail):
            nodes[f"rail_{side}_{k}"] = (x, s * y, h)
        nodes[f"bracket_{side}"] = (0.0, s * 0.32, 0.115)
        nodes[f"bearing_{side}"] = (0.0, s * 0.32, kart.rear_height)
        nodes[f"rear_{side}"] = (0.0, s * (kart.rear_half_track - 0.06), kart.rear_height)
        nodes[f"kingpin_{side}"] = (L, s * kart.kingpin_y, kart.front_height)
        nodes[f"bar_{side}"] = (0.95, s * 0.12, h)
    nodes |= {"axle": (0.0, 0.0, kart.rear_height), "column_low": (0.95, 0.0, h), "column_top": (0.72, 0.0, 0.36)}
    return nodes


def chassis_lines() -> list[tuple[str, str, str]]:
    """Return the tubes of the frame, each with two nodes and the section."""
    lines = []
    for side in ("left", "right"):
        lines += [(f"rail_{side}_{k}", f"rail_{side}_{k + 1}", "TUBE") for k in range(8)]
        lines += [(f"rail_{side}_1", f"bracket_{side}", "BRACKET"), (f"rail_{side}_7", f"kingpin_{side}", "TUBE")]
        lines += [(f"rail_{side}_6", f"bar_{side}", "TUBE"), (f"bar_{side}", "column_low", "TUBE")]
        lines += [(f"bar_{side}", "column_top", "THIN")]
        lines += [("axle", f"bearing_{side}", "AXLE"), (f"bearing_{side}", f"rear_{side}", "AXLE")]
    lines += [(f"rail_left_{k}", f"rail_right_{k}", "TUBE") for k in (0, 3, 8)]
    return lines


def chassis_tables(kart: Kart, *, has_axle: bool = True) -> dict[str, str]:
    """Return the tables of nodes and lines of `chassis.toml` by file name, with or without the rear axle."""
    of_axle = ("axle", "bearing_left", "bearing_right", "rear_left", "rear_right")
    nodes = {name: place for name, place in chassis_nodes(kart).items() if has_axle or name not in of_axle}
    number = {name: k + 1 for k, name in enumerate(nodes)}
    rows = [f"{number[n]},{x:g},{y:g},{z:g},{n}" for n, (x, y, z) in nodes.items()]
    lines = [
        f"{number[a]},{number[b]},{section},{4 if section == 'TUBE' else 2}"
        for a, b, section in chassis_lines()
        if a in nodes and b in nodes
    ]
    return {
        "chassis_nodes.csv": "node, x, y, z, sets\n" + "\n".join(rows) + "\n",
        "chassis_lines.csv": "node1, node2, group, elements\n" + "\n".join(lines) + "\n",
    }
