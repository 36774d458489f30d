"""The cards of a whole deck of Nastran: which fields are read, and which cards do not affect the body.

`CARDS` lists every card that is read, field by field in the order of the Quick Reference Guide, in the symbols of
`fe_models.files.decks.field_table`.

`HARMLESS` lists the cards that belong to an analysis: loads, modes, aerodynamics, optimisation, output. A card in
neither list is refused by name, because it may have mass or stiffness.
"""

from fe_models.files.decks.field_table import TableField, has_default, parse_fields
from fe_models.files.nastran.bulk_data.cards import real_of
from fe_models.files.nastran.deck.model import NastranModel

__all__ = ["CARDS", "check_cards", "fields_of"]

_SHELL_3 = "EID PID G1 G2 G3 THETA ZOFFS - - TFLAG=0 T1 T2 T3"
_SHELL_4 = "EID PID G1 G2 G3 G4 THETA ZOFFS - TFLAG=0 T1 T2 T3 T4"
_BEAM = "EID PID GA GB X1 X2 X3 OFFT PA PB W1A W2A W3A W1B W2B W3B"

CARDS: dict[str, str] = {
    "GRID": "ID CP X1 X2 X3 CD PS SEID~",
    "GRDSET": "- CP - - - CD PS SEID~",
    "CORD1C": "...", "CORD1R": "...", "CORD1S": "...", "CORD2C": "...", "CORD2R": "...", "CORD2S": "...",
    "PARAM": "N V1 V2",
    "MAT1": "MID E G NU RHO A~ TREF~ GE^ ST~ SC~ SS~ MCSID~",
    "MAT2": "MID G11 G12 G13 G22 G23 G33 RHO A1~ A2~ A3~ TREF~ GE^ ST~ SC~ SS~ MCSID~",
    "MAT8": "MID E1 E2 NU12 G12 G1Z G2Z RHO A1~ A2~ TREF~ XT~ XC~ YT~ YC~ S~ GE^ F12~ STRN~",
    "MATHP": "MID A10 A01 D1 RHO AV~ TREF~ GE^ ...",
    "PSOLID": "PID MID CORDM~ IN~ STRESS~ ISOP~ FCTN=SMECH",
    "PLSOLID": "PID MID STR~",
    "PSHELL": "PID MID1 T MID2 12I/T**3 MID3 TS/T NSM Z1~ Z2~ MID4",
    "PLPLANE": "PID MID CID STR~ T",
    "PCOMP": "PID Z0 NSM SB~ FT~ TREF~ GE^ LAM MID T THETA SOUT~ ...",
    "PCOMPG": "PID Z0 NSM SB~ FT~ TREF~ GE^ LAM GPLYID~ MID T THETA SOUT~ - - - ...",
    "PBAR": "PID MID A I1 I2 J NSM - C1~ C2~ D1~ D2~ E1~ E2~ F1~ F2~ K1 K2 I12",
    "PBARL": "PID MID GROUP=MSCBML0 TYPE - - - - ...",
    "PBEAM": "PID MID A I1 I2 I12 J NSM ...",
    "PBEAML": "PID MID GROUP=MSCBML0 TYPE - - - - ...",
    "PROD": "PID MID A J C~ NSM",
    "PTUBE": "PID MID OD T NSM OD2",
    "CTETRA": "...", "CHEXA": "...", "CPENTA": "...", "CPYRAM": "...", "CPYRA": "...",
    "CTRIA3": _SHELL_3, "CTRIAR": _SHELL_3, "CQUAD4": _SHELL_4, "CQUADR": _SHELL_4,
    "CTRIA6": "EID PID G1 G2 G3 G4 G5 G6 THETA ZOFFS T1 T2 T3 TFLAG=0",
    "CQUAD8": "EID PID G1 G2 G3 G4 G5 G6 G7 G8 T1 T2 T3 T4 THETA ZOFFS TFLAG=0",
    "CBAR": _BEAM, "CBEAM": f"{_BEAM} SA=0 SB=0",
    "BAROR": "- PID - - X1 X2 X3 OFFT", "BEAMOR": "- PID - - X1 X2 X3 OFFT",
    "CROD": "EID PID G1 G2", "CTUBE": "EID PID G1 G2", "CONROD": "EID G1 G2 MID A J C~ NSM",
    "CONM1": (
        "EID G CID M11 M21 M22 M31 M32 M33 M41 M42 M43 M44 M51 M52 M53 M54 M55 M61 M62 M63 M64 M65 M66"
    ),
    "CONM2": "EID G CID M X1 X2 X3 - I11 I21 I22 I31 I32 I33",
    "CBUSH": "EID PID GA GB GO/X1 X2 X3 CID S OCID=-1 S1! S2! S3!",
    "PBUSH": "PID ...",
    "CBUSH1D": "EID PID GA GB CID", "PBUSH1D": "PID K C M - SA~ SE~ ...^",
    "CGAP": "EID PID GA GB GO/X1~ X2~ X3~ CID", "PGAP": "PID U0 F0~ KA KB KT MU1 MU2~ TMAX~ MAR~ TRMIN~",
    "CWELD": "EWID PWID GS TYPE GA GB SPTYP MCID~ ...", "PWELD": "PID MID D - - MSET~ - TYPE LDMIN LDMAX",
    "CBEND": "EID PID GA GB X1 X2 X3 GEOM",
    "PBEND": "PID MID A/FSI I1/RM I2/T J/P RB THETAB C1~ C2~ D1~ D2~ E1~ E2~ F1~ F2~ K1 K2 NSM RC ZC DELTAN",
    "CSHEAR": "EID PID G1 G2 G3 G4", "PSHEAR": "PID MID T NSM F1 F2",
    "CELAS1": "EID PID G1 C1 G2 C2", "CELAS2": "EID K G1 C1 G2 C2 GE^ S~",
    "PELAS": "PID1 K1 GE1^ S1~ PID2 K2 GE2^ S2~",
    "CDAMP1": "EID PID G1 C1 G2 C2", "CDAMP2": "EID B G1 C1 G2 C2",
    "PDAMP": "PID1 B1 PID2 B2 PID3 B3 PID4 B4",
    "CMASS1": "EID PID G1 C1 G2 C2", "CMASS2": "EID M G1 C1 G2 C2",
    "PMASS": "PID1 M1 PID2 M2 PID3 M3 PID4 M4",
    "CELAS3": "EID PID~ S1 S2", "CELAS4": "EID K~ S1 S2", "CDAMP3": "EID PID~ S1 S2", "CDAMP4": "EID B~ S1 S2",
    "CMASS3": "EID PID~ S1 S2", "CMASS4": "EID M~ S1 S2",
    "CVISC": "EID PID G1 G2", "PVISC": "PID1 CE1 CR1 - PID2 CE2 CR2",
    "RBE2": "EID GN CM ...", "RBE3": "EID - REFGRID REFC ...", "RBAR": "EID GA GB CNA CNB CMA CMB ALPHA~ TREF~",
    "RROD": "EID GA GB CMA CMB ALPHA~ TREF~",
    "MPC": "...", "MPCADD": "...", "SPC": "SID G1 C1 D1~ G2 C2 D2~", "SPC1": "...", "SPCADD": "...",
    "BSET": "...", "BSET1": "...", "BNDFIX": "...", "BNDFIX1": "...", "ASET": "...", "ASET1": "...",
    "FORCE": "SID G CID F N1 N2 N3", "MOMENT": "SID G CID M N1 N2 N3", "GRAV": "SID CID A N1 N2 N3 MB~",
    "PLOAD": "SID~ P~ G1~ G2~ G3~ G4~", "PLOAD2": "SID~ P~ EID1~ EID2~ EID3~ EID4~ EID5~ EID6~",
    "SEBULK": "...", "SECONCT": "...", "SELOC": "...", "SEMPLN": "...", "SEEXCLD": "...",
    "PLOAD4": "SID EID P1 P2 P3 P4 G1 G34 CID N1 N2 N3 SORL LDIR~",
}  # fmt: skip

HARMLESS = frozenset(
    # modes, steps, solution control
    "EIGB EIGC EIGP EIGR EIGRL ENDDATA FREQ FREQ1 FREQ2 FREQ3 FREQ4 FREQ5 NLPARM NLPCI NLSTEP TSTEP TSTEP1 TSTEPNL "
    "TIC SUPORT SUPORT1 SUPAX SUPORT2 MODTRAK DOPTPRM DYNRED ITER "
    # loads, and functions and tables of loads
    "ACSRCE ACCEL ACCEL1 DAREA DELAY DPHASE DLOAD FORCE1 FORCE2 LOAD LOADCYH LOADCYN LSEQ MOMENT1 MOMENT2 PLOAD1 "
    "PLOADX1 PLOTEL PLOTEL3 PLOTEL4 RANDPS RANDT1 RFORCE RLOAD1 RLOAD2 SLOAD SPCD SPCR TLOAD1 TLOAD2 TABLED1 TABLED2 "
    "TABLED3 TABLED4 TABRND1 TABRNDG TEMP TEMPB3 TEMPBC TEMPD TEMPF TEMPP1 TEMPP2 TEMPP3 TEMPRB DEFORM DTEMP "
    "DEFUSET USET USET1 CLOAD QHBDY QVECT QVOL QBDY1 QBDY2 QBDY3 "
    # tables that are only referred to by other cards, and modal damping (named in the ledger)
    "TABLES1 TABLEST TABLEH1 TABLEHT TABLEM1 TABLEM2 TABLEM3 TABLEM4 TABDMP1 TABLE3D "
    # sets of dofs of an analysis
    "CSET CSET1 OMIT OMIT1 QSET QSET1 SESET SEQSET SEQSET1 SPOINT EPOINT SEELT SECSET SEBSET "
    "BNDFRE BNDFRE1 BNDFREE BNDGRID CYJOIN CYSYM CYAX CYSUP SEBSET1 SECSET1 SETREE SENQSET SELOAD RVDOF RVDOF1 "
    # sets, output, drawing, comments
    "BOUTPUT CBARAO DTI FEEDGE FEFACE GMCURV GMSURF OUTPUT OUTRCV PSET SET1 SET2 SET3 SNORM VIEW VIEW3D VIEWEX "
    "ABSNMVS ABSTRCT GROUP POINT MFLUID "  # MFLUID is refused where the case control asks for it
    # aerodynamics
    "AECOMP AECOMPL AEDW AEFACT AEFORCE AELINK AELIST AELISTC AEPARM AEPRESS AERO AEROS AESCALE AESTAT AESURF AESURFS "
    "CAERO1 CAERO2 CAERO3 CAERO4 CAERO5 CSSCHD DIVERG FLFACT FLUTTER GUST MKAERO1 MKAERO2 MONCNCM MONDSP1 MONGRP "
    "MONPNT1 MONPNT2 MONPNT3 PAERO1 PAERO2 PAERO3 PAERO4 PAERO5 SPLINE1 SPLINE2 SPLINE3 SPLINE4 SPLINE5 SPLINE6 "
    "SPLINE7 TRIM TRIM2 UXVEC "
    # optimisation
    "DCONADD DCONSTR DDVAL DESVAR DEQATN DLINK DRESP1 DRESP2 DRESP3 DSCREEN DTABLE DVCREL1 DVCREL2 DVGRID DVMREL1 "
    "DVMREL2 DVPREL1 DVPREL2 DVPRES DVSET DVSHAP BNDRY BEADVAR TOPVAR TOMVAR DVBSHAP DVPSURF DVTREL1 DMNCON DMRLAW "
    # rotors and cyclic results, acoustics and heat of an analysis
    "CAMPBLL CHACAB ROTORD ROTORG ROTORSE UNBALNC RSPINR RSPINT RGYRO CREEP CONV CONVM PCONV PCONVM RADBC RADM RADMT "
    "RADSET PHBDY CHBDYE CHBDYG CHBDYP MAT4 MAT5 "
    # contact regions, which do not connect anything themselves (BGSET, BCTABLE, BCTSET do)
    "BSURF BSURFS BSURF0 BCPROP BCPROPS BLSEG BCPARA BCTPARM BGPARM BCRPARA BCONP BFRIC BCBODY BCBODY1".split()
)  # fmt: skip
#: properties and materials that no supported element refers to; the elements that do are refused by name
UNNAMED = frozenset(
    "MAT3 MAT9 MAT10 MAT11 MATF MATG MATHE MATORT MATEP PACABS PACBAR PAABSF PAXISYM PBCOMP PBEAM3 "
    "PBUSH2D PCOHE PCONEAX PFAST PSEAM PRAC2D PRAC3D PSHLN1 PSHLN2 "
    "PSLDN1".split()
)
#: cards that change another card in nonlinear analyses, or with frequency; that card is used unchanged
NOMINAL = {
    "MATS1": "nonlinear material: the elastic constants of its MAT1 are taken",
    "PELAST": "the constant stiffness of its PELAS is taken",
    "PBUSHT": "the constants of its PBUSH are taken",
    "PDAMPT": "the constant damping of its PDAMP is taken",
    "MDLPRM": "parameters of the program are not looked at, except SHEARP",
}


def fields_of(name: str) -> tuple[TableField, ...]:
    """Return the fields of a card listed in `CARDS`, without the repeating fields at its end."""
    return parse_fields(CARDS[name].split())


def check_cards(model: NastranModel) -> None:
    """Add all cards and fields that are not converted to the ledger.

    (1) a card that is neither read nor harmless is refused by name
    (2) an unsupported field of a card that is read is refused if its value is not the default
    (3) structural damping is left out and named
    """
    for name, cards in model.cards.items():
        if name not in CARDS:
            if name in HARMLESS:
                model.ledger.note(name, "belongs to the analysis, not to the body", count=len(cards))
            elif name in UNNAMED:
                model.ledger.note(name, "no element that is read names it", count=len(cards))
            elif name in NOMINAL:
                model.ledger.note(name, NOMINAL[name], count=len(cards))
            elif name.startswith("MATT") and model.has_temperature is False:
                model.ledger.note(
                    name, "no temperature of materials is selected: constants are taken", count=len(cards)
                )
            else:
                model.ledger.refuse(name, "this card is not known here", count=len(cards))
            continue
        watched = [item for item in fields_of(name) if item.use in ("default", "left out")]
        for card in cards:
            for item in watched:
                word = card.text(item.number)
                if not word or has_default(word, item.default):
                    continue
                if item.use == "default":
                    model.ledger.refuse(name, f"{item.name} = {word}: this field is not taken over")
                elif real_of(word) != 0.0:
                    model.ledger.note(
                        name, f"structural damping {item.name} = {word} is left out: give the job a table [damping]"
                    )
