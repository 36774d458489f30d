from fe_models.foundation.documents.table import Table as Table
from fe_models.foundation.documents.table import read_table as read_table

from .cad.cad_faces import CadFace as CadFace
from .cad.cad_mesh import MeshSize as MeshSize
from .cad.cad_mesh import mesh_cad as mesh_cad
from .cad.cad_model import CadPart as CadPart
from .cad.cad_model import read_cad as read_cad
from .matrices.body import body_from_foreign as body_from_foreign
from .matrices.foreign_matrices import ForeignMatrices as ForeignMatrices
from .matrices.given import body_from_matrices as body_from_matrices
from .matrices.given import body_from_npz as body_from_npz
from .matrices.model import GivenArrays as GivenArrays
from .matrices.model import GivenMatrices as GivenMatrices
from .read_matrices import read_matrices as read_matrices
from .read_mesh import read_geometry as read_geometry
from .skfem_body import body_from_skfem as body_from_skfem
from .tables import read_tables as read_tables
