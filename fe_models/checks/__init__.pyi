from .mesh_report import MeshReport as MeshReport
from .report import Finding as Finding
