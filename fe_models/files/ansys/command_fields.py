"""The commands of ANSYS in a .cdb file, and which of their fields are read.

`COMMANDS` lists every command that is read, field by field, in the symbols of `fe_models.files.decks.field_table`.
`COLUMNS` lists the columns of an element in EBLOCK. `HARMLESS` lists commands without effect on the body. All other
commands are refused by name.
"""

from fe_models.files.decks.field_table import TableField, has_default, parse_fields
from fe_models.files.decks.ledger import Ledger

__all__ = ["COLUMNS", "COMMANDS", "HARMLESS", "check_columns", "check_command", "fields_of_command", "says_something"]

COMMANDS = {
    "NBLOCK": "NUMFIELD~ SOLKEY~ NDMAX~ NDSEL~", "EBLOCK": "NUM_NODES=19 SOLKEY~ NELMAX~ NELSEL~",
    "CMBLOCK": "NAME ENTITY NUMITEMS KOPT~",
    "ET": "ITYPE ENAME KOP1=0 KOP2=0 KOP3=0 KOP4=0 KOP5=0 KOP6=0 INOPR~",
    "KEYOP": "ITYPE KNUM VALUE", "KEYOPT": "ITYPE KNUM VALUE",
    "MP": "LAB MAT C0 C1=0 C2=0 C3=0 C4=0", "MPDATA": "REVISION~ NUMBER~ LAB MAT STLOC ...",
    "D": "NODE LAB VALUE~ VALUE2~ NEND! NINC~ LAB2! LAB3! LAB4! LAB5! LAB6!",
    "F": "NODE LAB VALUE VALUE2~ NEND! NINC~ MESHFLAG~",
    "SFE": "ELEM~ LKEY~ LAB KVAL~ ...",
    "LUMPM": "KEY",
    "SECTYPE": "SECID TYPE SUBTYPE~ NAME~ REFINEKEY~", "SECBLOCK": "N", "SECDATA": "...", "SECOFFSET": "LOCATION",
    "SECCONTROL": "...",
    "ALPHAD": "VALUE^", "BETAD": "VALUE^", "DMPRAT": "RATIO^", "DMPSTR": "COEFF^", "DMPSTRUCT": "COEFF^",
    "MDAMP": "STLOC~ V1^ V2^ V3^ V4^ V5^ V6^",
}  # fmt: skip
COLUMNS = "MAT TYPE REAL~ SECNUM ESYS DEATH=0 SOLID~ SHAPE~ COUNT EXCLUDE~ NUMBER"
#: commands without effect on the body: structure of the file, loads and controls of an analysis
HARMLESS = frozenset(
    "ACEL ACELL ANTYPE AUTOTS BF BFE BFBLOCK BFEBLOCK BFUNIF CGLOC CGOMEGA CGOMGA CLOCAL CLWRITE CM CMDELE CMGRP "
    "CMOMEGA CMSEL CNVTOL CRPLIM CS CSCIR CSDELE CSYS DCGOMG DELTIM DOF DOMEGA DSYS EPLOT EQSLV ERESX ERNORM ESEL "
    "ESYS ETCONTROL EXPASS EXTOPT FINI FINISH FREQ HARFRQ HROPT IC ICROTB INISTATE IRLF KBC KUSE LOCAL LSCLEAR "
    "LSWRITE LVSCALE MAT MODCONTROL MODOPT MPTEMP MPTRES MXPAND NCNV NEQIT NLGEOM NLHIST NROPT NSEL NSUBST NUMOFF "
    "OMEGA OUTPR OUTRES PRED PSTRES QRDOPT RESCONTROL REAL SAVE SECNUM SHPP SOLCONTROL SOLUTION SOLVE SSTIF SYNCHRO "
    "TIME TIMINT TINTP TOFFST TREF TRNOPT TUNIF TYPE USRCAL VSWEEP".split()
)


def fields_of_command(name: str) -> tuple[TableField, ...]:
    """Return the fields of a command listed in `COMMANDS`."""
    return parse_fields(COMMANDS[name].split())


def check_command(name: str, words: list[str], ledger: Ledger, line: int) -> None:
    """Add fields of a command that are not converted to the ledger; `words[0]` is its name."""
    fields = fields_of_command(name)
    for item in fields:
        word = words[item.number] if item.number < len(words) else ""
        word = "0" if word.upper() == "OFF" else word
        if not word or (item.use == "default" and has_default(word, item.default)):
            continue
        if item.use == "default":
            ledger.refuse(name, f"{item.name} = {word}: this field is not taken over", line=line)
        elif item.use == "left out" and says_something(word):
            why = f"damping ({item.name} = {word}) is left out: give the job a table [damping]"
            ledger.note(name, why, line=line)
    has_rest = COMMANDS[name].endswith("...")
    for number, word in enumerate(words[len(fields) + 1 :], start=len(fields) + 1):
        if word and not has_rest and says_something(word):
            ledger.refuse(name, f"field {number} = {word}: this command has {len(fields)} fields here", line=line)


def check_columns(row: list[int], ledger: Ledger) -> None:
    """Add an element of EBLOCK to the ledger if it uses an unsupported column."""
    for item in parse_fields(COLUMNS.split()):
        value = row[item.number - 1]
        if item.use == "default" and not has_default(str(value), item.default):
            ledger.refuse("EBLOCK", f"{item.name} = {value} of an element: this column is not taken over")


def says_something(word: str) -> bool:
    """Return whether a field is a text or a nonzero number."""
    try:
        return float(word) != 0
    except ValueError:
        return True
