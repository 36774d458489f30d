"""The coefficients of the Magic Formula, and their defaults for files that lack them."""

__all__ = ["COEFFICIENTS", "LEFT_OUT", "NEEDED", "NEEDED_COMBINED", "ONLY_52", "ONLY_61", "SCALES"]

ZERO = (
    "PCX1 PDX1 PDX2 PDX3 PEX1 PEX2 PEX3 PEX4 PKX1 PKX2 PKX3 PHX1 PHX2 PVX1 PVX2 PPX1 PPX2 PPX3 PPX4 "
    "RBX1 RBX2 RBX3 RCX1 REX1 REX2 RHX1 PTX1 PTX2 PTX3 "
    "PCY1 PDY1 PDY2 PDY3 PEY1 PEY2 PEY3 PEY4 PEY5 PKY1 PKY2 PKY3 PKY4 PKY5 PKY6 PKY7 "
    "PHY1 PHY2 PHY3 PVY1 PVY2 PVY3 PVY4 PPY1 PPY2 PPY3 PPY4 PPY5 "
    "RBY1 RBY2 RBY3 RBY4 RCY1 REY1 REY2 RHY1 RHY2 RVY1 RVY2 RVY3 RVY4 RVY5 RVY6 PTY1 PTY2 "
    "QBZ1 QBZ2 QBZ3 QBZ4 QBZ5 QBZ9 QBZ10 QCZ1 QDZ1 QDZ2 QDZ3 QDZ4 QDZ6 QDZ7 QDZ8 QDZ9 QDZ10 QDZ11 "
    "QEZ1 QEZ2 QEZ3 QEZ4 QEZ5 QHZ1 QHZ2 QHZ3 QHZ4 PPZ1 PPZ2 SSZ1 SSZ2 SSZ3 SSZ4 "
    "QSX1 QSX2 QSX3 QSX4 QSX5 QSX6 QSX7 QSX8 QSX9 QSX10 QSX11 PPMX1 "
    "QSY1 QSY2 QSY3 QSY4 QSY5 QSY6 QSY7 QSY8 "
    "BREFF DREFF FREFF QRE0 QV1 QV2 QFZ1 QFZ2 PFZ1 PCFX1 PCFX2 PCFX3 PCFY1 PCFY2 PCFY3"
).split()
SCALES = (
    "LFZO LCX LMUX LEX LKX LHX LVX LGAX LCY LMUY LEY LKY LHY LVY LGAY LKYC LTR LRES LGAZ LKZC "
    "LXAL LYKA LVYKA LS LSGKP LSGAL LMX LVMX LMY"
).split()  #: scaling factors, 1 if missing in the file

#: default value of each coefficient, by name
COEFFICIENTS = {name: 0.0 for name in ZERO} | {name: 1.0 for name in SCALES} | {"PKY4": 2.0, "QRE0": 1.0, "QSY7": 1.0}

#: coefficients that exist in only one version of the formula
ONLY_61 = set(
    "PPX1 PPX2 PPX3 PPX4 PPY1 PPY2 PPY3 PPY4 PPY5 PPZ1 PPZ2 PPMX1 RBX3 RBY4 PEY5 PKY4 PKY5 PKY6 PKY7 QDZ10 QDZ11 "
    "QSX4 QSX5 QSX6 QSX7 QSX8 QSX9 QSX10 QSX11 QSY5 QSY6 QSY7 QSY8 QRE0 QV1 QV2 QFZ1 QFZ2 PFZ1 "
    "PCFX1 PCFX2 PCFX3 PCFY1 PCFY2 PCFY3 LKYC LKZC".split()
)
ONLY_52 = set("PHY3 PTX1 PTX2 PTX3 PTY1 PTY2 LGAX LGAY LGAZ".split())

#: required in every file, with load, radius and stiffness
NEEDED = ("PCX1", "PDX1", "PKX1", "PCY1", "PDY1", "PKY1", "PKY2")
NEEDED_COMBINED = ("RBX1", "RCX1", "RBY1", "RCY1")  #: required in files for combined slip

#: neglected effects, by coefficient; they are reported if a file has the coefficient
LEFT_OUT = {
    "LMUV": "friction that decreases with the sliding speed",
    "QFCX": "vertical deflection by longitudinal force",
    "QFCY": "vertical deflection by lateral force",
    "QFCX1": "vertical deflection by longitudinal force",
    "QFCY1": "vertical deflection by lateral force",
    "QCAM": "vertical stiffness by inclination",
    "QCAM1": "vertical stiffness by inclination",
    "QFZ3": "vertical stiffness by inclination",
    "BOTTOM_STIFF": "contact of the rim",
    "Q_RA1": "length of the contact patch",
    "QSX12": "overturning moment of version 6.2",
    "QSX13": "overturning moment of version 6.2",
    "QSX14": "overturning moment of version 6.2",
    **{f"PDXP{k}": "turn slip" for k in (1, 2, 3)},
    **{f"PDYP{k}": "turn slip" for k in (1, 2, 3, 4)},
    **{f"PKYP{k}": "turn slip" for k in (1,)},
    **{f"QDTP{k}": "turn slip" for k in (1,)},
}
