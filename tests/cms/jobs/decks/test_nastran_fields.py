"""Every field of every card of Nastran that is read: it changes the body, or another value than its default is refused.

The table is `fe_models.files.nastran.deck.card_fields.CARDS`; a field that is read without a line here fails.
"""

import numpy as np
import pytest

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.nastran.deck.card_fields import CARDS, HARMLESS, fields_of
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages

GRIDS = "\n".join(
    f"GRID,{k},,{float(x)},{float(y)},{float(z)}"
    for k, (x, y, z) in enumerate(
        [(0, 0, 0), (2, 0, 0.1), (2.1, 1, 0), (0, 1.2, 0), (0.1, 0, 1), (2, 0.1, 1), (2, 1, 1.1), (0, 1, 1)], start=1
    )
)
COMMON = """CORD2R,7,,0.,0.,0.,.3,.2,1.
,1.,.1,.4
MAT1,1,2.+11,,.3,7800.
MAT1,2,1.+11,,.3,2700.
MAT8,3,1.4+11,1.+10,.3,5.+9,4.+9,3.+9,1600.
MAT2,4,1.+9,,,1.+9,,3.+8
PARAM,COUPMASS,1
"""
BAR = "CBAR,1,1,1,2,.1,.2,1.\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6,.5\n,,,,,,,,\n,.8,.9"
BEAM = "CBEAM,1,1,1,2,.1,.2,1.\nPBEAM,1,1,2.-3,3.-6,1.-6,,2.-6,.5"
SHELL_3, SHELL_4 = "CTRIA3,1,1,1,2,3,,.02\nPSHELL,1,1,.05,1,,1,,2.", "CQUAD4,1,1,1,2,3,4,,.02\nPSHELL,1,1,.05,1,,1,,2."
LAID = "CQUAD4,1,1,1,2,3,4,20.\nPCOMP,1,-.03,1.,,,,,\n,3,.02,30.,,1,.03,"
FRAME = "CBAR,1,1,1,2,.1,.2,1.\nCBAR,2,1,3,4,.1,.2,1.\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6\nRBE2,99,2,123456,3\n"
WELD = "CTRIA3,1,1,1,2,3\nCTRIA3,2,1,5,6,7\nPSHELL,1,1,.05,1,,1\nGRID,33,,1.4,.4,.1\nGRID,34,,1.4,.4,.9\n"
WELD += "GRID,35,,1.3,.4,.5\nCWELD,9,9,35,ELEMID,,,,7\n,1,2\nPWELD,9,1,.3"
PANEL = FRAME + "CSHEAR,7,9,1,2,3,4\nPSHEAR,9,1,.01,1.,.5,1.2"
ARC = "CBEND,1,9,1,2,.1,.2,1.,3\nPBEND,9,1,2.-3,3.-6,1.-6,2.-6,1.5\nCONM2,90,1,,3."
TWO = "CBAR,1,1,1,2,.1,.2,1.\nCBAR,2,1,9,4,.1,.2,1.\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6\n"
TWO += "GRID,9,,2.,0.,.1\nGRID,10,,2.,0.,.1\n"

#: card -> a deck with it, and for each field that is read another value; None: it names or numbers the card itself
READ: dict[str, tuple[str, dict[str, str | None]]] = {
    "GRID": (
        SHELL_3.replace("1,2,3,", "1,2,30,") + "\nGRID,30,,2.,1.,.1\nSPC1,1,12,30\nFORCE,5,30,0,1.,1.,0.,0.",
        {"ID": None, "CP": "7", "X1": "2.2", "X2": "1.1", "X3": ".2", "CD": "7", "PS": "456"},
    ),
    "GRDSET": (SHELL_3 + "\nGRDSET,,,,,,,\nSPC1,1,12,1", {"CP": "7", "CD": "7", "PS": "456"}),
    "MAT1": (
        SHELL_3.replace("PSHELL,1,1,.05,1,,1", "PSHELL,1,9,.05,9,,9") + "\nMAT1,9,2.+11,,.3,7800.",
        {"MID": None, "E": "1.+11", "G": "7.+10", "NU": ".2", "RHO": "7000."},
    ),
    "MAT8": (
        SHELL_4.replace("PSHELL,1,1,.05,1,,1", "PSHELL,1,9,.05,9,,9")
        + "\nMAT8,9,1.4+11,1.+10,.3,5.+9,4.+9,3.+9,1600.",
        {"MID": None, "E1": "1.+11", "E2": "2.+10", "NU12": ".2", "G12": "6.+9", "G1Z": "1.+9", "G2Z": "1.+9",
         "RHO": "1."},
    ),
    "MAT2": (
        SHELL_4.replace("PSHELL,1,1,.05,1,,1", "PSHELL,1,9,.05,9,,1")
        + "\nMAT2,9,2.+11,5.+10,1.+10,1.5+11,2.+10,7.+10,7800.",
        {"MID": None, "G11": "1.+11", "G12": "4.+10", "G13": "2.+10", "G22": "1.+11", "G23": "1.+10", "G33": "6.+10",
         "RHO": "7000."},
    ),
    "MATHP": (
        "CHEXA,1,9,1,2,3,4,5,6\n,7,8\nPLSOLID,9,9\nMATHP,9,1.+6,2.+5,5.+7,1000.",
        {"MID": None, "A10": "2.+6", "A01": "3.+5", "D1": "6.+7", "RHO": "900."},
    ),
    "PLSOLID": ("CHEXA,1,9,1,2,3,4,5,6\n,7,8\nPLSOLID,9,1", {"PID": None, "MID": "2"}),
    "PSOLID": ("CHEXA,1,9,1,2,3,4,5,6\n,7,8\nPSOLID,9,1", {"PID": None, "MID": "2"}),
    "PSHELL": (
        SHELL_4,
        {"PID": None, "MID1": None, "T": ".06", "MID2": "2", "12I/T**3": "1.5", "MID3": "2", "TS/T": ".5", "NSM": "3.",
         "MID4": "4"},
    ),
    "CBEND": (
        ARC, {"EID": None, "PID": None, "GA": "4", "GB": "3", "X1": ".5", "X2": ".9", "X3": ".1", "GEOM": "1"}
    ),
    "PBEND": (
        ARC,
        {"PID": None, "MID": "2", "A/FSI": "3.-3", "I1/RM": "4.-6", "I2/T": "2.-6", "J/P": "3.-6", "RB": "1.6",
         "THETAB": None, "K1": ".5", "K2": ".5", "NSM": "1.", "RC": ".1", "ZC": ".1", "DELTAN": ".1"},
    ),
    "CSHEAR": (
        PANEL, {"EID": None, "PID": None, "G1": "4", "G2": "4", "G3": "6", "G4": "7"}
    ),
    "PSHEAR": (PANEL, {"PID": None, "MID": "2", "T": ".02", "NSM": "2.", "F1": ".7", "F2": "1.5"}),
    "CWELD": (WELD, {"EWID": None, "PWID": None, "GS": "1", "TYPE": "ALIGN", "GA": "33", "GB": "34", "SPTYP": None}),
    "PWELD": (
        WELD, {"PID": None, "MID": "2", "D": ".25", "TYPE": "SPOT", "LDMIN": "4.", "LDMAX": ".5"}
    ),
    "PLPLANE": (
        "CTRIA3,1,9,1,3,4\nPLPLANE,9,1\nSPC1,1,345,1,3,4", {"PID": None, "MID": "2", "CID": "7", "T": ".1"}
    ),
    "PCOMP": (LAID, {"PID": None, "Z0": "0.", "NSM": "2.", "LAM": "SYM", "MID": "2", "T": ".04", "THETA": "45."}),
    "PCOMPG": (
        "CQUAD4,1,1,1,2,3,4,20.\nPCOMPG,1,-.03,1.,,,,,\n,1,3,.02,30.,,,,\n,2,1,.03,",
        {"PID": None, "Z0": "0.", "NSM": "2.", "LAM": "SYM", "MID": "2", "T": ".04", "THETA": "45."},
    ),
    "PBAR": (
        BAR,
        {"PID": None, "MID": "2", "A": "3.-3", "I1": "4.-6", "I2": "2.-6", "J": "3.-6", "NSM": "1.", "K1": ".4",
         "K2": ".4", "I12": "1.-6"},
    ),
    "PBARL": ("CBAR,1,1,1,2,.1,.2,1.\nPBARL,1,1,,BOX\n,.1,.2,.01,.02", {"PID": None, "MID": "2", "TYPE": "T"}),
    "PBEAM": (
        BEAM,
        {"PID": None, "MID": "2", "A": "3.-3", "I1": "4.-6", "I2": "2.-6", "I12": "1.-6", "J": "3.-6", "NSM": "1."},
    ),
    "PBEAML": ("CBEAM,1,1,1,2,.1,.2,1.\nPBEAML,1,1,,BOX\n,.1,.2,.01,.02", {"PID": None, "MID": "2", "TYPE": "H"}),
    "PROD": (
        "CROD,1,9,1,2\nCROD,2,9,2,3\nPROD,9,1,.1,.01,,1.",
        {"PID": None, "MID": "2", "A": ".2", "J": ".02", "NSM": "2."},
    ),
    "PTUBE": (
        "CTUBE,1,9,1,2\nPTUBE,9,1,.1,.01,1.",
        {"PID": None, "MID": "2", "OD": ".2", "T": ".02", "NSM": "2.", "OD2": ".05"},
    ),
    "CTRIA3": (
        SHELL_3.replace("PSHELL,1,1,.05,1,,1", "PSHELL,1,3,.05,3,,3"),
        {"EID": None, "PID": None, "G1": "4", "G2": "6", "G3": "4", "THETA": "30.", "ZOFFS": ".03", "T1": ".06",
         "T2": ".06", "T3": ".06"},
    ),
    "CQUAD4": (
        SHELL_4.replace("PSHELL,1,1,.05,1,,1", "PSHELL,1,3,.05,3,,3"),
        {"EID": None, "PID": None, "G1": "5", "G2": "6", "G3": "7", "G4": "8", "THETA": "30.", "ZOFFS": ".03",
         "T1": ".06", "T2": ".06", "T3": ".06", "T4": ".06"},
    ),
    "CBAR": (
        BAR,
        {"EID": None, "PID": None, "GA": "4", "GB": "3", "X1": ".5", "X2": ".9", "X3": ".1", "OFFT": None, "PA": "5",
         "PB": "5", "W1A": ".1", "W2A": ".1", "W3A": ".1", "W1B": ".1", "W2B": ".1", "W3B": ".1"},
    ),
    "BAROR": (
        "CBAR,1,,1,2\nBAROR,,1,,,.1,.2,1.\nPBAR,1,1,2.-3,3.-6,1.-6,2.-6\nPBAR,2,2,2.-3,3.-6,1.-6,2.-6",
        {"PID": "2", "X1": ".5", "X2": ".9", "X3": ".1", "OFFT": None},
    ),
    "CROD": ("CROD,1,9,1,2\nCROD,2,9,2,3\nPROD,9,1,.1,.01", {"EID": None, "PID": None, "G1": "4", "G2": "3"}),
    "CTUBE": ("CTUBE,1,9,1,2\nPTUBE,9,1,.1,.01", {"EID": None, "PID": None, "G1": "4", "G2": "3"}),
    "CONROD": (
        "CONROD,1,1,2,1,.1,.01,,1.",
        {"EID": None, "G1": "4", "G2": "3", "MID": "2", "A": ".2", "J": ".02", "NSM": "2."},
    ),
    "CONM2": (
        BAR + "\nCONM2,7,2,7,3.,.1,.2,.3,\n,1.,.1,2.,.2,.3,3.",
        {"EID": None, "G": "1", "CID": "0", "M": "4.", "X1": ".2", "X2": ".1", "X3": ".2", "I11": "1.1", "I21": ".2",
         "I22": "2.2", "I31": ".3", "I32": ".1", "I33": "3.3"},
    ),
    "CONM1": (
        BAR + "\nCONM1,7,2,7,3.,0.,3.,0.,0.\n,3.,0.,-.9,.6,1.39,.9,0.,-.3\n,-.06,2.3,-.6,.3,0.,-.09,-.18,3.15",
        {"EID": None, "G": "1", "CID": "0", **{f"M{i}{j}": "1.5" for i in range(1, 7) for j in range(1, i + 1)}},
    ),
    "CBUSH1D": (
        TWO + "CBUSH1D,7,9,2,9,7\nPBUSH1D,9,1.+5,20.", {"EID": None, "PID": None, "GA": "1", "GB": "10", "CID": "0"}
    ),
    "PBUSH1D": (
        TWO + "CBUSH1D,7,9,2,9,7\nPBUSH1D,9,1.+5,20.", {"PID": None, "K": "2.+5", "C": "30.", "M": "1."}
    ),
    "CGAP": (
        TWO + "CGAP,7,9,2,9,,,,7\nPGAP,9,0.,,1.+6,,2.+5,.1",
        {"EID": None, "PID": None, "GA": "1", "GB": "10", "CID": "0"},
    ),
    "PGAP": (
        TWO + "CGAP,7,9,2,9,,,,7\nPGAP,9,0.,,1.+6,,2.+5,.1",
        {"PID": None, "U0": "1.", "KA": "2.+6", "KB": None, "KT": "3.+5", "MU1": None},
    ),
    "RROD": (
        FRAME.replace("RBE2,99,2,123456,3", "RROD,99,2,3,1"),
        {"EID": None, "GA": "1", "GB": "4", "CMA": None, "CMB": "1"},
    ),
    "CBUSH": (
        TWO + "CBUSH,7,9,2,9,,,,7\nPBUSH,9,K,1.+5,2.+5,3.+5,4.+3,5.+3,6.+3",
        {"EID": None, "PID": None, "GA": "1", "GB": "10", "GO/X1": None, "X2": None, "X3": None, "CID": "0", "S": None},
    ),
    "PBUSH": (TWO + "CBUSH,7,9,2,9,,,,7\nPBUSH,9,K,1.+5,2.+5,3.+5,4.+3,5.+3,6.+3", {"PID": None}),
    "CELAS1": (
        TWO + "CELAS1,7,9,2,1,9,1\nPELAS,9,1.+6",
        {"EID": None, "PID": None, "G1": "10", "C1": "2", "G2": "10", "C2": "2"},
    ),
    "CELAS2": (TWO + "CELAS2,7,1.+6,2,1,9,1", {"EID": None, "K": "2.+6", "G1": "10", "C1": "2", "G2": "10", "C2": "2"}),
    "PELAS": (
        TWO + "CELAS1,7,9,2,1,9,1\nCELAS1,8,10,2,2,9,2\nPELAS,9,1.+6,,,10,2.+6",
        {"PID1": None, "K1": "2.+6", "PID2": "11", "K2": "3.+6"},
    ),
    "CDAMP1": (
        TWO + "CDAMP1,7,9,2,1,9,1\nPDAMP,9,1.+3",
        {"EID": None, "PID": None, "G1": "10", "C1": "2", "G2": "10", "C2": "2"},
    ),
    "CDAMP2": (TWO + "CDAMP2,7,1.+3,2,1,9,1", {"EID": None, "B": "2.+3", "G1": "10", "C1": "2", "G2": "10", "C2": "2"}),
    "PDAMP": (
        TWO + "".join(f"CDAMP1,{k},{k},2,{k - 10},9,{k - 10}\n" for k in range(11, 15))
        + "PDAMP,11,1.+3,12,2.+3,13,3.+3,14,4.+3",
        {"PID1": None, "B1": "5.", "PID2": "21", "B2": "6.", "PID3": "31", "B3": "7.", "PID4": "41", "B4": "8."},
    ),
    **{
        f"{kind}{k}": (BAR + f"\nSPOINT,901,902\n{kind}{k},7,9,901,902", {"EID": None, "S1": "2", "S2": "1"})
        for kind in ("CELAS", "CDAMP", "CMASS") for k in (3, 4)
    },
    "CMASS1": (
        BAR + "\nPMASS,9,2.,10,3.\nCMASS1,7,9,2,1\nCMASS1,8,9,2,2\nCMASS1,9,9,2,3",
        {"EID": None, "PID": "10", "G1": "1", "C1": "2", "G2": "1", "C2": None},
    ),
    "CMASS2": (
        BAR + "\nCMASS2,7,2.,2,1\nCMASS2,8,2.,2,2\nCMASS2,9,2.,2,3",
        {"EID": None, "M": "3.", "G1": "1", "C1": "2", "G2": "1", "C2": None},
    ),
    "PMASS": (
        BAR + "\nCMASS1,7,9,2,1\nCMASS1,8,10,2,2\nCMASS1,9,11,2,3\nPMASS,9,2.,10,2.,11,2.,12,5.",
        {"PID1": "90", "M1": "3.", "PID2": "91", "M2": "3.", "PID3": "92", "M3": "3.", "PID4": None, "M4": None},
    ),
    "CVISC": (TWO + "CVISC,7,9,1,4\nPVISC,9,1.+3,2.+3", {"EID": None, "PID": None, "G1": "2", "G2": "9"}),
    "PVISC": (
        TWO + "CVISC,7,9,1,4\nCVISC,8,10,2,4\nPVISC,9,1.+3,2.+3,,10,3.+3,4.+3",
        {"PID1": None, "CE1": "2.", "CR1": "3.", "PID2": "11", "CE2": "4.", "CR2": "5."},
    ),
    "RBE2": (FRAME, {"EID": None, "GN": "1", "CM": "123"}),
    "RBE3": (FRAME.replace("RBE2,99,2,123456,3", "RBE3,99,,3,123456,1.,123,1,2\n,4"), {"EID": None, "REFGRID": "5",
             "REFC": "123"}),
    "RBAR": (
        FRAME.replace("RBE2,99,2,123456,3", "RBAR,99,2,3,123456,,,123456"),
        {"EID": None, "GA": "1", "GB": "4", "CNA": "123", "CNB": "123456", "CMA": "1", "CMB": "123"},
    ),
    "SPC": (BAR + "\nSPC,3,1,123,0.,2,456", {"SID": None, "G1": "2", "C1": "12", "G2": "1", "C2": "4"}),
    "FORCE": (
        BAR + "\nFORCE,3,2,7,2.,1.,.5,.2",
        {"SID": None, "G": "1", "CID": "0", "F": "3.", "N1": "2.", "N2": "1.", "N3": "1."},
    ),
    "MOMENT": (
        BAR + "\nMOMENT,3,2,7,2.,1.,.5,.2",
        {"SID": None, "G": "1", "CID": "0", "M": "3.", "N1": "2.", "N2": "1.", "N3": "1."},
    ),
    "GRAV": (
        BAR + "\nGRAV,3,7,9.81,1.,.5,.2", {"SID": None, "CID": "0", "A": "3.", "N1": "2.", "N2": "1.", "N3": "1."}
    ),
    "PLOAD4": (
        "CHEXA,1,9,1,2,3,4,5,6\n,7,8\nPSOLID,9,1\nPLOAD4,3,1,5.,,,,1,3",
        {"SID": None, "EID": None, "P1": "6.", "P2": None, "P3": None, "P4": None, "G1": "5", "G34": "6", "CID": None,
         "N1": None, "N2": None, "N3": None, "SORL": None},
    ),
    "PLOAD": (SHELL_4 + "\nPLOAD,3,5.,1,2,3,4", {}),
    "PLOAD2": (SHELL_4 + "\nPLOAD2,3,5.,1", {}),
    "PARAM": (BAR + "\nPARAM,WTMASS,2.", {"N": None, "V1": "3.", "V2": None}),
}  # fmt: skip
#: cards with the fields of another one, on a deck of their own
LIKE = {
    "CTRIAR": "CTRIA3", "CQUADR": "CQUAD4", "CBEAM": "CBAR", "BEAMOR": "BAROR",
}  # fmt: skip
BY_OTHER_TESTS = {"CTRIA6", "CQUAD8"}  #: fields of CTRIA3 and CQUAD4 elsewhere; read in tests of shells


def deck_of(name):
    if name not in LIKE:
        return READ[name]
    deck, fields = READ[LIKE[name]]
    deck = deck.replace(LIKE[name], name)
    if name in ("CBEAM", "BEAMOR"):
        deck = deck.replace("CBAR", "CBEAM").replace("BAROR", "BEAMOR")
        deck = deck.replace(BAR.split("\n", 1)[1], BEAM.split("\n", 1)[1])
        deck = "\n".join(
            "PBEAM," + line[5:].replace("1.-6,2.-6", "1.-6,,2.-6") if line.startswith("PBAR,") else line
            for line in deck.split("\n")
        )
    return deck, fields


def model_of(tmp_path, text):
    """Return what a deck makes: M, K, D, interfaces and load cases as arrays; or the refusal."""
    path = tmp_path / "model.bdf"
    path.write_text(f"BEGIN BULK\n{COMMON}{GRIDS}\n{text}\nENDDATA\n")
    try:
        deck = parse_deck(path)
        path.with_suffix(".toml").write_text(job_text(deck, DeckOptions("m-kg-s", {}), path.name))
        body = uncoupled_body(read_job(path.with_suffix(".toml")), Stages())
    except ValueError as error:
        return str(error)
    D = np.zeros(body.K.shape) if body.D is None else body.D.toarray()
    return {
        "M": body.M.toarray(),
        "K": body.K.toarray(),
        "D": D,
        "nodes": body.nodes,
        "interfaces": [(i.name, i.kind, tuple(i.nodes), np.round(i.triad, 9).tolist()) for i in body.interfaces],
        "loads": np.array([case.f for case in body.load_cases]),
        "notes": deck.ledger.rows(),
    }


def differs(a, b):
    """Whether two models differ in mass, stiffness, damping, interfaces or loads, beyond rounding."""
    for key in ("M", "K", "D", "nodes", "loads"):
        if a[key].shape != b[key].shape:
            return True
        if np.abs(a[key] - b[key]).max(initial=0) > 1e-9 * np.abs(a[key]).max(initial=0):
            return True
    return a["interfaces"] != b["interfaces"]


def with_field(deck, name, number, value):
    """Return the deck with a field of the first card of a name changed; continuations have eight fields a line."""
    lines = deck.split("\n")
    at = next(k for k, line in enumerate(lines) if line.startswith(name + ","))
    row, place = divmod(number - 1, 8)
    for k in range(at + 1, at + 1 + row):
        if k >= len(lines) or not lines[k].startswith(","):
            lines.insert(k, ",")
    words = lines[at + row].split(",")
    words += [""] * (place + 2 - len(words))
    words[place + 1] = value
    lines[at + row] = ",".join(words)
    return "\n".join(lines)


def test_every_card_that_is_read_has_its_fields_here():
    listed = {name for name in CARDS if fields_of(name)} - BY_OTHER_TESTS
    assert listed == {*READ, *LIKE}
    for name in listed:
        read = {item.name for item in fields_of(name) if item.use == "read"}
        assert read == set(deck_of(name)[1]), name
    assert not set(CARDS) & HARMLESS


@pytest.mark.parametrize("name", sorted({*READ, *LIKE}))
def test_every_field_changes_the_body_or_is_refused(tmp_path, name):
    """Fields that name or number something, or choose between others, are None and tested elsewhere."""
    deck, values = deck_of(name)
    before = model_of(tmp_path, deck)
    assert isinstance(before, dict), before
    for item in fields_of(name):
        value = values.get(item.name)
        if item.use == "read" and value is not None:
            after = model_of(tmp_path, with_field(deck, name, item.number, value))
            assert isinstance(after, str) or differs(before, after), f"{name}: {item.name} = {value} changes nothing"
        elif item.use == "default":
            after = model_of(tmp_path, with_field(deck, name, item.number, "3"))
            assert isinstance(after, str), f"{name}: {item.name} is taken in silence"
            assert f"{name}: {item.name} = 3: this field is not taken over" in after
        elif item.use == "left out":
            after = model_of(tmp_path, with_field(deck, name, item.number, ".05"))
            assert any(f"{item.name} = .05 is left out" in row[2] for row in after["notes"]), item.name
        elif item.use == "harmless" and item.name not in ("CORDM", "MCSID", "MB", "LDIR"):
            after = model_of(tmp_path, with_field(deck, name, item.number, ".5"))
            assert isinstance(after, dict), f"{name}: {item.name}: {after}"
            assert not differs(before, after), f"{name}: {item.name} changes the body, but counts as harmless"


@pytest.mark.parametrize(
    "card", ["RSSCON,5,ELEM,1,2", "BGSET,1,1,2", "CFAST,1,2", "NEWCARD,1", "MATT1,1,5", "DMIG,K2,0,6,1"]
)
def test_a_card_that_is_neither_read_nor_harmless_is_refused_by_name(tmp_path, card):
    assert f"1 {card.split(',')[0]}: this card is not known here" in model_of(tmp_path, f"{BAR}\n{card}")


def test_harmless_cards_are_counted(tmp_path):
    model = model_of(tmp_path, f"{BAR}\nEIGRL,1,,,10\nEIGRL,2,,,10\nPFAST,5,1,.1")
    assert ("EIGRL", "2", "belongs to the analysis, not to the body") in model["notes"]
    assert ("PFAST", "1", "no element that is read names it") in model["notes"]
