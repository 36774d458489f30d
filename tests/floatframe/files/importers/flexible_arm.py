"""An arm of two links along z, the first a beam: rigid in the description, or a reduced body."""

import cms
import fe_models
from cms.reduction.basis.frames import NodalFrame

LENGTH, RHO_A, EI, RHO_I = 0.8, 2.0, 400.0, 2e-4
MASS, TIP_MASS, GRAVITY = RHO_A * LENGTH, 0.5, 9.81


def beam_body():
    line = fe_models.beams.BeamLine(
        LENGTH, rho_A=RHO_A, EA=1e7, EIy=EI, EIz=EI, GJ=200.0, rho_Iy=RHO_I, rho_Iz=RHO_I
    )  # fmt: skip
    stations = {"root": 0.0, "tip": LENGTH}
    return cms.reduction.beam_from_assumed_modes(
        line, name="beam", units=cms.unit_system("m-kg-s"), n_axial=1, n_bending=3, n_torsion=1, stations=stations,
        frame=NodalFrame("root"), n_shear=0,
    )  # fmt: skip


ACROSS = MASS * LENGTH**2 / 12 + RHO_I * LENGTH
ARM = f"""<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 {LENGTH / 2}"/><mass value="{MASS}"/>
    <inertia ixx="{ACROSS}" ixy="0" ixz="0" iyy="{ACROSS}" iyz="0" izz="{2 * RHO_I * LENGTH}"/></inertial></link>
  <link name="hand"><inertial><mass value="{TIP_MASS}"/>
    <inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.1" rpy="0 1.5707963267948966 0"/><axis xyz="0 1 0"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="hand"/>
    <origin xyz="0 0 {LENGTH}" rpy="0.3 0 0"/><axis xyz="0 1 0"/></joint>
</robot>
"""
