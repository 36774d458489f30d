from .beams.attachments import PointMass as PointMass
from .beams.attachments import RigidLink as RigidLink
from .beams.attachments import Spring as Spring
from .beams.beam_property import BeamProperty as BeamProperty
from .beams.body import beam_body as beam_body
from .beams.interfaces import NodeIndices as NodeIndices
from .beams.interfaces import line_interface as line_interface
from .beams.line_law import beam_line as beam_line
from .beams.line_mesh import LineMesh as LineMesh
from .beams.line_mesh import straight_line as straight_line
from .beams.links import link_rigidly as link_rigidly
from .beams.section_points import section_points as section_points
from .beams.sections import BoxSection as BoxSection
from .beams.sections import Circle as Circle
from .beams.sections import GeneralSection as GeneralSection
from .beams.sections import ISection as ISection
from .beams.sections import Rectangle as Rectangle
from .beams.sections import Tube as Tube
from .boundary import boundary_facets as boundary_facets
from .boundary import boundary_triangles as boundary_triangles
from .errors import BeamError as BeamError
from .errors import (
    FeModelsError as FeModelsError,
)
from .errors import (
    InterfaceError as InterfaceError,
)
from .errors import (
    LoadError as LoadError,
)
from .errors import (
    MaterialError as MaterialError,
)
from .errors import (
    MeshError as MeshError,
)
from .errors import SectionError as SectionError
from .errors import ShellError as ShellError
from .importers.read_mesh import read_line_mesh as read_line_mesh
from .importers.read_mesh import read_mesh as read_mesh
from .importers.read_mesh import read_shell_mesh as read_shell_mesh
from .importers.tables import read_tables as read_tables
from .interfaces import (
    check_overlap as check_overlap,
)
from .interfaces import (
    distributing_interface as distributing_interface,
)
from .interfaces import (
    nodes_interface as nodes_interface,
)
from .interfaces import (
    rigid_interface as rigid_interface,
)
from .loads import gravity_load as gravity_load
from .loads import interface_load as interface_load
from .loads import nodal_load as nodal_load
from .loads import pressure_load as pressure_load
from .loads import selection_load as selection_load
from .material import Material as Material
from .matrices import body_from_matrices as body_from_matrices
from .matrices import body_from_npz as body_from_npz
from .mesh import Mesh as Mesh
from .mesh_report import Finding as Finding
from .mesh_report import MeshReport as MeshReport
from .mesh_report import report_mesh as report_mesh
from .planar import planar as planar
from .selections import (
    Box as Box,
)
from .selections import (
    Cylinder as Cylinder,
)
from .selections import (
    FaceGroup as FaceGroup,
)
from .selections import (
    NearestNode as NearestNode,
)
from .selections import (
    NodeSet as NodeSet,
)
from .selections import (
    Plane as Plane,
)
from .shells.body import shell_body as shell_body
from .shells.interfaces import shell_interface as shell_interface
from .shells.normals import orient_normals as orient_normals
from .shells.shell_mesh import ShellMesh as ShellMesh
from .shells.shell_mesh import flat_plate as flat_plate
from .shells.shell_mesh import mapped_shell as mapped_shell
from .shells.shell_points import shell_points as shell_points
from .shells.shell_property import ShellProperty as ShellProperty
from .shells.shell_report import ShellReport as ShellReport
from .shells.shell_report import report_shell as report_shell
from .solid import solid_body as solid_body
from .split import Cut as Cut
from .split import Split as Split
from .split import split_mesh as split_mesh
from .unused_nodes import drop_unused_nodes as drop_unused_nodes
from .weld import weld as weld
